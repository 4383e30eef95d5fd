"""The edge of a map as one polygon, for programs that want it so."""

from __future__ import annotations

import numpy as np
import shapely

from projdist.earth import GEOS_ARITHMETIC
from projdist.surfaces.surface import Surface

# Of the map's size. The surface has chords for arcs, which leave out 1e-6 to 1e-5 of it; as much is put around it.
_SIMPLE, _AROUND = 5e-6, 2.5e-5
_POINT = 1e-6  # of the map's area: the images of poles within it are holes as small


@GEOS_ARITHMETIC
def boundary_polygon(surface: Surface) -> shapely.Polygon:
    """All of a map, a little more, and what it leaves out amidst it; ValueError for maps in several pieces.

    The edge of the map is what bounds one triangle only: triangles share their vertices, but across seams.
    """
    count = surface.x.size
    edges = np.sort(np.concatenate([surface.triangles[:, pair] for pair in ([0, 1], [1, 2], [2, 0])]), axis=1)
    numbers, uses = np.unique(edges[:, 0] * count + edges[:, 1], return_counts=True)
    ends = np.column_stack(np.divmod(numbers[uses == 1], count))
    segments = np.column_stack([surface.x, surface.y])[ends]
    segments = segments[(segments[:, 0] != segments[:, 1]).any(axis=1)]
    faces = shapely.get_parts(shapely.polygonize(shapely.linestrings(segments)))
    if not len(faces):
        raise ValueError(
            f"Invalid projection '{surface.domain.projection.name}'. Its map must have an edge that closes."
        )
    filled = shapely.polygons(shapely.get_exterior_ring(faces))
    largest = int(np.argmax(shapely.area(filled)))
    beside = ~shapely.covered_by(shapely.point_on_surface(filled), filled[largest])
    pieces = 1 + int(np.sum(beside & (shapely.area(filled) > _POINT * shapely.area(filled[largest]))))
    if pieces > 1:
        name = surface.domain.projection.name
        raise ValueError(f"Invalid projection '{name}'. It must be a map in one piece; this one has {pieces}.")
    west, east, south, north = surface.extent
    size = max(east - west, north - south)
    around = shapely.buffer(shapely.simplify(filled[largest], _SIMPLE * size), _AROUND * size, join_style="mitre")
    return shapely.Polygon(shapely.get_exterior_ring(around))
