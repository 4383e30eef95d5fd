"""Where a map is torn: links between neighbouring points, and the images of the seam on both sides.

A link whose midpoint does not fall near the middle of its image is looked into: it is halved
again and again, each time keeping the half that has the greater jump, or the change between
drawn and not drawn. If the jump remains, the link is torn, and the halving has found the place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from projdist._typing import BoolArray, FloatArray

Map = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]

_BENT = 0.1  # of the link's length; neighbours 1 degree apart stay well below, but for tears and singular points
_HALVINGS = 36  # of 1 degree leave 2 micrometres
_ROUNDING = 3e-8  # of the Earth's radius, 0.2 m: below it a jump is rounding, or 1 m from a pole
_JUMP = 1e-3  # of the link's length


@dataclass(frozen=True)
class Links:
    """What is between pairs of neighbouring points.

    `torn` where the map jumps, or where it is not drawn at one end or both. `bent` where the
    midpoint is off the middle of the image, yet nothing is torn. `start` and `stop` are (n, 4):
    u, v, x, y of the seam's images on the side of either end; NaN where there is none.
    """

    torn: BoolArray
    bent: BoolArray
    start: FloatArray
    stop: FloatArray


def evaluate(function: Map, u: FloatArray, v: FloatArray) -> FloatArray:
    """Points u, v and their images, shape (n, 4)."""
    x, y = function(u, v)
    return np.stack([u, v, x, y], axis=-1)


def find_tears(
    function: Map,
    start: FloatArray,
    stop: FloatArray,
    radius: float,
    *,
    most: int = 3,
    smallest: float | None = None,
) -> Links:
    """The tears between evaluated points `start` and `stop`, both (n, 4), on an Earth of `radius` metres.

    Where a link has several tears, up to `most`, the images are those nearest to its ends. Links that are bent are
    looked into, and jumps of a thousandth of their length count; with `smallest`, all links, and jumps of so many
    metres.
    """
    valid = drawn(start), drawn(stop)
    middle = _middle(function, start, stop)
    offset = _distance(middle, 0.5 * (start + stop))
    length = _distance(start, stop)
    with np.errstate(invalid="ignore"):
        bent = valid[0] & valid[1] & ~((offset <= _BENT * length) | (offset <= _ROUNDING * radius))
    torn = ~(valid[0] & valid[1])
    n = len(start)
    images = np.full((n, 4), np.nan), np.full((n, 4), np.nan)
    look = np.flatnonzero((bent if smallest is None else valid[0] & valid[1]) | (valid[0] != valid[1]))
    if look.size:
        low, high = _halve(function, start[look], stop[look])
        jump = _distance(low, high)
        least = np.maximum(_ROUNDING * radius, _JUMP * np.fmax(length[look], offset[look]))
        least = least if smallest is None else np.full_like(least, smallest)
        with np.errstate(invalid="ignore"):
            torn[look] |= ~(jump <= least)
        images[0][look], images[1][look] = low, high
        for image in images:
            image[~torn | ~drawn(image)] = np.nan
        # A gap in the middle of a link: the halving went to its near edge; the far edge is still to be found.
        gap = look[valid[0][look] & valid[1][look] & ~drawn(high)]
        if gap.size:
            images[1][gap] = _halve(function, high[np.searchsorted(look, gap)], stop[gap])[1]
        _take_nearest(function, start, images[0], radius, most, smallest)
        _take_nearest(function, stop, images[1], radius, most, smallest)
    return Links(torn, bent & ~torn, *images)


def _take_nearest(
    function: Map, ends: FloatArray, images: FloatArray, radius: float, most: int, smallest: float | None
) -> None:
    """Replace images that are beyond another tear, seen from the end of the link, by those of that tear."""
    found = np.flatnonzero(drawn(images) & drawn(ends))
    if most > 1 and found.size:
        between = find_tears(function, ends[found], images[found], radius, most=most - 1, smallest=smallest)
        images[found[between.torn]] = between.start[between.torn]


def drawn(points: FloatArray) -> BoolArray:
    """Whether evaluated points have an image."""
    return np.asarray(np.isfinite(points[..., 2]))


def _middle(function: Map, start: FloatArray, stop: FloatArray) -> FloatArray:
    return evaluate(function, *(0.5 * (start[:, :2] + stop[:, :2])).T)


def _distance(start: FloatArray, stop: FloatArray) -> FloatArray:
    return np.hypot(stop[:, 2] - start[:, 2], stop[:, 3] - start[:, 3])


def _halve(function: Map, start: FloatArray, stop: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The two sides of the greatest jump, or of the first change between drawn and not drawn."""
    low, high = start.copy(), stop.copy()
    for _ in range(_HALVINGS):
        middle = _middle(function, low, high)
        both = drawn(low) & drawn(high)
        with np.errstate(invalid="ignore"):
            by_jump = _distance(middle, high) >= _distance(low, middle)
        go_up = np.where(both, drawn(middle) & by_jump, drawn(middle) == drawn(low))
        low, high = np.where(go_up[:, None], middle, low), np.where(go_up[:, None], high, middle)
    return low, high
