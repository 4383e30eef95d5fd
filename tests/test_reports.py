"""Inputs after faults that people report in public, where they lie beside the checkout: right, or refused by name."""

import json
from pathlib import Path

import pytest
from commands import refused, run
from tables import each

REPORTS = Path(__file__).resolve().parents[2] / "shared" / "data" / "reports"

pytestmark = pytest.mark.skipif(not REPORTS.is_dir(), reason="the inputs are not beside the checkout")

# A file, a place, what is measured there, and the right value: closed forms, and GDAL's for the convergence.
MAPS = [
    ("polar_variant_b.prj", (10, -75), {"k": 0.98666428, "convergence": -10.0}),
    ("mercator_variant_b.wkt", (20, 35), {"h": 0.92164390, "k": 0.92164390}),
    ("lcc_2sp_spaces.wkt", (-98, 32.5), {"h": 1.00022402, "k": 1.00022402}),
    ("albers_spaces.wkt", (-100, 40), {"h": 1.00911371, "k": 0.99096860}),
]
REFUSED = {
    "polar_north_along.prj": 'unhandled axis direction: "North along 90 deg East"',
    "decimal_comma.prj": "PARAMETER 'Central_Meridian' has a comma within a number, 10,5",
    "unknown_method.prj": "PROJ does not know the method 'Unknown'",
    "unclosed.prj": "The closing bracket of PROJCS is missing",
}

# Two clouds of which the second is the first turned by 90 degrees, times two.
OTHERS = "cloudcompare_header.xyz", "faces_first.ply", "decimal_comma_cloud.csv"
CLOUDS = [("cloud_a.pcd", "cloud_b.pcd"), *(("cloud_a.xyz", name) for name in OTHERS)]


def answer(*words):
    """What a command says in JSON, and what it tells beside it."""
    done = run(*words, "--format", "json")
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout), done.stderr


@each("name, place, values", MAPS)
def test_maps(name, place, values):
    """Parameters by other names make the map that was meant."""
    found, told = answer("factors", REPORTS / name, *place)
    assert (told, {key: found["results"][0][key] for key in values}) == ("", pytest.approx(values, abs=5e-9))


@each("name, words", REFUSED.items())
def test_maps_that_are_refused(name, words):
    assert words in refused("factors", REPORTS / name, 10, 45, code=1)


def test_what_is_told():
    """Data and regions say that they look like degrees; the figure of Earth Engine's parameters is not taken."""
    _, told = answer("factors", REPORTS / "semi_major.wkt", -95, 25)
    assert all(name in told for name in ("'semi_major' (6371200)", "'semi_minor' (6371200)"))
    path = REPORTS / "degrees_in_3857.geojson"
    for words in (["check", path], ["compare", "EPSG:3857", "-r", f"file:{path}"]):
        assert "look like degrees" in answer(*words)[1]


@pytest.mark.slow
def test_points_and_tracks():
    """The scale of UTM at 11.5, 48.25, whatever columns are called and divided by; the factor of a height of 1000 m."""
    for name in ("longitude_latitude.csv", "semicolon.csv", "decimal_comma_points.csv"):
        found, _ = answer("factors", "EPSG:25832", "--at", REPORTS / name)
        assert found["results"][0]["h"] == pytest.approx(1.0000231733, abs=5e-11)
    for layer in ("", "#tracks"):  # where it begins
        found, _ = answer("profile", "EPSG:25832", "--line", f"{REPORTS / 'track.gpx'}{layer}")
        assert found["results"][0]["elevation_factor"] == pytest.approx(0.99984327, abs=5e-9)
    # Metres a unit: of control points in US feet, whose CRS the file states, and of a table of links in metres.
    for name in ("feet.points", "arcgis_links.txt"):
        found, _ = answer("oldmap", REPORTS / name)
        assert found["rectifications"]["mdt"]["scale"] == pytest.approx(1.9975, abs=5e-5)


@each("one, other", CLOUDS)
def test_clouds(one, other):
    """Fisher distances to the mean, and nothing left over but the rounding of PCD's single precision."""
    found, _ = answer("clouds", REPORTS / one, REPORTS / other)
    assert [row["distortion"] for row in found["clouds"]] == pytest.approx([0.600283] * 2, abs=5e-7)
    assert found["rms"] < 1e-7
