"""Custom projections beside existing CRSs: optimality, closed forms, purposes, criteria, and what is refused."""

import json
import re

import numpy as np
import pytest
from tables import each, some

from projdist import FIGURES, recommend
from projdist.decisions.measurement import Rejected, probe_of
from projdist.decisions.ranking import PURPOSES, suits
from projdist.decisions.recommendation import best_custom, families_for
from projdist.earth.ellipsoid import WGS84
from projdist.regions import get_region

pytestmark = pytest.mark.slow

GERMANY = "box:5.9,47.3,15.0,55.1"
CAP = "cap:10,50,300"


def best(family, region, ranking="airy_kavrayskiy", purpose="any"):
    place = get_region(region)
    return best_custom(family, place, probe_of(place), FIGURES[ranking], purpose)


def test_the_best_stereographic_map_of_a_cap():
    """k grows as 1 / cos^2(c / 2) from the middle, c the distance over the Gaussian radius: half of that remains."""
    found = best("stere", CAP, "max_scale_error_ppm")
    growth = 1.0 / np.cos(0.5 * 300e3 / np.sqrt(np.prod(WGS84.radii(np.array([50.0]))))) ** 2
    # The cap's radius is measured on a sphere, off by the flattening, 0.34 %, at most, and k - 1 by twice that.
    assert found.value == pytest.approx(1e6 * (growth - 1.0) / (growth + 1.0), rel=0.0067)
    assert found.value == found.distortion.max_scale_error_ppm


@pytest.mark.parametrize("country", ["MC", "MO", "VA"])
def test_means_of_the_smallest_countries(country):
    """The mean of |k - 1| on a transverse Mercator map, k = k_0 (1 + (1 + e'^2 cos^2 phi) (lam cos phi)^2 / 2)."""
    # The next term is of the fourth order, 1e-15 in a country of ten kilometres; what PROJ rounds is 1e-10.
    found, region = best("tmerc", f"country:{country}"), get_region(f"country:{country}")
    west, south, east, north = region.bounds
    grid = np.meshgrid(np.linspace(west, east, 400), np.linspace(south, north, 400))
    lon, lat = np.radians(np.array(grid)[:, region.contains(*grid)])
    lon_0, k_0 = (float(re.search(rf"\+{name}=(\S+)", found.proj)[1]) for name in ("lon_0", "k_0"))
    x = (lon - np.radians(lon_0)) * np.cos(lat)
    second = WGS84.f * (2.0 - WGS84.f) / (1.0 - WGS84.f) ** 2
    k = k_0 * (1.0 + 0.5 * (1.0 + second * np.cos(lat) ** 2) * x**2)
    rounding = 1e-3  # ppm
    for name, scale in (("scale", k), ("areal", k**2)):
        mean, error = (getattr(found.distortion, f"mean_{name}_error_ppm{end}") for end in ("", "_error"))
        assert mean == pytest.approx(1e6 * np.abs(scale - 1.0).mean(), rel=0.02, abs=rounding)
        assert 0.0 < error < rounding


@pytest.mark.parametrize("family", ["aeqd", "eqdc", "aea", "laea"])
def test_no_figure_of_a_small_country_is_missing(family):
    found = best(family, "country:MO").distortion
    assert all(np.isfinite(value) for value in vars(found).values())


# Names of methods, in EPSG's and ESRI's words, and the family that they are of.
METHODS = {
    "lcc": ("Lambert Conic Conformal (1SP)", "Lambert Conic Conformal (2SP)"), "aea": ("Albers Equal Area",),
    "eqdc": ("Equidistant Conic",), "tmerc": ("Transverse Mercator",), "laea": ("Lambert Azimuthal Equal Area",),
    "aeqd": ("Azimuthal Equidistant",), "stere": ("Polar Stereographic (variant A)", "Polar Stereographic (variant B)"),
    "merc": ("Mercator (variant A)", "Mercator (variant B)"),
    "omerc": ("Hotine Oblique Mercator (variant A)", "Hotine Oblique Mercator (variant B)"),
    "cea": ("Lambert Cylindrical Equal Area",), "wintri": ("Winkel Tripel",),
}  # fmt: skip
FAMILY = {method: family for family, methods in METHODS.items() for method in methods}
# Of a figure: the nodes of a search are fixed, an optimum is flat, and means are measured to 1e-4.
SLACK = 2e-4


@pytest.mark.parametrize(("region", "criterion"), some([
    (GERMANY, "airy_kavrayskiy"), (GERMANY, "max_scale_error_ppm"), (GERMANY, "max_omega"),
    ("box:-180,-90,180,-60", "airy_kavrayskiy"),
    ("box:177,-20,-178,-15", "max_scale_error_ppm"), ("country:CH", "mean_scale_error_ppm"),
    ("globe", "airy_kavrayskiy"),
], 2, 1))  # fmt: skip
def test_no_crs_is_better_than_the_best_of_its_family(region, criterion):
    """What holds by optimality, over every CRS of the same method; angles to 1e-6 degrees, areas to 0.1 ppm."""
    found = recommend(region, criterion=criterion, authorities=["EPSG"], area="intersects", limit=20, custom=True)
    optima, rounding = {one.family: one.value for one in found.custom}, FIGURES[criterion].rounding
    same = [one for one in found.results if FAMILY.get(one.method) in optima]
    for one in same:
        assert one.value >= (1.0 - SLACK) * optima[FAMILY[one.method]] - rounding, one.code
    assert same
    if criterion == "max_omega":  # by Airy-Kavrayskiy omerc is the best of the conformal ones; no ratio is to 0
        assert found.custom[0].family == "omerc"
        assert all(one.ratio_to_custom is None for one in found.results)


def test_winkel_tripel():
    """Over the globe ESRI's two Winkel Tripel are of the only family of compromises."""
    found = recommend("globe", purpose="compromise", authorities=["ESRI"], limit=3, custom=True)
    (least,) = [one.value for one in found.custom if one.family == "wintri"]
    assert min(one.value for one in found.results if one.method == "Winkel Tripel") > least


def test_the_answer():
    """Each CRS's figure over, and less, that of the best custom projection; these come in order, and last in rows."""
    found = recommend("box:9,45,11,50", purpose="conformal", authorities=["EPSG"], limit=2, custom=True)
    best, values = found.custom[0], [one.value for one in found.custom]
    assert values == sorted(values)
    for one in found.results:
        assert (one.ratio_to_custom, one.difference_to_custom) == (one.value / best.value, one.value - best.value)
    # A custom one has the columns of candidates: no code, the figures, what it keeps; in JSON its parameters, too.
    row, one = best._row(), best.to_dict()
    assert (row["code"], row["method"], row["proj"], row["keeps"]) == ("", best.family, best.proj, "conformal")
    assert row["airy_kavrayskiy"] == row["value"] == best.value == one["airy_kavrayskiy"]
    assert (one["parameters"], one["keeps"]) == (best.parameters, ["conformal"])
    data, rows = json.loads(found.to_json()), found.rows()
    assert data == found.to_dict()
    assert [one["proj"] for one in data["custom"]] == [one.proj for one in found.custom]
    assert {one["family"] for one in data["custom"]} == {"lcc", "tmerc", "omerc", "stere"}
    assert [row["code"] for row in rows] == [*(one.code for one in found.results), *[""] * len(found.custom)]
    assert all(list(row) == list(rows[0]) for row in rows)
    pytest.importorskip("pandas")
    assert found.to_frame()["proj"].tolist()[-1] == found.custom[-1].proj


@pytest.mark.parametrize("region", ["country:CH", "globe"])
@pytest.mark.parametrize("purpose", PURPOSES)
def test_purposes(region, purpose):
    """What is found keeps what is asked for, as measured."""
    place = get_region(region)
    found = [best(name, place, purpose=purpose) for name in families_for(place, purpose)]
    served = [one for one in found if not isinstance(one, Rejected)]
    assert all(suits(one.keeps, purpose) for one in served)
    # PROJ's equidistant cylindrical map has formulas for the sphere only.
    assert served or (region, purpose) == ("globe", "equidistant")


def test_what_vanishes_for_a_family():
    """Of maps that change no angles the one of the least Airy-Kavrayskiy error is the best."""
    found = best("tmerc", GERMANY, "max_omega")
    assert found.proj == best("tmerc", GERMANY).proj
    assert found.value < FIGURES["max_omega"].rounding


@each(("region", "purpose", "families"), [
    (GERMANY, "conformal", {"lcc", "tmerc", "omerc", "stere"}), (GERMANY, "equal-area", {"laea", "aea"}),
    ("globe", "conformal", {"merc"}), ("globe", "compromise", {"wintri"}),
    ("cap:0,90,300", "compromise", {"wintri", "airy"}),
])  # fmt: skip
def test_families_for_a_purpose(region, purpose, families):
    """Of those that suit the region's place those that serve; all that serve where none of them suits."""
    assert set(families_for(get_region(region), purpose)) == families
    assert "laea" in families_for(get_region(GERMANY), "any")


def test_what_does_not_serve_is_rejected():
    """A conformal map of a purpose that it does not serve, and a family that cannot map the region."""
    refused = best("stere", CAP, purpose="equal-area")
    assert refused == Rejected("", "stere", "It is not equal-area on the ellipsoid.")
