"""Commands over many regions."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from unittest import mock

import pytest
import shapely
from commands import parse_csv, refusal, run_json, run_ok, told
from refusals import says, wrong_words
from shapely.geometry import mapping
from tables import each

import projdist

MAPS = ["mollweide", "EPSG:3035", "robinson"]
BOXES = ["box:0,0,20,10", "box:0,40,20,60"]
REGIONS = [word for box in BOXES for word in ("--regions", box)]
QUICK = ["--tolerance", "1e-4"]
COMPARE = ["compare", *MAPS, *REGIONS, *QUICK]
ISLANDS = ["box:-7.2,61.3,-6.2,62.5", "box:5.2,46,6.1,46.5"]
IN_ISLANDS = [word for box in ISLANDS for word in ("--regions", box)]
RECOMMEND = ["recommend", *IN_ISLANDS, "--authority", "EPSG", "--limit", "2"]


@pytest.fixture(autouse=True)
def here(monkeypatch, request):
    """Without other processes, which take a second to start, but where a test is of them."""
    if "slow" not in request.keywords:
        monkeypatch.setattr("projdist.cli.batches.OWN", None)


def write(path: Path) -> Path:
    """Two squares by their names, and a feature that is nowhere."""
    features = [("A", shapely.box(0, -40, 2, -38)), ("B", shapely.box(8, 50, 10, 52)), ("C", None)]
    shapes = [
        {"type": "Feature", "properties": {"name": name}, "geometry": one and mapping(one)} for name, one in features
    ]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": shapes}))
    return path


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::projdist.Notice")
def test_comparisons_are_those_of_each_region():
    """JSON has for each region what `compare` has for it; CSV a row for each of its rows."""
    words = [*COMPARE, "-m", "omega", "--sort", "omega.max"]
    found, rows = run_json(*words), parse_csv(run_ok(*words, "-f", "csv"))
    expected = [projdist.compare(MAPS, box, measures=["omega"], sort="omega.max", tolerance=1e-4) for box in BOXES]
    for one, other in zip(found["regions"], expected, strict=True):
        assert {key: one[key] for key in ("region", "results", "failures")} == other.to_dict()
    flat = [(box, row) for box, other in zip(BOXES, expected, strict=True) for row in other.plain_rows()]
    assert [(row["region"], row["projection"], row["omega_max"]) for row in rows] == [
        (box, row["projection"], repr(row["omega_max"])) for box, row in flat
    ]


@pytest.mark.filterwarnings("ignore::projdist.Notice")
def test_a_table_tells_the_best_of_each():
    """A sentence, a star for each, and with --details how each map does in all."""
    text = run_ok(*COMPARE)
    assert text.startswith("Of 2 regions EPSG:3035 is the best in 2, by airy_kavrayskiy.\n")
    assert "2 regions, 3 maps, airy_kavrayskiy\n" in run_ok(*COMPARE, "--details")
    best = {line.split()[1]: line.split()[3] for line in text.splitlines() if line.startswith("│ box:")}
    assert best == {box: projdist.compare(MAPS, box, tolerance=1e-4).results[0].given for box in BOXES}
    assert text.count("*") == len(BOXES)
    assert run_ok("compare", "robin", "moll", "--regions", BOXES[0], *QUICK).startswith(
        f"moll is the best over {BOXES[0]}, "
    )


@pytest.mark.slow
def test_what_fails_is_named(tmp_path):
    """Once for a map or each map over a region that is none; the rest is there, in a layer with the best maps, too."""
    path = write(tmp_path / "parts.geojson")
    code, _, err = told("compare", "moll", "nosuch", "--regions", path, *QUICK, "-o", tmp_path / "a.csv")
    assert code == 1
    wrong, region = err.splitlines()
    assert wrong.startswith("projdist: Invalid projection 'nosuch'.")
    assert region == "projdist: moll over C: Invalid region 'C'. It holds no polygons."
    assert [row["region"] for row in parse_csv((tmp_path / "a.csv").read_text())] == ["A", "B"]
    assert not (tmp_path / "a.csv.partial").exists()
    geopandas = pytest.importorskip("geopandas")
    for name in ("a.gpkg", "a.geojson"):
        code, out, _ = told("compare", *MAPS, "--regions", path, *QUICK, "-o", tmp_path / name)
        assert (code, out) == (1, f"Wrote: {tmp_path / name}\n")
        frame = geopandas.read_file(tmp_path / name)
        assert [*frame["region"], *frame["projection"]] == ["A", "B", "mollweide", "EPSG:3035"]
        assert frame.geometry.bounds.to_numpy().tolist() == [[0, -40, 2, -38], [8, 50, 10, 52]]
        assert frame.crs.to_epsg() == 4326 or frame.crs.to_authority() == ("OGC", "CRS84")


def test_a_partial_file_that_is_asked_for_stays(tmp_path):
    """And the same command takes its results from there; another refuses it in one line."""
    part = tmp_path / "part.jsonl"
    first = run_ok(*COMPARE, "--partial", part, "-f", "json")
    lines = part.read_text().splitlines(keepends=True)
    assert len(lines) == 1 + len(MAPS) * len(BOXES)
    part.write_text("".join(lines[:4]))
    note = f"projdist: Note: Results that are in '{part}' are taken from there.\n"
    assert told(*COMPARE, "--partial", part, "-f", "json") == (0, first, note)
    code, out, err = told(*COMPARE, "-m", "omega", "--partial", part)
    assert (code, out) == (2, "")
    assert "It belongs to another job, with other options. Take another name, or remove it." in err


def test_a_cluster_that_goes_away(tmp_path, monkeypatch):
    gone = mock.Mock(side_effect=ConnectionError("The executor does not answer any more."))
    monkeypatch.setattr("projdist.answers.batch", gone)
    part = f"'{tmp_path}/a.csv.partial' has what was done; the same command continues from it."
    said = refusal(*COMPARE, "-o", tmp_path / "a.csv", code=1)
    assert said == f"The executor does not answer any more. {part}"


@pytest.mark.slow
def test_recommendations_are_those_of_each_region():
    """JSON has for each region what `recommend` has for it, CSV all rows."""
    found, rows = run_json(*RECOMMEND)["regions"], parse_csv(run_ok(*RECOMMEND, "-f", "csv"))
    expected = [projdist.recommend(box, authorities=["EPSG"], limit=2) for box in ISLANDS]
    plain = [one.to_dict() | {"notices": None} for one in expected]
    assert [one | {"notices": None} for one in found] == plain
    assert [row["code"] for row in rows] == [one.code for other in expected for one in other.results]
    text = run_ok(*RECOMMEND)
    worst = max(expected, key=lambda one: one.results[0].value)
    assert text.startswith(f"The best CRS of each region, by airy_kavrayskiy; it is largest for {worst.region.name}: ")
    assert "2 regions, any, by airy_kavrayskiy\n" in run_ok(*RECOMMEND, "--details")
    first = [line.split()[3] for line in text.splitlines() if line.startswith("│ box:")]
    assert first == [other.results[0].code for other in expected]


@pytest.mark.slow
@pytest.mark.usefixtures("default_signals")
def test_ctrl_c_and_the_same_command(tmp_path):
    """What was done is kept beside the output, and goes when that is written; the answers are those of one go."""
    words = [sys.executable, "-m", "projdist", "compare", MAPS[0], "--regions", "countries", "--quiet"]
    words += ["-o", "all.csv"]
    part = tmp_path / "all.csv.partial"
    with subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        while not (part.exists() and part.read_bytes().count(b"\n") > 20) and process.poll() is None:
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate()
    assert (process.returncode, out, err) == (130, b"", b"")
    done = part.read_bytes().count(b"\n") - 1
    assert 20 <= done < 240
    assert not (tmp_path / "all.csv").exists()
    again = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert again.stdout == "Wrote: all.csv\n"
    assert again.stderr == "projdist: Note: Results that are in 'all.csv.partial' are taken from there.\n"
    assert not part.exists()
    resumed = (tmp_path / "all.csv").read_text()
    subprocess.run([*words, "--overwrite", "--executor", "processes:1"], cwd=tmp_path, capture_output=True, check=True)
    assert (tmp_path / "all.csv").read_text() == resumed
    assert os.listdir(tmp_path) == ["all.csv"]


@each(("words", "code", "message"), wrong_words("_batches"))
def test_refused(words, code, message, tmp_path, monkeypatch):
    pytest.importorskip("geopandas")
    monkeypatch.chdir(tmp_path)
    assert says(message, refusal(*words.split(), code=code))
