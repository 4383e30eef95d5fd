"""The history of benchmarks: what counts as slower, and what the file keeps. No times."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def history() -> ModuleType:
    """The module, which is no part of the package; the wheel is tested without it."""
    path = ROOT / "benchmarks" / "history.py"
    if not path.exists():
        pytest.skip("There are no benchmarks beside the tests.")
    spec = importlib.util.spec_from_file_location("benchmark_history", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look there
    spec.loader.exec_module(module)
    return module


def test_an_entry_is_the_median_and_its_standard_error(history: ModuleType) -> None:
    """One run that something disturbed moves neither; even runs have no spread."""
    entry = history.entry_of("abc", "2026-01-01", "globe", "moll", [2.0, 2.1, 1.9, 2.05, 40.0])
    assert entry.ratio == 2.05
    assert entry.spread == pytest.approx(1.4826 * 0.05 / 2.05 / 5**0.5, abs=5e-5)  # deviations 0.05 0.05 0.15 0 37.95
    assert history.entry_of("abc", "2026-01-01", "globe", "moll", [3.0] * 7).spread == 0.0


def test_what_is_slower(history: ModuleType) -> None:
    """A tenth is seen, less is not, and noise explains no more than two standard errors of both."""
    then = history.newest([history.Entry("abc", "2026-01-01", "globe", "moll", 1.0, 0.002)])
    slower = {(1.2, 0.001): True, (1.11, 0.0): True, (3.0, 0.2): True}
    slower |= dict.fromkeys([(1.05, 0.0), (1.2, 0.1), (0.5, 0.0)], False)
    entries = {now: history.Entry("def", "2026-02-01", "globe", "moll", *now) for now in slower}
    assert {now: bool(history.slower([entry], then)) for now, entry in entries.items()} == slower


def test_rows_are_compared_with_their_last_entries(history: ModuleType, tmp_path: Path) -> None:
    """The file keeps all entries in order; the last of a row counts, and a new row is not judged."""
    path = tmp_path / "history.csv"
    assert history.read_history(path) == []
    old = history.Entry("abc", "2026-01-01", "globe", "moll", 1.0, 0.001)
    new = history.Entry("def", "2026-02-01", "globe", "moll", 2.0, 0.001)
    other = history.Entry("def", "2026-02-01", "points", "moll", 9.0, 0.001)
    for some in ([old], [new, other]):
        history.append_history(some, path)
    assert history.read_history(path) == [old, new, other]
    assert path.read_text().count("commit") == 1
    known = history.newest([old, new])
    assert (known, history.slower([new, other], known)) == ({("globe", "moll"): new}, [])
    assert history.slower([new], history.newest([old])) == [(new, old)]
    # Ours: each line is of a commit, and no commit has a row twice.
    entries = history.read_history()
    assert len({(one.commit, *one.key) for one in entries}) == len(entries) > 0
    assert all(one.ratio > 0 and one.spread >= 0 and one.commit for one in entries)
