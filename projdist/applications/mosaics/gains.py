"""What the images of a mosaic agree on: how bright they are, and the seams between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from projdist._typing import AnyArray, FloatArray
from projdist.applications.mosaics.canvases import AnyCanvas
from projdist.applications.mosaics.images import Piece, Store, as_array, opencv, shift

EXPOSURES = ("gain", "blocks", "none")

# Pixels a side of the small canvas that have one gain, and how often these are found anew: of vignettes by a third what
# shows at seams becomes four tenths; blocks of 32 pixels leave seven, and 8 follow what the images show.
_BLOCK, _FEEDS = 16, 4


def gains_of(exposure: str, pieces: Sequence[Piece]) -> list[FloatArray] | None:
    """A gain for each piece (1, 1), or for each of its blocks, from whole pieces on a small canvas; None for "none".

    Blocks even out vignettes: pieces that are darker at their rims.
    """
    if exposure == "none":
        return None
    detail = opencv().detail
    feeder = detail.GainCompensator() if exposure == "gain" else detail.BlocksGainCompensator(_BLOCK, _BLOCK, _FEEDS)
    feeder.feed(
        [piece.corner for piece in pieces],
        [piece.pixels.colours for piece in pieces],
        [piece.pixels.mask for piece in pieces],
    )
    return [np.atleast_2d(np.asarray(as_array(one), dtype=np.float32)) for one in feeder.getMatGains()]


def raised(piece: Piece, gains: FloatArray, whole: Piece, growth: float) -> AnyArray:
    """The colours of a piece with the gains of the whole, on a canvas that is larger by a growth."""
    colours = piece.pixels.colours
    top = np.iinfo(colours.dtype).max
    height, width = colours.shape[:2]
    each = gains
    if gains.size > 1:
        cv2 = opencv()
        (down, across), (tall, wide) = whole.pixels.mask.shape, gains.shape
        to_piece = shift(-piece.corner[0] - 0.5, -piece.corner[1] - 0.5) @ np.diag([growth, growth, 1.0])
        to_piece = to_piece @ shift(*whole.corner) @ np.diag([across / wide, down / tall, 1.0]) @ shift(0.5, 0.5)
        each = cv2.warpAffine(
            gains, to_piece[:2], (width, height), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
    bright = np.rint(colours * each[..., None])
    return np.minimum(bright, top, out=bright).astype(colours.dtype)


# ---- common --------------------------------------------------------------------------------------


SMALL = 3e5  # pixels of the canvas on which gains and seams are found


class Common:
    """The gains of all images and the seams between them, found on a small canvas."""

    def __init__(self, small: AnyCanvas, store: Store, blend: str, exposure: str) -> None:
        """`small`: the canvas in at most `SMALL` pixels."""
        cv2 = opencv()
        self.scale = small.scale
        self.pieces = [
            _shallow(small.warped(store.read(number), number, small.bounds(number, picture.size)))
            for number, picture in enumerate(store.pictures)
        ]
        self.places = [piece.corner for piece in self.pieces]
        self.gains = gains_of(exposure, self.pieces)
        self.seams: list[AnyArray] | None = None
        if blend == "multiband":
            colours = [_even(self.gains, number, piece, piece, 1.0) for number, piece in enumerate(self.pieces)]
            finder = cv2.detail.GraphCutSeamFinder("COST_COLOR")
            masks = [piece.pixels.mask for piece in self.pieces]
            cut = finder.find([one.astype(np.float32) for one in colours], self.places, masks)
            # A pixel more on either side: what is between two small pixels belongs to both.
            self.seams = [cv2.dilate(as_array(one), None) for one in cut]

    def even(self, number: int, piece: Piece, canvas: AnyCanvas) -> AnyArray:
        """The colours of a piece of an image on a canvas with its gain."""
        return _even(self.gains, number, piece, self.pieces[number], canvas.scale / self.scale)

    def cut(self, pieces: dict[int, Piece], canvas: AnyCanvas) -> dict[int, AnyArray]:
        """The masks of pieces, along the seams; what no image would then have goes to the first that can."""
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
            x, y = self.places[number]
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


def _even(gains: list[FloatArray] | None, number: int, piece: Piece, whole: Piece, growth: float) -> AnyArray:
    """The colours of a piece, with its gain where there are any."""
    return piece.pixels.colours if gains is None else raised(piece, gains[number], whole, growth)


def _shallow(piece: Piece) -> Piece:
    """A piece with 8 bits a colour, which gains and seams are found with."""
    colours = piece.pixels.colours
    if colours.dtype == np.uint8:
        return piece
    return piece._replace(pixels=piece.pixels._replace(colours=(colours // 257).astype(np.uint8)))
