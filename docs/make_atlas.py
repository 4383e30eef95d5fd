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

from pyproj import CRS

import projdist
from projdist.answers import Area, Batch
from projdist.designs import AtlasArea, atlas_areas, measured_entry
from projdist.projections import facts_of, proj_version
from projdist.regions import get_region

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
        answer = result.answer if is_national(area) else result.answer | {"country": ""}
        official = answer["official"] if is_official(area, answer["official"]) else None
        place = {"title": area.title, "kind": area.kind, "region": area.text, "area_km2": result.area_km2}
        yield place | answer | {"official": official}


def is_national(area: AtlasArea) -> bool:
    """Whether a place is a country's."""
    return area.kind in ("country", "part", "state")


def is_official(area: AtlasArea, crs: dict[str, Any] | None) -> bool:
    """Whether a country's own CRS is its official one there, and not one for the whole country in a state or far part.

    A state's is named by the name of its area of use, that of a part does not hold the middle of the country.
    """
    if crs is None or not is_national(area):
        return False
    if area.kind == "state":
        return area.title.partition(",")[0] in facts_of([crs["code"]])[crs["code"]].extents[0]
    return area.kind == "country" or not holds_main_part(area, CRS(crs["code"]))


def holds_main_part(area: AtlasArea, crs: CRS) -> bool:
    """Whether the area of use of a CRS has the middle of the main part of the country that a part is of."""
    west, south, east, north = get_region(f"{area.text.partition(' & ')[0]}@main").bounds
    lon, lat, use = 0.5 * (west + east), 0.5 * (south + north), crs.area_of_use
    return (lon - use.west) % 360.0 <= (use.east - use.west) % 360.0 and use.south <= lat <= use.north


def report(done: int, total: int) -> None:
    sys.stderr.write(f"\r{done} of {total}")
    sys.stderr.flush()


if __name__ == "__main__":
    main()
