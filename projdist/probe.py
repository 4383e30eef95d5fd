"""A fixed set of nodes of a region, at which many projections are measured cheaply."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray
from projdist.ellipsoid import WGS84
from projdist.nodes import nodes_of
from projdist.regions import Region

__all__ = ["Area", "Probe", "probe_of", "shares_within"]

Area = tuple[float, float, float, float]

_INNER = 150  # nodes: enough for a few per cent of an integral, at 0.3 ms a projection
_BORDER = 60
_LATTICE = 1000  # points
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


def shares_within(region: Region, areas: Sequence[Area]) -> FloatArray:
    """The shares of a region within areas of west, south, east, north in degrees; west > east crosses the antimeridian.

    They come from a thousand nodes, so that what lies out by a few thousandths does not count.
    """
    nodes = nodes_of(region, WGS84, _LATTICE)
    lon, lat, weight = nodes.lon, nodes.lat, nodes.weight
    west, south, east, north = np.array(areas, dtype=float).reshape(-1, 4).T[:, :, None]
    width = (east - west) % 360.0
    width[width == 0] = 360.0
    low, bottom, high, top = region.bounds
    near = (((low - west) % 360.0 <= width) | ((west - low) % 360.0 <= high - low)) & (south <= top) & (north >= bottom)
    shares = np.zeros(len(west))
    chosen = near[:, 0]
    west, south, north, width = west[chosen], south[chosen], north[chosen], width[chosen]
    within = (lon - west) % 360.0 <= width
    within &= (lat >= south) & (lat <= north)
    shares[chosen] = within @ weight
    return shares
