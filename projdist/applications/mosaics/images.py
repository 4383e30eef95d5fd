"""Images as files have them: upright, with 8 or 16 bits a colour, and what of them is transparent."""

from __future__ import annotations

import functools
import os
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from projdist._typing import AnyArray
from projdist.applications.mosaics.deep_images import (
    DEEPEST,
    Deep,
    Levels,
    array_of,
    common_levels,
    is_deep,
    nothing_of,
    read_deep,
)

if TYPE_CHECKING:
    from PIL import Image

__all__ = ["Picture", "Pixels", "check_pixels", "open_image", "open_pictures"]

_LONGEST_SIDE = 32766  # pixels: what OpenCV warps
_MOST_PIXELS = 100_000_000  # to read, a gigabyte or two of memory; a file of a few kB may have many more
_ORIENTATION, _SIDEWAYS = 0x0112, (5, 6, 7, 8)  # of EXIF; turned by a quarter
_GREY = ("1", "L", "LA", "La", "I", "I;16", "I;16B", "I;16L", "I;16N")
_TIFFS = (".tif", ".tiff")  # of which OpenCV reads some that Pillow does not


class Pixels(NamedTuple):
    """Red, green and blue (height, width, 3) of uint8 or uint16, and 255 where there is anything (height, width)."""

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

    `source`: a file in any format that Pillow reads, or a TIFF that OpenCV reads, or an array (height, width) or
    (height, width, 3 or 4). A file is turned upright as its EXIF data say (`is_turned`). What has more than 8 bits
    `is_deep` (and `is_whole` where its numbers are); its `levels` are the values of black and white, which
    `open_pictures` makes one for all images. Raises ValueError, in one line, for what cannot be read.
    """

    def __init__(self, source: str | os.PathLike[str] | AnyArray, name: str | None = None) -> None:
        self.path = None if isinstance(source, np.ndarray) else Path(source)
        self.name = name or ("image" if self.path is None else self.path.name)
        self._source, self._orientation = source, 1
        self._nothing: float | None = None
        self._together: Sequence[Picture] = (self,)
        if isinstance(source, np.ndarray) and source.dtype != np.uint8:
            deep = self._deep()
            self.is_deep, self.is_whole, self.is_grey = True, source.dtype.kind != "f", deep.values.shape[2] == 1
            self.size: tuple[int, int] = deep.seen.shape[::-1]
        else:
            self._open()
        self.is_turned = self._orientation != 1
        if self._orientation in _SIDEWAYS:
            self.size = self.size[::-1]
        if max(self.size) > _LONGEST_SIDE:
            raise ValueError(
                f"{self._invalid} It has {self.size[0]} x {self.size[1]} pixels; {_LONGEST_SIDE} a side do."
            )

    def _open(self) -> None:
        """Look at a file without reading its pixels, as far as that can be."""
        try:
            with open_image(self._source, self._invalid) as image:
                check_pixels(image)
                self.size = image.size
                self._orientation = image.getexif().get(_ORIENTATION, 1)
                self.is_grey, self.is_deep = image.mode in _GREY or image.mode == "F", is_deep(image, self.path)
                self.is_whole, self._nothing = image.mode != "F", nothing_of(image)
        except ValueError:
            if self.path is None or self.path.suffix.lower() not in _TIFFS or not self.path.is_file():
                raise
            try:
                deep = read_deep(self.path, None, 1)
            except (ValueError, ImportError):
                deep = None
            if deep is None:
                raise
            self.is_deep, self.is_whole, self.is_grey = True, False, deep.values.shape[2] == 1
            self.size = deep.seen.shape[::-1]

    @property
    def _invalid(self) -> str:
        return f"Invalid image '{self.name if self.path is None else self.path}'."

    @functools.cached_property
    def levels(self) -> Levels:
        """Of all images that were opened together and are deep."""
        if self._together[0] is not self:
            return self._together[0].levels
        whole = all(picture.is_whole for picture in self._together)
        return common_levels([picture._deep for picture in self._together], whole)

    def together(self, pictures: Sequence[Picture]) -> None:
        """Have black and white in common with others."""
        self._together = pictures

    def _deep(self) -> Deep:
        try:
            if isinstance(self._source, np.ndarray):
                return array_of(self._source)
            return read_deep(Path(self._source), self._nothing, self._orientation)
        except ValueError as error:
            raise ValueError(f"{self._invalid} It cannot be read: {error}.") from error

    def read(self, *, deep: bool = False) -> Pixels:
        """The pixels, of 8 bits, or of 16; raises ValueError where the file is broken."""
        if self.is_deep:
            found = self._deep()
            colours = found.scaled(self.levels, DEEPEST if deep else 255)
            return Pixels(colours, np.where(found.seen, 255, 0).astype(np.uint8))
        pixels = self._read()
        return Pixels(pixels.colours.astype(np.uint16) * (DEEPEST // 255), pixels.mask) if deep else pixels

    def _read(self) -> Pixels:
        from PIL import ImageOps  # as above

        with open_image(self._source, self._invalid) as image:
            upright = ImageOps.exif_transpose(image)
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
    pictures = [Picture(source, name) for source, name in zip(sources, names, strict=True)]
    deep = [picture for picture in pictures if picture.is_deep]
    for picture in deep:
        picture.together(deep)
    return pictures
