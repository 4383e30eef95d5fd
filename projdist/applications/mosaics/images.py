"""Images as files have them: upright, with 8 or 16 bits a colour, what of them is transparent, and pieces of them."""

from __future__ import annotations

import functools
import os
import warnings
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from projdist._typing import AnyArray, BoolArray, FloatArray
from projdist.applications.mosaics.homographies import corners, jacobians

if TYPE_CHECKING:
    from PIL import Image


def opencv() -> Any:
    """The library; raises ImportError in one line. It is slow to load, and points that are given do without it."""
    try:
        import cv2
    except ImportError as error:
        text = "Invalid images. To match and draw them takes OpenCV: pip install 'projdist[mosaic]'."
        raise ImportError(text, name="cv2") from error
    return cv2


def as_array(one: Any) -> AnyArray:
    """What the library answers, which has arrays of its own in some places."""
    return np.asarray(one.get() if hasattr(one, "get") else one)


# ---- deep images ---------------------------------------------------------------------------------


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


# ---- images --------------------------------------------------------------------------------------


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


# ---- pieces --------------------------------------------------------------------------------------


_KEPT = 3e8  # bytes of images that are kept for the next box
_HALF = 0.5  # an image that is drawn smaller than that is reduced first

Box = tuple[int, int, int, int]  # left, top, right, bottom


class Piece(NamedTuple):
    """Colours and a mask, and their place on the canvas, left and top."""

    corner: tuple[int, int]
    pixels: Pixels

    def window(self, left: int, top: int) -> tuple[slice, slice]:
        """Where it is in an array that begins at (left, top)."""
        height, width = self.pixels.mask.shape
        x, y = self.corner[0] - left, self.corner[1] - top
        return slice(y, y + height), slice(x, x + width)


class Store:
    """The images, read when they are needed; the last ones are kept."""

    def __init__(self, pictures: Sequence[Picture], deep: bool = False) -> None:
        """`deep`: with 16 bits a colour."""
        self.pictures, self._deep = pictures, deep
        self._kept: OrderedDict[int, Pixels] = OrderedDict()

    def read(self, number: int) -> Pixels:
        """The pixels of an image."""
        if number not in self._kept:
            self._kept[number] = _filled(self.pictures[number].read(deep=self._deep))
            while len(self._kept) > 1 and sum(one.colours.nbytes for one in self._kept.values()) > _KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(number)
        return self._kept[number]


def _filled(pixels: Pixels) -> Pixels:
    """Transparent pixels in the colour of the nearest others, which blending must not darken."""
    seen = pixels.mask > 0
    if seen.all() or not seen.any():
        return pixels
    cv2 = opencv()
    nearest = cv2.distanceTransformWithLabels(255 - pixels.mask, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)[1]
    numbers = np.zeros(nearest.max() + 1, int)
    numbers[nearest[seen]] = np.flatnonzero(seen)
    return Pixels(pixels.colours.reshape(-1, 3)[numbers[nearest]], pixels.mask)


def common_box(a: Box, b: Box) -> Box | None:
    """What two boxes have in common."""
    box = max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3])
    return box if box[0] < box[2] and box[1] < box[3] else None


def shift(x: float, y: float) -> FloatArray:
    """The matrix of a shift."""
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]])


def warped(pixels: Pixels, H: FloatArray, box: Box) -> Piece:
    """An image under its map, in a box of the canvas."""
    cv2 = opencv()
    height, width = pixels.mask.shape
    J = jacobians(H[None], corners(np.array([[float(width), float(height)]])))[1]
    pixels, factor = reduced(pixels, float(np.linalg.svd(J, compute_uv=False).max()))
    H = H @ np.diag([*(1.0 / factor), 1.0])
    # OpenCV counts from the middle of the first pixel.
    to_box = shift(-box[0] - 0.5, -box[1] - 0.5) @ H @ shift(0.5, 0.5)
    shape = box[2] - box[0], box[3] - box[1]
    colours = cv2.warpPerspective(
        pixels.colours, to_box, shape, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT_101
    )
    mask = cv2.warpPerspective(pixels.mask, to_box, shape, flags=cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT)
    return Piece(box[:2], Pixels(colours, mask))


def reduced(pixels: Pixels, scale: float) -> tuple[Pixels, FloatArray]:
    """An image reduced to about the scale at which it is drawn, where that is less than half; and by what it was."""
    if scale >= _HALF:
        return pixels, np.ones(2)
    cv2 = opencv()
    height, width = pixels.mask.shape
    small = max(1, round(scale * width)), max(1, round(scale * height))
    colours = cv2.resize(pixels.colours, small, interpolation=cv2.INTER_AREA)
    mask = cv2.resize(pixels.mask, small, interpolation=cv2.INTER_NEAREST)
    return Pixels(colours, mask), np.array(small) / [width, height]
