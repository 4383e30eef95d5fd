"""Files of drawn mosaics."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from projdist.applications.mosaics.rendering import Rendered
from projdist.support import replacing

__all__ = ["PICTURE_SUFFIXES", "save_mosaic"]

PICTURE_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff")

_FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".tif": "TIFF", ".tiff": "TIFF"}
_QUALITY = 92  # of JPEG
_SQUEEZE = 3  # of PNG: a third of the usual 6's time, for files as large to 5 %
_PAPER = 255  # where a JPEG has no image


def save_mosaic(drawn: Rendered, path: str | os.PathLike[str], *, overwrite: bool = True) -> Path:
    """Write a mosaic as .png or .tif, transparent where no image is, or as .jpg, white there.

    Grey images make a grey mosaic. Raises ValueError for another suffix, FileExistsError and OSError.
    """
    from PIL import Image  # slow to load, and few need it

    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in _FORMATS:
        raise ValueError(f"Invalid picture file '{path}'. Its suffix must be {', '.join(PICTURE_SUFFIXES)}.")
    pixels = drawn.bands
    form = _FORMATS[suffix]
    options: dict[str, object] = {"compression": "tiff_lzw"} if form == "TIFF" else {"compress_level": _SQUEEZE}
    if form == "JPEG":
        pixels = np.where(pixels[..., -1:] > 0, pixels[..., :-1], np.uint8(_PAPER)).squeeze()
        options = {"quality": _QUALITY}
    with replacing(path, overwrite=overwrite) as new:
        Image.fromarray(pixels).save(new, format=form, **options)
    return path
