"""The length of the lines along which the globe is cut, found from the map itself.

Where points that are neighbours on the globe are torn apart on the map, a cut runs between them. On a turned grid of
longitudes and latitudes the links between neighbours find the cuts; cells whose sides they cross twice hold a piece,
and all others that they cross, with ends, forks and corners, are quartered until they are too small to matter.
"""

from __future__ import annotations

import math

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.answers.published_indices.index import ScaledField
from projdist.field import evaluate, find_tears
from projdist.numerics import Estimate
from projdist.projections import Projection
from projdist.regions import GLOBE

__all__ = ["boundary_cuts", "cut_length"]

_COLUMNS, _ROWS = 144, 72  # cells of 2.5 degrees
_POLE = (27.31, 63.17, 11.7)  # longitude, latitude and turn of the grid's pole: where no cut runs along its lines
_TEAR = 5e-6  # of the semi-major axis; PROJ's goode slips by 4e-6 along the parallels where its two maps meet
_FADING = 100.0  # tears; a cut that is narrower where it seems to end may go on for as far as the cube root of one
_APART = 0.01  # radians; ends of cuts nearer to each other are one
_MOST = 4000  # cells in a generation; those of maps that do not end in curves double without end
_SMALLEST = 1e-7  # radians; what is in a cell so small is left out
_STRAIGHT = 1e-6  # radians, between a piece and the sum of its parts
_TOGETHER = 1e-6  # degrees, between the two sides of one tear
_WHOLE = 0.999  # of the globe


def boundary_cuts(field: ScaledField, scale: float) -> Estimate:
    """The length of the cuts over 4 pi; NaN where the region is not the globe, or the map shows a part of it only."""
    if field.region != GLOBE or field.samples.coverage < _WHOLE:
        return Estimate(math.nan, math.nan)
    length, error = cut_length(field.projection)
    return Estimate(length / (4.0 * math.pi), error / (4.0 * math.pi))


def cut_length(projection: Projection) -> tuple[float, float]:
    """The length of a map's cuts on the unit sphere, and its estimated error."""
    cells = _Cells(projection)
    parents = cells.first()
    total = error = 0.0
    while len(parents):
        if len(parents) > _MOST:
            return total, error + float(_size(parents).sum())
        chord = cells.chords(parents)
        children = _quarters(parents)
        parts = cells.chords(children).reshape(-1, 4)
        # A curve and its chord differ by four times what its halves and theirs do.
        gap = parts.sum(axis=1) - chord
        settled = np.abs(gap) <= _STRAIGHT
        total += float(np.sum((parts.sum(axis=1) + gap / 3.0)[settled]))
        error += float(np.abs(gap[settled]).sum())
        small = _size(parents) < _SMALLEST
        error += _TEAR ** (1.0 / 3.0) * cells.fading(parents[small & ~settled])
        # With those beside: a narrow cut is not seen in the next large cell.
        parents = children.reshape(-1, 4, 4)[~settled & ~small].reshape(-1, 4)
    return total, error


def _quarters(cells: FloatArray) -> FloatArray:
    """The quarters of cells (n, 4) of u0, u1, v0, v1, four in a row of each, (4 n, 4)."""
    u0, u1, v0, v1 = cells.T
    u, v = 0.5 * (u0 + u1), 0.5 * (v0 + v1)
    parts = [(u0, u, v0, v), (u, u1, v0, v), (u0, u, v, v1), (u, u1, v, v1)]
    return np.stack([np.stack(part, axis=-1) for part in parts], axis=1).reshape(-1, 4)


def _size(cells: FloatArray) -> FloatArray:
    """The height of cells in radians."""
    return np.asarray(np.radians(cells[:, 3] - cells[:, 2]))


class _Cells:
    """Cells in the longitude u and the latitude v of a turned grid."""

    def __init__(self, projection: Projection) -> None:
        self.projection, self.radius = projection, projection.ellipsoid.a
        lon, lat, _ = np.radians(_POLE)
        up = np.array([math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat)])
        east = np.array([-math.sin(lon), math.cos(lon), 0.0])
        self.axes = np.stack([east, np.cross(up, east), up])

    def directions(self, u: FloatArray, v: FloatArray) -> FloatArray:
        """Unit vectors (..., 3)."""
        turn, height = np.radians(u + _POLE[2]), np.radians(v)
        local = np.stack([np.cos(height) * np.cos(turn), np.cos(height) * np.sin(turn), np.sin(height)], axis=-1)
        return np.asarray(local @ self.axes)

    def __call__(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        x, y, z = np.moveaxis(self.directions(u, v), -1, 0)
        return self.projection(np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(z, np.hypot(x, y))))

    def first(self) -> FloatArray:
        """The cells of the grid (n, 4) that a cut enters, or may."""
        u = np.linspace(-180.0, 180.0, _COLUMNS + 1)
        v = np.linspace(-90.0, 90.0, _ROWS + 1)
        points = evaluate(self, *np.meshgrid(u, v))
        torn = [
            self._torn(points[start], points[stop])[0]
            for start, stop in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:]))
        ]
        across, along = torn[0].reshape(_ROWS + 1, _COLUMNS), torn[1].reshape(_ROWS, _COLUMNS + 1)
        entered = np.pad(across[:-1] | across[1:] | along[:, :-1] | along[:, 1:], 1)
        entered[:, [0, -1]] = entered[:, [-2, 1]]
        # And those beside, as a narrow cut is not seen in cells so large.
        entered = entered[:-2] | entered[1:-1] | entered[2:]
        row, column = np.nonzero(entered[:, :-2] | entered[:, 1:-1] | entered[:, 2:])
        return np.stack([u[column], u[column + 1], v[row], v[row + 1]], axis=-1)

    def fading(self, cells: FloatArray) -> int:
        """In how many places, of tiny cells in which cuts end, they are narrow."""
        torn, _, _, width = self._sides(cells)
        narrow = np.where(torn, width, 0.0).max(axis=1, initial=0.0) < _FADING * _TEAR
        places = self.directions(cells[narrow, 0], cells[narrow, 2])
        return len(np.unique(np.round(places / _APART), axis=0))

    def _sides(self, cells: FloatArray) -> tuple[BoolArray, FloatArray, BoolArray, FloatArray]:
        """What `_torn` tells of the four sides of cells."""
        u0, u1, v0, v1 = cells.T
        corners = evaluate(self, np.stack([u0, u1, u1, u0], axis=1), np.stack([v0, v0, v1, v1], axis=1))
        torn, places, once, width = self._torn(corners, np.roll(corners, -1, axis=1))
        return torn.reshape(-1, 4), places.reshape(-1, 4, 2), once.reshape(-1, 4), width.reshape(-1, 4)

    def _torn(self, start: FloatArray, stop: FloatArray) -> tuple[BoolArray, FloatArray, BoolArray, FloatArray]:
        """Which links are torn, where (n, 2), which of these once, and how widely, in semi-major axes."""
        start, stop = start.reshape(-1, 4), stop.reshape(-1, 4)
        torn, once = np.zeros((2, len(start)), dtype=bool)
        places, width = np.full((len(start), 2), np.nan), np.zeros(len(start))
        look = np.flatnonzero(self._suspect(start, stop))
        links = find_tears(self, start[look], stop[look], self.radius, smallest=_TEAR * self.radius)
        sides = links.start[:, :2], links.stop[:, :2]
        torn[look], places[look] = links.torn, 0.5 * (sides[0] + sides[1])
        once[look] = links.torn & (np.abs(sides[0] - sides[1]).max(axis=1) <= _TOGETHER)
        width[look] = np.hypot(*(links.stop - links.start)[:, 2:].T) / self.radius
        return torn, places, once, width

    def _suspect(self, start: FloatArray, stop: FloatArray) -> BoolArray:
        """Links along which fourth differences, which any tear makes as large as itself, are no less than a tear."""
        shares = np.array([0.25, 0.5, 0.75])
        between = start[:, None, :2] + shares[:, None] * (stop - start)[:, None, :2]
        inner = np.stack(self(between[..., 0], between[..., 1]), axis=-1)
        f = np.concatenate([start[:, None, 2:], inner, stop[:, None, 2:]], axis=1)
        fourth = np.abs(np.diff(f, n=4, axis=1)).max(axis=(1, 2))
        return np.asarray(~(fourth < _TEAR * self.radius))

    def chords(self, cells: FloatArray) -> FloatArray:
        """Length of the piece of a cut in each cell; 0 where there is none, NaN where it is more than one piece."""
        torn, places, once, _ = self._sides(cells)
        count = torn.sum(axis=1)
        single = (count == 2) & (once.sum(axis=1) == 2)
        order = np.argsort(~torn[single], axis=1, kind="stable")[:, :2, None]
        ends = np.take_along_axis(places[single], order, axis=1)
        start, stop = np.moveaxis(self.directions(ends[..., 0], ends[..., 1]), 1, 0)
        length = np.where(count == 0, 0.0, np.nan)
        length[single] = 2.0 * np.arcsin(np.minimum(1.0, 0.5 * np.linalg.norm(stop - start, axis=-1)))
        return length
