"""Polynomials of a map on panels of longitudes and latitudes, from a few evaluations each.

Panels are sampled at 14 x 14 Chebyshev nodes, and cut until the coefficients of x and y have died away. Coefficients
that make no difference are left out, and J is the polynomial's own derivative. There is no panel where none resolves
the map: at seams, kinks, noise and singular poles.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from projdist._typing import AnyArray, BoolArray, FloatArray, IntArray
from projdist.projections import Projection

# The smallest panels are cells of 2.5 x 1.25 degrees, the largest 360 x 30 degrees. Longitudes are cut into nine,
# latitudes into three, then both in halves: the edges come to lie on multiples of 20 and 10 degrees, where maps have
# their breaks, as Goode's lobes, and on those of 5, as Robinson's table.
_CELL_WIDTH, _CELL_HEIGHT = 2.5, 1.25
_COLUMNS, _ROWS = 144, 24  # cells of the largest
_WEST, _SOUTH, _NORTH = -180.0, -90.0, 90.0 - 1e-9  # the pole is in the cell below it
_MOST_COLUMNS = 3 * _COLUMNS  # so that panels have numbers of 16 bits
_NARROWEST = 0.1  # degrees, of a panel that may not reach beyond the points; in less, rounding is 1e-12 of J
ORDER = 14  # nodes along a side of a panel
_NODES = ORDER * ORDER
_FEWEST = 100  # points in a panel: differences take 8 evaluations each, a panel 196 and some 40 microseconds
_SPARE = 0.2  # evaluations a point that may be spent before any has paid
_AHEAD = 4  # times as much must be allowed as the largest panels take
_TRUNCATION = 3e-13  # of J
_FLOOR = np.finfo(float).eps  # of x and y; coefficients round to a third of it
_TOGETHER = 8192  # points at a time

_DEGREES = np.arange(ORDER)
# Cosines of multiples of pi / (2 p), exact to rounding, which those of large angles are not.
_FOLDED = np.abs((np.outer(_DEGREES, 2 * _DEGREES + 1) + 2 * ORDER) % (4 * ORDER) - 2 * ORDER)
_COSINES = np.cos(np.pi / (2 * ORDER) * np.minimum(_FOLDED, 2 * ORDER - _FOLDED)) * np.where(_FOLDED > ORDER, -1.0, 1.0)
_PLACES = _COSINES[1]
_COEFFICIENTS = np.where(_DEGREES == 0, 1.0, 2.0)[:, None] / ORDER * _COSINES
# From Chebyshev coefficients to those of powers, which are no larger than the values if the former have died away.
_POWERS = np.zeros((ORDER, ORDER))
for _degree in _DEGREES.tolist():
    _POWERS[_degree, : _degree + 1] = np.polynomial.chebyshev.cheb2poly(np.eye(ORDER)[_degree, : _degree + 1])


@dataclass(frozen=True)
class Panels:
    """A map's polynomials on n panels: x, y, their derivatives, and the errors of these."""

    projection: Projection
    corner: tuple[float, float]  # south-west, of a graticule
    index: IntArray  # (rows, columns), the panel of each of its cells, -1 for none
    centre: FloatArray  # (n, 2), degrees east and north
    half: FloatArray  # (n, 2), degrees
    kept: IntArray  # (n, 2), how many powers of the longitude and of the latitude
    powers: FloatArray  # (n, 6, p, p): of x, y, their derivatives by the longitude and by the latitude, per radian
    left_out: FloatArray  # (n, 2), effect of the powers left out on either derivative, in m per radian
    size: FloatArray  # (n,), of x and y

    def at(self, lon: FloatArray, lat: FloatArray) -> NDArray[np.uint16]:
        """The number of the panel of each point (m,), counted from 1; 0 for none."""
        number = np.pad(self.index + 1, ((0, 1), (0, 1))).astype(np.uint16)
        found = np.empty(lon.size, dtype=np.uint16)
        for part in parts_of(lon.size):
            rows, columns = _cells_of(lon[part], lat[part], self.corner, self.index.shape)
            found[part] = number[rows, columns]
        return found


def parts_of(count: int) -> Iterator[slice]:
    """Parts of so many points, at least one part, whose arrays stay in the cache."""
    return (slice(start, start + _TOGETHER) for start in range(0, max(count, 1), _TOGETHER))


def _cells_of(
    lon: FloatArray, lat: FloatArray, corner: tuple[float, float], shape: tuple[int, ...]
) -> tuple[IntArray, IntArray]:
    """Rows and columns (m,) of points in the graticule of the smallest panels, one too many for points outside."""
    rows = np.floor((np.minimum(lat, _NORTH) - corner[1]) * (1.0 / _CELL_HEIGHT))
    columns = np.floor((lon - corner[0]) * (1.0 / _CELL_WIDTH))
    outside = ~((np.abs(lat) <= 90.0) & (rows >= 0) & (rows < shape[0]) & (columns >= 0) & (columns < shape[1]))
    if outside.any():
        rows[outside], columns[outside] = shape
    return rows.astype(np.int32), columns.astype(np.int32)


def panels_for(projection: Projection, lon: FloatArray, lat: FloatArray) -> Panels | None:
    """Polynomials where points (m,) are dense enough for them to pay; None if they are so nowhere."""
    west, south, east, north = (float(bound.reduce(values)) for bound in (np.fmin, np.fmax) for values in (lon, lat))
    corner, shape = _graticule(west, south, east, north)
    if shape[1] > _MOST_COLUMNS:
        return None
    counts = np.zeros((shape[0] + 1) * (shape[1] + 1), dtype=np.int64)
    for part in parts_of(lon.size):
        rows, columns = _cells_of(lon[part], lat[part], corner, shape)
        counts += np.bincount(rows * np.int32(shape[1] + 1) + columns, minlength=counts.size)
    return _resolving_panels(projection, (west, south, east, north), corner, counts.reshape(shape[0] + 1, -1)[:-1, :-1])


def _graticule(west: float, south: float, east: float, north: float) -> tuple[tuple[float, float], tuple[int, int]]:
    """The south-west corner of the panels that cover a box, and their numbers of rows and columns of cells."""
    width, height = _COLUMNS * _CELL_WIDTH, _ROWS * _CELL_HEIGHT
    left, right = (int((lon - _WEST) // width) for lon in (west, east))
    low, high = (int((min(max(lat, -90.0), _NORTH) - _SOUTH) // height) for lat in (south, north))
    corner = _WEST + left * width, _SOUTH + low * height
    return corner, ((high - low + 1) * _ROWS, (right - left + 1) * _COLUMNS)


# Into how many parts so many cells are cut: a third of all longitudes is hardly ever resolved.
_PARTS = np.array([9 if cells == _COLUMNS else 3 if cells % 3 == 0 else 2 for cells in range(_COLUMNS + 1)])


class _Tiles(NamedTuple):
    """Rectangles of cells: their first rows and columns, and their numbers of rows and columns, each (n,)."""

    row: IntArray
    column: IntArray
    rows: IntArray
    columns: IntArray

    @staticmethod
    def covering(counts: IntArray) -> _Tiles:
        """The largest panels, each shrunk as far as the points in its cells allow."""
        tiles = []
        for row in range(0, counts.shape[0], _ROWS):
            for column in range(0, counts.shape[1], _COLUMNS):
                held = counts[row : row + _ROWS, column : column + _COLUMNS]
                low, rows = _shrunk(np.flatnonzero(held.any(axis=1)), _ROWS)
                left, columns = _shrunk(np.flatnonzero(held.any(axis=0)), _COLUMNS)
                tiles.append((row + low, column + left, rows, columns))
        return _Tiles(*np.array(tiles).T)

    def take(self, keep: BoolArray | IntArray) -> _Tiles:
        """Some of them."""
        return _Tiles(*(values[keep] for values in self))

    def cut(self, by_row: BoolArray, by_column: BoolArray) -> _Tiles:
        """The parts of the tiles that are to be cut, and can be; the others are left out."""
        by_row, by_column = by_row & (self.rows > 1), by_column & (self.columns > 1)
        some = by_row | by_column
        tiles = self.take(some)
        ups, rights = np.where(by_row[some], _PARTS[tiles.rows], 1), np.where(by_column[some], _PARTS[tiles.columns], 1)
        number = ups * rights
        each = np.repeat(np.arange(number.size), number)
        place = np.arange(each.size) - np.repeat(np.cumsum(number) - number, number)
        up, right = place // rights[each], place % rights[each]
        rows, columns = (tiles.rows // ups)[each], (tiles.columns // rights)[each]
        return _Tiles(tiles.row[each] + up * rows, tiles.column[each] + right * columns, rows, columns)

    def sums(self, below: IntArray) -> IntArray:
        """The points in each rectangle, from the sums over all cells to the south and west."""
        top, right = self.row + self.rows, self.column + self.columns
        return below[top, right] - below[self.row, right] - below[top, self.column] + below[self.row, self.column]


def _shrunk(held: IntArray, cells: int) -> tuple[int, int]:
    """The first cell, and the number of cells, of the smallest part of a panel that has all cells with points."""
    first = 0
    while held.size and cells > 1:
        part = cells // int(_PARTS[cells])
        place = (held[0] - first) // part
        if (held[-1] - first) // part != place:
            break
        first, cells = first + int(place) * part, part
    return first, cells


def _resolving_panels(
    projection: Projection, box: tuple[float, float, float, float], corner: tuple[float, float], counts: IntArray
) -> Panels | None:
    """Panels where cells hold enough points, cut until they resolve the map or have too few; those with most first."""
    # A fifth of an evaluation a point may be spent in vain, and each point with a polynomial pays for one more.
    below = np.pad(counts.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    allowed = _SPARE * below[-1, -1]
    tiles, number = _Tiles.covering(counts), 0
    if _AHEAD * tiles.row.size * _NODES > allowed:
        return None
    index: IntArray = np.full(counts.shape, -1)
    found: list[tuple[AnyArray, ...]] = []
    while True:
        points = tiles.sums(below)
        chosen = np.argsort(-points, kind="stable")[: int(allowed // _NODES)]
        chosen = chosen[points[chosen] >= _FEWEST]
        if not chosen.size:
            break
        waiting, tiles = tiles.take(np.delete(np.arange(points.size), chosen)), tiles.take(chosen)
        low = np.stack([corner[0] + tiles.column * _CELL_WIDTH, corner[1] + tiles.row * _CELL_HEIGHT], axis=1)
        high = low + np.stack([tiles.columns * _CELL_WIDTH, tiles.rows * _CELL_HEIGHT], axis=1)
        if not projection.answers_everywhere:  # panels of functions do not reach beyond the points
            low, high = np.maximum(low, box[:2]), np.minimum(high, box[2:])
        centre, half = 0.5 * (low + high), 0.5 * (high - low)
        coefficients, size = _sampled(projection, centre, half)
        kept, left_out = _chopped(coefficients, size, centre, half)
        resolved = (kept <= ORDER - 2) & (half.min(axis=1) >= 0.5 * _NARROWEST)[:, None]
        good = resolved.all(axis=1)
        for row, column, rows, columns in zip(*(values.tolist() for values in tiles.take(good)), strict=True):
            index[row : row + rows, column : column + columns] = number
            number += 1
        allowed += points[chosen[good]].sum() - chosen.size * _NODES
        powers = _powers(coefficients[good], kept[good], half[good])
        found.append((centre[good], half[good], kept[good], powers, left_out[good], size[good]))
        parts = tiles.take(~good).cut(~resolved[~good, 1], ~resolved[~good, 0])
        tiles = _Tiles(*(np.concatenate(pair) for pair in zip(waiting, parts, strict=True)))
    if not number:
        return None
    return Panels(projection, corner, index, *(np.concatenate(each) for each in zip(*found, strict=True)))


def _sampled(projection: Projection, centre: FloatArray, half: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Chebyshev coefficients (n, 2, p, p) of x and y on panels, first along the longitude; and their size (n,)."""
    lon, lat = (centre[:, k, None] + half[:, k, None] * _PLACES for k in (0, 1))
    lon, lat = np.repeat(lon, ORDER, axis=1), np.tile(lat, ORDER)
    # A node may lie where the map is not defined, though no point does.
    with np.errstate(all="ignore"):
        values = np.stack(projection(lon, lat), axis=1).reshape(-1, 2, ORDER, ORDER)
        size = np.abs(values).max(axis=(1, 2, 3))
        # Less a constant, there is less to round.
        constant = values[:, :, ORDER // 2, ORDER // 2].copy()
        coefficients = _COEFFICIENTS @ (values - constant[:, :, None, None]) @ _COEFFICIENTS.T
    coefficients[:, :, 0, 0] += constant
    return coefficients, size


def _chopped(
    coefficients: FloatArray, size: FloatArray, centre: FloatArray, half: FloatArray
) -> tuple[IntArray, FloatArray]:
    """How many coefficients (n, 2) are needed along either axis, and the effect of the others (n, 2), m per radian."""
    with np.errstate(invalid="ignore"):  # where the map is not defined all are needed
        c = np.abs(coefficients)
        c = np.sqrt((np.where(c <= _FLOOR * size[:, None, None, None], 0.0, c) ** 2).sum(axis=1))
        east, north = np.radians(half).T[:, :, None, None]
        cos = np.cos(np.radians(centre[:, 1]))
        # The derivative of a Chebyshev polynomial of degree j is j^2 at most.
        by_lon, by_lat = c * _DEGREES[:, None] ** 2 / east, c * _DEGREES**2 / north
        harm = (by_lon / cos[:, None, None]) ** 2 + by_lat**2
        scale = by_lon[:, 1, 0] / cos + by_lat[:, 0, 1]
        allowed = 0.5 * (_TRUNCATION * scale) ** 2
        beyond = [np.cumsum(harm.sum(axis=axis)[:, ::-1], axis=1)[:, ::-1] for axis in (2, 1)]
        kept = np.stack([(~(one <= allowed[:, None])).sum(axis=1) for one in beyond], axis=1)
        kept = np.maximum(kept, 1)
        dropped = (_DEGREES[:, None] >= kept[:, 0, None, None]) | (kept[:, 1, None, None] <= _DEGREES)
        left_out = [np.sqrt(((one * dropped) ** 2).sum(axis=(1, 2))) for one in (by_lon, by_lat)]
    return kept, np.stack(left_out, axis=1)


def _powers(coefficients: FloatArray, kept: IntArray, half: FloatArray) -> FloatArray:
    """Coefficients (n, 6, p, p) of powers: of x and y, of their derivatives by the longitude, and by the latitude."""
    needed = (_DEGREES[:, None] < kept[:, 0, None, None]) & (kept[:, 1, None, None] > _DEGREES)
    values = _POWERS.T @ np.where(needed[:, None], coefficients, 0.0) @ _POWERS
    powers = np.zeros((len(values), 6, ORDER, ORDER))
    powers[:, :2] = values
    east, north = np.radians(half).T[:, :, None, None, None]
    powers[:, 2:4, :-1] = values[:, :, 1:] * _DEGREES[1:, None] / east
    powers[:, 4:, :, :-1] = values[..., 1:] * _DEGREES[1:] / north
    return powers


# ---- many points on panels -----------------------------------------------------------------------

_EPS = np.finfo(float).eps
_DISAGREEMENT = 32.0  # roundings of x or y; PROJ's own arithmetic has ten
_MARGIN = 1e-6  # of a panel's half; points nearer to its edge may lie on a break
_CHUNK = 1536  # points at a time whose products stay in the cache
_MOST = 3 * _TOGETHER // 2


class _Scratch:
    """Memory that is used again and again: to allocate arrays costs more than to compute what is in them."""

    def __init__(self) -> None:
        sizes = np.cumsum(
            [ORDER * _CHUNK, ORDER * _CHUNK, 6 * ORDER * _CHUNK, 2 * _MOST, 6 * _MOST, 2 * _MOST, 4 * _MOST]
        )
        whole = np.empty(sizes[-1])
        self.east, self.north, self.products, self.places, self.out, self.known, self.rows = np.split(whole, sizes[:-1])
        self.beside = np.empty(_MOST, dtype=bool)

    @staticmethod
    def of(array: FloatArray, rows: int, columns: int) -> FloatArray:
        """A part of one array, with at least two rows."""
        rows = max(rows, 2)
        return array[: rows * columns].reshape(rows, columns)


def _evaluate_panel(
    panels: Panels, panel: int, places: FloatArray, out: FloatArray, beside: BoolArray, scratch: _Scratch
) -> None:
    """x, y and their derivatives by radians at places (2, m) in one panel, written into `out` (6, m)."""
    p, q = panels.kept[panel].tolist()
    rows = np.ascontiguousarray(panels.powers[panel, :, :p, :q]).reshape(6 * p, q)
    (lon_0, lat_0), (east, north) = panels.centre[panel].tolist(), panels.half[panel].tolist()
    for start in range(0, places.shape[1], _CHUNK):
        part = slice(start, start + _CHUNK)
        lon, lat = places[:, part]
        r, s = scratch.of(scratch.east, p, lon.size), scratch.of(scratch.north, q, lon.size)
        np.multiply(np.subtract(lon, lon_0, out=r[1]), 1.0 / east, out=r[1])
        np.multiply(np.subtract(lat, lat_0, out=s[1]), 1.0 / north, out=s[1])
        np.maximum(np.abs(r[1], out=r[0]), np.abs(s[1], out=s[0]), out=r[0])
        np.greater(r[0], 1.0 - _MARGIN, out=beside[part])
        for t in (r, s):  # the powers of t[1], from 1
            t[0] = 1.0
            done = 2
            while done < len(t):
                more = min(done - 1, len(t) - done)
                np.multiply(t[1 : more + 1], t[done - 1], out=t[done : done + more])
                done += more
        products = np.matmul(rows, s[:q], out=scratch.of(scratch.products, 6 * p, lon.size))
        np.einsum("kpm,pm->km", products.reshape(6, p, lon.size), r[:p], out=out[:, part])


def evaluate_points(
    panels: Panels,
    lon: FloatArray,
    lat: FloatArray,
    xy: tuple[FloatArray, FloatArray],
    J: FloatArray,
    error: FloatArray,
) -> tuple[BoolArray, NDArray[np.uint16], IntArray]:
    """J (m, 2, 2) and its relative error, written where points (m,) lie in panels that have the map's own x and y."""
    # The root mean square by which x and y differ from the polynomial in a panel counts as an error of J: by Markov's
    # inequality the derivative of a polynomial of p coefficients that is below d on [-1, 1] is below p^2 d. Panels that
    # differ by more than the map's own rounding anywhere are not used. Returned are a mask of points with a J, each
    # point's panel, 0 for none, and some points of each panel.
    number = panels.at(lon, lat)
    found, good = np.zeros(lon.size, dtype=bool), np.ones(len(panels.centre) + 1, dtype=bool)
    order = np.argsort(number, kind="stable")
    counts = np.bincount(number, minlength=good.size)
    given = np.stack([lon, lat, *xy], axis=1)  # the numbers of a point are contiguous
    scratch = _Scratch()
    for pieces in _groups(counts):
        index = order[pieces[0][1] : pieces[-1][2]]
        good[[piece[0] for piece in pieces]] &= _evaluate_group(panels, pieces, index, given, J, error, found, scratch)
    if not good.all():
        found &= good[number]
    ends = np.cumsum(counts)
    held = np.flatnonzero(counts[1:]) + 1
    first, last = ends[held - 1], ends[held] - 1
    return found, number, order[np.concatenate([first, (first + last) // 2, last])]


def _evaluate_group(
    panels: Panels,
    pieces: list[tuple[int, int, int]],
    index: IntArray,
    given: FloatArray,
    J: FloatArray,
    error: FloatArray,
    found: BoolArray,
    scratch: _Scratch,
) -> BoolArray:
    """J and its error at the points of pieces of panels, which have an index; True for pieces with x and y as given."""
    m, first = index.size, pieces[0][1]
    there, begins, sizes = np.array([(number - 1, begin - first, end - begin) for number, begin, end in pieces]).T
    beside, arrays = scratch.beside[:m], ((scratch.places, 2), (scratch.out, 6), (scratch.known, 2))
    places, out, known = (scratch.of(array, rows, m) for array, rows in arrays)
    rows = np.take(given, index, axis=0, out=scratch.rows[: 4 * m].reshape(m, 4), mode="clip")
    places[:] = rows[:, :2].T
    for k, begin, end in pieces:
        part = slice(begin - first, end - first)
        _evaluate_panel(panels, k - 1, places[:, part], out[:, part], beside[part], scratch)
    np.subtract(rows[:, 2:].T, out[:2], out=known)
    gap = np.abs(known, out=known).max(axis=0, out=known[0])
    rounding = 0.5 * _EPS * panels.size[there]
    good = np.asarray(np.maximum.reduceat(gap, begins) <= _DISAGREEMENT * rounding)
    gap *= gap
    off = np.maximum(np.sqrt(np.add.reduceat(gap, begins) / sizes), rounding)
    doubt = panels.left_out[there] + panels.kept[there] ** 2 * off[:, None] / np.radians(panels.half[there])
    error[index] = _scaled(panels.projection, places, out[2:], doubt, sizes)
    for values, (i, j) in zip(out[2:], ((0, 0), (1, 0), (0, 1), (1, 1)), strict=True):
        J[:, i, j][index] = values
    found[index] = ~beside
    return good


def _scaled(
    projection: Projection, places: FloatArray, derivatives: FloatArray, doubt: FloatArray, sizes: IntArray
) -> FloatArray:
    """Scale derivatives (4, m) to metres; their relative errors (m,), from doubts (n, 2) of panels of such sizes."""
    cos = np.cos(np.radians(places[1], out=places[0]), out=places[0])  # nobody needs the places any more
    inverse = 1.0 / cos
    # Radians per metre along the parallel and the meridian (Snyder 1987, 4-18 and 4-20).
    a, e2 = projection.ellipsoid.a, projection.ellipsoid.eccentricity_squared
    if e2 == 0.0:
        east, north = inverse * (1.0 / a), 1.0 / a
    else:
        w2 = 1.0 - e2 * (1.0 - cos * cos)
        w = np.sqrt(w2) * (1.0 / a)
        east, north = w * inverse, w * w2 * (1.0 / (1.0 - e2))
    derivatives[:2] *= east
    derivatives[2:] *= north
    total = np.abs(derivatives[0])
    for one in derivatives[1:]:
        total += np.abs(one, out=places[1])
    east *= np.repeat(doubt[:, 0], sizes)
    east += north * np.repeat(doubt[:, 1], sizes)
    with np.errstate(invalid="ignore", divide="ignore"):  # no map has derivatives of 0
        east /= total
    inverse *= _EPS
    east += inverse
    return east


def _groups(counts: IntArray) -> Iterator[list[tuple[int, int, int]]]:
    """Groups of pieces of panels to evaluate together: a panel's number, and the range of its points in order."""
    group: list[tuple[int, int, int]] = []
    done = int(counts[0])  # points without a panel, number 0, come first
    for number in (np.flatnonzero(counts[1:]) + 1).tolist():
        end = done + int(counts[number])
        while done < end:
            if group and done - group[0][1] >= _TOGETHER // 2:
                yield group
                group = []
            stop = min(end, done + _TOGETHER)
            group.append((number, done, stop))
            done = stop
    if group:
        yield group
