"""Where a map is torn, and how long its cuts are within a region."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.projections import Projection
from projdist.regions import GLOBE, Place, Region

Map = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]

_BENT = 0.1  # of the link's length; links of 1 degree stay well below, except at tears and singular points
_HALVINGS = 36  # of 1 degree leave 2 micrometres
_ROUNDING = 3e-8  # of the Earth's radius, 0.2 m: below it a jump is rounding, or 1 m from a pole
_JUMP = 1e-3  # of the link's length


@dataclass(frozen=True)
class Links:
    """What a map does between n pairs of neighbouring points."""

    torn: BoolArray  # the map jumps, or is not drawn at one end or both
    bent: BoolArray  # not torn, but the image of the midpoint is off the middle
    start: FloatArray  # (n, 4), u, v, x, y beside the link's start, on its side of the seam; NaN without one
    stop: FloatArray  # the same beside its stop


def evaluate(function: Map, u: FloatArray, v: FloatArray) -> FloatArray:
    """Points u, v and their images x, y: (n, 4)."""
    x, y = function(u, v)
    return np.stack([u, v, x, y], axis=-1)


def find_tears(
    function: Map, start: FloatArray, stop: FloatArray, radius: float, *, most: int = 3, smallest: float | None = None
) -> Links:
    """The tears between evaluated points `start` and `stop`, both (n, 4), on an Earth of `radius` metres."""
    # Of several tears in a link, up to `most`, those nearest to its ends are given. Only bent links are examined, in
    # which jumps of a thousandth of their length count; with `smallest` all are, and jumps of as many metres count.
    valid = drawn(start), drawn(stop)
    middle = evaluate(function, *(0.5 * (start[:, :2] + stop[:, :2])).T)
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
        # Images beyond another tear, seen from the end of the link, are replaced by those of that tear.
        for ends, image in zip((start, stop), images, strict=True):
            found = np.flatnonzero(drawn(image) & drawn(ends))
            if most > 1 and found.size:
                between = find_tears(function, ends[found], image[found], radius, most=most - 1, smallest=smallest)
                image[found[between.torn]] = between.start[between.torn]
    return Links(torn, bent & ~torn, *images)


def drawn(points: FloatArray) -> BoolArray:
    """True for evaluated points that have an image."""
    return np.asarray(np.isfinite(points[..., 2]))


def _distance(start: FloatArray, stop: FloatArray) -> FloatArray:
    return np.hypot(stop[:, 2] - start[:, 2], stop[:, 3] - start[:, 3])


def _halve(function: Map, start: FloatArray, stop: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The two sides of the largest jump, or of a change between drawn and not drawn."""
    low, high = start.copy(), stop.copy()
    for _ in range(_HALVINGS):
        middle = evaluate(function, *(0.5 * (low[:, :2] + high[:, :2])).T)
        both = drawn(low) & drawn(high)
        with np.errstate(invalid="ignore"):
            by_jump = _distance(middle, high) >= _distance(low, middle)
        go_up = np.where(both, drawn(middle) & by_jump, drawn(middle) == drawn(low))
        low, high = np.where(go_up[:, None], middle, low), np.where(go_up[:, None], high, middle)
    return low, high


# ---- the length of cuts --------------------------------------------------------------------------

_CELLS = 60  # along the longer side of a region: 3 or 6 degrees on the globe
_BLOCK = 4  # cells in a row, within which a cut is a straight line
_OFFSET = 0.4937  # of a cell: keeps links off the round longitudes and latitudes where cuts are
_INSET = 1e-6  # of a cell: a cut along the region's side does not count
_ONE_CUT = 1.25 * np.pi  # radii: between a meridian and the next longer cut, a meridian and a half


def is_interrupted(projection: Projection, region: Region) -> bool:
    """True if a map is cut within a region, where it need not be."""
    # In a region that goes round the globe a map may have cuts, if they are not longer than from pole to pole.
    if cut_length(projection, region) == 0.0:
        return False
    west, _, east, _ = region.bounds
    longest = _ONE_CUT * (projection.ellipsoid.ground.mean_radius / 1000.0)
    return east - west < 360.0 or cut_length(projection, GLOBE) > longest


def cut_length(projection: Projection, region: Place) -> float:
    """Kilometres of cuts within a region, to a sixtieth of its extent; 0 for a set of points."""
    # Each torn link of a grid counts for the width of its row or column; gaps below a tenth of it, and ends, do not.
    if not region.area_km2:
        return 0.0
    west, south, east, north = region.bounds
    step = max(east - west, north - south) / _CELLS
    columns, rows = (max(_BLOCK, int(np.ceil(span / step))) for span in (east - west, north - south))
    wide, high = (east - west) / columns, (north - south) / rows
    lon, lat = west + wide * (np.arange(columns) + _OFFSET), south + high * (np.arange(rows) + _OFFSET)
    round_the_earth = east - west >= 360.0
    sides = west + _INSET * wide, east - _INSET * wide
    all_lon = np.append(lon, lon[0] + 360.0) if round_the_earth else np.r_[sides[0], lon, sides[1]]
    all_lat = np.r_[south + _INSET * high, lat, north - _INSET * high]
    nodes = evaluate(projection, *(axis.ravel() for axis in np.meshgrid(all_lon, all_lat)))
    nodes = nodes.reshape(all_lat.size, all_lon.size, 4)
    inner = nodes[:, :-1] if round_the_earth else nodes[:, 1:-1]
    across = np.isfinite(_tears(projection, region, nodes[1:-1, :-1], nodes[1:-1, 1:]))
    along = np.nan_to_num(np.cos(np.radians(_tears(projection, region, inner[:-1], inner[1:]))))
    lengths = []
    for one in (high * across, wide * along):
        padded = np.zeros([_BLOCK * -(-size // _BLOCK) for size in (rows + 1, columns + 1)])
        padded[: one.shape[0], : one.shape[1]] = one
        lengths.append(padded.reshape(padded.shape[0] // _BLOCK, _BLOCK, -1, _BLOCK).sum(axis=(1, 3)))
    return float(np.radians(np.hypot(*lengths).sum()) * (projection.ellipsoid.ground.mean_radius / 1000.0))


def _tears(projection: Projection, region: Place, start: FloatArray, stop: FloatArray) -> FloatArray:
    """Latitudes at which links between evaluated points (m, n, 4) are torn within the region; NaN if not."""
    links = find_tears(projection, start.reshape(-1, 4), stop.reshape(-1, 4), projection.ellipsoid.a)
    torn = np.flatnonzero(links.torn & drawn(links.start) & drawn(links.stop))
    lon, lat = links.start[torn, :2].T
    latitudes = np.full(len(links.torn), np.nan)
    latitudes[torn] = np.where(region.contains(lon, lat), lat, np.nan)
    return latitudes.reshape(start.shape[:2])
