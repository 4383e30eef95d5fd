"""Pictures drawn into the canvas of a mosaic, tile by tile."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from projdist._typing import AnyArray
from projdist.applications.mosaics.blending import BLENDS, blender_of
from projdist.applications.mosaics.canvases import AnyCanvas
from projdist.applications.mosaics.common import SMALL, Common
from projdist.applications.mosaics.correspondences import Correspondences
from projdist.applications.mosaics.cropping import covered_box
from projdist.applications.mosaics.deep_images import DEEPEST
from projdist.applications.mosaics.gains import EXPOSURES
from projdist.applications.mosaics.images import Picture, Pixels
from projdist.applications.mosaics.pieces import Box, Store, common_box

__all__ = ["DEPTHS", "Rendered", "render"]

# A tile is drawn with a margin: the pyramid's reach is 3 * 2^5 pixels, that of the feather 1 / 0.02. Both are multiples
# of 2^5, so that the pyramids of all tiles have their pixels at the same places.
_TILE, _MARGIN = 2048, 128  # pixels
DEPTHS = (8, 16)


class Rendered(NamedTuple):
    """A drawn mosaic: red, green, blue and alpha (height, width, 4) of uint8 or uint16, alpha being 0 or the most.

    `canvas`: that of these pixels, after cropping, too. `is_grey`: no image has colours.
    """

    pixels: AnyArray
    canvas: AnyCanvas
    is_grey: bool

    @property
    def bands(self) -> AnyArray:
        """The same pixels, (height, width, 2) of grey and alpha where there are no colours."""
        return self.pixels[..., [0, 3]] if self.is_grey else self.pixels


class Drawable(Protocol):
    """What can be drawn: a `Mosaic`, or a panorama in a map projection."""

    @property
    def points(self) -> Correspondences:
        """Those of all images."""

    @property
    def images(self) -> list[int]:
        """The numbers of the images that are drawn."""

    def canvas(self, *, most_pixels: float | None = None) -> AnyCanvas:
        """The picture that holds them, of so many pixels at most."""


def render(
    found: Drawable,
    pictures: Sequence[Picture],
    *,
    blend: str = "multiband",
    exposure: str = "gain",
    depth: int = 8,
    crop: bool = False,
    most_pixels: float | None = None,
) -> Rendered:
    """Draw the pictures that a mosaic is of; those left out are not drawn.

    `blend`: "multiband" (by bands of frequencies, along seams where the images differ least), "feather" (by weights
    that fall to the rims) or "none" (later images lie on earlier ones). `exposure`: "gain" makes the images equally
    bright where they overlap, "blocks" parts of them, too, as vignettes need. `depth`: bits a colour, 8 or 16, with
    which images of 12 or 16 bits keep their values, and numbers that are no whole ones have 0 to 65535 for the range
    that all images have together. `crop`: to the largest box that is covered. `most_pixels`: of the canvas. OpenCV does
    the work, for a tile of 2048 pixels at a time. Raises ValueError, and ImportError without OpenCV.
    """
    for thing, word, words in (("blend", blend, BLENDS), ("exposure", exposure, EXPOSURES)):
        if word not in words:
            raise ValueError(f"Invalid {thing} '{word}'. It must be {', '.join(words[:-1])} or {words[-1]}.")
    if depth not in DEPTHS:
        raise ValueError(f"Invalid depth {depth}. It must be 8 or 16 bits.")
    sizes = found.points.sizes.tolist()
    if [list(picture.size) for picture in pictures] != sizes:
        raise ValueError(
            "Invalid images. They must be those of the correspondences, in their order, of the same sizes."
        )
    used = [pictures[image] for image in found.images]
    canvas = found.canvas(most_pixels=most_pixels)
    store = Store(used, depth > 8)
    most = DEEPEST if depth > 8 else 255
    common = Common(found.canvas(most_pixels=SMALL), store, blend, exposure)
    pixels = np.zeros((canvas.height, canvas.width, 4), np.uint8 if depth == 8 else np.uint16)
    boxes = [canvas.bounds(number, picture.size) for number, picture in enumerate(used)]
    for top in range(0, canvas.height, _TILE):
        for left in range(0, canvas.width, _TILE):
            tile = left, top, min(left + _TILE, canvas.width), min(top + _TILE, canvas.height)
            pixels[tile[1] : tile[3], tile[0] : tile[2]] = _tile(tile, canvas, boxes, store, common, blend, most)
    if depth > 8:
        _in_levels(pixels, used)
    if crop:
        pixels, canvas = _cropped(pixels, canvas)
    return Rendered(pixels, canvas, all(picture.is_grey for picture in used))


# ---- tiles ----------------------------------------------------------------------------------


def _tile(
    tile: Box, canvas: AnyCanvas, boxes: Sequence[Box], store: Store, common: Common, blend: str, most: int
) -> AnyArray:
    """The pixels of a tile, from all images that reach it or its margin."""
    left, top, right, bottom = tile
    around = (
        max(left - _MARGIN, 0),
        max(top - _MARGIN, 0),
        min(right + _MARGIN, canvas.width),
        min(bottom + _MARGIN, canvas.height),
    )
    pieces = {}
    for number, box in enumerate(boxes):
        part = common_box(box, around)
        if part is not None:
            piece = canvas.warped(store.read(number), number, part)
            even = common.even(number, piece, canvas)
            pieces[number] = piece._replace(pixels=Pixels(even, piece.pixels.mask))
    masks = common.cut(pieces, canvas)
    blender = blender_of(blend, around)
    for number, piece in pieces.items():
        if masks[number].any():
            blender.feed(piece.pixels.colours, masks[number], piece.corner)
    colours, seen = blender.blend()
    drawn = np.zeros((*seen.shape, 4), np.uint8 if most < DEEPEST else np.uint16)
    drawn[..., :3] = np.clip(np.rint(colours, out=colours), 0, most, out=colours)
    drawn[..., 3] = most
    drawn[~seen] = 0
    inside = slice(top - around[1], bottom - around[1]), slice(left - around[0], right - around[0])
    return np.asarray(drawn[inside])


def _in_levels(pixels: AnyArray, used: Sequence[Picture]) -> None:
    """Give whole numbers back the values that the files have: 12 bits stay 12 bits."""
    deep = [picture for picture in used if picture.is_deep]
    if deep and deep[0].levels.low == 0.0 and deep[0].is_whole:
        share = deep[0].levels.high / DEEPEST
        pixels[..., :3] = np.round(pixels[..., :3] * share)


# ---- cropping -------------------------------------------------------------------------------


def _cropped(pixels: AnyArray, canvas: AnyCanvas) -> tuple[AnyArray, AnyCanvas]:
    """The largest box of pixels that are all covered, and its canvas."""
    box = covered_box(pixels[..., 3] > 0)
    left, top, right, bottom = box
    return pixels[top:bottom, left:right], canvas.cropped(box)
