"""The slopes of shears, against differences; the best shears, against SciPy's."""

import numpy as np
import pytest
from scipy import optimize

from projdist.designs import fits
from projdist.designs.base_maps import base_nodes_of
from projdist.designs.fits import _independent, _sheared, equal_area_map
from projdist.earth import WGS84
from projdist.field import nodes_of
from projdist.projections import Projection
from projdist.regions import get_region

STEP = 1e-5  # of coefficients: central differences are off by its square, and by rounding over it
TOLERANCE = 1e-8


@pytest.mark.parametrize("degree", [1, 2, 5, 8])
def test_slopes(degree: int) -> None:
    """By all coefficients, of a base that is far from conformal at some points and conformal at one."""
    rng = np.random.default_rng(degree)
    z = rng.uniform(-0.7, 0.7, 40) + 1j * rng.uniform(-0.7, 0.7, 40)
    columns = np.array([1.0, 1j]) + rng.normal(scale=0.2, size=(40, 2)) + 1j * rng.normal(scale=0.2, size=(40, 2))
    columns[0] = 1.0, 1j
    angles = np.pi * np.arange(degree + 2) / (degree + 2)
    free = _independent(degree)
    place = rng.normal(scale=0.02, size=int(free.sum()))

    def rest(place: np.ndarray) -> np.ndarray:
        coefficients = np.zeros(free.shape)
        coefficients[free] = place
        return np.asarray(_sheared(z, columns, angles, coefficients, free)[0])

    coefficients = np.zeros(free.shape)
    coefficients[free] = place
    slopes = _sheared(z, columns, angles, coefficients, free)[1]
    for k, shift in enumerate(STEP * np.eye(place.size)):
        difference = (rest(place + shift) - rest(place - shift)) / (2.0 * STEP)
        np.testing.assert_allclose(slopes[:, k], difference, rtol=0.0, atol=TOLERANCE)


@pytest.mark.parametrize("degree", [1, 2, 5, 8])
def test_shears_have_all_maps_between_them(degree: int) -> None:
    """To first order a map that keeps areas is the flow of a polynomial; those of degree k + 1 have k + 2 terms.

    A shear by y^k moves along that of the (k + 1)th power of y: these powers in their directions must be independent.
    """
    rng = np.random.default_rng(7)
    x, y = rng.uniform(-1, 1, (2, 60))
    angles = np.pi * np.arange(degree + 2) / (degree + 2)
    for k, chosen in enumerate(_independent(degree).T, 1):
        powers = [(y * np.cos(angle) - x * np.sin(angle)) ** (k + 1) for angle in angles[chosen]]
        assert len(powers) == k + 2 == np.linalg.matrix_rank(powers)


@pytest.mark.slow
@pytest.mark.parametrize("degree", [2, 4])
def test_minima_are_those_of_minpack(degree: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the valley is long: in the USA at degree 2 the hundredth step has 7 % more."""
    nodes = nodes_of(get_region("country:US & box:-125,24,-66,50"), WGS84, 500)
    base = Projection.from_user_input("+proj=aea +lat_0=37 +lon_0=-96 +lat_1=30 +lat_2=45 +ellps=WGS84")
    found = []
    own = fits.least_squares

    def both(terms, start):
        fit = optimize.least_squares(
            lambda place: terms(place)[0], start, lambda place: terms(place)[1], method="lm", xtol=1e-12, ftol=1e-12
        )
        place = own(terms, start)
        found.extend([np.linalg.norm(terms(place)[0]), np.linalg.norm(fit.fun)])
        return place

    monkeypatch.setattr(fits, "least_squares", both)
    equal_area_map(base_nodes_of(base, nodes, None), degree, 0.0)
    assert found[0] <= 1.00001 * found[1]
