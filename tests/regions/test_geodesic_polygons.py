"""Polygons with geodesics for edges, and how crossing rings are repaired, against GeographicLib and closed forms."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
import scipy.integrate
import shapely
from region_texts import GEOD, geodesic_area, square
from tables import each

from projdist.earth import WGS84
from projdist.earth.natural_earth import chords
from projdist.projections.coordinates import geodesics
from projdist.regions import Box, Polygons, get_region, polygons_from_geojson, polygons_of

Ring = list[list[float]]

PROMISED = 1e-8
# GeographicLib's own areas, in km2: c^2 = 4e13 m2 times angles that are rounded, 4e-5 m2 for polygons of 50 m; those of
# a metre are measured against the plane.
ROUNDED = 1e-10


def region(*rings: Ring, edges: str = "geodesic") -> Polygons:
    return polygons_from_geojson({"type": "Polygon", "coordinates": list(rings)}, edges=edges)


def star(rng: np.random.Generator, lon: float, lat: float, km: float, shortest: float = 0.4) -> Ring:
    """A polygon whose vertices lie at growing azimuths round a point: it is valid on the ground."""
    n = int(rng.integers(3, 15))
    azimuths = np.sort(rng.uniform(0, 360, n))
    while np.diff(azimuths, append=azimuths[0] + 360).max() > 150:
        azimuths = np.sort(rng.uniform(0, 360, n))
    ends = GEOD.fwd(np.full(n, lon), np.full(n, lat), azimuths, 1000 * km * rng.uniform(shortest, 1, n))
    ring = [[x, y] for x, y in zip(*ends[:2], strict=True)]
    return [*ring, ring[0]]


CENTRES = {
    "anywhere": lambda rng: (rng.uniform(-180, 180), math.degrees(math.asin(rng.uniform(-1, 1)))),
    "antimeridian": lambda rng: (180 + rng.uniform(-0.5, 0.5), rng.uniform(-80, 80)),
    "pole": lambda rng: (rng.uniform(-180, 180), rng.choice([-1, 1]) * rng.uniform(86, 90)),
    "equator": lambda rng: (rng.uniform(-180, 180), rng.uniform(-1, 1)),
}


def valid_polygons(where: str, km: float, count: int) -> Iterator[list[Ring]]:
    """Random ones, every other with a hole: no edge comes nearer to the centre than 0.4 cos 75 = 0.10 of its size."""
    rng = np.random.default_rng([len(where), round(km * 1000)])
    for k in range(count):
        lon, lat = CENTRES[where](rng)
        rings = [star(rng, lon, lat, km), star(rng, lon, lat, 0.08 * km, 0.5)]
        yield rings[: 1 + k % 2]


def check(rings: list[Ring]) -> None:
    found = region(*rings)
    assert found.area_km2 == pytest.approx(geodesic_area(*rings), rel=PROMISED, abs=ROUNDED)
    assert found.notes == ()


@pytest.mark.parametrize(
    ("km", "count"), [(0.2, 4), *(pytest.param(km, 60, marks=pytest.mark.slow) for km in (0.05, 0.2, 5, 40, 500, 3000))]
)
@pytest.mark.parametrize("where", CENTRES)
def test_valid_polygons(where: str, km: float, count: int) -> None:
    """Their areas are GeographicLib's to 1e-8 whatever their size and place, and nothing is said of them."""
    for rings in valid_polygons(where, km, count):
        check(rings)


def test_known_polygons() -> None:
    """Two meridians and the equator hold a share of the hemisphere; edges leave chords by millimetres, which count."""
    # The published area of WGS 84, 510065621.724 km2; and three hundredths of a square kilometre at 65 N.
    assert region(square(10, 0, 55, 90)).area_km2 == pytest.approx(510065621.724 / 16, rel=1e-9)
    triangle = [[25.0, 65.0], [25.005, 65.0005], [25.003, 65.0025], [25.0, 65.0]]
    assert geodesic_area(triangle) == pytest.approx(0.03, rel=0.2)
    check([triangle])


@each("lat", [0.0, 40.0, -65.0, 85.0])
def test_a_triangle_of_a_metre(lat: float) -> None:
    """Is flat: its area is that of a plane triangle, by the radii of curvature."""
    d = 1e-5
    found = region([[179.999995, lat], [-179.999995, lat], [180.0, lat + d], [179.999995, lat]]).area_km2
    truth = 0.5 * math.radians(d) ** 2 * math.prod(WGS84.radii(lat + d / 3)) * math.cos(math.radians(lat + d / 3)) / 1e6
    # Longitudes near 180 are good to 3e-14 degrees, 3e-9 of this width.
    assert found == pytest.approx(truth, rel=2e-8)


def test_a_ring_ends_where_it_begins() -> None:
    """The vertices of geodesics are those given, to the last bit, also after a turn."""
    ring = np.array([[179.1, 12.3], [181.7, 14.9], [180.3, 17.7], [179.1, 12.3]])
    lon, lat = geodesics(ring, WGS84)(np.arange(4.0))
    np.testing.assert_array_equal(np.column_stack([lon, lat]), ring)


@each("tolerance", [1e-2, 1e-4])
def test_chords_have_the_area_of_their_curve(tolerance: float) -> None:
    """A circle's polygon has its area to fourth order in the chord: to the square of what chords alone have."""
    points = chords(lambda t: (np.cos(t), np.sin(t)), np.linspace(0.0, 2.0 * math.pi, 9), tolerance)
    assert shapely.Polygon(points).area == pytest.approx(math.pi, rel=tolerance**2)
    assert np.abs(np.hypot(*points.T) - 1.0).max() <= tolerance


@each("km", [0.01, 1.0, 100.0])
def test_small_caps_as_polygons(km: float) -> None:
    cap = get_region(f"cap:25,65,{km}")
    assert Polygons(polygons_of(cap), "").area_km2 == pytest.approx(cap.area_km2, rel=PROMISED)


# ---- repairs --------------------------------------------------------------------------------
# A hole that sticks out, one that is outside, and one around.
@each("hole, common", [((8, 2, 14, 4), (8, 2, 10, 4)), ((20, 2, 22, 4), None), ((-5, -5, 15, 15), (0, 0, 10, 10))])
def test_a_hole_that_leaves_its_shell(hole: tuple[float, ...], common: tuple[float, ...] | None) -> None:
    """The polygon is what one of the two goes round, whichever its edges, as shapely repairs it; and that is said."""
    rings = square(0, 0, 10, 10), square(*hole)
    straight, geodesic = region(*rings, edges="straight"), region(*rings)
    truth = Box(0, 0, 10, 10).area_km2 + Box(*hole).area_km2 - (2 * Box(*common).area_km2 if common else 0)
    assert straight.area_km2 == pytest.approx(truth, rel=1e-12)
    assert geodesic.area_km2 == pytest.approx(truth, rel=0.02)
    repaired = shapely.make_valid(shapely.Polygon(rings[0], [rings[1]]))
    assert straight.geometry.symmetric_difference(repaired).area == pytest.approx(0.0, abs=1e-12)
    said = "1 polygon(s) with holes that leave their shells or overlap repaired by the even-odd rule; the area"
    assert all(found.repairs[0].startswith(f"polygons: {said}") for found in (straight, geodesic))


@pytest.mark.slow
@pytest.mark.parametrize("edges", ["straight", "geodesic"])
def test_a_hole_round_a_pole(edges: str) -> None:
    """A ring between two parallels that both go round the pole, however they begin, is a band, and as it was meant."""
    shell = [[lon, 60.0] for lon in range(-180, 181)]
    hole = [[lon, 80.0] for lon in range(-30, 331)]
    found = region(shell, hole, edges=edges)
    truth = Box(-180, 60, 180, 80).area_km2 if edges == "straight" else geodesic_area(shell, hole)
    assert found.area_km2 == pytest.approx(truth, rel=PROMISED)
    assert found.notes == ()
    assert found.contains([0, 0, 200], [70, 85, 61]).tolist() == [True, False, True]


def test_a_ring_round_a_pole_that_turns_back() -> None:
    """It begins on a meridian that it crosses again: the way to the pole starts where the ring is nearest to it."""
    ring = [[10.0, 50], [10, 60], [70, 60], [70, 70], [40, 70], [-90, 55], [-200, 50], [-350, 50]]
    found = region(ring, edges="straight")
    assert found.notes == ()
    assert bool(found.contains(0, 90))
    # By hand: the pole's side of the ring, in the plane of longitude and latitude, which goes round westwards.
    lon, lat = np.transpose(ring)
    assert found.geometry.area == pytest.approx(360 * 90 + scipy.integrate.trapezoid(lat, lon), rel=1e-12)
    assert not shapely.Polygon([*ring, [-350, 90], [10, 90]]).is_valid
