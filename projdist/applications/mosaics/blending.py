"""How the images of a mosaic are laid over one another."""

from __future__ import annotations

from typing import Any

import numpy as np

from projdist._typing import AnyArray
from projdist.applications.mosaics.libraries import as_array, opencv

__all__ = ["BLENDS", "blender_of"]

BLENDS = ("multiband", "feather", "none")

_BANDS = 5
# OpenCV's pyramids are of whole numbers of 16 bits and round towards zero in every band: in sixteenths of a grey level,
# what is lost is nothing (38 dB of a known picture become 47), and up to eight images have room in a pixel.
_FINE = 16
_FEATHER = 0.02  # of the full weight a pixel from an image's rim


def blender_of(name: str) -> Any:
    """The blender of a name."""
    cv2 = opencv()
    if name == "multiband":
        return _MultiBand()
    return _Feather() if name == "feather" else cv2.detail.Blender_createDefault(cv2.detail.Blender_NO)


class _MultiBand:
    """OpenCV's blender by bands of frequencies, in finer steps."""

    def __init__(self) -> None:
        self._blender = opencv().detail.MultiBandBlender(0, _BANDS)

    def prepare(self, roi: tuple[int, int, int, int]) -> None:
        """Begin a box: its left, top, width and height."""
        self._blender.prepare(roi)

    def feed(self, colours: AnyArray, mask: AnyArray, corner: tuple[int, int]) -> None:
        """Add a piece of an image."""
        self._blender.feed(_FINE * colours, mask, corner)

    def blend(self, *none: None) -> tuple[AnyArray, AnyArray]:
        """Colours and a mask."""
        colours, mask = self._blender.blend(*none)
        return np.round(as_array(colours) / _FINE), mask


class _Feather:
    """Means by weights that fall to the images' rims, with the methods of OpenCV's blenders.

    OpenCV's own of that kind rounds weighted colours down, and draws dark lines along the rims.
    """

    def prepare(self, roi: tuple[int, int, int, int]) -> None:
        """Begin a box: its left, top, width and height."""
        self._left, self._top, width, height = roi
        self._sum = np.zeros((height, width, 3), np.float32)
        self._weights = np.zeros((height, width), np.float32)

    def feed(self, colours: AnyArray, mask: AnyArray, corner: tuple[int, int]) -> None:
        """Add a piece of an image, which ends where its mask or the piece does."""
        cv2 = opencv()
        distance = cv2.distanceTransform(np.pad(mask, 1), cv2.DIST_L2, 3)[1:-1, 1:-1]
        weight = np.minimum(distance * _FEATHER, 1.0)
        (height, width), x, y = mask.shape, corner[0] - self._left, corner[1] - self._top
        place = slice(y, y + height), slice(x, x + width)
        self._sum[place] += weight[..., None] * colours
        self._weights[place] += weight

    def blend(self, *_: None) -> tuple[AnyArray, AnyArray]:
        """Colours and a mask."""
        with np.errstate(invalid="ignore"):
            colours = np.round(self._sum / self._weights[..., None])
        return np.nan_to_num(colours), self._weights > 0
