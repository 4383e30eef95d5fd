"""The command `recommend`: formats, options, the picture, words, and what is refused."""

import io
import time
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from commands import Terminal, command, parse_csv
from matplotlib.image import imread
from tables import each

from projdist import recommend
from projdist.cli.app import app
from projdist.cli.errors import progress_bar, without_progress, working
from projdist.cli.recommend import _drawable
from projdist.decisions.measurement import INTERRUPTED, Rejected
from projdist.decisions.recommendation import Custom
from projdist.decisions.zones import Zone, ZoneSystem
from projdist.regions import GLOBE

run, run_ok, run_json, _ = command("recommend")

ISLAND = "box:-7.2,61.3,-6.2,62.5"
QUICK = ["--authority", "EPSG", "--limit", "3"]


@pytest.fixture(scope="module")
def found():
    return recommend(ISLAND, authorities=["EPSG"], limit=3)


@pytest.fixture
def known(found, monkeypatch):
    """The answer is there already: what it looks like takes no second search."""
    monkeypatch.setattr("projdist.decisions.recommend", lambda *_, **__: found)
    return found


USUAL = {
    **{"authorities": ["EPSG"], "limit": 3, "datum": None, "deprecated": False, "area": "preferred", "purpose": "any"},
    **{"criterion": "airy_kavrayskiy", "custom": False, "uninterrupted": False, "progress": None, "executor": None},
}


@pytest.mark.slow
@each(("words", "given"), [
    ("--datum FD54 --deprecated", {"datum": "FD54", "deprecated": True}),
    ("--purpose conformal --intersects", {"purpose": "conformal", "area": "intersects"}),
    ("--criterion max_omega --contains", {"criterion": "max_omega", "area": "contains"}),
    ("--custom --uninterrupted", {"custom": True, "uninterrupted": True}),
])  # fmt: skip
def test_json(words, given, found):
    """The dictionary of the Python function, which has the options; `--quiet` wants no progress."""
    with mock.patch("projdist.decisions.recommend", return_value=found) as asked:
        assert run_json(ISLAND, *QUICK, "--quiet", *words.split()) == found.to_dict()
    (place,), options = asked.call_args
    assert (place.name, {name: options[name] for name in USUAL}) == (ISLAND, USUAL | given)


@pytest.mark.slow
def test_table(known):
    """Every candidate with its columns; below, what draws the same map, and what was rejected."""
    out = run_ok(ISLAND, *QUICK)
    assert out.startswith(f"Use {known.official.code} ({known.official.name}) for ")
    assert f"\n{ISLAND} (" in out
    for one in known.results:
        assert one.code in out
        assert f"{one.value:.5g}" in out
        assert [other for other, _ in one.same if other not in out.partition("draws the same map as")[2]] == []
    shown = ("ppm max", "omega max", "areal scale", "covers", "in area", "area of use", "were tried", "Rejected")
    assert [text for text in shown if text not in out] == []
    assert "cuts" not in out


@pytest.mark.slow
def test_far_parts_are_told_once():
    """What lies far away stands on the standard error; the answer says what part it is for, and no more of it."""
    code, out, err = run("country:FR", "--authority", "EPSG", "--datum", "RGF93 v1", "--limit", "1")
    assert code == 0
    assert "\nThe answer is for the main part, country:FR@main.\n" in out
    assert (out.count("km from the main part"), err.count("km from the main part")) == (0, 1)


def test_forms_of_an_answer(known):
    """Rows of CSV have their numbers in full and nothing where there is none, tables begin with the codes."""
    out = run_ok(ISLAND, *QUICK, "--format", "csv")
    rows = parse_csv(out)
    assert [row["code"] for row in rows] == [one.code for one in known.results]
    assert [float(row["value"]) for row in rows] == [one.value for one in known.results]
    assert {row["ratio_to_custom"] for row in rows} == {""}
    assert [float(row["over_limit"]) for row in rows] == [one.value / known.limit for one in known.results]
    out = run(ISLAND, *QUICK, "--format", "markdown")[1]
    assert out.startswith("| code | name | method | ranks by | airy_kavrayskiy | over limit |")
    assert f"| {known.results[0].code} |" in out
    assert [one for one in known.results if f"| x {one.value / known.limit:.3g} |" not in out] == []
    assert f"over {known.limit:.3g}, about what the best possible map" in run(ISLAND, *QUICK)[1]


def test_the_official_one(found, monkeypatch):
    """The country's own CRS is named, with its figures where no row has them."""
    first, *others = found.results
    official = replace(first, code="EPSG:1")
    named = f"EPSG:1, {first.name}, airy_kavrayskiy "
    for results, expected in (((official, *others), "EPSG:1."), (tuple(others), named)):
        answer = replace(found, country="Atlantis", official=official, results=results)
        monkeypatch.setattr("projdist.decisions.recommend", lambda *_, answer=answer, **__: answer)
        own = "The best of Atlantis's own for general use, on its datum in force: "
        assert f"{own}{expected}" in run(ISLAND, *QUICK)[1]


@pytest.fixture
def rich(found, monkeypatch):
    """An answer with all that there may be: cuts, zones, custom projections, reasons; two of its CRSs are torn."""
    whole, *others = found.results
    torn = [replace(one, distortion=replace(one.distortion, cut_km=1234.6)) for one in others]
    figures = replace(whole.distortion, airy_kavrayskiy=0.5 * whole.value, max_omega=np.inf, max_areal_scale=np.inf)
    found_by = {"family": "laea", "name": "LAEA", "proj": "+proj=laea +lat_0=62", "parameters": {"lat_0": 62.0}}
    custom = Custom(**found_by, value=0.5 * whole.value, distortion=figures, keeps=())
    zone = Zone("EPSG:1", "A", "east", 0.25, 1e-4, 73.04)
    system = {"name": "A to B", "share": 1.0, "value": 1e-4, "max_scale_error_ppm": 73.04, "zones": (zone,)}
    reasons = ("Its area of use holds 3 % of the region.", "It can be projected to 50 %.", INTERRUPTED, "Broken.")
    answer = replace(
        found,
        results=(replace(whole, ratio_to_custom=2.0), *torn),
        custom=(custom,),
        not_custom=(Rejected("", "tmerc", "It is not equal-area."),),
        zones=tuple(ZoneSystem(**system, national=national) for national in (True, False)),
        rejected=tuple(Rejected("EPSG:9", "C", reason) for reason in (*reasons, reasons[0])),
    )
    monkeypatch.setattr("projdist.decisions.recommend", lambda *_, **__: answer)
    return answer


SHOWN = [
    *("+100.00 %", "cuts km", "1,235", "custom laea", "+proj=laea +lat_0=62", "EPSG:1", "25 %"),
    "No custom tmerc: It is not equal-area.",
    "Zones: no conformal map keeps all of the region within 100 ppm",
    "2 whose area of use holds too little of the region; 1 that project too little of it; 1 that are interrupted; 1 "
    "that PROJ cannot compute.",
]


def test_all_that_an_answer_may_have(rich):
    """Cuts, zones and custom projections have columns and tables, in Markdown, too; what has no bound says so."""
    for form in ("details", "markdown"):
        out = run_ok(ISLAND, "--format", form)
        assert [text for text in SHOWN if text not in out] == []
        assert out.count("inf") >= 2
    table = run(ISLAND)[1]
    assert "1 national zones, each in its part at most 73.04 ppm" in table
    assert "1 zones of the world" in table
    rows = parse_csv(run(ISLAND, "--format", "csv")[1])
    assert [row["proj"] for row in rows] == [*[""] * len(rich.results), "+proj=laea +lat_0=62"]
    assert (rows[0]["ratio_to_custom"], rows[-1]["max_omega"]) == ("2.0", "")
    (custom,) = run_json(ISLAND)["custom"]
    assert (custom["max_omega"], custom["parameters"]) == (None, {"lat_0": 62.0})


def test_what_a_picture_shows(rich, tmp_path, monkeypatch):
    """The best that are not torn, the best custom projection last; torn ones where there is nothing else."""
    drawn = []
    monkeypatch.setattr("projdist.plots.heatmap_figure", lambda maps, **options: drawn.append((maps, options)))
    monkeypatch.setattr(
        "projdist.cli.options.PictureFile.save", lambda _, draw, *shown, **options: draw(*shown, **options)
    )
    run_ok(ISLAND, "-o", tmp_path / "x.png")
    ((maps, options),) = drawn
    assert maps == [rich.results[0].code, "+proj=laea +lat_0=62"]
    assert options["titles"] == ["ETRS89 / Faroe TM (EPSG:5316)", "custom laea"]
    assert options["airy_kavrayskiy"] == [rich.results[0].distortion.airy_kavrayskiy, 0.5 * rich.results[0].value]
    torn = replace(rich, results=rich.results[1:])
    assert _drawable(torn) == torn.results
    assert _drawable(replace(torn, region=GLOBE)) == torn.results


@each(("error", "code", "message"), [
    (OSError("Timed out."), 1, "Invalid executor 'dask://localhost:1'. Nothing answers there."),
    (ImportError("It needs Dask."), 2, "It needs Dask."),
])  # fmt: skip
def test_nobody_answers(error, code, message):
    """A scheduler that is not there, or a library, is told in a line; a missing library ends with 2, as any other."""
    with mock.patch("projdist.support.open_executor") as missing:
        missing.return_value.__enter__.side_effect = error
        assert run(ISLAND, "--executor", "dask://localhost:1") == (code, "", f"projdist: {message}\n")


@pytest.mark.slow
def test_picture(tmp_path):
    """Heat maps of the best, in a picture that is no blank."""
    path = tmp_path / "comparison.png"
    out = run_ok(ISLAND, *QUICK, "-o", str(path), "--dpi", "50")
    assert out.endswith(f"Wrote: {path}\n")
    picture = imread(path)
    assert picture.shape[1] > picture.shape[0] * 0.8
    assert picture[..., :3].std() > 0.05


def test_no_bar_before_wrong_words_are_refused(monkeypatch):
    """The progress bar comes with the first news, after two seconds, and leaves nothing."""
    monkeypatch.setenv("TERM", "xterm")
    shown = Terminal()
    monkeypatch.setattr("sys.stderr", shown)
    with pytest.raises(SystemExit) as ended:
        app(["recommend", ISLAND, "--criterion", "beauty"])
    assert ended.value.code == 2
    assert shown.getvalue().startswith("projdist: Invalid criterion 'beauty'.")
    with progress_bar("maps", after=0.0) as move:
        assert "maps" not in shown.getvalue()
        move(1, 4)
        assert " maps " in shown.getvalue()
    shown = Terminal()
    monkeypatch.setattr("sys.stderr", shown)
    with progress_bar("frames") as move:
        move(1, 4)
        assert shown.getvalue() == ""
    with progress_bar("frames", after=0.0) as move:
        move(1, 4)
    assert "1/4" in shown.getvalue()


def test_progress_in_a_pipe(monkeypatch):
    """A line now and then, after a moment; none if nobody wants it."""
    monkeypatch.setattr("sys.stderr", pipe := io.StringIO())
    for moment, apart in ((60.0, 60.0), (0.0, 60.0), (0.0, 0.0)):
        monkeypatch.setattr("projdist.cli.errors._MOMENT_IN_A_PIPE", moment)
        monkeypatch.setattr("projdist.cli.errors._LINES_APART", apart)
        with progress_bar("frames") as move:
            move(1, 4)
            move(2, 4)
    assert pipe.getvalue().splitlines() == [f"projdist: {done} of 4 frames ..." for done in (1, 1, 2)]
    with without_progress(True), progress_bar("frames") as move, working("Drawing"):
        assert move is None
        time.sleep(0.05)
    assert "Drawing" not in pipe.getvalue()
    assert "--quiet" in run_ok("--help")


@pytest.mark.slow
def test_words_for_what_cannot_be_counted(monkeypatch):
    """They come after a moment, and go; in a pipe they are a line, the last words that were set by then."""
    monkeypatch.setenv("TERM", "xterm")
    for name in ("_MOMENT", "_MOMENT_IN_A_PIPE"):
        monkeypatch.setattr(f"projdist.cli.errors.{name}", 0.05)
    for stream in (Terminal(), io.StringIO()):
        monkeypatch.setattr("sys.stderr", stream)
        with working("Measuring") as show:
            show("Drawing")
            time.sleep(0.3)
        assert "Drawing" in stream.getvalue()
    assert stream.getvalue() == "projdist: Drawing ...\n"
    monkeypatch.setattr("projdist.cli.errors._MOMENT", 60.0)
    quick = Terminal()
    monkeypatch.setattr("sys.stderr", quick)
    with working("Drawing"):
        pass
    assert "Drawing" not in quick.getvalue()
