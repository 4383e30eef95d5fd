"""Regions: their area, extent and edge, the frames of their charts, and what texts name them."""

import math
from itertools import pairwise

import numpy as np
import pyproj
import pytest
import scipy.integrate

from projdist import summarize
from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS, WGS84
from projdist.regions import GLOBE, Box, Cap, PointSet, Region, get_region
from projdist.regions.boxes import likelier

R_KM = MEAN_EARTH_RADIUS / 1000
HALF_TURN = math.pi * R_KM  # 20015.1 km

REGIONS = {
    "globe": GLOBE,
    "box": Box(-10, 35, 40, 70),
    "antimeridian": Box(150, -60, -120, 10),
    "polar box": Box(0, 60, 90, 90),
    "cap": Cap(20, 50, 3000),
    "antimeridian cap": Cap(-175, -30, 4000),
    "polar cap": Cap(30, 90, 2000),
    "cap over a pole": Cap(-60, 75, 4000),
    "cap over the antipode": Cap(10, 20, 16000),
}
region_ids = pytest.mark.parametrize("region", REGIONS.values(), ids=REGIONS.keys())


def unit(lon, lat):
    """Points of the unit sphere, shape (3, ...)."""
    lam, phi = np.radians(lon), np.radians(lat)
    return np.stack(np.broadcast_arrays(np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)))


def frame(lon, lat):
    """Unit vectors east and north, each (3, ...)."""
    lam, phi = np.radians(lon), np.radians(lat)
    east = np.stack([-np.sin(lam), np.cos(lam), 0 * lam])
    north = np.stack([-np.sin(phi) * np.cos(lam), -np.sin(phi) * np.sin(lam), np.cos(phi)])
    return east, north


def random_points(n=4000, seed=11):
    """Points of uniform density on the sphere."""
    rng = np.random.default_rng(seed)
    return rng.uniform(-180, 180, n), np.degrees(np.arcsin(rng.uniform(-1, 1, n)))


# ---- areas ----------------------------------------------------------------------------------


def test_area_of_the_globe():
    """The globe on WGS 84 has 510 065 621.72 km2 (NIMA TR 8350.2; its authalic sphere has 6371.0072 km)."""
    assert GLOBE.area_km2 == pytest.approx(510_065_621.72, abs=0.01)
    assert GLOBE.area_km2 == pytest.approx(4 * math.pi * 6371.0071809**2, rel=1e-10)


@pytest.mark.parametrize(
    "box", [Box(-10, 35, 40, 70), Box(150, -60, -120, 10), Box(3, 80, 9, 84)], ids=lambda b: b.name
)
def test_area_of_a_box(box):
    """The area of a box is that of GeographicLib's geodesic polygon through points along its sides."""
    west, south, east, north = box.bounds
    # A chord of 0.01 degrees leaves the parallel by 1e-9 of its length squared: 1e-7 of the area, at most.
    lons = np.linspace(west, east, round((east - west) / 0.01) + 1)
    sides = [(lons, np.full(lons.size, south)), (lons[::-1], np.full(lons.size, north))]
    area, _ = pyproj.Geod(ellps="WGS84").polygon_area_perimeter(*np.concatenate(sides, axis=1))
    assert box.area_km2 == pytest.approx(abs(area) / 1e6, rel=1e-7)


@pytest.mark.parametrize(
    "cap",
    [Cap(20, 50, 3000), Cap(-175, -30, 4000), Cap(0, 0, 10), Cap(-60, 75, 4000), Cap(10, 20, 16000)],
    ids=lambda c: c.name,
)
def test_area_of_a_cap(cap):
    """A cap on WGS 84 is the integral over its latitudes of M N cos(latitude) times its width in longitude there."""
    a, e2 = WGS84.a, WGS84.f * (2 - WGS84.f)
    angle, phi_0 = cap.radius_km / R_KM, math.radians(cap.lat)

    def width(phi):
        """The longitudes within `angle` of the centre at a latitude, by the law of cosines."""
        bottom = math.cos(phi_0) * math.cos(phi)
        cos = (math.cos(angle) - math.sin(phi_0) * math.sin(phi)) / bottom if bottom > 1e-15 else math.inf
        return 2 * math.acos(min(1.0, max(-1.0, cos)))

    def strip(phi):
        return width(phi) * a * a * (1 - e2) * math.cos(phi) / (1 - e2 * math.sin(phi) ** 2) ** 2

    # The width has square-root ends, at the rim and where the cap begins to go all the way round.
    edges = {phi_0 - angle, phi_0 + angle, math.pi - phi_0 - angle, -math.pi - phi_0 + angle, -math.pi / 2, math.pi / 2}
    inside = sorted(edge for edge in edges if -math.pi / 2 <= edge <= math.pi / 2)
    area = sum(scipy.integrate.quad(strip, low, high, epsrel=1e-11, limit=200)[0] for low, high in pairwise(inside))
    assert cap.area_km2 == pytest.approx(area / 1e6, rel=1e-9)


def test_area_of_a_polar_cap():
    """A cap about a pole is the box north of its rim."""
    cap = Cap(17, 90, 2500)
    assert cap.area_km2 == pytest.approx(Box(-180, 90 - math.degrees(2500 / R_KM), 180, 90).area_km2, rel=1e-12)


@pytest.mark.parametrize(("lon", "lat"), [(0, 0), (20, 50), (-100, -90)])
def test_the_largest_cap_is_the_globe(lon, lat):
    """A cap of half the Earth's circumference is the globe; two opposite caps of a quarter each make it up."""
    assert Cap(lon, lat, HALF_TURN).area_km2 == pytest.approx(GLOBE.area_km2, rel=1e-12)
    assert Cap(lon, lat, 20015).area_km2 == pytest.approx(GLOBE.area_km2, rel=1e-9)  # of 20015.087
    halves = Cap(lon, lat, HALF_TURN / 2).area_km2 + Cap(lon + 180, -lat, HALF_TURN / 2).area_km2
    assert halves == pytest.approx(GLOBE.area_km2, rel=1e-12)


def test_boxes_add_up():
    """The boxes of a partition, one of them across the antimeridian, make up the globe."""
    parts = [(west, south, west + 90, north) for west in (-135, -45, 45) for south, north in ((-90, 12), (12, 90))]
    parts += [(135, -90, -135, 12), (135, 12, -135, 90)]
    assert sum(Box(*part).area_km2 for part in parts) == pytest.approx(GLOBE.area_km2, rel=1e-13)


# ---- extent ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("region", "bounds"),
    [
        (GLOBE, (-180, -90, 180, 90)),
        (Box(-10, 35, 40, 70), (-10, 35, 40, 70)),
        (Box(150, -60, -120, 10), (150, -60, 240, 10)),
        (Box(0, -90, 360, 90), (0, -90, 360, 90)),
        (Cap(30, 90, 2000), (-150, 90 - math.degrees(2000 / R_KM), 210, 90)),
        (Cap(0, 0, HALF_TURN / 6), (-30, -30, 30, 30)),
        (Cap(100, -80, HALF_TURN / 9), (-80, -90, 280, -60)),
    ],
    ids=["globe", "box", "antimeridian", "0-360", "polar cap", "equatorial cap", "cap over a pole"],
)
def test_bounds(region, bounds):
    """Bounds are west, south, east, north with west < east; all longitudes where a cap holds a pole."""
    assert region.bounds == pytest.approx(bounds, abs=1e-9)


@region_ids
def test_points_within_are_within_the_bounds(region):
    """No point of the region lies outside its bounds, and some come near to each of the four."""
    lon, lat = random_points(40_000)
    inside = region.contains(lon, lat)
    west, south, east, north = region.bounds
    east_of_west = np.mod(lon[inside] - west, 360)
    assert (east_of_west <= east - west).all()
    assert ((lat[inside] >= south) & (lat[inside] <= north)).all()
    # Of 40,000 points some hundreds are in the smallest region: a few degrees from any side.
    margin = 6.0
    assert east_of_west.min() < margin
    assert east_of_west.max() > east - west - margin
    assert lat[inside].min() < south + margin
    assert lat[inside].max() > north - margin


@pytest.mark.parametrize("turns", [-360, 0, 360])
def test_longitudes_of_any_turn(turns):
    """A point is in a box or cap whatever full turns its longitude has; edges belong to the region."""
    box = Box(150, -60, -120, 10)
    assert box.contains(np.array([150, 180, -180, -120, 200]) + turns, [-60, 0, 10, 5, -30]).all()
    assert not box.contains(np.array([149.99, -119.99, 0, 180]) + turns, [0, 0, 0, 10.01]).any()
    cap = Cap(-175, 0, HALF_TURN / 18)  # ten degrees
    assert cap.contains(np.array([-165, 175, -175, 180]) + turns, [0, 0, 10, 5]).all()
    assert not cap.contains(np.array([-164.99, 174.99, -175, 0]) + turns, [0, 0, 10.01, 0]).any()


@region_ids
def test_contains_by_distance_or_sides(region):
    """A cap holds the points within its radius, by the angle between unit vectors; a box those between its sides."""
    lon, lat = random_points()
    if isinstance(region, Cap):
        centre, points = unit(region.lon, region.lat), unit(lon, lat)
        distance = np.arctan2(np.linalg.norm(np.cross(centre, points, axis=0), axis=0), centre @ points)
        truth = distance * R_KM <= region.radius_km
    else:
        west, south, east, north = region.bounds
        truth = (lat >= south) & (lat <= north)
        truth &= ((west <= lon) & (lon <= east)) | ((west <= lon + 360) & (lon + 360 <= east))
    np.testing.assert_array_equal(region.contains(lon, lat), truth)
    assert truth.any()


def test_contains_broadcasts():
    """Longitudes and latitudes broadcast together, and a single point is a single answer."""
    assert Box(-10, 35, 40, 70).contains([[0], [50]], [40, 50, 80]).tolist() == [[True, True, False], [False] * 3]
    assert bool(GLOBE.contains(0, 90))
    assert Cap(0, 90, 1000).contains(123.0, 90.0).shape == ()


# ---- charts ---------------------------------------------------------------------------------


def chart_points(region, n=300, seed=5):
    """Random chart coordinates of a region's panels: patch, u, v."""
    rng = np.random.default_rng(seed)
    number, rectangles = region.panels()
    index = rng.integers(len(number), size=n)
    u0, u1, v0, v1 = rectangles[index].T
    return number[index], u0 + (u1 - u0) * rng.uniform(0.001, 0.999, n), v0 + (v1 - v0) * rng.uniform(0.001, 0.999, n)


@region_ids
def test_chart_stays_within(region):
    """The chart's points lie in the region."""
    points = region.chart(*chart_points(region))
    assert region.contains(points.lon, points.lat).all()


@region_ids
def test_frame_of_the_chart(region):
    """East and north velocities of the chart are those of the unit vector, by finite differences."""
    patch, u, v = chart_points(region)
    points = region.chart(patch, u, v)
    directions = frame(points.lon, points.lat)
    h = 2e-3  # degrees: truncated terms and rounding of fourth-order differences are both some 1e-12

    def velocity(du, dv):
        def at(steps):
            moved = region.chart(patch, u + steps * h * du, v + steps * h * dv)
            return unit(moved.lon, moved.lat)

        return (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * h)

    for du, dv, east, north in ((1, 0, points.east_u, points.north_u), (0, 1, points.east_v, points.north_v)):
        moved = velocity(du, dv)
        for value, direction in zip((east, north), directions, strict=True):
            truth = np.sum(moved * direction, axis=0)
            np.testing.assert_allclose(np.broadcast_to(value, truth.shape), truth, atol=1e-12)


@region_ids
def test_panels_cover_the_region(region):
    """The solid angle under the chart, panel by panel, is that of the region: nothing is missing, nothing double."""
    number, rectangles = region.panels()
    x, w = np.polynomial.legendre.leggauss(24)
    total = 0.0
    for patch, (u0, u1, v0, v1) in zip(number, rectangles, strict=True):
        u, v = np.broadcast_arrays((u0 + u1) / 2 + (u1 - u0) / 2 * x[:, None], (v0 + v1) / 2 + (v1 - v0) / 2 * x)
        points = region.chart(np.array(patch), u, v)
        density = np.abs(points.east_u * points.north_v - points.east_v * points.north_u)
        total += np.sum(w[:, None] * w * density) * (u1 - u0) * (v1 - v0) / 4
    if isinstance(region, Cap):
        truth = 2 * math.pi * (1 - math.cos(region.radius_km / R_KM))
    else:
        west, south, east, north = np.radians(region.bounds)
        truth = (east - west) * (math.sin(north) - math.sin(south))
    assert total == pytest.approx(truth, rel=1e-12)


def test_azimuth_and_distance():
    """The chart of a cap is azimuth and distance: its points solve the direct problem on a sphere."""
    cap = Cap(20, 50, 3000)
    geod = pyproj.Geod(a=MEAN_EARTH_RADIUS, b=MEAN_EARTH_RADIUS)
    azimuth, distance = np.array([0.0, 33, 120, 250, 359]), np.array([5.0, 26, 12, 0.1, 20])
    points = cap.chart(np.zeros(5, dtype=int), azimuth, distance)
    lon, lat, _ = geod.fwd(np.full(5, 20.0), np.full(5, 50.0), azimuth, np.radians(distance) * MEAN_EARTH_RADIUS)
    np.testing.assert_allclose(np.mod(points.lon - lon + 180, 360) - 180, 0.0, atol=1e-12)
    np.testing.assert_allclose(points.lat, lat, atol=1e-12)


# ---- texts ----------------------------------------------------------------------------------

TEXTS = {
    "globe": GLOBE,
    " Globe ": GLOBE,
    "box:-180,-90,180,90": GLOBE,
    "box:-10,35,40,70": Box(-10, 35, 40, 70),
    "BOX: -10, 35.5, 4e1, 70": Box(-10, 35.5, 40, 70),
    "box:170,-20,-170,20": Box(170, -20, -170, 20),
    "cap:20,50,3000": Cap(20, 50, 3000),
    "Cap:-175,-90,20015": Cap(-175, -90, 20015),
}


@pytest.mark.parametrize("text", TEXTS)
def test_texts(text):
    """A text names a region, with blanks and capitals as they come."""
    assert get_region(text) == TEXTS[text]


@region_ids
def test_regions_pass_through(region):
    """A region stands for itself, and its name is a text for it."""
    assert get_region(region) is region
    assert get_region(region.name) == region


@pytest.mark.parametrize("box", [Box(-180, -90, 180, 90), Box(0, -90, 360, 90)], ids=["-180", "0"])
def test_name_of_the_globe(box):
    """A box that is the whole sphere is called globe, wherever it begins."""
    assert box.is_globe
    assert box.name == "globe"
    assert not Box(-180, -90, 180, 89).is_globe


FORMS = (
    "It must be globe, land, ocean, box:W,S,E,N, cap:LON,LAT,KM, country:NAME, continent:NAME, state:NAME, crs:CODE, "
    "file:PATH, geodesic:PATH or points:PATH, or a combination of these by &, - and +."
)
WRONG = {
    "": f"Invalid region ''. {FORMS}",
    "europe": f"Invalid region 'europe'. Did you mean continent:Europe? {FORMS}",
    "disc:1,2,3": f"Invalid region 'disc:1,2,3'. {FORMS}",
    "-10,35,40,70": f"Invalid region '-10,35,40,70'. {FORMS}",
    "box": "Invalid region 'box'. It must be box:W,S,E,N, 4 numbers.",
    "box:": "Invalid region 'box:'. It must be box:W,S,E,N, 4 numbers.",
    "box:1,2,3": "Invalid region 'box:1,2,3'. It must be box:W,S,E,N, 4 numbers.",
    "box:1,2,3,4,5": "Invalid region 'box:1,2,3,4,5'. It must be box:W,S,E,N, 4 numbers.",
    "box:1,2,3,north": "Invalid region 'box:1,2,3,north'. It must be box:W,S,E,N, 4 numbers.",
    "CAP:1,2": "Invalid region 'CAP:1,2'. It must be cap:LON,LAT,KM, 3 numbers.",
    "box:0,50,10,40": "Invalid box '0,50,10,40'. Did you mean 0,40,10,50? "
    "South must be below north, both within -90 and 90.",
    "box:0,40,10,40": "Invalid box '0,40,10,40'. South must be below north, both within -90 and 90.",
    "box:0,40,10,91": "Invalid box '0,40,10,91'. Did you mean 40,0,91,10? "
    "South must be below north, both within -90 and 90.",
    "box:0,-91,10,40": "Invalid box '0,-91,10,40'. Did you mean -91,0,40,10? "
    "South must be below north, both within -90 and 90.",
    "box:nan,40,10,50": "Invalid box 'nan,40,10,50'. West, south, east and north must be finite numbers of degrees.",
    "box:0,40,inf,50": "Invalid box '0,40,inf,50'. West, south, east and north must be finite numbers of degrees.",
    "box:-400,40,0,50": "Invalid box '-400,40,0,50'. West and east must lie within -360 and 360.",
    "box:0,40,361,50": "Invalid box '0,40,361,50'. West and east must lie within -360 and 360.",
    "box:10,40,10,50": "Invalid box '10,40,10,50'. It must be wider than 0 and at most 360 degrees.",
    "box:-200,40,200,50": "Invalid box '-200,40,200,50'. It must be wider than 0 and at most 360 degrees.",
    "cap:0,91,100": "Invalid cap '0,91,100'. Its centre must be a longitude within -360 and 360, "
    "a latitude within -90 and 90.",
    "cap:400,0,100": "Invalid cap '400,0,100'. Its centre must be a longitude within -360 and 360, "
    "a latitude within -90 and 90.",
    "cap:nan,0,100": "Invalid cap 'nan,0,100'. Its centre must be a longitude within -360 and 360, "
    "a latitude within -90 and 90.",
    "cap:0,nan,100": "Invalid cap '0,nan,100'. Its centre must be a longitude within -360 and 360, "
    "a latitude within -90 and 90.",
}
WRONG |= {
    f"cap:0,0,{radius}": f"Invalid cap '0,0,{radius}'. Its radius must be above 0 and at most 20015 km, "
    "half the Earth's circumference."
    for radius in ("0", "-5", "20016", "nan", "inf")
}


@pytest.mark.parametrize("text", WRONG)
def test_wrong_texts(text):
    """What is no region is refused, with what it must be."""
    with pytest.raises(ValueError) as caught:  # noqa: PT011 the whole text is compared
        get_region(text)
    assert str(caught.value) == WRONG[text]


def test_boxes_two_turns_apart():
    """A box whose east is more than a turn west of its west is refused."""
    with pytest.raises(ValueError, match=r"^Invalid box '350,0,-350,10'\. It must be wider than 0 and at most 360"):
        Box(350, 0, -350, 10)


@pytest.mark.parametrize("text", ["box:-122.4194155,37.7749295,-122.3,37.9", "cap:2.3522219,48.856614,1234.5678"])
def test_names_keep_all_digits(text):
    """The name of a region is the region: no digit is lost."""
    assert get_region(get_region(text).name) == get_region(text)


@region_ids
def test_regions_are_values(region):
    """Regions are frozen, and satisfy what the cubature asks of one."""
    checked: Region = region
    assert hash(checked) == hash(region)
    with pytest.raises(AttributeError, match="cannot assign"):
        region.name = "other"


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ((95, -40, -67, 20), (95, -40, -67, 20)),  # the Pacific, from Sumatra to Chile
        ((30, 35, -10, 70), (-10, 35, 30, 70)),
        ((-10, 70, 30, 35), (-10, 35, 30, 70)),
        ((35, -120, 70, -10), (-120, 35, -10, 70)),  # latitudes first
    ],
)
def test_what_is_likelier_meant(given: tuple[float, ...], meant: tuple[float, ...]) -> None:
    """West and east exchanged make a box of far more than half of the Earth; wide oceans are no mistakes."""
    assert likelier(given) == meant


def test_bounds_of_points_all_round() -> None:
    """Points round the Earth have all longitudes, others the narrowest range, across the antimeridian, too."""
    ring = PointSet(np.arange(-180.0, 180.0, 5.0), np.full(72, 10.0), np.ones(72))
    west, south, east, north = ring.bounds
    assert east - west == pytest.approx(360.0)
    assert south < 10.0 < north
    assert ring.contains([0.0, 179.0, 0.0], [10.0, 10.0, 60.0]).tolist() == [True, True, False]
    some = PointSet(np.array([170.0, -170.0]), np.array([89.9, 80.0]), np.ones(2))
    assert some.bounds == pytest.approx((169.0, 79.0, 191.0, 90.0))
    assert some.contains([180.0, -175.0, 160.0, 190.0], [85.0, 85.0, 85.0, 70.0]).tolist() == [True, True, False, False]


def test_a_cap_of_the_whole_sphere_is_all_polygons() -> None:
    """Combined with others it takes nothing from them."""
    whole = get_region("cap:0,0,20015 & box:0,40,10,50")
    assert whole.area_km2 == pytest.approx(Box(0, 40, 10, 50).area_km2, rel=1e-9)


def test_points_of_lists():
    """Lists are taken as arrays are: on the sphere Mercator's scale is 1 / cos(lat) at each of the points."""
    points = PointSet([0.0, 1.0], [0.0, 60.0], [1.0, 1.0])
    assert summarize("mercator", points, measures=["k"]).measures["k"].mean == pytest.approx(1.5, rel=1e-9)


def test_points_are_no_area() -> None:
    """What asks a region for its area, its edges or its far parts need not know that it is of points."""
    points = PointSet(np.array([0.0, 1.0]), np.array([0.0, 60.0]), np.ones(2))
    assert (points.area_km2, points.edges.shape, points.far) == (0.0, (0, 4), "")
