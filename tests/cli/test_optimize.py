"""The command `optimize`: formats, options, and what is refused."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from commands import command
from pyproj import CRS

from projdist import optimize, recommend, summarize
from projdist.cli.optimize import _best_existing
from projdist.decisions.optimization import Optimum
from projdist.regions import get_region

run, run_ok, run_json, refusal = command("optimize")

SQUARE = "box:5,47,15,55"
KEYS = {
    *("family", "region", "criterion", "parameters", "scale", "value"),
    *("proj", "wkt", "roundings", "baselines", "others"),
}


@pytest.mark.slow
def test_json() -> None:
    answer = run_json("lcc", SQUARE, "--round", "0.5")
    assert set(answer) >= KEYS
    assert answer == optimize("lcc", SQUARE, round_to=0.5).to_dict()


@pytest.mark.slow
def test_against() -> None:
    """A projection, or the best existing CRS: the last of the baselines, with the figure that recommend has."""
    out = run_ok("laea", SQUARE, "--against", "EPSG:4839", "--against", "robinson", "--format", "json")
    *_, one, other = json.loads(out)["baselines"]
    assert (one["definition"], other["name"]) == ("EPSG:4839", "Robinson")
    assert one["value"] == pytest.approx(summarize("EPSG:4839", SQUARE).airy_kavrayskiy, rel=1e-5)
    out = run_ok("laea", SQUARE, "--against", "recommend", "--criterion", "max_omega", "--format", "json")
    (best,) = recommend(SQUARE, criterion="max_omega", limit=1).results
    last = json.loads(out)["baselines"][-1]
    assert last["definition"] == best.code
    assert last["value"] == pytest.approx(best.value, abs=1e-6)


@pytest.mark.slow
def test_against_what_does_not_show_the_region() -> None:
    assert refusal("lcc", SQUARE, "--against", "+proj=ortho +lat_0=0 +lon_0=100 +R=6371000", code=1).endswith(
        f"to compare with. It shows 50 % of {SQUARE}."
    )


@pytest.mark.slow
def test_proj() -> None:
    out = run_ok("lcc", SQUARE, "--free", "lat_1, lat_2", "-f", "proj")
    assert out.startswith("+proj=lcc +ellps=WGS84")


@pytest.fixture(scope="module")
def best() -> Optimum:
    return optimize("lcc", SQUARE)


def test_forms_of_an_answer(best: Optimum, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """JSON, PROJ, WKT, also in a file; where there is no WKT the reason, with 1."""
    monkeypatch.setattr("projdist.decisions.optimize", lambda *_, **__: best)
    assert run_json("lcc", SQUARE) == best.to_dict()
    assert run("lcc", SQUARE, "-f", "proj")[1] == f"{best.proj}\n"
    assert run("lcc", SQUARE, "-f", "wkt")[1] == f"{best.wkt}\n"
    path = tmp_path / "best.wkt"
    assert run("lcc", SQUARE, "-f", "wkt", "-o", str(path)) == (0, f"Wrote: {path}\n", "")
    assert CRS.from_wkt(path.read_text()).is_projected
    nothing = replace(best, wkt=None, wkt_reason="It has none.")
    monkeypatch.setattr("projdist.decisions.optimize", lambda *_, **__: nothing)
    name = best.projection.name
    assert run("lcc", SQUARE, "-f", "wkt") == (1, "", f"projdist: Invalid format 'wkt' for {name}. It has none.\n")


@pytest.mark.slow
def test_the_limit(best: Optimum, monkeypatch: pytest.MonkeyPatch) -> None:
    """A line says how many times the limit the optimum has, for the figure that has one."""
    monkeypatch.setattr("projdist.decisions.optimize", lambda *_, **__: best)
    assert best.limit is not None
    assert f"\n{best.value / best.limit:.3g} times the limit " in run("lcc", SQUARE)[1]
    monkeypatch.undo()
    assert "the limit" not in run("eqc", SQUARE, "--free", "lat_ts", "--criterion", "max_omega")[1]


def test_the_best_existing(monkeypatch: pytest.MonkeyPatch) -> None:
    """That of recommend, by the same criterion; where there is none that is said."""
    asked = []

    def recommended(codes: list[str]) -> Callable[..., SimpleNamespace]:
        def recommend(region: object, **options: object) -> SimpleNamespace:
            asked.append(options)
            return SimpleNamespace(results=[SimpleNamespace(code=code) for code in codes])

        return recommend

    monkeypatch.setattr("projdist.decisions.recommend", recommended(["EPSG:4839"]))
    assert _best_existing(get_region(SQUARE), "kavrayskiy") == "EPSG:4839"
    assert asked == [{"criterion": "kavrayskiy", "limit": 1}]
    monkeypatch.setattr("projdist.decisions.recommend", recommended([]))
    with pytest.raises(ValueError, match=f"^Invalid option '--against recommend'. No CRS serves the region '{SQUARE}'"):
        _best_existing(get_region(SQUARE), "max_omega")


@pytest.mark.slow
def test_table() -> None:
    """The report names the parameters, the rule of thumb, UTM, and what rounding costs."""
    out = run_ok("tmerc", SQUARE, "--criterion", "max_scale_error_ppm", "--ellipsoid", "GRS80")
    shown = ("lon_0", "k_0", "true on the middle meridian", "UTM 32N", "rounded to", "ppm", "+ellps=GRS80", "WKT2:")
    assert [words for words in shown if words not in out] == []


@pytest.mark.slow
def test_templates() -> None:
    """A PROJ string with ranges is one word of the command line."""
    out = run_ok("+proj=tmerc +lon_0={12..15} +ellps=GRS80", SQUARE)
    assert "lon_0 is at the end of its range." in out


@pytest.mark.slow
def test_a_criterion_that_vanishes() -> None:
    """It is said, and what is compared is the error that has decided."""
    out = run_ok("lcc", SQUARE, "--criterion", "max_omega")
    assert "max_omega vanishes for all of lcc: the least Airy-Kavrayskiy error has decided." in out
    assert "airy_kavrayskiy" in out


@pytest.mark.slow
def test_no_bound() -> None:
    message = "Invalid criterion 'max_scale_error_ppm' for merc over globe. It is not finite there."
    assert refusal("merc", "globe", "--criterion", "max_scale_error_ppm", code=1) == message
