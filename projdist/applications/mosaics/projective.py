"""Affine maps and homographies of the plane as 3 x 3 matrices, their fit to points, and their Jacobians."""

from __future__ import annotations

import numpy as np

from projdist._typing import FloatArray

__all__ = ["CHOICES", "ENTRIES", "LEAST", "MODELS", "check_model", "fit", "homogeneous", "jacobians", "normalised"]

MODELS = ("affine", "homography")
CHOICES = (*MODELS, "auto")
LEAST = {"affine": 3, "homography": 4}  # points that determine a map
# The entries that a map is changed in, at the identity: all but the last, or two rows.
ENTRIES = {
    model: [(a, b) for a in range(rows) for b in range(3)][:8] for model, rows in zip(MODELS, (2, 3), strict=True)
}


def check_model(model: str) -> str:
    """The name of a model or auto; raises ValueError for another."""
    if model not in CHOICES:
        raise ValueError(f"Invalid model '{model}'. It must be affine, homography or auto.")
    return model


def homogeneous(x: FloatArray) -> FloatArray:
    """Points (..., 2) with a 1 behind, (..., 3)."""
    return np.concatenate([x, np.ones((*x.shape[:-1], 1))], axis=-1)


def normalised(H: FloatArray, x: FloatArray) -> FloatArray:
    """H (..., 3, 3) of either sign, scaled: an affine map's last entry is 1, else the determinant is 1 or -1.

    The third coordinates of the images of points x (..., n, 2) are then positive in the mean. The determinant's sign is
    that of the Jacobian: -1 where H mirrors.
    """
    third = np.einsum("...j,...nj->...n", H[..., 2, :], homogeneous(x)).mean(axis=-1)
    affine = (H[..., 2, :2] == 0).all(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.where(affine, np.abs(third), np.cbrt(np.abs(np.linalg.det(H))))
        return np.asarray(H / (np.sign(third) * size)[..., None, None])


def fit(x: FloatArray, y: FloatArray, model: str) -> FloatArray:
    """The maps that take points x (..., n, 2) to points y with the least algebraic error, (..., 3, 3).

    Coordinates should be of the order of 1 (R. Hartley 1997, "In defense of the eight-point algorithm"). What points
    do not determine is not finite, or noise.
    """
    x1, zero = homogeneous(x), np.zeros((*x.shape[:-1], 3))
    A = np.concatenate(
        [
            np.concatenate([x1, zero, -y[..., :1] * x1], axis=-1),
            np.concatenate([zero, x1, -y[..., 1:] * x1], axis=-1),
        ],
        axis=-2,
    )
    columns = [0, 1, 2, 3, 4, 5, 8] if model == "affine" else list(range(9))
    vector = np.linalg.svd(np.linalg.qr(A[..., columns], mode="r"))[2][..., -1, :]
    H = np.zeros((*x.shape[:-2], 9))
    H[..., columns] = vector
    return normalised(H.reshape(*x.shape[:-2], 3, 3), x)


def places(H: FloatArray, x: FloatArray) -> FloatArray:
    """Where maps (N, 3, 3) take points (N, n, 2)."""
    y = np.einsum("kij,kmj->kmi", H[:, :, :2], x) + H[:, None, :, 2]
    return np.asarray(y[..., :2] / y[..., 2:])


def jacobians(H: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of maps (N, 3, 3) at points (N, n, 2): the images (N, n, 2) and the Jacobians (N, n, 2, 2)."""
    y = np.einsum("kij,knj->kni", H, homogeneous(x))
    image = y[..., :2] / y[..., 2:]
    slopes = H[:, None, :2, :2] - image[..., :, None] * H[:, None, 2:, :2]
    return image, np.asarray(slopes / y[..., 2:, None])
