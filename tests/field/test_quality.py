"""The flags of a Jacobian, at poles and seams."""

import math

import numpy as np
import pytest
from jacobians import ACCURACY, FORMS, UNDEFINED, R, make, matrices, polar_stereographic, random_points, value
from numpy.polynomial.polynomial import polyder, polyval2d as polyval
from tables import each

from projdist.earth.ellipsoid import WGS84
from projdist.field.at_points import Quality, derivatives, jacobian
from projdist.matrices.measures import principal_scales

# Goode's interrupted map: seams, the central meridians west and east of each (Snyder 1987, page 250).
GOODE = [(-40.0, 30.0, -100.0, 30.0), (-100.0, -30.0, -160.0, -60.0)]
GOODE += [(-20.0, -30.0, -60.0, 20.0), (80.0, -30.0, 20.0, 140.0)]
CONES, SHARP = (0.5, 0.9, 0.999), (Quality.SINGULAR, Quality.SEAM)
REASON = "PROJ's q_p - q cancels near the pole, in steps that differences miss"
NOISY = pytest.param("laea", marks=pytest.mark.xfail(strict=True, reason=REASON))


@each("shape", [(), (1,), (5,), (2, 3), (2, 1, 4), (0,), (0, 3)])
def test_shapes(shape):
    result = derivatives(make("robin"), np.full(shape, 12.0), 47.0)
    assert {array.shape for array in (result.x, result.y, result.quality, result.error)} == {shape}
    assert result.jacobian.shape == (*shape, 2, 2)


def test_lon_and_lat_broadcast():
    """A row of longitudes and a column of latitudes make a grid, each point the same as alone, x and y the map's."""
    projection = make("wintri")
    lon, lat = np.array([[-100.0, 0.0, 33.0]]), np.array([[-90.0], [10.0], [89.995]])
    grid = derivatives(projection, lon, lat)
    assert grid.jacobian.shape == (3, 3, 2, 2)
    np.testing.assert_array_equal((grid.x, grid.y), projection(*np.broadcast_arrays(lon, lat)))
    for i, j in np.ndindex(3, 3):
        one = derivatives(projection, lon[0, j], lat[i, 0])
        np.testing.assert_allclose(one.jacobian, grid.jacobian[i, j], rtol=1e-13, atol=1e-13)
        assert one.quality == grid.quality[i, j]


def test_points_do_not_influence_each_other():
    """A point has the same J alone and among 9,000 others, undefined ones too."""
    lon, lat = random_points(9_000)
    lon[::7], lat[::11] = np.nan, 91.0
    projection = make("gnom")
    together = derivatives(projection, lon, lat)
    some = np.arange(0, 9_000, 449)
    alone = derivatives(projection, lon[some], lat[some])
    # To rounding: numpy's vector loops treat the ends of an array apart.
    np.testing.assert_allclose(alone.jacobian, together.jacobian[some], rtol=1e-14)
    np.testing.assert_array_equal(alone.quality, together.quality[some])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["robin", "moll", "wintri", "laea", "igh"])
def test_hard_points_do_not_influence_each_other(name):
    """At poles, beside them and on seams a point has the same alone, where its steps are tried together, and in 900."""
    lon = np.tile(np.linspace(-180.0, 180.0, 60), 15)
    lat = np.repeat([-90, -89.9999, -89.995, -88, -86, -40, -1e-9, 0, 30, 60, 86, 89.9, 89.99, 89.9995, 90], 60)
    projection = make(name)
    together = derivatives(projection, lon, lat)
    for k in range(300):
        part = derivatives(projection, lon[k::300], lat[k::300])
        np.testing.assert_array_equal(part.quality, together.quality[k::300])
        gap = np.abs(part.jacobian - together.jacobian[k::300]).max(axis=(1, 2))
        size = np.abs(part.jacobian).max(axis=(1, 2))
        ends = np.isnan(size) & np.isnan(gap)
        assert (ends | (gap <= 1e-13 * size + part.error * size)).all()


def test_outside_is_nan():
    """Beyond the horizon, beyond the poles and at NaN: J is NaN, the quality OUTSIDE, x and y NaN."""
    result = derivatives(make("gnom"), [100.0, 180.0, np.nan, 0.0, 0.0, np.inf], [0.0, 0.0, 0.0, np.nan, 91.0, 0.0])
    assert (result.quality == Quality.OUTSIDE).all()
    assert all(np.isnan(array).all() for array in (result.x, result.y, result.jacobian, result.error))
    assert np.isnan(jacobian(make("ortho"), 120.0, 5.0)).all()
    assert [quality.label for quality in Quality] == ["ok", "one-sided", "rough", "seam", "singular", "outside"]


def test_exact_on_polynomials():
    """The stencils are exact, to rounding, on polynomials of longitude and latitude of degree 4 and less."""
    rng = np.random.default_rng(4)
    A, B = rng.normal(size=(2, 5, 5)) * (np.add.outer(range(5), range(5)) <= 4)
    A[1, 0] += 3.0
    B[0, 1] += 3.0

    def function(lon, lat):
        return tuple(R * polyval(np.radians(lon), np.radians(lat), C) for C in (A, B))

    lon, lat = rng.uniform(-60, 60, 1000), rng.uniform(-80, 80, 1000)
    lam, phi = np.radians(lon), np.radians(lat)
    (a, b), (c, d) = ([polyval(lam, phi, polyder(C, axis=k)) for k in (0, 1)] for C in (A, B))
    truth = matrices(a / np.cos(phi), b, c / np.cos(phi), d)
    J = jacobian(function, lon, lat)
    assert np.abs((J - truth) / np.linalg.norm(truth, axis=(1, 2), keepdims=True)).max() <= ACCURACY


@each("waves", [1, 10, 50, 200, 500])
def test_accuracy_on_waves(waves):
    """Maps with ripples down to 0.7 degrees are differentiated to 1e-10: the step follows the map."""

    def function(lon, lat):
        lam, phi = np.radians(lon), np.radians(lat)
        return R * (lam + 0.5 * np.sin(waves * phi) / waves), R * (phi + 0.5 * np.sin(waves * lam) / waves)

    lon, lat = random_points(2000, limit=85.0)
    result = derivatives(function, lon, lat)
    lam, phi = np.radians(lon), np.radians(lat)
    across, up = 0.5 * np.cos(waves * phi), 0.5 * np.cos(waves * lam) / np.cos(phi)
    truth = matrices(1 / np.cos(phi), across, up, 1.0)
    actual = np.abs(result.jacobian - truth).max(axis=(1, 2)) / np.linalg.norm(truth, axis=(1, 2))
    assert (result.quality == Quality.OK).all()
    assert actual.max() <= 1e-10
    # The error bar may be twenty times too small, no more: it is of two gaps, and one may vanish by chance.
    assert (actual <= 20 * result.error + ACCURACY).all()


@pytest.mark.parametrize("name", [NOISY if name == "laea" else name for name in FORMS])
def test_the_error_estimate_is_honest(name):
    """The error that is reported is not less than a tenth of the true one, above rounding, nor than 1e-15."""
    definition, form = FORMS[name]
    lon, lat = random_points(4000)
    result = derivatives(make(f"{definition} +ellps=WGS84"), lon, lat)
    h, k = form(WGS84, np.radians(lat))
    actual = np.hypot(value("h", result.jacobian) - h, value("k", result.jacobian) - k) / np.hypot(h, k)
    given = np.isfinite(actual)
    assert given.mean() > 0.99
    assert result.error.min() >= 1e-15
    assert (actual <= 10 * result.error + ACCURACY)[given].all(), (actual / result.error)[given].max()


POLE_LONGITUDES = np.array([-180.0, -77.0, 0.0, 30.0, 90.0, 180.0])
SEC_25, SEC_65 = (1 / math.cos(math.radians(angle)) for angle in (25, 65))
# The scale at the pole is 1 at the latitude of true scale, 71 degrees (EPSG:19992) and 70 (EPSG:19865).
SOUTH, NORTH = (1 / polar_stereographic(WGS84, math.radians(lat))[0] for lat in (71, 70))

# Maps that are smooth at the pole, and a and b there.
REGULAR_POLES = {
    "+proj=stere +lat_0=-90 +k_0=0.994 +ellps=WGS84": (-90, 0.994, 0.994),
    "+proj=aeqd +lat_0=-90 +ellps=WGS84": (-90, 1.0, 1.0),
    "+proj=stere +lat_0=40 +R=6371000": (90, SEC_25**2, SEC_25**2),
    "+proj=stere +lat_0=40 +lon_0=20 +R=6371000": (-90, SEC_65**2, SEC_65**2),
    "+proj=laea +lat_0=40 +lon_0=20 +R=6371000": (90, SEC_25, 1 / SEC_25),
    "+proj=aeqd +lat_0=40 +lon_0=20 +R=6371000": (90, math.radians(50) / math.sin(math.radians(50)), 1.0),
    "+proj=tmerc +R=6371000": (90, 1.0, 1.0),
    "+proj=tmerc +k_0=0.9996 +ellps=WGS84": (90, 0.9996, 0.9996),
    "+proj=utm +zone=32 +ellps=WGS84": (-90, 0.9996, 0.9996),
    "EPSG:3031": (-90, SOUTH, SOUTH),
    "EPSG:3413": (90, NORTH, NORTH),
    "EPSG:5041": (90, 0.994, 0.994),
    "+proj=ob_tran +o_proj=merc +o_lat_p=0 +o_lon_p=0 +R=6371000": (90, 1.0, 1.0),
}
CENTRED = ("stere", "laea", "aeqd", "gnom", "ortho")
REGULAR_POLES |= {f"+proj={name} +lat_0=90 +R=6371000": (90, 1.0, 1.0) for name in CENTRED}
REGULAR_POLES |= {f"+proj={name} +lat_0=90 +ellps=WGS84": (90, 1.0, 1.0) for name in CENTRED[:3]}


@each("definition", REGULAR_POLES)
def test_regular_poles(definition):
    """Where the map is smooth at a pole, the pole is a point like others: J is that of the closed form, quality OK."""
    lat, *scales = REGULAR_POLES[definition]
    result = derivatives(make(definition), POLE_LONGITUDES, float(lat))
    assert (result.quality == Quality.OK).all(), result.quality
    # Rounding of x and y against the step allows 1e-11. PROJ's ellipsoidal laea loses digits there (see above).
    rtol = 1e-9 if definition == "+proj=laea +lat_0=90 +ellps=WGS84" else 1e-10
    np.testing.assert_allclose(principal_scales(result.jacobian), np.broadcast_to(scales, (6, 2)), rtol=rtol)
    # The east of longitude lam is turned by lam against that of longitude 0: J turns with it.
    angle = np.radians(POLE_LONGITUDES) * np.sign(lat)
    turn = matrices(np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle))
    np.testing.assert_allclose(result.jacobian, result.jacobian[2] @ turn, atol=1e-9 * np.min(scales))


@each("gap", [1e-1, 1.1e-2, 1e-2, 9e-3, 1e-4, 1e-7, 1e-10, 1e-13])
@each("definition", ["+proj=stere +lat_0=90 +R=6371000", "+proj=laea +lat_0=40 +R=6371000"])
def test_on_the_way_to_a_regular_pole(definition, gap):
    """From a tenth of a degree to 1e-13 degrees from the pole J goes to its value at the pole."""
    projection = make(definition)
    result = derivatives(projection, POLE_LONGITUDES, 90.0 - gap)
    assert (result.quality == Quality.OK).all()
    at_pole = derivatives(projection, POLE_LONGITUDES, 90.0).jacobian
    # The change on the way is the Hessian, about 1 a radian, times the gap.
    np.testing.assert_allclose(result.jacobian, at_pole, atol=2 * math.radians(gap) + 1e-10)


# Pole lines, the apexes of cones, points where meridians meet at other than their angles, and poles at infinity.
SINGULAR_POLES = [
    *("eqc", "merc", "mill", "eck4", "natearth", "wintri", "sinu", "moll", "hammer", "aitoff", "cea", "goode", "igh"),
    *("ESRI:54009", "+proj=bonne +lat_1=45 +R=6371000", "+proj=eqdc +lat_1=30 +lat_2=60 +ellps=WGS84"),
    *(f"+proj={name} +lat_1=30 +lat_2=60 +R=6371000" for name in ("lcc", "aea")),
]
# A parallel that the map sends to infinity, 90 degrees from the one where a cone touches, is undefined, not 1e16.
FAR = ["ccon +lat_1=45", "murd2 +lat_1=30 +lat_2=60", "pconic +lat_1=30 +lat_2=60"]
SLOW_POLES = [pytest.param(name, marks=pytest.mark.slow) for name in SINGULAR_POLES]


@each("definition", ["robin", "EPSG:3857", *FAR, *SLOW_POLES])
def test_singular_poles(definition):
    """Where the pole is a line, the apex of a cone or at infinity there is no derivative: NaN with its reason."""
    for lat in (-45.0,) if definition in FAR else (90.0, -90.0):
        result = derivatives(make(definition), POLE_LONGITUDES, lat)
        assert np.isnan(result.jacobian).all()
        assert np.isin(result.quality, UNDEFINED).all(), result.quality


def sinusoidal_jacobian(lon, lat, centre):
    return np.array([[1.0, -math.radians(lon - centre) * math.sin(math.radians(lat))], [0.0, 1.0]])


@each(("lon", "lat", "west", "east"), GOODE)
def test_seams_of_goode(lon, lat, west, east):
    """On a seam and beside it, however near, J is the limit from the lobe that the point belongs to."""
    for gap in (0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10):
        result = derivatives(make("igh"), [lon - gap, lon + gap], lat)
        assert (result.quality <= Quality.ONE_SIDED).all(), result.quality
        truth = [sinusoidal_jacobian(lon - gap, lat, west), sinusoidal_jacobian(lon + gap, lat, east)]
        np.testing.assert_allclose(result.jacobian, truth, atol=1e-9)
    result = derivatives(make("igh"), lon, lat)
    assert result.quality == Quality.ONE_SIDED
    # x of a lobe: its centre plus the sinusoidal's own.
    places = [math.radians(c) + math.radians(lon - c) * math.cos(math.radians(lat)) for c in (west, east)]
    centre = (west, east)[int(np.argmin(np.abs(places - result.x / R)))]
    np.testing.assert_allclose(result.jacobian, sinusoidal_jacobian(lon, lat, centre), atol=1e-9)


@pytest.mark.slow
@each("name", ["moll", "robin", "wintri", "eqc", "merc", "hammer", "natearth", "sinu"])
def test_the_antimeridian(name):
    """At +-180 degrees J is the limit from inside, by extrapolation from 1, 2, 3 and 4 thousandths of a degree."""
    projection, lat = make(name), np.array([-60.0, -12.0, 0.0, 33.0, 71.0])
    for sign in (-1, 1):
        result = derivatives(projection, sign * 180.0, lat)
        assert (result.quality <= Quality.ONE_SIDED).all()
        inside = [derivatives(projection, sign * (180 - 1e-3 * i), lat).jacobian for i in (1, 2, 3, 4)]
        np.testing.assert_allclose(result.jacobian, np.einsum("i,i...->...", [4, -6, 4, -1], inside), atol=1e-9)


@each("lat", [-45.0, -20.0, 0.0, 10.0])
def test_the_seam_of_an_oblique_map(lat):
    """On both sides of the cut of an oblique Mollweide, found by bisection, J is its own side's and equal-area."""
    projection = make(f"+proj=ob_tran +o_proj=moll +o_lat_p=35 +o_lon_p=15 +R={R}")
    lon = np.linspace(-180, 180, 7201)
    jump = np.hypot(*np.diff(projection(lon, lat)))
    i = int(np.argmax(jump))
    assert jump[i] > 0.1 * R  # lat was chosen so that the cut crosses the parallel
    left, right = lon[i], lon[i + 1]
    for _ in range(60):
        middle = 0.5 * (left + right)
        (x, across), (y, up) = projection(np.array([left, middle]), lat)
        left, right = (middle, right) if math.hypot(across - x, up - y) < 0.05 * R else (left, middle)
    assert right - left < 1e-12
    for lon_here, away in ((left, -1), (right, 1)):
        result = derivatives(projection, lon_here + away * np.array([0.0, 1e-9, 1e-6, 1e-4, 1e-2]), lat)
        assert (result.quality <= Quality.ROUGH).all(), result.quality
        # One-sided stencils of a map that PROJ rounds to 1e-9 m; the iteration of moll stops at 1e-10.
        np.testing.assert_allclose(value("s", result.jacobian), 1.0, atol=1e-6)
        for k, gap in enumerate((1e-9, 1e-6, 1e-4)):
            assert np.abs(result.jacobian[0] - result.jacobian[k + 1]).max() <= 1e-6 + 10 * math.radians(gap)


@each("lon", [-120.0, 40.0, 90.0])
@each("name", ["eck1", "eck2", "putp3p", "collg"])
def test_the_equator_of_maps_with_a_kink_there(name, lon):
    """On an equator where the meridians break J is a limit from one side, not the mean of the two."""
    projection = make(name)
    north, south, here = (jacobian(projection, lon, lat) for lat in (1e-5, -1e-5, 0.0))
    # 1e-5 degrees beside it the Hessian makes 1e-7 of a difference.
    assert min(np.abs(here - north).max(), np.abs(here - south).max()) <= 1e-5


def cone(n):
    """A conic map, whose derivative at its apex, the pole, is not linear in the direction."""

    def function(lon, lat):
        rho, theta = R * (np.pi / 2 - np.radians(lat)), n * np.radians(lon)
        return rho * np.sin(theta), -rho * np.cos(theta)

    return function


def torn(lon, lat):
    """A map that jumps at every point."""
    return R * np.sin(1e9 * lon), R * np.cos(1e9 * lat)


@each(
    ("function", "lat", "qualities"), [(torn, [30.0, 40.0], [Quality.SEAM]), *((cone(n), 90.0, SHARP) for n in CONES)]
)
def test_no_derivative_is_no_number(function, lat, qualities):
    result = derivatives(function, [10.0, 50.0], lat)
    assert np.isnan(result.jacobian).all()
    assert np.isin(result.quality, qualities).all()


def test_mirrored_kinked_and_constant_maps():
    """det J < 0 is a fact of the map, kept in J; what maps all to one point has J = 0 or NaN, without a warning."""
    # At a kink J is one of its two limits, and not their mean.
    result = derivatives(lambda lon, lat: (R * np.radians(lon), R * np.radians(np.maximum(lat, 2 * lat))), 10.0, 0.0)
    assert result.quality == Quality.ONE_SIDED
    assert np.abs(result.jacobian[1, 1] - [1, 2]).min() < 1e-10
    result = derivatives(lambda lon, lat: (-R * np.radians(lon), R * np.radians(lat)), 3.0, 4.0)
    assert result.quality == Quality.OK
    assert value("orientation", result.jacobian) == -1
    result = derivatives(lambda lon, lat: (0 * lon, 0 * lat), [10.0, 0.0], [20.0, 90.0])
    assert (np.isnan(result.jacobian) | (result.jacobian == 0)).all()
