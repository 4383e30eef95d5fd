"""The slopes of shears, against differences."""

import numpy as np
import pytest

from projdist.designs.equal_area_maps import _independent, _sheared

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
