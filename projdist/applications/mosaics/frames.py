"""The common frame of registered images: the plane of one of them, or the mean distorting transformation's."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray
from projdist.applications.mosaics.homographies import behind, corners, field_of, least_distorting
from projdist.applications.mosaics.projective import places
from projdist.applications.mosaics.registration import Registration
from projdist.matrices import Rotation, axes_shift, mdt, mean_rotation

__all__ = ["CommonFrames", "Frame", "common_frames", "frame_of_image"]


class Frame(NamedTuple):
    """A plane that all images are brought into, in pixels.

    `reference`: the number of the image whose plane it is, or None for the MDT's. `matrices`: from the pixels of the
    images into it (n, 3, 3). `distortions`: Dist_F of each image, (n,), of a homography the root of its mean square
    over the image. `figure`: the sum of their squares, of homographies the mean; with weights, by the weights.
    """

    reference: int | None
    matrices: FloatArray
    distortions: FloatArray
    figure: float


def frame_of_image(found: Registration, image: int, weights: FloatArray) -> Frame | None:
    """The plane of an image that was registered; None where it has no room for another image."""
    own = found.images.index(image)
    matrices = np.linalg.solve(found.matrices[own], found.matrices)
    matrices[own] = np.eye(3)
    return None if behind(matrices, found.sizes).any() else _measured(found, image, matrices, weights)


class CommonFrames(NamedTuple):
    """The frames `first`, `last`, `central`, `best` and `mdt`, None where impossible.

    `impossible`: the images in whose planes others reach infinity. `rotation`: that of the MDT's frame.
    """

    frames: dict[str, Frame | None]
    impossible: list[int]
    rotation: Rotation


def common_frames(found: Registration, weights: FloatArray, rotation: str) -> CommonFrames:
    """All frames. Raises ValueError where every plane sends some image through infinity.

    Central is the image whose middle is nearest to the mean of all middles in the MDT's frame, best the one with the
    least figure.
    """
    mean, turn = _mdt_frame(found, weights, rotation)
    of_image = {image: frame_of_image(found, image, weights) for image in found.images}
    possible = [frame for frame in of_image.values() if frame is not None]
    frames = {
        "first": of_image[found.images[0]],
        "last": of_image[found.images[-1]],
        "central": of_image[_central(found, mean)],
        "best": min(possible, key=lambda frame: frame.figure, default=None),
        "mdt": mean,
    }
    return CommonFrames(frames, [image for image, frame in of_image.items() if frame is None], turn)


def _central(found: Registration, mean: Frame) -> int:
    middles = places(mean.matrices, 0.5 * found.sizes[:, None])[:, 0]
    return found.images[int(np.hypot(*(middles - middles.mean(axis=0)).T).argmin())]


def _mdt_frame(found: Registration, weights: FloatArray, rotation: str) -> tuple[Frame, Rotation]:
    """The MDT's frame: its shape by the MDT, turned by the mean rotation, shifted to the axes."""
    H = found.matrices if found.model == "affine" else least_distorting(found.matrices, found.sizes, weights)
    if H is None:
        raise ValueError("Invalid images for one plane. Every plane sends some of them through infinity.")
    J, w = _jacobians(found, H)
    J, each = J.reshape(-1, 2, 2), np.outer(weights, w).reshape(-1)
    T = mdt(J, each).T
    turn = mean_rotation(J, each, T=T, method=rotation)
    G = np.eye(3)
    G[:2, :2] = turn.q @ np.linalg.inv(T)
    H = G @ H
    shift = axes_shift(places(H, corners(found.sizes)).reshape(-1, 2))
    H[:, :2] += shift[:, None] * H[:, 2:]
    return _measured(found, None, H, weights), turn


def _jacobians(found: Registration, H: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Jacobians (n, m, 2, 2) of the images at their nodes, and the nodes' weights; one node of an affine map."""
    if found.model == "affine":
        return H[:, None, :2, :2], np.ones(1)
    J, _, w = field_of(H, found.sizes)
    return J, w


def _measured(found: Registration, reference: int | None, H: FloatArray, weights: FloatArray) -> Frame:
    J, w = _jacobians(found, H)
    squares = (np.log(np.linalg.svd(J, compute_uv=False)) ** 2).sum(axis=-1) @ w
    # With equal weights the figure of affine maps is the plain sum.
    figure = float(weights @ squares) * (len(squares) if found.model == "affine" else 1.0)
    return Frame(reference, H, np.sqrt(squares), figure)
