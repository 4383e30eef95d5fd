"""Rendering of mosaics: exposure, seams and blending of their images tile by tile, cropping, and picture files."""

from __future__ import annotations

import io
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from projdist._typing import AnyArray, AnyPath, BoolArray, FloatArray
from projdist.applications.mosaics import canvases, panoramas, registration
from projdist.applications.mosaics.images import DEEPEST, Box, Picture, Piece, Pixels, Store, as_array, opencv, shift
from projdist.support import check_choice, replacing

_BANDS = 5
_UNIT = 2**_BANDS  # pixels: pyramids begin at multiples of this, so that the pixels of all pieces coincide
_REACH = 3 * _UNIT  # pixels as far as which a pixel has influence through the bands
_LITTLE = 1e-5  # a negligible weight
_FEATHER = 0.02  # of the full weight, per pixel from an image's rim


class Blender(ABC):
    """Blending of pieces of images within a box of the canvas, by weighted sums of colours in bands of frequencies."""

    bands = 0  # besides the first

    def __init__(self, box: Box) -> None:
        self._left, self._top = box[:2]
        self._shape = box[3] - box[1], box[2] - box[0]
        height, width = (-(-side // 2**self.bands) * 2**self.bands for side in self._shape)
        shapes = [(height >> band, width >> band) for band in range(self.bands + 1)]
        self._sums = [np.zeros((*shape, 3), np.float32) for shape in shapes]
        self._weights = [np.zeros(shape, np.float32) for shape in shapes]

    @abstractmethod
    def feed(self, piece: Piece) -> None:
        """Add a piece of an image, bounded by its mask."""

    def blend(self) -> tuple[AnyArray, BoolArray]:
        """Colours (height, width, 3), and a mask of pixels that have any."""
        self._sums[0] /= np.maximum(self._weights[0], _LITTLE)[..., None]
        return self._sums[0], self._weights[0] > 0


class _Overlay(Blender):
    """Blending in which later pieces cover earlier ones."""

    def feed(self, piece: Piece) -> None:
        """Put a piece on top."""
        place, (colours, mask) = piece.window(self._left, self._top), piece.pixels
        opencv().copyTo(colours.astype(np.float32), mask, self._sums[0][place])
        self._weights[0][place][mask > 0] = 1.0


class _Feather(Blender):
    """Blending by means with weights that decrease towards the images' rims."""

    def feed(self, piece: Piece) -> None:
        """Add a piece."""
        cv2 = opencv()
        distance = cv2.distanceTransform(np.pad(piece.pixels.mask, 1), cv2.DIST_L2, 3)[1:-1, 1:-1]
        weight = np.minimum(distance * _FEATHER, 1.0)
        place = piece.window(self._left, self._top)
        self._sums[0][place] += weight[..., None] * piece.pixels.colours
        self._weights[0][place] += weight


class _MultiBand(Blender):
    """Blending by means in bands of frequencies, with masks as smooth as the band (Burt & Adelson 1983, ACM TOG 2)."""

    bands = _BANDS

    def feed(self, piece: Piece) -> None:
        """Add a piece."""
        cv2 = opencv()
        rows, columns = piece.window(self._left, self._top)
        height, width = self._weights[0].shape
        top, left = (max(side.start - _REACH, 0) // _UNIT * _UNIT for side in (rows, columns))
        bottom, right = (
            min(-(-(side.stop + _REACH) // _UNIT) * _UNIT, most) for side, most in ((rows, height), (columns, width))
        )
        around = rows.start - top, bottom - rows.stop, columns.start - left, right - columns.stop
        part = cv2.copyMakeBorder(piece.pixels.colours.astype(np.float32), *around, cv2.BORDER_REFLECT)
        weight = cv2.copyMakeBorder((piece.pixels.mask > 0).astype(np.float32), *around, cv2.BORDER_CONSTANT)
        for band in range(_BANDS + 1):
            place = slice(top >> band, bottom >> band), slice(left >> band, right >> band)
            detail = part
            if band < _BANDS:
                smaller = cv2.pyrDown(part)
                detail, part = part - cv2.pyrUp(smaller, dstsize=part.shape[1::-1]), smaller
            self._sums[band][place] += weight[..., None] * detail
            self._weights[band][place] += weight
            weight = cv2.pyrDown(weight)

    def blend(self) -> tuple[AnyArray, BoolArray]:
        """Colours from all bands, and a mask of pixels that have any."""
        cv2 = opencv()
        height, width = self._shape
        found: AnyArray = np.zeros((1, 1, 3))
        for band in reversed(range(_BANDS + 1)):
            level = self._sums[band] / (self._weights[band] + _LITTLE)[..., None]
            found = level if band == _BANDS else level + cv2.pyrUp(found, dstsize=level.shape[1::-1])
        return np.ascontiguousarray(found[:height, :width]), np.asarray(self._weights[0][:height, :width] > _LITTLE)


BLENDERS: dict[str, Callable[[Box], Blender]] = {"multiband": _MultiBand, "feather": _Feather, "none": _Overlay}
BLENDS = tuple(BLENDERS)


# ---- cropping ------------------------------------------------------------------------------------

_CELLS = 400  # along the longer side of the grid on which the box is found before it is grown by pixels


def covered_box(covered: BoolArray) -> Box:
    """A large box of pixels that are all covered; raises ValueError if there is none."""
    # It is the largest on a grid of at most 400 cells a side, grown by pixels as far as possible.
    height, width = covered.shape
    step = max(1, -(-max(height, width) // _CELLS))
    rows, columns = height // step, width // step
    cells = np.asarray(covered[: rows * step, : columns * step].reshape(rows, step, columns, step).all(axis=(1, 3)))
    left, top, right, bottom = (step * side for side in _largest(cells))
    if left == right:
        raise ValueError("Invalid crop. No box is covered by images.")
    while left > 0 and covered[top:bottom, left - 1].all():
        left -= 1
    while right < width and covered[top:bottom, right].all():
        right += 1
    while top > 0 and covered[top - 1, left:right].all():
        top -= 1
    while bottom < height and covered[bottom, left:right].all():
        bottom += 1
    return left, top, right, bottom


def _largest(cells: BoolArray) -> Box:
    """The largest box of covered cells, found row by row as the largest under the bars of covered cells up to there."""
    heights = np.zeros(cells.shape[1], int)
    best, found = 0, (0, 0, 0, 0)
    for row, line in enumerate(cells):
        heights = np.where(line, heights + 1, 0)
        boxes = [(0, 0, 0, 0)]  # area, left, right and height
        growing: list[tuple[int, int]] = []  # left and height
        for place, height in enumerate([*heights.tolist(), 0]):
            start = place
            while growing and growing[-1][1] >= height:
                start, tall = growing.pop()
                boxes.append((tall * (place - start), start, place, tall))
            growing.append((start, height))
        area, left, right, high = max(boxes)
        if area > best:
            best, found = area, (left, row + 1 - high, right, row + 1)
    return found


# A tile is drawn with a margin: the pyramid's reach is 3 * 2^5 pixels, that of the feather 1 / 0.02. Tiles and margins
# are multiples of 2^5, so that the pixels of all tiles' pyramids coincide.
_TILE, _MARGIN = 2048, 128  # pixels
DEPTHS = (8, 16)


class Rendered(NamedTuple):
    """A drawn mosaic: red, green, blue and alpha (height, width, 4) of uint8 or uint16, alpha 0 or the maximum."""

    pixels: AnyArray
    canvas: canvases.AnyCanvas  #: of these pixels, also after cropping
    is_grey: bool  #: no image has colours

    @property
    def bands(self) -> AnyArray:
        """The pixels, of a grey mosaic (height, width, 2), grey and alpha."""
        return self.pixels[..., [0, 3]] if self.is_grey else self.pixels


def render(
    found: registration.Mosaic | panoramas.MappedPanorama,
    pictures: Sequence[Picture],
    *,
    blend: str = "multiband",
    exposure: str = "gain",
    depth: int = 8,
    crop: bool = False,
    most_pixels: float | None = None,
) -> Rendered:
    """Draw the pictures of a mosaic, without those left out.

    `blend`: "multiband" (in bands of frequencies, along seams where the images differ least), "feather" (with weights
    that decrease towards the rims) or "none" (later images cover earlier ones). `exposure`: "gain" makes the images
    equally bright where they overlap, "blocks" also blocks of them, against vignetting, or "none". `depth`: bits per
    colour, 8 or 16; with 16, images of 12 or 16 bits keep their values, and values that are not whole numbers are
    scaled from the range of all images to 0 .. 65535. `crop`: to the largest covered box. `most_pixels`: limit of the
    canvas. Drawing is by OpenCV, in tiles of 2048 pixels. Raises ValueError, and ImportError without OpenCV.
    """
    check_choice("blend", blend, BLENDS)
    check_choice("exposure", exposure, EXPOSURES)
    if depth not in DEPTHS:
        raise ValueError(f"Invalid depth {depth}. It must be 8 or 16 bits.")
    if [list(picture.size) for picture in pictures] != found.points.sizes.tolist():
        raise ValueError("Invalid images. They must be those of the correspondences, in order, of the same sizes.")
    used = [pictures[image] for image in found.images]
    canvas = found.canvas(most_pixels=most_pixels)
    most = DEEPEST if depth > 8 else 255
    seams = Seams(found.canvas(most_pixels=SMALL), Store(used, depth > 8), blend, exposure)
    pixels = np.zeros((canvas.height, canvas.width, 4), np.uint8 if depth == 8 else np.uint16)
    boxes = [canvas.bounds(number, picture.size) for number, picture in enumerate(used)]
    for top in range(0, canvas.height, _TILE):
        for left in range(0, canvas.width, _TILE):
            tile = _common((left, top, left + _TILE, top + _TILE), (0, 0, canvas.width, canvas.height))
            pixels[tile[1] : tile[3], tile[0] : tile[2]] = _tile(tile, canvas, boxes, seams, blend, most)
    deep = [picture for picture in used if picture.is_deep] if depth > 8 else []
    if deep and deep[0].levels[0] == 0.0 and deep[0].is_whole:
        # Whole numbers get back the values in the files, so that 12 bits stay 12 bits.
        pixels[..., :3] = np.round(pixels[..., :3] * (deep[0].levels[1] / DEEPEST))
    if crop:
        left, top, right, bottom = box = covered_box(pixels[..., 3] > 0)
        pixels, canvas = pixels[top:bottom, left:right], canvas.cropped(box)
    return Rendered(pixels, canvas, all(picture.is_grey for picture in used))


def _common(one: Box, other: Box) -> Box:
    """The part that two boxes share."""
    return max(one[0], other[0]), max(one[1], other[1]), min(one[2], other[2]), min(one[3], other[3])


def _tile(tile: Box, canvas: canvases.AnyCanvas, boxes: Sequence[Box], seams: Seams, blend: str, most: int) -> AnyArray:
    """The pixels of a tile, from all images that overlap it or its margin."""
    left, top, right, bottom = tile
    whole = 0, 0, canvas.width, canvas.height
    around = _common((left - _MARGIN, top - _MARGIN, right + _MARGIN, bottom + _MARGIN), whole)
    pieces = {}
    for number, box in enumerate(boxes):
        part = _common(box, around)
        if part[0] < part[2] and part[1] < part[3]:
            piece = canvas.warped(seams.store.read(number), number, part)
            pieces[number] = piece._replace(pixels=Pixels(seams.even(number, piece, canvas.scale), piece.pixels.mask))
    masks = seams.cut(pieces, canvas)
    blender = BLENDERS[blend](around)
    for number, piece in pieces.items():
        if masks[number].any():
            blender.feed(piece._replace(pixels=piece.pixels._replace(mask=masks[number])))
    colours, seen = blender.blend()
    drawn = np.zeros((*seen.shape, 4), np.uint8 if most < DEEPEST else np.uint16)
    drawn[..., :3] = np.clip(np.rint(colours, out=colours), 0, most, out=colours)
    drawn[..., 3] = most
    drawn[~seen] = 0
    return drawn[top - around[1] : bottom - around[1], left - around[0] : right - around[0]]


_FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".tif": "TIFF", ".tiff": "TIFF"}
PICTURE_SUFFIXES = tuple(_FORMATS)
DEEP_SUFFIXES = (".png", ".tif", ".tiff")
_COMPRESSION = 3  # of PNG: a third of the time of the usual 6, for files at most 5 % larger


def save_mosaic(drawn: Rendered, path: AnyPath, *, overwrite: bool = True) -> Path:
    """Write a mosaic as .png or .tif, transparent outside the images, or as .jpg, white there.

    Grey images give a grey mosaic. 16 bits a colour are for .png and .tif. Raises ValueError, FileExistsError, OSError.
    """
    from PIL import Image  # slow to load, and few need it

    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in _FORMATS:
        raise ValueError(f"Invalid picture file '{path}'. Its suffix must be {', '.join(PICTURE_SUFFIXES)}.")
    if drawn.pixels.dtype == np.uint16:
        if suffix not in DEEP_SUFFIXES:
            message = f"Invalid picture file '{path}'. For 16 bits a colour its suffix must be .png, .tif or .tiff."
            raise ValueError(message)
        content = opencv().imencode(suffix, drawn.pixels[..., [2, 1, 0, 3]])[1].data
    else:
        pixels, form = drawn.bands, _FORMATS[suffix]
        options: dict[str, object] = {"compression": "tiff_lzw"} if form == "TIFF" else {"compress_level": _COMPRESSION}
        if form == "JPEG":
            pixels = np.where(pixels[..., -1:] > 0, pixels[..., :-1], np.uint8(255)).squeeze()
            options = {"quality": 92}
        encoded = io.BytesIO()
        Image.fromarray(pixels).save(encoded, format=form, **options)
        content = encoded.getvalue()
    # Codecs that write themselves misreport a full disk.
    with replacing(path, overwrite=overwrite) as new:
        new.write_bytes(content)
    return path


EXPOSURES = ("gain", "blocks", "none")
SMALL = 3e5  # pixels of the canvas on which gains and seams are found

# Side of a block with one gain, in pixels of the small canvas, and number of iterations. They reduce steps at seams due
# to vignettes of a third to 40 %; blocks of 32 pixels leave 70 %, and blocks of 8 follow the content of images.
_BLOCK, _FEEDS = 16, 4


class Seams:
    """The gains of all images and the seams between them, found on a small canvas."""

    def __init__(self, small: canvases.AnyCanvas, store: Store, blend: str, exposure: str) -> None:
        """`small`: the canvas in at most `SMALL` pixels."""
        cv2 = opencv()
        self.store, self.scale, self.pieces = store, small.scale, list[Piece]()
        for number, picture in enumerate(store.pictures):
            piece = small.warped(store.read(number), number, small.bounds(number, picture.size))
            if piece.pixels.colours.dtype != np.uint8:  # 8 bits suffice
                colours = (piece.pixels.colours // 257).astype(np.uint8)
                piece = piece._replace(pixels=piece.pixels._replace(colours=colours))
            self.pieces.append(piece)
        places, masks = [piece.corner for piece in self.pieces], [piece.pixels.mask for piece in self.pieces]
        self.gains: list[FloatArray] | None = None  # (1, 1) each, or one per block, which compensates vignetting
        if exposure != "none":
            blocks, one = cv2.detail.BlocksGainCompensator, cv2.detail.GainCompensator
            feeder = one() if exposure == "gain" else blocks(_BLOCK, _BLOCK, _FEEDS)
            feeder.feed(places, [piece.pixels.colours for piece in self.pieces], masks)
            self.gains = [np.atleast_2d(np.asarray(as_array(one), dtype=np.float32)) for one in feeder.getMatGains()]
        self.seams: list[AnyArray] | None = None
        if blend == "multiband":
            even = [self.even(number, piece, self.scale).astype(np.float32) for number, piece in enumerate(self.pieces)]
            cut = cv2.detail.GraphCutSeamFinder("COST_COLOR").find(even, places, masks)
            # One pixel wider: the border between two small pixels belongs to both.
            self.seams = [cv2.dilate(as_array(one), None) for one in cut]

    def even(self, number: int, piece: Piece, scale: float) -> AnyArray:
        """The colours of a piece of an image, on a canvas of a scale, times its gain if there are gains."""
        colours = piece.pixels.colours
        if self.gains is None:
            return colours
        gains, whole, growth = self.gains[number], self.pieces[number], scale / self.scale
        height, width = colours.shape[:2]
        if gains.size > 1:
            cv2 = opencv()
            (down, across), (tall, wide) = whole.pixels.mask.shape, gains.shape
            to_piece = shift(-piece.corner[0] - 0.5, -piece.corner[1] - 0.5) @ np.diag([growth, growth, 1.0])
            to_piece = to_piece @ shift(*whole.corner) @ np.diag([across / wide, down / tall, 1.0]) @ shift(0.5, 0.5)
            how = {"flags": cv2.INTER_LINEAR, "borderMode": cv2.BORDER_REPLICATE}
            gains = cv2.warpAffine(gains, to_piece[:2], (width, height), **how)
        bright = np.rint(colours * gains[..., None])
        return np.minimum(bright, np.iinfo(colours.dtype).max, out=bright).astype(colours.dtype)

    def cut(self, pieces: dict[int, Piece], canvas: canvases.AnyCanvas) -> dict[int, AnyArray]:
        """Masks of pieces, cut along the seams; pixels that no image would then have go to the first that has them."""
        masks = {number: piece.pixels.mask for number, piece in pieces.items()}
        if self.seams is None or not pieces:
            return masks
        cv2 = opencv()
        left, top = (min(piece.corner[axis] for piece in pieces.values()) for axis in (0, 1))
        right = max(piece.corner[0] + piece.pixels.mask.shape[1] for piece in pieces.values())
        bottom = max(piece.corner[1] + piece.pixels.mask.shape[0] for piece in pieces.values())
        none = np.ones((bottom - top, right - left), bool)
        growth = canvas.scale / self.scale
        seamed = {}
        for number, piece in pieces.items():
            height, width = masks[number].shape
            x, y = self.pieces[number].corner
            to_piece = shift(-piece.corner[0] - 0.5, -piece.corner[1] - 0.5) @ np.diag([growth, growth, 1.0])
            to_piece = to_piece @ shift(x + 0.5, y + 0.5)
            part = cv2.warpAffine(self.seams[number], to_piece[:2], (width, height), flags=cv2.INTER_LINEAR)
            seamed[number] = np.where(part > 127, masks[number], 0).astype(np.uint8)
            none[piece.window(left, top)] &= seamed[number] == 0
        for number, piece in pieces.items():
            place = piece.window(left, top)
            seamed[number] = np.where(none[place], masks[number], seamed[number])
            none[place] &= masks[number] == 0
        return seamed
