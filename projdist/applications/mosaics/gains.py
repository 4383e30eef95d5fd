"""How much brighter each image of a mosaic must be drawn to be as bright as the others where they overlap."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from projdist._typing import AnyArray, FloatArray
from projdist.applications.mosaics.libraries import as_array, opencv
from projdist.applications.mosaics.pieces import Piece, shift

__all__ = ["EXPOSURES", "gains_of", "raised"]

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
