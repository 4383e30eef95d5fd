"""Nodes of regions, and single candidates measured in full, against closed forms."""

import math

import numpy as np
import pytest
from tables import each

from projdist import FIGURES, Projection, sample
from projdist.answers.summaries import summarize
from projdist.decisions.measurement import FullMeasurement, lattice_of, measure, probe_of
from projdist.earth.ellipsoid import WGS84
from projdist.regions import GLOBE, Box, Cap, get_region


def measured(code, region, keeps=()):
    """A candidate's figures over a region."""
    region = get_region(region)
    task = FullMeasurement(
        code=code,
        name=code,
        region=region,
        probe=probe_of(region),
        keeps=keeps,
        level=0.01,
        ranking=FIGURES["airy_kavrayskiy"],
    )
    value, found = measure(task)
    assert value == found.airy_kavrayskiy
    return found


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


# ---- means where PROJ's own map is noisy -----------------------------------------------------


def van_der_grinten(lam, phi):
    """x and y in radii north-east of the centre (Snyder 1987, 29-1 to 29-6)."""
    sine = 2 * phi / np.pi
    cosine = np.sqrt(1 - sine**2)
    A, G = 0.5 * (np.pi / lam - lam / np.pi), cosine / (sine + cosine - 1)
    P, Q = G * (2 / sine - 1), A**2 + G
    below = P**2 + A**2
    x = A * (G - P**2) + np.sqrt(A**2 * (G - P**2) ** 2 - below * (G**2 - P**2))
    y = P * Q - A * np.sqrt((A**2 + 1) * below - Q**2)
    return np.pi * x / below, np.pi * y / below


@pytest.fixture(scope="module")
def mean_scale_error():
    """The mean of max(|a - 1|, |b - 1|) of the formulas, in ppm, on 100 by 100 cells, by differences."""
    middles, step = np.radians(0.2 * np.arange(100) + 0.1), 1e-4
    lam, phi = np.meshgrid(middles, middles)
    east = np.subtract(van_der_grinten(lam + step, phi), van_der_grinten(lam - step, phi)) / (2 * step)
    north = np.subtract(van_der_grinten(lam, phi + step), van_der_grinten(lam, phi - step)) / (2 * step)
    e2 = WGS84.f * (2 - WGS84.f)
    w = np.sqrt(1 - e2 * np.sin(phi) ** 2)
    M, parallel = (1 - e2) / w**3, np.cos(phi) / w
    scales = np.linalg.svd(np.moveaxis(np.stack([east / parallel, north / M], axis=1), (0, 1), (-2, -1)))[1]
    scales *= math.sqrt(WGS84.area / (4 * math.pi)) / WGS84.a  # ESRI's CRS has the sphere of the same area (+R_A)
    return 1e6 * np.average(np.abs(scales - 1).max(axis=-1), weights=M * parallel)


@pytest.mark.slow
def test_mean_beside_noise(mean_scale_error):
    """PROJ's Van der Grinten map rounds by kilometres beside its centre: its mean is found where cells are larger."""
    found = measured("ESRI:54029", "box:-20,-20,20,20")
    assert found.mean_scale_error_ppm == pytest.approx(mean_scale_error, rel=1e-4)
    summary = summarize("ESRI:54029", "box:-20,-20,20,20", measures=["scale_error_ppm"])
    assert summary.measures["scale_error_ppm"].mean == pytest.approx(mean_scale_error, rel=1e-4)
    assert summary.airy_kavrayskiy == pytest.approx(found.airy_kavrayskiy, rel=1e-6)
    assert summary.error_estimate < 1e-5


# ---- figures beside singular points ----------------------------------------------------------


def test_areal_scale_has_a_mean_where_the_image_is_bounded():
    """Adams' map of the world is a square: the mean areal scale is its area by that of the sphere, though s grows."""
    # At its corners angles of 360 degrees become right ones, so that s grows as r^-1.5.
    projection = Projection.from_user_input("+proj=adams_ws2 +R=1")
    north = projection(0.0, 90.0)[1]
    assert sample(projection, "globe").mean("s").value == pytest.approx(2 * north**2 / (4 * math.pi), rel=1e-3)
    assert measured("+proj=adams_ws2 +R=6371007", "globe").mean_areal_error_ppm == pytest.approx(827860, rel=2e-3)
    # Beside the pole that a conic map has at infinity s grows as r^-3.3: its integral diverges.
    assert math.isnan(measured("+proj=lcc +lat_1=30 +lat_2=50", "globe", ("conformal",)).mean_areal_error_ppm)


def test_noise_beside_a_rim_is_no_singular_point():
    """PROJ's map of Guyou snaps to the rim of a hemisphere; the least areal scale is that of the middle, about 1."""
    assert measured("+proj=guyou +R=6371007", "globe", ("conformal",)).min_areal_scale == pytest.approx(1.0, abs=0.02)


REGIONS = [GLOBE, Box(5.9, 47.3, 15.0, 55.1), Box(177, -20, -178, -15), Cap(10, 50, 20), Cap(0, -90, 2000)]


@pytest.mark.parametrize("region", REGIONS, ids=lambda region: region.name)
def test_weights(region):
    """Weights add up to 1, stand for area, and all nodes lie in the region."""
    probe = probe_of(region)
    assert probe.weight.sum() == pytest.approx(1.0, abs=1e-12)
    assert region.contains(probe.lon, probe.lat).all()
    assert 60 <= len(probe.lon) <= 400


def test_mean_latitude():
    """The mean of sin(latitude) over a band is the mean of its ends, by Archimedes, but for the flattening."""
    probe = probe_of(Box(0, 20, 40, 60))
    mean = probe.weight @ np.sin(np.radians(probe.lat))
    assert mean == pytest.approx(0.5 * (np.sin(np.radians(20)) + np.sin(np.radians(60))), abs=2e-3)


@each(("area", "share"), [
    ((177, -20, -178, -15), 1.0), ((177, -20, 180, -15), 0.6), ((-180, -20, -178, -15), 0.4),
    ((-180, -90, 180, 90), 1.0), ((0, -20, 10, -15), 0.0),
])  # fmt: skip
def test_share_across_the_antimeridian(area, share):
    """Shares of a box that crosses the antimeridian, within areas that do and do not; to half a row of its lattice."""
    lattice = lattice_of(Box(177, -20, -178, -15))
    assert lattice.within([area])[0] @ lattice.weight == pytest.approx(share, abs=0.02)
