"""The command line: every command and option, what is printed and written, exit codes, and what stderr says."""

import csv
import errno
import io
import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pyproj
import pytest
from matplotlib.image import imread
from typer.testing import CliRunner, Result

from projdist import CRITERIA, MEASURES, __version__, factors, projection_names, summarize
from projdist.cli.app import app
from projdist.cli.formats import Format, render_comparison, render_factors, rounded
from projdist.indices import INDICES

FORMATS = [form.value for form in Format]
COMMANDS = [
    *("compare", "factors", "tissot", "heatmap", "recommend", "optimize", "ldp", "check", "correct"),
    *("mosaic", "clouds", "oldmap", "list"),
]
QUICK = ["--tolerance", "1e-3"]

COMPARE_KEYS = [
    "projection",
    "name",
    "definition",
    "coverage",
    "airy_kavrayskiy",
    "airy_kavrayskiy_scaled",
    "airy_kavrayskiy_affine",
    "error_estimate",
    "evaluations",
]
MEASURE_KEYS = ["mean", "rms", "median", "p95", "max", "min", "max_at", "min_at"]
FACTORS_KEYS = ["lon", "lat", "x", "y", "h", "k", "a", "b", "s", "omega", "theta", "convergence", "fisher", "quality"]

# What the JSON has beyond the issue: how the figure was limited, and the errors of a measure's mean and RMS.

WKT = pyproj.CRS("EPSG:32632").to_wkt(pretty=True)
HIDDEN = ["+proj=ortho +lat_0=90 +R=6371000", "--region", "box:0,-40,40,-10"]


def run(*words: str, stdin: str | bytes = "") -> Result:
    result = CliRunner().invoke(app, list(words), input=stdin)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    assert "Traceback" not in result.output
    return result


def run_ok(*words: str, stdin: str | bytes = "") -> str:
    result = run(*words, stdin=stdin)
    assert (result.exit_code, result.stderr) == (0, "")
    return result.stdout


def run_json(*words: str, stdin: str = "", code: int = 0) -> dict:
    result = run(*words, "--format", "json", stdin=stdin)
    assert result.exit_code == code, result.stderr
    return json.loads(result.stdout, parse_constant=lambda text: pytest.fail(f"{text} is not JSON"))


def refused(*words: str, stdin: str = "") -> str:
    """The one line of a usage error, which ends with 2 and prints nothing else."""
    result = run(*words, stdin=stdin)
    assert (result.exit_code, result.stdout) == (2, "")
    assert re.fullmatch(r"projdist: [^\n]+\n", result.stderr)
    return result.stderr


def process(*words: str, **options: object) -> subprocess.CompletedProcess:
    """The command in a process of its own."""
    settings = {"capture_output": True, "timeout": 60, **options}
    return subprocess.run([sys.executable, "-m", "projdist", *words], check=False, **settings)


def parse_markdown(text: str) -> list[dict[str, str]]:
    lines = [line for line in text.splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]
    assert all(re.fullmatch("-{3}:?", cell) for cell in cells[1])
    assert len({len(row) for row in cells}) == 1
    return [dict(zip(cells[0], row, strict=True)) for row in cells[2:]]


def parse_csv(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


# ---- compare: results -----------------------------------------------------------------------


def test_compare_json_keys() -> None:
    """The keys of the issue, in its order; more may stand after them."""
    found = run_json("compare", "moll", "nosuch", "-m", "omega", "--region", "box:0,0,40,40", *QUICK, code=1)
    assert list(found) == ["region", "results", "failures"]
    assert list(found["region"]) == ["name", "area_km2"]
    assert list(found["results"][0]) == [*COMPARE_KEYS, "omega"]
    assert set(found["results"][0]["omega"]) == set(MEASURE_KEYS)
    assert list(found["failures"][0]) == ["projection", "error"]
    assert found["failures"][0]["projection"] == "nosuch"


def test_compare_json_is_what_python_says() -> None:
    """Full precision: the JSON has the very numbers of `summarize`."""
    found = run_json("compare", "winkel-tripel", "-m", "h")["results"][0]
    assert found == summarize("winkel-tripel", measures=["h"]).to_dict()
    lon, lat = found["h"]["max_at"]
    assert -180 <= lon <= 180
    assert -90 <= lat <= 90


def test_compare_json_has_null_for_what_is_not_finite() -> None:
    """Mercator's areal scale has no bound on the globe: null, not Infinity."""
    found = run_json("compare", "merc", "-m", "s", *QUICK)["results"][0]
    assert found["s"]["max"] is None
    assert found["s"]["mean"] is None
    assert math.isfinite(found["s"]["median"])


def test_compare_region_of_json() -> None:
    """Name and area of the region: that of an octant is an eighth of WGS 84's 510,065,621.7 km2."""
    found = run_json("compare", "moll", "--region", "box:-90,0,0,90", *QUICK)["region"]
    assert found["name"] == "box:-90,0,0,90"
    assert found["area_km2"] == pytest.approx(510065621.724 / 8, abs=1e-3)


@pytest.mark.parametrize(
    ("region", "name"),
    [
        ("globe", "globe"),
        ("GLOBE", "globe"),
        ("box:-10,-20,30,40.5", "box:-10,-20,30,40.5"),
        ("box:170,-20,-170,20", "box:170,-20,-170,20"),
        ("cap:-10,-50,1e3", "cap:-10,-50,1000"),
    ],
)
@pytest.mark.parametrize("option", ["--region", "-r"])
def test_compare_regions(region: str, name: str, option: str) -> None:
    """Negative numbers in regions need no `--`."""
    assert run_json("compare", option, region, "moll", *QUICK)["region"]["name"] == name


def test_compare_measures_repeat_or_have_commas() -> None:
    """`-m a,b -m c`: statistics of all, by the names that were given."""
    found = run_json("compare", "moll", "-m", "omega, h", "--measure", "scale@45", "-r", "box:0,0,9,9")["results"][0]
    assert {"omega", "h", "scale@45"} < set(found)


def test_compare_tolerance() -> None:
    """A looser tolerance costs fewer evaluations, and its errors stay below it."""
    tight = run_json("compare", "moll", "--tolerance", "1e-7")["results"][0]
    loose = run_json("compare", "moll", "--tolerance", "1e-2")["results"][0]
    assert loose["evaluations"] < tight["evaluations"]
    assert loose["error_estimate"] < 1e-2
    assert tight["error_estimate"] < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sort", "column"),
    [
        ("airy_kavrayskiy", "airy_kavrayskiy"),
        ("airy_kavrayskiy_scaled", "airy_kavrayskiy_scaled"),
        ("airy_kavrayskiy_affine", "airy_kavrayskiy_affine"),
        ("coverage", "coverage"),
        ("evaluations", "evaluations"),
        ("error_estimate", "error_estimate"),
        ("name", "name"),
        ("s", "s.mean"),
        *((f"s.{statistic}", f"s.{statistic}") for statistic in MEASURE_KEYS[:-2]),
    ],
)
def test_compare_sort(sort: str, column: str) -> None:
    """Rows ascend in the column of the key; a measure alone is its mean."""
    words = ["winkel-tripel", "moll", "robin", "+proj=ortho +R=6371000", "-r", "box:-80,0,0,80", "-m", "s"]
    found = run_json("compare", *words, "--sort", sort, "--tolerance", "1e-2")["results"]
    name, _, statistic = column.partition(".")
    values = [row[name][statistic] if statistic else row[name] for row in found]
    assert len(values) == 4
    assert values == sorted(values)


def test_compare_sort_as_given() -> None:
    """`--sort given` keeps the order of the command line."""
    words = ["robin", "moll", "winkel-tripel"]
    found = run_json("compare", *words, "--sort", "given", "-r", "box:0,0,9,9", *QUICK)
    assert [row["projection"] for row in found["results"]] == words


@pytest.mark.slow
def test_compare_sort_puts_the_undefined_last() -> None:
    """Where a statistic diverges the projection goes to the end."""
    found = run_json("compare", "merc", "moll", "--sort", "s.max", "-m", "s", *QUICK)["results"]
    assert [row["projection"] for row in found] == ["moll", "merc"]


@pytest.mark.slow
def test_compare_sort_by_a_measure_with_a_point_in_its_name() -> None:
    """`scale@22.5.max` is the maximum of `scale@22.5`."""
    for sort in ("scale@22.5", "scale@22.5.median"):
        run_ok("compare", "robin", "moll", "-m", "scale@22.5", "--sort", sort, "-r", "box:0,0,40,40", *QUICK)


@pytest.mark.parametrize("sort", ["given", "name", "airy_kavrayskiy"])
def test_compare_the_same_projection_twice(sort: str) -> None:
    """Two rows, as asked."""
    found = run_json("compare", "moll", "moll", "--sort", sort, *QUICK)["results"]
    assert [row["projection"] for row in found] == ["moll", "moll"]


def test_compare_table_marks_the_best() -> None:
    """A star behind the least of each column, on one row, and a note that says what the star is."""
    text = run_ok("compare", "robin", "moll", *QUICK)
    (robin,) = [line for line in text.splitlines() if "robin" in line]
    (moll,) = [line for line in text.splitlines() if "moll" in line]
    assert robin.count("*") == 3
    assert "*" not in moll
    assert "* is the best" in text
    assert "1/sqrt(2)" in text
    assert "globe (510,065,622 km2), by airy_kavrayskiy" in text


def test_compare_table_of_one_has_no_best() -> None:
    """Alone, a projection is not the best of anything."""
    (line,) = [line for line in run_ok("compare", "robin", *QUICK).splitlines() if "robin" in line]
    assert "*" not in line


def test_compare_table_has_no_digits_that_the_error_makes_doubtful() -> None:
    """A figure good to 1e-8 has six decimals, one good to 1e-4 at most four."""
    (line,) = [line for line in run_ok("compare", "moll").splitlines() if "moll" in line]
    assert "0.545459 " in line
    found = run_json("compare", "moll", "--tolerance", "1e-2")["results"][0]
    (line,) = [line for line in run_ok("compare", "moll", "--tolerance", "1e-2").splitlines() if "moll" in line]
    decimals = len(re.findall(r"0\.(\d+) ", line)[0])
    assert 10.0**-decimals > 0.5 * found["error_estimate"]


def test_doubtful_figures_are_no_zeros() -> None:
    """What is above its error has its first digit; what is not has none."""
    assert [rounded(0.031, 0.016), rounded(0.0049, 0.0012), rounded(0.31, 0.16)] == ["0.03", "0.005", "0.3"]
    assert [rounded(1e-12, 1e-9), rounded(0.01, 0.016)] == ["0.000000000", "0.0"]


def test_compare_table_tells_coverage() -> None:
    """Half of the globe can be projected: the table has the share and says what the figures are of."""
    text = run_ok("compare", "+proj=ortho +lat_0=90 +R=6371000", "moll", "--tolerance", "1e-2")
    assert "covers" in text
    assert "the share of the region that can be projected" in text


@pytest.mark.slow
@pytest.mark.parametrize("measures", ["omega", "omega,h,k,s,a,b"])
def test_compare_tables_are_never_cut_off(measures: str) -> None:
    """However many columns: each number of the Markdown stands whole in the table."""
    words = ["compare", "robin", "moll", "-m", measures, "-r", "box:0,0,40,40", *QUICK]
    table = run_ok(*words)
    for row in parse_markdown(run_ok(*words, "-f", "markdown")):
        for cell in row.values():
            assert f" {cell.replace(chr(92), '')} " in table


@pytest.mark.parametrize("columns", [40, 80, 132])
def test_tables_fit_into_a_terminal(columns: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the terminal is narrow there are several tables; each repeats what its rows are of, none is cut off."""

    class Terminal(io.StringIO):
        encoding = "utf-8"

        def isatty(self) -> bool:
            return True

    found = factors("robin", [10, 20], [30, 40]).to_dict()
    whole = parse_markdown(render_factors(found, "Robinson", Format.MARKDOWN))
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setattr(sys, "stdout", Terminal())
    text = re.sub(r"\x1b\[[0-9;]*m", "", render_factors(found, "Robinson", Format.TABLE))
    assert all(len(line) <= columns for line in text.splitlines())
    assert text.count(" lon ") > 1
    for cell in {cell for row in whole for cell in row.values()}:
        assert f" {cell} " in text


def test_compare_csv() -> None:
    """One row a projection, statistics as columns of their own, all digits."""
    words = ["compare", "moll", "robin", "-m", "omega", "-r", "box:0,0,40,40", *QUICK]
    rows = parse_csv(run_ok(*words, "--format", "csv"))
    assert [row["projection"] for row in rows] == ["moll", "robin"]
    for row, expected in zip(rows, run_json(*words)["results"], strict=True):
        assert float(row["airy_kavrayskiy"]) == expected["airy_kavrayskiy"]
        assert float(row["omega_rms"]) == expected["omega"]["rms"]
        assert [float(row["omega_max_lon"]), float(row["omega_max_lat"])] == expected["omega"]["max_at"]


def test_compare_markdown() -> None:
    """A table that Markdown reads, with what would be markup escaped."""
    rows = parse_markdown(run_ok("compare", "moll", "robin", "-f", "markdown", "-m", "scale@45", "-r", "box:0,0,80,80"))
    assert {row["projection"] for row in rows} == {"robin", "moll"}
    assert rows[0]["AK"].endswith("\\*")
    assert "scale@45 mean" in rows[0]


def test_compare_shows_long_definitions_by_name() -> None:
    """WKT fills the screen: the table has the name of the CRS, the JSON what was given."""
    words = ["compare", WKT, "-r", "box:6,40,12,50", *QUICK]
    for form in ("table", "markdown"):
        text = run_ok(*words, "-f", form)
        assert "WGS 84 / UTM zone 32N" in text
        assert "PROJCRS" not in text
    assert run_json(*words)["results"][0]["projection"] == WKT


def test_compare_shows_undefined_figures() -> None:
    """A projection without a figure has `-`, and is not the best."""
    result = {"region": {"name": "globe", "area_km2": 1.0}}
    row = dict.fromkeys(COMPARE_KEYS[4:8]) | {"projection": "x", "name": "X", "coverage": 0.5}
    other = dict.fromkeys(COMPARE_KEYS[4:8], 0.25) | {"projection": "y", "name": "Y", "coverage": 1.0}
    text = render_comparison({**result, "results": [row, other]}, [], [], "given", 1e-8, Format.MARKDOWN)
    first, second = parse_markdown(text)
    assert first["AK"] == first["error"] == "-"
    assert second["AK"].endswith("\\*")
    assert np.isclose(float(second["covers"].removesuffix(" %")), 100)


# ---- compare: failures ----------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMATS)
def test_compare_failures_stand_beside_results(form: str) -> None:
    """Good projections are measured, each bad one has its line, and the exit code is 1."""
    result = run("compare", "nosuch", "moll", "EPSG:4326", "-f", form, *QUICK)
    assert result.exit_code == 1
    assert "moll" in result.stdout
    lines = result.stderr.splitlines()
    assert len(lines) == 2
    assert lines[0].startswith("projdist: Invalid projection 'nosuch'. It must be a PROJ id or a name")
    assert re.match(r"projdist: Invalid projection 'EPSG:4326'. It is a Geographic", lines[1])


@pytest.mark.parametrize("form", FORMATS)
def test_compare_nothing_but_failures(form: str) -> None:
    """Exit code 1; JSON and CSV still parse."""
    result = run("compare", "nosuch", "EPSG:4979", "-f", form)
    assert result.exit_code == 1
    assert len(result.stderr.splitlines()) == 2
    if form == "json":
        found = json.loads(result.stdout)
        assert found["results"] == []
        assert [row["projection"] for row in found["failures"]] == ["nosuch", "EPSG:4979"]
    if form == "csv":
        assert parse_csv(result.stdout) == []
    if form in ("table", "markdown"):
        assert result.stdout == "No projection could be measured.\n"


def test_compare_region_that_cannot_be_projected() -> None:
    """A failure of the projection, not of the whole."""
    found = run_json("compare", "moll", *HIDDEN, *QUICK, code=1)
    assert [row["projection"] for row in found["results"]] == ["moll"]
    assert re.search(r"No point of it can be projected", found["failures"][0]["error"])


HOSTILE = [
    "",
    " ",
    "-",
    "0",
    "-10",
    "ünïcödé",
    "\N{SNOWMAN}",
    "\u202e",
    "+proj=",
    "+proj=nosuch",
    "+proj=utm +zone=99",
    "+proj=robin +R=-1",
    "+proj=robin +R=0",
    "+proj=merc +k_0=0",
    "+proj=merc +to_meter=0",
    "+proj=pipeline",
    "EPSG:",
    "EPSG:99999999",
    "EPSG:4326",
    "EPSG:4978",
    "ESRI:foo",
    '{"a": 1}',
    "{",
    "PROJCRS[",
    WKT[:200],
    "https://example.com",
    "/etc/passwd",
    "a" * 100_000,
    "[bold]",
    "%s",
    "robin\nmoll",
]


@pytest.mark.slow
@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_compare_hostile_projections(text: str) -> None:
    """Each is refused in one line that names it, and says what is allowed."""
    result = run("compare", "--format", "json", "--", text)
    assert result.exit_code == 1
    assert re.fullmatch(r"projdist: Invalid [^\n]+\n", result.stderr)
    assert len(result.stderr) < 1000
    assert json.loads(result.stdout)["failures"][0]["projection"] == text


@pytest.mark.parametrize("content", [None, b"", b"\xff\xfe\x00", b'GEOGCS["x"', b"hello", b"+proj=robin +R"])
def test_compare_bad_files(content: bytes | None, tmp_path: Path) -> None:
    """A directory, an empty, a binary and a broken file are refused by their name."""
    path = tmp_path / "some.prj"
    if content is None:
        path.mkdir()
    else:
        path.write_bytes(content)
    result = run("compare", str(path))
    assert result.exit_code == 1
    assert re.fullmatch(r"projdist: Invalid [^\n]+\n", result.stderr)
    assert "some.prj" in result.stderr


def test_compare_files(tmp_path: Path) -> None:
    """A .prj and a .wkt file of one CRS give the same numbers."""
    crs = pyproj.CRS("EPSG:3035")
    (tmp_path / "a.prj").write_text(crs.to_wkt("WKT1_ESRI"))
    (tmp_path / "b.wkt").write_text(crs.to_wkt(pretty=True))
    found = run_json("compare", str(tmp_path / "a.prj"), str(tmp_path / "b.wkt"), "-r", "box:0,40,20,60", *QUICK)
    first, second = (row["airy_kavrayskiy"] for row in found["results"])
    assert first == pytest.approx(second, rel=1e-9)


@pytest.mark.slow
def test_compare_many_projections() -> None:
    """Two hundred are no trouble."""
    words = [f"+proj=eqc +lat_ts={k / 4} +R=6371000" for k in range(200)]
    found = run_json("compare", *words, "-r", "box:0,0,10,10", *QUICK)
    assert len(found["results"]) == 200


# ---- usage errors ---------------------------------------------------------------------------


def test_repairs_are_said(tmp_path: Path) -> None:
    """A region that had to be repaired is measured, and the repair is told on standard error."""
    path = tmp_path / "bow.geojson"
    path.write_text('{"type": "Polygon", "coordinates": [[[0, 0], [10, 10], [10, 0], [0, 10], [0, 0]]]}')
    result = run("compare", "robin", "--region", f"file:{path}")
    assert result.exit_code == 0
    assert re.fullmatch(r"projdist: file:.*: 1 self-intersecting polygon\(s\) repaired; [^\n]*\n", result.stderr)
    assert "AK" in result.stdout


def test_a_set_of_points(tmp_path: Path) -> None:
    """A table over points tells how many there are, and that they are weighed."""
    path = tmp_path / "a.csv"
    path.write_text("lon,lat,weight\n1,2,1\n3,4,5\n")
    shown = run_ok("compare", "robin", "--region", f"points:{path}")
    assert "(2 points)" in shown
    assert "by the points' weights" in shown


@pytest.mark.slow
@pytest.mark.parametrize("command", ["tissot", "heatmap"])
def test_pictures_of_countries(tmp_path: Path, command: str) -> None:
    """Pictures show a country, also one across the antimeridian, and the surroundings of points."""
    (tmp_path / "a.csv").write_text("lon,lat\n1,2\n30,40\n")
    for region in ("country:FJ", f"points:{tmp_path / 'a.csv'}"):
        picture = tmp_path / "a.png"
        run_ok(command, "robin", "--region", region, "-o", str(picture), "--dpi", "40", "--overwrite")
        assert picture.stat().st_size > 2000


USAGE = {
    "compare --region glob robin": r"Invalid region 'glob'. Did you mean globe\? It must be globe, land, ocean, ",
    "compare --region= robin": r"Invalid region ''",
    "compare --region box:-10,30,20 robin": r"Invalid region 'box:-10,30,20'. It must be box:W,S,E,N, 4 numbers.",
    "compare --region box:a,b,c,d robin": r"Invalid region 'box:a,b,c,d'",
    "compare --region box:-10,30,-10,40 robin": r"Invalid box '-10,30,-10,40'. It must be wider than 0",
    "compare --region box:0,40,10,30 robin": r"Invalid box '0,40,10,30'. South must be below north",
    "compare --region box:0,0,nan,1 robin": r"Invalid box '0,0,nan,1'",
    "compare --region box:0,0,1e400,1 robin": r"Invalid box '0,0,inf,1'",
    "compare --region cap:0,0,0 robin": r"Invalid cap '0,0,0'. Its radius must be above 0",
    "compare --region cap:0,0,-5 robin": r"Invalid cap '0,0,-5'",
    "compare --region cap:0,0,1e6 robin": r"Invalid cap '0,0,1e\+06'. .*at most 20015 km",
    "compare --region cap:0,91,10 robin": r"Invalid cap '0,91,10'",
    "compare --measure foo robin": r"Invalid measure 'foo'. It must be one of fisher, .*scale@AZIMUTH",
    "compare --measure omga robin": r"Invalid measure 'omga'. Did you mean omega",
    "compare --measure omega,,h robin": r"Invalid measure ''",
    "compare --measure scale@nan robin": r"Invalid azimuth 'nan'",
    "compare --sort foo robin": r"Invalid sort key 'foo'. It must be given, name, .*airy_kavrayskiy, .*\.median",
    "compare --sort foo nosuch": r"Invalid sort key 'foo'",
    "compare --sort omega robin": r"Invalid sort key 'omega'.*asked for with --measure",
    "compare --sort omega.bad -m omega robin": r"Invalid sort key 'omega.bad'",
    "compare --sort name.x robin": r"Invalid sort key 'name.x'",
    "compare --sort definition robin": r"Invalid sort key 'definition'",
    "compare --sort= robin": r"Invalid sort key ''",
    "compare --tolerance 0 robin": r"Invalid tolerance '0'. It must be a number within 1e-15 and 1.",
    "compare --tolerance -1e-3 robin": r"Invalid tolerance '-1e-3'",
    "compare --tolerance nan robin": r"Invalid tolerance 'nan'",
    "compare --tolerance inf robin": r"Invalid tolerance 'inf'",
    "compare --tolerance abc robin": r"Invalid tolerance 'abc'",
    "compare --format yaml robin": r"Invalid format 'yaml'. It must be table, json, csv or markdown.\n$",
    "compare --format= robin": r"Invalid format ''",
    "compare --format JSON robin": r"Invalid format 'JSON'",
    "compare robin -f json -f csv": r"Invalid option '--format'. It must be given once.",
    "compare robin --region globe -r globe": r"Invalid option '--region'. It must be given once.",
    "compare --format": r"--format.*requires an argument. See 'projdist compare --help'.",
    "compare --formt json robin": r"Invalid option '--formt'. Did you mean --format\? See 'projdist compare --help'.",
    "compare --projection robin": r"Invalid option '--projection'. See 'projdist compare --help'.",
    "compare robin -o ": r"Invalid output ''. It must be the name of a file.",
    "compare robin -o new/": r"Invalid output 'new/'. It is a directory.",
    f"compare robin -o {'x' * 300}": r"Invalid output 'x+'. It cannot be written: File name too long.",
    "compare robin --tolerance -inf": r"Invalid tolerance '-inf'. It must be a number within 1e-15 and 1.",
    "compare": r"Missing argument 'PROJECTION...'. See 'projdist compare --help'",
    "compare --": r"Missing argument 'PROJECTION...'",
    "factors": r"Missing argument 'PROJECTION'",
    "factors robin": r"Invalid points. They must be LON LAT..., - for stdin, or --at FILE.",
    "factors robin 1 2 3": r"Invalid coordinates '1 2 3'. They must be pairs of LON LAT, or - for stdin.",
    "factors robin 1 2 -": r"Invalid coordinates '1 2 -'",
    "factors robin 10 90.001": r"Invalid latitude '90.001'. It must lie within -90 and 90 degrees.",
    "factors robin 10 -91": r"Invalid latitude '-91'",
    "factors robin 10 nan": r"Invalid latitude 'nan'",
    "factors robin 1e300 10": r"Invalid longitude '1e300'. It must be a number of degrees within -720 and 720.",
    "factors robin inf 10": r"Invalid longitude 'inf'",
    "factors robin -inf 5": r"Invalid longitude '-inf'. It must be a number of degrees within -720 and 720.",
    "factors robin 5 -Infinity": r"Invalid latitude '-Infinity'. It must lie within -90 and 90 degrees.",
    "factors robin -- -inf 5": r"Invalid longitude '-inf'",
    "factors robin 5 -nan": r"Invalid option '-nan'",
    "factors robin 5,6": r"Invalid coordinates '5,6'. They must be pairs of LON LAT, or - for stdin.",
    "factors robin 5": r"Invalid coordinates '5'",
    "factors robin x y": r"Invalid point 'x y'. Longitude and latitude must be numbers of degrees.",
    "factors robin 10N 20E": r"Invalid point '10N 20E'",
    "factors robin −10 20": r"Invalid point '−10 20'",
    "factors robin 1 2 --measure foo": r"Invalid measure 'foo'",
    "factors robin 1 2 --format xml": r"Invalid format 'xml'. It must be table, json, csv or markdown.",
    "tissot robin -o x.jpg": r"Invalid output 'x.jpg'. Its suffix must be .png, .svg, .pdf, .gpkg or .geojson.",
    "tissot robin -o noname": r"Invalid output 'noname'",
    "tissot robin -o ": r"Invalid output ''",
    "tissot robin -o new.png/": r"Invalid output 'new.png/'. It is a directory.",
    "tissot robin -o x.png -o y.png": r"Invalid option '--output'. It must be given once.",
    "tissot robin --region foo": r"Invalid region 'foo'",
    "tissot robin --step 0": r"Invalid step '0'. It must be a number of degrees within 1e-05 and 90.",
    "tissot robin --step -5": r"Invalid step '-5'",
    "tissot robin --step x": r"Invalid step 'x'",
    "tissot robin --size big": r"Invalid size 'big'. It must be WIDTH,HEIGHT in inches, as 10,6.",
    "tissot robin --size 1,2,3": r"Invalid size '1,2,3'",
    "tissot robin --size 0,6": r"Invalid width '0'. It must be a number of inches within 0.5 and 200.",
    "tissot robin --size 6,nan": r"Invalid height 'nan'",
    "tissot robin --size 200,200 --dpi 1200": r"Invalid size '200,200' at 1200 dots per inch. It must have at most",
    "tissot robin --dpi 0": r"Invalid dpi '0'. It must be a number within 10 and 1200.",
    "tissot robin --dpi nan": r"Invalid dpi 'nan'",
    "tissot": r"Missing argument 'PROJECTION...'",
    "heatmap robin -o x.gif": r"Invalid output 'x.gif'. Its suffix must be .png, .svg, .pdf, .tif or .tiff.",
    "heatmap robin --measure foo": r"Invalid measure 'foo'",
    "heatmap robin --measure a,b": r"Invalid measures 'a,b' for 'heatmap.png'. A picture shows one;",
    "heatmap robin --measure=": r"Invalid measure ''",
    "heatmap robin --levels foo": r"Invalid levels 'foo'. It must be a number of them, 1 to 100, or values as 1,1.5,2.",
    "heatmap robin --levels 0": r"Invalid levels '0'",
    "heatmap robin --levels -3": r"Invalid levels '-3'",
    "heatmap robin --levels 100000": r"Invalid levels '100000'",
    "heatmap robin --levels 1,nan": r"Invalid levels '1,nan'",
    "heatmap robin --levels=": r"Invalid levels ''",
    "heatmap robin --step 100": r"Invalid step '100'",
    "heatmap robin --dpi 5000": r"Invalid dpi '5000'",
    "heatmap robin -m h -m k": r"Invalid measures 'h,k' for 'heatmap.png'.",
    "list": r"Missing argument 'projections|measures|criteria|indices'. See 'projdist list --help'.",
    "list nothing": r"^projdist: Invalid list 'nothing'. It must be projections, measures, criteria or indices.\n$",
    "list measures criteria": r"unexpected extra argument.*criteria",
    "list measures --format xml": r"Invalid format 'xml'. It must be table, json, csv or markdown.",
    "list measures -o x": r"No such option: -o",
    "foo": r"No such command 'foo'. See 'projdist --help'.",
    "compar robin": r"No such command 'compar'",
    "--format json list measures": r"No such option: --format",
    "--foo": r"No such option: --foo",
}


@pytest.mark.parametrize("words", USAGE)
def test_usage_errors(words: str) -> None:
    """One line that names what was wrong and what is allowed, nothing on stdout, exit code 2."""
    assert re.search(USAGE[words], refused(*words.split(" ")))


@pytest.mark.parametrize("option", ["--formt", "--region-x", "-x", "--", "---", "-q5", "--formt=json"])
@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("position", ["first", "last"])
def test_unknown_options(command: str, option: str, position: str) -> None:
    """An option that there is not is refused in every command, wherever it stands."""
    arguments = {"factors": ["robin", "1", "2"], "list": ["measures"]}.get(command, ["robin"])
    if option == "--":
        arguments, option = ["--", *arguments], "--formt"
    words = [option, *arguments] if position == "first" else [*arguments, option]
    assert option.split("=")[0][:2] in refused(command, *words)


def test_no_arguments_is_help() -> None:
    """Alone, the command says what it can do; that is no success."""
    result = run()
    assert (result.exit_code, result.stdout) == (2, "")
    assert all(command in result.stderr for command in COMMANDS)


def test_version() -> None:
    """The version of the package, and nothing is done besides."""
    assert run_ok("--version") == f"projdist {__version__}\n"
    assert run_ok("--version", "compare", "robin") == f"projdist {__version__}\n"


@pytest.mark.parametrize("command", [[], *([command] for command in COMMANDS)], ids=["projdist", *COMMANDS])
@pytest.mark.parametrize("option", ["--help", "-h"])
def test_help(command: list[str], option: str) -> None:
    """Every command has help with its usage."""
    assert "Usage: " in run_ok(*command, option)


# ---- factors --------------------------------------------------------------------------------


def test_factors_json() -> None:
    """The keys of the issue and no others, and the very numbers of `factors`."""
    found = run_json("factors", "winkel-tripel", "10", "20", "-150.5", "-60")
    assert list(found) == ["projection", "results"]
    assert found["projection"] == "winkel-tripel"
    assert [list(row) for row in found["results"]] == [FACTORS_KEYS, FACTORS_KEYS]
    expected = factors("winkel-tripel", [10, -150.5], [20, -60])
    for name in FACTORS_KEYS:
        assert [row[name] for row in found["results"]] == getattr(expected, name).tolist()


def test_factors_json_has_null_where_undefined() -> None:
    """Beyond the horizon nothing is defined: null, with the quality that says so."""
    (row,) = run_json("factors", "+proj=ortho +lat_0=90 +R=6371000", "0", "-80")["results"]
    assert row["quality"] == "outside"
    assert {row[name] for name in FACTORS_KEYS if name not in ("lon", "lat", "quality")} == {None}


@pytest.mark.parametrize(
    "words",
    [
        ["robin", "-10", "-20"],
        ["robin", "-1e1", "-2e+1"],
        ["robin", "-10.", "-20.0"],
        ["-m", "h", "robin", "-10", "-20"],
        ["robin", "-10", "-m", "h", "-20"],
        ["robin", "--", "-10", "-20"],
        ["--", "robin", "-10", "-20"],
        ["robin", " -10", "-20 "],
    ],
    ids=" ".join,
)
def test_factors_negative_numbers(words: list[str]) -> None:
    """Negative numbers are numbers, with or without `--`, wherever options stand."""
    words = ["-m", "ppm", "-f", "json", *words]
    (row,) = json.loads(run_ok("factors", *words))["results"]
    assert (row["lon"], row["lat"]) == (-10, -20)


def test_factors_more_negative_numbers() -> None:
    """Points beginning with a decimal point, too."""
    (row,) = run_json("factors", "robin", "-.5", "-.25")["results"]
    assert (row["lon"], row["lat"]) == (-0.5, -0.25)


def test_factors_measures() -> None:
    """Measures beyond the standard ones are columns."""
    (row,) = run_json("factors", "robin", "10", "20", "-m", "flexion,skewness", "-m", "scale@45")["results"]
    assert list(row) == [*FACTORS_KEYS, "flexion", "skewness", "scale@45"]


def test_factors_csv_and_markdown() -> None:
    """One row a point: all digits in the CSV, readable ones in the Markdown."""
    words = ["factors", "robin", "10", "20", "-30", "-40"]
    expected = run_json(*words)["results"]
    for row, wanted in zip(parse_csv(run_ok(*words, "-f", "csv")), expected, strict=True):
        assert list(row) == FACTORS_KEYS
        assert float(row["omega"]) == wanted["omega"]
    for row, wanted in zip(parse_markdown(run_ok(*words, "-f", "markdown")), expected, strict=True):
        assert float(row["h"]) == pytest.approx(wanted["h"], abs=1e-8)


def test_factors_table() -> None:
    """For people: the projection, a row a point, `-` where undefined, no negative zero."""
    text = run_ok("factors", "EPSG:32632", "9", "0", "9", "45")
    assert text.startswith("EPSG:32632\n")
    assert "0.99960000" in text
    assert "-0.000000" not in text
    (line,) = [line for line in run_ok("factors", HIDDEN[0], "0", "-80").splitlines() if "outside" in line]
    assert line.count(" - ") == 11


def test_factors_of_a_bad_projection() -> None:
    """Nothing on stdout, one line, exit code 1."""
    result = run("factors", "nosuch", "1", "2")
    assert (result.exit_code, result.stdout) == (1, "")
    assert re.fullmatch(r"projdist: Invalid projection 'nosuch'. [^\n]+\n", result.stderr)


def test_factors_looks_at_the_projection_first() -> None:
    """Before it waits for lines, and before it reads coordinates of which the first was taken for a projection."""
    for words in (["nosuch", "-"], ["5", "6"]):
        result = run("factors", *words)
        assert (result.exit_code, result.stdout) == (1, "")
        assert re.fullmatch(rf"projdist: Invalid projection '{words[0]}'. [^\n]+\n", result.stderr)


LINES = """\ufeff# longitude latitude name
10 20 Ab c, d
-10,-20,Zürich|x
 -.5\t1e1
3
foo bar

8 95 beyond
720 -90  *last*
"""


def test_factors_stdin_json() -> None:
    """Points in their order with the text that came with them; bad lines by their number, and exit code 1."""
    result = run("factors", "robin", "-", "-f", "json", stdin=LINES)
    assert result.exit_code == 1
    rows = json.loads(result.stdout)["results"]
    assert [(row["lon"], row["lat"], row["text"]) for row in rows] == [
        (10, 20, "Ab c, d"),
        (-10, -20, "Zürich|x"),
        (-0.5, 10, ""),
        (720, -90, "*last*"),
    ]
    assert result.stderr.splitlines() == [
        "projdist: line 5: Invalid point '3'. It must be 'lon lat [text]'.",
        "projdist: line 6: Invalid point 'foo bar'. Longitude and latitude must be numbers of degrees.",
        "projdist: line 8: Invalid latitude '95'. It must lie within -90 and 90 degrees.",
    ]


@pytest.mark.parametrize("form", ["csv", "markdown", "table"])
def test_factors_stdin_text(form: str) -> None:
    """The text is kept in every format, and escaped where the format asks for it."""
    result = run("factors", "robin", "-", "-f", form, stdin=LINES)
    assert result.exit_code == 1
    if form == "csv":
        assert [row["text"] for row in parse_csv(result.stdout)] == ["Ab c, d", "Zürich|x", "", "*last*"]
    elif form == "markdown":
        rows = parse_markdown(result.stdout)
        assert [row["text"] for row in rows] == ["Ab c, d", "Zürich\\|x", "", "\\*last\\*"]
    else:
        assert all(text in result.stdout for text in ("Ab c, d", "Zürich|x", "*last*"))


def test_factors_stdin_without_text() -> None:
    """No text, no column."""
    rows = parse_csv(run_ok("factors", "robin", "-", "-f", "csv", stdin="1 2\n3,4\n"))
    assert [list(row) for row in rows] == [FACTORS_KEYS, FACTORS_KEYS]


@pytest.mark.parametrize("text", ["", "\n\n", "# only a remark\n"])
def test_factors_stdin_empty(text: str) -> None:
    """Nothing to measure is a usage error."""
    assert "It must have lines of 'lon lat [text]'; there were none." in refused("factors", "robin", "-", stdin=text)


@pytest.mark.parametrize("form", FORMATS)
def test_factors_stdin_of_bad_lines_only(form: str) -> None:
    """What there is of results, which is none, still parses."""
    result = run("factors", "robin", "-", "-f", form, stdin="a\nb c\n")
    assert result.exit_code == 1
    assert len(result.stderr.splitlines()) == 2
    if form == "json":
        assert json.loads(result.stdout)["results"] == []
    if form == "csv":
        assert parse_csv(result.stdout) == []


def test_factors_stdin_of_bytes() -> None:
    """Lines of any bytes are told without sending these to the terminal, and each in a line of its own length."""
    result = run("factors", "robin", "-", stdin=b"\x1b[31mred\n1 2\n\0 \x07" + b"x" * 1000)
    assert result.exit_code == 1
    assert len(result.stderr.splitlines()) == 2
    assert all(line.isprintable() and len(line) < 200 for line in result.stderr.splitlines())


# ---- files ----------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("command", ["compare", "factors"])
def test_output_file(command: str, form: str, tmp_path: Path) -> None:
    """`-o` writes what would have been printed, replaces what was there if told to, and leaves nothing else."""
    words = {"compare": ["moll", "-r", "box:0,0,9,9", *QUICK], "factors": ["moll", "-10", "20"]}[command]
    path = tmp_path / "out.txt"
    path.write_text("old\n" * 1000)
    assert run_ok(command, *words, "-f", form, "-o", str(path), "--overwrite") == ""
    assert path.read_text(encoding="utf-8") == run_ok(command, *words, "-f", form)
    assert list(tmp_path.iterdir()) == [path]


def test_output_file_with_a_failure(tmp_path: Path) -> None:
    """The results are written, the failure is told, the exit code is 1."""
    path = tmp_path / "out.json"
    result = run("compare", "moll", "nosuch", *QUICK, "-f", "json", "--output", str(path))
    assert (result.exit_code, result.stdout) == (1, "")
    assert len(json.loads(path.read_text())["results"]) == 1


PLACES = {
    "compare": ["moll", "-r", "box:0,0,9,9", *QUICK],
    "factors": ["moll", "-10", "20"],
    "tissot": ["eqc", "-r", "box:0,0,40,30", "--dpi", "20"],
    "heatmap": ["eqc", "-r", "box:0,0,40,30", "--dpi", "20"],
}


@pytest.mark.parametrize("command", PLACES)
def test_output_that_cannot_be_written(command: str, tmp_path: Path) -> None:
    """A directory that is not there, and a directory in the place of the file: one line, and nothing left behind."""
    (tmp_path / "dir.png").mkdir()
    for path in (tmp_path / "no" / "x.png", tmp_path / "dir.png"):
        assert refused(command, *PLACES[command], "-o", str(path)).startswith(f"projdist: Invalid output '{path}'. ")
    assert [path.name for path in tmp_path.rglob("*")] == ["dir.png"]


@pytest.mark.slow
@pytest.mark.parametrize("command", PLACES)
def test_output_that_fails_at_the_end(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that is full when the file is written: one line, the old file as it was, no other left behind."""
    path = tmp_path / "x.png"
    path.write_text("old")

    def full(*arguments: object, **options: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", full)
    message = refused(command, *PLACES[command], "-o", str(path), "--overwrite")
    assert "It cannot be written: No space left on device." in message
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("command", PLACES)
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_output_to_a_directory_without_permission(command: str, tmp_path: Path) -> None:
    """The same where the directory may not be written to."""
    tmp_path.chmod(0o500)
    assert "Permission denied" in refused(command, *PLACES[command], "-o", str(tmp_path / "x.png"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name == "nt", reason="devices of Unix")
def test_output_to_a_device() -> None:
    """/dev/null stays a device."""
    run_ok("factors", "moll", "10", "20", "-o", "/dev/null")
    assert Path("/dev/null").is_char_device()


# ---- list -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("what", "names"),
    [
        ("projections", [*projection_names()]),
        ("measures", [*MEASURES, "scale@AZIMUTH"]),
        ("criteria", [*CRITERIA, "pNN", *INDICES]),
        ("indices", [*INDICES]),
    ],
    ids=["projections", "measures", "criteria", "indices"],
)
@pytest.mark.parametrize("form", FORMATS)
def test_list(what: str, names: list[str], form: str) -> None:
    """All that there is, in every format, each with something said of it."""
    text = run_ok("list", what, "--format", form)
    if form == "table":
        assert all(f" {name} " in text for name in names)
        return
    rows = {"json": json.loads, "csv": parse_csv, "markdown": parse_markdown}[form](text)
    assert [row["name"] for row in rows] == names
    assert all(row.get("description") or row.get("definition") for row in rows)


@pytest.mark.slow
def test_list_says_what_names_need() -> None:
    """Parameters that a name needs stand beside it, with an example that is taken; most need none."""
    rows = {row["name"]: row for row in json.loads(run_ok("list", "projections", "-f", "json"))}
    needs = {name: row["needs"] for name, row in rows.items() if row["needs"]}
    assert needs["aea"] == "lat_1, lat_2"
    assert needs["utm"] == "zone, ellps"
    assert "robinson" not in needs
    assert 20 < len(needs) < 50
    for name in needs:
        assert run("factors", name, "1", "2").exit_code == 1
        run_ok("factors", rows[name]["definition"], "1", "2")


def test_list_has_names_that_work() -> None:
    """At least forty friendly names; those of the issue among them, and they are taken."""
    rows = json.loads(run_ok("list", "projections", "-f", "json"))
    friendly = [row["name"] for row in rows if row["kind"] == "name"]
    assert len(friendly) >= 40
    wanted = ["robinson", "winkel-tripel", "equal-earth", "plate-carree"]
    assert set(wanted) <= set(friendly)
    for name in wanted:
        run_ok("factors", name, "1", "2")


# ---- pictures -------------------------------------------------------------------------------

SMALL = ["eqc", "--dpi", "30"]
PATCH = ["-r", "box:0,0,40,30"]


def check_picture(path: Path, size: tuple[float, float] | None = None, dpi: float = 150) -> None:
    """The file is what its suffix says, and as large as asked."""
    data = path.read_bytes()
    if path.suffix.lower() == ".png":
        pixels = imread(path)
        assert pixels[..., :3].std() > 0.02, "an empty picture"
        if size:
            assert pixels.shape[:2] == (round(size[1] * dpi), round(size[0] * dpi))
    elif path.suffix == ".svg":
        root = ElementTree.fromstring(data)
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
        if size:  # SVG and PDF are in points, 72 in an inch
            assert [float(root.get(key).removesuffix("pt")) for key in ("width", "height")] == [72 * x for x in size]
    else:
        assert data.startswith(b"%PDF-")
        assert data.rstrip().endswith(b"%%EOF")
        if size:
            box = re.search(rb"/MediaBox \[ ?([\d. ]+) ?\]", data)
            assert [float(x) for x in box[1].split()][2:] == [72 * x for x in size]


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["PNG", "svg", "pdf"])
@pytest.mark.parametrize("command", ["tissot", "heatmap"])
def test_pictures(command: str, suffix: str, tmp_path: Path) -> None:
    """PNG, SVG and PDF by suffix, of the size and dots asked for; the path is printed; nothing else is left."""
    path = tmp_path / f"map.{suffix}"
    words = ["eqc", "-r", "box:0,0,40,30", "--size", "5,4", "--dpi", "50", "-o", str(path)]
    assert run_ok(command, *words) == f"{path}\n"
    check_picture(path, (5, 4), 50)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.slow
@pytest.mark.parametrize("command", ["tissot", "heatmap"])
def test_pictures_have_default_names(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without -o the picture is tissot.png or heatmap.png, where one is."""
    monkeypatch.chdir(tmp_path)
    assert run_ok(command, *SMALL, *PATCH) == f"{command}.png\n"
    check_picture(tmp_path / f"{command}.png")


@pytest.mark.slow
@pytest.mark.parametrize("command", ["tissot", "heatmap"])
def test_pictures_beside_failures(command: str, tmp_path: Path) -> None:
    """Good projections are drawn, each bad one has its line, and the exit code is 1."""
    path = tmp_path / "map.png"
    result = run(command, "nosuch", "eqc", *HIDDEN, "--dpi", "20", "-o", str(path))
    assert (result.exit_code, result.stdout) == (1, f"{path}\n")
    lines = result.stderr.splitlines()
    assert len(lines) == 2
    assert "'nosuch'" in lines[0]
    assert "No point of it can be projected" in lines[1]
    check_picture(path)


@pytest.mark.parametrize("command", ["tissot", "heatmap"])
def test_pictures_of_nothing_but_failures(command: str, tmp_path: Path) -> None:
    """No picture, exit code 1."""
    result = run(command, "nosuch", "EPSG:4326", "-o", str(tmp_path / "map.png"))
    assert (result.exit_code, result.stdout, len(result.stderr.splitlines())) == (1, "", 2)
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A picture of each kind without any option beyond `SMALL` and `PATCH`."""
    folder = tmp_path_factory.mktemp("plain")
    for command in ("tissot", "heatmap"):
        run_ok(command, *SMALL, *PATCH, "-o", str(folder / f"{command}.png"))
    return {path.stem: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        [*PATCH, "--levels", "5"],
        [*PATCH, "--levels", "0.5,1,2"],
        [*PATCH, "--cmap", "cividis"],
        [*PATCH, "--step", "7"],
        [*PATCH, "--measure", "convergence"],
        [*PATCH, "--size", "6x4"],
        ["--region", "cap:-10,-40,2000"],
    ],
    ids=" ".join,
)
def test_heatmap_options_change_the_picture(options: list[str], plain: dict[str, bytes], tmp_path: Path) -> None:
    """Each option is taken, and changes what is drawn."""
    run_ok("heatmap", *SMALL, *options, "-o", str(tmp_path / "x.png"))
    assert (tmp_path / "x.png").read_bytes() != plain["heatmap"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "options", [[*PATCH, "--step", "5"], [*PATCH, "--size", "6,4"], ["-r", "cap:0,40,2000"]], ids=" ".join
)
def test_tissot_options_change_the_picture(options: list[str], plain: dict[str, bytes], tmp_path: Path) -> None:
    """The same for the indicatrices."""
    run_ok("tissot", *SMALL, *options, "-o", str(tmp_path / "x.png"))
    assert (tmp_path / "x.png").read_bytes() != plain["tissot"]


@pytest.mark.slow
def test_heatmap_of_an_unknown_colour_map(tmp_path: Path) -> None:
    """Refused by its name, and no picture is written."""
    message = refused("heatmap", "robin", "--cmap", "nosuch", "--dpi", "20", "-o", str(tmp_path / "x.png"))
    assert "Invalid colour map 'nosuch'. It must be a name of matplotlib" in message
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_heatmap_too_small_for_its_panels(tmp_path: Path) -> None:
    """A size without room is a usage error, not a broken picture."""
    assert "no room" in refused("heatmap", "robin", "--size", "0.5,0.5", "-o", str(tmp_path / "x.png"))


@pytest.mark.slow
@pytest.mark.parametrize("projection", [name for name in projection_names() if "-" not in name])
def test_every_name_makes_numbers_and_a_picture(projection: str, tmp_path: Path) -> None:
    """What `list projections` names is compared and drawn without a word on stderr, or asks for its parameters."""
    result = run("compare", projection, *QUICK)
    if result.exit_code:
        assert re.fullmatch(r"projdist: [^\n]* needs [^\n]*: give a PROJ string[^\n]*\n", result.stderr)
        return
    assert result.stderr == ""
    run_ok("heatmap", projection, "--dpi", "30", "-o", str(tmp_path / "map.png"))


# ---- as a process ---------------------------------------------------------------------------


@pytest.mark.slow
def test_module_is_the_command() -> None:
    """`python -m projdist` compares, and returns the exit code."""
    done = process("compare", "moll", "nosuch", *QUICK, "-f", "json", text=True)
    assert done.returncode == 1
    assert len(json.loads(done.stdout)["results"]) == 1
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.slow
def test_script_is_the_command() -> None:
    """So does the installed `projdist`."""
    script = Path(sys.executable).with_name("projdist")
    done = subprocess.run([script, "factors", "merc", "-10", "-60", "-f", "csv"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert float(parse_csv(done.stdout)[0]["k"]) == pytest.approx(2, rel=1e-11)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="pipes of Unix")
def test_broken_pipe() -> None:
    """`projdist list projections | head -1` says nothing on stderr."""
    command = f"{sys.executable} -m projdist list projections | head -1"
    done = subprocess.run(command, shell=True, capture_output=True, text=True)
    assert done.stderr == ""
    assert len(done.stdout.splitlines()) == 1
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "wb") as closed:
        done = subprocess.run(
            [sys.executable, "-m", "projdist", "list", "projections", "-f", "json"],
            stdout=closed,
            stderr=subprocess.PIPE,
            text=True,
        )
    assert done.stderr == ""
    assert done.returncode != 0


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="devices and descriptors of Unix")
@pytest.mark.parametrize("redirection", [">/dev/full", ">&-", "<&-", "2>&-"])
@pytest.mark.parametrize("words", ["list projections", "factors robin -", "compare nosuch"])
def test_streams_that_are_closed_or_full(redirection: str, words: str) -> None:
    """A standard stream that cannot be used is no traceback; what cannot be written is said."""
    command = f"echo 1 2 | {sys.executable} -m projdist {words} {redirection}"
    done = subprocess.run(command, shell=True, capture_output=True, text=True)
    assert "Traceback" not in done.stderr
    if "full" in redirection:
        assert done.returncode == 2
        assert "It cannot be written: No space left on device." in done.stderr.splitlines()[0]


@pytest.mark.slow
def test_output_that_is_not_utf8() -> None:
    """Where the locale has ASCII only, tables are drawn with ASCII and nothing stops."""
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = process("factors", "robin", "-", input="1 2 Zürich\n".encode(), env=environment)
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"+--" in done.stdout
    done = process("factors", "robin", "-", "-f", "json", input=b"1 2 Z\xfcrich\n", env=environment)
    assert done.returncode == 0
    assert "rich" in json.loads(done.stdout)["results"][0]["text"]


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="arguments of Unix are bytes")
def test_bytes_that_are_no_text() -> None:
    """Broken UTF-8 in arguments and on stdin stops nothing, and the JSON is valid."""
    done = process("compare", b"\xff", "-f", "json")
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
    assert len(json.loads(done.stdout)["failures"]) == 1
    done = process("factors", "robin", "-", "-f", "csv", input=b"1 2 \xff\n3 4 ok\n")
    assert (done.returncode, done.stderr) == (0, b"")
    assert len(done.stdout.splitlines()) == 3
