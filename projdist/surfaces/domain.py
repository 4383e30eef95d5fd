"""The drawn part of a map, the requested region without parts that run off to infinity, and lines within it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypeGuard

import numpy as np
import shapely

from projdist._typing import ArrayLike, BoolArray, FloatArray, IntArray
from projdist.earth import wrapped
from projdist.field import drawn, evaluate, find_tears
from projdist.numerics import quantile
from projdist.projections import Projection
from projdist.regions import GLOBE, Box, Place, PointSet, Region, RegionLike, region_for
from projdist.support import check_number

Bounds = tuple[float, float, float, float]

_LARGEST_PART = 90.0  # degrees: larger regions are drawn without surroundings

POLE = 90.0 - 1e-5
"""The latitude that stands for a pole, 1 m away from it, where longitudes still differ by more than rounding."""


def longitude_width(bounds: Bounds) -> float:
    """Degrees of longitude from west to east, up to 360."""
    width = bounds[2] - bounds[0]
    return width if width < 360.0 - 1e-9 else 360.0


def ground_size(bounds: Bounds) -> tuple[float, float]:
    """Width and height in degrees on the ground; the width is at the middle latitude, or across the pole if less."""
    _, south, _, north = bounds
    width = longitude_width(bounds) * np.cos(np.radians(0.5 * (south + north)))
    equatorward = max(south, -north)
    across = 2.0 * (90.0 - equatorward) if equatorward > 0 and longitude_width(bounds) > 180.0 else np.inf
    return float(min(width, across)), north - south


def check_step(step: float) -> None:
    """Raise ValueError for a step, in degrees, that is not positive and finite."""
    if not 0.0 < check_number("step", step) < np.inf:
        raise ValueError(f"Invalid step '{step}'. It must be a positive number of degrees.")


class Survey(NamedTuple):
    """Images x, y and rough principal scales a >= b of a map on a grid lon, lat over a region; all (rows, columns)."""

    lon: FloatArray
    lat: FloatArray
    x: FloatArray
    y: FloatArray
    a: FloatArray
    b: FloatArray


@dataclass(frozen=True)
class Domain:
    """The drawn part of a projection; call it for x, y in metres, NaN outside."""

    projection: Projection
    region: Place
    box: Place  # the drawn area: of a region that is a part of the globe the box around it, else the region
    survey: Survey = field(compare=False, repr=False)
    # Test of x, y, a, b for parts that run off to infinity.
    beyond: Callable[[FloatArray, FloatArray, FloatArray, FloatArray], BoolArray] | None = None
    # Test of lon, lat that limits a map which folds to one sheet.
    within: Callable[[FloatArray, FloatArray], BoolArray] | None = None

    def __call__(self, lon: ArrayLike, lat: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Coordinates in metres of points in degrees, NaN for points that are not drawn."""
        lon, lat = np.broadcast_arrays(np.asarray(lon, dtype=float), np.asarray(lat, dtype=float))
        lon = wrapped(lon)
        x, y = self.projection(lon, lat)
        outside = self._outside(lon, lat, x)
        if self.beyond is not None:
            outside |= self.beyond(x, y, *rough_scales(self.projection, lon, lat, x, y))
        return np.where(outside, np.nan, x), np.where(outside, np.nan, y)

    def surveyed(self) -> BoolArray:
        """True for the places of the survey that are drawn."""
        survey = self.survey
        outside = self._outside(survey.lon, survey.lat, survey.x)
        if self.beyond is not None:
            outside |= self.beyond(survey.x, survey.y, survey.a, survey.b)
        return ~outside

    def _outside(self, lon: FloatArray, lat: FloatArray, x: FloatArray) -> BoolArray:
        """True for points without an image or outside the drawn area."""
        outside = ~np.isfinite(x)
        if self.box != GLOBE:
            outside |= ~self.box.contains(lon, lat)
        if self.within is not None:
            outside |= ~self.within(lon, lat)
        return outside

    def shows_nothing(self) -> ValueError:
        """The error for a map that shows nothing of a region."""
        return ValueError(f"Invalid region for '{self.projection.name}'. No part of it can be projected.")

    @property
    def radius(self) -> float:
        """The semi-major axis of the map's ellipsoid in metres."""
        return self.projection.ellipsoid.a


def domain_of(projection: Projection, region: RegionLike | None) -> Domain:
    """The drawn part of a projection in a region; None is its area of use, or the globe."""
    place = region_for(region, [projection])
    box = Box.between(place.bounds) if is_part(place) else place
    west, south, _, north = place.bounds
    # 180 by 121 places: two degrees apart on a globe.
    u = west + longitude_width(place.bounds) * (np.arange(180) + 0.5) / 180
    v = np.clip(south + (north - south) * np.linspace(0.0, 1.0, 121), -POLE, POLE)
    lon, lat = np.meshgrid(wrapped(u), v)
    x, y = projection(lon, lat)
    survey = Survey(lon, lat, x, y, *rough_scales(projection, lon, lat, x, y))
    return Domain(projection, place, box, survey, _beyond(projection, place, survey))


def is_part(region: Place) -> TypeGuard[Region]:
    """True if a region is drawn with its surroundings: polygons, and regions no larger than a continent."""
    if isinstance(region, PointSet):
        return False
    return len(region.edges) > 0 or max(ground_size(region.bounds)) <= _LARGEST_PART


_STEP = 2e-5  # degrees; 2 m on the ground, where differences still have 9 digits


def rough_scales(
    projection: Projection, lon: FloatArray, lat: FloatArray, x: FloatArray, y: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Principal scales a >= b at points with images x, y, by differences over 2 m, to about 5 digits."""
    # In each direction the smaller of two one-sided differences counts, so that a seam is not taken for a large scale.
    # Scales at a pole are those one step away from it.
    polar = np.abs(lat) > POLE - _STEP
    if polar.any():
        lat, x, y = np.clip(lat, -POLE + _STEP, POLE - _STEP), x.copy(), y.copy()
        x[polar], y[polar] = projection(lon[polar], lat[polar])
    east = _STEP / np.cos(np.radians(lat))
    lons = wrapped(np.stack([lon + east, lon - east, lon, lon]))
    lats = np.stack([lat, lat, lat + _STEP, lat - _STEP])
    xs, ys = projection(lons, lats)
    metres = np.radians(_STEP) * projection.ellipsoid.a
    columns = []
    for pair in ((0, 1), (2, 3)):
        dx, dy = (xs[[*pair]] - x) / metres, (ys[[*pair]] - y) / metres
        length = np.where(np.isfinite(dx), np.hypot(dx, dy), np.inf)
        first = length[0] <= length[1]
        columns.append((np.where(first, dx[0], -dx[1]), np.where(first, dy[0], -dy[1])))
    (xe, ye), (xn, yn) = columns
    total = np.hypot(xe + yn, ye - xn)
    difference = np.hypot(xe - yn, ye + xn)
    return 0.5 * (total + difference), 0.5 * np.abs(total - difference)


# Multiples of the part with usual scales. Maps that end reach 1.6 times as far (van der Grinten); Mercator's map, which
# grows slowly, is at 1.46 by 89 degrees and at 4 a metre from the pole.
_CORE, _FAR, _ENDLESS = 0.9, 1.35, 2.5
_WRONG, _GAPS = 10.0, 1e-3  # multiple of the limit of b that is wrong; share of nodes that makes a gap
_LARGE = 12.0  # times the usual scale: Mercator's at 85.2 degrees, the gnomonic map's at 73 degrees from the centre


def _beyond(
    projection: Projection, region: Place, survey: Survey
) -> Callable[[FloatArray, FloatArray, FloatArray, FloatArray], BoolArray] | None:
    """A test of x, y, a, b for parts that run off to infinity; None for maps without such parts."""
    lon, lat, x, y, a, b = survey
    within = region.contains(lon, lat)
    undefined = ~np.isfinite(x[within])
    inside = np.isfinite(x + a + b) & within
    if inside.sum() < 3:
        return None
    x, y, a, b = (value[inside] for value in (x, y, a, b))
    area = np.cos(np.radians(lat[inside]))
    a_limit = _LARGE * quantile(a, area, 0.05)
    near = a <= a_limit
    b_limit = 2.0 * quantile(b[near], area[near], 0.5)
    centre = np.array([x[near].mean(), y[near].mean()])
    spread = np.column_stack([x[near], y[near]]) - centre
    # A line, of at least two points, is made in a tenth of the time that points take.
    hull = shapely.convex_hull(shapely.linestrings(np.concatenate([spread, spread[:1]])))
    factors = (_CORE, _FAR, _ENDLESS)
    core, far, endless = (shapely.transform(hull, lambda xy, factor=factor: xy * factor) for factor in factors)
    # A large scale alone is no reason: it also occurs at pole lines, antipodes and the corners of conformal
    # squares, where the map ends a little farther out.
    best = int(np.argmax(np.hypot(x - centre[0], y - centre[1])))

    def distance(lon: FloatArray, lat: FloatArray) -> FloatArray:
        x, y = projection(lon, lat)
        away = np.hypot(x - centre[0], y - centre[1])
        return np.where(np.isfinite(away) & region.contains(lon, lat), away, -1.0)

    farthest = projection(*climb(distance, float(lon[inside][best]), float(lat[inside][best]))[:2])
    if shapely.contains_xy(endless, *(np.array(farthest) - centre)):
        # Beside gaps in a map that has an end PROJ may be wrong, as etmerc is within some degrees of singular points.
        wrong = _WRONG * b_limit if undefined.mean() > _GAPS else np.inf
        return (lambda x, y, a, b: b > wrong) if (b > wrong).any() else None
    shapely.prepare(core)
    shapely.prepare(far)

    def beyond(x: FloatArray, y: FloatArray, a: FloatArray, b: FloatArray) -> BoolArray:
        x, y = x - centre[0], y - centre[1]
        large = (a > a_limit) & ~shapely.contains_xy(core, x, y)
        return np.asarray(large & ((b > b_limit) | ~shapely.contains_xy(far, x, y)))

    return beyond


def climb(
    function: Callable[[FloatArray, FloatArray], FloatArray], lon: float, lat: float
) -> tuple[float, float, float]:
    """Longitude, latitude and value of a local maximum near a point, found on ever finer grids of 9 by 9 points."""
    span, offsets = 2.0, np.linspace(-1.0, 1.0, 9)
    while span > 1e-4:
        lons = wrapped(lon + span * offsets[:, None] / max(np.cos(np.radians(lat)), 1e-3))
        lons, lats = np.broadcast_arrays(lons, np.clip(lat + span * offsets, -POLE, POLE))
        values = function(lons, lats)
        best = int(np.argmax(values))
        lon, lat, span = float(lons.flat[best]), float(lats.flat[best]), span / 3.0
    return lon, lat, float(values.flat[best])


# ---- lines ----------------------------------------------------------------------------------------

_SMOOTH = 5e-4  # of the map's size; a chord farther than this from its arc is halved
_ROUNDS = 8
_LONGEST = 0.1  # of the map's size: a longer step crosses a seam that was missed, as may happen where many seams meet


def project_lines(domain: Domain, lines: Sequence[FloatArray], size: float) -> list[FloatArray]:
    """Images of lines of (lon, lat) as pieces of (x, y) without seams, smooth for a map of `size` metres."""
    if not lines:
        return []
    line = np.repeat(np.arange(len(lines)), [len(points) for points in lines])
    points = evaluate(domain, *np.concatenate(lines).T)
    joined = np.flatnonzero(line[1:] == line[:-1])
    for _ in range(_ROUNDS):
        joined = joined[drawn(points[joined + 1]) | drawn(points[joined])]
        middle = evaluate(domain, *(0.5 * (points[joined, :2] + points[joined + 1, :2])).T)
        offset = middle[:, 2:] - 0.5 * (points[joined, 2:] + points[joined + 1, 2:])
        coarse = ~(np.hypot(*offset.T) <= _SMOOTH * size)
        if not coarse.any():
            break
        where = joined[coarse] + 1
        points = np.insert(points, where, middle[coarse], axis=0)
        line = np.insert(line, where, line[where], axis=0)
        added = where + np.arange(where.size)
        joined = np.column_stack([added - 1, added]).ravel()  # the halves: the others are smooth
    xy = cut_at_tears(domain, points, line)[:, 2:]
    jumps = np.flatnonzero(np.hypot(*np.diff(xy, axis=0).T) > _LONGEST * size)
    xy = np.insert(xy, jumps + 1, np.nan, axis=0)
    return [xy[run] for run in runs(np.isfinite(xy[:, 0]))]


def cut_at_tears(domain: Domain, points: FloatArray, line: IntArray) -> FloatArray:
    """Points (n, 4) of numbered lines, cut at tears; rows of NaN separate lines and the two sides of a tear."""
    joined = np.flatnonzero(line[1:] == line[:-1])
    links = find_tears(domain, points[joined], points[joined + 1], domain.radius)
    torn = joined[links.torn]
    gap = np.full((torn.size, 1, 4), np.nan)
    ends = np.concatenate([links.start[links.torn][:, None], gap, links.stop[links.torn][:, None]], axis=1)
    last = np.flatnonzero(line[1:] != line[:-1]) + 1
    where = np.concatenate([np.repeat(torn + 1, 3), last])
    filling = np.concatenate([ends.reshape(-1, 4), np.full((last.size, 4), np.nan)])
    return np.insert(points, where, filling, axis=0)


def runs(there: BoolArray) -> list[slice]:
    """Runs of two or more true values."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]]).astype(np.int8)))
    return [slice(start, stop) for start, stop in ends.reshape(-1, 2) if stop - start > 1]


_ROUND_STEPS = (
    *(m * 10.0**k / 3600.0 for k in range(-2, 1) for m in (1, 2, 5)),
    *(seconds / 3600.0 for seconds in (10, 20, 30)),
    *(minutes / 60.0 for minutes in (1, 2, 5, 10, 20, 30)),
    *(1.0, 2.0, 5.0, 10.0, 15.0, 30.0),
)
_ACROSS = 6  # lines
_MOST_LINES = 2000  # more cannot be told apart


def graticule_steps(bounds: Bounds, step: float | None = None) -> tuple[float, float]:
    """Degrees between meridians and between parallels: those given, or round numbers for about six lines across."""
    # Raises ValueError for a step that makes more than 2000 lines.
    if step is not None:
        check_step(step)
        count = (longitude_width(bounds) + bounds[3] - bounds[1]) / step
        if count > _MOST_LINES:
            message = f"Invalid step '{step}'. It makes {count:,.0f} lines, and at most {_MOST_LINES:,} are drawn."
            raise ValueError(message)
        return step, step

    def nearest(step: float) -> float:
        """The round step nearest in ratio."""
        return min(_ROUND_STEPS, key=lambda candidate: abs(np.log(candidate / step)))

    parallels = nearest(max(ground_size(bounds)) / _ACROSS)
    return nearest(parallels / np.cos(np.radians(0.5 * (bounds[1] + bounds[3])))), parallels


def graticule(bounds: Bounds, meridian_step: float, parallel_step: float) -> list[FloatArray]:
    """Meridians, then parallels at multiples of the steps in degrees, as lines of (lon, lat)."""
    west, south, _, north = bounds
    along = np.linspace(max(south, -POLE), min(north, POLE), 181)
    across = np.linspace(west, west + longitude_width(bounds), 361)
    meridians, parallels = graticule_values(bounds, meridian_step, parallel_step)
    return [
        *(np.column_stack([np.full(along.size, value), along]) for value in meridians),
        *(np.column_stack([across, np.full(across.size, value)]) for value in parallels),
    ]


def graticule_values(bounds: Bounds, meridian_step: float, parallel_step: float) -> tuple[list[float], list[float]]:
    """Longitudes of meridians and latitudes of parallels at multiples of the steps, in degrees."""
    west, south, _, north = bounds
    east = west + longitude_width(bounds)
    # A pole is not a parallel, and on a whole globe the last meridian is the first. Ends may be off by rounding.
    across = west, east - (1e-6 if east - west == 360.0 else 0.0), meridian_step
    meridians, parallels = (
        [step * k for k in range(int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9)) + 1)]
        for low, high, step in (across, (max(south, -POLE), min(north, POLE), parallel_step))
    )
    return meridians, [value for value in parallels if abs(value) < POLE]


# ---- grids of points ------------------------------------------------------------------------------

_MOST_POINTS = 200_000  # half a degree apart on a globe, where ellipses are less than a pixel


def even_grid(bounds: Bounds, step: float, central_meridian: float | None = None) -> tuple[FloatArray, FloatArray]:
    """Points about `step` degrees apart on the ground, in rings of latitude; ValueError for an invalid step."""
    # The rings are symmetric about the middle latitude, the points about the middle meridian.
    check_step(step)
    west, south, _, north = bounds
    width = longitude_width(bounds)
    count = width * np.degrees(np.diff(np.sin(np.radians([south, north]))).item()) / step**2
    if count > _MOST_POINTS:
        message = f"Invalid step '{step}'. It makes {count:,.0f} ellipses, and at most {_MOST_POINTS:,} are drawn."
        raise ValueError(message)
    rows = max(round((north - south) / step), 1)
    lats = south + (north - south) * (np.arange(rows) + 0.5) / rows
    start = west if width < 360.0 or central_meridian is None else central_meridian - 180.0
    lons, points = [], []
    for lat in lats:
        count = max(round(width * np.cos(np.radians(lat)) / step), 3 if width == 360.0 else 1)
        lons.append(start + width * (np.arange(count) + 0.5) / count)
        points.append(np.full(count, lat))
    return wrapped(np.concatenate(lons)), np.concatenate(points)


def graticule_grid(bounds: Bounds, lat_step: float, lon_step: float) -> tuple[FloatArray, FloatArray]:
    """Crossings of parallels and meridians at multiples of the steps in degrees; raises ValueError for too many."""
    check_step(lat_step)
    check_step(lon_step)
    if longitude_width(bounds) / lon_step * (bounds[3] - bounds[1]) / lat_step > _MOST_POINTS:
        raise ValueError(f"Invalid grid '{lat_step:g},{lon_step:g}'. At most {_MOST_POINTS:,} ellipses are drawn.")
    meridians, parallels = graticule_values(bounds, lon_step, lat_step)
    lon, lat = np.meshgrid(meridians, parallels)
    return wrapped(lon.ravel()), lat.ravel()
