"""Newton's method: the order of its convergence, and its way when far from the minimum."""

import numpy as np
import pytest

from projdist.designs.newton import minimise_energy
from projdist.matrices import Energy, mdt

rng = np.random.default_rng(3)


@pytest.mark.parametrize("spread", [0.02, 0.3, 1.0])
def test_the_best_linear_map_is_the_mdt(spread: float) -> None:
    """Of the least mean of Dist_F(C A_i)^2: the inverse of the MDT, by quite another method; a handful of steps."""
    A = np.eye(2) + spread * rng.uniform(-0.5, 0.5, size=(50, 2, 2))
    w = rng.uniform(0.5, 1.0, size=50)
    found = minimise_energy(Energy(), A, w, np.eye(2))
    best = mdt(A, w)
    assert found.energy == pytest.approx(best.cost, rel=1e-12)
    T = np.linalg.inv(found.place)
    np.testing.assert_allclose(T @ T.T, best.T @ best.T.T, rtol=1e-7)
    assert found.steps <= 8


def test_quadratic_convergence_where_curvatures_are_negative() -> None:
    """From a thousandth away to rounding in three steps, where the energy is far from convex at points."""
    A = np.eye(2) + rng.uniform(-0.5, 0.5, size=(200, 2, 2))
    best = minimise_energy(Energy(), A, np.ones(200), np.eye(2))
    assert (Energy().expansion(best.place @ A).curvatures < 0.0).any()
    again = minimise_energy(Energy(), A, np.ones(200), best.place + 0.001 * rng.normal(size=(2, 2)))
    assert again.steps <= 3
    assert again.energy == pytest.approx(best.energy, rel=1e-12)


def test_one_point() -> None:
    """It is mapped without distortion, where no curvature is negative."""
    found = minimise_energy(Energy(), np.array([[[1.3, 0.2], [0.1, 0.8]]]), np.ones(1), np.eye(2))
    assert found.energy < 1e-20
