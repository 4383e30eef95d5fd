"""Single candidates measured in full, against closed forms."""

import math

import pytest

from projdist.candidates import Full, measure
from projdist.ellipsoid import WGS84
from projdist.probe import probe_of
from projdist.regions import get_region


def measured(code, region, keeps=()):
    """A candidate's figures over a region."""
    region = get_region(region)
    return measure(Full(code, code, region, probe_of(region), keeps, 0.01, "airy_kavrayskiy"))


def test_no_noise_beside_the_centre():
    """An equal-area azimuthal map of Antarctica shears most at the northernmost vertex, not where J is noise."""
    lat = get_region("continent:Antarctica").edges[:, 1].max()
    e = math.sqrt(WGS84.f * (2 - WGS84.f))

    def q(sine):  # Snyder 1987, 3-12
        return (1 - e * e) * (sine / (1 - (e * sine) ** 2) + math.atanh(e * sine) / e)

    sine = math.sin(math.radians(-lat))
    m = math.cos(math.radians(lat)) / math.sqrt(1 - (e * sine) ** 2)
    k = math.sqrt(q(1) - q(sine)) / m  # 21-32, 24-23; h is 1 / k
    expected = math.degrees(2 * math.asin((k - 1 / k) / (k + 1 / k)))
    found = measured("EPSG:6932", "continent:Antarctica", ("equal-area",))
    assert found.max_omega == pytest.approx(expected, abs=1e-6)
