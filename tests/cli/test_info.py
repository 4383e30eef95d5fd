"""The commands `info` and `find`."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from commands import parse_csv, parse_markdown, refusal, run, run_json, run_ok

from projdist.cli.draw import _drawn, sketch_of
from projdist.projections import Projection
from projdist.regions import get_region


def test_a_card() -> None:
    """What is stated, what is kept as measured, the errors, and a map in characters."""
    text = run_ok("info", "EPSG:3035", "--details")
    shown = [
        *("\nEPSG:3035: ETRS89-extended / LAEA Europe\n", "Over its area of use (33,095,996 km2)\n"),
        *("│ keeps       │ areas (equal-area, to ", "│ bounds      │ 35.58°W to 44.83°E, 24.6°N to 84.73°N "),
        "│ ellipsoid   │ GRS 1980, a 6378137 m, 1/f 298.257222101 ",
        "│ coordinates │ northing (north), easting (east) in metre ",
        "│ Latitude of natural origin  │      52 │ degree │",
    ]
    assert [line for line in shown if line not in text] == []
    assert re.search(r"\nScale error: ░ to [\d.]+, ▒ to [\d.]+, ▓ to [\d.]+, █ to [\d.]+ %; · sea\n", text)


@pytest.mark.slow
def test_deprecated_ones_are_said() -> None:
    """A conformal method far outside of where it is meant for is told to be none."""
    assert "│ status      │ deprecated; use EPSG:2953 instead " in run_ok("info", "EPSG:2036", "--details")
    result = run("info", "+proj=nzmg +ellps=intl", "-r", "box:0,40,20,60", "--details")
    assert "should keep │ angles, by its method: it is not conformal as measured" in result.stdout
    assert "is not conformal here" in result.stderr


@pytest.mark.slow
def test_formats(tmp_path: Path) -> None:
    """JSON has all, CSV a row, Markdown tables without the characters; a picture and a page are files."""
    assert run_json("info", "EPSG:32633")["keeps"] == ["conformal"]
    (row,) = parse_csv(run_ok("info", "mollweide", "-f", "csv"))
    assert (row["keeps"], row["kind"], row["code"]) == ("equal-area", "PROJ string", "")
    text = run_ok("info", "EPSG:2056", "-f", "markdown")
    first, *_ = parse_markdown(text.partition("\nParameters")[0])
    assert (first, "░" in text) == ({"what": "kind", "it is": "projected CRS"}, False)
    picture, page = tmp_path / "a.png", tmp_path / "a.html"
    assert run_ok("info", "EPSG:2056", "-o", picture, "--dpi", "30").endswith(f"Wrote: {picture}\n")
    assert run_ok("info", "EPSG:2056", "-o", page) == f"Wrote: {page}\n"
    assert picture.stat().st_size > 2000
    assert "LV95" in page.read_text(encoding="utf-8")


def test_shades_are_quarters() -> None:
    """Sixteen characters of land in order of their errors, with sea to the right."""
    values = np.column_stack([np.arange(16.0).reshape(4, 4), np.zeros(4)])
    land = values >= 0
    land[:, 4] = False
    lines = _drawn(np.ones((4, 5), dtype=bool), values, land, unicode=True)
    assert lines == ["░░░░·", "▒▒▒▒·", "▓▓▓▓·", "████·", "Scale error: ░ to 3.8, ▒ to 7.5, ▓ to 11, █ to 15 ppm; · sea"]
    plain = _drawn(np.ones((4, 4), dtype=bool), 1e5 * values[:, :4], land[:, :4], unicode=False)
    assert plain == ["----", "++++", "xxxx", "####", "Scale error: - to 38, + to 75, x to 110, # to 150 %"]


def test_a_sketch_is_the_map(tmp_path: Path) -> None:
    """Mercator's map of a strip of ocean is darkest at both ends, and as high as it is; points have none."""
    strip = get_region("box:-35,-60,-25,60")
    *lines, legend = sketch_of(Projection.from_user_input("mercator"), strip, tmp_path / "x.txt")
    # The map is 2 ln tan(75 degrees) / (pi / 18) = 15.1 times as high as wide, and so are two characters by 15.
    assert [len(line) for line in lines] == [2] * 15
    assert (lines[0], lines[7], lines[-1], "sea" in legend) == ("██", "░░", "██", False)
    (tmp_path / "a.csv").write_text("lon,lat\n1,2\n3,4\n")
    assert sketch_of(Projection.from_user_input("robin"), get_region(f"points:{tmp_path / 'a.csv'}")) == []
    assert "(2 points)" in run_ok("info", "robin", "-r", f"points:{tmp_path / 'a.csv'}", "--details")


@pytest.mark.slow
def test_other_bodies() -> None:
    """Regions are on the map's body: the globe of Mars has 4 pi 3396.19^2 km2; what is not there is refused."""
    assert "Over globe (144,941,857 km2)" in run_ok("info", "IAU_2015:49910", "--details")
    jupiter = 2.0 * math.pi * 71492.0**2 * (1.0 - math.cos(50_000.0 / 71492.0))
    words = ("info", "+proj=eqc +R=71492000", "-r", "cap:0,0,50000", "--details")
    assert f"Over cap:0,0,50000 ({jupiter:,.0f} km2)" in run_ok(*words)
    two = "EPSG:3857 IAU_2015:49910"
    for words, message in {
        "info IAU_2015:49910 -r country:CH": "region 'country:CH'. It is on the Earth, not on ",
        "info IAU_2015:49910 -r cap:0,0,15000": "cap '0,0,15000'. Its radius must be above 0 ",
        f"compare {two}": "maps 'EPSG:3857' and 'IAU_2015:49910'. They are of ",
        f"compare {two} -r cap:0,0,5": "maps 'EPSG:3857' and 'IAU_2015:4",
        f"tissot {two} -o never.png": "maps 'EPSG:3857' and 'IAU_2015:4",
        f"compare {two} --regions box:0,0,1,1": "maps 'EPSG:3857' and ",
    }.items():
        assert refusal(*words.split(), code=2 if words.startswith("info") else 1).startswith(f"Invalid {message}")


@pytest.mark.slow
def test_a_table_of_hits() -> None:
    """The likeliest first, and how many more there are."""
    first = r"The likeliest of \d+ is EPSG:2154 \(RGF93 v1 / Lambert-93\)\.\n"
    assert re.match(first, run_ok("find", "lambert", "93"))
    text = run_ok("find", "lambert", "93", "--limit", "2", "--details")
    assert "│ EPSG:2154 │ RGF93 v1 / Lambert-93 │ France      │" in text
    assert re.search(r"\n\d+ more: --limit \d+ shows all\.\n$", text)
    assert "(deprecated)" in run_ok("find", "2036")
    assert "more" not in run_ok("find", "EPSG:3035", "--details")
    found = run_json("find", "utm 33", "--authority", "EPSG", "--limit", "1")
    assert [hit["code"] for hit in found["results"]] == ["EPSG:32633"]
    (row,) = parse_csv(run_ok("find", "EPSG:3035", "-f", "csv"))
    assert (row["code"], row["west"], row["deprecated"]) == ("EPSG:3035", "-35.58", "False")
    assert parse_markdown(run_ok("find", "EPSG:3035", "-f", "markdown"))[0]["code"] == "EPSG:3035"


@pytest.mark.slow
@pytest.mark.parametrize("form", ["table", "json", "csv"])
def test_nothing(form: str) -> None:
    message = "Nothing was found for 'amersfort'. Did you mean 'amersfoort'?"
    assert refusal("find", "amersfort", "-f", form, code=1) == message


@pytest.mark.slow
def test_what_a_region_is(tmp_path: Path) -> None:
    """A sentence, its limits and what it is made of; options of maps are refused."""
    assert run_ok("info", "Lower 48").startswith("The Contiguous United States has 7,9")
    assert "│ country:AT " in run_ok("info", "EU", "--details")
    row = parse_csv(run_ok("info", "box:1,2,3,4", "-f", "csv"))[0]
    assert (row["region"], row["west"], row["north"], row["definition"]) == ("box:1,2,3,4", "1.0", "4.0", "")
    (tmp_path / "p.csv").write_text("lon,lat\n1,2\n3,4\n")
    assert run_ok("info", f"points:{tmp_path / 'p.csv'}").startswith("The 2 points of p.csv lie from 0.9°E to 3.1°E")
    for words in (("-r", "land"), ("-o", tmp_path / "x.png")):
        assert "It is for projections, not for a region." in refusal("info", "Europe", *words)
    assert not (tmp_path / "x.png").exists()
