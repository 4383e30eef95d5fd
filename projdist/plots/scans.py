"""Scans of old maps, as pictures to draw on."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from projdist._typing import AnyArray, FloatArray
from projdist.applications.mosaics import check_pixels, open_image
from projdist.applications.oldmaps import OldMap, scan_extent
from projdist.support import check_path

_LONGEST = 4000  # pixels of a side that are drawn
_PAPER = 0.7  # of the pixels are darker than blank paper


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
    return Scan(pixels, scan_extent(found, width, height, text))
