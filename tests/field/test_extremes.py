"""Extremes of measures over regions against closed forms, with their places."""

import math

import numpy as np
import pyproj
import pytest
from jacobians import arc_distance
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


def sec(degrees):
    return 1 / math.cos(math.radians(degrees))


def polygon(*corners):
    return {"type": "Polygon", "coordinates": [[*map(list, corners), list(corners[0])]]}


def transverse_mercator_scale(lon, lat, k_0=0.9996):
    """Its scale, lon degrees from the central meridian, on WGS 84: the series of Snyder 1987, 8-11.

    The next term is of the order of A^8: 1e-10 three degrees off.
    """
    phi, e2 = math.radians(lat), WGS84.f * (2 - WGS84.f)
    second = e2 / (1 - e2)
    T, C, A = math.tan(phi) ** 2, second * math.cos(phi) ** 2, math.radians(lon) * math.cos(phi)
    fourth = (5 - 4 * T + 42 * C + 13 * C**2 - 28 * second) * A**4 / 24
    return k_0 * (1 + (1 + C) * A**2 / 2 + fourth + (61 - 148 * T + 16 * T**2) * A**6 / 720)


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


SQUARES = [[-30, -30], [30, -30], [30, 30], [-30, 30], [-30, -30]], [[-10, -10], [-10, 10], [10, 10], [10, -10]]
HOLE = {"type": "Polygon", "coordinates": [SQUARES[0], [*SQUARES[1], SQUARES[1][0]]]}
OVER_10_DEGREES = 1e6 * (1 - 0.9 * 2 / (1 + math.cos(math.radians(10))))
SHEAR = math.radians(30) * math.sin(math.radians(60))
ANGLE = 3000e3 / R
TOO_LARGE = {
    (0.9996, "box:-2.413,-60.23,2.413,-15.62"): (2.413, -15.62),
    (0.9996, "box:-2.31,-60,2.31,60"): (2.31, 0),
    (0.9996, "box:-2.336,4.34,2.336,64.08"): (2.336, 4.34),
    (0.9996, "box:-3.017,39.69,3.017,80"): (3.017, 39.69),
    (0.99992365, "box:-1,-80,1,80"): (1, 0),
}


# Map, region, measure, truth, relative and absolute error; and the place, None where it is not known, to some degrees.
MAXIMA = [
    # The sinusoidal map shears most at the corner of a box farthest from its centre; longitudes come within 180.
    *(
        (
            f"+proj=sinu +lon_0={west} +R={R}",
            f"box:{west},10,{west + 30},60",
            *("omega", math.degrees(2 * math.atan(SHEAR / 2)), 1e-9, 0.0, (lon, 60), 1e-6),
        )
        for west, lon in ((0, 30), (170, -160), (-200, -170))
    ),
    # A side where the scale is too large counts more than the central meridian, all of it nearly as much too small.
    *(
        (
            f"+proj=tmerc +k_0={k_0} +ellps=WGS84",
            region,
            *("scale_error_ppm", 1e6 * (transverse_mercator_scale(*place, k_0) - 1), 0.0, 1e-3, place, 0.01),
        )
        for (k_0, region), place in TOO_LARGE.items()
    ),
    # Mercator's scale at the northern vertex of a triangle; the panels around it go farther north.
    (f"+proj=merc +R={R}", polygon((0, 10), (40, 20), (15, 57)), "k", sec(57), 1e-9, 0.0, (15, 57), 1e-9),
    # A stereographic map with k_0 = 0.9 is most too small at its centre; beside it, on a polygon's nearest edge.
    (
        *(f"+proj=stere +k_0=0.9 +R={R}", polygon((10, -20), (25, 3), (10, 30)), "scale_error_ppm"),
        *(OVER_10_DEGREES, 1e-9, 0.0, (10, 0), 1e-3),
    ),
    # Nothing is read off nodes in a hole: round the centre of an azimuthal map the smallest scale is left out.
    (f"+proj=stere +k_0=0.9 +R={R}", HOLE, "scale_error_ppm", OVER_10_DEGREES, 1e-9, 0.0, (None, None), 0.0),
    # Between the edges of a polygon, as in a box.
    (
        *(f"+proj=stere +k_0=0.5 +lon_0=5 +lat_0=5 +R={R}", polygon((0, 0), (12, 1), (8, 11))),
        *("scale_error_ppm", 5e5, 1e-12, 0.0, (5, 5), 1e-4),
    ),
    # Up to 89 degrees Mercator's scale is 57, not infinity.
    ("mercator", "box:-180,-89,180,89", "k", sec(89), 1e-9, 0.0, (None, 89), 1e-9),
    # The shear of the sinusoidal map is pi sin(latitude): a bound that no sample reaches; at 89.9 degrees 1.5e-6 less.
    ("sinusoidal", "globe", "omega", math.degrees(2 * math.atan(math.pi / 2)), 1e-5, 0.0, (180, 90), 0.1),
    # The flexion of Mercator's map is 2 / pi tan(latitude).
    ("mercator", "box:0,10,30,60", "flexion", 2 / math.pi * math.sqrt(3), 1e-6, 0.0, (None, 60), 1e-4),
    # Of a box that reaches beyond the horizon only the part on this side counts: b is cos c, and c is nearly 45.
    pytest.param(
        *(f"+proj=ortho +R={R}", "box:45,-30,135,30", "b", math.sqrt(0.5), 1e-9, 0.0, (45, 0), 1e-3),
        marks=pytest.mark.slow,
    ),
    # What is nothing but rounding is small: omega of a conformal map, the areal error of an equal-area one.
    ("mercator", "box:-10,35,40,70", "omega", 0.0, 0.0, 1e-6, (None, None), 0.0),
    (f"+proj=cea +R={R}", "box:-10,35,40,70", "areal_error_ppm", 0.0, 0.0, 1e-3, (None, None), 0.0),
    (
        *(f"+proj=stere +k_0=0.99 +lon_0=5 +lat_0=5 +R={R}", polygon((-20, -10), (30, -20), (8, 40))),
        *("omega", 0.0, 0.0, 1e-6, (None, None), 0.0),
    ),
]


@each(("projection", "region", "measure", "truth", "relative", "absolute", "place", "near"), MAXIMA)
def test_maxima(projection, region, measure, truth, relative, absolute, place, near):
    """The largest values and their places are those of closed forms; symmetric maps have them on either side."""
    found = maximum(projection, region, measure)
    assert found.value == pytest.approx(truth, rel=relative, abs=absolute)
    for k, (here, there) in enumerate(zip((found.lon, found.lat), place, strict=True)):
        is_symmetric = region in ("box:-180,-89,180,89", "globe") or ("tmerc" in projection and k == 0)
        assert there is None or (abs(here) if is_symmetric else here) == pytest.approx(there, abs=near)


def test_side_of_a_zone():
    """In UTM's zone the scale is largest where its edge meets the equator: 1.000981 (Snyder 1987, 8-11)."""
    found = maximum("EPSG:32631", "box:0,0,6,84", "k")
    assert found.value == pytest.approx(transverse_mercator_scale(3, 0), abs=1e-9)
    assert abs(found.lon - 3) == pytest.approx(3, abs=1e-6)
    assert found.lat == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize("centre", [(0, 90), (20, -35), (179, 10)], ids=["pole", "oblique", "antimeridian"])
def test_rim_of_a_cap(centre):
    """Azimuthal equidistant maps stretch most on the rim of a cap: a = c / sin c."""
    found = maximum(
        f"+proj=aeqd +lon_0={centre[0]} +lat_0={centre[1]} +R={R}", f"cap:{centre[0]},{centre[1]},3000", "a"
    )
    assert found.value == pytest.approx(ANGLE / math.sin(ANGLE), rel=1e-9)
    assert float(arc_distance(found.lon, found.lat, *centre)) == pytest.approx(ANGLE, abs=1e-7)


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
        ("mercator", "flexion"),  # 2 / pi tan(latitude)
    ],
)
def test_unbounded(projection, measure):
    """A measure that grows without bound towards the poles has the maximum infinity, near a pole."""
    found = maximum(projection, "globe", measure)
    assert found.value == math.inf
    assert abs(found.lat) > 85


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


def test_undefined():
    """A measure that is undefined everywhere has no maximum and no place, and no warning."""

    def nothing(J):
        return np.full(J.shape[:-2], np.nan)

    found = maximum("mercator", "box:0,0,10,10", nothing)
    assert isinstance(found, Extreme)
    assert np.isnan(found).all()


def test_measure_at():
    """Measures at points: s of Mercator's map is 1 / cos^2, its flexion 2 / pi tan in units per radian."""
    lon, lat = np.array([0.0, 50.0]), np.array([60.0, -45.0])
    mercator = Projection.from_user_input("mercator")
    np.testing.assert_allclose(measure_at(mercator, get_measure("s"), lon, lat), [4.0, 2.0], rtol=1e-11)
    flexion = measure_at(mercator, get_measure("flexion"), lon, lat)
    np.testing.assert_allclose(flexion, 2 / math.pi * np.array([math.sqrt(3), 1.0]), rtol=1e-7)


# ---- minima -----------------------------------------------------------------------------------


NEAREST = 2 / (1 + math.cos(math.radians(10)) * math.cos(math.radians(5)))


@each(
    ("projection", "region", "measure", "value", "place", "near"),
    [
        # k = 1 / cos(lat), least on the southern side of the box.
        ("mercator", "box:0,30,10,60", "k", sec(30), (None, 30), 2e-3),
        # Snyder's stereographic k = 2 / (1 + cos c), 1 at the centre, which is in the polygon's interior.
        ("+proj=stere +lat_0=47 +lon_0=8 +R=6371000", "country:CH", "a", 1.0, (8, 47), 2e-3),
        # s of the gnomonic map is 1 / cos^3 c.
        ("+proj=gnom +lat_0=47 +lon_0=8 +R=6371000", "country:CH", "s", 1.0, (8, 47), 2e-3),
        # On a triangle away from the centre at the vertex nearest to it.
        ("+proj=stere +R=6371000", polygon((10, 5), (30, 8), (20, 30)), "a", NEAREST, (10, 5), 1e-5),
    ],
)
def test_minima(projection, region, measure, value, place, near):
    """The smallest value and its place, inside and at an edge, against closed forms."""
    found = summarize(projection, region, measures=[measure]).measures[measure]
    assert found.min == pytest.approx(value, rel=1e-9)
    for got, expected in zip(found.min_at, place, strict=True):
        assert expected is None or got == pytest.approx(expected, abs=near)  # a smooth minimum is flat


def test_unbounded_below():
    """ln(ab) of a map that shrinks to nothing falls without bound; what is no less than 0 does not."""
    found = summarize(lambda lon, lat: (1e5 * lon**3, 1e5 * lat), Box(0.0, 0.0, 20.0, 20.0), measures=["ln(ab)", "s"])
    assert found.measures["ln(ab)"].min == -math.inf
    assert found.measures["s"].min >= 0.0


LAEA = "+proj=laea +lat_0=3.7 +lon_0=100"
ARCHIPELAGOS = [("country:MV", "merc"), ("country:PW", LAEA), ("country:MH", "merc")]
OTHERS = [("country:MV", LAEA), ("country:PW", "merc"), ("country:MH", LAEA)]


@each(("region", "projection"), [*ARCHIPELAGOS, *(pytest.param(*pair, marks=pytest.mark.slow) for pair in OTHERS)])
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
