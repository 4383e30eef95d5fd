"""Measure the atlas: one batch job, and `projdist/data/atlas.jsonl.gz` of its results.

`python docs/make_atlas.py [EXECUTOR]`, as `processes:8` or `dask://HOST:8786`; half a minute a region and core.
Results are kept in docs/atlas/results.jsonl as they come; the job goes on from there, also after Ctrl-C.
"""

from __future__ import annotations

import argparse
import gzip
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import projdist
from projdist.answers import Area, Batch
from projdist.designs import AtlasArea, atlas_areas, measured_entry
from projdist.projections import proj_version

PARTIAL = Path(__file__).parent / "atlas" / "results.jsonl"
RESULT = Path(projdist.__file__).parent / "data" / "atlas.jsonl.gz"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("executor", nargs="?", default="processes")
    executor = parser.parse_args().executor
    PARTIAL.parent.mkdir(exist_ok=True)
    areas = [Area(area.title, area.text) for area in atlas_areas()]
    found = projdist.batch(measured_entry, areas, executor=executor, partial=PARTIAL, progress=report)
    for failure in found.failures:
        print(failure.line)
    if not found.failures:
        lines = (json.dumps(line, ensure_ascii=False, separators=(",", ":")) for line in lines_of(found))
        RESULT.write_bytes(gzip.compress("\n".join(lines).encode(), mtime=0))
        print(f"\n{RESULT}: {len(found.results)} entries, {RESULT.stat().st_size:,} bytes")


def lines_of(found: Batch) -> Iterator[dict[str, Any]]:
    """The versions, then the entries."""
    yield {"projdist": projdist.__version__, "PROJ": proj_version()}
    for area, result in zip(atlas_areas(), found.results, strict=True):
        answer = result.answer if is_national(area) else result.answer | {"country": "", "official": None}
        place = {"title": area.title, "kind": area.kind, "region": area.text, "area_km2": result.area_km2}
        yield place | answer


def is_national(area: AtlasArea) -> bool:
    """Whether a place is a country's."""
    return area.kind in ("country", "part", "state")


def report(done: int, total: int) -> None:
    sys.stderr.write(f"\r{done} of {total}")
    sys.stderr.flush()


if __name__ == "__main__":
    main()
