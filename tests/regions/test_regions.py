"""Regions: their area, extent and edge, the frames of their charts, and what texts name them."""

import math

import numpy as np
import pyproj
import pytest
from hypothesis import given, strategies as st
from region_texts import geodesic_area, refused
from tables import each

from projdist import summarize
from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS, SPHERE, WGS84, Ellipsoid
from projdist.regions import GLOBE, Box, Cap, PointSet, TurnedGlobe, bounding_box, get_region

R_KM = MEAN_EARTH_RADIUS / 1000
HALF_TURN, SIXTH = math.pi * R_KM, math.pi * R_KM / 6  # 20015.1 km, 30 degrees
SATURN = Ellipsoid(60268000.0, 1 - 54364.0 / 60268.0)  # IAU 2015; the flattest of the planets

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
    "cap near the antipode": Cap(10, 20, 19900),
    "cap on a sphere": Cap(-175, -30, 4000, SPHERE),
    "cap on a sphere over the antipode": Cap(10, 20, 16000, SPHERE),
    "cap on Saturn": Cap(-60, 35, 40_000, SATURN),
}
TURNED = [TurnedGlobe(13.0, 45.0), TurnedGlobe(-170.0, -20.0, graded=False, widest=90.0)]
TURNED += [TurnedGlobe(90.0, 0.0, widest=90.0)]


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


# ---- areas ----------------------------------------------------------------------------------
def test_area_of_the_globe():
    """The globe on WGS 84 has 510 065 621.72 km2 (NIMA TR 8350.2; its authalic sphere has 6371.0072 km)."""
    assert GLOBE.area_km2 == pytest.approx(510_065_621.72, abs=0.01)
    assert GLOBE.area_km2 == pytest.approx(4 * math.pi * 6371.0071809**2, rel=1e-10)


@each("box", [Box(-10, 35, 40, 70), Box(150, -60, -120, 10), Box(3, 80, 9, 84)])
def test_area_of_a_box(box):
    """The area of a box is that of GeographicLib's geodesic polygon through points along its sides."""
    west, south, east, north = box.bounds
    # A chord of 0.01 degrees leaves the parallel by 1e-9 of its length squared: 1e-7 of the area, at most.
    lons = np.linspace(west, east, round((east - west) / 0.01) + 1)
    sides = [(lons, np.full(lons.size, south)), (lons[::-1], np.full(lons.size, north))]
    assert box.area_km2 == pytest.approx(geodesic_area(np.concatenate(sides, axis=1).T), rel=1e-7)


def geod_of(cap):
    """GeographicLib on the figure of a cap."""
    return pyproj.Geod(a=cap.figure.a, f=cap.figure.f)


def circle(cap, count):
    """Longitudes and latitudes of points at the radius of a cap, in all directions."""
    azimuths = np.arange(count) * 360.0 / count
    start = np.full(count, cap.lon), np.full(count, cap.lat)
    lon, lat, _ = geod_of(cap).fwd(*start, azimuths, np.full(count, 1000.0 * cap.radius_km))
    return np.asarray(lon), np.asarray(lat)


def distance_from(cap, lon, lat):
    """Metres from the centre of a cap to points, by GeographicLib."""
    return np.asarray(
        geod_of(cap).inv(np.full(lon.shape, float(cap.lon)), np.full(lat.shape, float(cap.lat)), lon, lat)[2]
    )


@each("cap", [
    *(Cap(20, 50, 3000), Cap(-175, -30, 4000), Cap(0, 0, 10), Cap(-60, 75, 4000), Cap(0, 0, 1000)),
    *(Cap(10, 20, 16000), Cap(10, 50, 19900), Cap(3, -89.9, 20), Cap(-60, 35, 40_000, SATURN)),
    *(Cap(7, 20, 140_000, SATURN), Cap(0, 0, 1000, Ellipsoid(3396190.0, 1 / 169.894447))),
])  # fmt: skip
def test_area_of_a_cap(cap):
    """The area of GeographicLib's polygon of geodesics through 3000 points at the radius, and through half as many."""

    def polygon(count):
        area = abs(geod_of(cap).polygon_area_perimeter(*circle(cap, count))[0])
        return area if cap.radius_km < 1.5e-3 * cap.figure.a else max(area, cap.figure.area - area)

    # Chords leave a circle by the square of their length; of two such areas the error is thrown away.
    area = (4.0 * polygon(3000) - polygon(1500)) / 3.0
    assert cap.area_km2 == pytest.approx(area / 1e6, rel=1e-10)


def test_area_of_a_polar_cap():
    """It is the box north of its rim."""
    _, rim, _ = pyproj.Geod(ellps="WGS84").fwd(17.0, 90.0, 180.0, 2.5e6)
    assert Cap(17, 90, 2500).area_km2 == pytest.approx(Box(-180, rim, 180, 90).area_km2, rel=1e-11)


@each(("lon", "lat"), [(0, 0), (20, 50), (-100, -90)])
def test_the_largest_cap_is_the_globe(lon, lat):
    """A cap of half the Earth's circumference is the globe; on a sphere two opposite caps of a quarter make it up."""
    globe = 4 * math.pi * R_KM**2
    assert Cap(lon, lat, HALF_TURN).area_km2 == pytest.approx(GLOBE.area_km2, rel=1e-12)
    assert Cap(lon, lat, HALF_TURN, SPHERE).area_km2 == pytest.approx(globe, rel=1e-12)
    assert Cap(lon, lat, 20015, SPHERE).area_km2 == pytest.approx(globe, rel=1e-9)  # of 20015.087
    halves = [Cap(*centre, HALF_TURN / 2, SPHERE) for centre in ((lon, lat), (lon + 180, -lat))]
    assert sum(half.area_km2 for half in halves) == pytest.approx(globe, rel=1e-12)


@pytest.mark.slow
@each(("lat", "radius_km", "half"), [(0, 20_000, 40.0), (60, 20_003, 8.0), (0, 19_980, 80.0), (30, 19_990, 50.0)])
def test_what_the_largest_caps_leave_out(lat, radius_km, half):
    """About the antipode, where geodesics of equal length meet: by GeographicLib's distances on a lattice about it."""
    cap = Cap(10, lat, radius_km)
    north, east = np.meshgrid(*2 * [np.linspace(-half, half, 301)], indexing="ij")
    to_lat = -lat + np.degrees(north / 6371.0)
    to_lon = 190.0 + np.degrees(east / 6371.0 / math.cos(math.radians(lat)))
    outside = distance_from(cap, to_lon, to_lat) > 1000.0 * radius_km
    assert (cap.contains(to_lon, to_lat) == ~outside).all()
    ground = math.prod(WGS84.radii(to_lat)) * np.cos(np.radians(to_lat)) * 1e-6
    cell = np.radians(to_lat[1, 0] - to_lat[0, 0]) * np.radians(to_lon[0, 1] - to_lon[0, 0])
    left_out = np.sum(ground[outside]) * cell
    assert not outside[[0, -1]].any()
    assert not outside[:, [0, -1]].any()
    assert GLOBE.area_km2 - cap.area_km2 == pytest.approx(left_out, rel=0.003)


def test_boxes_add_up():
    """The boxes of a partition, one of them across the antimeridian, make up the globe."""
    parts = [(west, south, west + 90, north) for west in (-135, -45, 45) for south, north in ((-90, 12), (12, 90))]
    parts += [(135, -90, -135, 12), (135, 12, -135, 90)]
    assert sum(Box(*part).area_km2 for part in parts) == pytest.approx(GLOBE.area_km2, rel=1e-13)


# ---- extent ---------------------------------------------------------------------------------
@each(("region", "bounds"), [
    *((GLOBE, (-180, -90, 180, 90)), (Box(-10, 35, 40, 70), (-10, 35, 40, 70))),
    *((Box(150, -60, -120, 10), (150, -60, 240, 10)), (Box(0, -90, 360, 90), (0, -90, 360, 90))),
    (Cap(30, 90, 2000, SPHERE), (-150, 90 - math.degrees(2000 / R_KM), 210, 90)),
    *((Cap(0, 0, SIXTH, SPHERE), (-30, -30, 30, 30)), (Cap(100, -80, SIXTH, SPHERE), (-80, -90, 280, -50))),
])  # fmt: skip
def test_bounds(region, bounds):
    """Bounds are west, south, east, north with west < east; all longitudes where a cap holds a pole."""
    assert region.bounds == pytest.approx(bounds, abs=1e-9)


@each("cap", [Cap(20, 50, 3000), Cap(-175, -30, 4000), Cap(0, 0, 10), Cap(-60, 35, 40_000, SATURN)])
def test_bounds_of_a_cap(cap):
    """The extremes of the points at the radius; a parabola through those about each is as good as its neighbours."""
    lon, lat = circle(cap, 3600)
    lon = cap.lon + np.mod(lon - cap.lon + 180.0, 360.0) - 180.0
    truth = (lon.min(), lat.min(), lon.max(), lat.max())
    assert cap.bounds == pytest.approx(truth, abs=3e-6 * math.degrees(1000.0 * cap.radius_km / cap.figure.a))
    assert (np.subtract(truth, cap.bounds) * [1.0, 1.0, -1.0, -1.0] > -1e-9).all()


@each("region", REGIONS.values())
def test_points_within_are_within_the_bounds(region):
    """A cap holds the points within its radius, by GeographicLib, a box those within its bounds, which are narrow."""
    rng = np.random.default_rng(11)
    lon, lat = rng.uniform(-180, 180, 40_000), np.degrees(np.arcsin(rng.uniform(-1, 1, 40_000)))
    inside, (west, south, east, north) = region.contains(lon, lat), region.bounds
    from_west = np.mod(lon - west, 360)
    truth = (from_west <= east - west) & (lat >= south) & (lat <= north)
    assert truth[inside].all()
    # Of 40,000 points some hundreds are in the smallest region: a few degrees from any side.
    for values, least, most in ((from_west[inside], 0, east - west), (lat[inside], south, north)):
        assert max(values.min() - least, most - values.max()) < 6.0
    if isinstance(region, Cap):
        truth = distance_from(region, lon[:4000], lat[:4000]) <= 1000.0 * region.radius_km
    np.testing.assert_array_equal(inside[: truth.size], truth)


@each("turns", [-360, 0, 360])
def test_longitudes_of_any_turn(turns):
    """A point is in a box or cap whatever full turns its longitude has; edges belong to the region."""
    box = Box(150, -60, -120, 10)
    assert box.contains(np.array([150, 180, -180, -120, 200]) + turns, [-60, 0, 10, 5, -30]).all()
    assert not box.contains(np.array([149.99, -119.99, 0, 180]) + turns, [0, 0, 0, 10.01]).any()
    cap = Cap(-175, 0, HALF_TURN / 18, SPHERE)  # ten degrees
    assert cap.contains(np.array([-165, 175, -175, 180]) + turns, [0, 0, 10, 5]).all()
    assert not cap.contains(np.array([-164.99, 174.99, -175, 0]) + turns, [0, 0, 10.01, 0]).any()


@each("cap", [one for one in REGIONS.values() if isinstance(one, Cap)])
def test_the_rim_of_a_cap(cap):
    """Its points are at the radius, to a micrometre on Earth; those farther are not in the cap, nearer ones are."""
    metre, u = cap.figure.a / 6.4e6, np.linspace(0.0, 360.0, 721)
    rim = cap.chart(np.zeros(u.size, dtype=int), u, np.full(u.size, cap.angle))
    start = np.full(u.size, cap.lon), np.full(u.size, cap.lat)
    _, back, distance = geod_of(cap).inv(*start, rim.lon, rim.lat)
    np.testing.assert_allclose(distance, 1000.0 * cap.radius_km, rtol=0.0, atol=1e-6 * metre)
    assert cap.contains(rim.lon, rim.lat).all()
    for further, inside in ((1e-3 * metre, False), (-1e-3 * metre, True)):
        lon, lat, _ = geod_of(cap).fwd(rim.lon, rim.lat, np.asarray(back) + 180.0, np.full(u.size, further))
        assert (cap.contains(lon, lat) == inside).all()
    if cap.figure.is_sphere:  # the chart is azimuth and distance
        near = cap.chart(np.zeros(u.size, dtype=int), u, 0.3 * np.full(u.size, cap.angle))
        lon, lat, _ = geod_of(cap).fwd(*start, u, np.full(u.size, 300.0 * cap.radius_km))
        np.testing.assert_allclose(np.mod(near.lon - lon + 180, 360) - 180, 0.0, atol=1e-12)
        np.testing.assert_allclose(near.lat, lat, atol=1e-12)


def test_contains_broadcasts():
    """Longitudes and latitudes broadcast together, and a single point is a single answer."""
    assert Box(-10, 35, 40, 70).contains([[0], [50]], [40, 50, 80]).tolist() == [[True, True, False], [False] * 3]
    assert bool(GLOBE.contains(0, 90))
    assert Cap(0, 90, 1000).contains(123.0, 90.0).shape == ()


@each("region", [*REGIONS.values(), *TURNED])
def test_frame_of_the_chart(region):
    """The chart's points lie in the region; its velocities are those of the unit vector, by finite differences."""
    rng, (number, rectangles) = np.random.default_rng(5), region.panels()
    index = rng.integers(len(number), size=300)
    patch, (u0, u1, v0, v1) = number[index], rectangles[index].T
    u, v = u0 + (u1 - u0) * rng.uniform(0.001, 0.999, 300), v0 + (v1 - v0) * rng.uniform(0.001, 0.999, 300)
    points = region.chart(patch, u, v)
    assert region.contains(points.lon, points.lat).all()
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


@each("region", [*REGIONS.values(), *TURNED])
def test_panels_cover_the_region(region):
    """The area under the chart, panel by panel, is that of the region: nothing is missing, nothing double."""
    number, rectangles = region.panels()
    x, w = np.polynomial.legendre.leggauss(40)
    total = 0.0
    for patch, (u0, u1, v0, v1) in zip(number, rectangles, strict=True):
        u, v = np.broadcast_arrays((u0 + u1) / 2 + (u1 - u0) / 2 * x[:, None], (v0 + v1) / 2 + (v1 - v0) / 2 * x)
        points = region.chart(np.array(patch), u, v)
        meridian, vertical = region.figure.radii(points.lat)
        density = np.abs(points.east_u * points.north_v - points.east_v * points.north_u) * meridian * vertical
        total += np.sum(w[:, None] * w * density) * (u1 - u0) * (v1 - v0) / 4
    assert total / 1e6 == pytest.approx(region.area_km2, rel=1e-11)


# ---- texts ----------------------------------------------------------------------------------
TEXTS = {
    **dict.fromkeys(("globe", " Globe ", "box:-180,-90,180,90"), GLOBE),
    **{"box:-10,35,40,70": Box(-10, 35, 40, 70), "BOX: -10, 35.5, 4e1, 70": Box(-10, 35.5, 40, 70)},
    **{"box:170,-20,-170,20": Box(170, -20, -170, 20), "cap:20,50,3000": Cap(20, 50, 3000)},
    **{"Cap:-175,-90,20015": Cap(-175, -90, 20015)},
    "box:-122.4194155,37.7749295,-122.3,37.9": Box(-122.4194155, 37.7749295, -122.3, 37.9),
    "cap:2.3522219,48.856614,1234.5678": Cap(2.3522219, 48.856614, 1234.5678),
}


@each("text", TEXTS)
def test_texts(text):
    """A text names a region, with blanks and capitals as they come; in the name no digit is lost."""
    assert get_region(text) == get_region(get_region(text).name) == TEXTS[text]


@each("region", REGIONS.values())
def test_regions_are_values(region):
    """A region stands for itself and is frozen; its name is a text for it, that gives an equal one of the same hash."""
    again = get_region(region.name, getattr(region, "ellipsoid", None))
    assert get_region(region) is region
    assert (again, hash(again)) == (region, hash(region))
    with pytest.raises(AttributeError, match="cannot assign"):
        region.name = "other"


def test_name_of_the_globe():
    """A box that is the whole sphere is called globe, wherever it begins."""
    boxes = [Box(-180, -90, 180, 90), Box(0, -90, 360, 90), Box(-180, -90, 180, 89)]
    assert [(box.is_globe, box.name == "globe") for box in boxes] == [(True, True), (True, True), (False, False)]


FORMS = (
    "It must be globe, land, ocean, box:W,S,E,N, cap:LON,LAT,KM, country:NAME, continent:NAME, area:NAME, state:NAME "
    "(or the NAME alone), polygon:LON,LAT,..., crs:CODE, file:PATH, geodesic:PATH or points:PATH, or a combination of "
    "these by &, - and +."
)
FEW = ("box", "box:", "box:1,2,3", "box:1,2,3,4,5", "box:1,2,3,north")
CENTRE = "Its centre must be a longitude within -360 and 360, a latitude within -90 and 90."
TOO_WIDE = ("10,40,10,50", "-200,40,200,50", "350,0,-350,10")
NO_BOX = "South must be below north, both within -90 and 90."
# Latitudes before longitudes, north before south, or both: the box that is one is asked for.
MEANT = {
    **{"0,50,10,40": "0,40,10,50", "0,40,10,91": "40,0,91,10", "0,-91,10,40": "-91,0,40,10"},
    **{"35,100,70,150": "100,35,150,70", "35,-120,70,-10": "-120,35,-10,70", "30,70,-10,35": "-10,35,30,70"},
}
WRONG = {
    "": f"Invalid region ''. {FORMS}",
    "europa": f"Invalid region 'europa'. Did you mean continent:Europe? {FORMS}",
    "disc:1,2,3": f"Invalid region 'disc:1,2,3'. {FORMS}",
    "-10,35,40,70": f"Invalid region '-10,35,40,70'. {FORMS}",
    **{f"cap:{at},100": f"Invalid cap '{at},100'. {CENTRE}" for at in ("0,91", "400,0", "nan,0", "0,nan")},
    **{text: f"Invalid region '{text}'. It must be box:W,S,E,N, 4 numbers." for text in FEW},
    "CAP:1,2": "Invalid region 'CAP:1,2'. It must be cap:LON,LAT,KM, 3 numbers.",
    "box:nan,40,10,50": "Invalid box 'nan,40,10,50'. West, south, east and north must be finite numbers of degrees.",
    "box:0,40,inf,50": "Invalid box '0,40,inf,50'. West, south, east and north must be finite numbers of degrees.",
    "box:-400,40,0,50": "Invalid box '-400,40,0,50'. West and east must lie within -360 and 360.",
    "box:0,40,361,50": "Invalid box '0,40,361,50'. West and east must lie within -360 and 360.",
    **{f"box:{box}": f"Invalid box '{box}'. It must be wider than 0 and at most 360 degrees." for box in TOO_WIDE},
    **{f"box:{box}": f"Invalid box '{box}'. Did you mean {meant}? {NO_BOX}" for box, meant in MEANT.items()},
    **{f"box:{box}": f"Invalid box '{box}'. {NO_BOX}" for box in ("0,40,10,40", "0,50,10,500")},
}
WRONG |= {
    f"cap:0,0,{radius}": f"Invalid cap '0,0,{radius}'. Its radius must be above 0 and at most 20015 km, "
    "half the Earth's circumference."
    for radius in ("0", "-5", "20016", "nan", "inf")
}


@each("text", WRONG)
def test_wrong_texts(text):
    assert refused(text) == WRONG[text]


def test_points():
    """Points round the Earth have all longitudes, others the narrowest range, across the antimeridian, too."""
    ring = PointSet(np.arange(-180.0, 180.0, 5.0), np.full(72, 10.0), np.ones(72))
    west, south, east, north = ring.bounds
    assert east - west == pytest.approx(360.0)
    assert south < 10.0 < north
    assert ring.contains([0.0, 179.0, 0.0], [10.0, 10.0, 60.0]).tolist() == [True, True, False]
    some = PointSet(np.array([170.0, -170.0]), np.array([89.9, 80.0]), np.ones(2))
    assert some.bounds == pytest.approx((169.0, 79.0, 191.0, 90.0))
    assert some.contains([180.0, -175.0, 160.0, 190.0], [85.0, 85.0, 85.0, 70.0]).tolist() == [True, True, False, False]
    # Lists are taken as arrays are: on the sphere Mercator's scale is 1 / cos(lat) at each of the points.
    points = PointSet([0.0, 1.0], [0.0, 60.0], [1.0, 1.0])
    assert summarize("mercator", points, measures=["k"]).measures["k"].mean == pytest.approx(1.5, rel=1e-9)
    # What asks a region for its area, its edges or its far parts need not know that it is of points.
    assert (points.area_km2, points.edges.shape, points.far) == (0.0, (0, 4), "")


# ---- the rotated globe ----------------------------------------------------------------------------
@each("region", TURNED)
def test_places_of_the_chart(region):
    """Points lie at their distance from the pole, those of meridian 0 towards the south; it is all of the globe."""
    v = np.array([80.0, 45.0, -30.0])
    points = region.chart(np.zeros(3, dtype=int), np.array([12.0, 100.0, -150.0]), v)
    cosine = unit(region.lon, region.lat) @ unit(points.lon, points.lat)
    np.testing.assert_allclose(cosine, np.sin(np.radians(v)), atol=1e-14)
    south = region.chart(np.zeros(1, dtype=int), np.zeros(1), np.array([89.0]))
    assert south.lat[0] == pytest.approx(region.lat - 1.0, abs=1e-9)
    assert math.cos(math.radians(south.lon[0] - region.lon)) == pytest.approx(1.0)
    assert (region.name, region.bounds, region.area_km2) == (GLOBE.name, GLOBE.bounds, GLOBE.area_km2)
    assert region.contains([0.0, 170.0], [90.0, -3.0]).all()


# ---- boxes about boxes ----------------------------------------------------------------------------
INTERVALS = st.lists(
    st.tuples(st.floats(-180.0, 180.0), st.floats(0.01, 360.0) | st.floats(0.01, 40.0)), min_size=1, max_size=8
)
ROUNDING = 1e-9  # of a degree, of sums up to 720


@each(("west", "east", "box"), [
    *(([5.0, 8.0], [6.0, 15.0], (5.0, 15.0)), ([177.0, -180.0], [180.0, -178.0], (177.0, -178.0))),
    *(([-180.0, 177.0], [-178.0, 180.0], (177.0, -178.0)), ([170.0, -10.0], [190.0, 0.0], (170.0, 0.0))),
    *(([-180.0], [180.0], (-180.0, 180.0)), ([-170.0, -60.0, 60.0], [-50.0, 70.0, 175.0], (-170.0, 175.0))),
    ([10.0], [10.0], (9.995, 10.005)),
])  # fmt: skip
def test_known_boxes(west: list[float], east: list[float], box: tuple[float, float]) -> None:
    """The narrowest interval of longitudes, across the antimeridian or not; a point gets a hundredth of a degree."""
    south, north = np.full(len(west), -20.0), np.full(len(west), -15.0)
    assert bounding_box(west, south, east, north).bounds == pytest.approx(Box(box[0], -20.0, box[1], -15.0).bounds)


@given(INTERVALS)
def test_the_narrowest_of_all(intervals: list[tuple[float, float]]) -> None:
    """Against every box that begins where one of the boxes does; each begins and ends within it."""
    west, width = np.array(intervals).T
    box = bounding_box(west, np.full(west.shape, 10.0), west + width, np.full(west.shape, 20.0))
    reaches = [np.max((west - start) % 360.0 + width) for start in west]
    span = (box.east - box.west) % 360.0 or 360.0
    assert span == pytest.approx(min(360.0, *reaches, 360.0), abs=ROUNDING)
    assert (box.south, box.north) == (10.0, 20.0)
    begins = (west - box.west + ROUNDING) % 360.0 - ROUNDING
    assert np.all(begins + width <= span + 2.0 * ROUNDING) or span == 360.0
