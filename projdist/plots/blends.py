"""Two maps as one that flows from the first to the second: points of both, cut wherever either is cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.field import drawn, evaluate, jacobian
from projdist.matrices import Measure
from projdist.projections import Projection
from projdist.regions import Place
from projdist.surfaces import (
    Surface,
    coast,
    cut_at_tears,
    graticule,
    graticule_steps,
    ground_size,
    normalised,
    surface_of,
)

_INWARD = 0.01  # of the way from a seam to the node behind it: there the side is certain
_POLE = 89.9  # degrees: nearer to a pole maps may be singular
_STRAIGHT = np.radians(2.0)  # a turn that is less is none
_SHRUNK = 0.02  # of the longest edge: shorter ones are of a line that becomes a pole
_CLOSED = 0.4  # of an edge: sides of a cut as near to each other as that
_SPANNING = 0.1  # of the width of a map
_COARSE = 40  # points a side
_ROUNDS = 3  # of filling what is undefined from its neighbours


@dataclass(frozen=True)
class Track:
    """Points in metres on both maps, (n, 2) each."""

    first: FloatArray
    second: FloatArray


@dataclass(frozen=True)
class Blend:
    """Vertices and triangles of both maps, Jacobians (n, 2, 2) there, and the lines that are drawn.

    The second map is turned by `turn` radians so that it lies on the first as well as it can,
    and turns back on the way.
    """

    maps: tuple[Projection, Projection]
    region: Place
    vertices: Track
    jacobians: tuple[FloatArray, FloatArray]
    weights: FloatArray
    triangles: IntArray
    edges: IntArray
    graticule: list[Track]
    coast: list[Track]
    turn: float

    def at(self, share: float, track: Track) -> FloatArray:
        """Points (n, 2) at a share of the way."""
        way = (1.0 - share) * track.first + share * track.second @ _rotation(self.turn).T
        return way @ _rotation(-share * self.turn).T

    def values(self, share: float, measure: Measure) -> FloatArray:
        """A measure (n,) of the Jacobians there, which are those of both maps in these shares."""
        first, second = self.jacobians
        J = _rotation(-share * self.turn) @ ((1.0 - share) * first + share * _rotation(self.turn) @ second)
        return measure(J)


def blend_of(first: Projection, second: Projection, region: Place) -> Blend:
    """What flows from a map to another; raises ValueError where they have nothing in common."""

    turn = _turn(first, second, region)
    cos, sin = np.cos(turn), np.sin(turn)

    def between(lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        # It is cut where either map is: in uneven shares, no cut of one closes that of the other.
        (x, y), (p, q) = first(lon, lat), second(lon, lat)
        return 0.55 * x + 0.45 * (cos * p - sin * q), 0.55 * y + 0.45 * (sin * p + cos * q)

    both = Projection.from_function(between, name=f"{first.name} and {second.name}", ellipsoid=first.ellipsoid)
    surface = surface_of(both, region)
    lon, lat = _inward(surface)
    vertices = Track(np.column_stack(first(lon, lat)), np.column_stack(second(lon, lat)))
    there = np.asarray(np.isfinite(np.hstack([vertices.first, vertices.second])).all(axis=1))
    triangles = surface.triangles[there[surface.triangles].all(axis=1)]
    triangles = triangles[~(_spans(vertices.first, triangles) | _spans(vertices.second, triangles))]
    used = np.zeros(there.size, dtype=bool)
    used[triangles] = True
    weights = np.zeros(there.size)
    weights[: surface.nodes] = surface.weights
    weights[~used | ~there] = 0.0
    bounds = region.bounds
    resolution = "110m" if max(ground_size(bounds)) > 60.0 else "50m"
    spacing = min(1.0, max(ground_size(bounds)) / 60.0)
    shore = [] if first.is_of_another_body else coast(bounds, resolution, spacing)
    return Blend(
        maps=(first, second),
        region=region,
        vertices=vertices,
        jacobians=(_filled(first, lon, lat, triangles), _filled(second, lon, lat, triangles)),
        weights=weights,
        triangles=triangles,
        edges=_border(triangles),
        graticule=_tracks(surface, graticule(bounds, *graticule_steps(bounds)), first, second),
        coast=_tracks(surface, shore, first, second),
        turn=turn,
    )


def _rotation(angle: float) -> FloatArray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _inward(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Longitudes and latitudes of the vertices, those on a seam a little on their own side of it."""
    du, dv = surface.u[surface.source] - surface.u, surface.v[surface.source] - surface.v
    u = surface.u + _INWARD * (np.mod(du + 180.0, 360.0) - 180.0)
    lon, lat = surface.frame.geographic(u, surface.v + _INWARD * dv)
    return normalised(lon), lat


def _turn(first: Projection, second: Projection, region: Place) -> float:
    """The angle by which the second map lies best on the first (Procrustes)."""
    west, south, _, north = region.bounds
    u = west + (np.mod(region.bounds[2] - west - 1e-9, 360.0) + 1e-9) * (np.arange(_COARSE) + 0.5) / _COARSE
    lon, lat = (one.ravel() for one in np.meshgrid(normalised(u), np.linspace(south, north, _COARSE + 2)[1:-1]))
    one, other = (np.column_stack(projection(lon, lat)) for projection in (first, second))
    kept = np.isfinite(one + other).all(axis=1) & region.contains(lon, lat)
    if not kept.any():
        return 0.0
    w = np.cos(np.radians(lat[kept]))
    one, other = (points[kept] - w @ points[kept] / w.sum() for points in (one, other))
    angle = float(np.arctan2(w @ (other[:, 0] * one[:, 1] - other[:, 1] * one[:, 0]), w @ (other * one).sum(axis=1)))
    return angle if abs(angle) > _STRAIGHT else 0.0


def _filled(projection: Projection, lon: FloatArray, lat: FloatArray, triangles: IntArray) -> FloatArray:
    """Jacobians at points; what is undefined, as at a pole, is the mean of its neighbours."""
    J = np.full((lon.size, 2, 2), np.nan)
    inner = np.isfinite(lon) & (np.abs(lat) < _POLE)
    J[inner] = jacobian(projection, lon[inner], lat[inner])
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    for _ in range(_ROUNDS):
        missing = ~np.isfinite(J).all(axis=(1, 2))
        useful = pairs[missing[pairs[:, 0]] & ~missing[pairs[:, 1]]]
        if not len(useful):
            break
        count = np.bincount(useful[:, 0], minlength=len(J))
        total = np.zeros_like(J)
        np.add.at(total, useful[:, 0], J[useful[:, 1]])
        J[count > 0] = total[count > 0] / count[count > 0][:, None, None]
    return J


def _spans(xy: FloatArray, triangles: IntArray) -> BoolArray:
    """Triangles that reach across a map: where many cuts meet at a point, some go unseen."""
    corners = xy[triangles]
    longest = np.hypot(*(corners - corners[:, [1, 2, 0]]).reshape(-1, 2).T).reshape(-1, 3).max(axis=1)
    size = np.ptp(corners.reshape(-1, 2), axis=0).max() if len(corners) else 0.0
    return np.asarray((longest > _SPANNING * size) & (longest > 10.0 * np.median(longest)))


def _border(triangles: IntArray) -> IntArray:
    """The edges (k, 2) that only one triangle has."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    found, count = np.unique(edges, axis=0, return_counts=True)
    return np.asarray(found[count == 1])


def open_edges(xy: FloatArray, edges: IntArray) -> IntArray:
    """The edges at the rim of the map, without those of a cut that has closed: both its sides are at one place."""
    ends = xy[edges]
    lengths = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    near = _CLOSED * float(np.median(lengths[lengths >= _SHRUNK * lengths.max()]))
    # Points along all edges, and the edges that they are of: an edge is closed where another, that shares no end with
    # it, has a point beside its middle.
    count = np.maximum(1, np.ceil(2.0 * lengths / near)).astype(int)
    owner = np.repeat(np.arange(len(edges)), count)
    share = (np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[owner]
    points = ends[owner, 0] + share[:, None] * (ends[owner, 1] - ends[owner, 0])
    closed = np.zeros(len(edges), dtype=bool)
    for shift in ((0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)):  # neighbours have a cell of one lattice in common
        cells = np.floor(np.concatenate([points, ends.mean(axis=1)]) / near + shift)
        cell = np.unique(cells, axis=0, return_inverse=True)[1].ravel()
        closed |= _meets(cell[: len(points)], owner, cell[len(points) :], edges)
    return edges[~closed]


def _meets(cell: IntArray, owner: IntArray, middle: IntArray, edges: IntArray) -> BoolArray:
    """Whether the cell of an edge's middle has a point of an edge that shares no end with it."""
    order = np.argsort(cell, kind="stable")
    cell, owner = cell[order], owner[order]
    start, stop = np.searchsorted(cell, middle), np.searchsorted(cell, middle, side="right")
    mine = np.repeat(np.arange(len(middle)), stop - start)
    place = np.arange(mine.size) - np.repeat(np.cumsum(stop - start) - (stop - start), stop - start) + start[mine]
    other = owner[place]
    apart = (edges[mine][:, :, None] != edges[other][:, None, :]).all(axis=(1, 2))
    found = np.zeros(len(middle), dtype=bool)
    found[mine[apart]] = True
    return found


def _tracks(surface: Surface, lines: Sequence[FloatArray], first: Projection, second: Projection) -> list[Track]:
    """Lines of (lon, lat) on both maps, in pieces that neither map cuts."""
    if not lines:
        return []
    domain = surface.domain
    line = np.repeat(np.arange(len(lines)), [len(points) for points in lines])
    points = cut_at_tears(domain, evaluate(domain, *np.concatenate(lines).T), line)
    there = drawn(points)
    lon, lat = normalised(np.where(there, points[:, 0], 0.0)), np.where(there, points[:, 1], 0.0)
    one, other = (np.column_stack(projection(lon, lat)) for projection in (first, second))
    there &= np.isfinite(one).all(axis=1) & np.isfinite(other).all(axis=1)
    return [Track(one[start:stop], other[start:stop]) for start, stop in _runs(there)]


def _runs(there: BoolArray) -> list[tuple[int, int]]:
    """Where two or more in a row are there."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]]).astype(np.int8))).reshape(-1, 2)
    return [(int(start), int(stop)) for start, stop in ends if stop - start > 1]
