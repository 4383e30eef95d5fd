"""Regions combined and taken apart: unions, intersections and differences, the main part, edges."""

import dataclasses
import math
from typing import Any, overload

import numpy as np
import shapely

from projdist import earth
from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.projections import Body, is_same_body
from projdist.regions.caps import Cap
from projdist.regions.polygons import Polygons
from projdist.regions.region import Box, PointSet, Region

OPERATIONS = {
    sign: earth.GEOS_ARITHMETIC(operation)
    for sign, operation in (("&", shapely.intersection), ("-", shapely.difference), ("+", shapely.union))
}

RIM_TOLERANCE = 1e-6
"""Tolerance in degrees of the polygon of a cap: 0.1 m."""

MAIN_KM = 400.0
"""Largest gap between the parts of a main part.

In Natural Earth it keeps together what is mapped together (Indonesia has gaps of 210 km, Japan down to Okinawa 268,
Yemen and Socotra 355, Russia and Kaliningrad 364), and separates the rest (Norway from Bear Island and Svalbard at 415,
Malaysia's two halves, each with a datum grid of its own, at 586, New Zealand from Chatham at 654, Alaska at 817).
"""

FAR_KM = 800.0
"""Smallest gap between parts that is reported.

A conformal map that is true at one end is off by d^2 / (2 R^2), 0.8 %, at the other; the Azores, the Galapagos, Jan
Mayen, the Andamans and the Canaries are beyond, Malaysia's halves and Fiji's Rotuma are not.
"""

# Smallest gap that can be asked for: outlines at 1 : 50 million are accurate to some kilometres, and shorter pieces of
# edges take seconds for a continent.
_NEAREST_KM = 10.0
_SPACING = 8.0  # points on edges per gap: a gap d is measured as at most d sqrt(1 + 1 / 8^2), 0.8 % too long
_PAIRS = 2e6  # of points: fewer take less time than loading scipy, 0.2 s


@overload
def combine(operator: str, left: Region, right: Region | PointSet, name: str) -> Polygons: ...
@overload
def combine(operator: str, left: PointSet, right: Region | PointSet, name: str) -> PointSet: ...
def combine(operator: str, left: Region | PointSet, right: Region | PointSet, name: str) -> Polygons | PointSet:
    """Two regions combined by `&`, `-` or `+`; of points, `&` and `-` select. Raises ValueError if nothing is left."""
    if isinstance(right, PointSet) or (isinstance(left, PointSet) and operator == "+"):
        raise ValueError(f"Invalid region '{name}'. Points can only stand on the left of & and -.")
    ellipsoids = [
        region.figure if isinstance(region, Cap) else getattr(region, "ellipsoid", None) for region in (left, right)
    ]
    ellipsoid, other = ellipsoids if ellipsoids[0] else ellipsoids[::-1]
    if ellipsoid and other and not is_same_body(Body(ellipsoid), Body(other)):
        raise ValueError(
            f"Invalid region '{name}'. Its parts are on different bodies, {Body(ellipsoid)} and {Body(other)}."
        )
    if isinstance(left, PointSet):
        return left.chosen(lambda lon, lat: right.contains(lon, lat) == (operator == "&"), name)
    resolutions = {region.resolution for region in (left, right) if isinstance(region, Polygons)} - {""}
    if len(resolutions) > 1:  # the shipped outlines
        both = " and ".join(sorted(resolutions))
        raise ValueError(
            f"Invalid region '{name}'. Its parts are of different detail, {both}, and would leave slivers along "
            "coasts: give all of them the same suffix."
        )
    found = OPERATIONS[operator](polygons_of(left), polygons_of(right))
    if found.area == 0.0:
        raise ValueError(f"Invalid region '{name}'. Nothing is left of it.")
    repairs = [one.repairs if isinstance(one, Polygons) else one.notes for one in (left, right)]
    return Polygons(earth.merged([found]), name, (*repairs[0], *repairs[1]), "", "".join(resolutions), ellipsoid)


def polygons_of(region: Region | PointSet) -> shapely.MultiPolygon:
    """A region as polygons; the rim of a cap to `RIM_TOLERANCE`. Raises ValueError for what has no polygons."""
    if isinstance(region, Polygons):
        return region.geometry
    if isinstance(region, Box):
        west, south, east, north = region.bounds
        return earth.merged(list(earth.cut_at_antimeridian(shapely.box(west, south, east, north))))
    if isinstance(region, Cap):
        return _cap_polygons(region)
    raise ValueError(f"Invalid region '{region.name}'. It must be made of boxes, caps and polygons to be combined.")


def geojson_of(region: Region | PointSet) -> dict[str, Any]:
    """A region as a geometry of GeoJSON; the rim of a cap to `RIM_TOLERANCE`. Raises ValueError, as `polygons_of`."""
    return dict(shapely.geometry.mapping(polygons_of(region)))


def _cap_polygons(cap: Cap) -> shapely.MultiPolygon:
    """The cap with a rim of chords."""
    if cap.angle == 180.0:
        return shapely.MultiPolygon([shapely.box(-180.0, -90.0, 180.0, 90.0)])

    def rim(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        points = cap.chart(np.zeros(t.shape, dtype=int), t, np.full(t.shape, cap.angle))
        return points.lon, points.lat

    ring = earth.unwrapped(earth.chords(rim, np.linspace(0.0, 360.0, 65), RIM_TOLERANCE))
    poles = [pole for pole in (90.0, -90.0) if bool(cap.contains(0.0, pole))]
    if len(poles) == 2:
        # The rim encloses the complement, unless both poles lie on it.
        around = earth.merged(list(earth.cut_at_antimeridian(shapely.make_valid(shapely.Polygon(ring)))))
        if shapely.intersects_xy(around, (cap.lon + 180.0) % 360.0 - 180.0, cap.lat):
            return around
        return earth.merged([shapely.difference(shapely.box(-180.0, -90.0, 180.0, 90.0), around)])
    if poles:
        ring = np.concatenate([ring, [[ring[-1, 0], poles[0]], [ring[0, 0], poles[0]]]])
    else:
        ring = earth.closed_round_pole(ring)
    return earth.merged(list(earth.cut_at_antimeridian(shapely.make_valid(shapely.Polygon(ring)))))


# ---- parts ---------------------------------------------------------------------------------------


@overload
def main_part(region: Region, km: float = MAIN_KM) -> Region: ...
@overload
def main_part(region: PointSet, km: float = MAIN_KM) -> PointSet: ...
def main_part(region: Region | PointSet, km: float = MAIN_KM) -> Region | PointSet:
    """The parts connected to the largest by gaps of at most `km`; a connected region as it is. Raises ValueError."""
    farthest = math.pi * (region.figure.mean_radius / 1000.0)
    if not _NEAREST_KM <= km <= farthest:
        raise ValueError(
            f"Invalid distance '{km:g}' of a main part. It must be {_NEAREST_KM:.0f} to {farthest:.0f} km."
        )
    if not isinstance(region, Polygons):
        return region
    outline = _Outline(region, km)
    kept = outline.main(km)
    if kept.all():
        return region
    name = _suffixed(region.name, "@main" if km == MAIN_KM else f"@main:{km:g}")
    return dataclasses.replace(region, geometry=shapely.MultiPolygon(list(outline.parts[kept])), name=name, far="")


def all_parts(region: Region | PointSet) -> Region | PointSet:
    """The region with all parts, without a note on distant ones."""
    if not isinstance(region, Polygons):
        return region
    return dataclasses.replace(region, far="", name=_suffixed(region.name, "@all"))


def _suffixed(name: str, suffix: str) -> str:
    """Name of a region with a suffix; that of a combination gets brackets."""
    combined = any(f" {operator} " in name for operator in "&+-")
    return f"({name}){suffix}" if combined else f"{name}{suffix}"


def told_apart(region: Polygons) -> Polygons:
    """The region, with a note on parts beyond gaps of `FAR_KM` if it has some."""
    parts = shapely.get_parts(region.geometry)
    largest = parts[np.argmax(shapely.area(parts))]
    shapely.prepare(largest)
    # No degree is longer than those of meridians at the poles.
    if shapely.dwithin(largest, parts, math.degrees(1000.0 * FAR_KM * (1.0 - region.figure.f) / region.figure.a)).all():
        return region
    outline = _Outline(region, MAIN_KM)
    if outline.main(FAR_KM).all():
        return region
    kept = outline.main(MAIN_KM)
    away = outline.distances(np.flatnonzero(kept), ~kept)
    share = 100.0 * outline.areas[~kept].sum() / outline.areas.sum()
    distances = " to ".join(dict.fromkeys(f"{distance:.0f}" for distance in (away.min(), away.max())))
    far = f"{share:.2g} % of the area lies {distances} km from the main part"
    return dataclasses.replace(
        region, far=f"{region.name}: {far}; @main leaves it out, @all keeps it and says nothing."
    )


class _Outline:
    """The polygons of a region, their areas, and points on their edges, shared by those cut at the antimeridian."""

    def __init__(self, region: Polygons, km: float) -> None:
        self._radius = region.figure.mean_radius / 1000.0
        self.parts = shapely.get_parts(region.geometry)
        dense = shapely.segmentize(self.parts, math.degrees(km / self._radius) / _SPACING)
        lonlat, self._part = shapely.get_coordinates(dense, return_index=True)
        self._points = earth.unit_vectors(*lonlat.T).T
        # Areas by the mean latitude suffice to find the largest.
        self.areas = shapely.area(self.parts) * np.cos(np.radians(shapely.get_y(shapely.centroid(self.parts))))

    def main(self, km: float) -> BoolArray:
        """Mask of the parts connected to the largest by gaps of at most `km`."""
        kept = np.zeros(len(self.parts), dtype=bool)
        front: IntArray = np.array([np.argmax(self.areas)])
        while front.size:
            kept[front] = True
            front = np.flatnonzero(~kept)[self.distances(front, ~kept, km) <= km]
        return kept

    def distances(self, near: IntArray, far: BoolArray, within: float = math.inf) -> FloatArray:
        """Distance in km of the parts `far` from the parts `near`; half way round the body beyond `within`."""
        asked = far[self._part]
        bound = 2.0 * math.sin(0.5 * min(within / self._radius, math.pi)) * (1.0 + 1e-9)
        points, wanted = self._points[np.isin(self._part, near)], self._points[asked]
        if len(points) * len(wanted) > _PAIRS:
            from scipy.spatial import KDTree  # slow to load

            # With a bound a tree is fast even if many points are equally far, as from the centre of a ring.
            chords = np.asarray(KDTree(points).query(wanted, distance_upper_bound=bound)[0])
        else:
            squares = np.full(len(wanted), np.inf)
            for point in points:
                np.minimum(squares, ((wanted - point) ** 2).sum(axis=1), out=squares)
            chords = np.where(squares <= bound**2, np.sqrt(squares), np.inf)
        least = np.full(len(self.parts), np.inf)
        np.minimum.at(least, self._part[asked], 2.0 * np.arcsin(np.minimum(0.5 * chords, 1.0)))
        return np.asarray(least[far] * self._radius)


class RegionEdges:
    """The edges of a region within longitudes -180 to 180, with those along the antimeridian where it is cut."""

    def __init__(self, region: Region) -> None:
        rings = shapely.get_rings(shapely.get_parts(polygons_of(region)))
        points, ring = shapely.get_coordinates(rings, return_index=True)
        edges = np.stack([points[:-1], points[1:]], axis=1)[ring[1:] == ring[:-1]]
        self._tree = shapely.STRtree(shapely.linestrings(edges))

    def crosses(self, boxes: FloatArray) -> BoolArray:
        """Mask of boxes (n, 4) W, S, E, N that edges may cross; True if in doubt, as across the antimeridian."""
        west, south, east, north = boxes.T
        turns = 360.0 * np.floor((west + 180.0) / 360.0)
        doubt = ~np.isfinite(boxes).all(axis=1) | (east - turns > 180.0)
        result = doubt.copy()
        known = np.flatnonzero(~doubt)
        found = shapely.box((west - turns)[known], south[known], (east - turns)[known], north[known])
        result[known[np.unique(self._tree.query(found, predicate="intersects")[0])]] = True
        return result
