"""What has become slower since the history's last entries: `python benchmarks/check.py [table ...] [--record]`.

Every row is a ratio of processor times, of projdist and of a reference that runs beside it, in turn: less is better.
Set OPENBLAS_NUM_THREADS=1, as `make benchmarks-check` does. What seems slower is measured a second time, with twice as
many runs; the exit code is 1 where something is slower by a tenth. With --record the ratios go into history.csv, with
the commit, and nothing is judged.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from history import Entry, append_history, entry_of, newest, read_history, slower
from pyproj import Proj

import projdist

ROOT = Path(__file__).resolve().parents[1]
RUNS = 7
R = 6371008.7714

Seconds = Callable[[], float]
"""Runs something once, and tells the processor time of that."""

# ---- whole processes ------------------------------------------------------------------------

REFERENCE = ["-c", "import numpy, pyproj"]
COMMANDS = {
    "--version": "",
    "--help": "",
    "compare robinson mollweide winkel-tripel": "",
    "factors robinson 10 50": "",
    "tissot robinson": ".png",
    "heatmap robinson": ".png",
    "heatmap EPSG:3035 -r country:DE": ".png",
    "recommend country:DE": "",
}


def process_seconds(words: list[str]) -> float:
    """Processor time of Python with some words, its own processes included."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    subprocess.run([sys.executable, "-P", *words], env=environment, capture_output=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def commands() -> Iterator[tuple[str, Seconds, Seconds]]:
    """Whole commands, over the time in which Python loads numpy and pyproj."""
    with tempfile.TemporaryDirectory() as folder:
        for command, suffix in COMMANDS.items():
            output = ["-o", str(Path(folder) / f"picture{suffix}"), "--overwrite"] if suffix else []
            words = ["-m", "projdist", *command.split(), *output]
            yield command, partial(process_seconds, words), partial(process_seconds, REFERENCE)


def imports() -> Iterator[tuple[str, Seconds, Seconds]]:
    """What loading projdist takes, over the same."""
    for code in (
        "import projdist",
        "from projdist import compare, factors",
        "from projdist.plots import heatmap_figure",
    ):
        yield code, partial(process_seconds, ["-c", code]), partial(process_seconds, REFERENCE)


# ---- within a process -----------------------------------------------------------------------


def seconds_of(function: Callable[[], object]) -> Seconds:
    """Processor time of a call."""

    def run() -> float:
        start = time.process_time()
        function()
        return time.process_time() - start

    return run


def often(times: int, function: Callable[[], object]) -> Callable[[], None]:
    """Several calls of what takes less than clocks tell."""

    def run() -> None:
        for _ in range(times):
            function()

    return run


def globe() -> Iterator[tuple[str, Seconds, Seconds]]:
    """Ten summaries of the globe to 1e-7, over the factors of PROJ on a grid of a degree."""
    lon, lat = np.meshgrid(np.arange(-179.5, 180.0), np.arange(-89.5, 90.0))
    for name in ("moll", "robin", "kav7", "hammer", "merc", "eqearth"):
        text = f"+proj={name} +R={R}"
        ours = often(10, partial(projdist.summarize, text, tolerance=1e-7))
        theirs = often(5, partial(Proj(text).get_factors, lon, lat, errcheck=False))
        yield name, seconds_of(ours), seconds_of(theirs)


def points() -> Iterator[tuple[str, Seconds, Seconds]]:
    """Factors at 100,000 scattered points, over PROJ's."""
    generator = np.random.default_rng(1)
    lon, lat = generator.uniform(-179, 179, 100_000), np.degrees(np.arcsin(generator.uniform(-0.999, 0.999, 100_000)))
    for name in ("merc", "moll", "robin", "laea"):
        text = f"+proj={name} +R={R}"
        theirs = partial(Proj(text).get_factors, lon, lat, errcheck=False)
        yield name, seconds_of(partial(projdist.factors, text, lon, lat)), seconds_of(theirs)


def regions() -> Iterator[tuple[str, Seconds, Seconds]]:
    """Five summaries of a country, whose weights are kept, over PROJ's factors at as many points as it is asked for."""
    lon, lat = np.meshgrid(np.linspace(6.0, 15.0, 400), np.linspace(47.5, 55.0, 400))
    for text, region in (("EPSG:3035", "country:DE"), ("+proj=lcc +lat_1=49 +lat_2=77 +lon_0=-95", "country:CA")):
        theirs = partial(Proj(text).get_factors, lon, lat, errcheck=False)
        ours = often(5, partial(projdist.summarize, text, region))
        yield f"{text} {region}", seconds_of(ours), seconds_of(theirs)


def designs() -> Iterator[tuple[str, Seconds, Seconds]]:
    """Fits of maps made to measure, the nodes and the base given, over PROJ's factors on a grid of a degree."""
    from designs import fit_of

    lon, lat = np.meshgrid(np.arange(-179.5, 180.0), np.arange(-89.5, 90.0))
    theirs = often(5, partial(Proj(f"+proj=moll +R={R}").get_factors, lon, lat, errcheck=False))
    for kind, region, degree in (
        ("equal-area", "continent:Africa", 4),
        ("equal-area", "continent:Europe & box:-26,34,60,72", 6),
        ("conformal", "country:DE", 6),
        ("any", "continent:Africa", 6),
    ):
        fit = fit_of(kind, "airy_kavrayskiy", region, degree)
        yield f"{kind} {region} degree {degree}", seconds_of(fit), seconds_of(theirs)


def recommendations() -> Iterator[tuple[str, Seconds, Seconds]]:
    """`recommend` over the bare cost of its candidates' transformers, as benchmarks/recommend.py has them."""
    from recommend import FLOOR, OURS, run

    for region in ("country:CH", "box:-76,-56,-66,-17.5"):
        yield region, partial(told_seconds, run, OURS, region), partial(told_seconds, run, FLOOR, region)


def told_seconds(run: Callable[[str, str], list], script: str, region: str) -> float:
    """Processor time that a script of benchmarks/recommend.py tells of itself."""
    return run(script, region)[1]


TABLES = {
    "commands": commands,
    "imports": imports,
    "globe": globe,
    "points": points,
    "regions": regions,
    "designs": designs,
    "recommend": recommendations,
}
FEW = {"recommend": 3}  # runs of what takes seconds

# ---- measuring and judging ------------------------------------------------------------------


def ratios_of(ours: Seconds, reference: Seconds, runs: int) -> list[float]:
    """Ratios of runs in turn, after one of each that fills caches."""
    pairs = [(ours(), reference()) for _ in range(runs + 1)][1:]
    return [own / other for own, other in pairs]


def measured(tables: list[str], only: set[tuple[str, str]] | None = None, times: int = 1) -> Iterator[Entry]:
    """The rows of tables, or only some, at this commit; told as they come."""
    commit, date = git("rev-parse", "--short", "HEAD"), git("show", "-s", "--format=%cs")
    for table in tables:
        for row, ours, reference in TABLES[table]():
            if only is None or (table, row) in only:
                found = entry_of(commit, date, table, row, ratios_of(ours, reference, times * FEW.get(table, RUNS)))
                print(f"| {table} | {row} | {found.ratio:.3g} | {100 * found.spread:.1f} % |", flush=True)
                yield found


def git(*words: str) -> str:
    """What git says of this checkout."""
    return subprocess.run(["git", "-C", ROOT, *words], capture_output=True, text=True, check=True).stdout.strip()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "tables", nargs="*", metavar="table", help=f"Some of {', '.join(TABLES)}; all if none is named."
    )
    parser.add_argument("--record", action="store_true", help="Append the ratios to the history, with the commit.")
    given = parser.parse_args()
    unknown = [table for table in given.tables if table not in TABLES]
    if unknown:
        parser.error(f"Invalid table '{unknown[0]}'. It must be one of {', '.join(TABLES)}.")
    tables = given.tables or list(TABLES)
    if given.record and git("status", "--porcelain", "--untracked-files=no", "--", "projdist"):
        parser.error("The package differs from the commit that the history would name. Commit it first.")
    subprocess.run([sys.executable, "-m", "compileall", "-q", ROOT / "projdist"], check=True)  # no run compiles modules
    print("| table | row | over its reference | good to |\n| --- | --- | --- | --- |")
    found = list(measured(tables))
    if given.record:
        append_history(found)
        return
    known = newest(read_history())
    for entry in found:
        if entry.key not in known:
            print(f"New, and not judged: {entry.table}, {entry.row}.")
    suspects = {now.key for now, _ in slower(found, known)}
    if suspects:
        print("Again, what seems slower:")
    again = list(measured(tables, suspects, times=2)) if suspects else []
    worse = slower(again, known)
    for now, then in worse:
        more = f"{100 * (now.ratio / then.ratio - 1):.0f} % slower than at {then.commit} ({then.date})"
        print(f"{now.table}, {now.row}: {now.ratio:.3g} for {then.ratio:.3g} times its reference, {more}.")
    sys.exit(1 if worse else 0)


if __name__ == "__main__":
    main()
