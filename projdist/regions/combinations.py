"""Unions, intersections and differences of regions as polygons, and edges of regions."""

from __future__ import annotations

from typing import Any, overload

import numpy as np
import shapely

from projdist._typing import BoolArray, FloatArray
from projdist.earth import (
    GEOS_ARITHMETIC,
    Ellipsoid,
    chords,
    closed_round_pole,
    cut_at_antimeridian,
    merged,
    unwrapped,
)
from projdist.projections import Body, is_same_body
from projdist.regions.boxes import Box
from projdist.regions.caps import Cap
from projdist.regions.points import PointSet
from projdist.regions.polygons import Polygons
from projdist.regions.region import Region

RIM_TOLERANCE = 1e-6
"""Tolerance in degrees of the polygon of a cap: 0.1 m."""


@overload
def combine(operator: str, left: Region, right: Region | PointSet, name: str) -> Polygons: ...
@overload
def combine(operator: str, left: PointSet, right: Region | PointSet, name: str) -> PointSet: ...
def combine(operator: str, left: Region | PointSet, right: Region | PointSet, name: str) -> Polygons | PointSet:
    """Two regions combined by `&`, `-` or `+`; of points, `&` and `-` select. Raises ValueError if nothing is left."""
    if isinstance(right, PointSet) or (isinstance(left, PointSet) and operator == "+"):
        raise ValueError(f"Invalid region '{name}'. Points can only stand on the left of & and -.")
    ellipsoid = _ellipsoid(left, right, name)
    if isinstance(left, PointSet):
        wanted = operator == "&"
        return left.chosen(lambda lon, lat: right.contains(lon, lat) == wanted, name)
    resolution = _resolution(left, right, name)
    one, other = polygons_of(left), polygons_of(right)
    found = _combined(operator, one, other)
    if found.area == 0.0:
        raise ValueError(f"Invalid region '{name}'. Nothing is left of it.")
    return Polygons(merged([found]), name, (*_repairs(left), *_repairs(right)), "", resolution, ellipsoid)


def _ellipsoid(left: Region | PointSet, right: Region, name: str) -> Ellipsoid | None:
    """The common ellipsoid of two regions, None if neither has one; raises ValueError for different bodies."""
    one, other = (
        region.figure if isinstance(region, Cap) else getattr(region, "ellipsoid", None) for region in (left, right)
    )
    if one and other and not is_same_body(Body(one), Body(other)):
        raise ValueError(f"Invalid region '{name}'. Its parts are on different bodies, {Body(one)} and {Body(other)}.")
    return one or other


def _resolution(left: Region, right: Region, name: str) -> str:
    """The resolution of the shipped outlines in two regions; raises ValueError for two, which would leave slivers."""
    found = {region.resolution for region in (left, right) if isinstance(region, Polygons)} - {""}
    if len(found) > 1:
        both = " and ".join(sorted(found))
        raise ValueError(
            f"Invalid region '{name}'. Its parts are of different detail, {both}, and would leave slivers along "
            "coasts: give all of them the same suffix."
        )
    return found.pop() if found else ""


@GEOS_ARITHMETIC
def _combined(operator: str, one: shapely.MultiPolygon, other: shapely.MultiPolygon) -> shapely.Geometry:
    return {"&": shapely.intersection, "-": shapely.difference, "+": shapely.union}[operator](one, other)


def _repairs(region: Region) -> tuple[str, ...]:
    return region.repairs if isinstance(region, Polygons) else region.notes


def polygons_of(region: Region | PointSet) -> shapely.MultiPolygon:
    """A region as polygons; the rim of a cap to `RIM_TOLERANCE`. Raises ValueError for what has no polygons."""
    if isinstance(region, Polygons):
        return region.geometry
    if isinstance(region, Box):
        west, south, east, north = region.bounds
        return merged(list(cut_at_antimeridian(shapely.box(west, south, east, north))))
    if isinstance(region, Cap):
        return _cap_polygons(region)
    raise ValueError(f"Invalid region '{region.name}'. It must be made of boxes, caps and polygons to be combined.")


def geojson_of(region: Region | PointSet) -> dict[str, Any]:
    """A region as a geometry of GeoJSON; the rim of a cap to `RIM_TOLERANCE`. Raises ValueError, as `polygons_of`."""
    return dict(shapely.geometry.mapping(polygons_of(region)))


def _cap_polygons(cap: Cap) -> shapely.MultiPolygon:
    if cap.angle == 180.0:
        return shapely.MultiPolygon([shapely.box(-180.0, -90.0, 180.0, 90.0)])

    def rim(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        points = cap.chart(np.zeros(t.shape, dtype=int), t, np.full(t.shape, cap.angle))
        return points.lon, points.lat

    ring = unwrapped(chords(rim, np.linspace(0.0, 360.0, 65), RIM_TOLERANCE))
    poles = [pole for pole in (90.0, -90.0) if bool(cap.contains(0.0, pole))]
    if len(poles) == 2:
        # The rim encloses the complement, unless both poles lie on it.
        around = merged(list(cut_at_antimeridian(shapely.make_valid(shapely.Polygon(ring)))))
        if shapely.intersects_xy(around, (cap.lon + 180.0) % 360.0 - 180.0, cap.lat):
            return around
        return merged([shapely.difference(shapely.box(-180.0, -90.0, 180.0, 90.0), around)])
    if poles:
        ring = np.concatenate([ring, [[ring[-1, 0], poles[0]], [ring[0, 0], poles[0]]]])
    else:
        ring = closed_round_pole(ring)
    return merged(list(cut_at_antimeridian(shapely.make_valid(shapely.Polygon(ring)))))


# ---- edges ---------------------------------------------------------------------------------------


class RegionEdges:
    """The edges of a region within longitudes -180 to 180, also those along the antimeridian where it is cut."""

    def __init__(self, region: Region) -> None:
        rings = shapely.get_rings(shapely.get_parts(polygons_of(region)))
        points, ring = shapely.get_coordinates(rings, return_index=True)
        edges = np.stack([points[:-1], points[1:]], axis=1)[ring[1:] == ring[:-1]]
        self._tree = shapely.STRtree(shapely.linestrings(edges))

    def crosses(self, boxes: FloatArray) -> BoolArray:
        """Mask of boxes (n, 4) of west, south, east, north that edges may cross; True if in doubt.

        Longitudes are arbitrary; a box across the antimeridian is in doubt.
        """
        west, south, east, north = boxes.T
        turns = 360.0 * np.floor((west + 180.0) / 360.0)
        doubt = ~np.isfinite(boxes).all(axis=1) | (east - turns > 180.0)
        result = doubt.copy()
        known = np.flatnonzero(~doubt)
        found = shapely.box((west - turns)[known], south[known], (east - turns)[known], north[known])
        result[known[np.unique(self._tree.query(found, predicate="intersects")[0])]] = True
        return result
