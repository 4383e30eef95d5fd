"""Stencils for first derivatives at hard points, and second derivatives along geodesics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from projdist._typing import ArrayLike, BoolArray, FloatArray, IntArray
from projdist.earth import Ellipsoid
from projdist.projections import Projection, ProjectionLike
from projdist.support import check_degrees

TARGET = 1e-12  # relative error at which a stencil is good enough
# Odd differences at a kink agree. The fourth, over step times slope, is about 1 there, at most 2e-4 on smooth maps.
KINK = 1e-3
_ROUGH = 1e-8
TANGENT_LATITUDE = 89.99  # beyond, lines are straight in the tangent plane
_LINE_LATITUDE = 90.0 - 1e-4  # beyond, steps along the meridian are too short for the digits of a latitude

# Central weights of f(+j h) - f(-j h), j = 1.., for the first derivative times h, of orders 2, 4 and 6.
_CENTRAL = np.array([[1 / 2, 0.0, 0.0], [2 / 3, -1 / 12, 0.0], [3 / 4, -3 / 20, 1 / 60]])
_CENTRAL_OFFSETS = np.array([1.0, -1.0, 2.0, -2.0, 3.0, -3.0])
_CENTRAL_STEPS = tuple(2e-3 / 4**k for k in range(8))
# Forward weights of f(0), f(h), .., f(6 h), for the first derivative times h, of orders 4 and 6.
_FORWARD = np.array(
    [[-25 / 12, 4.0, -3.0, 4 / 3, -1 / 4, 0.0, 0.0], [-49 / 20, 6.0, -15 / 2, 20 / 3, -15 / 4, 6 / 5, -1 / 6]]
)
_FORWARD_OFFSETS = np.arange(1.0, 7.0)
_FORWARD_STEPS = (1.5e-3, 1.5e-4, 1.5e-5)
_AT_ONCE = 4096  # points whose arrays have some megabytes
_TOGETHER = 400  # points, each with a step, in one call: so few cost no more than the call


@dataclass(frozen=True)
class Refined:
    """Jacobians (n, 2, 2), their relative errors (infinite if there is none), and which are one-sided."""

    jacobian: FloatArray
    error: FloatArray
    one_sided: BoolArray


def refine(points: StencilPoints, centre: FloatArray) -> Refined:
    """Jacobians at hard points, where the projection has the values `centre` (2, n)."""
    n = points.lon.size
    best = Refined(np.full((n, 2, 2), np.nan), np.full(n, np.inf), np.zeros(n, dtype=bool))
    _improve(best, np.arange(n), points, centre, _CENTRAL_STEPS)
    # Where central stencils lose digits to a seam near by, a one-sided one may keep them.
    poor = np.flatnonzero(~(best.error <= 10 * TARGET))
    _improve(best, poor, points, centre, _FORWARD_STEPS, one_sided=True)
    # Where neither does, a singularity may be nearer than the first steps were.
    lost = np.flatnonzero(~(best.error <= _ROUGH) & ~points.tangent)
    _improve(best, lost, points, centre, _CENTRAL_STEPS[4:], patient=True)
    # A pole that is drawn as a line is no point of the tangent plane like others: lines follow the graticule there.
    lined = np.flatnonzero(~(best.error <= 10 * TARGET) & points.tangent & (np.abs(points.lat) < _LINE_LATITUDE))
    _improve(best, lined, replace(points, tangent=np.zeros_like(points.tangent)), centre, _CENTRAL_STEPS)
    return best


def _improve(
    best: Refined,
    index: IntArray,
    points: StencilPoints,
    centre: FloatArray,
    steps: tuple[float, ...],
    *,
    patient: bool = False,
    one_sided: bool = False,
) -> None:
    """Improve Jacobians at points of an index by ever smaller steps; one-sided ones must be ten times better."""
    # They are sixth-order differences: central ones, or the best one-sided ones of the four quadrants. Points where a
    # smaller central step does not help are given up, unless `patient`: near a smooth singularity the error falls by
    # 4^6, beside a seam it does not. All further steps of few points are computed together.
    if not index.size:
        return
    points, centre = points.take(index), centre[:, index]
    J, error, noise = np.full((index.size, 2, 2), np.nan), np.full(index.size, np.inf), np.zeros(index.size)
    left, count = np.arange(index.size), 0
    previous = np.full(index.size, np.inf)
    while left.size and count < len(steps):
        n, number = left.size, max(1, min(count, _TOGETHER // left.size))
        some = np.array(steps[count : count + number])
        each = np.tile(left, some.size)
        found = _in_parts(_one_sided if one_sided else _central, points.take(each), centre[:, each], np.repeat(some, n))
        at = np.arange(n)
        for level in range(some.size):
            count += 1
            own = left[at]
            new_J, new, new_noise = (part[level * n + at] for part in found)
            better = new < error[own]
            J[own[better]], error[own[better]], noise[own[better]] = new_J[better], new[better], new_noise[better]
            if one_sided:
                on = ~(new <= 10 * TARGET)
            else:
                # Rounding sets in where a small error rises.
                on = ~(new <= TARGET) & ~((new > 2.0 * previous) & (previous < _ROUGH))
                if not patient and count > 3:
                    on &= (new < 0.1 * previous) | points.tangent[own]
            # An infinite error is no reason to hope: it counts as one that a second step must beat.
            at, previous = at[on], np.minimum(new[on], 1.0)
        left = left[at]
    error = error + noise
    better = error < (0.1 if one_sided else 1.0) * best.error[index]
    chosen = index[better]
    best.jacobian[chosen], best.error[chosen], best.one_sided[chosen] = J[better], error[better], one_sided


@dataclass(frozen=True)
class StencilPoints:
    """Points of the ellipsoid, and f on lines through them: in the tangent plane for those of the mask `tangent`."""

    projection: Projection
    lon: FloatArray
    lat: FloatArray
    tangent: BoolArray

    def take(self, index: IntArray | BoolArray) -> StencilPoints:
        """Some of the points."""
        return StencilPoints(self.projection, self.lon[index], self.lat[index], self.tangent[index])

    def along(self, directions: Sequence[tuple[float, float]], steps: FloatArray) -> tuple[FloatArray, FloatArray]:
        """f (2, k, m, n) at signed steps (m, n) or (m, 1) along k directions (east, north), and metres (k, m, n)."""
        # The projection is called once, because a call costs more than a few points. Up to 89.99 degrees lines are
        # straight in longitude and latitude, so that those along parallels and meridians cross no seams and kinks that
        # lie on these. Nearer the poles they are straight in the tangent plane, where a pole is a point like others. A
        # step of 1 is an equatorial radius up to 87 degrees, and shrinks with the distance to the pole beyond.
        ellipsoid, polar = self.projection.ellipsoid, self.tangent
        cos = np.cos(np.radians(self.lat))
        distance = steps * np.where(polar, 1.0, np.minimum(1.0, 20.0 * cos))
        meridian, vertical = (radius / ellipsoid.a for radius in ellipsoid.radii(self.lat))
        parallel, meridian = np.where(polar, 1.0, vertical * cos), meridian
        east, north = (distance * np.array(part)[:, None, None] for part in zip(*directions, strict=True))
        lon = self.lon + np.degrees(east / parallel)
        lat = self.lat + np.degrees(north / meridian)
        taken = np.repeat(distance[None], len(directions), axis=0)
        # The steps as taken: rounding of angles in radians, 2e-16 / step of the derivative, cancels in the quotient.
        for k, direction in enumerate(directions):
            if direction == NORTH:
                taken[k] = meridian * (np.radians(lat[k]) - np.radians(self.lat))
            elif direction == EAST:
                taken[k] = parallel * (np.radians(lon[k]) - np.radians(self.lon))
        if polar.any():
            planar = self.lon[polar], self.lat[polar], east[..., polar], north[..., polar]
            lon[..., polar], lat[..., polar] = drop(ellipsoid, *planar)
            taken[..., polar] = np.broadcast_to(distance, taken.shape)[..., polar]
        return np.stack(self.projection(lon, lat)), taken * ellipsoid.a


def drop(
    ellipsoid: Ellipsoid, lon: FloatArray, lat: FloatArray, east: FloatArray, north: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Degrees of the points `east`, `north` (in semi-major axes) of tangent planes at (lon, lat), on the ellipsoid."""
    # They drop along the normal at the tangent point, so that straight lines become geodesics to second order. In the
    # frame of the point's meridian the plane has axes east (0, 1, 0), north (-sin, 0, cos) and normal (cos, 0, sin).
    sin, cos = np.sin(np.radians(lat)), np.cos(np.radians(lat))
    cos = np.where(np.abs(lat) == 90.0, 0.0, cos)
    e2 = ellipsoid.eccentricity_squared
    radius = 1.0 / np.sqrt(1.0 - e2 * sin * sin)
    # With q = x^2 + y^2 + z^2 / (1 - e2), q(point - w normal) = 1 is A w^2 - 2 B w + C = 0, without cancellation.
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
_LINES = (EAST, NORTH, DIAGONAL)
_QUADRANTS = np.array([(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)])
# Quadrants beside each other share a ray east, west, north or south.
_RAYS_OF = [[(x * east, y * north) for east, north in _QUADRANTS.tolist()] for x, y in _LINES]
_RAYS = tuple(dict.fromkeys(ray for rays in zip(*_RAYS_OF, strict=True) for ray in rays))
_PLACES = np.array([[_RAYS.index(ray) for ray in rays] for rays in _RAYS_OF])  # (3, 4), of the quadrants' lines


_Found = tuple[FloatArray, FloatArray, FloatArray]
"""J (n, 2, 2), its relative error (n,), and the noise of f in it."""
_Differences = Callable[[StencilPoints, FloatArray, FloatArray], _Found]


def _in_parts(differences: _Differences, points: StencilPoints, centre: FloatArray, steps: FloatArray) -> _Found:
    """Differences for a few thousand points at a time, because one-sided ones need a hundred numbers a point."""
    if not points.projection.answers_everywhere:  # functions, whose answers may depend on the other points
        return differences(points, centre, steps)
    parts = [np.arange(start, min(start + _AT_ONCE, steps.size)) for start in range(0, steps.size, _AT_ONCE)]
    found = [differences(points.take(part), centre[:, part], steps[part]) for part in parts]
    if len(found) == 1:
        return found[0]
    J, error, noise = (np.concatenate(each) for each in zip(*found, strict=True))
    return J, error, noise


def _central(points: StencilPoints, centre: FloatArray, steps: FloatArray) -> _Found:
    """Sixth-order central differences with a step (n,) for each point."""
    f, t = points.along(_LINES, steps * _CENTRAL_OFFSETS[:, None])
    even = f[:, :, 0::2] + f[:, :, 1::2]
    middle = centre[:, None]
    fourth = even[:, :, 1] - 4.0 * even[:, :, 0] + 6.0 * middle
    sixth = even[:, :, 2] - 6.0 * even[:, :, 1] + 15.0 * even[:, :, 0] - 20.0 * middle
    first = np.abs(t[:, 0])
    kink = np.fmax.reduce(np.max(np.abs(fourth), axis=0) / first, axis=0, initial=0.0)
    noise = np.fmax.reduce(_white(fourth, sixth) / first, axis=0, initial=0.0)
    slopes, metres = _slopes(f[:, :, 0::2] - f[:, :, 1::2], t[:, 0::2] - t[:, 1::2], _CENTRAL)
    J, error = _jacobian_of(slopes, metres, _CENTRAL, centre)
    size = np.sqrt(np.sum(J * J, axis=(0, 1)))
    error = np.where(kink <= KINK * size, error, np.inf)
    # Noise is 20 times as large in the sixth difference as in the derivative.
    return np.moveaxis(J, -1, 0), error, noise / (20.0 * np.where(size > 0, size, np.inf))


def _one_sided(points: StencilPoints, centre: FloatArray, steps: FloatArray) -> _Found:
    """Sixth-order one-sided differences with a step (n,) for each point, in the quadrant where they are best."""
    n = steps.size
    f, t = points.along(_RAYS, steps * _FORWARD_OFFSETS[:, None])
    f = np.concatenate([np.broadcast_to(centre[:, None, None], (2, len(_RAYS), 1, n)), f], axis=2)
    t = np.concatenate([np.zeros_like(t[:, :1]), t], axis=1)
    fourth, sixth = (np.diff(f[:, :, : order + 1], n=order, axis=2)[:, :, 0] for order in (4, 6))
    noise = np.fmax.reduce((_white(fourth, sixth) / np.abs(t[:, 1]))[_PLACES], axis=0, initial=0.0)
    slopes, metres = _slopes(f, t, _FORWARD)
    J, error = _jacobian_of(slopes[:, :, _PLACES], metres[_PLACES], _FORWARD, centre)
    J = J * _QUADRANTS.T[:, :, None]
    # One-sided stencils hold about half as much noise as the sixth difference.
    size = np.sqrt(np.sum(J * J, axis=(0, 1)))
    noise = noise / (2.0 * np.where(size > 0, size, np.inf))
    best = error.argmin(axis=0), np.arange(n)
    return J[:, :, *best].transpose(2, 0, 1), error[best], noise[best]


def fourth_order(values: FloatArray, metre: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Derivatives from values (4, n) at h, -h, 2 h, -2 h (`metre` is 1 / h), and their changes from second order."""
    ahead, behind, far_ahead, far_behind = values
    near = ahead - behind
    change = (near - 0.5 * (far_ahead - far_behind)) * (metre / 6.0)
    return near * (0.5 * metre) + change, change


def _white(fourth: FloatArray, sixth: FloatArray) -> FloatArray:
    """The sixth difference where it is white noise, else 0: on smooth maps it is well below the fourth difference."""
    fourth, sixth = np.max(np.abs(fourth), axis=0), np.max(np.abs(sixth), axis=0)
    return np.where(sixth > 0.3 * fourth, sixth, 0.0)


def _slopes(f: FloatArray, t: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Stencils (o, 2, k, n) of o orders of f (2, k, m, n) over those of distances t (k, m, n); the last of these."""
    metres = weights @ t
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        return np.moveaxis((weights @ f) / metres, 2, 0), metres[:, -1]


def _jacobian_of(
    slopes: FloatArray, metres: FloatArray, weights: FloatArray, centre: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """J (2, 2, ..., n) and its relative error (..., n), from slopes (o, 2, 3, ..., n) to east, north and between."""
    low, high = slopes[-2:]
    J = high[:, :2]
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        size = np.sqrt(np.sum(J * J, axis=(0, 1)))
        gap = np.max(np.abs(high - low), axis=(0, 1))
        if len(slopes) > 2:
            # The gaps of orders 2, 4 and 6 fall in geometric progression: extrapolate to the sixth order's error.
            coarse = np.max(np.abs(low - slopes[0]), axis=(0, 1))
            gap = np.minimum(gap, gap * gap / np.where(coarse > 0, coarse, 1.0))
        # Rounding of f: half a unit in the last place, and as much for PROJ's own arithmetic.
        rounding = np.spacing(np.max(np.abs(centre), axis=0)) * np.sum(np.abs(weights[-1])) / np.abs(metres).min(axis=0)
        # A derivative is linear in the direction. At the apex of a cone it is not.
        bend = np.max(np.abs(high[:, 2] - (J[:, 0] + J[:, 1]) * DIAGONAL[0]), axis=0)
        error = (gap + np.where(bend > 1e3 * (gap + rounding), bend, 0.0) + rounding) / size
    return J, np.where(np.isfinite(error), error, np.inf)


def is_torn(points: StencilPoints, centre: FloatArray) -> BoolArray:
    """True if f jumps within 1e-7 radii of the point, instead of changing in proportion to the distance."""
    jumps = []
    for distance in (1e-5, 1e-7):
        f, _ = points.along((EAST, NORTH), distance * np.array([[1.0], [-1.0]]))
        jumps.append(np.nan_to_num(np.abs(f - centre[:, None, None]), nan=0.0).max(axis=(0, 1, 2)))
    return np.asarray((jumps[1] > 0.5 * jumps[0]) & (jumps[1] > 1e-6 * points.projection.ellipsoid.a))


# At the first step rounding, eps / step^2 = 2e-12, and truncation, step^6, balance; near singularities smaller ones do.
_STEPS = tuple(1e-2 / 4**k for k in range(6))
_SECOND = np.array([3 / 2, -3 / 20, 1 / 90])  # weights of f(+j h) + f(-j h) - 2 f(0), times h^2
_SECOND_LOW = np.array([4 / 3, -1 / 12, 0.0])


def hessian(projection: ProjectionLike, lon: ArrayLike, lat: ArrayLike) -> FloatArray:
    """Second derivatives at points in degrees, along geodesics; NaN at kinks and seams.

    Parameters
    ----------
    projection : ProjectionLike
    lon, lat : array_like (...)
        The points in degrees, of shapes that broadcast.

    Returns
    -------
    ndarray (..., 2, 2, 2)
        H[..., i, j, k], with i for x and y, j and k for east and north, per radian of the semi-major axis. That is
        Goldberg and Gott's unit for flexion and skewness; divided by the axis in metres it is 1/m.

    Raises
    ------
    ProjectionError, ValueError
        For what is no projection; for points that are no numbers, or whose shapes do not broadcast.

    References
    ----------
    Goldberg & Gott 2007, Flexion and Skewness in Map Projections of the Earth, Cartographica 42:297, section 3.

    Examples
    --------
    On a plate carree a great circle that starts to the east bends to the south by tan(lat), 1 at 45 degrees.

    >>> H = hessian("plate-carree", 0, 45)
    >>> round(float(H[1, 0, 0]), 6)
    -1.0
    """
    projection = Projection.from_user_input(projection)
    lon, lat = check_degrees(lon, lat)
    shape, lon, lat = lon.shape, lon.ravel(), lat.ravel()
    best = np.full((lon.size, 3, 2), np.nan)
    best_error = np.full(lon.size, np.inf)
    if form := projection.closed_form:
        plane, error = form.checked(lon, lat, *projection(lon, lat))
        if plane.second:
            with np.errstate(all="ignore"):  # at points where the formula is not good
                east, mixed, north = plane.second()
            lines = (east, north, mixed + 0.5 * (east + north))
            best = np.stack([np.stack([values.real, values.imag], axis=-1) for values in lines], axis=1)
            best_error = np.where(error >= 0.0, error, np.inf)
    index = np.flatnonzero(~(best_error <= 1e-7))
    along_east, along_north = np.array(_LINES).T[:, :, None, None]
    for step in _STEPS:
        if not index.size:
            break
        place = lon[index], lat[index]
        centre = np.stack(projection(*place))
        metres = step * projection.ellipsoid.a
        distance = step * _CENTRAL_OFFSETS[:, None]
        f = np.stack(projection(*drop(projection.ellipsoid, *place, along_east * distance, along_north * distance)))
        bends = f[:, :, 0::2] + f[:, :, 1::2] - 2.0 * centre[:, None, None]
        values, low = (
            np.asarray(sum(weight * bends[:, :, m] for m, weight in enumerate(weights))).T / metres**2
            for weights in (_SECOND, _SECOND_LOW)
        )
        gap = np.max(np.abs(values - low), axis=(1, 2)) * projection.ellipsoid.a
        error = np.where(np.isfinite(gap), gap, np.inf)
        better = error < best_error[index]
        best[index[better]], best_error[index[better]] = values[better], error[better]
        index = index[~(error <= 1e-7)]
    best[~(best_error <= 1e-2)] = np.nan
    east, north, diagonal = best[:, 0], best[:, 1], best[:, 2]
    mixed = diagonal - 0.5 * (east + north)
    H = np.stack([np.stack([east, mixed], axis=-1), np.stack([mixed, north], axis=-1)], axis=-1)
    return np.asarray(H.reshape(*shape, 2, 2, 2) * projection.ellipsoid.a)
