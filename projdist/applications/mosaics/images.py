"""Images read from files, upright, with 8 or 16 bits per colour and a mask of transparency, and pieces of them."""

from __future__ import annotations

import functools
import os
import warnings
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from projdist._typing import AnyArray, AnyPath, BoolArray, FloatArray

if TYPE_CHECKING:
    from PIL import Image


def opencv() -> Any:
    """The library OpenCV, loaded when needed, as it is slow to load; raises ImportError in one line."""
    try:
        import cv2
    except ImportError as error:
        text = "Invalid images. To match and draw them takes OpenCV: pip install 'projdist[mosaic]'."
        raise ImportError(text, name="cv2") from error
    return cv2


def as_array(one: Any) -> AnyArray:
    """A result of OpenCV as an array; some functions return a type of OpenCV's own."""
    return np.asarray(one.get() if hasattr(one, "get") else one)


# ---- deep images ---------------------------------------------------------------------------------

DEEPEST = 65535
_PNG_DEPTH = 24  # the byte of a PNG with the bits per colour (PNG specification, 11.2.2)
_TIFF_DEPTH, _TIFF_NODATA = 258, 42113  # tags: BitsPerSample, and GDAL's for the value of no data


class Deep(NamedTuple):
    """Values (height, width, 1 or 3) of a file, and a mask (height, width) of pixels with data."""

    values: FloatArray
    seen: BoolArray

    def scaled(self, levels: tuple[float, float], top: int) -> AnyArray:
        """Red, green and blue (height, width, 3), whole numbers from 0 to `top`, black without data."""
        low, high = levels
        share = (self.values - low) / ((high - low) or 1.0)
        share = np.where(self.seen[..., None], np.clip(share, 0.0, 1.0), 0.0)
        colours = np.round(top * share).astype(np.uint8 if top < 256 else np.uint16)
        return np.repeat(colours, 3, axis=2) if colours.shape[2] == 1 else colours


def is_deep(image: Image.Image, path: Path | None) -> bool:
    """True if an image opened by Pillow has more than 8 bits per colour, which Pillow does not always report."""
    if image.mode.startswith("I") or image.mode == "F":
        return True
    if image.format == "PNG" and path is not None:
        with path.open("rb") as file:
            head = file.read(_PNG_DEPTH + 1)
        return len(head) > _PNG_DEPTH and head[_PNG_DEPTH] > 8
    bits = getattr(image, "tag_v2", {}).get(_TIFF_DEPTH, (8,))
    return max(bits if isinstance(bits, tuple) else (bits,)) > 8


def array_of(source: AnyArray) -> Deep:
    """The values of an array (height, width) or (height, width, 1, 3 or 4), the fourth alpha; ValueError for others."""
    if source.dtype.kind not in "uif" or source.ndim not in (2, 3) or source.shape[2:] not in ((), (1,), (3,), (4,)):
        raise ValueError(f"its shape is {source.shape}, of {source.dtype}")
    values = np.asarray(source, dtype=float).reshape(*source.shape[:2], -1)
    seen = np.asarray(np.isfinite(values).all(axis=2))
    if values.shape[2] == 4:
        seen &= values[..., 3] > 0.5 * (np.iinfo(source.dtype).max if source.dtype.kind != "f" else 1.0)
        values = values[..., :3]
    return Deep(np.where(seen[..., None], values, 0.0), seen)


def read_deep(path: Path, nodata: float | None, orientation: int) -> Deep:
    """The values of a file, upright; raises ValueError, and ImportError without OpenCV."""
    # `nodata`: the value for no data.
    cv2 = opencv()
    read = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if read is None:
        raise ValueError("it is broken, or its pixels are of a kind that OpenCV does not know")
    if read.ndim == 3 and read.shape[2] >= 3:
        read = read[..., [2, 1, 0, *range(3, read.shape[2])]]
    if orientation >= 5:
        read = read.swapaxes(0, 1)
    # Reversals of columns and of rows, for 5 to 8 after these are exchanged.
    across, down = {2: (1, 0), 3: (1, 1), 4: (0, 1), 6: (1, 0), 7: (1, 1), 8: (0, 1)}.get(orientation, (0, 0))
    deep = array_of(read[:: -1 if down else 1, :: -1 if across else 1])
    if nodata is None:
        return deep
    seen = deep.seen & ~(deep.values == nodata).all(axis=2)
    return Deep(np.where(seen[..., None], deep.values, 0.0), seen)


def nodata_of(image: Image.Image) -> float | None:
    """The value for no data that GDAL writes into a TIFF, None without one."""
    text = getattr(image, "tag_v2", {}).get(_TIFF_NODATA)
    try:
        return None if text is None else float(str(text).strip("\0 "))
    except ValueError:
        return None


# ---- images --------------------------------------------------------------------------------------

_LONGEST_SIDE = 32766  # pixels: OpenCV's limit for warping
_MOST_PIXELS = 100_000_000  # takes a gigabyte or two of memory; a file of a few kB may claim many more
_ORIENTATION, _SIDEWAYS = 0x0112, (5, 6, 7, 8)  # EXIF's tag; values for rotations by 90 degrees
_GREY = ("1", "L", "LA", "La", "I", "I;16", "I;16B", "I;16L", "I;16N")
_TIFFS = (".tif", ".tiff")  # OpenCV reads some that Pillow does not


class Pixels(NamedTuple):
    """Red, green and blue (height, width, 3) of uint8 or uint16, and a mask (height, width), 255 where opaque."""

    colours: AnyArray
    mask: AnyArray


@contextmanager
def open_image(source: AnyPath | AnyArray, invalid: str) -> Iterator[Image.Image]:
    """Context with an opened image, its pixels not yet read; raises ValueError, beginning with `invalid`."""
    from PIL import Image  # slow to load, and not needed for given points

    # Errors of Pillow for broken files of its many formats and for files that are no images; most are OSErrors.
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
    """Raise ValueError for an image with too many pixels."""
    width, height = image.size
    if width * height > _MOST_PIXELS:
        raise ValueError(f"{width} x {height} pixels are more than {_MOST_PIXELS:,}")


class Picture:
    """An image, read when needed, with its `name`, its `size` (width and height in pixels), and whether it `is_grey`.

    `source`: a file in any format that Pillow reads, a TIFF that OpenCV reads, or an array (height, width) or
    (height, width, 3 or 4). A file is rotated upright by its EXIF data (`is_turned`). An image with more than 8 bits
    per colour `is_deep` (and `is_whole` if its values are whole numbers); its `levels` are the values of black and
    white, the same for all images of one `open_pictures`. Raises ValueError for an image that cannot be read.
    """

    def __init__(self, source: AnyPath | AnyArray, name: str | None = None) -> None:
        self.path = None if isinstance(source, np.ndarray) else Path(source)
        self.name = name or ("image" if self.path is None else self.path.name)
        self._source, self._orientation = source, 1
        self._nodata: float | None = None
        self.together: Sequence[Picture] = (self,)
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
            message = f"{self._invalid} It has {self.size[0]} x {self.size[1]} pixels; {_LONGEST_SIDE} a side do."
            raise ValueError(message)

    def _open(self) -> None:
        """Read the properties of an image, without its pixels if possible."""
        try:
            with open_image(self._source, self._invalid) as image:
                check_pixels(image)
                self.size = image.size
                self._orientation = image.getexif().get(_ORIENTATION, 1)
                self.is_grey, self.is_deep = image.mode in _GREY or image.mode == "F", is_deep(image, self.path)
                self.is_whole, self._nodata = image.mode != "F", nodata_of(image)
        except ValueError:
            if self.path is None or self.path.suffix.lower() not in _TIFFS or not self.path.is_file():
                raise
            with suppress(ValueError, ImportError):
                deep = read_deep(self.path, None, 1)
                self.is_deep, self.is_whole, self.is_grey = True, False, deep.values.shape[2] == 1
                self.size = deep.seen.shape[::-1]
                return
            raise

    @property
    def _invalid(self) -> str:
        return f"Invalid image '{self.name if self.path is None else self.path}'."

    @functools.cached_property
    def levels(self) -> tuple[float, float]:
        """The values of black and white, common to all deep images that were opened together.

        For whole numbers they are 0 and the largest value of the bits in use, so that 12 bits in files of 16 bits have
        the full range of greys; for other numbers the range of all images.
        """
        if self.together[0] is not self:
            return self.together[0].levels
        images = (picture._deep() for picture in self.together)
        ends = [(float(seen.min()), float(seen.max())) for one in images if len(seen := one.values[one.seen])]
        low, high = (min(low for low, _ in ends), max(high for _, high in ends)) if ends else (0.0, 1.0)
        if low >= 0.0 and all(picture.is_whole for picture in self.together):
            return 0.0, float(2 ** max(8, int(high).bit_length()) - 1)
        return low, high

    def _deep(self) -> Deep:
        """The values of an image of more than 8 bits."""
        try:
            if isinstance(self._source, np.ndarray):
                return array_of(self._source)
            return read_deep(Path(self._source), self._nodata, self._orientation)
        except ValueError as error:
            raise ValueError(f"{self._invalid} It cannot be read: {error}.") from error

    def read(self, *, deep: bool = False) -> Pixels:
        """The pixels with 8 bits per colour, or with 16 if `deep`; raises ValueError for a broken file."""
        if self.is_deep:
            found = self._deep()
            colours = found.scaled(self.levels, DEEPEST if deep else 255)
            return Pixels(colours, np.where(found.seen, 255, 0).astype(np.uint8))
        from PIL import ImageOps  # as above

        with open_image(self._source, self._invalid) as image:
            upright = ImageOps.exif_transpose(image)
            if "A" in upright.getbands() or "transparency" in upright.info:
                pixels = np.asarray(upright.convert("RGBA"))
                colours, mask = pixels[..., :3].copy(), np.where(pixels[..., 3] > 127, 255, 0).astype(np.uint8)
            else:
                colours = np.array(upright.convert("RGB"))
                mask = np.full(colours.shape[:2], 255, np.uint8)
        return Pixels(colours.astype(np.uint16) * (DEEPEST // 255) if deep else colours, mask)


def open_pictures(sources: Sequence[AnyPath | AnyArray]) -> list[Picture]:
    """Images named by their files, by their paths if two files have the same name, and arrays by their numbers.

    Raises ValueError for an image that cannot be read, and for a file that is given twice.
    """
    paths = [str(number) if isinstance(one, np.ndarray) else os.fspath(one) for number, one in enumerate(sources)]
    twice = next((path for path in paths if paths.count(path) > 1), None)
    if twice is not None:
        raise ValueError(f"Invalid image '{twice}'. It must be given once.")
    names = [path if isinstance(one, np.ndarray) else Path(one).name for path, one in zip(paths, sources, strict=True)]
    names = names if len(set(names)) == len(names) else paths
    pictures = [Picture(source, name) for source, name in zip(sources, names, strict=True)]
    deep = [picture for picture in pictures if picture.is_deep]
    for picture in deep:
        picture.together = deep
    return pictures


_KEPT = 3e8  # bytes of images kept in memory
_HALF = 0.5  # scale below which an image is reduced before it is drawn

Box = tuple[int, int, int, int]  # left, top, right, bottom


class Piece(NamedTuple):
    """Pixels and their place on the canvas, left and top."""

    corner: tuple[int, int]
    pixels: Pixels

    def window(self, left: int, top: int) -> tuple[slice, slice]:
        """Slices of the piece in an array that begins at (left, top)."""
        height, width = self.pixels.mask.shape
        x, y = self.corner[0] - left, self.corner[1] - top
        return slice(y, y + height), slice(x, x + width)


class Store:
    """A cache of images, read when needed."""

    def __init__(self, pictures: Sequence[Picture], deep: bool = False) -> None:
        """`deep`: with 16 bits per colour."""
        self.pictures, self._deep = pictures, deep
        self._kept: OrderedDict[int, Pixels] = OrderedDict()

    def read(self, number: int) -> Pixels:
        """The pixels of an image; transparent ones have the colour of the nearest others, lest blends darken these."""
        if number not in self._kept:
            pixels = self.pictures[number].read(deep=self._deep)
            seen = pixels.mask > 0
            if seen.any() and not seen.all():
                cv2 = opencv()
                kind = cv2.DIST_LABEL_PIXEL
                nearest = cv2.distanceTransformWithLabels(255 - pixels.mask, cv2.DIST_L2, 5, labelType=kind)[1]
                numbers = np.zeros(nearest.max() + 1, int)
                numbers[nearest[seen]] = np.flatnonzero(seen)
                pixels = pixels._replace(colours=pixels.colours.reshape(-1, 3)[numbers[nearest]])
            self._kept[number] = pixels
            while len(self._kept) > 1 and sum(one.colours.nbytes for one in self._kept.values()) > _KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(number)
        return self._kept[number]


def shift(x: float, y: float) -> FloatArray:
    """The matrix of a shift."""
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]])


def reduced(pixels: Pixels, scale: float) -> tuple[Pixels, FloatArray]:
    """An image reduced to the scale at which it is drawn, if that is below a half, and the factors that do it."""
    if scale >= _HALF:
        return pixels, np.ones(2)
    cv2 = opencv()
    height, width = pixels.mask.shape
    small = max(1, round(scale * width)), max(1, round(scale * height))
    colours = cv2.resize(pixels.colours, small, interpolation=cv2.INTER_AREA)
    mask = cv2.resize(pixels.mask, small, interpolation=cv2.INTER_NEAREST)
    return Pixels(colours, mask), np.array(small) / [width, height]
