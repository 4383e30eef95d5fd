"""The states of the USA, as the Census Bureau outlines them, from the data that is shipped with the package.

They end at the shores of the sea and of the Great Lakes, and have all other lakes, rivers and small bays.
"""

from __future__ import annotations

import csv
import functools
import importlib.resources

import shapely

from projdist.earth.topojson import decoded, topology

__all__ = ["state_keys", "state_outline"]


@functools.cache
def state_keys() -> tuple[dict[str, str], ...]:
    """The rows of states.csv: `name`, `postal`, `fips`, `other_names` with | between."""
    file = importlib.resources.files("projdist") / "data" / "states.csv"
    return tuple(csv.DictReader(file.read_text(encoding="utf-8").splitlines()))


def state_outline(fips: str) -> shapely.MultiPolygon:
    """The polygons of a state, the District of Columbia or a territory by its FIPS code, at 1 : 10 million."""
    objects, arcs = topology("states-10m.npz")
    (geometry,) = (one for one in objects["states"] if one["id"] == fips)
    return decoded(geometry, arcs)
