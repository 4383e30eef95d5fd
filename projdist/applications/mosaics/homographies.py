"""Affine maps and homographies of images: their fit, their distortion, and the plane with the least distortion."""

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.matrices import mdt

MODELS = ("affine", "homography")
CHOICES = (*MODELS, "auto")
LEAST = {"affine": 3, "homography": 4}  # points that determine a map
# The free entries of a map near the identity: two rows, or all but the last.
_ENTRIES = [(a, b) for a in range(3) for b in range(3)]
ENTRIES = {"affine": _ENTRIES[:6], "homography": _ENTRIES[:8]}


def homogeneous(x: FloatArray) -> FloatArray:
    """Homogeneous coordinates (..., 3) of points (..., 2)."""
    return np.concatenate([x, np.ones((*x.shape[:-1], 1))], axis=-1)


def normalised(H: FloatArray, x: FloatArray) -> FloatArray:
    """H (..., 3, 3) scaled so that the last entry of an affine map is 1, and the determinant of others 1 or -1."""
    # Third coordinates of images of points x (..., n, 2) are then positive on average, and det H < 0 if H mirrors.
    third = np.einsum("...j,...nj->...n", H[..., 2, :], homogeneous(x)).mean(axis=-1)
    affine = (H[..., 2, :2] == 0).all(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.where(affine, np.abs(third), np.cbrt(np.abs(np.linalg.det(H))))
        return np.asarray(H / (np.sign(third) * size)[..., None, None])


def fit(x: FloatArray, y: FloatArray, model: str) -> FloatArray:
    """Maps (..., 3, 3) from points x (..., n, 2) to points y with the least algebraic error."""
    # Coordinates should be of the order of 1 (R. Hartley 1997, "In defense of the eight-point algorithm").
    x1, zero = homogeneous(x), np.zeros((*x.shape[:-1], 3))
    rows = [x1, zero, -y[..., :1] * x1], [zero, x1, -y[..., 1:] * x1]
    A = np.concatenate([np.concatenate(parts, axis=-1) for parts in rows], axis=-2)
    columns = [0, 1, 2, 3, 4, 5, 8] if model == "affine" else list(range(9))
    H = np.zeros((*x.shape[:-2], 9))
    H[..., columns] = np.linalg.svd(np.linalg.qr(A[..., columns], mode="r"))[2][..., -1, :]
    return normalised(H.reshape(*x.shape[:-2], 3, 3), x)


def places(H: FloatArray, x: FloatArray) -> FloatArray:
    """Images (N, n, 2) of points (N, n, 2) under maps (N, 3, 3)."""
    y = np.einsum("kij,kmj->kmi", H[:, :, :2], x) + H[:, None, :, 2]
    return np.asarray(y[..., :2] / y[..., 2:])


def jacobians(H: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Images (N, n, 2) and Jacobians (N, n, 2, 2) of maps (N, 3, 3) at points (N, n, 2)."""
    y = np.einsum("kij,knj->kni", H, homogeneous(x))
    image = y[..., :2] / y[..., 2:]
    slopes = H[:, None, :2, :2] - image[..., :, None] * H[:, None, 2:, :2]
    return image, np.asarray(slopes / y[..., 2:, None])


# ---- the plane with the least distortion -----------------------------------------------------------

_NODES = 12  # Gauss nodes along a side: errors of 1e-15, and of 3e-8 if outer images are enlarged ten times
_MOST_STEPS, _HALVINGS = 60, 40
# Changes of a line, times the size of the mosaic: for differences, and the step at which to stop. With a Hessian
# accurate to 1e-8 the step after one of 1e-9 is rounding.
_DIFFERENCE, _CONVERGED = 1e-4, 1e-9


def corners(sizes: FloatArray) -> FloatArray:
    """Corners (N, 4, 2) of images of widths and heights (N, 2), in order around each."""
    return sizes[:, None] * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def field_of(H: FloatArray, sizes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Jacobians (N, n, 2, 2) of maps of images at Gauss-Legendre nodes, places (N, n, 2), weights (n,) of sum 1."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    along = 0.5 * (nodes + 1.0)
    grid = np.stack(np.meshgrid(along, along), axis=-1).reshape(-1, 2)
    places, J = jacobians(H, grid * sizes[:, None])
    return J, places, np.outer(weights, weights).reshape(-1) / 4.0


def behind(H: FloatArray, sizes: FloatArray) -> BoolArray:
    """True for images (N,) that reach the horizon or lie behind it: a corner's third coordinate is not positive."""
    return np.asarray((np.einsum("kj,knj->kn", H[:, 2], homogeneous(corners(sizes))) <= 0).any(axis=1))


def least_distorting(H: FloatArray, sizes: FloatArray, weights: FloatArray) -> FloatArray | None:
    """Maps (N, 3, 3) of images into the plane that distorts them least, up to a rotation and a shift."""
    # Of the planes of G^-1 H_i, G a homography, it has the least mean over the images, with `weights` of sum 1, of the
    # mean of Dist_F^2 over the image. None if some image reaches infinity in every plane.
    line = _feasible_line(H, sizes)
    if line is None:
        return None
    # Any rows that complete the line to a matrix that does not mirror will do, as the affine part is found below.
    G = np.vstack([np.linalg.svd(line[None])[2][1:], line])
    G[0] *= np.sign(np.linalg.det(G))
    H = np.asarray(G @ H)
    for _ in range(_MOST_STEPS):
        H, size = _whitened(H, sizes, weights)
        cost, gradient = _cost(H, sizes, weights)
        step = _newton_step(H, sizes, weights, gradient, size)
        for _ in range(_HALVINGS):
            tried = _sent(H, step)
            if _cost(tried, sizes, weights)[0] <= cost * (1.0 + 1e-14):
                break
            step = 0.5 * step
        else:
            return H
        H = tried
        if np.abs(step).max() * size < _CONVERGED:
            break
    return _whitened(H, sizes, weights)[0]


def _feasible_line(H: FloatArray, sizes: FloatArray) -> FloatArray | None:
    """The line l that maximises the least l . H_i corner, with their mean 1; None if that is not positive."""
    # With equal determinants of all H_i it is the same line in any plane.
    from scipy.optimize import linprog  # scipy is slow to load, and few need it

    seen = np.einsum("kij,knj->kni", H / np.cbrt(np.linalg.det(H))[:, None, None], homogeneous(corners(sizes)))
    rows = seen.reshape(-1, 3)
    scale = np.abs(rows).max(axis=0)
    rows = rows / scale
    least, mean = np.hstack([-rows, np.ones((len(rows), 1))]), np.append(rows.mean(axis=0), 0.0)[None]
    found = linprog([0.0, 0.0, 0.0, -1.0], least, np.zeros(len(rows)), mean, [1.0], bounds=(None, None), method="highs")
    if found.status != 0 or found.x is None or found.x[3] <= 0:
        return None
    return np.asarray(found.x[:3]) / scale


def _sent(H: FloatArray, line: FloatArray) -> FloatArray:
    """The maps followed by a homography that sends the line (a, b, 1) to infinity."""
    H = H.copy()
    H[:, 2] += np.einsum("a,kaj->kj", line, H[:, :2])
    return H


def _cost(H: FloatArray, sizes: FloatArray, weights: FloatArray) -> tuple[float, FloatArray]:
    """The cost at the best T, and its gradient by the line (a, b, 1) at 0; infinite if an image crosses the horizon."""
    # A small change da multiplies a place p of the plane by 1 - da . p. With L = ln (B B^T), B = T^-1 J, the gradient
    # is minus the mean of p tr L + T L T^-1 p; the change of T with the line is of second order.
    if behind(H, sizes).any():
        return np.inf, np.zeros(2)
    J, p, each = _flat(H, sizes, weights)
    found = mdt(J, each)
    U, scales, _ = np.linalg.svd(np.linalg.solve(found.T, J))
    L = (U * (2.0 * np.log(scales))[:, None]) @ U.swapaxes(-1, -2)
    whitened = np.linalg.solve(found.T, p.T).T
    slopes = p * np.trace(L, axis1=1, axis2=2)[:, None] + np.einsum("ab,nbc,nc->na", found.T, L, whitened)
    return float(found.cost), -(each @ slopes)


def _flat(H: FloatArray, sizes: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Jacobians (m, 2, 2), places (m, 2) and weights (m,) of all nodes of all images."""
    J, places, w = field_of(H, sizes)
    return J.reshape(-1, 2, 2), places.reshape(-1, 2), np.outer(weights, w).reshape(-1)


def _whitened(H: FloatArray, sizes: FloatArray, weights: FloatArray) -> tuple[FloatArray, float]:
    """The maps followed by T^-1 and a shift of the mean place to the origin, and the RMS of the places."""
    J, places, each = _flat(H, sizes, weights)
    G = np.eye(3)
    G[:2, :2] = np.linalg.inv(mdt(J, each).T)
    H, places = G @ H, places @ G[:2, :2].T
    middle = each @ places
    H[:, :2] -= middle[:, None] * H[:, 2:]
    return np.asarray(H), float(np.sqrt(np.mean((places - middle) ** 2)))


def _newton_step(
    H: FloatArray, sizes: FloatArray, weights: FloatArray, gradient: FloatArray, size: float
) -> FloatArray:
    """Newton's step with a Hessian by differences of the gradient, made positive; else a gradient step."""
    h = _DIFFERENCE / size
    ends = [[_cost(_sent(H, sign * h * axis), sizes, weights) for sign in (1.0, -1.0)] for axis in np.eye(2)]
    if not all(np.isfinite(cost) for pair in ends for cost, _ in pair):
        return -gradient / size**2
    hessian = np.stack([(ahead[1] - back[1]) / (2.0 * h) for ahead, back in ends])
    values, axes = np.linalg.eigh(0.5 * (hessian + hessian.T))
    curvature = np.maximum(np.abs(values), 1e-6 * np.abs(values).max())
    return np.asarray(-(axes / curvature) @ (axes.T @ gradient))
