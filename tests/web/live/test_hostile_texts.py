"""Whatever is typed on a page, PROJ opens no file for it; and what needs none is a map there as elsewhere."""

import contextlib
import csv
import importlib.resources
import json
import os
import shutil
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hostile_texts import EQUALS, MARK, PATHS, READERS, SEPARATORS, WRAPS, hostile_texts, outcomes
from pyproj import CRS
from pyproj.database import query_crs_info
from pyproj.enums import PJType
from pyproj.exceptions import CRSError
from refusals import refuses
from tables import each

from projdist import projections
from projdist.projections import Projection, file_named_in
from projdist.web.live.dispatcher import InputPolicy

TEXTS = hostile_texts()
MONSTERS = ["[" * 4000, "[" * 1000, "=" * 4000, "=" * 1000, "+" * 9000, ";" * 9000, "urn:ogc:def:crs:" * 900]


def assert_nothing_is_opened(texts: list[str], found: list[dict[str, Any]]) -> None:
    """And of each there is a map, or a problem in one line."""
    for text, one in zip(texts, found, strict=True):
        assert one["opened"] == [], text
        assert "map" in one or "\n" not in one["map problem"], text
        assert "region" in one or "\n" not in one["region problem"], text


@pytest.mark.slow
def test_no_hostile_text_opens_a_file(tmp_path: Path) -> None:
    """One in six hundred of them; behind open policy PROJ asks for the files of every way to name one, and says so."""
    path = "./h0stile.gsb"
    texts = [f"+proj={words.format('+', '=', path)}" for words in READERS]
    texts += [wrap("hgridshift +grids=./h0stile.gsb") for wrap in WRAPS.values()]
    closed, asked = outcomes(TEXTS[::600], texts, tmp_path)
    assert_nothing_is_opened(TEXTS[::600], closed)
    opened = ["h0stile.gsb" in one["opened"] for one in asked]
    assert sum(opened[: len(READERS)]) >= 9
    assert sum(opened[len(READERS) :]) >= 15


@each("key", ["proj", "+proj", "+o_proj"])
@each("reader", ["defmodel", "gridshift", "hgridshift", "vgridshift", "xyzgridshift", "tinshift"])
def test_operations_that_read_files_are_named(key: str, reader: str) -> None:
    """Also as the map that ob_tran turns, and whatever else they state."""
    before = "+proj=ob_tran +o_lat_p=40 " if key == "+o_proj" else ""
    assert file_named_in(f"{before}{key}={reader}") == f"{key}={reader}"


@pytest.mark.slow
def test_hundreds_of_hostile_texts_open_no_file(tmp_path: Path) -> None:
    """One in eleven of thousands, of each wrap, operation, path, separator and sign."""
    assert len(TEXTS) > len(WRAPS) * (len(READERS) * len(PATHS) + 2 * (len(SEPARATORS) + len(EQUALS))) * 0.9 > 5000
    assert_nothing_is_opened(TEXTS[::11], outcomes(TEXTS[::11], [], tmp_path)[0])


@pytest.mark.skipif(shutil.which("strace") is None, reason="needs strace")
@pytest.mark.slow
@pytest.mark.parametrize("how", ["closed", "open"])
def test_the_system_is_asked_for_no_file(how: str, tmp_path: Path) -> None:
    """By its own words, as PROJ's may be incomplete; behind open policy it is."""
    log = tmp_path / "calls"
    before = ("strace", "-f", "-s", "300", "-e", "trace=%file,%network", "-o", str(log))
    outcomes(*((TEXTS[::80], []) if how == "closed" else ([], TEXTS[::80])), tmp_path, before)
    lines = log.read_text(errors="replace").splitlines()
    asked = [line for line in lines if MARK in line and "inotify_add_watch" not in line]
    assert bool(asked) == (how == "open"), asked[:5]


@pytest.mark.slow
@each("text", [
    "{" * 9000, "PROJCS[" * 2000, "PROJCS(" * 2000 + ")" * 2000, "(" * 9000, '{"a":' * 3000,
    '{"a":' * 3000 + "1" + "}" * 3000, '{"a":[' * 900 + "]}" * 900, f'{{"a": {"9" * 5000}}}', '{"a": 1e999}',
    '{"proj": "merc", "lat_ts": NaN}', '{"proj": "merc", "R": 1e999}', '{"proj": ["merc"]}', '{"proj": null}',
    "+proj=merc +lat_ts=nan", "+proj=merc +R=1e999", "+proj=merc +k_0=inf", f"+proj=merc +R={'9' * 9000}",
    "+proj=merc +lat_ts=" * 900, "+proj=pipeline " + "+step +proj=merc " * 1000, "robinson" + "+lon_0=1" * 2000,
    "x" * 20_001, "x" * 1_000_000, "é" * 20_000, '"' * 20_000, "PROJCS[" + '"' * 9000, "\u202e" * 100, "\ud800",
    "proj=" * 3000, "EPSG:" + "9" * 9000, "{}", "[]",
    *MONSTERS,
])  # fmt: skip
def test_monsters_are_refused(text: str) -> None:
    """In one line that is no longer than others, as projections and as regions."""
    policy = InputPolicy()
    for ask, given in ((policy.projection, text), (policy.region, text), (policy.region, f"crs:{text}")):
        refuses(r"^[^\n]{1,999}\Z", ask, given)


def forms_of(crs: CRS) -> list[str]:
    """A CRS in all the texts that pyproj makes of it."""
    found = [crs.name, crs.to_json(), crs.to_json(pretty=True), crs.to_wkt("WKT2_2019", pretty=True)]
    for version in ("WKT2_2015", "WKT2_2019_SIMPLIFIED", "WKT1_GDAL", "WKT1_ESRI"):
        with contextlib.suppress(CRSError):  # PROJ has no such text of some
            found.append(crs.to_wkt(version))
    with warnings.catch_warnings(), contextlib.suppress(CRSError):
        warnings.simplefilter("ignore")  # of what a PROJ string loses
        found.append(crs.to_proj4())
    return found


def some_crss(step: int) -> list[str]:
    """The code of one projected CRS of PROJ's in so many."""
    found = query_crs_info(pj_types=[PJType.PROJECTED_CRS], allow_deprecated=True)
    return [f"{info.auth_name}:{info.code}" for info in found[::step]]


@pytest.mark.slow
def test_no_crs_names_a_file() -> None:
    for code in some_crss(23):
        for text in (code, *forms_of(CRS(code))):
            assert file_named_in(text) == "", text


@pytest.mark.slow
def test_crss_are_maps_behind_closed_doors() -> None:
    for text in (CRS(code).to_wkt() for code in some_crss(150)):
        assert InputPolicy().projection(text) == Projection.from_user_input(text)


def test_names_are_open() -> None:
    for name, string in projections.projection_names().items():
        assert (file_named_in(name), file_named_in(string)) == ("", "")


def test_parameters_are_open() -> None:
    """Every number of every operation, in all the spellings of numbers and angles."""
    table = importlib.resources.files("projdist") / "data" / "parameter_ranges.csv"
    rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    assert len(rows) > 100
    for row in rows:
        for value in ("1", "-1.5", "+1e-3", ".5", "1_000", "10d30'15\"W", "10.5N", "0.18r", "10°30'"):
            assert file_named_in(f"+proj={row['operation']} +{row['key']}={value} +ellps=GRS80 +units=us-ft") == ""


DESIGN = (
    "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=omerc +ellps=WGS84 +lonc=8.2 "
    "+lat_0=46.8 +alpha=78 +k_0=0.99997 +step +proj=horner +deg=2 +range=1e8 +inv_tolerance=1e-6 "
    "+fwd_origin=0.0,-1431.0 +fwd_c=4.27,0.0004,0.99999,-4.9e-09,-1.8e-11,1.17E-11 "
    "+step +proj=affine +xoff=5833.0 +s11=-1.0 +s12=-0.0"
)


def test_designs_are_open() -> None:
    """Pipelines of polynomials, and their CRSs in WKT, of either kind."""
    base, *steps = DESIGN.split(" +step ")[2:]
    made = projections.derived_crs(
        Projection.from_user_input(base), steps, "a design", projections.AreaOfUse("a box", (5.0, 45.0, 11.0, 49.0))
    )
    assert file_named_in(CRS(made.wkt).to_wkt("WKT1_GDAL")) == ""
    for text in (DESIGN, made.pipeline, made.wkt, made.wkt_derived, made.projjson, CRS(made.wkt_derived).to_json()):
        assert np.isfinite(InputPolicy().projection(text)(8.0, 47.0)).all()


SHIFT = """
import json, pyproj, pyproj.network, sys, threading
found = {}
def ask():
    shifted = pyproj.Transformer.from_pipeline("+proj=merc +datum=NAD27").transform(-100.0, 40.0)
    found[threading.current_thread().name] = [pyproj.network.is_network_enabled(), *shifted]
ask()
thread = threading.Thread(target=ask, name="other")
thread.start()
thread.join()
print(json.dumps(found))
"""


def shifts(folder: Path, more: dict[str, str]) -> list[list[float]]:
    """Whether PROJ may use the network, and where it puts a point of NAD27, in two threads, with a user's folder."""
    env = os.environ | {"PROJ_NETWORK": "ON", "PROJ_NETWORK_ENDPOINT": "http://127.0.0.1:9", "PROJ_DATA": str(folder)}
    env |= {"PROJ_USER_WRITABLE_DIRECTORY": str(folder), **more}
    found = subprocess.run([sys.executable, "-c", SHIFT], env=env, capture_output=True, text=True, check=True)
    return list(json.loads(found.stdout).values())


def grid(shift: float) -> bytes:
    """A grid of NAD27 in PROJ's old format, CTABLE V2, that moves North America by so many degrees east."""
    origin, step, size = np.radians([-130.0, 20.0]), np.radians([70.0, 40.0]), np.array([2, 2], dtype="<i4")
    head = b"CTABLE V2.0".ljust(16) + b"a user's grid".ljust(80) + np.append(origin, step).astype("<f8").tobytes()
    return (head + size.tobytes()).ljust(160, b"\0") + np.tile(np.radians([-shift, 0.0]), 4).astype("<f4").tobytes()


@pytest.mark.slow
def test_processes_of_a_page_have_no_grids_of_the_user(tmp_path: Path) -> None:
    """Nor a network: a grid in the user's folder moves a point elsewhere, by what is in it, and not there."""
    (tmp_path / "conus").write_bytes(grid(0.5))
    (plain, east, _), (_, other, _) = shifts(tmp_path, {})
    (here, west, _), (there, west_there, _) = shifts(tmp_path, projections.environment_without_files())
    assert (plain, here, there, east) == (True, False, False, other)
    assert abs(east - west) == pytest.approx(np.radians(0.5) * 6378206.4, rel=1e-6)
    assert west == west_there == pytest.approx(np.radians(-100.0) * 6378206.4)


def test_the_user_may_have_his_grids() -> None:
    """Who names a file on the command line has PROJ as he has set it up; names, codes and countries are none."""
    for opened in ({"robinson", "country:DE"}, {"EPSG:3035", "box:1,2,3,4 - crs:EPSG:3035"}, {"WGS 84 / UTM zone 32N"}):
        assert InputPolicy(frozenset(opened)).environment() == projections.environment_without_files()
    for text in ("+proj=merc +nadgrids=x.gsb", "file:x.gpkg", "globe - points:x.csv", "map.prj", "file:abc"):
        assert InputPolicy(frozenset({text, "globe"})).environment() == {}
