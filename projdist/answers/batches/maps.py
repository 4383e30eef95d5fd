"""The maps of a batch as text."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from projdist.projections import Projection, ProjectionLike
from projdist.support import quoted, read_text

_FILES = (".prj", ".wkt", ".json")  # that a map may be in, and that workers may not have


def map_text(projection: ProjectionLike) -> str:
    """A projection as text: a name, a PROJ string, a code, WKT; raises ValueError for what has none."""
    if isinstance(projection, str | Path):
        path = Path(projection)
        is_file = len(str(projection)) < 4096 and path.suffix.lower() in _FILES and path.is_file()
        return read_text(path, f"Invalid projection file '{path}'.").strip() if is_file else str(projection)
    found = Projection.from_user_input(projection)
    if not _is_what_it_says(found):
        raise ValueError(
            f"Invalid projection {quoted(found.label)} of a batch. It must have a text: a name, a PROJ string, a code "
            "or WKT."
        )
    return found.definition


def _is_what_it_says(projection: Projection) -> bool:
    """Whether its definition is a text that it can be made of again, as that of a function is not."""
    try:
        again = Projection.from_user_input(projection.definition)
    except ValueError:
        return False
    lon, lat = (axis.ravel() for axis in np.meshgrid(np.linspace(-160.0, 160.0, 9), np.linspace(-70.0, 80.0, 9)))
    return all(
        np.array_equal(one, other, equal_nan=True)
        for one, other in zip(projection(lon, lat), again(lon, lat), strict=True)
    )
