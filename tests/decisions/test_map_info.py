"""A map by itself: what it keeps and how large its errors are, against closed forms and what is known of methods."""

import numpy as np
import pytest
from gis_files import some_slow

import projdist
from projdist import SPHERE, WGS84, Box, info

# Snyder & Voxland 1989, An Album of Map Projections, says of each what it keeps; of the CRSs, EPSG's Guidance Note 7-2.
KNOWN = {
    "mercator": ("conformal",),
    "stere": ("conformal",),
    "lagrange": ("conformal",),
    "mollweide": ("equal-area",),
    "hatano": ("equal-area",),
    "sinu": ("equal-area",),
    "goode": ("equal-area",),
    "gott-elliptical": ("equal-area",),
    "plate-carree": ("equidistant",),
    "aeqd": ("equidistant",),
    "robinson": (),
    "winkel-tripel": (),
    "EPSG:32633": ("conformal",),
    "EPSG:5514": ("conformal",),
    "EPSG:6933": ("equal-area",),
    # A square of 50 km, in which every map is nearly everything.
    "EPSG:2326": ("conformal",),
    # Formulas of the sphere on an ellipsoid.
    "EPSG:3857": (),
    "ESRI:54009": (),
}
SOME = {"lagrange", "gott-elliptical", "aeqd", "robinson", "EPSG:5514", "EPSG:2326", "EPSG:3857"}


@pytest.mark.parametrize("given", some_slow(KNOWN, set(KNOWN) - SOME))
def test_what_is_kept(given: str) -> None:
    """As measured it is what the literature says, also where PROJ's own iterations leave 1e-6."""
    found = info(given, "cap:10,50,100")
    assert found.keeps == KNOWN[given]
    assert not found.promises or found.promises in found.keeps


def test_departures_are_by_closed_forms() -> None:
    """Pseudo-Mercator stretches meridians by nu / rho less than parallels; plate carree has s = 1 / cos(latitude)."""
    found = info("EPSG:3857", Box(0, 0, 1, 1))
    at_equator = -np.log(1.0 - WGS84.eccentricity_squared)
    assert 0.98 * at_equator < found.departures["conformal"] <= at_equator
    plain = info(lambda lon, lat: (SPHERE.a * np.radians(lon), SPHERE.a * np.radians(lat)), "box:0,0,1,1")
    # The median of ln(sec) by area is at the parallel of 30 degrees; 99 % of the globe lie below asin(0.99).
    below = np.log(1.0 / np.cos(np.arcsin(0.99))) - np.log(1.0 / np.cos(np.radians(30.0)))
    assert plain.departures["equal-area"] == pytest.approx(below, rel=0.1)


def test_errors_by_closed_forms() -> None:
    """Of Mercator's map between the equator and 60 degrees: k = sec, whose mean by area is the gd's integral."""
    found = info("mercator", "box:0,0,30,60")
    h, omega = found.measures["h"], found.measures["omega"]
    assert h.mean.value == pytest.approx(np.radians(60.0) / np.sin(np.radians(60.0)), abs=max(h.mean.error, 1e-12))
    assert h.maximum.value == pytest.approx(2.0, abs=1e-9)
    assert found.measures["s"].maximum.value == pytest.approx(4.0, abs=1e-8)
    assert found.measures["scale_error_ppm"].maximum.value == pytest.approx(1e6, abs=1e-2)
    assert omega.maximum.value == pytest.approx(0.0, abs=1e-6)
    assert found.coverage == 1.0
    assert found.airy_kavrayskiy.raw > found.airy_kavrayskiy.scaled > 0.0


def test_what_is_stated() -> None:
    """The region is the area of use; the dictionary and the frame have what the registry has."""
    found = info("EPSG:3035")
    stated = found.to_dict()
    assert found.region == Box(-35.58, 24.6, 44.83, 84.73)
    assert stated["area_of_use"]["bounds"] == [-35.58, 24.6, 44.83, 84.73]
    assert [axis["direction"] for axis in stated["axes"]] == ["north", "east"]
    assert (stated["unit"], stated["deprecated"]) == ({"name": "metre", "metres": 1.0}, False)
    assert stated["ellipsoid"] == {"name": "GRS 1980", "a": 6378137.0, "inverse_flattening": 298.257222101}
    assert {one["name"]: one["value"] for one in stated["parameters"]} == {
        "Latitude of natural origin": 52.0,
        "Longitude of natural origin": 10.0,
        "False easting": 4321000.0,
        "False northing": 3210000.0,
    }
    assert repr(found).startswith("MapInfo(ETRS89-extended / LAEA Europe, equal-area; AK 0.0323")
    pytest.importorskip("pandas")
    frame = found.to_frame()
    assert (len(frame), frame.keeps[0], frame["axes"][0]) == (1, "equal-area", "north;east")


@pytest.mark.slow
def test_what_diverges() -> None:
    """Scales without bound are null, and nothing of JSON is infinite."""
    found = info("mercator")
    assert found.to_dict()["errors"]["s"]["max"] is None
    assert projdist.info("mercator").to_json()
