"""Frechet means of matrices in the affine-invariant metric, of any size, and of 2 x 2 matrices by coordinates.

SPD(2) is a line times the hyperbolic plane. On the line a matrix A is at v = ln |det A|, and the mean of v is the plain
one. In the upper half-plane A is at (x, y) = (l21, l22) / l11, l its lower triangular LQ factor: no product A A^T is
formed, so that no condition is squared. With r the hyperbolic distance of two points and dv their difference on the
line, Dist_F(A^-1 B)^2 = (dv^2 + r^2) / 2, where sinh^2(r / 2) = (dx^2 + dy^2) / (4 y1 y2).
"""

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.matrices import whitened_sets

_NEWTON_STEPS = 100  # 3 to 5 suffice, from far away about 15
_GRADIENT_STEPS = 1000  # about 15 suffice; conditions of 1e6 take 300
# Largest n, and smallest N, for which vectorised Jacobi rotations are faster than LAPACK calls.
_SMALL, _MANY = 4, 256
_POOR = 100.0  # condition |T^-1| |T|, invariant under scaling of rows, above which a refinement pays


class Mean(NamedTuple):
    """The means T of B sets of N matrices, or (in brackets, where they differ) their medians, and the accuracy."""

    T: FloatArray  # (B, n, n), lower triangular with a positive diagonal
    cost: FloatArray  # (B,), the weighted mean of the distances (of their roots)
    # (B,), of the weighted mean of ln(T^-1 A_i A_i^T T^-T) (of directions, less the weight of what lies at T).
    gradient_norm: FloatArray
    iterations: IntArray  # (B,)
    floor: FloatArray  # (B,), the gradient's rounding: n eps times the mean of cosh r, r the logarithm of a condition
    distances: FloatArray  # (B, N), Dist_F(T^-1 A_i)^2
    unique: BoolArray  # (B,), True for all means


def newton(A: FloatArray, w: FloatArray, start: FloatArray) -> Mean:
    """Newton's method with the exact Hessian."""
    if A.shape[-1] in range(3, _SMALL + 1) and A.shape[1] >= _MANY:
        one = [slice(b, b + 1) for b in range(len(A))]
        found = [_descend(whitened_sets.JacobiSet(A[b], w[b], start[b]), _newton_step, _NEWTON_STEPS) for b in one]
        mean = Mean(*(np.concatenate(parts) for parts in zip(*found, strict=True)))
    else:
        mean = _descend(whitened_sets.LapackSets(A, w, start), _newton_step, _NEWTON_STEPS)
    return _refined(A, w, mean)


def gradient(A: FloatArray, w: FloatArray, start: FloatArray) -> Mean:
    """The gradient method with the automatic step 2 / (1 + mean of r coth r) (Bini & Iannazzo 2013)."""
    sets = whitened_sets.LapackSets(A, w, start)
    mean = _descend(sets, lambda _, view: view.logarithm * (2.0 / (1.0 + view.bend))[:, None, None], _GRADIENT_STEPS)
    return _refined(A, w, mean)


def _newton_step(sets: whitened_sets.AnySets, view: whitened_sets.View) -> FloatArray:
    """Newton's step, shortened if it is long."""
    V = sets.newton_step(view.logarithm)
    if np.abs(V).max() * V.shape[-1] < 1.0:
        return V  # all eigenvalues are below 1
    values = np.linalg.eigvalsh(V)
    return V * damping(0.5 * (values[:, -1] - values[:, 0]), view.bend)[:, None, None]


def damping(length: FloatArray, bend: FloatArray) -> FloatArray:
    """Factor that shortens a long Newton step, by its length in the hyperbolic plane and the mean of r coth r."""
    # Along a geodesic of unit speed the third derivative of the cost is at most twice the second, and far less where
    # the points are near (bend 1). Such a bound b allows the step ln(1 + b) / b; half of the bound proved enough.
    b = np.maximum(length * (1.0 - 1.0 / bend), 1.0)
    return np.asarray(np.where(b > 1.0, np.log1p(b) / b, 1.0))


def settled(size: FloatArray, previous: FloatArray, floor: FloatArray) -> BoolArray:
    """Mask of gradients that are only rounding: below the floor, or near it and no longer falling."""
    # The floor is capped at 1e-6, as it is a pessimistic bound that grows without limit for matrices far apart.
    return (size <= np.minimum(floor, 1e-6)) | ((size <= np.minimum(4.0 * floor, 1e-4)) & (size > 0.5 * previous))


_Step = Callable[[whitened_sets.AnySets, whitened_sets.View], FloatArray]


def _descend(sets: whitened_sets.AnySets, step: _Step, limit: int) -> Mean:
    """The means after steps until each set has settled; half of a step that raised the cost is undone."""
    b, n, _ = sets.T.shape
    active, iterations = np.ones(b, dtype=bool), np.zeros(b, dtype=int)
    best, previous, V = np.full(b, np.inf), np.full(b, np.inf), np.zeros((b, n, n))
    for count in range(limit + 1):
        view = sets.look()
        size, floor = np.linalg.norm(view.logarithm, axis=(-1, -2)), _floor(view)
        active &= ~settled(size, previous, floor)
        if count == limit or not active.any():
            break
        risen = active & (view.cost > best * (1.0 + 1e-9) + 10.0 * floor * np.sqrt(view.cost))
        fresh = active & ~risen
        view = view._replace(logarithm=np.where(fresh[:, None, None], view.logarithm, 0.0))
        V = np.where(risen[:, None, None], -0.5 * V, step(sets, view))
        best, previous = np.where(fresh, view.cost, best), np.where(fresh, size, previous)
        iterations += active
        sets.move(V)
    return Mean(
        whitened_sets.lower_factor(sets.T), view.cost, size, iterations, floor, view.distances, np.ones(b, dtype=bool)
    )


def _floor(view: whitened_sets.View) -> FloatArray:
    """Bound of the gradient's rounding."""
    return 2.0 * view.logarithm.shape[-1] * whitened_sets.EPS * (view.cosh + np.sqrt(view.cost))


def _refined(A: FloatArray, w: FloatArray, mean: Mean) -> Mean:
    """The mean after one more Newton step from T itself, where its condition let rounding accumulate over the steps."""
    # What remains is the rounding of A and T, some eps times the condition: a third to a tenth of the error before.
    poor = whitened_sets.row_condition(mean.T) > _POOR
    if not poor.any():
        return mean
    T = mean.T[poor]
    sets = whitened_sets.LapackSets(A[poor], w[poor], T)
    # exp(V / 2) = (1 + K) Q to first order, where the lower triangular K has K + K^T = V.
    K = np.tril(sets.newton_step(sets.look().logarithm))
    np.einsum("bkk->bk", K)[...] *= 0.5
    refined = mean.T.copy()
    refined[poor] += T @ K
    return mean._replace(T=refined, iterations=mean.iterations + poor)


def middle(A: FloatArray, w: FloatArray) -> tuple[FloatArray, BoolArray]:
    """The midpoint of the arithmetic and the harmonic mean, and a mask (B, N) of singular matrices."""
    # It is affine-invariant like the Frechet mean and near it, for moderate spread ten times nearer than the
    # log-Cholesky mean. Both means are triangular factors of stacked matrices, so that no condition is squared.
    b, count, n, _ = A.shape
    straight, inverse = np.zeros((b, n, n)), np.zeros((b, n, n))
    wrong = np.zeros((b, count), dtype=bool)
    for part in whitened_sets.pieces(A):
        A_inv, wrong[:, part] = _inverses(A[:, part])
        root = np.sqrt(w[:, part])[:, :, None, None]
        straight = _stack(straight, whitened_sets.transposed(A[:, part]) * root)
        inverse = _stack(inverse, A_inv * root)
    # With R^T R and S^T S the means of A A^T and of its inverse: S R^T = U s V^T, T = R^T V s^-1/2.
    _, scales, V = np.linalg.svd(inverse @ whitened_sets.transposed(straight))
    return whitened_sets.transposed(straight) @ (whitened_sets.transposed(V) / np.sqrt(scales)[:, None, :]), wrong


def _stack(R: FloatArray, rows: FloatArray) -> FloatArray:
    """The triangular factor of R on top of matrices of shape (B, M, n, n)."""
    b, n, _ = R.shape
    return np.asarray(np.linalg.qr(np.concatenate([R, rows.reshape(b, -1, n)], axis=1), mode="r"))


def _inverses(A: FloatArray) -> tuple[FloatArray, BoolArray]:
    """A^-1, and a mask of singular matrices, whose inverse is set to the identity."""
    one = np.eye(A.shape[-1])
    try:
        inverse = np.asarray(np.linalg.inv(A), dtype=float)
    except np.linalg.LinAlgError:
        zero = np.linalg.slogdet(A)[0] == 0
        inverse = np.asarray(np.linalg.inv(np.where(zero[..., None, None], one, A)), dtype=float)
        inverse[zero] = np.inf
    # The inverse norm of a column of A^-1 is the distance of a row of A from the span of the others (here 1-norms).
    ratio = np.abs(A).sum(axis=-1) * np.abs(inverse).sum(axis=-2)
    wrong = ~(ratio.max(axis=-1) < 1.0 / whitened_sets.EPS)
    inverse[wrong] = one
    return inverse, wrong


# ---- other means ------------------------------------------------------------------------------


def _known(A: FloatArray, w: FloatArray, T: FloatArray, iterations: int = 0) -> Mean:
    """The `Mean` of factors T found by another method."""
    T = whitened_sets.lower_factor(T)
    view = whitened_sets.LapackSets(A, w, T).look()
    size = np.linalg.norm(view.logarithm, axis=(-1, -2))
    count, unique = np.full(len(T), iterations), np.ones(len(T), dtype=bool)
    return Mean(T, view.cost, size, count, _floor(view), view.distances, unique)


def arithmetic(A: FloatArray, w: FloatArray, start: FloatArray) -> Mean:
    """The arithmetic mean of A_i A_i^T."""
    R = np.zeros_like(start)
    for part in whitened_sets.pieces(A):
        R = _stack(R, whitened_sets.transposed(A[:, part]) * np.sqrt(w[:, part])[:, :, None, None])
    return _known(A, w, whitened_sets.transposed(R))


def log_cholesky(A: FloatArray, w: FloatArray, start: FloatArray) -> Mean:
    """The mean of the Cholesky factors, their diagonals geometric (Lin 2019)."""
    T, logs = np.zeros_like(start), np.zeros(start.shape[:2])
    for part in whitened_sets.pieces(A):
        L = whitened_sets.lower_factor(A[:, part])
        T += np.einsum("bi,bikl->bkl", w[:, part], L)
        logs += np.einsum("bi,bik->bk", w[:, part], np.log(np.einsum("bikk->bik", L)))
    np.einsum("bkk->bk", T)[...] = np.exp(logs)
    return _known(A, w, T)


def log_euclidean(A: FloatArray, w: FloatArray, start: FloatArray) -> Mean:
    """exp of the mean of ln(A_i A_i^T) (Arsigny et al. 2007)."""
    logs = np.zeros_like(start)
    for part in whitened_sets.pieces(A):
        U, scales, _ = np.linalg.svd(A[:, part])
        logs += np.einsum("bi,bija,bia,bika->bjk", w[:, part], U, np.log(scales), U, optimize=True)
    return _known(A, w, whitened_sets.symmetric_exp(logs)[0])


_ORDER = 0.01  # of the two power means of `mpm`, whose error is of the order of its square
_POWER_STEPS, _POWER_TOLERANCE = 500, 1e-12


def mpm(A: FloatArray, w: FloatArray, start: FloatArray) -> Mean:
    """The midpoint of the power means of orders 0.01 and -0.01 (Congedo, Barachant & Bhatia 2017)."""
    # It is only near the Frechet mean: off by 1e-5 where conditions are below 100, by more for matrices farther apart.
    (above, up), (below, down) = (_power_mean(A, w, start, order) for order in (_ORDER, -_ORDER))
    U, scales, _ = np.linalg.svd(np.linalg.solve(above, below))
    return _known(A, w, above @ (U * np.sqrt(scales)[:, None, :]), up + down)


def _power_mean(A: FloatArray, w: FloatArray, T: FloatArray, order: float) -> tuple[FloatArray, int]:
    """T for which the mean of (T^-1 A_i A_i^T T^-T)^order is 1, by that paper's fixed point, and the steps taken."""
    for count in range(_POWER_STEPS):  # noqa: B007 the steps taken
        inverse = np.linalg.inv(T)[:, None]
        power = np.zeros_like(T)
        for part in whitened_sets.pieces(A):
            U, scales, _ = np.linalg.svd(inverse @ A[:, part])
            power += np.einsum("bi,bija,bia,bika->bjk", w[:, part], U, scales ** (2.0 * order), U, optimize=True)
        values, U = np.linalg.eigh(power)
        if np.abs(values - 1.0).max() <= _POWER_TOLERANCE:
            break
        # 3/8 of the step that commuting matrices would need; in terms of T T^T it is 3/4.
        T = T @ ((U * values[:, None, :] ** (0.375 / order)) @ whitened_sets.transposed(U))
    return T, count


METHODS = {method.__name__: method for method in (newton, gradient, mpm, log_euclidean, log_cholesky, arithmetic)}


# ---- 2 x 2 matrices ------------------------------------------------------------------------------

# Doubles of one array, of which a dozen are in use; BLAS starts no threads for the product of so few.
_CHUNK = 10_000
_MANY_POINTS, _STRIDE = 8192, 8  # from this number on the start is found by every eighth matrix
_CENTRE_STEPS = 10
_SQRT2 = np.sqrt(2.0)  # ratio of a gradient's length in the metric of SPD(2) to that in the plane


class _Plane(NamedTuple):
    """Points x, y, the inverse of y, and weights of sum 1, each of shape (B, N)."""

    x: FloatArray
    y: FloatArray
    inverse: FloatArray
    w: FloatArray

    def mean(self, values: FloatArray) -> FloatArray:
        """Weighted means of values (B, N)."""
        return sum((_dot(self.w[:, part], values[:, part]) for part in _slices(self.w)), np.zeros(len(self.w)))


class _Moments(NamedTuple):
    """Weighted means about a trial centre, of shape (B,), or (2, B) for vectors."""

    gradient: FloatArray  # the mean of r times the direction to the point
    square: FloatArray  # of r^2
    cosh: FloatArray  # of cosh r
    step: FloatArray  # Newton's: what the Hessian maps to the gradient
    bend: FloatArray  # of r coth r


def plane_points(A: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Coordinates v, x and y (3, B, N) of sets of matrices (B, N, 2, 2), and a mask of singular or non-finite ones."""
    found, wrong = np.empty((3, *A.shape[:2])), np.zeros(A.shape[:2], dtype=bool)
    for part in _slices(A):
        v, x, y = piece = found[:, :, part]
        _locate(A[:, part], piece)
        # If a square may be out of range, each matrix is divided by a power of 2; NaN compares as false.
        if not (v.min() > -600 and y.min() > 1e-30 and y.max() < 1e30 and math.isfinite(x.sum())):
            exponents = np.frexp(np.abs(A[:, part]).max(axis=(2, 3)))[1]
            _locate(np.ldexp(A[:, part], -exponents[:, :, None, None]), piece)
            v += 2.0 * np.log(2.0) * exponents
            wrong[:, part] = ~(np.isfinite(v) & np.isfinite(x) & np.isfinite(y) & (y > 0))
    return found, wrong


def _locate(A: FloatArray, found: FloatArray) -> None:
    """Write the coordinates v, x and y of matrices (B, M, 2, 2) into `found` (3, B, M)."""
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


def newton_in_plane(points: FloatArray, w: FloatArray, start: FloatArray | None = None) -> Mean:
    """The Frechet mean by Newton's method, weights w of shape (B, N) and sum 1; `start`: x and y, shape (2, B)."""
    v, x, y = points
    plane, squares = _Plane(x, y, 1.0 / y, w), np.empty(w.shape)
    centre = _start(plane) if start is None else start
    active, iterations = np.ones(len(w), dtype=bool), np.zeros(len(w), dtype=int)
    best, previous, expected = np.full((3, len(w)), np.inf)
    floor, length, base, step = np.zeros(len(w)), np.ones(len(w)), centre, np.zeros((2, len(w)))
    for count in range(_NEWTON_STEPS + 1):
        # The Hessian is not needed if the last step left no error.
        last = bool((expected <= floor).all()) or count == _NEWTON_STEPS
        if not last:
            found = _moments(plane, centre)
            size = _SQRT2 * np.hypot(*found.gradient)
            # Rounding of the points and of the centre.
            floor = 4.0 * whitened_sets.EPS * (found.cosh + np.abs(centre[0] / centre[1]))
            last = bool((settled(size, previous, floor) | ~active).all())
        if last:
            size = _SQRT2 * np.hypot(*_distances(plane, centre, squares))
            active &= ~settled(size, previous, floor)
            if count == _NEWTON_STEPS or not active.any():
                break
            found = _moments(plane, centre)
        active &= ~settled(size, previous, floor)
        # Newton's error is a constant, estimated from the steps so far, times the square of the error before.
        constant = size / (length * length) if count else 0.1
        risen = active & (found.square > best * (1.0 + 1e-9) + 10.0 * floor * np.sqrt(found.square))
        fresh = found.step * active
        if risen.any():
            base, step = np.where(risen, base, centre), np.where(risen, 0.5 * step, fresh)
            best, previous = np.where(risen, best, found.square), np.where(risen, previous, size)
        else:
            base, step, best, previous = centre, fresh, found.square, size
        length = np.maximum(np.hypot(step[0], step[1]), 1e-150)
        if (length > 1.0).any():
            step = step * np.where(risen, 1.0, damping(length, found.bend))
        expected = constant * length * length
        iterations += active
        centre = _move(base, step)
    v0 = plane.mean(v)
    for part in _slices(plane.w):
        square, dv = squares[:, part], v[:, part] - v0[:, None]
        dv *= dv
        square += dv
        square *= 0.5
    (x0, y0), T = centre, np.zeros((len(w), 2, 2))
    T[:, 0, 0] = np.exp(0.5 * v0) / np.sqrt(y0)
    T[:, 1, 0] = x0 * T[:, 0, 0]
    T[:, 1, 1] = y0 * T[:, 0, 0]
    return Mean(T, plane.mean(squares), size, iterations, floor, squares, np.ones(len(w), dtype=bool))


def _start(plane: _Plane) -> FloatArray:
    """The centroid on the hyperboloid; for many points that of every eighth, after one Newton step."""
    # For matrices of determinant 1 it is the midpoint of their arithmetic and their harmonic mean.
    many = plane.w.shape[1] >= _MANY_POINTS
    if many:
        some = plane.w[:, ::_STRIDE].copy()
        total = some.sum(axis=1, keepdims=True)
        many = bool((total > 0).all())
    if many:
        x, y = (values[:, ::_STRIDE].copy() for values in (plane.x, plane.y))
        plane = _Plane(x, y, 1.0 / y, some / total)
    centre = np.array([plane.mean(plane.x), np.exp(plane.mean(np.log(plane.y)))])
    for _ in range(_CENTRE_STEPS):
        sums = np.zeros((3, len(plane.w)))  # the weighted means of s and of cosh r
        for part in _slices(plane.w):
            seen, weight = _seen(plane, part, centre), plane.w[:, part]
            for row, values in zip(sums, seen, strict=False):
                row += _dot(weight, values)
        length = np.hypot(sums[0], sums[1])
        # For points far on one side cosh and length cancel, so that it takes some steps instead of one.
        ratio = np.minimum(length / sums[2], 1.0 - 1e-12)
        centre = _move(centre, sums[:2] * (np.arctanh(ratio) / np.where(length > 0, length, 1.0)))
        if (ratio < 0.9).all():
            break
    if many:
        found = _moments(plane, centre)
        centre = _move(centre, found.step * damping(np.hypot(*found.step), found.bend))
    return centre


def _dot(a: FloatArray, b: FloatArray) -> Any:
    """Sums of a b over the last axis; for one set by BLAS, which starts no threads for so few."""
    return a[0] @ b[0] if len(a) == 1 else np.einsum("bi,bi->b", a, b)


def _slices(sets: FloatArray) -> Iterator[slice]:
    """Slices of the second axis that stay in a processor's cache."""
    count = sets.shape[1]
    step = math.ceil(count / math.ceil(count / _CHUNK))
    return (slice(start, start + step) for start in range(0, count, step))


def _seen(plane: _Plane, part: slice, centre: FloatArray) -> tuple[FloatArray, ...]:
    """Points as seen from a centre: s1, s2 (sinh r times the direction), cosh r, cosh r - 1 and sinh^2 r."""
    # An isometry moves the centre to (0, 1).
    (x0, y0), reciprocal = centre, plane.inverse[:, part]
    dx, dy = plane.x[:, part] - x0[:, None], plane.y[:, part] - y0[:, None]
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
    return dx, s2, cosh, excess, square


def _moments(plane: _Plane, centre: FloatArray) -> _Moments:
    """The weighted means about a centre (2, B)."""
    sums = np.zeros((7, len(plane.w)))
    for part in _slices(plane.w):
        (s1, s2, cosh, _, square), weight = _seen(plane, part, centre), plane.w[:, part]
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
    g1, g2, _, _, h11, h22, h12 = sums
    step = np.array([h22 * g1 - h12 * g2, h11 * g2 - h12 * g1]) / (h11 * h22 - h12 * h12)
    return _Moments(sums[:2], sums[2], sums[3], step, h11 + h22 - 1.0)


def _distances(plane: _Plane, centre: FloatArray, squares: FloatArray) -> FloatArray:
    """The gradient about a centre; writes r^2 with full relative accuracy into `squares`."""
    gradient = np.zeros((2, len(plane.w)))
    for part in _slices(plane.w):
        (s1, s2, _, excess, square), weight = _seen(plane, part, centre), plane.w[:, part]
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


def _move(centre: FloatArray, step: FloatArray) -> FloatArray:
    """The end of the geodesic from a centre in the direction and of the length of `step`, all of shape (2, B)."""
    length = np.hypot(step[0], step[1])
    slope = np.sinh(length) / np.maximum(length, 1e-300)
    y0 = centre[1] / (np.cosh(length) - step[1] * slope)
    return np.array([centre[0] + y0 * step[0] * slope, y0])
