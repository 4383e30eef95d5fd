"""Stencils for hard points: ever smaller central ones, then one-sided ones.

Sixth-order differences along lines through the points, east, north and diagonal. Lower orders
from the same samples tell the error; the diagonal tells whether the derivative is linear at all.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import Ellipsoid
from projdist.projections import Projection

TARGET = 1e-12  # relative error at which a stencil is good enough
# Odd differences at a kink agree with each other. The fourth difference, over step times slope, is about 1 there,
# and at most 2e-4 on smooth maps.
KINK = 1e-3
_ROUGH = 1e-8
_TANGENT_LATITUDE = 89.99
_LINE_LATITUDE = 90.0 - 1e-4  # beyond, steps along the meridian are too short for the digits of a latitude

# Central weights of f(+j h) - f(-j h), j = 1.., for the first derivative times h, by order.
_CENTRAL = {
    2: np.array([1 / 2, 0.0, 0.0]),
    4: np.array([2 / 3, -1 / 12, 0.0]),
    6: np.array([3 / 4, -3 / 20, 1 / 60]),
}
_CENTRAL_STEPS = tuple(2e-3 / 4**k for k in range(8))
# Forward weights of f(0), f(h), .., f(6 h), for the first derivative times h, by order.
_FORWARD = {
    4: np.array([-25 / 12, 4.0, -3.0, 4 / 3, -1 / 4, 0.0, 0.0]),
    6: np.array([-49 / 20, 6.0, -15 / 2, 20 / 3, -15 / 4, 6 / 5, -1 / 6]),
}
_FORWARD_STEPS = (1.5e-3, 1.5e-4, 1.5e-5)


@dataclass(frozen=True)
class Settled:
    """Jacobians (n, 2, 2), their relative errors (infinite: none found), and which are one-sided."""

    jacobian: FloatArray
    error: FloatArray
    one_sided: BoolArray


def settle(points: Points, centre: FloatArray) -> Settled:
    """Jacobians at hard points, where the projection has the values `centre` (2, n)."""
    n = points.lon.size
    best = Settled(np.full((n, 2, 2), np.nan), np.full(n, np.inf), np.zeros(n, dtype=bool))
    _improve(best, np.arange(n), _central_levels(points, centre, _CENTRAL_STEPS))
    # Where central stencils lose digits to a seam near by, a one-sided one may keep them.
    poor = np.flatnonzero(~(best.error <= 10 * TARGET))
    if poor.size:
        _improve(best, poor, _one_sided_levels(points.take(poor), centre[:, poor]), one_sided=True)
    # Where neither does, a singularity may be nearer than the first steps were.
    lost = np.flatnonzero(~(best.error <= _ROUGH) & ~points.tangent)
    if lost.size:
        _improve(best, lost, _central_levels(points.take(lost), centre[:, lost], _CENTRAL_STEPS[4:], patient=True))
    # A pole that is drawn as a line is no point of the tangent plane like others.
    lined = np.flatnonzero(~(best.error <= 10 * TARGET) & points.tangent & (np.abs(points.lat) < _LINE_LATITUDE))
    if lined.size:
        _improve(best, lined, _central_levels(points.take(lined).graticule(), centre[:, lined], _CENTRAL_STEPS))
    return best


def _improve(best: Settled, index: IntArray, levels: Iterator[_Level], *, one_sided: bool = False) -> None:
    """Take over the Jacobians that are better; one-sided ones by a factor of ten."""
    found = _best_of(levels, index.size)
    better = found[1] < (0.1 if one_sided else 1.0) * best.error[index]
    chosen = index[better]
    best.jacobian[chosen], best.error[chosen], best.one_sided[chosen] = found[0][better], found[1][better], one_sided


@dataclass(frozen=True)
class Points:
    """Points of the ellipsoid, and f on lines through them: in the tangent plane for those of the mask `tangent`."""

    projection: Projection
    lon: FloatArray
    lat: FloatArray
    tangent: BoolArray

    @staticmethod
    def of(projection: Projection, lon: FloatArray, lat: FloatArray) -> Points:
        """The points, with lines in the tangent plane where a pole is near."""
        return Points(projection, lon, lat, np.asarray(np.abs(lat) > _TANGENT_LATITUDE))

    def take(self, index: IntArray | BoolArray) -> Points:
        """Some of the points."""
        return Points(self.projection, self.lon[index], self.lat[index], self.tangent[index])

    def graticule(self) -> Points:
        """The same points, with lines along the parallels and meridians however near a pole is."""
        return Points(self.projection, self.lon, self.lat, np.zeros_like(self.tangent))

    def along(
        self, directions: Sequence[tuple[float, float]], steps: FloatArray
    ) -> list[tuple[FloatArray, FloatArray]]:
        """f at signed steps (m,) along each (east, north), shape (2, m, n), and the distances in metres, (m, n).

        All in one call of the projection, which for a few points costs more than the points.

        Up to 89.99 degrees the lines are straight in longitude and latitude, so that those along
        a parallel or a meridian do not cross the seams and kinks that lie on parallels and
        meridians. Nearer the poles they are straight in the tangent plane, where a pole is a
        point like others. Both have the unit velocity of their direction at the point itself. A step is
        1 equatorial radius up to 87 degrees, and shrinks with the distance to the pole beyond.
        """
        ellipsoid = self.projection.ellipsoid
        cos = np.cos(np.radians(self.lat))
        distance = steps[:, None] * np.where(self.tangent, 1.0, np.minimum(1.0, 20.0 * cos))
        meridian, vertical = (radius / ellipsoid.a for radius in ellipsoid.radii(self.lat))
        radii = np.where(self.tangent, 1.0, vertical * cos), meridian
        lines = [self._line(direction, distance, *radii) for direction in directions]
        lon, lat, taken = (np.stack(part) for part in zip(*lines, strict=True))
        return list(zip(np.stack(self.projection(lon, lat), axis=1), taken * ellipsoid.a, strict=True))

    def _line(
        self, direction: tuple[float, float], distance: FloatArray, parallel: FloatArray, meridian: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Longitudes and latitudes (m, n) at signed distances, and these as they were taken, in equatorial radii."""
        polar = self.tangent
        east, north = distance * direction[0], distance * direction[1]
        lon = self.lon + np.degrees(east / parallel)
        lat = self.lat + np.degrees(north / meridian)
        # The step that was really taken: rounding of the angles, as the projection sees them in radians,
        # is 2e-16 / step of the derivative, and in the quotient it cancels.
        if direction == NORTH:
            distance = meridian * (np.radians(lat) - np.radians(self.lat))
        elif direction == EAST:
            distance = parallel * (np.radians(lon) - np.radians(self.lon))
        if polar.any():
            lon[:, polar], lat[:, polar] = drop(
                self.projection.ellipsoid, self.lon[polar], self.lat[polar], east[:, polar], north[:, polar]
            )
            if direction in (EAST, NORTH):
                distance[:, polar] = (east + north)[:, polar]
        return lon, lat, distance


def drop(
    ellipsoid: Ellipsoid, lon: FloatArray, lat: FloatArray, east: FloatArray, north: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Geographic coordinates of points of the tangent planes at (lon, lat), dropped to the ellipsoid.

    `east` and `north` are in units of the semi-major axis. The drop is along the normal at the
    tangent point, which makes straight lines of the plane geodesics to second order.
    """
    # In the frame of the point's own meridian the tangent plane at latitude phi has axes
    # east (0, 1, 0) and north (-sin, 0, cos), and the normal is (cos, 0, sin).
    sin, cos = np.sin(np.radians(lat)), np.cos(np.radians(lat))
    cos = np.where(np.abs(lat) == 90.0, 0.0, cos)
    e2 = ellipsoid.eccentricity_squared
    radius = 1.0 / np.sqrt(1.0 - e2 * sin * sin)
    # With q = x^2 + y^2 + z^2 / (1 - e2), q(point - w normal) = 1 is A w^2 - 2 B w + C = 0; the form
    # of the root below has no cancellation.
    flat = 1.0 / (1.0 - e2)
    A = cos * cos + sin * sin * flat
    B = (radius * cos - north * sin) * cos + (radius * (1.0 - e2) * sin + north * cos) * sin * flat
    C = north * north * (sin * sin + cos * cos * flat) + east * east
    w = C / (B + np.sqrt(B * B - A * C))
    px = radius * cos - north * sin - w * cos
    pz = radius * (1.0 - e2) * sin + north * cos - w * sin
    return lon + np.degrees(np.arctan2(east, px)), np.degrees(np.arctan2(pz * flat, np.hypot(px, east)))


EAST, NORTH = (1.0, 0.0), (0.0, 1.0)
DIAGONAL = (float(np.sqrt(0.5)), float(np.sqrt(0.5)))
_QUADRANTS = ((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0))
# Quadrants beside each other share a ray east, west, north or south.
_RAYS = tuple(dict.fromkeys((x * east, y * north) for east, north in _QUADRANTS for x, y in (EAST, NORTH, DIAGONAL)))


_Level = tuple[IntArray, FloatArray, FloatArray, FloatArray]
"""Index of the points, J, its relative error, and the noise of f in it that no step avoids."""


def _best_of(levels: Iterator[_Level], n: int) -> tuple[FloatArray, FloatArray]:
    """The Jacobians of least error among levels; a level is computed only when it is asked for."""
    best_J = np.full((n, 2, 2), np.nan)
    best_error, best_noise = np.full(n, np.inf), np.zeros(n)
    for index, J, error, noise in levels:
        better = error < best_error[index]
        chosen = index[better]
        best_J[chosen], best_error[chosen], best_noise[chosen] = J[better], error[better], noise[better]
    return best_J, best_error + best_noise


def _central_levels(
    points: Points, centre: FloatArray, steps: tuple[float, ...], *, patient: bool = False
) -> Iterator[_Level]:
    """Sixth-order central differences with ever smaller steps, for the points not yet settled.

    Points where a smaller step does not help are given up, unless `patient`: near a smooth
    singularity the error falls by 4^6, beside a seam it does not.
    """
    index = np.arange(points.lon.size)
    previous = np.full(index.size, np.inf)
    offsets = np.array([1.0, -1.0, 2.0, -2.0, 3.0, -3.0])
    for count, step in enumerate(steps, start=1):
        lines = []
        kink, noise = np.zeros((2, index.size))
        for f, t in points.along((EAST, NORTH, DIAGONAL), step * offsets):
            lines.append((f[:, 0::2] - f[:, 1::2], t[0::2] - t[1::2]))
            even = f[:, 0::2] + f[:, 1::2]
            fourth = even[:, 1] - 4.0 * even[:, 0] + 6.0 * centre
            sixth = even[:, 2] - 6.0 * even[:, 1] + 15.0 * even[:, 0] - 20.0 * centre
            kink = np.fmax(kink, np.max(np.abs(fourth), axis=0) / np.abs(t[0]))
            noise = np.fmax(noise, _white(fourth, sixth) / np.abs(t[0]))
        J, error = _jacobian_of(lines, _CENTRAL, centre)
        size = np.sqrt(np.sum(J * J, axis=(1, 2)))
        error = np.where(kink <= KINK * size, error, np.inf)
        # Noise is 20 times as large in the sixth difference as in the derivative.
        yield index, J, error, noise / (20.0 * np.where(size > 0, size, np.inf))
        # Rounding sets in where a small error rises.
        on = ~(error <= TARGET) & ~((error > 2.0 * previous) & (previous < _ROUGH))
        if not patient and count > 3:
            on &= (error < 0.1 * previous) | points.tangent
        if not on.any():
            return
        index, centre, points = index[on], centre[:, on], points.take(on)
        # An infinite error is no reason to hope: it counts as one that a second step must beat.
        previous = np.minimum(error[on], 1.0)


def _one_sided_levels(points: Points, centre: FloatArray) -> Iterator[_Level]:
    """Sixth-order one-sided differences into each quadrant, for the points not yet settled."""
    index = np.arange(points.lon.size)
    offsets = np.arange(1.0, 7.0)
    for step in _FORWARD_STEPS:
        best = np.full(index.size, np.inf)
        rays = dict(zip(_RAYS, points.along(_RAYS, step * offsets), strict=True))
        for east, north in _QUADRANTS:
            lines = []
            noise = np.zeros(index.size)
            for direction in (EAST, NORTH, DIAGONAL):
                f, t = rays[direction[0] * east, direction[1] * north]
                f, t = np.concatenate([centre[:, None], f], axis=1), np.concatenate([np.zeros_like(t[:1]), t])
                lines.append((f, t))
                fourth, sixth = (np.diff(f[:, : n + 1], n=n, axis=1)[:, 0] for n in (4, 6))
                noise = np.fmax(noise, _white(fourth, sixth) / np.abs(t[1]))
            J, error = _jacobian_of(lines, _FORWARD, centre)
            J[..., 0] *= east
            J[..., 1] *= north
            # One-sided stencils hold about half as much noise as the sixth difference.
            size = np.sqrt(np.sum(J * J, axis=(1, 2)))
            yield index, J, error, noise / (2.0 * np.where(size > 0, size, np.inf))
            best = np.fmin(best, error)
        on = ~(best <= 10 * TARGET)
        if not on.any():
            return
        index, centre, points = index[on], centre[:, on], points.take(on)


def fourth_order(values: FloatArray, metre: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First derivatives (n,) of values (4, n) at h, -h, 2 h and -2 h, one over h being `metre`; and what that corrects.

    Fourth order is second order at h plus a third of its change from 2 h to h.
    """
    ahead, behind, far_ahead, far_behind = values
    near = ahead - behind
    change = (near - 0.5 * (far_ahead - far_behind)) * (metre / 6.0)
    return near * (0.5 * metre) + change, change


def _white(fourth: FloatArray, sixth: FloatArray) -> FloatArray:
    """The sixth difference where it is white noise: on smooth maps it is well below the fourth, in noise above it.

    Noise is told, but does not choose the step: a smaller one is no better.
    """
    fourth, sixth = np.max(np.abs(fourth), axis=0), np.max(np.abs(sixth), axis=0)
    return np.where(sixth > 0.3 * fourth, sixth, 0.0)


def _jacobian_of(
    lines: list[tuple[FloatArray, FloatArray]], weights: dict[int, FloatArray], centre: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """J of shape (n, 2, 2) and its relative error (n,), from samples f (2, m, n) at distances (m, n).

    `lines` go east, north and along their diagonal. The derivative is the stencil of f over the
    same stencil of the distance.
    """
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        by_order = {
            order: np.stack([np.einsum("m,imn->ni", w, f) / (w @ t)[:, None] for f, t in lines], axis=-1)
            for order, w in weights.items()
        }
        low, high = by_order[4], by_order[6]
        J = high[..., :2]
        size = np.sqrt(np.sum(J * J, axis=(1, 2)))
        gap = np.max(np.abs(high - low), axis=(1, 2))
        if 2 in by_order:
            # The gaps of orders 2, 4 and 6 fall in geometric progression: extrapolate to the sixth order's error.
            coarse = np.max(np.abs(low - by_order[2]), axis=(1, 2))
            gap = np.minimum(gap, gap * gap / np.where(coarse > 0, coarse, 1.0))
        # Rounding of f: half a unit in the last place, and as much for PROJ's own arithmetic.
        metres = np.min([np.abs(weights[6] @ t) for _, t in lines], axis=0)
        rounding = np.spacing(np.max(np.abs(centre), axis=0)) * np.sum(np.abs(weights[6])) / metres
        # A derivative is linear in the direction. At the apex of a cone it is not.
        bend = np.max(np.abs(high[..., 2] - (J[..., 0] + J[..., 1]) * DIAGONAL[0]), axis=1)
        error = (gap + np.where(bend > 1e3 * (gap + rounding), bend, 0.0) + rounding) / size
    return J, np.where(np.isfinite(error), error, np.inf)


def is_torn(points: Points, centre: FloatArray) -> BoolArray:
    """Whether f jumps within 1e-7 radii of the point (against a change in proportion to the distance)."""
    jumps = []
    for distance in (1e-5, 1e-7):
        f = np.stack([f for f, _ in points.along((EAST, NORTH), distance * np.array([1.0, -1.0]))])
        jumps.append(np.nan_to_num(np.abs(f - centre[:, None]), nan=0.0).max(axis=(0, 1, 2)))
    scale = points.projection.ellipsoid.a
    return np.asarray((jumps[1] > 0.5 * jumps[0]) & (jumps[1] > 1e-6 * scale))
