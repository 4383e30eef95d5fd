"""What the names of methods promise: conformal or equal-area maps; `data/natures.csv` has them with their sources."""

from __future__ import annotations

import csv
import functools
import re
from importlib import resources
from typing import NamedTuple

from projdist.projections.operations import CrsOperation, Pipeline
from projdist.projections.projection import Projection


class Nature(NamedTuple):
    """The name of a CRS's method or a PROJ operation, and what it keeps: "conformal" or "equal-area"."""

    name: str
    keeps: str


def nature_of(projection: Projection) -> Nature | None:
    """What a map's method promises on its figure; None for methods that promise nothing, pipelines and functions."""
    function = projection.function
    if isinstance(function, CrsOperation):
        key = "method", _method_of(function.crs)
    elif isinstance(function, Pipeline):
        key = "operation", _operation_of(function.pipeline)
    else:
        return None
    keeps, figure = _promises().get(key, ("", ""))
    if not keeps or (figure == "sphere" and not projection.ellipsoid.is_sphere):
        return None
    return Nature(key[1], keeps)


def _method_of(wkt: str) -> str:
    """The method in the WKT2 of a projected CRS, in a hundredth of the time that PROJ takes; "" of a derived one."""
    method = re.search(r'METHOD\["([^"]*)"', wkt) if wkt.startswith("PROJCRS[") else None
    return method[1] if method else ""


def _operation_of(pipeline: str) -> str:
    """The first operation, which is `pipeline` for several."""
    return next((token[6:] for token in pipeline.split() if token.startswith("+proj=")), "")


@functools.cache
def _promises() -> dict[tuple[str, str], tuple[str, str]]:
    """What is kept, and on which figure, "any" or "sphere", by kind and name."""
    text = resources.files("projdist").joinpath("data", "natures.csv").read_text(encoding="utf-8")
    return {(row["kind"], row["name"]): (row["nature"], row["figure"]) for row in csv.DictReader(text.splitlines())}
