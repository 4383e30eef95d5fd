"""Images as files have them: upright, with 8 bits a colour, and what of them is transparent."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from projdist._typing import AnyArray

if TYPE_CHECKING:
    from PIL import Image

__all__ = ["Picture", "Pixels", "check_pixels", "open_image", "open_pictures"]

_LONGEST_SIDE = 32766  # pixels: what OpenCV warps
_MOST_PIXELS = 100_000_000  # to read, a gigabyte or two of memory; a file of a few kB may have many more
_ORIENTATION, _SIDEWAYS = 0x0112, (5, 6, 7, 8)  # of EXIF; turned by a quarter
_GREY = ("1", "L", "LA", "La", "I", "I;16", "I;16B", "I;16L", "I;16N")
_DEEP = 257  # 65535 / 255


class Pixels(NamedTuple):
    """Red, green and blue (height, width, 3), and 255 where there is anything (height, width), else 0; of uint8."""

    colours: AnyArray
    mask: AnyArray


@contextmanager
def open_image(source: str | os.PathLike[str] | AnyArray, invalid: str) -> Iterator[Image.Image]:
    """An image, whose pixels are not yet read; what cannot be read, also later, is a ValueError that begins as told."""
    from PIL import Image  # slow to load, and points that are given do without it

    # What Pillow raises for broken files of its many formats; most is an OSError, what is no image, too.
    broken = (OSError, SyntaxError, TypeError, ValueError, NotImplementedError, Image.DecompressionBombError)
    try:
        with warnings.catch_warnings(action="ignore"):  # of sizes, and of broken tags
            if isinstance(source, np.ndarray):
                yield Image.fromarray(source)
            else:
                with Image.open(source) as image:
                    yield image
    except broken as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error).rstrip(".")
        raise ValueError(f"{invalid} It cannot be read: {reason}.") from error


def check_pixels(image: Image.Image) -> None:
    """Raise ValueError for an image of more pixels than are read."""
    width, height = image.size
    if width * height > _MOST_PIXELS:
        raise ValueError(f"{width} x {height} pixels are more than {_MOST_PIXELS:,}")


class Picture:
    """An image: its `name`, its `size` in pixels, width and height, whether it `is_grey`; read when it is needed.

    `source`: a file in any format that Pillow reads, or an array (height, width) or (height, width, 3 or 4) of uint8.
    A file is turned upright as its EXIF data say (`is_turned`), and 16 bits a colour become 8. Raises ValueError, in
    one line, for what cannot be read.
    """

    def __init__(self, source: str | os.PathLike[str] | AnyArray, name: str | None = None) -> None:
        self.path = None if isinstance(source, np.ndarray) else Path(source)
        self.name = name or ("image" if self.path is None else self.path.name)
        with open_image(source, self._invalid) as image:
            check_pixels(image)
            mode = image.mode
            self.size: tuple[int, int] = image.size
            orientation = image.getexif().get(_ORIENTATION, 1)
            self.is_turned = orientation != 1
            self.is_grey = mode in _GREY
        if orientation in _SIDEWAYS:
            self.size = self.size[::-1]
        if mode == "F":
            raise ValueError(f"{self._invalid} Its pixels are floating-point numbers; they must be of 8 or 16 bits.")
        if max(self.size) > _LONGEST_SIDE:
            raise ValueError(
                f"{self._invalid} It has {self.size[0]} x {self.size[1]} pixels; {_LONGEST_SIDE} a side do."
            )
        self._source = source

    @property
    def _invalid(self) -> str:
        return f"Invalid image '{self.name if self.path is None else self.path}'."

    def read(self) -> Pixels:
        """The pixels; raises ValueError where the file is broken."""
        from PIL import ImageOps  # as above

        with open_image(self._source, self._invalid) as image:
            upright = ImageOps.exif_transpose(image)
            if upright.mode.startswith("I"):
                grey = np.clip(np.asarray(upright).astype(np.int64) // _DEEP, 0, 255).astype(np.uint8)
                return Pixels(np.repeat(grey[..., None], 3, axis=2), np.full(grey.shape, 255, np.uint8))
            if "A" in upright.getbands() or "transparency" in upright.info:
                pixels = np.asarray(upright.convert("RGBA"))
                return Pixels(pixels[..., :3].copy(), np.where(pixels[..., 3] > 127, 255, 0).astype(np.uint8))
            pixels = np.array(upright.convert("RGB"))
            return Pixels(pixels, np.full(pixels.shape[:2], 255, np.uint8))


def open_pictures(sources: Sequence[str | os.PathLike[str] | AnyArray]) -> list[Picture]:
    """Images, called by the names of their files, by their paths where two have one name, arrays by their numbers.

    Raises ValueError for what cannot be read, and for a file that is given twice.
    """
    names = [str(number) if isinstance(one, np.ndarray) else Path(one).name for number, one in enumerate(sources)]
    paths = [str(number) if isinstance(one, np.ndarray) else os.fspath(one) for number, one in enumerate(sources)]
    for path in paths:
        if paths.count(path) > 1:
            raise ValueError(f"Invalid image '{path}'. It must be given once.")
    if len(set(names)) < len(names):
        names = paths
    return [Picture(source, name) for source, name in zip(sources, names, strict=True)]
