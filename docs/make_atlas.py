"""Measure the atlas: one batch job, which goes on from docs/atlas/results.jsonl.gz.

`python docs/make_atlas.py [EXECUTOR]`, as `processes:8` or `dask://HOST:8786`; a quarter of a minute a region and core.
Results are kept in docs/atlas/results.jsonl as they come, and compressed when the job ends, also by Ctrl-C.
"""

from __future__ import annotations

import argparse
import gzip
import sys
from pathlib import Path

import projdist
from projdist.answers import Area
from projdist.designs import atlas_areas, measured_entry

FOLDER = Path(__file__).parent / "atlas"
RESULTS = FOLDER / "results.jsonl.gz"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("executor", nargs="?", default="processes")
    executor = parser.parse_args().executor
    FOLDER.mkdir(exist_ok=True)
    partial = RESULTS.with_suffix("")
    if RESULTS.exists() and not partial.exists():
        partial.write_bytes(gzip.decompress(RESULTS.read_bytes()))
    areas = [Area(area.title, area.text) for area in atlas_areas()]
    try:
        found = projdist.batch(measured_entry, areas, executor=executor, partial=partial, progress=report)
    finally:
        RESULTS.write_bytes(gzip.compress(partial.read_bytes(), mtime=0))
    partial.unlink()
    print(f"\n{len(found.results)} entries")
    for failure in found.failures:
        print(failure.line)


def report(done: int, total: int) -> None:
    sys.stderr.write(f"\r{done} of {total}")
    sys.stderr.flush()


if __name__ == "__main__":
    main()
