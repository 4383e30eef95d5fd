"""Minima: problems whose answers are known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import optimize
from tables import each

from projdist.numerics.minima import descend_lattice, lattice, least_range, minimise

BOX = np.array([-2.0, -2.0]), np.array([2.0, 2.0])


def rosenbrock(x: np.ndarray) -> np.ndarray:
    """Sum of squares with its minimum 0 at (1, 1), in a curved valley."""
    return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])


def madsen(x: np.ndarray) -> np.ndarray:
    """Charalambous and Bandler's first minimax problem: 1.9522245 at (1.1390376, 0.8995599)."""
    a = x[0] ** 2 + x[1] ** 4
    b = (2.0 - x[0]) ** 2 + (2.0 - x[1]) ** 2
    return np.array([[a, b, 2.0 * np.exp(x[1] - x[0])]])


def test_least_squares() -> None:
    """The valley's end, to 1e-6, and the same every time: nothing is random."""
    found, again = (minimise(rosenbrock, *BOX, worst=False) for _ in range(2))
    assert found.place.tolist() == again.place.tolist()
    assert_allclose(found.place, 1.0, atol=1e-6)
    assert found.evaluations < 1500


@pytest.mark.slow
def test_minimax() -> None:
    """A published problem with a kink at its minimum; groups are added: the range of x^2 - x t over t in [0, 1]."""
    found = minimise(madsen, *BOX, worst=True)
    assert_allclose(found.place, [1.1390376, 0.8995599], atol=1e-5)
    assert found.value == pytest.approx(1.9522245, abs=1e-6)
    # That is |x|: the maxima of a function and of its negative.
    both = np.outer([1.0, -1.0], np.linspace(0.0, 1.0, 11))
    found = minimise(lambda x: (x[0] - 0.3) * both, np.array([-1.0]), np.array([1.0]), worst=True)
    assert found.place[0] == pytest.approx(0.3, abs=1e-7)


def test_minimax_of_zero() -> None:
    """Terms that vanish everywhere promise no gain, and are at their minimum."""
    assert minimise(lambda x: np.zeros((2, 3)), *BOX, worst=True).value == 0.0


@pytest.mark.slow
def test_least_range() -> None:
    """That of scipy's simplex method, to the stated share; the weights prove it; Chebyshev's polynomial."""
    rng = np.random.default_rng(5)
    values, columns, up = rng.normal(size=9000), rng.normal(size=(9000, 6)), np.ones((9000, 1))
    rows = np.block([[columns, -up, 0.0 * up], [-columns, 0.0 * up, up]])
    truth = optimize.linprog([0.0] * 6 + [1.0, -1.0], rows, np.append(-values, values), bounds=(None, None)).fun
    x, weights = least_range(values, columns)
    assert truth * (1.0 - 1e-9) <= np.ptp(values + columns @ x) <= truth * 1.002
    assert truth * 0.998 <= weights @ values <= truth * 1.001
    assert_allclose([weights[weights > 0.0].sum(), weights.sum()], [1.0, 0.0], atol=1e-3)
    assert_allclose(weights @ columns, 0.0, atol=1e-3)
    t = np.linspace(-1.0, 1.0, 5001)
    x, _ = least_range(t**5, t[:, None] ** np.arange(1, 5))
    assert np.ptp(t**5 + t[:, None] ** np.arange(1, 5) @ x) == pytest.approx(2.0 / 2**4, rel=2e-3)
    assert np.abs(least_range(np.ones(50), np.eye(50)[:, :3])[0]).max() < 1e-6


def test_several_minima() -> None:
    """The deepest of many: the lattice finds its basin; with nothing to choose the value is that of the only place."""

    def square(x: np.ndarray) -> np.ndarray:
        return np.cos(9.0 * x) + 0.1 * (x - 1.0) ** 2

    found = minimise(lambda x: np.sqrt(2.0 + square(x[:1])), np.array([-2.0]), np.array([2.0]), worst=False)
    grid = np.linspace(-2.0, 2.0, 400001)
    assert found.place[0] == pytest.approx(grid[np.argmin(square(grid))], abs=1e-5)
    empty = np.empty(0)
    for start in ({}, {"start": empty}):
        assert minimise(lambda x: np.array([2.0]), empty, empty, worst=False, **start).value == 4.0


@each("dimensions", [1, 2, 3, 4])
def test_the_lattice_is_even(dimensions: int) -> None:
    """Every half of every axis holds half of the points, by a few."""
    points = lattice(dimensions, 200)
    assert ((points >= 0) & (points < 1)).all()
    assert_allclose((points < 0.5).mean(axis=0), 0.5, atol=0.05)


def test_whole_numbers() -> None:
    """Steps to the best neighbour end at the best whole numbers; tuples decide ties."""

    def value(x: np.ndarray) -> tuple[float, float]:
        return max(abs(x[0] - 7.4), 3.0), abs(x[0] - 6.0) + abs(x[1] + 2.0)

    place, found = descend_lattice(value, np.array([0.0, 0.0]))
    assert (place.tolist(), found) == ([6.0, -2.0], (3.0, 0.0))


@each("worst", [False, True])
@each("at, end, distance", [(-3.0, -1.0, 2.0), (5.0, 2.0, 3.0)])
def test_minima_at_either_end(at: float, end: float, distance: float, worst: bool) -> None:
    """Where the least value lies beyond the box its end is the place, to the last bit: a round number stays one."""
    box = np.array([-1.0]), np.array([2.0])
    found = minimise(lambda place: np.abs(place - at)[(None,) * worst], *box, worst=worst)
    assert found.place[0] == end
    assert found.value == pytest.approx(distance if worst else distance**2)
