"""Layers of old maps for GIS programs: displacements of control points, and isolines."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from projdist._typing import FloatArray
from projdist.applications.oldmaps import LOCAL_MEASURES, OldMap, isolines
from projdist.gis.libraries import needed_for
from projdist.projections import Plane, Projection, ProjectionLike, plane_of
from projdist.support import check_choice, check_instance

if TYPE_CHECKING:
    import geopandas

__all__ = ["old_map_layers"]

_BY = ("mdt", "affine", "helmert")


def old_map_layers(
    found: OldMap, *, by: str = "mdt", crs: ProjectionLike | None = None
) -> dict[str, geopandas.GeoDataFrame]:
    """Displacements of an old map's control points, and isolines of its distortion, as layers of lines.

    Parameters
    ----------
    found : OldMap
        The old map.
    by : str
        The rectification, "mdt", "affine" or "helmert", that the displacements and the measures are after.
    crs : ProjectionLike, optional
        The CRS of the control points' truth, by default the one that they know; without one the layers are in metres
        of a plane without a name.

    Returns
    -------
    dict
        "displacements": lines from where the rectification brings the control points to their true places, with `id`,
        `dx`, `dy` and `length` in metres and whether the point is an `outlier`; and "fisher", "areal_scale", "scale",
        "rotation" (degrees clockwise): isolines with their `level`. Measures without isolines have no layer.

    Raises
    ------
    ValueError
        For an unknown rectification, and a map that is no CRS.
    ImportError
        Without geopandas.

    Examples
    --------
    >>> import geopandas
    >>> from projdist import ControlPoints, old_map
    >>> points = ControlPoints([[0, 0], [1, 0], [0, 1], [1, 1]], [[0, 0], [100, 0], [0, 100], [100, 140]])
    >>> old_map_layers(old_map(points, model="affine"))["displacements"]["length"].round(6).tolist()
    [10.0, 10.0, 10.0, 10.0]
    """
    check_instance("old map", found, OldMap, "an OldMap")
    check_choice("rectification", by, _BY)
    plane = _plane(found.points.crs if crs is None else crs)
    with needed_for("layer"):
        import geopandas
        import shapely
    wkt = None if plane is None else plane.wkt
    start, stop = found.rectifications[by].affine(found.points.old), found.points.new
    dx, dy = (stop - start).T
    columns = {"id": found.points.names, "dx": dx, "dy": dy, "length": np.hypot(dx, dy), "outlier": found.is_outlier}
    lines = shapely.linestrings(_native(np.stack([start, stop], axis=1), plane))
    layers = {"displacements": geopandas.GeoDataFrame(columns, geometry=lines, crs=wkt)}
    for measure in LOCAL_MEASURES:
        levels = isolines(found, measure, by=by)
        merged = [
            shapely.line_merge(shapely.multilinestrings(shapely.linestrings(_native(pieces, plane))))
            for pieces in levels.values()
        ]
        if levels:
            layers[measure] = geopandas.GeoDataFrame({"level": list(levels)}, geometry=merged, crs=wkt).explode(
                ignore_index=True
            )
    return layers


def _plane(crs: ProjectionLike | None) -> Plane | None:
    if crs is None:
        return None
    projection = Projection.from_user_input(crs)
    plane = plane_of(projection)
    if plane is None:
        raise ValueError(f"Invalid CRS '{projection.label}'. PROJ has no CRS of it.")
    return plane


def _native(places: FloatArray, plane: Plane | None) -> FloatArray:
    """Coordinates of the CRS of places in metres."""
    return places if plane is None else np.asarray(places @ np.linalg.inv(plane.to_metres).T)
