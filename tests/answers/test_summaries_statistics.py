"""Statistics of measures over regions against closed forms: means, quantiles, maxima."""

import math

import pytest
import scipy.integrate
from closed_errors import HALF_PI, L2, R

from projdist.answers.summaries import summarize


def sec(x):
    return 1 / math.cos(x)


def mean_over_latitude(value, low=0.0, high=HALF_PI):
    """The mean over a sphere's belt of a function of the latitude."""
    total, _ = scipy.integrate.quad(lambda phi: value(phi) * math.cos(phi), low, high, epsabs=1e-13, epsrel=1e-12)
    return total / (math.sin(high) - math.sin(low))


def moments(value, *belt):
    """The mean and the RMS."""
    return mean_over_latitude(value, *belt), math.sqrt(mean_over_latitude(lambda phi: value(phi) ** 2, *belt))


def omega(a, b):
    return math.degrees(2 * math.asin(abs(a - b) / (a + b)))


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


@pytest.mark.slow
@pytest.mark.parametrize("key", MEANS, ids="-".join)
def test_mean_and_rms(key):
    """Means and RMS agree with closed forms within three times their errors; what diverges is NaN."""
    found, (mean, rms) = summarize(*key[:2], measures=[key[2]]).measures[key[2]], MEANS[key]
    for value, error, truth in ((found.mean, found.mean_error, mean), (found.rms, found.rms_error, rms)):
        if math.isnan(truth):
            assert math.isnan(value)
            assert math.isnan(error)
        else:
            assert abs(value - truth) <= min(3 * error + 1e-9, 5e-6 * max(1, abs(truth)))


# The gradient of ln k of a conformal map: on Mercator's tan(latitude), on the stereographic tan(c / 2). The mean
# over all directions of |sin| or |cos| is 2 / pi (Goldberg & Gott 2007 have 0.64 for both on Mercator's map).
FLEXION = {
    ("mercator", "box:0,10,30,60"): 2 / math.pi * mean_over_latitude(math.tan, *BELT),
    ("stereographic", "cap:0,0,5000"): 2 / math.pi * (RIM - math.sin(RIM)) / (1 - math.cos(RIM)),
    ("mercator", "globe"): 2 / math.pi,
    # 2 / pi tan(c / 2), and the mean of tan(c / 2) is pi / 2.
    ("stereographic", "globe"): 1.0,
    ("gnomonic", "cap:0,0,5000"): 0.0,  # great circles are straight
}
SECOND_ORDER = 1e-5  # That of the cubature, which refines the means of second derivatives to this.


@pytest.mark.slow
@pytest.mark.parametrize("key", FLEXION, ids="-".join)
def test_means_of_second_derivatives(key):
    """The mean flexion and skewness of conformal maps are 2 / pi times the mean of |grad ln k|."""
    names = ["flexion"] if key[0] == "gnomonic" else ["flexion", "skewness"]
    for found in summarize(*key, measures=names).measures.values():
        assert abs(found.mean - FLEXION[key]) <= min(3.0 * found.mean_error, SECOND_ORDER)
