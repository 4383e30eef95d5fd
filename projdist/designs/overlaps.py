"""Whether a map lays one part of a region over another."""

from __future__ import annotations

import numpy as np
import shapely

from projdist.projections import Projection
from projdist.regions import Place, polygons_of

__all__ = ["overlaps"]

_EDGE = 0.25  # degrees: edges are divided to it, so that their images bend
_AREA = 1e-6  # of the image: what is laid on twice; the edges' images are chords


def overlaps(projection: Projection, region: Place) -> bool | None:
    """Whether the image of a region covers itself; None for points. A map that mirrors nowhere is meant."""
    if not region.area_km2:
        return None
    outline = shapely.segmentize(polygons_of(region), _EDGE)
    image = shapely.transform(outline, lambda points: np.column_stack(projection(points[:, 0], points[:, 1])))
    rings, which = shapely.get_rings(shapely.get_parts(image), return_index=True)
    shell = np.append(True, which[1:] != which[:-1])
    once = float(shapely.union_all(shapely.make_valid(shapely.get_parts(image))).area)
    # Covered twice, an area counts twice along its edge.
    signed = float(np.sum(np.where(shell, 1.0, -1.0) * np.abs([_turned(ring) for ring in rings])))
    return bool(signed > once * (1.0 + _AREA))


def _turned(ring: shapely.LinearRing) -> float:
    """The area within a ring, with its sign."""
    x, y = shapely.get_coordinates(ring).T
    x, y = x - x[0], y - y[0]
    return 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
