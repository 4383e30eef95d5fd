"""Files of drawn mosaics."""

from __future__ import annotations

import io
import os
from pathlib import Path

import numpy as np

from projdist.applications.mosaics.libraries import opencv
from projdist.applications.mosaics.rendering import Rendered
from projdist.support import replacing

__all__ = ["DEEP_SUFFIXES", "PICTURE_SUFFIXES", "save_mosaic"]

DEEP_SUFFIXES = (".png", ".tif", ".tiff")
PICTURE_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff")

_FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".tif": "TIFF", ".tiff": "TIFF"}
_QUALITY = 92  # of JPEG
_SQUEEZE = 3  # of PNG: a third of the usual 6's time, for files as large to 5 %
_PAPER = 255  # where a JPEG has no image


def save_mosaic(drawn: Rendered, path: str | os.PathLike[str], *, overwrite: bool = True) -> Path:
    """Write a mosaic as .png or .tif, transparent where no image is, or as .jpg, white there.

    Grey images make a grey mosaic. 16 bits a colour go to .png and .tif, by OpenCV, in four bands. Raises ValueError
    for another suffix, FileExistsError and OSError.
    """
    from PIL import Image  # slow to load, and few need it

    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in _FORMATS:
        raise ValueError(f"Invalid picture file '{path}'. Its suffix must be {', '.join(PICTURE_SUFFIXES)}.")
    if drawn.pixels.dtype == np.uint16:
        return _save_deep(drawn, path, overwrite=overwrite)
    pixels = drawn.bands
    form = _FORMATS[suffix]
    options: dict[str, object] = {"compression": "tiff_lzw"} if form == "TIFF" else {"compress_level": _SQUEEZE}
    if form == "JPEG":
        pixels = np.where(pixels[..., -1:] > 0, pixels[..., :-1], np.uint8(_PAPER)).squeeze()
        options = {"quality": _QUALITY}
    content = io.BytesIO()
    Image.fromarray(pixels).save(content, format=form, **options)
    return _written(content.getvalue(), path, overwrite)


def _save_deep(drawn: Rendered, path: Path, *, overwrite: bool) -> Path:
    suffix = path.suffix.lower()
    if suffix not in DEEP_SUFFIXES:
        raise ValueError(f"Invalid picture file '{path}'. For 16 bits a colour its suffix must be .png, .tif or .tiff.")
    encoded = opencv().imencode(suffix, drawn.pixels[..., [2, 1, 0, 3]])[1]
    return _written(encoded.data, path, overwrite)


def _written(content: bytes | memoryview, path: Path, overwrite: bool) -> Path:
    """The path of a file that has the content: what codecs make of a disk that is full is theirs."""
    with replacing(path, overwrite=overwrite) as new:
        new.write_bytes(content)
    return path
