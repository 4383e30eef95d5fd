"""Measure the atlas: one batch job, and `projdist/data/atlas.jsonl.gz` of its results.

`python tools/measure_atlas.py [EXECUTOR]`, as `processes:8` or `dask://HOST:8786`; half a minute a region and core, two
for wide ones. Results are kept in tools/made/results.jsonl as they come; the job goes on from there, also after Ctrl-C.
With `--only TITLE ...` these entries and those that the file lacks are measured, and the others stay as they are;
without a title only what it lacks.
"""

from __future__ import annotations

import argparse
import gzip
import json
import sys
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

from atlas_measurement import AtlasArea, atlas_areas, measured_entry

import projdist
from projdist.answers import Area
from projdist.projections import proj_version
from projdist.regions import definition

PARTIAL = Path(__file__).parent / "made" / "results.jsonl"
AGAIN = PARTIAL.with_name("again.jsonl")
RESULT = Path(projdist.__file__).parent / "data" / "atlas.jsonl.gz"
VERSIONS = {"projdist": projdist.__version__, "PROJ": proj_version()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("executor", nargs="?", default="processes")
    parser.add_argument("--only", nargs="*", metavar="TITLE", help="entries to measure anew, and what the file lacks")
    given = parser.parse_args()
    unknown = set(given.only or ()) - {area.title for area in atlas_areas()}
    if unknown:
        parser.error(f"Invalid title '{min(unknown)}'. It must be one of the atlas' places.")
    kept = {} if given.only is None else kept_lines(given.only)
    wanted = [area for area in atlas_areas() if area.text not in kept]
    PARTIAL.parent.mkdir(exist_ok=True)
    found = projdist.batch(
        measured_entry,
        [Area(area.title, area.text) for area in wanted],
        executor=given.executor,
        partial=PARTIAL if given.only is None else AGAIN,
        progress=report,
    )
    for failure in found.failures:
        print(failure.line)
    if not found.failures:
        measured = {area.text: line_of(area, result) for area, result in zip(wanted, found.results, strict=True)}
        write([(kept | measured)[area.text] for area in atlas_areas()])
        AGAIN.unlink(missing_ok=True)


def kept_lines(anew: Collection[str]) -> dict[str, dict[str, Any]]:
    """The entries of the file but those of some titles, by their regions; ends where other versions measured them."""
    versions, *lines = map(json.loads, gzip.decompress(RESULT.read_bytes()).splitlines())
    if versions != VERSIONS:
        sys.exit(f"{RESULT} was measured with {versions}, this is {VERSIONS}: measure all of it anew.")
    return {line["region"]: line for line in lines if line["title"] not in anew}


def write(entries: Sequence[dict[str, Any]]) -> None:
    """The versions, then the entries."""
    lines = (json.dumps(line, ensure_ascii=False, separators=(",", ":")) for line in (VERSIONS, *entries))
    RESULT.write_bytes(gzip.compress("\n".join(lines).encode(), mtime=0))
    print(f"\n{RESULT}: {len(entries)} entries, {RESULT.stat().st_size:,} bytes")


def line_of(area: AtlasArea, result: Any) -> dict[str, Any]:
    """An entry."""
    answer = result.answer if is_national(area) else result.answer | {"country": "", "official": None}
    place = {"title": area.title, "kind": area.kind, "region": area.text, "area_km2": result.area_km2}
    return place | answer


def is_national(area: AtlasArea) -> bool:
    """Whether a place is a country's, as are the contiguous United States."""
    if area.kind == "area":
        return definition(area.text)["definition"].count("country:") == 1
    return area.kind in ("country", "part", "state")


def report(done: int, total: int) -> None:
    sys.stderr.write(f"\r{done} of {total}")
    sys.stderr.flush()


if __name__ == "__main__":
    main()
