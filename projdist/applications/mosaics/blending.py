"""How the images of a mosaic are laid over one another.

OpenCV's own blenders count in whole numbers of 16 bits, which have no room for images of 16, and lose in every band.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from projdist._typing import AnyArray, BoolArray
from projdist.applications.mosaics.libraries import opencv

__all__ = ["BLENDS", "Blender", "blender_of"]

BLENDS = ("multiband", "feather", "none")

_BANDS = 5
_UNIT = 2**_BANDS  # pixels: pyramids begin at multiples of it, so that those of all pieces have their pixels together
_REACH = 3 * _UNIT  # of a pixel through the bands
_LITTLE = 1e-5  # a weight that is none
_FEATHER = 0.02  # of the full weight a pixel from an image's rim

Place = tuple[slice, slice]


class Blender(Protocol):
    """Pieces of images become a box of the canvas; they lie within it."""

    def feed(self, colours: AnyArray, mask: AnyArray, corner: tuple[int, int]) -> None:
        """Add a piece of an image, which ends where its mask or the piece does."""

    def blend(self) -> tuple[AnyArray, BoolArray]:
        """Colours (height, width, 3), and where there are any."""


def blender_of(name: str, box: tuple[int, int, int, int]) -> Blender:
    """The blender of a name, for a box: its left, top, right and bottom."""
    kinds: dict[str, Callable[[tuple[int, int, int, int]], Blender]] = {
        "multiband": _MultiBand,
        "feather": _Feather,
        "none": _Later,
    }
    return kinds[name](box)


class _Box:
    """Sums of colours by weights."""

    def __init__(self, box: tuple[int, int, int, int]) -> None:
        self._left, self._top = box[:2]
        self._shape = box[3] - box[1], box[2] - box[0]
        self._sum = np.zeros((*self._shape, 3), np.float32)
        self._weights = np.zeros(self._shape, np.float32)

    def _place(self, mask: AnyArray, corner: tuple[int, int]) -> Place:
        """Where a piece lies in the box."""
        (height, width), x, y = mask.shape, corner[0] - self._left, corner[1] - self._top
        return slice(y, y + height), slice(x, x + width)

    def blend(self) -> tuple[AnyArray, BoolArray]:
        """Their means."""
        self._sum /= np.maximum(self._weights, _LITTLE)[..., None]
        return self._sum, self._weights > 0


class _Later(_Box):
    """Later pieces lie on earlier ones."""

    def feed(self, colours: AnyArray, mask: AnyArray, corner: tuple[int, int]) -> None:
        """Lay a piece on what there is."""
        place = self._place(mask, corner)
        opencv().copyTo(colours.astype(np.float32), mask, self._sum[place])
        self._weights[place][mask > 0] = 1.0


class _Feather(_Box):
    """Means by weights that fall to the images' rims."""

    def feed(self, colours: AnyArray, mask: AnyArray, corner: tuple[int, int]) -> None:
        """Add a piece."""
        cv2 = opencv()
        distance = cv2.distanceTransform(np.pad(mask, 1), cv2.DIST_L2, 3)[1:-1, 1:-1]
        weight = np.minimum(distance * _FEATHER, 1.0)
        place = self._place(mask, corner)
        self._sum[place] += weight[..., None] * colours
        self._weights[place] += weight


class _MultiBand(_Box):
    """Means by bands of frequencies, in each by masks that are as smooth as the band.

    P. J. Burt & E. H. Adelson 1983, "A multiresolution spline with application to image mosaics", ACM Transactions on
    Graphics 2, 217-236.
    """

    def __init__(self, box: tuple[int, int, int, int]) -> None:
        self._left, self._top = box[:2]
        self._shape = box[3] - box[1], box[2] - box[0]
        height, width = (-(-side // _UNIT) * _UNIT for side in self._shape)
        shapes = [(height >> band, width >> band) for band in range(_BANDS + 1)]
        self._sums = [np.zeros((*shape, 3), np.float32) for shape in shapes]
        self._bands = [np.zeros(shape, np.float32) for shape in shapes]

    def feed(self, colours: AnyArray, mask: AnyArray, corner: tuple[int, int]) -> None:
        """Add a piece."""
        cv2 = opencv()
        rows, columns = self._place(mask, corner)
        height, width = self._bands[0].shape
        top, left = (max(side.start - _REACH, 0) // _UNIT * _UNIT for side in (rows, columns))
        bottom, right = (
            min(-(-(side.stop + _REACH) // _UNIT) * _UNIT, most) for side, most in ((rows, height), (columns, width))
        )
        around = rows.start - top, bottom - rows.stop, columns.start - left, right - columns.stop
        part = cv2.copyMakeBorder(colours.astype(np.float32), *around, cv2.BORDER_REFLECT)
        weight = cv2.copyMakeBorder((mask > 0).astype(np.float32), *around, cv2.BORDER_CONSTANT)
        for band in range(_BANDS + 1):
            place = slice(top >> band, bottom >> band), slice(left >> band, right >> band)
            detail = part
            if band < _BANDS:
                smaller = cv2.pyrDown(part)
                detail, part = part - cv2.pyrUp(smaller, dstsize=part.shape[1::-1]), smaller
            self._sums[band][place] += weight[..., None] * detail
            self._bands[band][place] += weight
            weight = cv2.pyrDown(weight)

    def blend(self) -> tuple[AnyArray, BoolArray]:
        """The bands together."""
        cv2 = opencv()
        height, width = self._shape
        found: AnyArray = np.zeros((1, 1, 3))
        for band in reversed(range(_BANDS + 1)):
            level = self._sums[band] / (self._bands[band] + _LITTLE)[..., None]
            found = level if band == _BANDS else level + cv2.pyrUp(found, dstsize=level.shape[1::-1])
        seen = np.asarray(self._bands[0][:height, :width] > _LITTLE)
        return np.ascontiguousarray(found[:height, :width]), seen
