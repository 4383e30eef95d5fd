"""Parts of regions: the main part and distant parts (France without Guiana), and the share in a box."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import unit_vectors
from projdist.regions.boxes import Box
from projdist.regions.caps import Cap
from projdist.regions.points import PointSet
from projdist.regions.region import Region

if TYPE_CHECKING:
    from projdist.regions.polygons import Polygons

MAIN_KM = 400.0
"""Largest gap between the parts of a main part.

In Natural Earth it keeps together what is mapped together (Indonesia has gaps of 210 km, Japan down to Okinawa 268,
Yemen and Socotra 355, Russia and Kaliningrad 364), and separates the rest (Norway from Bear Island and Svalbard at 415,
Malaysia's two halves, each with a datum's grid of its own, at 586, New Zealand from Chatham at 654, Alaska at 817).
"""

FAR_KM = 800.0
"""Smallest gap between parts that is reported.

A conformal map that is true at one end is off by d^2 / (2 R^2), 0.8 %, at the other; the Azores, the Galapagos, Jan
Mayen, the Andamans and the Canaries are beyond, Malaysia's halves and Fiji's Rotuma are not.
"""

# Outlines at 1 : 50 million are accurate to some kilometres; shorter pieces of edges take seconds for a continent.
_NEAREST_KM = 10.0
_SPACING = 8.0  # points on edges per gap: a gap d is measured as at most d sqrt(1 + 1 / 8^2), 0.8 % too long
_PAIRS = 2e6  # of points; fewer take less time than loading scipy, 0.2 s


@overload
def main_part(region: Region, km: float = MAIN_KM) -> Region: ...
@overload
def main_part(region: PointSet, km: float = MAIN_KM) -> PointSet: ...
def main_part(region: Region | PointSet, km: float = MAIN_KM) -> Region | PointSet:
    """The parts of a region connected to the largest by gaps of at most `km`; raises ValueError.

    A connected region is returned as it is, and so are boxes, caps and points.
    """
    farthest = math.pi * _radius_km(region)
    if not _NEAREST_KM <= km <= farthest:
        allowed = f"{_NEAREST_KM:.0f} to {farthest:.0f} km"
        raise ValueError(f"Invalid distance '{km:g}' of a main part. It must be {allowed}.")
    from projdist.regions.polygons import Polygons  # shapely is slow to load

    if not isinstance(region, Polygons):
        return region
    outline = _Outline(region, km)
    kept = outline.main(km)
    if kept.all():
        return region
    suffix = "@main" if km == MAIN_KM else f"@main:{km:g}"
    name = _suffixed(region.name, suffix)
    return dataclasses.replace(region, geometry=outline.geometry(kept), name=name, far="")


def all_parts(region: Region | PointSet) -> Region | PointSet:
    """The region with all parts, without a note on distant ones."""
    from projdist.regions.polygons import Polygons  # as above

    if not isinstance(region, Polygons):
        return region
    return dataclasses.replace(region, far="", name=_suffixed(region.name, "@all"))


def _suffixed(name: str, suffix: str) -> str:
    """Name of a region with a suffix; a combination gets brackets."""
    combined = any(f" {operator} " in name for operator in "&+-")
    return f"({name}){suffix}" if combined else f"{name}{suffix}"


def told_apart(region: Polygons) -> Polygons:
    """The region, with a note on parts beyond gaps of `FAR_KM` if there are any."""
    west, south, east, north = region.bounds
    if math.radians(east - west + north - south) * _radius_km(region) < FAR_KM:  # no two points are farther apart
        return region
    outline = _Outline(region, MAIN_KM)
    if outline.main(FAR_KM).all():
        return region
    kept = outline.main(MAIN_KM)
    away = outline.away(kept)
    share = 100.0 * outline.areas[~kept].sum() / outline.areas.sum()
    distances = " to ".join(dict.fromkeys(f"{distance:.0f}" for distance in (away.min(), away.max())))
    far = f"{share:.2g} % of the area lies {distances} km from the main part"
    return dataclasses.replace(
        region, far=f"{region.name}: {far}; @main leaves it out, @all keeps it and says nothing."
    )


def _radius_km(region: Region | PointSet) -> float:
    """Mean radius of the body in km."""
    return region.figure.mean_radius / 1000.0


def _nearest(points: FloatArray, asked: FloatArray, bound: float) -> FloatArray:
    """Chords from unit vectors `asked` to the nearest of `points`; infinity beyond a bound."""
    if len(points) * len(asked) > _PAIRS:
        from scipy.spatial import KDTree  # slow to load

        # With a bound a tree is fast even if many points are equally far, as from the centre of a ring.
        return np.asarray(KDTree(points).query(asked, distance_upper_bound=bound)[0])
    squares = np.full(len(asked), np.inf)
    for point in points:
        np.minimum(squares, ((asked - point) ** 2).sum(axis=1), out=squares)
    return np.where(squares <= bound**2, np.sqrt(squares), np.inf)


class _Outline:
    """The polygons of a region, their areas in km^2, and points on their edges as unit vectors.

    Parts cut at the antimeridian share points there, and so are connected.
    """

    def __init__(self, region: Polygons, km: float) -> None:
        import shapely  # slow to load

        self._radius = _radius_km(region)
        self._parts = shapely.get_parts(region.geometry)
        dense = shapely.segmentize(self._parts, math.degrees(km / self._radius) / _SPACING)
        lonlat, self._part = shapely.get_coordinates(dense, return_index=True)
        self._points = unit_vectors(*lonlat.T).T
        # By mean latitude: enough to find the largest.
        self.areas = shapely.area(self._parts) * np.cos(np.radians(shapely.get_y(shapely.centroid(self._parts))))

    def main(self, km: float) -> BoolArray:
        """Mask of the parts connected to the largest by gaps of at most `km`."""
        kept = np.zeros(len(self._parts), dtype=bool)
        front: IntArray = np.array([np.argmax(self.areas)])
        while front.size:
            kept[front] = True
            front = np.flatnonzero(~kept)[self._distances(front, ~kept, km) <= km]
        return kept

    def away(self, kept: BoolArray) -> FloatArray:
        """Distance in km of each other part from these."""
        return self._distances(np.flatnonzero(kept), ~kept)

    def _distances(self, near: IntArray, far: BoolArray, within: float = math.inf) -> FloatArray:
        """Distance in km of the parts `far` from the parts `near`; half way round the body beyond `within`."""
        asked = far[self._part]
        bound = 2.0 * math.sin(0.5 * min(within / self._radius, math.pi)) * (1.0 + 1e-9)
        chords = _nearest(self._points[np.isin(self._part, near)], self._points[asked], bound)
        least = np.full(len(self._parts), np.inf)
        np.minimum.at(least, self._part[asked], 2.0 * np.arcsin(np.minimum(0.5 * chords, 1.0)))
        return np.asarray(least[far] * self._radius)

    def geometry(self, kept: BoolArray) -> Any:
        """Some of the parts as one geometry."""
        import shapely  # slow to load

        return shapely.MultiPolygon(list(self._parts[kept]))


_WHOLE = 1.0 - 1e-9


def share_in(box: Box, region: Region | PointSet) -> float:
    """Share of a region that lies in a box; for region types of other packages that of its bounds."""
    if isinstance(region, PointSet):
        return float(region.weight[box.contains(region.lon, region.lat)].sum() / region.weight.sum())
    around = Box.between(region.bounds, getattr(region, "ellipsoid", None))
    share = around.shared_km2(box) / around.area_km2
    if share == 0.0 or isinstance(region, Box):
        return share
    if share > _WHOLE:
        return 1.0
    from projdist.regions.combinations import combine  # shapely is slow to load
    from projdist.regions.polygons import Polygons

    if not isinstance(region, Cap | Polygons):
        return share
    try:
        return combine("&", region, box, region.name).area_km2 / region.area_km2
    except ValueError:  # nothing is left
        return 0.0
