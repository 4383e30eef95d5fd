"""Cuts of the globe from a point to its antipode, and splines on the sheet that unrolls along a cut.

In the frame of a cut its first point is the south pole and its last the north pole; between them it may bend.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.designs.newton import Elements
from projdist.earth import wrapped
from projdist.support import check_degrees, check_number

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

_APART = 1e-6  # degrees between points of a cut, at least

CutLike = float | Sequence[Sequence[float]]


@dataclass(frozen=True)
class ObliqueFrame:
    """Longitudes and latitudes about other poles, by the formulas and the parameters of PROJ's ob_tran."""

    lon_0: float
    lat_p: float  # latitude of the frame's north pole, on the meridian opposite to `lon_0`
    lon_p: float  # added to the frame's longitudes

    def of(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitudes and latitudes in the frame, in degrees."""
        return self._tilted(lon - self.lon_0, lat, 1.0, self.lon_p)

    def back(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitudes and latitudes of points in the frame."""
        return self._tilted(lon - self.lon_p, lat, -1.0, self.lon_0)

    def _tilted(self, lon: FloatArray, lat: FloatArray, way: float, shift: float) -> tuple[FloatArray, FloatArray]:
        """Longitudes plus a shift, and latitudes, about poles tilted one way (1) or the other (-1)."""
        lam, phi, tilt = np.radians(lon), np.radians(lat), np.radians(self.lat_p)
        sin, cos, ahead = np.sin(tilt), way * np.cos(tilt), np.cos(phi) * np.cos(lam)
        x, y, z = sin * ahead + cos * np.sin(phi), np.cos(phi) * np.sin(lam), sin * np.sin(phi) - cos * ahead
        return wrapped(np.degrees(np.arctan2(y, x)) + shift), np.degrees(np.arctan2(z, np.hypot(x, y)))

    @property
    def step(self) -> str:
        """PROJ's operation, radians to radians."""
        return (
            f"+proj=ob_tran +o_proj=longlat +o_lat_p={self.lat_p!r} +o_lon_p={self.lon_p!r} +lon_0={self.lon_0!r} +R=1"
        )


@dataclass(frozen=True)
class Cut:
    """A cut through points (m, 2) of ascending latitude in a frame, by default the globe's own.

    Between its points it is a cubic spline of the latitude, along a meridian at either end.
    """

    name: str
    frame: ObliqueFrame | None
    points: tuple[tuple[float, float], ...]

    @property
    def is_straight(self) -> bool:
        """True for half a great circle."""
        return len(self.points) == 1

    def at(self, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The cut's longitude in degrees at latitudes of the frame, and its derivative by the latitude."""
        if self.is_straight:
            return np.full(np.shape(lat), self.points[0][0]), np.zeros(np.shape(lat))
        return np.asarray(self._curve(lat)), np.asarray(self._curve(lat, 1))

    @functools.cached_property
    def _curve(self) -> CubicSpline:
        from scipy.interpolate import CubicSpline  # slow to load

        lon, lat = np.array(self.points).T
        return CubicSpline(np.r_[-90.0, lat, 90.0], np.r_[lon[0], lon, lon[-1]], bc_type="clamped")

    def unrolled(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitudes from the middle of the sheet, within -pi and pi, and latitudes of the frame, in radians."""
        if self.frame is not None:
            lon, lat = self.frame.of(lon, lat)
        return np.radians(wrapped(lon - (self.at(lat)[0] - 180.0))), np.radians(lat)

    def rolled(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitudes and latitudes in degrees of points of the sheet."""
        lat = np.degrees(v)
        lon = wrapped(np.degrees(u) + self.at(lat)[0] - 180.0)
        return (lon, lat) if self.frame is None else self.frame.back(lon, lat)


def get_cut(given: CutLike) -> Cut:
    """The cut along a meridian, or from the first of some points through the others to its antipode; ValueError."""
    if isinstance(given, Cut):
        return given
    if isinstance(given, str) or not isinstance(given, Iterable):
        meridian = check_number("cut", given)
        if not abs(meridian) <= 360.0:
            raise ValueError(f"Invalid cut '{given}'. Its longitude must be within -360 and 360.")
        return Cut(f"{meridian:g}", None, ((meridian, 0.0),))
    try:
        points = np.array(list(given), dtype=float)
    except (TypeError, ValueError) as error:
        raise ValueError("Invalid cut. Its points must be pairs of a longitude and a latitude.") from error
    if points.ndim != 2 or points.shape[0] < 2 or points.shape[1] != 2:
        raise ValueError("Invalid cut. It must be a longitude, or two or more points, each a longitude and a latitude.")
    lon, lat = check_degrees(points[:, 0], points[:, 1])
    if not (np.all(np.abs(lon) <= 360.0) and np.all(np.abs(lat) <= 90.0)):
        raise ValueError("Invalid cut. Latitudes must be within -90 and 90, longitudes within -360 and 360.")
    name = " ".join(f"{x:g},{y:g}" for x, y in points)
    frame = ObliqueFrame(float(lon[0]), -float(lat[0]), 0.0)  # the antipode of the first point is its north pole
    own_lon, own_lat = frame.of(lon[1:], lat[1:])
    if not np.all(np.diff(np.r_[-90.0, own_lat, 90.0]) > _APART):
        raise ValueError(f"Invalid cut '{name}'. Each of its points must be farther from the first than those before.")
    frame = ObliqueFrame(frame.lon_0, frame.lat_p, float(180.0 - own_lon[0]))
    own_lon = np.unwrap(np.r_[180.0, wrapped(own_lon[1:] + frame.lon_p)], period=360.0)
    return Cut(name, frame, tuple(zip(own_lon.tolist(), own_lat.tolist(), strict=True)))


# ---- spline sheets -------------------------------------------------------------------------------

_POLE = 0.5 * np.pi
_ROUNDING = 1e-12  # radians


@dataclass(frozen=True, eq=False)
class Splines:
    """B-splines of a degree on an interval that is cut at `breaks` (s + 1,); there are s + degree of them."""

    breaks: FloatArray
    degree: int

    @property
    def count(self) -> int:
        """The number of splines."""
        return len(self.breaks) - 1 + self.degree

    @property
    def knots(self) -> FloatArray:
        """The breaks, with repeated ends."""
        return np.r_[[self.breaks[0]] * self.degree, self.breaks, [self.breaks[-1]] * self.degree]

    @property
    def middles(self) -> FloatArray:
        """Greville's abscissae (count,), near which each spline is largest."""
        knots = self.knots
        return np.array([knots[k + 1 : k + 1 + self.degree].mean() for k in range(self.count)])

    def at(self, t: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """The first spline that is not zero at t (n,), and values and slopes (n, degree + 1) from it on."""
        from scipy.interpolate import BSpline  # slow to load

        knots, d = self.knots, self.degree
        span = np.clip(np.searchsorted(self.breaks, t, side="right") - 1, 0, len(self.breaks) - 2)
        values, lower = (BSpline.design_matrix(t, knots[d - k : len(knots) - d + k], k).data for k in (d, d - 1))
        ends = span[:, None] + np.arange(1, d + 1)
        rates = d * (lower.reshape(-1, d) / (knots[ends + d] - knots[ends]))
        slopes = np.pad(rates, ((0, 0), (1, 0))) - np.pad(rates, ((0, 0), (0, 1)))
        return span, values.reshape(-1, d + 1), slopes

    def interpolation(self) -> FloatArray:
        """The matrix (count, count) of the splines' values at the middles."""
        from scipy.interpolate import BSpline

        return BSpline.design_matrix(self.middles, self.knots, self.degree).toarray()


@dataclass(frozen=True, eq=False)
class SplineMap:
    """A map of the world from degrees to the unit of the coefficients (2, of v, of u); NaN beyond the breaks of v."""

    cut: Cut
    u: Splines
    v: Splines
    coefficients: FloatArray

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x and y of any shape, NaN beyond the sheet."""
        u, v = self.cut.unrolled(np.asarray(lon, dtype=float), np.asarray(lat, dtype=float))
        end = self.v.breaks[-1]
        shown = np.isfinite(u) & (np.abs(v) <= end + _ROUNDING)
        x, y = (np.full(np.shape(u), np.nan) for _ in range(2))
        if shown.any():
            x[shown], y[shown] = self.on_sheet(u[shown], np.clip(v[shown], -end, end))
        return x, y

    def on_sheet(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x and y (n,) at the coordinates of the sheet, radians (n,)."""
        (i, of_u, _), (j, of_v, _) = self.u.at(u), self.v.at(v)
        rows, columns = j[:, None] + np.arange(self.v.degree + 1), i[:, None] + np.arange(self.u.degree + 1)
        near = self.coefficients[:, rows[:, :, None], columns[:, None, :]]
        x, y = np.einsum("rnji,nj,ni->rn", near, of_v, of_u, optimize=True)
        return x, y

    def moved(self, similarity: complex, shift: complex) -> SplineMap:
        """The map followed by a rotation and scaling, and a shift of x + i y."""
        z = similarity * (self.coefficients[0] + 1j * self.coefficients[1]) + shift
        return replace(self, coefficients=np.stack([z.real, z.imag]))


@dataclass(frozen=True, eq=False)
class SplineSheet:
    """Splines of the sheet and its symmetry: `across` about the middle meridian, `along` about the equator."""

    cut: Cut
    u: Splines
    v: Splines
    across: bool
    along: bool

    def nodes(self, points: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Gauss nodes u, v of all elements, and the areas, each (spans of v, spans of u, points v, points u)."""
        u, of_u = _gauss(self.u.breaks, points)
        v, of_v = _gauss(self.v.breaks, points)
        area = (np.cos(v) * of_v)[:, None, :, None] * of_u[None, :, None, :]
        u, v = np.broadcast_arrays(u[None, :, None, :], v[:, None, :, None])
        return u, v, area

    def elements(self, weights: FloatArray) -> Elements:
        """The elements with weights of all nodes, folded by symmetry onto a half or a quarter of the sheet."""
        points = weights.shape[-1]
        if self.across:
            weights = (weights + weights[:, ::-1, :, ::-1])[:, weights.shape[1] // 2 :]
        if self.along:
            weights = (weights + weights[::-1, :, ::-1])[weights.shape[0] // 2 :]
        rows, columns = len(self.v.breaks) - 1, len(self.u.breaks) - 1
        row, column = (a.ravel() for a in np.meshgrid(*(np.arange(n) for n in (rows, columns)), indexing="ij"))
        kept = ((column >= columns // 2) | (not self.across)) & ((row >= rows // 2) | (not self.along))
        row, column = row[kept], column[kept]
        numbers, signs, count = self._numbering()
        j = row[:, None] + np.arange(self.v.degree + 1)
        i = column[:, None] + np.arange(self.u.degree + 1)
        e, a = len(row), j.shape[1] * i.shape[1]
        local = (slice(None), j[:, :, None], i[:, None, :])
        return Elements(
            numbers[local].reshape(2, e, a),
            signs[local].reshape(2, e, a),
            self._gradients(row, column, points),
            (weights / weights.sum()).reshape(e, points * points),
            count,
        )

    def _gradients(self, row: IntArray, column: IntArray, points: int) -> FloatArray:
        """Derivatives of products of splines by east and north on the unit sphere, (e, points^2, products, 2)."""
        u, v = _gauss(self.u.breaks, points)[0], _gauss(self.v.breaks, points)[0]
        _, U, by_u = (part.reshape(*u.shape, -1)[column] if part.ndim > 1 else part for part in self.u.at(u.ravel()))
        _, V, by_v = (part.reshape(*v.shape, -1)[row] if part.ndim > 1 else part for part in self.v.at(v.ravel()))
        across = np.einsum("epj,eqi->epqji", V, by_u)
        northward = np.einsum("epj,eqi->epqji", by_v, U)
        phi = v[row][:, :, None, None, None]
        _, drift = self.cut.at(np.degrees(phi))
        both = np.stack([across / np.cos(phi), northward - drift * across], axis=-1)
        return both.reshape(len(row), points * points, -1, 2)

    def _numbering(self) -> tuple[IntArray, FloatArray, int]:
        """The unknown of each coefficient (2, of v, of u), -1 for none, its sign, and the number of unknowns."""
        j, i = np.indices((self.v.count, self.u.count))
        has_poles = bool(self.v.breaks[-1] > _POLE - 1e-9)
        places, signs, zero = [], [], []
        for across_sign, along_sign in ((-1.0, 1.0), (1.0, -1.0)):
            place, sign, none = j * self.u.count + i, np.ones(j.shape), np.zeros(j.shape, dtype=bool)
            if has_poles:
                place = np.where((j == 0) | (j == self.v.count - 1), j * self.u.count, place)
                none |= self.across & ((j == 0) | (j == self.v.count - 1)) & (across_sign < 0.0)
            if self.across:
                mirrored = place[:, ::-1] < place
                sign = np.where(mirrored, across_sign * sign, sign)
                none |= (i == self.u.count - 1 - i) & (across_sign < 0.0)
                place = np.minimum(place, place[:, ::-1])
            if self.along:
                mirrored = j > self.v.count - 1 - j
                sign = np.where(mirrored, along_sign * sign[::-1], sign)
                none |= (j == self.v.count - 1 - j) & (along_sign < 0.0)
                place = np.where(mirrored, place[::-1], place)
            places.append(place)
            signs.append(sign)
            zero.append(none)
        # The map shall neither shift nor rotate.
        middle = slice(None) if has_poles else slice(self.u.count // 2, self.u.count // 2 + 1)
        if not self.across:
            zero[0][0, middle] = zero[0][-1, middle] = True
        if not self.along:
            zero[1][0, middle] = True
        numbers = 2 * np.stack(places) + np.arange(2)[:, None, None]
        numbers[np.stack(zero)] = -1
        used = np.unique(numbers[numbers >= 0])
        return np.where(numbers >= 0, np.searchsorted(used, numbers), -1), np.stack(signs), len(used)

    def map(self, unknowns: FloatArray) -> SplineMap:
        """The map with given unknowns."""
        numbers, signs, _ = self._numbering()
        return SplineMap(self.cut, self.u, self.v, signs * np.append(unknowns, 0.0)[numbers])

    def interpolated(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """The unknowns of the map with given values (of v, of u) at the middles of the splines."""
        of_u, of_v = self.u.interpolation(), self.v.interpolation()
        coefficients = np.stack([np.linalg.solve(of_v, np.linalg.solve(of_u, z.T).T) for z in (x, y)])
        if not self.across:
            coefficients[0] -= coefficients[0, 0, self.u.count // 2]
        if not self.along:
            coefficients[1] -= coefficients[1, 0, self.u.count // 2]
        numbers, signs, count = self._numbering()
        kept = numbers >= 0
        times = np.bincount(numbers[kept], minlength=count)
        return np.bincount(numbers[kept], (signs * coefficients)[kept], count) / times


def _gauss(breaks: FloatArray, points: int) -> tuple[FloatArray, FloatArray]:
    """Gauss nodes and weights (spans, points) between breaks."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    middle, half = 0.5 * (breaks[1:] + breaks[:-1])[:, None], 0.5 * np.diff(breaks)[:, None]
    return middle + half * nodes, half * weights
