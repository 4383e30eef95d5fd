"""Where a map is known to be torn or bent: meridians and parallels that PROJ's methods have by their definitions.

`data/breaks.csv` has them with their sources. Beside a map's own there is the meridian opposite the central one.
"""

from __future__ import annotations

import csv
import functools
import re
from importlib import resources

from projdist.earth import SMOOTH, Breaks
from projdist.projections.operations import CrsOperation, Pipeline
from projdist.projections.projection import Projection

__all__ = ["breaks_of", "known_breaks", "numbers_of"]

_SHIFTED = ("+pm=", "+over", "+proj=pipeline", "+proj=ob_tran", "+axis=")


def breaks_of(projection: Projection) -> Breaks:
    """What is known of a map; nothing of functions, pipelines and oblique maps."""
    function = projection.function
    if isinstance(function, Pipeline):
        found = _of_text(function.pipeline)
    elif isinstance(function, CrsOperation) and function.angle_unit == 1.0:
        found = _of_crs(function.crs, function.greenwich)
    else:
        return SMOOTH
    return found


@functools.lru_cache(maxsize=256)
def _of_text(pipeline: str) -> Breaks:
    """Of a PROJ string."""
    if any(part in pipeline for part in _SHIFTED):
        return SMOOTH
    values = numbers_of(pipeline)
    centre = values.get("lon_0", 0.0)
    return known_breaks(str(values.get("proj")), centre) if isinstance(centre, float) else SMOOTH


def numbers_of(pipeline: str) -> dict[str, float | str]:
    """The parameters of a PROJ string: numbers, and what else is text."""
    found: dict[str, float | str] = {}
    for token in pipeline.split():
        name, _, text = token.removeprefix("+").partition("=")
        try:
            found[name] = float(text)
        except ValueError:
            found[name] = text
    return found


def known_breaks(operation: str, centre: float) -> Breaks:
    """The breaks of one of PROJ's operations about a central meridian, and the meridian opposite."""
    return _turned(_known().get(("operation", operation), SMOOTH), centre)


@functools.lru_cache(maxsize=256)
def _of_crs(wkt: str, greenwich: float) -> Breaks:
    """Of a projected CRS: of some methods only, as others have more than one meridian."""
    method = re.search(r'METHOD\["([^"]*)"', wkt)
    known = _known().get(("method", method[1])) if method and wkt.startswith("PROJCRS[") else None
    centre = re.search(r'PARAMETER\["Longitude of natural origin",([-+.\deE]+),ANGLEUNIT\["Degree"', wkt, re.IGNORECASE)
    if known is None or centre is None:
        return SMOOTH
    return _turned(known, float(centre[1]) + greenwich)


def _turned(breaks: Breaks, centre: float) -> Breaks:
    """Breaks about a central meridian, and the meridian opposite."""
    opposite = (180.0,)
    northern, southern = (
        tuple(sorted((lon + centre + 180.0) % 360.0 - 180.0 for lon in (*lons, *opposite))) for lons in breaks[1:]
    )
    return Breaks(breaks.parallels, northern, southern)


@functools.cache
def _known() -> dict[tuple[str, str], Breaks]:
    """Breaks of methods with the central meridian 0, by kind and name."""
    text = resources.files("projdist").joinpath("data", "breaks.csv").read_text(encoding="utf-8")
    found = {}
    for row in csv.DictReader(text.splitlines()):
        parallels = _numbers(row["parallels"])
        both = tuple(sorted({*parallels, *(-lat for lat in parallels)}))
        found[row["kind"], row["name"]] = Breaks(both, _numbers(row["northern"]), _numbers(row["southern"]))
    return found


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(float(word) for word in text.split())
