"""J of many points from a map's polynomials on panels, by matrix products of all points of a panel.

Each point's own x and y are compared with those of the polynomial.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.field.chebyshev_panels import ORDER, Panels
from projdist.projections import Projection

_EPS = np.finfo(float).eps
_DISAGREEMENT = 32.0  # roundings of x or y; PROJ's own arithmetic has ten
_MARGIN = 1e-6  # of a panel's half; what is nearer to its edge may be on a break
_CHUNK = 1536  # points at a time whose products stay in the cache
_TOGETHER = 8192
_MOST = 3 * _TOGETHER // 2


class _Scratch:
    """Arrays that are used again and again: new ones cost more than what is computed in them."""

    def __init__(self) -> None:
        sizes = np.cumsum(
            [ORDER * _CHUNK, ORDER * _CHUNK, 6 * ORDER * _CHUNK, 2 * _MOST, 6 * _MOST, 2 * _MOST, 4 * _MOST]
        )
        whole = np.empty(sizes[-1])
        self.east, self.north, self.products, self.places, self.out, self.known, self.rows = np.split(whole, sizes[:-1])
        self.beside = np.empty(_MOST, dtype=bool)

    @staticmethod
    def of(array: FloatArray, rows: int, columns: int) -> FloatArray:
        """A part of one of them, with two rows at least."""
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
        _fill_powers(r)
        _fill_powers(s)
        products = np.matmul(rows, s[:q], out=scratch.of(scratch.products, 6 * p, lon.size))
        np.einsum("kpm,pm->km", products.reshape(6, p, lon.size), r[:p], out=out[:, part])


def _fill_powers(t: FloatArray) -> None:
    """The powers (p, m) of t[1], from 1."""
    t[0] = 1.0
    done = 2
    while done < len(t):
        more = min(done - 1, len(t) - done)
        np.multiply(t[1 : more + 1], t[done - 1], out=t[done : done + more])
        done += more


def evaluate_points(
    panels: Panels,
    lon: FloatArray,
    lat: FloatArray,
    xy: tuple[FloatArray, FloatArray],
    J: FloatArray,
    error: FloatArray,
) -> tuple[BoolArray, NDArray[np.uint16], IntArray]:
    """J (m, 2, 2) and its relative error, written where points (m,) lie in panels and have the map's own x and y.

    What these are off by in a panel, root mean square, counts as an error of J: by Markov's inequality the derivative
    of a polynomial of p coefficients that is below d on [-1, 1] is below p^2 d. Where they are off by more than the
    map's own rounding anywhere, the panel has no points. Returned are which points have a J, the number of the panel of
    each, 0 for none, and some points of every panel.
    """
    number = panels.at(lon, lat)
    found, good = np.zeros(lon.size, dtype=bool), np.ones(len(panels.centre) + 1, dtype=bool)
    order = np.argsort(number, kind="stable")
    counts = np.bincount(number, minlength=good.size)
    given = np.stack([lon, lat, *xy], axis=1)  # what is of one point lies together
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


def interpolate_points(
    panels: Panels,
    lon: FloatArray,
    lat: FloatArray,
    xy: tuple[FloatArray, FloatArray],
    J: FloatArray,
    error: FloatArray,
) -> BoolArray:
    """x, y, J (m, 2, 2) and its relative error, written where points (m,) lie in panels; and which these are."""
    number, found = panels.at(lon, lat), np.zeros(lon.size, dtype=bool)
    order = np.argsort(number, kind="stable")
    given, scratch = np.stack([lon, lat], axis=1), _Scratch()
    for pieces in _groups(np.bincount(number, minlength=len(panels.centre) + 1)):
        index = order[pieces[0][1] : pieces[-1][2]]
        _evaluate_group(panels, pieces, index, given, J, error, found, scratch)
        xy[0][index], xy[1][index] = scratch.of(scratch.out, 6, index.size)[:2]
    return found


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
    """J and its error for pieces of panels, whose points have an index; which pieces have x and y as given."""
    m, first = index.size, pieces[0][1]
    there, begins, sizes = np.array([(number - 1, begin - first, end - begin) for number, begin, end in pieces]).T
    places, out, known = (
        scratch.of(array, rows, m) for array, rows in ((scratch.places, 2), (scratch.out, 6), (scratch.known, 2))
    )
    beside = scratch.beside[:m]
    columns = given.shape[1]
    rows = np.take(given, index, axis=0, out=scratch.rows[: columns * m].reshape(m, columns), mode="clip")
    places[:] = rows[:, :2].T
    for k, begin, end in pieces:
        part = slice(begin - first, end - first)
        _evaluate_panel(panels, k - 1, places[:, part], out[:, part], beside[part], scratch)
    np.subtract(rows[:, 2:].T if columns == 4 else out[:2], out[:2], out=known)
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
    """Derivatives (4, m) by the longitude and the latitude, scaled to those by metres, and the error (m,) of all.

    That is made of the doubt of each panel (n, 2) in as many points as it has. The places are overwritten.
    """
    cos = np.cos(np.radians(places[1], out=places[0]), out=places[0])
    inverse = 1.0 / cos
    east, north = _radians_per_metre(projection, cos, inverse)
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
    """Pieces of panels that are evaluated together: the number, and the first and the end of its points in their order.

    Number 0 are points without a panel, which come first.
    """
    group: list[tuple[int, int, int]] = []
    done = int(counts[0])
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


def _radians_per_metre(
    projection: Projection, cos: FloatArray, inverse: FloatArray
) -> tuple[FloatArray, FloatArray | float]:
    """Along the parallel and the meridian at the latitude with this cosine and inverse (Snyder 1987, 4-18 and 4-20)."""
    a, e2 = projection.ellipsoid.a, projection.ellipsoid.eccentricity_squared
    if e2 == 0.0:
        return inverse * (1.0 / a), 1.0 / a
    w2 = 1.0 - e2 * (1.0 - cos * cos)
    w = np.sqrt(w2) * (1.0 / a)
    return w * inverse, w * w2 * (1.0 / (1.0 - e2))
