"""Pictures drawn into the canvas of a mosaic, tile by tile."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from projdist._typing import AnyArray
from projdist.applications.mosaics.blending import BLENDS, blender_of
from projdist.applications.mosaics.canvases import AnyCanvas
from projdist.applications.mosaics.common import EXPOSURES, SMALL, Common
from projdist.applications.mosaics.correspondences import Correspondences
from projdist.applications.mosaics.cropping import covered_box
from projdist.applications.mosaics.images import Picture, Pixels
from projdist.applications.mosaics.libraries import as_array
from projdist.applications.mosaics.pieces import Box, Store, common_box

__all__ = ["Rendered", "render"]

# A tile is drawn with a margin: the pyramid's reach is 3 * 2^5 pixels, that of the feather 1 / 0.02. Both are multiples
# of 2^5, so that the pyramids of all tiles have their pixels at the same places.
_TILE, _MARGIN = 2048, 128  # pixels


class Rendered(NamedTuple):
    """A drawn mosaic: red, green, blue and alpha (height, width, 4) of uint8, alpha being 0 or 255.

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
    crop: bool = False,
    most_pixels: float | None = None,
) -> Rendered:
    """Draw the pictures that a mosaic is of; those left out are not drawn.

    `blend`: "multiband" (by bands of frequencies, along seams where the images differ least), "feather" (by weights
    that fall to the rims) or "none" (later images lie on earlier ones). `exposure`: "gain" makes the images equally
    bright where they overlap. `crop`: to the largest box that is covered. `most_pixels`: of the canvas. OpenCV does
    the work, for a tile of 2048 pixels at a time. Raises ValueError, and ImportError without OpenCV.
    """
    for thing, word, words in (("blend", blend, BLENDS), ("exposure", exposure, EXPOSURES)):
        if word not in words:
            raise ValueError(f"Invalid {thing} '{word}'. It must be {', '.join(words[:-1])} or {words[-1]}.")
    sizes = found.points.sizes.tolist()
    if [list(picture.size) for picture in pictures] != sizes:
        raise ValueError(
            "Invalid images. They must be those of the correspondences, in their order, of the same sizes."
        )
    used = [pictures[image] for image in found.images]
    canvas = found.canvas(most_pixels=most_pixels)
    store = Store(used)
    common = Common(found.canvas(most_pixels=SMALL), store, blend, exposure)
    pixels = np.zeros((canvas.height, canvas.width, 4), np.uint8)
    boxes = [canvas.bounds(number, picture.size) for number, picture in enumerate(used)]
    for top in range(0, canvas.height, _TILE):
        for left in range(0, canvas.width, _TILE):
            tile = left, top, min(left + _TILE, canvas.width), min(top + _TILE, canvas.height)
            pixels[tile[1] : tile[3], tile[0] : tile[2]] = _tile(tile, canvas, boxes, store, common, blend)
    if crop:
        pixels, canvas = _cropped(pixels, canvas)
    return Rendered(pixels, canvas, all(picture.is_grey for picture in used))


# ---- tiles ----------------------------------------------------------------------------------


def _tile(tile: Box, canvas: AnyCanvas, boxes: Sequence[Box], store: Store, common: Common, blend: str) -> AnyArray:
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
            pieces[number] = piece._replace(pixels=Pixels(common.even(number, piece), piece.pixels.mask))
    masks = common.cut(pieces, canvas)
    blender = blender_of(blend)
    blender.prepare((around[0], around[1], around[2] - around[0], around[3] - around[1]))
    for number, piece in pieces.items():
        if masks[number].any():
            blender.feed(piece.pixels.colours.astype(np.int16), masks[number], piece.corner)
    colours, mask = blender.blend(None, None)
    pixels = np.dstack([np.clip(as_array(colours), 0, 255), np.where(as_array(mask) > 0, 255, 0)]).astype(np.uint8)
    pixels[pixels[..., 3] == 0] = 0
    inside = slice(top - around[1], bottom - around[1]), slice(left - around[0], right - around[0])
    return np.asarray(pixels[inside])


# ---- cropping -------------------------------------------------------------------------------


def _cropped(pixels: AnyArray, canvas: AnyCanvas) -> tuple[AnyArray, AnyCanvas]:
    """The largest box of pixels that are all covered, and its canvas."""
    box = covered_box(pixels[..., 3] > 0)
    left, top, right, bottom = box
    return pixels[top:bottom, left:right], canvas.cropped(box)
