"""What a box of the canvas has of an image."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray
from projdist.applications.mosaics.homographies import corners
from projdist.applications.mosaics.images import Picture, Pixels
from projdist.applications.mosaics.libraries import opencv
from projdist.applications.mosaics.projective import jacobians

__all__ = ["Box", "Piece", "Store", "common_box", "reduced", "shift", "warped"]

_KEPT = 3e8  # bytes of images that are kept for the next box
_HALF = 0.5  # an image that is drawn smaller than that is reduced first

Box = tuple[int, int, int, int]  # left, top, right, bottom


class Piece(NamedTuple):
    """Colours and a mask, and their place on the canvas, left and top."""

    corner: tuple[int, int]
    pixels: Pixels

    def window(self, left: int, top: int) -> tuple[slice, slice]:
        """Where it is in an array that begins at (left, top)."""
        height, width = self.pixels.mask.shape
        x, y = self.corner[0] - left, self.corner[1] - top
        return slice(y, y + height), slice(x, x + width)


class Store:
    """The images, read when they are needed; the last ones are kept."""

    def __init__(self, pictures: Sequence[Picture], deep: bool = False) -> None:
        """`deep`: with 16 bits a colour."""
        self.pictures, self._deep = pictures, deep
        self._kept: OrderedDict[int, Pixels] = OrderedDict()

    def read(self, number: int) -> Pixels:
        """The pixels of an image."""
        if number not in self._kept:
            self._kept[number] = _filled(self.pictures[number].read(deep=self._deep))
            while len(self._kept) > 1 and sum(one.colours.nbytes for one in self._kept.values()) > _KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(number)
        return self._kept[number]


def _filled(pixels: Pixels) -> Pixels:
    """Transparent pixels in the colour of the nearest others, which blending must not darken."""
    seen = pixels.mask > 0
    if seen.all() or not seen.any():
        return pixels
    cv2 = opencv()
    nearest = cv2.distanceTransformWithLabels(255 - pixels.mask, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)[1]
    numbers = np.zeros(nearest.max() + 1, int)
    numbers[nearest[seen]] = np.flatnonzero(seen)
    return Pixels(pixels.colours.reshape(-1, 3)[numbers[nearest]], pixels.mask)


def common_box(a: Box, b: Box) -> Box | None:
    """What two boxes have in common."""
    box = max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3])
    return box if box[0] < box[2] and box[1] < box[3] else None


def shift(x: float, y: float) -> FloatArray:
    """The matrix of a shift."""
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]])


def warped(pixels: Pixels, H: FloatArray, box: Box) -> Piece:
    """An image under its map, in a box of the canvas."""
    cv2 = opencv()
    height, width = pixels.mask.shape
    J = jacobians(H[None], corners(np.array([[float(width), float(height)]])))[1]
    pixels, factor = reduced(pixels, float(np.linalg.svd(J, compute_uv=False).max()))
    H = H @ np.diag([*(1.0 / factor), 1.0])
    # OpenCV counts from the middle of the first pixel.
    to_box = shift(-box[0] - 0.5, -box[1] - 0.5) @ H @ shift(0.5, 0.5)
    shape = box[2] - box[0], box[3] - box[1]
    colours = cv2.warpPerspective(
        pixels.colours, to_box, shape, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT_101
    )
    mask = cv2.warpPerspective(pixels.mask, to_box, shape, flags=cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT)
    return Piece(box[:2], Pixels(colours, mask))


def reduced(pixels: Pixels, scale: float) -> tuple[Pixels, FloatArray]:
    """An image reduced to about the scale at which it is drawn, where that is less than half; and by what it was."""
    if scale >= _HALF:
        return pixels, np.ones(2)
    cv2 = opencv()
    height, width = pixels.mask.shape
    small = max(1, round(scale * width)), max(1, round(scale * height))
    colours = cv2.resize(pixels.colours, small, interpolation=cv2.INTER_AREA)
    mask = cv2.resize(pixels.mask, small, interpolation=cv2.INTER_NEAREST)
    return Pixels(colours, mask), np.array(small) / [width, height]
