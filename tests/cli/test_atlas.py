"""The command `atlas`."""

import functools
import gzip
import importlib.resources
import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import parse_csv, parse_markdown, refusal, run_json, run_ok

from projdist import atlas, atlas_names

ERROR = "airy_kavrayskiy"
# The area of an outline whose parallels are chords: the error of the largest steps, which are those of UTM zones.
OF_CHORDS = 2e-3


@pytest.mark.slow
def test_a_table() -> None:
    """The official CRS first, then the best of each purpose; what the words mean; and the versions."""
    assert run_ok("atlas", "NZ").startswith("The official map of New Zealand is EPSG:2193 (NZGD2000 / New Zealand Tran")
    assert re.search(r"│ official +│ EPSG:2193 +│ NZGD2000 │ +0.08 % │ +0.28 % │\n", run_ok("atlas", "NZ"))
    text = run_ok("atlas", "NZ", "--details")
    first = r"\nNew Zealand \(26.*\n┡[^\n]*\n│ +- +│ official │ EPSG:2193.*New Zealand Transverse Mercator 2000"
    assert re.search(rf"{first}.*Measured with projdist \S+ and PROJ \S+", text, re.DOTALL)
    entry = atlas("NZ")
    assert run_json("atlas", "new zealand") == entry.to_dict()
    rows = parse_csv(run_ok("atlas", "NZ", "-f", "csv"))
    assert [row["projection"] for row in rows] == [row["projection"] for row in entry.rows()]
    assert parse_markdown(run_ok("atlas", "NZ", "-f", "markdown"))[0]["map"] == "EPSG:2193"


@pytest.mark.slow
def test_all_places() -> None:
    rows = parse_csv(run_ok("atlas", "-f", "csv"))
    assert len(rows) == len(atlas_names())
    (row,) = (row for row in rows if row["place"] == "New Zealand")
    assert (row["official"], row["kind"]) == ("EPSG:2193", "country")
    assert len(run_json("atlas")["entries"]) == len(rows)


# ---- export ---------------------------------------------------------------------------------


@functools.cache
def shipped() -> list[dict[str, Any]]:
    """The entries of the file in the package, as they stand there."""
    file = importlib.resources.files("projdist") / "data" / "atlas.jsonl.gz"
    return [json.loads(line) for line in gzip.decompress(file.read_bytes()).splitlines()[1:]]


def maps_of(entry: dict[str, Any]) -> list[tuple[str, str, str, float]]:
    """The title, the purpose, the map and its error of each row that an entry should have."""
    rows = [] if entry["official"] is None else [("", entry["official"])]
    for purpose, best in entry["purposes"].items():
        rows += [
            (purpose, one) for one in (best["existing"], best["custom"], best["made"]) if one and "error" not in one
        ]
    names = ((purpose, one.get("code") or one["proj"], one[ERROR]) for purpose, one in rows)
    return [(entry["title"], purpose, name, np.nan if error is None else error) for purpose, name, error in names]


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_exported_tables(suffix: str, tmp_path: Path) -> None:
    """Read by pandas, they have the rows and the figures of the package's file."""
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    path = tmp_path / f"atlas{suffix}"
    assert run_ok("atlas", "--export", str(path)) == f"Wrote: {path}\n"
    read = functools.partial(pandas.read_csv, dtype={ERROR: str, "area_km2": str})  # old versions round the last bit
    frame = read(path) if suffix == ".csv" else pandas.read_parquet(path)
    truth = [row for entry in shipped() for row in maps_of(entry)]
    titles, purposes, names, errors = zip(*truth, strict=True)
    assert (tuple(frame.region), tuple(frame.purpose.fillna("")), tuple(frame.projection)) == (titles, purposes, names)
    np.testing.assert_array_equal(frame[ERROR].map(float), errors)
    areas = {entry["title"]: entry["area_km2"] for entry in shipped() if entry["kind"] == "country"}
    countries = frame[frame.kind == "country"]
    np.testing.assert_array_equal(countries.area_km2.map(float), countries.region.map(areas))


@pytest.mark.slow
def test_exported_outlines(tmp_path: Path) -> None:
    """Read by geopandas, they have a feature for each place, in whose outline its area is."""
    geopandas = pytest.importorskip("geopandas")
    pytest.importorskip("pyogrio")
    path = tmp_path / "atlas.gpkg"
    run_ok("atlas", "--export", str(path))
    frame, truth = geopandas.read_file(path, layer="atlas"), shipped()
    assert frame.place.tolist() == [entry["title"] for entry in truth]
    official = [np.nan if entry["official"] is None else entry["official"][ERROR] for entry in truth]
    np.testing.assert_array_equal(frame.official_error.astype(float), np.array(official, dtype=float))
    areas = frame.geometry.to_crs("+proj=cea +ellps=WGS84").area / 1e6
    np.testing.assert_allclose(areas, [entry["area_km2"] for entry in truth], rtol=OF_CHORDS)


def test_one_place_is_exported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its rows; and CSV needs no library."""
    path = tmp_path / "nz.csv"
    run_ok("atlas", "NZ", "--export", str(path))
    (entry,) = (entry for entry in shipped() if entry["region"] == "country:New Zealand@main")
    rows = parse_csv(path.read_text(encoding="utf-8"))
    assert [(row["region"], row["purpose"], row["projection"]) for row in rows] == [row[:3] for row in maps_of(entry)]
    for library in ("pandas", "geopandas", "pyogrio", "pyarrow"):
        monkeypatch.setitem(sys.modules, library, None)
    run_ok("atlas", "Malta", "--export", str(tmp_path / "malta.csv"))


def test_files_that_are_not_exported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Other suffixes and formats, folders that are not there, and files that are."""
    monkeypatch.chdir(tmp_path)
    Path("old.csv").write_text("old")
    for words, message in {
        "--export a.xls": "output 'a.xls'. Its suffix must be .csv, .parquet or .gpkg.",
        "--export a": "output 'a'. Its suffix must be .csv, .parquet or .gpkg.",
        "--export no/a.csv": "output 'no/a.csv'. There is no directory 'no'.",
        "--export old.csv": "output 'old.csv'. It exists; --overwrite replaces it.",
        "--export a.csv -f json": "format 'json' for 'a.csv'. Its suffix tells the format.",
    }.items():
        assert refusal("atlas", "Malta", *words.split()) == f"Invalid {message}"
    assert [path.name for path in tmp_path.iterdir()] == ["old.csv"]
    assert Path("old.csv").read_text() == "old"
    run_ok("atlas", "Malta", "--export", "old.csv", "--overwrite")
    assert Path("old.csv").read_text().startswith("region,kind,")
