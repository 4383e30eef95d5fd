"""Forty questions of five kinds of people: the first command that help or the README leads to answers in three lines.

Each is asked in a terminal of 80 columns, whose screen has 24 lines. The samples on the pages are what is printed.
"""

import re
import shlex
import sys
from pathlib import Path

import pytest
from commands import Terminal
from rich.cells import cell_len

from projdist.cli.app import app

slow = pytest.mark.slow
COLUMNS, LINES, FIRST = 80, 24, 3

PARCELS = """{"type": "FeatureCollection", "features": [
{"type": "Feature", "properties": {"name": "north"}, "geometry": {"type": "Polygon", "coordinates":
[[[8.0, 47.0], [8.1, 47.0], [8.1, 47.1], [8.0, 47.1], [8.0, 47.0]]]}}]}"""
TOWNS = "lon,lat\n8.5,47.4\n7.4,46.9\n6.1,46.2\n"
CLOUDS = ("x,y\n0,0\n1,0\n0,1\n1,1\n", "x,y\n0,0\n1.1,0\n0,1\n1.1,1\n")
MAP_POINTS = "".join(f"{x},{y},{30 * x + y * y},{30 * y + x}\n" for x in range(5) for y in range(5))

# What is asked, how, and what the first three lines say to it.
TASKS = {
    # GIS analysts
    "Which CRS for Kenya?": ("recommend Kenya", "EPSG:21037 (Arc 1960 / UTM zone 37S) in the southeast", slow),
    "Which for New Zealand?": ("recommend 'New Zealand@main'", "Use EPSG:2193 (NZGD2000 / New Zealand", slow),
    "Which to compare areas in Germany?": ("recommend DE --for areas", "areas are true", slow),
    "Which for a web map of Germany?": ("recommend DE --for web", "Use EPSG:3857 (WGS 84 / Pseudo-Mercator)", slow),
    "Which for a sea chart of Iceland?": ("recommend Iceland --for navigation", "Use EPSG:3395 (WGS 84", slow),
    "Which for a printed map of Portugal?": ("recommend PT@main --for print", "Use EPSG:3763 (ETRS89 /", slow),
    "What is EPSG:2056?": ("info 2056", "EPSG:2056 (CH1903+ / LV95) keeps angles."),
    "What does Web Mercator do to Norway?": ("info 3857 -r Norway@main", "areas by a factor of 9.6"),
    "Which code has UTM zone 37 south?": ("find utm 37s", "EPSG:32737 (WGS 84 / UTM zone 37S)"),
    "What do the Swiss use?": ("find swiss", "EPSG:2056 (CH1903+ / LV95)"),
    "UTM or LAEA for Germany?": ("compare 25832 3035 -r Germany", "LAEA Europe distorts Germany least"),
    "Are areas of my parcels right?": ("check parcels.geojson --crs 3857", "areas are off by at most a factor of 2.2"),
    "And in the national grid?": ("check parcels.geojson --crs 2056", "areas are off by at most 0.0"),
    "Can I have them in UTM?": ("convert parcels.geojson 25832 -o new.gpkg", "Wrote: new.gpkg"),
    # Cartographers
    "Robinson or Winkel Tripel?": ("compare robinson winkel-tripel", "Winkel Tripel distorts the globe least"),
    "What does Robinson keep?": ("info robinson", "keeps neither areas, angles nor distances"),
    "Which parameters of Lambert's cone for Europe?": ("optimize lcc box:-30,27,45,71 --round 0.5", "+lat_1=36", slow),
    "Which map for Chile, of all that there are?": ("design CL@main --degree 3", "less than on EPSG:20049", slow),
    "What was measured of New Zealand?": ("atlas NZ", "is EPSG:2193"),
    "Which places are in the atlas?": ("atlas", "400 places"),
    "Which map is between two?": ("mean-map robinson moll --degree 5", "The mean of 2 maps over 85°S to 85°N", slow),
    "A map of the land?": ("world-map land --cells 16", "less than on", slow),
    "How much better is a plate carree that is squeezed?": ("correct plate-carree", "19 % less"),
    "May I see Tissot's ellipses?": (
        "tissot robinson --dpi 30 -o t.png",
        "On Robinson, scales are off by 35 %",
        slow,
    ),
    "And the angles in colour?": ("heatmap robinson -m omega --dpi 30 -o h.png", "On Robinson, scales are off", slow),
    # Surveyors
    "A ground projection for a town?": ("ldp box:-105.3,39.9,-105.1,40.1 --height 1610", "by at most 0.58 ppm"),
    "Which way is grid north?": ("factors 32610 -- -120 34", "Grid north lies 1.67865° east of true north."),
    "Scale at many points?": ("factors 2056 --at towns.csv", "At 3 points on"),
    "How long is my road on the map?": ("profile 25832 --line 6,47,15,55", "1 in 17,000 too long on average"),
    "And on the ground at 1600 m?": ("profile 32613 --line -105,40,-104.5,40 --height 1600", "combined factor"),
    "May areas be off by 0.1 %?": ("check parcels.geojson --crs 2056 --fail-above 0.1%", "areas are off"),
    # Teachers
    "Which maps are there?": ("list projections", "107 projections: plate-carree"),
    "What can be measured?": ("list measures", "21 measures: fisher"),
    "Are the textbook's figures right?": ("tables canters-decleir", "8 come out as printed"),
    "Which tables are there?": ("tables", "9 published tables"),
    "How large is Greenland on Mercator's map?": ("factors mercator -- -40 72", "areas by a factor of 11"),
    # Researchers
    "How many times worse is Mercator's than Mollweide's?": ("compare moll merc", "35 % more"),
    "Do two clouds differ by a stretch?": ("clouds a.csv b.csv", "2 clouds are brought to the frame of their mean"),
    "How distorted is an old map?": ("oldmap points.csv", "the old map's scales are off by 3.9 %", slow),
    "Do two images fit together?": ("mosaic --correspondences pairs.csv --sizes 100x100,100x100", "2 images are", slow),
}


@pytest.fixture(autouse=True)
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """People's files."""
    files = {"parcels.geojson": PARCELS, "towns.csv": TOWNS, "a.csv": CLOUDS[0], "b.csv": CLOUDS[1]}
    files |= {"points.csv": MAP_POINTS, "pairs.csv": PAIRS}
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    monkeypatch.setenv("NO_COLOR", "1")


PAIRS = "model,i,j,xi,yi,xj,yj\n" + "".join(
    f"affine,0,1,{x},{y},{1.1 * x - 40},{y}\n" for x, y in ((50, 10), (90, 20), (60, 80), (95, 90), (70, 50))
)


def test_there_are_forty() -> None:
    assert len(TASKS) == 40


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "said"),
    [pytest.param(command, said, id=asked, marks=marks) for asked, (command, said, *marks) in TASKS.items()],
)
def test_the_first_lines_answer(command: str, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """In words that are told on one screen, none of whose lines is wider than it."""
    if "geojson" in command:
        pytest.importorskip("geopandas")
    terminal = Terminal()
    monkeypatch.setattr(sys, "stdout", terminal)
    with pytest.raises(SystemExit) as ended:
        app(shlex.split(command))
    lines = terminal.getvalue().splitlines()
    assert ended.value.code == 0
    assert said in " ".join(" ".join(lines[:FIRST]).split())
    assert len(lines) <= LINES
    assert [line for line in lines if cell_len(line) > COLUMNS] == []


ROOT = Path(__file__).parents[2]
# A command, and its answer up to a table, what is left out ("...") or an empty line.
SAMPLE = re.compile(r"^\$ projdist ([^|\n]+)\n((?![┏$`\n]|\.\.\.).*?)(?=^[┏$`]|^\.\.\.|^$)", re.MULTILINE | re.DOTALL)
SAMPLES = [
    (command, answer)
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
    for command, answer in SAMPLE.findall(page.read_text(encoding="utf-8"))
]


def words(text: str) -> str:
    """Its words, with 12 digits of numbers: the last are rounding."""
    return " ".join(re.sub(r"\d\.\d{12,}", lambda number: f"{float(number[0]):.12g}", text).split())


@pytest.mark.slow
@pytest.mark.parametrize(("command", "answer"), SAMPLES, ids=[command for command, _ in SAMPLES])
def test_samples_on_pages_are_what_is_printed(command: str, answer: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The sentences before the table; lines may be folded elsewhere."""
    with pytest.raises(SystemExit) as ended:
        app(shlex.split(command))
    assert ended.value.code == 0
    assert words(capsys.readouterr().out).startswith(words(answer))
