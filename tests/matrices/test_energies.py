"""Energies of Jacobians against central differences, the Fisher distortion, and known limits of ellipticity."""

import numpy as np
from tables import each

from projdist.matrices import EXPONENT, Energy, fisher

rng = np.random.default_rng(5)
JACOBIANS = np.concatenate([np.eye(2) + 0.3 * rng.normal(size=(40, 2, 2)), [np.eye(2), 2.0 * np.eye(2)]])
JACOBIANS = JACOBIANS[np.linalg.det(JACOBIANS) > 0.2]
ENERGIES = [Energy(), Energy(0.3, 1.7), Energy(exponent=EXPONENT), Energy(2.0, 0.5, 0.4)]
STEP = 1e-4
FIRST, SECOND = 1e-6, 1e-6  # of central differences: the step's square times third and fourth derivatives of about 100


def test_values() -> None:
    """With weights 1 and 1 the square of the Fisher distortion, to rounding; what turns over costs infinitely much."""
    np.testing.assert_allclose(Energy().value(JACOBIANS), fisher(JACOBIANS) ** 2, rtol=1e-12, atol=1e-15)
    # So that a search stays among maps that do not fold.
    turned = np.array([np.diag([1.0, -1.0]), np.diag([1.0, 0.0]), np.full((2, 2), np.nan)])
    assert np.isinf(Energy().value(turned)).all()


@each("energy", ENERGIES)
def test_derivatives(energy: Energy) -> None:
    """Gradients and Hessians in random directions, also at similarities, where a = b."""
    found = energy.expansion(JACOBIANS)
    np.testing.assert_allclose(found.value, energy.value(JACOBIANS), rtol=1e-12, atol=1e-14)
    directions = found.directions.reshape(-1, 4, 4)  # orthonormal, so that curvatures are eigenvalues
    np.testing.assert_allclose(directions @ np.swapaxes(directions, 1, 2), np.eye(4)[None] + 0 * directions, atol=1e-12)
    for D in rng.normal(size=(5, 2, 2)):
        ahead, behind = energy.value(JACOBIANS + STEP * D), energy.value(JACOBIANS - STEP * D)
        slope = np.sum(found.gradient * D, axis=(1, 2))
        np.testing.assert_allclose(slope, (ahead - behind) / (2 * STEP), rtol=FIRST, atol=FIRST)
        bend = np.sum(found.curvatures * np.sum(found.directions * D, axis=(2, 3)) ** 2, axis=1)
        second = (ahead - 2 * found.value + behind) / STEP**2
        np.testing.assert_allclose(bend, second, rtol=SECOND * 100, atol=SECOND * 10)


@each(("power", "factor", "limit"), [(-1.0, 1.0, 2.28723), (0.0, 0.5, 2.44519), (1.0, 1.0, np.e)])
def test_where_it_is_elliptic(power: float, factor: float, limit: float) -> None:
    """Up to a limit of a that is known to five digits, for b = 1/a and 1/2; here to the azimuths tried."""
    # With a = b the energy is 2 ln^2 a, whose second derivative along a vanishes at e.
    J = np.stack([np.diag([a, factor * a**power]) for a in (limit * 0.998, limit * 1.002)])
    assert Energy().expansion(J).is_elliptic().tolist() == [True, False]
    assert Energy(exponent=EXPONENT).expansion(J).is_elliptic().all()
