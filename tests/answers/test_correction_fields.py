"""Local corrections, against those of caps by the cubature, and against their limit."""

import json

import numpy as np
import pytest
from tables import each

from projdist import SPHERE, correct, jacobian, local_corrections, mdt
from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS, destination
from projdist.matrices.spd import factor_distance
from projdist.projections import ProjectionError


def symmetric_inverse(A):
    """(A A^T)^-1/2."""
    U, scales, _ = np.linalg.svd(A)
    return (U / scales) @ U.T


@each("name", ["mollweide", "winkel-tripel", "EPSG:3035"])
@each(("radius", "good"), [(2000.0, 1e-6), (200.0, 1e-11)])
def test_caps(name, radius, good):
    """The correction about a point is that of the cap about it, by the adaptive cubature."""
    found = local_corrections(name, 10.0, 50.0, radius).matrix
    truth = symmetric_inverse(np.linalg.inv(correct(name, f"cap:10,50,{radius}").matrix))
    np.testing.assert_allclose(found, truth, atol=good)


def test_caps_of_mars():
    """They are of geodesics of Mars."""
    found = local_corrections("IAU_2015:49976", 10.0, 50.0, 100.0).matrix
    truth = symmetric_inverse(np.linalg.inv(correct("IAU_2015:49976", "cap:10,50,100").matrix))
    np.testing.assert_allclose(found, truth, atol=1e-11)


@pytest.mark.parametrize("name", ["mollweide", "mercator", "EPSG:3035"])
def test_limit(name):
    """As the cap shrinks, the correction tends to the inverse polar factor of J, with the square of the radius."""
    limit = symmetric_inverse(jacobian(name, 30.0, 60.0))
    errors = [np.abs(local_corrections(name, 30.0, 60.0, km).matrix - limit).max() for km in (400.0, 200.0, 100.0)]
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4.0, rtol=0.02)


def test_conformal_maps_need_a_scale():
    """About the poles of two stereographic maps, and elsewhere at the limit, the correction is 1/k."""
    field = local_corrections("+proj=stere +lat_0=90 +R=6371008.7714", 0.0, [90.0, 50.0], 1.0)
    np.testing.assert_allclose(field.parts.scale, [1.0, 0.5 * (1.0 + np.sin(np.radians(50.0)))], rtol=1e-7)
    np.testing.assert_allclose(field.parts.stretch, 1.0, atol=1e-7)


def test_edges():
    """Where less than half of a cap is on the map there is no correction; elsewhere the rest of it counts."""
    field = local_corrections("ortho", [0.0, 80.0, 95.0], 0.0, 1500.0)
    assert np.isfinite(field.matrix).all(axis=(1, 2)).tolist() == [True, True, False]
    rows = json.loads(field.to_json())["results"]
    assert rows[2].pop("lon") == 95.0
    assert rows[2].pop("lat") == 0.0
    assert set(rows[2].values()) == {None}
    assert field.matrix.shape == (3, 2, 2)


# Caps with an antipode, a seam, an edge, a pole line, a pole of infinite scale, and a smooth one.
HARD = [
    ("laea", 170, 0, 1000),
    ("igh", -40, 40, 300),
    ("ortho", 80, 0, 1500),
    ("robin", 0, 88, 500),
    ("merc", 0, 90, 500),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "lon", "lat", "radius"), [*HARD, ("moll", 10, 50, 2000)])
def test_error_estimates(name, lon, lat, radius):
    """The error is at most twice what is said, by the cubature."""
    field = local_corrections(name, lon, lat, radius)
    truth = np.linalg.inv(correct(name, f"cap:{lon},{lat},{radius}").matrix)
    assert 0.5 * factor_distance(np.linalg.inv(field.matrix), truth) <= 2.0 * field.error


def test_the_error_is_the_largest_change_with_fewer_nodes():
    """Half of the azimuths, the other half, three of five rings: each makes a correction of its own."""
    found, radius = local_corrections("mollweide", 60.0, 40.0, 3000.0), 3000e3 / MEAN_EARTH_RADIUS
    t, gauss = np.polynomial.legendre.leggauss(5)
    rings = np.degrees(2.0 * np.arcsin(np.sqrt(0.5 * (1.0 + t)) * np.sin(0.5 * radius)))
    lon, lat = destination(60.0, 40.0, 30.0 * np.arange(12), rings[:, None])
    J, area = jacobian("mollweide", lon, lat), np.multiply.reduce(SPHERE.radii(lat))
    # The weights of t[0], 0 and t[4] = -t[0] that integrate 1 and t^2 from -1 to 1.
    outer = 1.0 / (3.0 * t[0] ** 2)
    fewer = np.zeros(5)
    fewer[[0, 2, 4]] = outer, 2.0 - 2.0 * outer, outer
    even = np.arange(12) % 2 == 0

    def corrected(along, around):
        weights = np.outer(along, around) * area
        return mdt(J[weights != 0], weights[weights != 0]).T

    whole = corrected(gauss, np.ones(12))
    np.testing.assert_allclose(found.matrix, symmetric_inverse(whole), rtol=1e-12)
    others = [corrected(gauss, even), corrected(gauss, ~even), corrected(fewer, np.ones(12))]
    changes = [0.5 * float(factor_distance(whole, other)) for other in others]
    assert max(changes) > 1.5 * min(changes)
    assert found.error == pytest.approx(max(changes), rel=1e-9)


def test_no_such_place():
    """Beyond a pole there is no correction."""
    assert np.isnan(local_corrections("robin", 0.0, [91.0, -95.0], 100.0).matrix).all()


@pytest.mark.parametrize("radius", [0.0, -1.0, 10_001.0, np.nan])
def test_wrong_radius(radius):
    """The radius is above 0, and not of half the globe."""
    with pytest.raises(ValueError, match=r"^Invalid radius '.*'\. It must be above 0 and at most 10,000 km\.$"):
        local_corrections("robin", 0.0, 0.0, radius)


@pytest.mark.slow
def test_wrong_projection():
    """A projection that is none is refused as elsewhere."""
    with pytest.raises(ProjectionError):
        local_corrections("nosuch", 0.0, 0.0, 10.0)


def test_frame():
    """A frame has a row a place, NaN where there is no correction."""
    pytest.importorskip("pandas")
    frame = local_corrections("ortho", [0.0, 95.0], 0.0, 500.0).to_frame()
    assert frame["scale"].isna().tolist() == [False, True]
