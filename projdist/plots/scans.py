"""Scans of old maps, as pictures to draw on."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from projdist._typing import AnyArray, FloatArray
from projdist.applications.mosaics import check_pixels, open_image
from projdist.applications.oldmaps import OldMap
from projdist.support import check_path

_LONGEST = 4000  # pixels of a side that are drawn
_PAPER = 0.7  # of the pixels are darker than blank paper
_BEYOND = 0.05  # of a side: points as far outside are still on a scan that was cut


@dataclass(frozen=True, eq=False)
class Scan:
    """Pixels, and the old map's coordinates of the left, right, bottom and top side."""

    pixels: AnyArray
    extent: tuple[float, float, float, float]

    def brightness(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Shape (y, x): that of the pixels there, 1 for blank paper."""
        left, right, bottom, top = self.extent
        height, width = self.pixels.shape[:2]
        columns = np.clip(((x - left) / (right - left) * width).astype(int), 0, width - 1)
        rows = np.clip(((y - top) / (bottom - top) * height).astype(int), 0, height - 1)
        grey = self.pixels[rows[:, None], columns].mean(axis=-1)
        return np.minimum(grey / max(float(np.quantile(grey, _PAPER)), 1.0), 1.0)


def read_scan(path: str | os.PathLike[str], found: OldMap) -> Scan:
    """A scan in whose pixels the control points are; raises ValueError for what is none, or where they are outside."""
    path = check_path("image", path)
    text = f"Invalid image '{path}'."
    with open_image(path, text) as image:
        width, height = image.size
        image.draft("RGB", (_LONGEST, _LONGEST))  # a JPEG is read at a part of its size
        check_pixels(image)
        image.thumbnail((_LONGEST, _LONGEST))
        pixels = np.asarray(image.convert("RGB"))
    extent = _extent(found.points.old, found.is_mirrored, width, height)
    share = (found.points.old - [extent[0], min(extent[2:])]) / [width, height]
    outside = np.asarray((np.abs(share - 0.5) > 0.5 + _BEYOND).any(axis=1))
    if outside.any():
        name = found.points.names[int(np.argmax(outside))]
        raise ValueError(
            f"{text} It has {width} by {height} pixels, and {int(outside.sum())} of {len(outside)} control points lie "
            f"outside, as '{name}'."
        )
    return Scan(pixels, extent)


def _extent(old: FloatArray, is_mirrored: bool, width: int, height: int) -> tuple[float, float, float, float]:
    """Rows are counted downwards, or, where that is not so, upwards, or downwards by negative numbers as QGIS does."""
    if is_mirrored:
        return 0.0, float(width), float(height), 0.0
    if old[:, 1].mean() < 0:
        return 0.0, float(width), -float(height), 0.0
    return 0.0, float(width), 0.0, float(height)
