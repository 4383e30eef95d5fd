"""Extremes of measures over regions against closed forms, with their places."""

import math

import numpy as np
import pyproj
import pytest
from scipy.special import erf
from tables import each

from projdist.answers.summaries import summarize
from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS, WGS84
from projdist.field.at_points import jacobian, measure_at
from projdist.field.extremes import Extreme
from projdist.field.sampling import field_resolving
from projdist.matrices.measures import get_measure
from projdist.projections import Projection
from projdist.regions import Box, get_region, region_for

R = MEAN_EARTH_RADIUS


def maximum(projection, region, measure):
    """The maximum as `summarize` finds it."""
    projection, region, measure = Projection.from_user_input(projection), region, get_measure(measure)
    region = region_for(region, [projection])
    samples = field_resolving(
        projection, region, tolerance=1e-6, second_order=[measure] if measure.needs_hessian else []
    )
    return samples.maximum(measure)


# ---- on the edge ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("west", "lon"), [(0, 30), (170, -160), (-200, -170)], ids=["plain", "antimeridian", "beyond the antimeridian"]
)
def test_corner(west, lon):
    """The sinusoidal map shears most at the corner of a box farthest from its centre; longitudes come within 180."""
    found = maximum(f"+proj=sinu +lon_0={west} +R={R}", f"box:{west},10,{west + 30},60", "omega")
    shear = math.radians(30) * math.sin(math.radians(60))
    assert found.value == pytest.approx(math.degrees(2 * math.atan(shear / 2)), rel=1e-9)
    assert (found.lon, found.lat) == pytest.approx((lon, 60), abs=1e-6)


@pytest.mark.parametrize("centre", [(0, 90), (20, -35), (179, 10)], ids=["pole", "oblique", "antimeridian"])
def test_rim_of_a_cap(centre):
    """Azimuthal equidistant maps stretch most on the rim of a cap: a = c / sin c."""
    angle = 3000e3 / R
    lon, lat = centre
    found = maximum(f"+proj=aeqd +lon_0={lon} +lat_0={lat} +R={R}", f"cap:{lon},{lat},3000", "a")
    assert found.value == pytest.approx(angle / math.sin(angle), rel=1e-9)
    phi, phi_0, dlam = math.radians(found.lat), math.radians(lat), math.radians(found.lon - lon)
    cos = math.sin(phi) * math.sin(phi_0) + math.cos(phi) * math.cos(phi_0) * math.cos(dlam)
    assert math.acos(cos) == pytest.approx(angle, abs=1e-7)


def transverse_mercator_scale(lon, lat, k_0=0.9996):
    """Its scale, lon degrees from the central meridian, on WGS 84: the series of Snyder 1987, 8-11.

    The next term is of the order of A^8: 1e-10 three degrees off.
    """
    phi, e2 = math.radians(lat), WGS84.f * (2 - WGS84.f)
    second = e2 / (1 - e2)
    T, C, A = math.tan(phi) ** 2, second * math.cos(phi) ** 2, math.radians(lon) * math.cos(phi)
    fourth = (5 - 4 * T + 42 * C + 13 * C**2 - 28 * second) * A**4 / 24
    return k_0 * (1 + (1 + C) * A**2 / 2 + fourth + (61 - 148 * T + 16 * T**2) * A**6 / 720)


def test_side_of_a_zone():
    """In UTM's zone the scale is largest where its edge meets the equator: 1.000981 (Snyder 1987, 8-11)."""
    found = maximum("EPSG:32631", "box:0,0,6,84", "k")
    assert found.value == pytest.approx(transverse_mercator_scale(3, 0), abs=1e-9)
    assert abs(found.lon - 3) == pytest.approx(3, abs=1e-6)
    assert found.lat == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize(
    ("k_0", "region", "lon", "lat"),
    [
        (0.9996, "box:-2.413,-60.23,2.413,-15.62", 2.413, -15.62),
        (0.9996, "box:-2.31,-60,2.31,60", 2.31, 0),
        (0.9996, "box:-2.336,4.34,2.336,64.08", 2.336, 4.34),
        (0.9996, "box:-3.017,39.69,3.017,80", 3.017, 39.69),
        (0.99992365, "box:-1,-80,1,80", 1, 0),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_sides_against_the_middle(k_0, region, lon, lat):
    """A side where the scale is too large counts more than the central meridian, all of it nearly as much too small."""
    found = maximum(f"+proj=tmerc +k_0={k_0} +ellps=WGS84", region, "scale_error_ppm")
    assert found.value == pytest.approx(1e6 * (transverse_mercator_scale(lon, lat, k_0) - 1), abs=1e-3)
    assert (abs(found.lon), found.lat) == pytest.approx((lon, lat), abs=0.01)


def test_side_against_between_parallels():
    """Albers's map between close parallels on the ellipsoid: the side beyond them, not the middle, errs most."""
    first, second, south, north = -46.632, -45.022, -46.974, -44.82
    found = maximum(f"+proj=aea +lat_1={first} +lat_2={second} +ellps=WGS84", f"box:-20,{south},11,{north}", "a")
    e = math.sqrt(WGS84.f * (2 - WGS84.f))

    def m2_and_q(lat):
        sine = math.sin(math.radians(lat))
        w = 1 - (e * sine) ** 2
        q = (1 - e * e) * (sine / w + math.atanh(e * sine) / e)
        return math.cos(math.radians(lat)) ** 2 / w, q

    (m1, q1), (m2, q2) = m2_and_q(first), m2_and_q(second)
    n = (m1 - m2) / (q2 - q1)  # Snyder 1987, 14-14 to 14-16
    C = m1 + n * q1

    def k(lat):
        m, q = m2_and_q(lat)
        return math.sqrt((C - n * q) / m)

    # An equal-area map has a = max(k, 1 / k).
    expected = max(max(k(lat), 1 / k(lat)) for lat in np.linspace(south, north, 2001))
    assert expected == k(south)
    assert found.value == pytest.approx(expected, abs=1e-10)


def polygon(*corners):
    return {"type": "Polygon", "coordinates": [[*corners, corners[0]]]}


def test_vertex_of_a_polygon():
    """Mercator's scale is largest at the northern vertex of a triangle; the panels around it go farther north."""
    found = maximum(f"+proj=merc +R={R}", polygon((0, 10), (40, 20), (15, 57)), "k")
    assert found.value == pytest.approx(1 / math.cos(math.radians(57)), rel=1e-9)
    assert (found.lon, found.lat) == pytest.approx((15, 57), abs=1e-9)


def test_edge_of_a_polygon():
    """A stereographic map with k_0 = 0.9 is most too small at its centre; beside it, on a polygon's nearest edge."""
    found = maximum(f"+proj=stere +k_0=0.9 +R={R}", polygon((10, -20), (25, 3), (10, 30)), "scale_error_ppm")
    assert found.value == pytest.approx(1e6 * (1 - 0.9 * 2 / (1 + math.cos(math.radians(10)))), rel=1e-9)
    assert (found.lon, found.lat) == pytest.approx((10, 0), abs=1e-3)


def test_rim_of_a_hole():
    """Nothing is read off nodes in a hole: round the centre of an azimuthal map the smallest scale is left out."""
    region = {
        "type": "Polygon",
        "coordinates": [
            [[-30, -30], [30, -30], [30, 30], [-30, 30], [-30, -30]],
            [[-10, -10], [-10, 10], [10, 10], [10, -10], [-10, -10]],
        ],
    }
    found = maximum(f"+proj=stere +k_0=0.9 +R={R}", region, "scale_error_ppm")
    assert found.value == pytest.approx(1e6 * (1 - 0.9 * 2 / (1 + math.cos(math.radians(10)))), rel=1e-9)


def test_inside_a_polygon():
    """A maximum between the edges is found as in a box."""
    found = maximum(f"+proj=stere +k_0=0.99 +lon_0=5 +lat_0=5 +R={R}", polygon((-20, -10), (30, -20), (8, 40)), "omega")
    assert found.value < 1e-6
    found = maximum(
        f"+proj=stere +k_0=0.5 +lon_0=5 +lat_0=5 +R={R}", polygon((0, 0), (12, 1), (8, 11)), "scale_error_ppm"
    )
    assert found.value == pytest.approx(5e5, rel=1e-12)
    assert (found.lon, found.lat) == pytest.approx((5, 5), abs=1e-4)


@pytest.mark.parametrize("code", ["CA", "FJ"])
def test_maximum_of_a_country(code):
    """The largest scale of Mercator's map in a country is at its vertex farthest from the equator."""
    region = get_region(f"country:{code}")
    lat = np.abs(region.edges[:, 1]).max()
    assert maximum(f"+proj=merc +R={R}", region, "k").value == pytest.approx(1 / math.cos(math.radians(lat)), rel=1e-8)


@pytest.mark.slow
def test_vertices_of_many_islands_compete():
    """Where islands have nearly the same distortion, no vertex has more than the largest, by PROJ's factors."""
    definition = "+proj=aea +ellps=WGS84 +lat_0=49 +lon_0=-112 +lat_1=29.8031 +lat_2=67.2169"
    region = get_region("country:US")
    at_vertices = pyproj.Proj(definition).get_factors(region.edges[:, 0], region.edges[:, 1])
    found = summarize(definition, region, measures=["omega", "a"]).measures
    # PROJ's factors are good to 1e-8; between the vertices of a degree and less there is hardly more.
    assert found["omega"].max == pytest.approx(at_vertices.angular_distortion.max(), rel=1e-6)
    assert found["a"].max == pytest.approx(at_vertices.tissot_semimajor.max(), rel=1e-6)


# ---- inside -----------------------------------------------------------------------------------


def test_between_the_standard_parallels():
    """Lambert's conformal map of the sphere is most too small where sin(latitude) = n."""
    p1, p2 = math.radians(33), math.radians(45)
    t = {phi: math.tan(math.pi / 4 - phi / 2) for phi in (p1, p2)}
    n = math.log(math.cos(p1) / math.cos(p2)) / math.log(t[p1] / t[p2])  # Snyder 1987, 15-3
    phi_0 = math.asin(n)
    k_0 = math.cos(p1) * (math.tan(math.pi / 4 - phi_0 / 2) / t[p1]) ** n / math.cos(phi_0)
    found = maximum(f"+proj=lcc +lat_1=33 +lat_2=45 +lon_0=-96 +R={R}", "box:-125,34,-65,44", "scale_error_ppm")
    assert found.value == pytest.approx(1e6 * (1 - k_0), abs=1e-4)
    # The maximum is flat: 1e-11 of the value is 1e-4 degrees.
    assert found.lat == pytest.approx(math.degrees(phi_0), abs=0.01)


@each("width", [0.5, 0.05, 0.01])
@each("lat", [-71.3, 0.2, 33.3])
def test_peaks_within(lat, width):
    """A cylindrical map that stretches by a fifth along a belt, some degrees or half a degree wide, peaks there."""
    centre = math.radians(lat)

    def belt(lon, lat):
        lam, phi = np.radians(lon), np.radians(lat)
        # dy / dphi = 1 + exp(-((phi - centre) / width)^2) / 5
        return R * lam, R * (phi + 0.1 * width * math.sqrt(math.pi) * erf((phi - centre) / width))

    found = maximum(belt, "globe", "h")
    assert found.value == pytest.approx(1.2, abs=1e-9)
    assert math.radians(found.lat) == pytest.approx(centre, abs=1e-4 * max(width, 0.1))


def test_nothing_to_find():
    """What is nothing but rounding is small: omega of a conformal map, the areal error of an equal-area one."""
    assert maximum("mercator", "box:-10,35,40,70", "omega").value < 1e-6
    assert maximum(f"+proj=cea +R={R}", "box:-10,35,40,70", "areal_error_ppm").value < 1e-3


# ---- at singular points -----------------------------------------------------------------------


@each(
    ("projection", "measure"),
    [
        ("plate-carree", "k"),
        ("plate-carree", "s"),
        ("mercator", "s"),
        ("mercator", "fisher"),
        ("mollweide", "a"),
        ("mollweide", "k"),
        ("mollweide", "fisher"),
        ("equal-earth", "a"),
    ],
)
def test_unbounded(projection, measure):
    """A measure that grows without bound towards the poles has the maximum infinity, near a pole."""
    found = maximum(projection, "globe", measure)
    assert found.value == math.inf
    assert abs(found.lat) > 85


def test_large_is_not_unbounded():
    """Up to 89 degrees Mercator's scale is 57, not infinity."""
    found = maximum("mercator", "box:-180,-89,180,89", "k")
    assert found.value == pytest.approx(1 / math.cos(math.radians(89)), rel=1e-9)
    assert abs(found.lat) == pytest.approx(89, abs=1e-9)


def test_bounded_at_a_singular_point():
    """The sinusoidal map shears most where the antimeridian meets a pole: a bound that no sample reaches."""
    found = maximum("sinusoidal", "globe", "omega")
    # The shear is pi sin(latitude): at 89.9 degrees 1.5e-6 less.
    assert found.value == pytest.approx(math.degrees(2 * math.atan(math.pi / 2)), rel=1e-5)
    assert abs(found.lon) == pytest.approx(180, abs=0.1)
    assert abs(found.lat) == pytest.approx(90, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    "projection",
    [
        "plate-carree",
        "robinson",
        pytest.param(
            "mollweide", marks=pytest.mark.xfail(strict=True, reason="PROJ's iteration ends at 89.997 degrees")
        ),
    ],
)
def test_the_limit_of_a_bounded_measure(projection):
    """Where a / b grows without bound omega comes to 180 degrees."""
    assert maximum(projection, "globe", "omega").value == pytest.approx(180, abs=0.5)


def test_unbounded_second_derivatives():
    """The flexion of Mercator's map, 2 / pi tan(latitude), has no bound."""
    assert maximum("mercator", "globe", "flexion").value == math.inf


def test_second_derivatives():
    """On a box the flexion of Mercator's map is 2 / pi tan(latitude), largest on the northern side."""
    found = maximum("mercator", "box:0,10,30,60", "flexion")
    assert found.value == pytest.approx(2 / math.pi * math.tan(math.radians(60)), rel=1e-6)
    assert found.lat == pytest.approx(60, abs=1e-4)


def test_undefined():
    """A measure that is undefined everywhere has no maximum and no place, and no warning."""

    def nothing(J):
        return np.full(J.shape[:-2], np.nan)

    found = maximum("mercator", "box:0,0,10,10", nothing)
    assert isinstance(found, Extreme)
    assert np.isnan(found).all()


@pytest.mark.slow
def test_only_what_is_mapped():
    """Of a box that reaches beyond the horizon only the part on this side counts: b is cos c, and c is nearly 45."""
    found = maximum(f"+proj=ortho +R={R}", "box:45,-30,135,30", "b")
    assert found.value == pytest.approx(math.cos(math.radians(45)), rel=1e-9)
    assert (found.lon, found.lat) == pytest.approx((45, 0), abs=1e-3)


def test_measure_at():
    """Measures at points: s of Mercator's map is 1 / cos^2, its flexion 2 / pi tan in units per radian."""
    lon, lat = np.array([0.0, 50.0]), np.array([60.0, -45.0])
    mercator = Projection.from_user_input("mercator")
    np.testing.assert_allclose(measure_at(mercator, get_measure("s"), lon, lat), [4.0, 2.0], rtol=1e-11)
    flexion = measure_at(mercator, get_measure("flexion"), lon, lat)
    np.testing.assert_allclose(flexion, 2 / math.pi * np.array([math.sqrt(3), 1.0]), rtol=1e-7)


# ---- minima -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("projection", "region", "measure", "value", "place"),
    [
        # k = 1 / cos(lat), least on the southern side of the box.
        ("mercator", "box:0,30,10,60", "k", 1.0 / math.cos(math.radians(30.0)), (None, 30.0)),
        # Snyder's stereographic k = 2 / (1 + cos c), 1 at the centre, which is in the polygon's interior.
        ("+proj=stere +lat_0=47 +lon_0=8 +R=6371000", "country:CH", "a", 1.0, (8.0, 47.0)),
        # s of the gnomonic map is 1 / cos^3 c.
        ("+proj=gnom +lat_0=47 +lon_0=8 +R=6371000", "country:CH", "s", 1.0, (8.0, 47.0)),
    ],
)
def test_minima(projection, region, measure, value, place):
    """The smallest value and its place, inside and at an edge, against closed forms."""
    found = summarize(projection, region, measures=[measure]).measures[measure]
    assert found.min == pytest.approx(value, rel=1e-9)
    for got, expected in zip(found.min_at, place, strict=True):
        assert expected is None or got == pytest.approx(expected, abs=2e-3)  # a smooth minimum is flat


def test_minimum_at_a_vertex():
    """On a triangle away from the centre of an azimuthal map the least scale is at the vertex nearest to it."""
    triangle = {"type": "Polygon", "coordinates": [[[10, 5], [30, 8], [20, 30], [10, 5]]]}
    found = summarize("+proj=stere +R=6371000", triangle, measures=["a"]).measures["a"]
    cosine = math.cos(math.radians(10)) * math.cos(math.radians(5))
    assert found.min == pytest.approx(2.0 / (1.0 + cosine), rel=1e-9)
    assert found.min_at == pytest.approx((10.0, 5.0), abs=1e-5)


def test_unbounded_below():
    """ln(ab) of a map that shrinks to nothing falls without bound; what is no less than 0 does not."""
    found = summarize(lambda lon, lat: (1e5 * lon**3, 1e5 * lat), Box(0.0, 0.0, 20.0, 20.0), measures=["ln(ab)", "s"])
    assert found.measures["ln(ab)"].min == -math.inf
    assert found.measures["s"].min >= 0.0


@each("region", ["country:MV", "country:PW", "country:MH"])
@each("projection", ["merc", "+proj=laea +lat_0=3.7 +lon_0=100"])
def test_islands_between_the_nodes(region, projection):
    """The extremes of scales that grow to one side are on a coast, also where no node falls on an island."""
    place = get_region(region)
    lon, lat = place.edges[:, 0], place.edges[:, 1]
    J = jacobian(projection, lon, lat)
    found = summarize(projection, place, measures=["a", "b"], tolerance=1e-6)
    for name, extreme in (("a", np.max), ("b", np.min)):
        spread = found.measures[name]
        value, where = (spread.max, spread.max_at) if name == "a" else (spread.min, spread.min_at)
        assert value == pytest.approx(float(extreme(get_measure(name)(J))), rel=1e-9)
        assert place.contains(*where)
