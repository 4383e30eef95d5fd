"""Images of more than 8 bits a colour: whole numbers of 16 bits, and floating-point numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from projdist._typing import AnyArray, BoolArray, FloatArray
from projdist.applications.mosaics.libraries import opencv

if TYPE_CHECKING:
    from PIL import Image

__all__ = ["DEEPEST", "Deep", "Levels", "array_of", "common_levels", "is_deep", "nothing_of", "read_deep"]

DEEPEST = 65535
_PNG_DEPTH = 24  # the byte of a PNG that has the bits a colour (PNG specification, 11.2.2)
_TIFF_DEPTH, _TIFF_NOTHING = 258, 42113  # tags: BitsPerSample, and GDAL's for the value that stands for no data
_KINDS = "uif"


class Levels(NamedTuple):
    """The values of black and white."""

    low: float
    high: float


class Deep(NamedTuple):
    """Values (height, width, 1 or 3) as a file has them, and where there are any (height, width)."""

    values: FloatArray
    seen: BoolArray

    def scaled(self, levels: Levels, top: int) -> AnyArray:
        """Red, green and blue (height, width, 3), whole numbers from 0 to the top, black where there is nothing."""
        share = (self.values - levels.low) / ((levels.high - levels.low) or 1.0)
        share = np.where(self.seen[..., None], np.clip(share, 0.0, 1.0), 0.0)
        colours = np.round(top * share).astype(np.uint8 if top < 256 else np.uint16)
        return np.repeat(colours, 3, axis=2) if colours.shape[2] == 1 else colours


def common_levels(images: Sequence[Callable[[], Deep]], are_whole: bool) -> Levels:
    """One range for all images: of whole numbers 0 to the most of as many bits as hold all of them, else what there is.

    So 12 bits in files of 16 have the whole range of greys.
    """
    ends = []
    for image in images:
        deep = image()
        if deep.seen.any():
            seen = deep.values[deep.seen]
            ends.append((float(seen.min()), float(seen.max())))
    low, high = (min(low for low, _ in ends), max(high for _, high in ends)) if ends else (0.0, 1.0)
    if are_whole and low >= 0.0:
        return Levels(0.0, float(2 ** max(8, int(high).bit_length()) - 1))
    return Levels(low, high)


def is_deep(image: Image.Image, path: Path | None) -> bool:
    """Whether an image that Pillow has opened has more than 8 bits a colour, which Pillow may not say."""
    if image.mode.startswith("I") or image.mode == "F":
        return True
    if image.format == "PNG" and path is not None:
        with path.open("rb") as file:
            head = file.read(_PNG_DEPTH + 1)
        return len(head) > _PNG_DEPTH and head[_PNG_DEPTH] > 8
    bits = getattr(image, "tag_v2", {}).get(_TIFF_DEPTH, (8,))
    return max(bits if isinstance(bits, tuple) else (bits,)) > 8


def array_of(source: AnyArray) -> Deep:
    """An array (height, width) or (height, width, 1, 3 or 4), the fourth being alpha; raises ValueError for others."""
    if source.dtype.kind not in _KINDS or source.ndim not in (2, 3) or source.shape[2:] not in ((), (1,), (3,), (4,)):
        raise ValueError(f"its shape is {source.shape}, of {source.dtype}")
    values = np.asarray(source, dtype=float).reshape(*source.shape[:2], -1)
    seen = np.asarray(np.isfinite(values).all(axis=2))
    if values.shape[2] == 4:
        seen &= values[..., 3] > 0.5 * (np.iinfo(source.dtype).max if source.dtype.kind != "f" else 1.0)
        values = values[..., :3]
    return Deep(np.where(seen[..., None], values, 0.0), seen)


def read_deep(path: Path, nothing: float | None, orientation: int) -> Deep:
    """The values of a file, upright; raises ValueError, and ImportError without OpenCV.

    `nothing`: the value that stands for no data.
    """
    cv2 = opencv()
    read = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if read is None:
        raise ValueError("it is broken, or its pixels are of a kind that OpenCV does not know")
    if read.ndim == 3 and read.shape[2] >= 3:
        read = read[..., [2, 1, 0, *range(3, read.shape[2])]]
    deep = array_of(_upright(read, orientation))
    if nothing is None:
        return deep
    seen = deep.seen & ~(deep.values == nothing).all(axis=2)
    return Deep(np.where(seen[..., None], deep.values, 0.0), seen)


def nothing_of(image: Image.Image) -> float | None:
    """The value that stands for no data, as GDAL writes it."""
    text = getattr(image, "tag_v2", {}).get(_TIFF_NOTHING)
    try:
        return None if text is None else float(str(text).strip("\0 "))
    except ValueError:
        return None


def _upright(pixels: AnyArray, orientation: int) -> AnyArray:
    """Pixels turned as EXIF's orientation says."""
    if orientation >= 5:
        pixels = pixels.swapaxes(0, 1)
    # Of 5 to 8 what is to be done after the rows have become columns.
    across, down = {2: (1, 0), 3: (1, 1), 4: (0, 1), 6: (1, 0), 7: (1, 1), 8: (0, 1)}.get(orientation, (0, 0))
    return pixels[:: -1 if down else 1, :: -1 if across else 1]
