"""The command `optimize`: formats, options, and what is refused."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import pytest
from commands import command
from pyproj import CRS
from refusals import refuses

from projdist import optimize, recommend, summarize
from projdist.cli.optimize import _best_existing
from projdist.decisions.optimization import Optimum
from projdist.regions import get_region

pytestmark = pytest.mark.slow

run, run_ok, run_json, refusal = command("optimize")

SQUARE = "box:5,47,15,55"
KEYS = {
    "family",
    "region",
    "criterion",
    "parameters",
    "scale",
    "value",
    "proj",
    "wkt",
    "roundings",
    "baselines",
    "others",
}


def test_json() -> None:
    answer = run_json("lcc", SQUARE, "--round", "0.5", "--free", "lat_1, lat_2")
    assert answer.keys() >= KEYS
    assert answer == optimize("lcc", SQUARE, round_to=0.5, free=["lat_1", "lat_2"]).to_dict()


def test_against() -> None:
    """A projection, or the best existing CRS: the last of the baselines, with the figure that recommend has."""
    out = run_ok("laea", SQUARE, "--against", "EPSG:4839", "--against", "robinson", "--format", "json")
    *_, one, other = json.loads(out)["baselines"]
    assert (one["definition"], other["name"]) == ("EPSG:4839", "Robinson")
    assert one["value"] == pytest.approx(summarize("EPSG:4839", SQUARE).airy_kavrayskiy, rel=1e-5)
    out = run_ok("laea", SQUARE, "--against", "recommend", "--criterion", "max_omega", "--format", "json")
    (best,) = recommend(SQUARE, criterion="max_omega", limit=1).results
    last = json.loads(out)["baselines"][-1]
    assert (last["definition"], last["value"]) == (best.code, pytest.approx(best.value, abs=1e-6))


@pytest.fixture(scope="module")
def best() -> Optimum:
    return optimize("lcc", SQUARE)


def test_forms_of_an_answer(best: Optimum, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """JSON, PROJ, WKT, also in a file; where there is no WKT the reason, with 1; how many times the limit it has."""
    monkeypatch.setattr("projdist.decisions.optimize", lambda *_, **__: best)
    assert run_json("lcc", SQUARE) == best.to_dict()
    assert f"\n{best.value / best.limit:.3g} times the limit " in run("lcc", SQUARE)[1]
    assert run("lcc", SQUARE, "-f", "proj")[1] == f"{best.proj}\n"
    assert run("lcc", SQUARE, "-f", "wkt")[1] == f"{best.wkt}\n"
    path = tmp_path / "best.wkt"
    assert run("lcc", SQUARE, "-f", "wkt", "-o", str(path)) == (0, f"Wrote: {path}\n", "")
    assert CRS.from_wkt(path.read_text()).is_projected
    nothing = replace(best, wkt=None, wkt_reason="It has none.")
    monkeypatch.setattr("projdist.decisions.optimize", lambda *_, **__: nothing)
    name = best.projection.name
    assert run("lcc", SQUARE, "-f", "wkt") == (1, "", f"projdist: Invalid format 'wkt' for {name}. It has none.\n")


def test_the_best_existing(monkeypatch: pytest.MonkeyPatch) -> None:
    """That of recommend, by the same criterion; where there is none that is said."""
    recommend = mock.Mock(return_value=SimpleNamespace(results=[SimpleNamespace(code="EPSG:4839")]))
    monkeypatch.setattr("projdist.decisions.recommend", recommend)
    assert _best_existing(get_region(SQUARE), "kavrayskiy") == "EPSG:4839"
    assert recommend.call_args.kwargs == {"criterion": "kavrayskiy", "limit": 1}
    recommend.return_value.results = []
    message = f"^Invalid option '--against recommend'. No CRS serves the region '{SQUARE}'"
    refuses(message, _best_existing, get_region(SQUARE), "max_omega")


def test_table() -> None:
    """The report names the parameters, the rule of thumb, UTM, and what rounding costs."""
    out = run_ok("tmerc", SQUARE, "--criterion", "max_scale_error_ppm", "--ellipsoid", "GRS80")
    shown = ("lon_0", "k_0", "true on the middle meridian", "UTM 32N", "rounded to", "ppm", "+ellps=GRS80", "WKT2:")
    assert [words for words in shown if words not in out] == []


def test_what_is_said() -> None:
    """Of a PROJ string with ranges, which is one word; of a criterion that vanishes, where another error decides."""
    assert "lon_0 is at the end of its range." in run_ok("+proj=tmerc +lon_0={12..15} +ellps=GRS80", SQUARE)
    out = run_ok("lcc", SQUARE, "--criterion", "max_omega")
    assert "max_omega vanishes for all of lcc: the least Airy-Kavrayskiy error has decided." in out
    assert ("airy_kavrayskiy" in out, "the limit" in out) == (True, False)


def test_what_cannot_be_compared() -> None:
    """Criteria without a bound, and other maps that do not show the region."""
    message = "Invalid criterion 'max_scale_error_ppm' for merc over globe. It is not finite there."
    assert refusal("merc", "globe", "--criterion", "max_scale_error_ppm", code=1) == message
    said = refusal("lcc", SQUARE, "--against", "+proj=ortho +lat_0=0 +lon_0=100 +R=6371000", code=1)
    assert said.endswith(f"to compare with. It shows 50 % of {SQUARE}.")
