"""A fixed set of nodes of a region, at which many projections are measured cheaply."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.earth import WGS84
from projdist.field import nodes_of
from projdist.regions import Region

__all__ = ["Area", "Lattice", "Probe", "probe_of"]

Area = tuple[float, float, float, float]

_INNER = 150  # nodes: enough for a few per cent of an integral, at 0.3 ms a projection
_BORDER = 60
_LATTICE = 4000  # points: shares to a per cent
_POLAR = 85.0  # degrees; derivatives beyond cost fifty times as much
_ELSEWHERE = 0.9  # of a region: then what is polar is left out


@dataclass(frozen=True)
class Probe:
    """Points in degrees with weights whose sum is 1, by area on WGS 84; those on edges have weight 0."""

    lon: FloatArray
    lat: FloatArray
    weight: FloatArray


def probe_of(region: Region) -> Probe:
    """About two hundred nodes of a region, some of them on its edges."""
    nodes = nodes_of(region, WGS84, _INNER, edges=True)
    inner, border = np.flatnonzero(nodes.weight > 0), np.flatnonzero(nodes.weight == 0)
    border = border[region.contains(nodes.lon[border], nodes.lat[border])]  # rounding may lay them outside
    chosen = np.concatenate([inner, border[:: max(1, border.size // _BORDER)]])
    near = chosen[np.abs(nodes.lat[chosen]) <= _POLAR]
    if nodes.weight[near].sum() < _ELSEWHERE:
        near = chosen
    return Probe(nodes.lon[near], nodes.lat[near], nodes.weight[near] / nodes.weight[near].sum())


class Lattice:
    """Some thousand points of a region, with weights whose sum is 1, to see what areas of use hold of it."""

    def __init__(self, region: Region) -> None:
        nodes = nodes_of(region, WGS84, _LATTICE)
        self.lon, self.lat, self.weight = nodes.lon, nodes.lat, nodes.weight
        self._bounds = region.bounds
        # In a box the points are on some dozens of meridians and parallels.
        self._meridians, self._parallels = (np.unique(values, return_inverse=True) for values in (self.lon, self.lat))

    def near(self, areas: Sequence[Area]) -> BoolArray:
        """Which areas of west, south, east, north have something in common with the region's bounds."""
        west, south, _, north, width = _columns(areas)
        low, bottom, high, top = self._bounds
        beside = ((low - west) % 360.0 <= width) | ((west - low) % 360.0 <= high - low)
        return np.asarray(beside & (south <= top) & (north >= bottom))

    def within(self, areas: Sequence[Area]) -> BoolArray:
        """Which points are within areas, shape (areas, points); west > east crosses the antimeridian."""
        west, south, _, north, width = _columns(areas)
        chosen = self.near(areas)
        found = np.zeros((len(west), self.lon.size), dtype=bool)
        (lon, of_lon), (lat, of_lat) = self._meridians, self._parallels
        between = (lon - west[chosen, None]) % 360.0 <= width[chosen, None]
        beside = (lat >= south[chosen, None]) & (lat <= north[chosen, None])
        found[chosen] = between[:, of_lon] & beside[:, of_lat]
        return found


def _columns(areas: Sequence[Area]) -> tuple[FloatArray, ...]:
    """West, south, east, north, and the width; one of 0 goes round the Earth."""
    west, south, east, north = np.array(areas, dtype=float).reshape(-1, 4).T
    width = (east - west) % 360.0
    return west, south, east, north, np.where(width == 0.0, 360.0, width)
