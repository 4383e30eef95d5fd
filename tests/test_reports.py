"""Inputs after faults that people report in public, where they lie beside the checkout: right, or refused by name.

The kinds of fault have tests of their own with other inputs, in the rooms that mend them.
"""

import json
from pathlib import Path

import pytest
from commands import run

REPORTS = Path(__file__).resolve().parents[2] / "shared" / "data" / "reports"

pytestmark = pytest.mark.skipif(not REPORTS.is_dir(), reason="the inputs are not beside the checkout")

# A file, a place, what is measured there, and the right value: closed forms, and GDAL's for the convergence.
MAPS = [
    ("polar_variant_b.prj", (10, -75), {"k": 0.98666428, "convergence": -10.0}),
    ("mercator_variant_b.wkt", (20, 35), {"h": 0.92164390, "k": 0.92164390}),
    ("lcc_2sp_spaces.wkt", (-98, 32.5), {"h": 1.00022402, "k": 1.00022402}),
    ("albers_spaces.wkt", (-100, 40), {"h": 1.00911371, "k": 0.99096860}),
]

REFUSED = [
    ("polar_north_along.prj", 'unhandled axis direction: "North along 90 deg East"'),
    ("decimal_comma.prj", "PARAMETER 'Central_Meridian' has a comma within a number, 10,5"),
    ("unknown_method.prj", "PROJ does not know the method 'Unknown'"),
    ("unclosed.prj", "The closing bracket of PROJCS is missing"),
]

# Two clouds of which the second is the first turned by 90 degrees, times two.
CLOUDS = [
    ("cloud_a.pcd", "cloud_b.pcd"),
    ("cloud_a.xyz", "cloudcompare_header.xyz"),
    ("cloud_a.xyz", "faces_first.ply"),
    ("cloud_a.xyz", "decimal_comma_cloud.csv"),
]


def answer(*words):
    """What a command says in JSON, and what it tells beside it."""
    done = run(*(str(word) for word in words), "--format", "json")
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout), done.stderr


@pytest.mark.parametrize(("name", "place", "values"), MAPS, ids=[row[0] for row in MAPS])
def test_maps(name, place, values):
    """Parameters by other names make the map that was meant."""
    found, told = answer("factors", REPORTS / name, *place)
    assert told == ""
    for key, value in values.items():
        assert found["results"][0][key] == pytest.approx(value, abs=5e-9)


@pytest.mark.parametrize(("name", "words"), REFUSED, ids=[row[0] for row in REFUSED])
def test_maps_that_are_refused(name, words):
    """In one line, with what is not understood."""
    done = run("factors", str(REPORTS / name), "10", "45")
    assert (done.exit_code, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert words in done.stderr


def test_parameters_without_use():
    """The figure of Earth Engine's parameters is not taken, and that is told."""
    _, told = answer("factors", REPORTS / "semi_major.wkt", -95, 25)
    assert "'semi_major' (6371200)" in told
    assert "'semi_minor' (6371200)" in told


@pytest.mark.parametrize("name", ["feet.points", "arcgis_links.txt"])
def test_control_points(name):
    """Metres a unit: of points in US feet, whose CRS the file states, and of a table of links in metres."""
    found, _ = answer("oldmap", REPORTS / name)
    assert found["rectifications"]["mdt"]["scale"] == pytest.approx(1.9975, abs=5e-5)


def test_degrees_in_metres():
    """Data and regions say that they look like degrees."""
    path = REPORTS / "degrees_in_3857.geojson"
    for words in (["check", path, "--no-recommend"], ["compare", "EPSG:3857", "-r", f"file:{path}"]):
        _, told = answer(*words)
        assert "look like degrees" in told


@pytest.mark.parametrize("name", ["longitude_latitude.csv", "semicolon.csv", "decimal_comma_points.csv"])
def test_points(name):
    """The scale of UTM at 11.5, 48.25, whatever the columns are called and divided by."""
    found, _ = answer("factors", "EPSG:25832", "--at", REPORTS / name)
    assert found["results"][0]["h"] == pytest.approx(1.0000231733, abs=5e-11)


@pytest.mark.parametrize(("one", "other"), CLOUDS, ids=[pair[1] for pair in CLOUDS])
def test_clouds(one, other):
    """Fisher distances to the mean, and nothing left over but the rounding of PCD's single precision."""
    found, _ = answer("clouds", REPORTS / one, REPORTS / other)
    assert [row["distortion"] for row in found["clouds"]] == pytest.approx([0.600283] * 2, abs=5e-7)
    assert found["rms"] < 1e-7


@pytest.mark.parametrize("layer", ["", "#tracks"])
def test_a_track(layer):
    """The factor of its height, 1000 m, where it begins."""
    found, _ = answer("profile", "EPSG:25832", "--line", f"{REPORTS / 'track.gpx'}{layer}")
    assert found["results"][0]["elevation_factor"] == pytest.approx(0.99984327, abs=5e-9)
