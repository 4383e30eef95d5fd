"""Frechet means of 2 x 2 matrices: SPD(2) is a line times the hyperbolic plane.

The line is v = ln |det A|, whose mean is the plain one. The point of the upper half-plane is
(x, y) = (l21, l22) / l11, l the lower-triangular LQ factor of A: no product A A^T is formed, so no condition is
squared. With r the hyperbolic distance of two points and dv their difference on the line, Dist_F(A^-1 B)^2 =
(dv^2 + r^2) / 2, where sinh^2(r / 2) = (dx^2 + dy^2) / (4 y1 y2). Arrays are (B, N): B sets of N matrices. Passes
over them run in pieces that stay in a processor's cache.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.matrices.frechet import Mean, damping, settled
from projdist.matrices.spd import EPS

# Doubles of one array, of which a dozen are in use; BLAS starts no threads for the product of so few.
_CHUNK = 10_000
_MANY, _STRIDE = 8192, 8  # above this number every eighth matrix gives the start
_STEPS = 100  # 2 to 4 suffice, from far away about 15
_CENTRE_STEPS = 10


class PlanePoints(NamedTuple):
    """Coordinates of matrices on the line and in the half-plane, each of shape (B, N)."""

    v: FloatArray
    x: FloatArray
    y: FloatArray


class _Moments(NamedTuple):
    """Weighted means about a trial centre, each of shape (B,) or a pair or triple of such."""

    gradient: FloatArray  # the mean of r times the direction to the point
    square: FloatArray  # of r^2
    cosh: FloatArray  # of cosh r
    hessian: FloatArray  # h11, h22, h12


def points(A: FloatArray) -> tuple[PlanePoints, BoolArray]:
    """Points of matrices (B, N, 2, 2), and a mask of singular or non-finite ones."""
    found = PlanePoints(*(np.empty(A.shape[:2]) for _ in range(3)))
    wrong = np.zeros(A.shape[:2], dtype=bool)
    for part in _slices(A.shape[1]):
        piece = PlanePoints(*(values[:, part] for values in found))
        _locate(A[:, part], piece)
        v, x, y = piece
        # NaN compares as false. If a square may be out of range, each matrix is divided by a power of 2.
        if not (v.min() > -600 and y.min() > 1e-30 and y.max() < 1e30 and math.isfinite(x.sum())):
            exponents = np.frexp(np.abs(A[:, part]).max(axis=(2, 3)))[1]
            _locate(np.ldexp(A[:, part], -exponents[:, :, None, None]), piece)
            v += 2.0 * np.log(2.0) * exponents
            wrong[:, part] = ~(np.isfinite(v) & np.isfinite(x) & np.isfinite(y) & (y > 0))
    return found, wrong


def _locate(A: FloatArray, found: PlanePoints) -> None:
    a, b, c, d = A[..., 0, 0], A[..., 0, 1], A[..., 1, 0], A[..., 1, 1]
    v, x, y = found
    with np.errstate(all="ignore"):
        row = a * a
        row += b * b
        np.multiply(a, d, out=y)
        y -= b * c
        np.abs(y, out=y)
        np.log(y, out=v)
        y /= row
        np.multiply(a, c, out=x)
        x += b * d
        x /= row


def newton(points: PlanePoints, w: FloatArray, start: FloatArray | None = None) -> Mean:
    """The Frechet mean by Newton's method, weights w of shape (B, N) and sum 1; `start`: x and y, shape (2, B)."""
    inverse, squares = 1.0 / points.y, np.empty(w.shape)
    centre = _start(points, inverse, w) if start is None else start
    active, iterations = np.ones(len(w), dtype=bool), np.zeros(len(w), dtype=int)
    best, previous, expected = np.full((3, len(w)), np.inf)
    floor, length, base, step = np.zeros(len(w)), np.ones(len(w)), centre, np.zeros((2, len(w)))
    for count in range(_STEPS + 1):
        # If the last step leaves no error, the Hessian is not needed.
        last = bool((expected <= floor).all()) or count == _STEPS
        if not last:
            found = _moments(points, inverse, w, centre)
            # Rounding of the points and of the centre.
            size, floor = _size(found.gradient), 4.0 * EPS * (found.cosh + np.abs(centre[0] / centre[1]))
            last = bool((settled(size, previous, floor) | ~active).all())
        if last:
            size = _size(_distances(points, inverse, w, centre, squares))
            active &= ~settled(size, previous, floor)
            if count == _STEPS or not active.any():
                break
            found = _moments(points, inverse, w, centre)
        active &= ~settled(size, previous, floor)
        # Newton's error is a constant times the square of that before; the steps so far estimate the constant.
        constant = size / (length * length) if count else 0.1
        risen = active & (found.square > best * (1.0 + 1e-9) + 10.0 * floor * np.sqrt(found.square))
        fresh = _solve(found.hessian, found.gradient) * active
        if risen.any():
            base, step = np.where(risen, base, centre), np.where(risen, 0.5 * step, fresh)
            best, previous = np.where(risen, best, found.square), np.where(risen, previous, size)
        else:
            base, step, best, previous = centre, fresh, found.square, size
        length = np.maximum(np.hypot(step[0], step[1]), 1e-150)
        if (length > 1.0).any():
            step = step * np.where(risen, 1.0, damping(length, _bend(found)))
        expected = constant * length * length
        iterations += active
        centre = _move(base, step)
    return _result(points, w, centre, squares, size, iterations, floor)


def _result(
    points: PlanePoints,
    w: FloatArray,
    centre: FloatArray,
    squares: FloatArray,
    size: FloatArray,
    iterations: IntArray,
    floor: FloatArray,
) -> Mean:
    """The mean at a centre; turns `squares` of distances in the plane into those of the matrices."""
    v0 = _mean(w, points.v)
    for part in _slices(w.shape[1]):
        square, dv = squares[:, part], points.v[:, part] - v0[:, None]
        dv *= dv
        square += dv
        square *= 0.5
    (x0, y0), T = centre, np.zeros((len(w), 2, 2))
    T[:, 0, 0] = np.exp(0.5 * v0) / np.sqrt(y0)
    T[:, 1, 0] = x0 * T[:, 0, 0]
    T[:, 1, 1] = y0 * T[:, 0, 0]
    return Mean(T, _mean(w, squares), size, iterations, floor, squares)


def _size(gradient: FloatArray) -> FloatArray:
    """The gradient's norm in the metric of SPD(2), where the plane's lengths count sqrt 2 times."""
    return np.sqrt(2.0) * np.hypot(gradient[0], gradient[1])


def _start(points: PlanePoints, inverse: FloatArray, w: FloatArray) -> FloatArray:
    """The centroid on the hyperboloid; of many points that of every eighth and one Newton step.

    That centre is the midpoint of the arithmetic and the harmonic mean of the matrices, for determinant 1.
    """
    many = w.shape[1] >= _MANY
    if many:
        some = w[:, ::_STRIDE].copy()
        total = some.sum(axis=1, keepdims=True)
        many = bool((total > 0).all())
    if many:
        points, w = PlanePoints(points.v, *(values[:, ::_STRIDE].copy() for values in points[1:])), some / total
        inverse = 1.0 / points.y
    centre = np.array([_mean(w, points.x), np.exp(_mean(w, np.log(points.y)))])
    for _ in range(_CENTRE_STEPS):
        sums, cosh = _centroid(points, inverse, w, centre)
        length = np.hypot(*sums)
        # For points far on one side cosh and length cancel: then some steps instead of one.
        ratio = np.minimum(length / cosh, 1.0 - 1e-12)
        centre = _move(centre, sums * (np.arctanh(ratio) / np.where(length > 0, length, 1.0)))
        if (ratio < 0.9).all():
            break
    if many:
        found = _moments(points, inverse, w, centre)
        step = _solve(found.hessian, found.gradient)
        centre = _move(centre, step * damping(np.hypot(*step), _bend(found)))
    return centre


def _bend(found: _Moments) -> FloatArray:
    """The mean of r coth r: the Hessian's trace holds it and a 1."""
    return found.hessian[0] + found.hessian[1] - 1.0


def _dot(a: FloatArray, b: FloatArray) -> Any:
    """Sums of a b over the last axis; for one set by BLAS, single-threaded at this size."""
    return a[0] @ b[0] if len(a) == 1 else np.einsum("bi,bi->b", a, b)


def _slices(count: int) -> list[slice]:
    step = math.ceil(count / math.ceil(count / _CHUNK))
    return [slice(start, start + step) for start in range(0, count, step)]


def _mean(w: FloatArray, values: FloatArray) -> FloatArray:
    total = np.zeros(len(w))
    for part in _slices(w.shape[1]):
        total += _dot(w[:, part], values[:, part])
    return total


class _FromCentre(NamedTuple):
    """Points relative to a centre: s = sinh(r) times the direction, cosh(r), cosh(r) - 1 and sinh(r)^2."""

    s1: FloatArray
    s2: FloatArray
    cosh: FloatArray
    excess: FloatArray
    square: FloatArray


def _seen(points: PlanePoints, inverse: FloatArray, part: slice, centre: FloatArray) -> _FromCentre:
    """Points after an isometry that moves the centre to (0, 1); `inverse` is 1 / y."""
    (x0, y0), reciprocal = centre, inverse[:, part]
    dx, dy = points.x[:, part] - x0[:, None], points.y[:, part] - y0[:, None]
    # cosh(r) - 1 = (dx^2 + dy^2) / (2 y y0), without cancellation; s2 = cosh(r) - y0 / y is good to eps cosh(r).
    excess = dx * dx
    dy *= dy
    excess += dy
    excess *= reciprocal
    excess *= 0.5 / y0[:, None]
    dx *= reciprocal
    cosh = excess + 1.0
    s2 = np.multiply(reciprocal, -y0[:, None], out=dy)
    s2 += cosh
    square = excess + 2.0
    square *= excess
    return _FromCentre(dx, s2, cosh, excess, square)


def _centroid(
    points: PlanePoints, inverse: FloatArray, w: FloatArray, centre: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The weighted means of s and of cosh r."""
    sums = np.zeros((3, len(w)))
    for part in _slices(w.shape[1]):
        seen, weight = _seen(points, inverse, part, centre), w[:, part]
        sums[0] += _dot(weight, seen.s1)
        sums[1] += _dot(weight, seen.s2)
        sums[2] += _dot(weight, seen.cosh)
    return sums[:2], sums[2]


def _moments(points: PlanePoints, inverse: FloatArray, w: FloatArray, centre: FloatArray) -> _Moments:
    sums = np.zeros((7, len(w)))
    for part in _slices(w.shape[1]):
        (s1, s2, cosh, _, square), weight = _seen(points, inverse, part, centre), w[:, part]
        square += 1e-18  # so that r / sinh(r) is 1 at 0
        sinh = np.sqrt(square)
        r = sinh + cosh
        np.log(r, out=r)
        f = np.divide(r, sinh, out=sinh)
        f *= weight
        r *= r
        sums[0] += _dot(f, s1)
        sums[1] += _dot(f, s2)
        sums[2] += _dot(weight, r)
        sums[3] += _dot(weight, cosh)
        # The Hessian of r^2 / 2 is 1 along the geodesic and r coth r across it: 1 - this times (-s2, s1) squared.
        f *= cosh
        f -= weight
        f /= square
        g = np.multiply(f, s1, out=square)
        f *= s2
        sums[4] += _dot(f, s2)
        sums[5] += _dot(g, s1)
        sums[6] -= _dot(f, s1)
    sums[4:6] += 1.0
    return _Moments(sums[:2], sums[2], sums[3], sums[4:])


def _distances(
    points: PlanePoints, inverse: FloatArray, w: FloatArray, centre: FloatArray, squares: FloatArray
) -> FloatArray:
    """The gradient; writes r^2 to full relative accuracy into `squares`."""
    gradient = np.zeros((2, len(w)))
    for part in _slices(w.shape[1]):
        (s1, s2, _, excess, square), weight = _seen(points, inverse, part, centre), w[:, part]
        square += 1e-300
        sinh = np.sqrt(square, out=square)
        excess += sinh
        r = np.log1p(excess, out=excess)
        f = np.divide(r, sinh, out=sinh)
        f *= weight
        gradient[0] += _dot(f, s1)
        gradient[1] += _dot(f, s2)
        np.multiply(r, r, out=squares[:, part])
    return gradient


def _solve(hessian: FloatArray, gradient: FloatArray) -> FloatArray:
    (h11, h22, h12), (g1, g2) = hessian, gradient
    return np.array([h22 * g1 - h12 * g2, h11 * g2 - h12 * g1]) / (h11 * h22 - h12 * h12)


def _move(centre: FloatArray, step: FloatArray) -> FloatArray:
    """The end of the geodesic from a centre in the direction and of the length of `step`, all of shape (2, B)."""
    length = np.hypot(step[0], step[1])
    slope = np.sinh(length) / np.maximum(length, 1e-300)
    y0 = centre[1] / (np.cosh(length) - step[1] * slope)
    return np.array([centre[0] + y0 * step[0] * slope, y0])
