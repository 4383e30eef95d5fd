"""Maps of the plane: what numpy computes is what PROJ runs, and Jacobians are the derivatives."""

import numpy as np
from pyproj import Transformer
from tables import each

from projdist.designs.plane_maps import ComplexPolynomial, PlaneMap, PolynomialMap, Shears

rng = np.random.default_rng(3)
X, Y = rng.uniform(-2e6, 2e6, size=(2, 400))
SAME = 1e-8  # metres: rounding of coordinates of 2e6
BACK = 1e-5  # metres: where PROJ's iteration stops


def general() -> PolynomialMap:
    c = np.zeros((2, 9, 9))
    for i in range(9):
        for j in range(9 - i):
            c[:, i, j] = 2e6 * 0.02 / (1 + i + j) ** 2 * rng.normal(size=2)
    c[0, 1, 0], c[1, 0, 1] = 2e6, 2e6
    return PolynomialMap(1e5 + 2e5j, 2e6, c)


def conformal() -> ComplexPolynomial:
    tail = 2e4 * (rng.normal(size=8) + 1j * rng.normal(size=8)) / (2 + np.arange(8)) ** 2
    return ComplexPolynomial(1e5 + 2e5j, 2e6, np.concatenate([[1e4, 2e6], tail]))


def equal_area() -> Shears:
    return Shears(1e5 + 2e5j, 2e6, np.pi * np.arange(6) / 6, 0.02 * rng.normal(size=(6, 6)))


MAPS = {"general": general(), "conformal": conformal(), "equal_area": equal_area()}


@each("moved", [False, True])
@each("name", MAPS)
def test_proj_runs_it(name: str, moved: bool) -> None:
    """Forward to rounding, and back."""
    plane_map: PlaneMap = MAPS[name].moved(0.9 * np.exp(0.3j), 1e6 - 2e5j) if moved else MAPS[name]
    transformer = Transformer.from_pipeline("+proj=pipeline " + " ".join(f"+step {step}" for step in plane_map.steps))
    x, y, J = plane_map.at(X, Y)
    found = transformer.transform(X, Y)
    np.testing.assert_allclose(found, (x, y), rtol=0, atol=SAME)
    np.testing.assert_allclose(transformer.transform(*found, direction="INVERSE"), (X, Y), rtol=0, atol=BACK)
    step = 10.0
    for axis, by in enumerate(((step, 0.0), (0.0, step))):
        ahead, behind = (plane_map.at(X + sign * by[0], Y + sign * by[1]) for sign in (1, -1))
        np.testing.assert_allclose(J[:, 0, axis], (ahead[0] - behind[0]) / (2 * step), atol=1e-8)
        np.testing.assert_allclose(J[:, 1, axis], (ahead[1] - behind[1]) / (2 * step), atol=1e-8)


def test_conformal_maps_keep_angles() -> None:
    """The columns of J are each other's turn by a right angle, to the last digit."""
    J = MAPS["conformal"].at(X, Y)[2]
    np.testing.assert_array_equal(J[:, :, 1], np.stack([-J[:, 1, 0], J[:, 0, 0]], axis=-1))


def test_shears_keep_areas() -> None:
    """Their determinant is 1 to rounding."""
    np.testing.assert_allclose(np.linalg.det(MAPS["equal_area"].at(X, Y)[2]), 1.0, rtol=1e-13)
