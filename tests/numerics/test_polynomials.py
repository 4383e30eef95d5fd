"""Graded polynomials, and fits by them: orthonormal, equal to powers, exact where the answer is known."""

import numpy as np
from refusals import refuses
from tables import each

from projdist.numerics import ComplexPolynomials, PlanePolynomials, fit_harmonic, least_largest, least_squares

rng = np.random.default_rng(7)
X, Y = rng.uniform(-1.0, 1.0, size=(2, 500))
Z, W = X + 1j * Y, rng.uniform(0.5, 1.0, size=500)
ROUNDING = 1e-12


def test_plane_polynomials() -> None:
    """Orthonormal at their points; gradients and powers are those of what they are; degrees are nested."""
    basis = PlanePolynomials.over(X, Y, W, 9)
    np.testing.assert_allclose(basis.values.T @ (basis.values * (W / W.sum())[:, None]), np.eye(55), atol=ROUNDING)
    there, step = rng.uniform(-1.0, 1.0, size=(2, 20)), 1e-5
    values, gradients = basis.at(*there)
    for axis in (0, 1):
        moved = [basis.at(*(there + sign * step * np.eye(2)[axis][:, None]))[0] for sign in (1, -1)]
        np.testing.assert_allclose(gradients[:, :, axis], (moved[0] - moved[1]) / (2 * step), atol=1e-5)
    c = rng.normal(size=(2, 55))
    found = [np.polynomial.polynomial.polyval2d(*there, powers) for powers in basis.powers(c)]
    np.testing.assert_allclose(found, c @ values.T, atol=1e-10)
    np.testing.assert_allclose(PlanePolynomials.over(X, Y, W, 4).values, basis.values[:, :15], atol=ROUNDING)


def test_complex_polynomials() -> None:
    """The same of one complex variable."""
    basis, c = ComplexPolynomials.over(Z, W, 9), rng.normal(size=(10, 2)) @ [1.0, 1j]
    products = basis.values.conj().T @ (basis.values * (W / W.sum())[:, None])
    np.testing.assert_allclose(products, np.eye(10), atol=ROUNDING)
    np.testing.assert_allclose(np.polynomial.polynomial.polyval(Z, basis.powers(c)), basis.at(Z) @ c, atol=1e-11)


def test_too_few_points() -> None:
    """Polynomials that vanish at all points are refused."""
    refuses("5 points do not tell polynomials of degree 3 apart", PlanePolynomials.over, X[:5], Y[:5], W[:5], 3)
    refuses("3 points do not tell polynomials of degree 3 apart", ComplexPolynomials.over, Z[:3], W[:3], 3)
    # One row with 1e22 beside others of 1: the solver of the linear programme takes no such number.
    columns = np.ones((50, 3))
    columns[0] = 1.0, 1e12, 1e22
    refuses("50 points do not tell 3 terms apart", least_largest, columns, np.linspace(-1.0, 1.0, 50))


@each("norm", [2.0, 8.0, np.inf])
def test_what_is_harmonic_is_cancelled(norm: float) -> None:
    """By its own polynomial, whatever the norm."""
    powers = np.array([0.3, 0.2 - 0.1j, 0.05j, 0.02])
    fit = fit_harmonic(Z, np.polynomial.polynomial.polyval(Z, powers).real, W, 3, norm)
    np.testing.assert_allclose(fit.powers, -powers, atol=1e-9)
    assert np.abs(fit.rest).max() < 1e-9


def test_the_largest_on_a_disc() -> None:
    """Of |z|^2 - c the best has c = 1/2 on the unit disc, as no harmonic polynomial helps (mean value theorem)."""
    z = np.outer(np.linspace(0.0, 1.0, 17), np.exp(2j * np.pi * np.arange(64) / 64)).ravel()
    fit = fit_harmonic(z, np.abs(z) ** 2, np.full(z.size, 1.0), 6, np.inf)
    np.testing.assert_allclose(fit.powers, [-0.5, *np.zeros(6)], atol=1e-9)
    np.testing.assert_allclose(np.abs(fit.rest).max(), 0.5, rtol=1e-9)
    # The constant that is best by the fourth power: the mean of the cubes of what is left vanishes.
    fit = fit_harmonic(Z, rng.normal(size=500), W, 0, 4.0)
    assert abs(np.sum(W * fit.rest**3) / np.sum(W)) < 1e-8


def test_least_largest() -> None:
    """Chebyshev: of x^3 less a parabola the best on [-1, 1] is T3 / 4, whatever the unit; of nothing it is nothing."""
    x = np.linspace(-1.0, 1.0, 2001)
    columns = np.stack([np.ones_like(x), x, x * x], axis=-1)
    for unit in (1.0, 1e-12):
        np.testing.assert_allclose(least_largest(columns, unit * x**3) / unit, [0.0, -0.75, 0.0], atol=1e-6)
    assert not least_largest(columns, 0.0 * x).any()


def test_least_squares() -> None:
    """Rosenbrock's valley ends at 1, 1."""

    def terms(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x, y = place
        return np.array([10 * (y - x * x), 1 - x]), np.array([[-20 * x, 10.0], [-1.0, 0.0]])

    np.testing.assert_allclose(least_squares(terms, np.array([-1.2, 1.0])), [1.0, 1.0], atol=1e-8)
