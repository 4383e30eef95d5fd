"""Statistics of measures over regions against closed forms: means, quantiles, maxima."""

import functools
import math

import pytest
import scipy.integrate
from closed_errors import HALF_PI, L2, R
from gis_files import some_slow
from tables import each

from projdist.answers.summaries import summarize
from projdist.earth.ellipsoid import WGS84


def sec(x):
    return 1 / math.cos(x)


def utm_edge():
    """The scale of UTM on the equator, 3 degrees off (Snyder 1987, 8-11 with T = 0); the next term is 1e-13."""
    e2 = WGS84.f * (2 - WGS84.f)
    C = e2 / (1 - e2)
    A = math.radians(3)
    return 0.9996 * (1 + (1 + C) * A**2 / 2 + (5 + 42 * C + 13 * C**2 - 28 * C) * A**4 / 24 + 61 * A**6 / 720)


@functools.cache
def statistics(projection, region, measure):
    return summarize(projection, region, measures=[measure]).measures[measure]


def mean_over_latitude(value, low=0.0, high=HALF_PI):
    """The mean over a sphere's belt of a function of the latitude."""
    total, _ = scipy.integrate.quad(lambda phi: value(phi) * math.cos(phi), low, high, epsabs=1e-13, epsrel=1e-12)
    return total / (math.sin(high) - math.sin(low))


def moments(value, *belt):
    """The mean and the RMS."""
    return mean_over_latitude(value, *belt), math.sqrt(mean_over_latitude(lambda phi: value(phi) ** 2, *belt))


def omega(a, b):
    return math.degrees(2 * math.asin(abs(a - b) / (a + b)))


POLAR = "cap:0,90,5000"
RIM = 5000e3 / R  # its angular radius
BELT = (math.radians(10), math.radians(60))
# (projection, region, measure): the true mean and RMS.
MEANS = {
    ("plate-carree", "globe", "s"): (HALF_PI, math.nan),
    ("plate-carree", "globe", "omega"): moments(lambda phi: omega(sec(phi), 1)),
    ("plate-carree", "box:0,10,30,60", "s"): moments(sec, *BELT),
    ("plate-carree", "globe", "log_areal_scale"): (1 - L2, math.sqrt(2 - 2 * L2 + L2**2 - math.pi**2 / 12)),
    ("mercator", "globe", "k"): (HALF_PI, math.nan),
    ("mercator", "globe", "s"): (math.nan, math.nan),
    ("mollweide", "globe", "s"): (1.0, 1.0),
    ("sinusoidal", "globe", "omega"): tuple(
        scipy.integrate.dblquad(
            lambda phi, lam, n=n: math.degrees(2 * math.atan(lam * math.sin(phi) / 2)) ** n * math.cos(phi) / math.pi,
            *(0, math.pi, 0, HALF_PI),
            epsabs=1e-10,
        )[0]
        ** (1 / n)
        for n in (1, 2)
    ),
    ("lambert-cylindrical", "globe", "airy"): (
        mean_over_latitude(lambda phi: math.sqrt(((math.cos(phi) - 1) ** 2 + (1 / math.cos(phi) - 1) ** 2) / 2)),
        math.nan,
    ),
    # The projected area 4 pi tan^2(c/2) over the cap's 2 pi (1 - cos c); s^2 = sec^8(c/2), and sin c dc = -4 u du of
    # u = cos(c/2).
    ("stereographic", "cap:0,0,5000", "s"): (
        2 / (1 + math.cos(RIM)),
        math.sqrt((sec(RIM / 2) ** 6 - 1) / 3 * 2 / (1 - math.cos(RIM))),
    ),
}


def mean_id(key):
    return "-".join(key)


@pytest.mark.slow
@pytest.mark.parametrize("key", MEANS, ids=mean_id)
def test_mean_and_rms(key):
    """Means and RMS agree with closed forms within three times their errors; what diverges is NaN."""
    found, (mean, rms) = statistics(*key), MEANS[key]
    for value, error, truth in ((found.mean, found.mean_error, mean), (found.rms, found.rms_error, rms)):
        if math.isnan(truth):
            assert math.isnan(value)
            assert math.isnan(error)
        else:
            assert value == pytest.approx(truth, abs=3 * error + 1e-9)
            assert value == pytest.approx(truth, abs=5e-6 * max(1, abs(truth)))


# Measures of cylindrical maps grow with the latitude: the quantile q is the value where sin(latitude) = q.
QUANTILES = {
    ("plate-carree", "k"): sec,
    ("plate-carree", "omega"): lambda phi: omega(sec(phi), 1),
    ("mercator", "s"): lambda phi: sec(phi) ** 2,
    ("mercator", "fisher"): lambda phi: -math.sqrt(2) * math.log(math.cos(phi)),
    ("lambert-cylindrical", "a"): sec,
}


@each("key", some_slow(QUANTILES, {("plate-carree", "omega")}))
def test_median_and_p95(key):
    """Medians and 95th percentiles of cylindrical maps are right to 1e-3: a share of 1e-4 is a point of theirs."""
    found = statistics(key[0], "globe", key[1])
    assert found.median == pytest.approx(QUANTILES[key](math.asin(0.5)), rel=1e-3)
    assert found.p95 == pytest.approx(QUANTILES[key](math.asin(0.95)), rel=1e-3)


# The gradient of ln k of a conformal map: on Mercator's tan(latitude), on the stereographic tan(c / 2). The mean
# over all directions of |sin| or |cos| is 2 / pi (Goldberg & Gott 2007 have 0.64 for both on Mercator's map).
FLEXION = {
    ("mercator", "box:0,10,30,60"): 2 / math.pi * mean_over_latitude(math.tan, *BELT),
    ("stereographic", POLAR.replace("90", "0")): 2 / math.pi * (RIM - math.sin(RIM)) / (1 - math.cos(RIM)),
    ("mercator", "globe"): 2 / math.pi,
    # 2 / pi tan(c / 2), and the mean of tan(c / 2) is pi / 2.
    ("stereographic", "globe"): 1.0,
}


SECOND_ORDER = 1e-5  # That of the cubature, which refines the means of second derivatives to this.


@pytest.mark.slow
@pytest.mark.parametrize("key", FLEXION, ids=mean_id)
def test_means_of_second_derivatives(key):
    """The mean flexion and skewness of conformal maps are 2 / pi times the mean of |grad ln k|."""
    for found in summarize(*key, measures=["flexion", "skewness"]).measures.values():
        assert found.mean == pytest.approx(FLEXION[key], abs=SECOND_ORDER)
        assert abs(found.mean - FLEXION[key]) <= 3.0 * found.mean_error


@pytest.mark.slow
def test_no_flexion_of_the_gnomonic_map():
    """The gnomonic map shows great circles straight."""
    assert statistics("gnomonic", "cap:0,0,5000", "flexion").mean == pytest.approx(0.0, abs=SECOND_ORDER)


MAXIMA = {  # (projection, region, measure): value, and latitude and longitude where they are unique
    ("plate-carree", "box:0,10,30,60", "k"): (2.0, None, 60.0),
    ("plate-carree", "globe", "s"): (math.inf, None, None),
    ("mercator", "globe", "k"): (math.inf, None, None),
    ("sinusoidal", "globe", "omega"): (math.degrees(2 * math.atan(HALF_PI)), 180.0, 90.0),
    ("sinusoidal", "box:0,0,90,60", "omega"): (math.degrees(2 * math.atan(HALF_PI * math.sqrt(3) / 4)), 90, 60),
    ("EPSG:32631", "box:0,0,6,84", "k"): (utm_edge(), None, 0.0),
    ("azimuthal-equidistant", "cap:0,0,5000", "a"): (RIM / math.sin(RIM), None, None),
    ("stereographic", "cap:0,0,5000", "s"): (sec(RIM / 2) ** 4, None, None),
    ("laea", "cap:0,0,5000", "omega"): (omega(1 / math.cos(RIM / 2), math.cos(RIM / 2)), None, None),
}


@each("key", MAXIMA)
def test_maxima(key):
    """Maxima are those of the closed form, at their place, on the rim of a cap; unbounded ones are infinite."""
    found = statistics(*key)
    value, lon, lat = MAXIMA[key]
    # Pole ends are searched as near as the samples reach, some 1e-4 of a radian.
    near_pole = lat == 90.0
    assert found.max == pytest.approx(value, rel=1e-5 if near_pole else 1e-9)
    at_lon, at_lat = found.max_at
    if lat is not None:
        assert abs(at_lat) == pytest.approx(lat, abs=0.05 if near_pole else 1e-4)
    if lon is not None:
        assert abs(at_lon) == pytest.approx(lon, abs=0.05)
    if key[1].startswith("cap"):
        distance = math.acos(math.cos(math.radians(at_lat)) * math.cos(math.radians(at_lon)))
        assert distance == pytest.approx(RIM, abs=1e-6)
