"""Points strewn over a region, evenly by area and at random: for means over pairs of points.

One coordinate is stratified with a jitter, the other a golden-ratio sequence with a random shift. Each
draw is unbiased, draws are independent of each other, and means of smooth functions over them err by far
less than those over independent points: for pairs of draws of 512 on the globe, twenty to a hundred
times less. Scrambled Sobol points do no better, and scipy.stats takes half a second to load.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import Ellipsoid, destination
from projdist.regions import Box, Cap, Place, PointSet, Region, cells_of

__all__ = ["GOLDEN", "Points", "scatter_over"]

GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
"""The step of the sequence, modulo 1, that fills an interval most evenly."""
_CELLS = 200  # of polygons; between a half and nine tenths of them is polygon


class Points(NamedTuple):
    """Points in degrees, and weights to make means those by true area; all of shape (n,)."""

    lon: FloatArray
    lat: FloatArray
    weight: FloatArray

    def take(self, kept: BoolArray | IntArray) -> Points:
        """The points of a mask, or of numbers."""
        return Points(self.lon[kept], self.lat[kept], self.weight[kept])


class Scatter(Protocol):
    """What strews points over a region."""

    def draw(self, count: int, rng: np.random.Generator) -> Points:
        """About `count` points."""


def scatter_over(region: Place, ellipsoid: Ellipsoid) -> Scatter:
    """What strews points over a region by area on an ellipsoid, and those of a set of points by their weights."""
    if isinstance(region, PointSet):
        return _OfPoints(region)
    return _OfCap(region, ellipsoid) if isinstance(region, Cap) else _OfBoxes(region, ellipsoid)


class _OfPoints:
    """Points of a set, by their weights."""

    def __init__(self, points: PointSet) -> None:
        self._points = points
        self._cumulative = np.cumsum(points.weight) / points.weight.sum()

    def draw(self, count: int, rng: np.random.Generator) -> Points:
        along, _ = _even(count, rng)
        # The last sum may be rounded to less than one.
        k = np.minimum(np.searchsorted(self._cumulative, along, side="right"), self._points.lon.size - 1)
        return Points(self._points.lon[k], self._points.lat[k], np.ones(count))


@dataclass(frozen=True)
class _OfCap:
    """Points of a cap, in each direction evenly by area on the sphere that has its latitudes."""

    cap: Cap
    ellipsoid: Ellipsoid

    def draw(self, count: int, rng: np.random.Generator) -> Points:
        along, across = _even(count, rng)
        azimuth = 360.0 * across
        # The area within c is as sin^2(c / 2).
        widest, reach = (np.sin(np.radians(0.5 * one)) for one in (self.cap.angle, self.cap.reach(azimuth)))
        distance = 2.0 * np.degrees(np.arcsin(np.sqrt(along) * reach))
        points = _weighted(*destination(self.cap.lon, self.cap.lat, azimuth, distance), self.ellipsoid)
        return points._replace(weight=points.weight * np.square(reach / widest))


class _OfBoxes:
    """Points of the boxes that cover a region.

    Polygons are covered by cells, and what falls beside them is dropped: no point is moved, so that coasts
    have their share, at the cost of some more points and of a count that is about what was asked for.
    """

    def __init__(self, region: Region, ellipsoid: Ellipsoid) -> None:
        self._region, self._ellipsoid = region, ellipsoid
        self._boxes = _boxes(region, ellipsoid)
        west, south, east, north = self._boxes.T
        # A difference of sines without cancellation.
        middle, half = np.radians(0.5 * (north + south)), np.radians(0.5 * (north - south))
        areas = np.radians(east - west) * 2.0 * np.cos(middle) * np.sin(half)
        self._cumulative = np.cumsum(areas) / areas.sum()
        self._is_box = isinstance(region, Box)
        self._fill = 1.0 if self._is_box else min(1.0, region.area_km2 * 1e6 / (areas.sum() * region.figure.a**2))

    def draw(self, count: int, rng: np.random.Generator) -> Points:
        lon, lat = self._places(*_even(int(np.ceil(count / self._fill)), rng))
        points = _weighted(lon, lat, self._ellipsoid)
        return points if self._is_box else points.take(self._region.contains(lon, lat))

    def _places(self, along: FloatArray, across: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points by area: `along` runs through the boxes, and from south to north in each."""
        k = np.minimum(np.searchsorted(self._cumulative, along, side="right"), len(self._boxes) - 1)
        before = np.append(0.0, self._cumulative)
        share = np.clip((along - before[k]) / (self._cumulative[k] - before[k]), 0.0, 1.0)
        west, south, east, north = self._boxes[k].T
        low, high = np.sin(np.radians(south)), np.sin(np.radians(north))
        lat = np.degrees(np.arcsin(np.clip(low + share * (high - low), -1.0, 1.0)))
        return west + across * (east - west), np.clip(lat, south, north)


def _even(count: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """So many points that fill the unit square evenly."""
    index = np.arange(count)
    return (index + rng.random(count)) / count, np.mod(index * GOLDEN + rng.random(), 1.0)


def _weighted(lon: FloatArray, lat: FloatArray, ellipsoid: Ellipsoid) -> Points:
    """Points that are even on a sphere, with the weights that make means those on the ellipsoid."""
    meridian, vertical = ellipsoid.radii(lat)
    return Points(lon, lat, meridian * vertical / ellipsoid.a**2)


def _boxes(region: Region, ellipsoid: Ellipsoid) -> FloatArray:
    """West, south, east, north (n, 4) of what covers a region."""
    if isinstance(region, Box):
        return np.array([region.bounds])
    cells = cells_of(region, ellipsoid, _CELLS)
    u0, u1, v0, v1 = cells.rectangle.T
    # Panels of polygons have longitude for u; v runs north or south.
    ends = region.chart(cells.patch, u0, v0), region.chart(cells.patch, u1, v1)
    lats = np.sort([np.asarray(end.lat) for end in ends], axis=0)
    return np.stack([u0, lats[0], u1, lats[1]], axis=-1)
