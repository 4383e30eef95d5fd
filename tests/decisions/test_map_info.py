"""A map by itself: what it keeps and how large its errors are, against closed forms and what is known of methods."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from gis_files import some_slow
from tables import each

import projdist
from projdist import SPHERE, WGS84, Box, Cap, info
from projdist._typing import FloatArray
from projdist.decisions.map_info import PROPERTIES, _square_across, properties_of
from projdist.decisions.measurement import probe_of
from projdist.field import jacobian
from projdist.projections import Projection

# Snyder & Voxland 1989, An Album of Map Projections, says of each what it keeps; of the CRSs, EPSG's Guidance Note 7-2.
KNOWN = {
    "mercator": ("conformal",), "stere": ("conformal",), "lagrange": ("conformal",), "mollweide": ("equal-area",),
    "hatano": ("equal-area",), "sinu": ("equal-area",), "goode": ("equal-area",), "gott-elliptical": ("equal-area",),
    "plate-carree": ("equidistant",), "aeqd": ("equidistant",), "robinson": (), "winkel-tripel": (),
    "EPSG:32633": ("conformal",), "EPSG:5514": ("conformal",), "EPSG:6933": ("equal-area",),
    # A square of 50 km, in which every map is nearly everything.
    "EPSG:2326": ("conformal",),
    # Formulas of the sphere on an ellipsoid.
    "EPSG:3857": (), "ESRI:54009": (),
}  # fmt: skip
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


RNG = np.random.default_rng(5)


@dataclass(frozen=True)
class Points:
    """Points with even weights all over the globe, or in a square of some degrees."""

    lon: FloatArray
    lat: FloatArray
    weight: FloatArray


def points(width: float = 360.0, n: int = 400) -> Points:
    lon, height = width * RNG.uniform(-0.5, 0.5, n), np.sin(np.radians(min(0.5 * width, 90.0)))
    return Points(lon, np.degrees(np.arcsin(height * RNG.uniform(-1.0, 1.0, n))), np.full(n, 1.0 / n))


GLOBE = points()


def diagonal(a: FloatArray, b: FloatArray) -> FloatArray:
    """Matrices with these singular values, times random rotations, which change no figure."""
    angle = RNG.uniform(0, 2 * np.pi, len(a))
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]).transpose(2, 0, 1)
    J = np.zeros((len(a), 2, 2))
    J[:, 0, 0], J[:, 1, 1] = a, b
    return np.asarray(rotation @ J)


K = RNG.uniform(0.99, 1.02, 400)
FIELDS = {
    "conformal": (diagonal(K, K), ("conformal",)),
    "equal-area": (diagonal(K, 0.819 / K), ("equal-area",)),
    "equidistant": (diagonal(np.ones(400), K), ("equidistant",)),
    "true": (diagonal(np.ones(400), np.ones(400)), tuple(PROPERTIES)),
    "compromise": (diagonal(K, RNG.uniform(0.98, 0.985, 400)), ()),
}


@each("name", FIELDS)
def test_properties(name: str) -> None:
    """Equal-area is a constant areal scale, whatever it is; conformal a = b; equidistant a or b = 1 everywhere."""
    J, kept = FIELDS[name]
    assert properties_of(J, GLOBE).keeps == kept


@each(("width", "error", "kept"), [(360, 4e-6, True), (360, 1e-4, False), (0.1, 4e-6, False)])
def test_limits(width: float, error: float, kept: bool) -> None:
    """What PROJ's iterations leave is rounding in maps of the world; the same is much in a town."""
    found = properties_of(diagonal(K * (1.0 + error), K), points(width))
    assert found.departures["conformal"] == pytest.approx(np.log1p(error), rel=1e-6)
    assert ("conformal" in found.keeps) == kept


def test_poles_do_not_count() -> None:
    """Half a per cent of the area may be anything, and what is undefined or on the edges has no part."""
    # Where no matrix is defined nothing is kept, and nobody knows how far off it is.
    J = FIELDS["conformal"][0].copy()
    J[:2, 0, 0] *= 2.0
    assert properties_of(J, GLOBE).keeps == ("conformal",)
    J[2:300] = np.nan
    assert properties_of(J, GLOBE).keeps == ()
    edges = Points(GLOBE.lon, GLOBE.lat, np.where(np.arange(400) < 2, 0.0, GLOBE.weight))
    assert properties_of(J, edges).keeps == ("conformal",)
    none = properties_of(np.full((400, 2, 2), np.nan), GLOBE)
    assert none.keeps == ()
    assert np.isnan(list(none.departures.values())).all()


def test_the_size_of_a_strip_is_its_width() -> None:
    """What maps are off by grows across it: a degree to either side of a meridian has a third of its square."""
    lat = np.degrees(np.arcsin(RNG.uniform(-0.7, 0.7, 4000)))
    lon = 30.0 + np.linspace(-1.0, 1.0, 4000) / np.cos(np.radians(lat))
    found = _square_across(lon, lat, np.full(4000, 1.0 / 4000.0))
    assert found == pytest.approx(np.radians(1.0) ** 2 / 3.0, rel=1e-2)


# By method: EPSG Guidance Note 7-2. Formulas of the sphere on the ellipsoid keep neither angles nor areas.
METHODS = {
    "EPSG:32632": ("conformal",), "EPSG:2056": ("conformal",), "EPSG:3035": ("equal-area",),
    "EPSG:9191": ("equal-area",), "+proj=cass +lat_0=47 +lon_0=8.5 +R=6371000": ("equidistant",), "EPSG:3857": (),
    "ESRI:54009": (),
}  # fmt: skip


@each("km", [1.0, 10.0, 100.0, 500.0])
@each("given", METHODS)
def test_regions_of_any_size(given: str, km: float) -> None:
    """A town's maps keep what they keep of a country, though all are nearly true in it."""
    probe = probe_of(Cap(8.2, 46.8, km))
    J = jacobian(Projection.from_user_input(given), probe.lon, probe.lat)
    assert properties_of(J, probe).keeps == METHODS[given]


def test_off_by_curvature() -> None:
    """Seen from far away a sphere has the areal scale cos(rho): even between 1 and that of the rim, by area."""
    n, rim = 2000, 100e3 / SPHERE.a
    share = (np.arange(n) + 0.5) / n
    rho, bearing = np.arccos(1.0 - share * (1.0 - np.cos(rim))), 2.4 * np.arange(n)
    lon = np.degrees(np.arctan2(np.sin(rho) * np.sin(bearing), np.cos(rho)))
    cap = Points(lon, np.degrees(np.arcsin(np.sin(rho) * np.cos(bearing))), np.full(n, 1.0 / n))
    J = jacobian(Projection.from_user_input(f"+proj=ortho +R={SPHERE.a}"), cap.lon, cap.lat)
    # From the median, with half of the area on either side, 99 % are within 0.99 / 2 of it.
    assert properties_of(J, cap).departures["equal-area"] == pytest.approx(0.5 * rim**2 * 0.99 * 0.5, rel=2e-3)
