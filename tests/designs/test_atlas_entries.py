"""The atlas as it is shipped, whole and right by pyproj; its regions, and an entry against what is known of caps."""

import gzip
import importlib.resources
import json
import math
import zlib
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pyproj
import pytest
from atlas_measurement import _scale_error, atlas_areas, measured_entry
from pyproj.database import query_crs_info
from pyproj.enums import PJType
from refusals import refuses
from tables import each, some

from projdist.decisions import CLOSE, WIDE_FACTOR
from projdist.designs import atlas, atlas_names
from projdist.regions import definition, get_region, region_names

NAMES, WHAT = atlas_names(), ("existing", "custom", "made")
FEW = [name for name in NAMES if zlib.crc32(name.encode()) % 12 == 0]  # whatever their order
A, E2 = 6378137.0, 0.0066943799901413165  # of WGS 84

# A lattice's mean is that of the region to a few per cent, as islands and coasts lie between its points; its largest
# values are missed by as much. Factors of a sphere in place of the ellipsoid's are off by 0.7 %.
OF_LATTICE = 0.06


def test_the_largest_scale_error_is_that_of_either_side() -> None:
    for least, most, ppm in ((0.999, 1.0004, 1000.0), (0.9998, 1.0007, 700.0)):
        found = SimpleNamespace(smallest=SimpleNamespace(value=least), largest=SimpleNamespace(value=most))
        assert _scale_error(found) == pytest.approx(ppm)


def test_every_place_once() -> None:
    """Under a name that finds it: no two are of one name, or of one kind and title. Every named region is there."""
    entries = [atlas(name) for name in NAMES]
    assert len(set(NAMES)) == len({(one.title, one.kind) for one in entries}) == len({one.region for one in entries})
    kinds = Counter(entry.kind for entry in entries)
    assert (kinds["country"], kinds["continent"], kinds["state"]) == (240, 7, 56)
    assert {*region_names()} - {*NAMES} == {"globe", "land", "ocean"}


@pytest.mark.slow
def test_every_region_is_there() -> None:
    areas = atlas_areas()
    assert [(entry.title, entry.kind, entry.region) for entry in map(atlas, NAMES)] == [tuple(area) for area in areas]
    truth = [get_region(area.text).area_km2 for area in areas]
    assert [atlas(name).area_km2 for name in NAMES] == pytest.approx(truth, rel=1e-9)
    # A country's main part and those far away have its area; those of boxes lose or win nothing.
    for main in (area for area in areas if area.text.endswith("@main") and area.kind == "country"):
        parts = [area for area in areas if area.kind == "part" and area.title.startswith(f"{main.title}, ")]
        together = sum(get_region(area.text).area_km2 for area in (main, *parts))
        assert together == pytest.approx(get_region(f"country:{main.title}@all").area_km2, rel=1e-9), main.title


@each(("asked", "title", "kind"), [
    ("NZ", "New Zealand", "country"), ("new zealand", "New Zealand", "country"),
    ("country:NZL", "New Zealand", "country"), ("CA", "Canada", "country"), ("state:CA", "California, USA", "state"),
    ("Texas", "Texas, USA", "state"), ("Georgia", "Georgia", "country"), ("Antarctica", "Antarctica", "country"),
    ("continent:Antarctica", "Antarctica", "continent"), ("Cote d'Ivoire", "Côte d'Ivoire", "country"),
    ("north atlantic", "North Atlantic", "ocean"), ("utm zone 33n", "UTM zone 33N", "zone"),
    ("france cayenne", "France, Cayenne", "part"), ("EU", "European Union", "area"),
    ("Mercosur", "Mercosur", "area"), ("Southeast Asia", "South-eastern Asia", "area"),
    ("lower 48", "Contiguous United States", "area"), ("area:Iberia", "Iberian Peninsula", "area"),
])  # fmt: skip
def test_names(asked: str, title: str, kind: str) -> None:
    entry = atlas(asked)
    assert (entry.title, entry.kind) == (title, kind)


@each(("asked", "advice"), [
    ("Brazl", "Did you mean country:Brazil?"), ("UTM zone 17N", "ask for these"), ("", "atlas_names"),
    ("box:1,2,3,4", "atlas_names"),
])  # fmt: skip
def test_what_is_not_there(asked: str, advice: str) -> None:
    refuses(f"Invalid place '{asked}'. .*{advice}", atlas, asked)
    for unlike in (None, 3, b"NZ"):
        with pytest.raises(TypeError, match="It must be text"):
            atlas(unlike)


AROUND_POLES = {"continent:Antarctica", "country:Antarctica", "Southern Ocean", "Arctic Ocean"}
CUT_CONES = {"Southern Ocean"}  # about a pole a cone that is cut within the place has less than any map in one piece
SIX_DIGITS = 1.0 + 2e-4  # of the maps' parameters; extremes are good to more


@pytest.mark.slow
@each("name", NAMES)
def test_an_entry_is_sound(name: str) -> None:
    entry = atlas(name)
    if name in FEW[::4]:  # of all in a slow test
        assert entry.area_km2 == pytest.approx(get_region(entry.region).area_km2, rel=1e-9)
    assert json.loads(entry.to_json()) == entry.to_dict()
    of_one = entry.kind in ("country", "part", "state") or definition(entry.region)["definition"].count("country:") == 1
    assert entry.official is None or (of_one and entry.official.national)
    for purpose in ("conformal", "equal-area"):
        for one in (entry.purposes[purpose].existing, entry.purposes[purpose].custom):
            assert one is None or purpose in (one.keeps or ())
    for purpose in entry.purposes.values():
        for one in purpose.maps.values():
            assert (one.airy_kavrayskiy or 0.0) > 0.0
            assert one.mean_scale_error_ppm is None or one.mean_scale_error_ppm <= (one.max_scale_error_ppm or np.inf)
        custom, made = purpose.custom, purpose.made
        if purpose.criterion == "airy_kavrayskiy" and custom and made and not custom.cut_km:  # cut maps may have less
            assert made.airy_kavrayskiy <= custom.airy_kavrayskiy
        if name in AROUND_POLES and custom:  # it is whole, and above the limit, which is good to some per cent
            assert custom.cut_km == 0.0
            assert custom.airy_kavrayskiy > 0.95 * (purpose.limit or 0.0)
    best, conformal = entry.purposes["any"], entry.purposes["conformal"]
    if best.made is not None and conformal.made is not None:
        assert best.made.airy_kavrayskiy <= 1.01 * conformal.made.airy_kavrayskiy
    assert entry.purposes["compromise"].made == best.made
    least = entry.purposes["least scale error"]
    if least.made is not None and least.custom is not None and name not in CUT_CONES:
        assert least.made.max_scale_error_ppm <= SIX_DIGITS * least.custom.max_scale_error_ppm


def lattice(name: str, count: int = 400) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Longitudes, latitudes and shares of the area of points of a region."""
    region = get_region(atlas(name).region)
    west, south, east, north = region.bounds
    size, held = 20, np.zeros(1)
    while held.sum() < count:
        share = (np.arange(size) + 0.5) / size
        lon, lat = np.meshgrid(west + (east - west) * share, south + (north - south) * share)
        held = region.contains(lon, lat)
        size = int(1.5 * size)
    lon, lat = np.mod(lon[held] + 180.0, 360.0) - 180.0, lat[held]
    weight = np.cos(np.radians(lat)) / (1.0 - E2 * np.sin(np.radians(lat)) ** 2) ** 2
    return lon, lat, weight / weight.sum()


def errors(definition: str, lon: np.ndarray, lat: np.ndarray, weight: np.ndarray) -> tuple[float, ...]:
    """The Airy-Kavrayskiy error, largest |ln a| or |ln b|, omega, range of ln s: differences of PROJ's coordinates."""
    if definition.startswith("+proj=pipeline"):
        forward, a, e2 = pyproj.Transformer.from_pipeline(definition).transform, A, E2
    else:
        ellipsoid = pyproj.CRS(definition).ellipsoid
        forward, a = pyproj.Proj(definition, preserve_units=False), ellipsoid.semi_major_metre
        parameters = dict(token.partition("=")[::2] for token in forward.definition.split())
        if parameters["proj"] == "eqc":
            # By formulas of the sphere in PROJ 9.5, which the atlas was measured with, of the ellipsoid in 9.8.
            forward = pyproj.Proj(f"+proj=eqc +lat_ts={parameters['lat_ts']} +lon_0={parameters['lon_0']} +R={a}")
        e2 = 1.0 - (ellipsoid.semi_minor_metre / a) ** 2
    step = 1e-4  # degrees: 11 m, of which the rounding of coordinates is 1e-10
    ends = [np.array(forward(lon + u, lat + v)) for u, v in ((-step, 0), (step, 0), (0, -step), (0, step))]
    with np.errstate(all="ignore"):  # of places that are not on the map
        west, east, south, north = (x + 1j * y for x, y in ends)
        w = 1.0 - e2 * np.sin(np.radians(lat)) ** 2
        by_lon = (east - west) * np.sqrt(w) / (a * np.cos(np.radians(lat)) * np.radians(2.0 * step))
        by_lat = (north - south) * w**1.5 / (a * (1.0 - e2) * np.radians(2.0 * step))
        half_sum, half_difference = 0.5 * np.abs(by_lon - 1j * by_lat), 0.5 * np.abs(by_lon + 1j * by_lat)
        logs = np.log(np.abs([half_sum + half_difference, half_sum - half_difference]))
        omega = np.degrees(2.0 * np.arcsin(np.divide(*np.sort([half_difference, half_sum], axis=0))))
    error = np.sqrt(weight @ (logs**2).sum(axis=0))
    return tuple(map(float, (error, np.abs(logs).max(), omega.max(), np.ptp(logs.sum(axis=0)))))


@pytest.mark.slow
@pytest.mark.parametrize("name", FEW)
def test_maps_by_pyproj(name: str) -> None:
    """The errors of existing, custom and made maps are those of PROJ's coordinates; none is above the largest."""
    points, entry = lattice(name), atlas(name)
    for purpose in entry.purposes.values():
        for what, one in purpose.maps.items():
            if one.cut_km:
                continue
            error, largest, *_ = errors(one.projection, *points)
            assert error == pytest.approx(one.airy_kavrayskiy, rel=3 * OF_LATTICE, abs=1e-8), (purpose.name, what)
            scale = 1e-6 * (one.max_scale_error_ppm or np.nan)
            assert largest <= max(np.log1p(scale), -np.log1p(-min(scale, 0.999999))) + 1e-8, (purpose.name, what)


def test_no_figure_is_missing() -> None:
    """Of no map, however small or polar the place: what a map has is a number, and a made map is there everywhere."""
    file = importlib.resources.files("projdist") / "data" / "atlas.jsonl.gz"
    entries = [json.loads(line) for line in gzip.decompress(file.read_bytes()).splitlines()[1:]]
    sets = [one["official"] for one in entries]
    sets += [one["purposes"][key][what] for one in entries for key in one["purposes"] for what in WHAT]
    sets = [found for found in sets if found is not None]
    assert len(sets) > 5000
    assert not [found for found in sets if "error" in found or None in found.values()]
    assert np.isfinite([value for found in sets for value in found.values() if isinstance(value, float)]).all()


SPOT_CHECKED = [f"country:{name}" for name in "Brazil Norway Kenya Japan Chile Poland Indonesia".split()]
SPOT_CHECKED += ["country:New Zealand", "state:Texas", "continent:Africa", "area:European Union"]


def width_of(area: object) -> float:
    return (area.east - area.west) % 360.0 or 360.0


def share_within(area: object, lon: np.ndarray, lat: np.ndarray, weight: np.ndarray) -> float:
    """The share of the points within an area of use."""
    held = (np.mod(lon - area.west, 360.0) <= width_of(area)) & (lat >= area.south) & (lat <= area.north)
    return float(weight @ held)


@pytest.mark.slow
@pytest.mark.parametrize("name", some(SPOT_CHECKED, 3))
def test_no_crs_is_better(name: str) -> None:
    """By pyproj's coordinates at a lattice none of all CRSs of EPSG and Esri counts less than the best that is told."""
    # A CRS counts its error over the share of the place in its area of use, and those a tenth above the best are as
    # good. What is for the world or a continent counts double: here none does, so that the best may be above those by
    # as much.
    points, entry = lattice(name, 1500), atlas(name)
    counts: dict[str, dict[str, float]] = {purpose: {} for purpose in ("any", "conformal", "equal-area")}
    for authority in ("EPSG", "ESRI"):
        for info in query_crs_info(authority, pj_types=[PJType.PROJECTED_CRS]):
            share = share_within(info.area_of_use, *points) if info.area_of_use else 0.0
            if share < 0.5:
                continue
            code = f"{authority}:{info.code}"
            try:
                error, _, omega, areas = errors(code, *points)
            except pyproj.exceptions.ProjError:
                continue
            if pyproj.CRS(code).ellipsoid.inverse_flattening == 0.0 or not np.isfinite(error):
                continue  # of a sphere
            for purpose, keeps in (("any", True), ("conformal", omega < 1e-4), ("equal-area", areas < 1e-6)):
                if keeps:
                    counts[purpose][code] = error / share
    for purpose, found in counts.items():
        assert found, purpose
        best = entry.purposes[purpose].existing
        told = (best.airy_kavrayskiy or 0.0) / (best.share or 1.0)
        wide = [code for code, count in found.items() if told > (1.0 + CLOSE + OF_LATTICE) * count]
        assert all(told <= WIDE_FACTOR * (1.0 + CLOSE + OF_LATTICE) * found[code] for code in wide), purpose
        assert all(is_wide(code) for code in wide), (purpose, wide)


def is_wide(code: str) -> bool:
    """Whether a CRS is for more than a zone of UTM has: five million square kilometres of 510."""
    area = pyproj.CRS(code).area_of_use
    return width_of(area) / 360.0 * np.ptp(np.sin(np.radians([area.south, area.north]))) / 2.0 > 5.0 / 510.0


CAP_KM = 300.0
OF_LIMIT = 0.02  # the Earth is no sphere, and a made map stops where degrees gain less than 1 %


@pytest.mark.slow
def test_an_entry() -> None:
    """Over a cap of radius r no map has less than r^2 / sqrt(192), no conformal one than sqrt(2) times that."""
    least = (CAP_KM / 6371.0) ** 2 / math.sqrt(192.0)
    entry = measured_entry(get_region(f"cap:10,50,{CAP_KM}"))
    for purpose, times in (("any", 1.0), ("conformal", math.sqrt(2.0))):
        found = entry["purposes"][purpose]
        assert found["limit"] == pytest.approx(times * least, rel=OF_LIMIT)
        assert found["made"]["airy_kavrayskiy"] == pytest.approx(times * least, rel=OF_LIMIT)
        assert found["custom"]["airy_kavrayskiy"] > (1.0 - OF_LIMIT) * times * least
        assert found["existing"]["airy_kavrayskiy"] >= found["custom"]["airy_kavrayskiy"]
    assert all(name in entry["purposes"][name]["existing"]["keeps"] for name in ("conformal", "equal-area"))
    scale = entry["purposes"]["least scale error"]["existing"]["max_scale_error_ppm"]
    assert all(scale <= WIDE_FACTOR * one["existing"]["max_scale_error_ppm"] for one in entry["purposes"].values())
    assert json.loads(json.dumps(entry)) == entry
