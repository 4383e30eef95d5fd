"""Distances between all pairs of points of a region, and the bending of great circles."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from projdist import earth, support
from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.projections import Projection, ProjectionLike, geodesic_direct, geodesic_inverse
from projdist.regions import Box, Cap, Place, PointSet, Region, RegionLike, cells_of, region_for

# Points in a set, for spheres (True), on which distances cost a twentieth, and for other ellipsoids.
_SIZES = {True: (1024, 2048), False: (512, 1024)}
_EXACT = 1000  # most points of which all pairs are taken
_TOLERANCE = 5e-3  # of the value, for polygons; on whole globes the first sets give 1e-4 of a distance measure


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class FiniteDistortion(support.Answer):
    """A measure of finite distortion, its standard error, and the number of `pairs` of points; NaN if undefined."""

    given: str = field(metadata=support.schema("projection"))
    projection: Projection = field(metadata=support.schema(of=("name", "definition"), spread=True))
    region: Place = field(metadata=support.schema(of=("name", "area_km2")))
    measure: str
    value: float
    error: float
    pairs: int
    coverage: float  # share of the area, or of the geodesics, that is on the map; pairs beyond it do not count

    def _line(self) -> str:
        return f"{self.projection.name} over {self.region.name}: {self.measure} {self.value:.4g} ± {self.error:.1g}"

    def _table(self) -> list[dict[str, Any]]:
        return [support.values_of(self) | {"region": self.region.name}]


# ---- distance measures ---------------------------------------------------------------------------

MapDistance = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]
DistanceMeasure = Callable[[FloatArray, FloatArray], float]


def gott(ratio: FloatArray, weight: FloatArray) -> float:
    """Standard deviation of ln(d_map / d_globe) at any scale: sigma, or D, of Gott, Mugnolo & Colley 2007."""
    logarithm = np.log(ratio)
    logarithm -= weighted_sum(logarithm, weight)
    return float(np.sqrt(weighted_sum(np.square(logarithm), weight)))


def peters(ratio: FloatArray, weight: FloatArray) -> float:
    """Mean of |d_map - d_globe| / (d_map + d_globe) at the map's own scale, the distance index of Peters 1984."""
    return weighted_sum(np.abs(ratio - 1.0) / (ratio + 1.0), weight)


def canters(ratio: FloatArray, weight: FloatArray) -> float:
    """Mean finite scale factor K1 = (1 + D) / (1 - D) of Canters 2002, with D the index of Peters."""
    # It is K for a map whose distances are all K times the true ones, or all 1 / K times. Canters chose other
    # distances: on land without Antarctica his map with six coefficients has 1.143, and over all pairs 1.18.
    index = peters(ratio, weight)
    return (1.0 + index) / (1.0 - index) if index < 1.0 else np.inf


# A search uses every so many pairs: near the minimum the loss is of second order. A prime, as pairs come in rows.
_THINNED = 61
_REACH, _HALVINGS = 4.0, 32  # of ln scale to either side of the geometric mean


def best_scale_of_distances(ratio: FloatArray, weight: FloatArray) -> float:
    """Logarithm of the scale that minimises the indices of Peters and of Canters."""
    logarithm, weight = np.log(ratio[::_THINNED]), weight[::_THINNED]
    # The index is the mean of |tanh(ln(r) / 2)|; its slope is negative below the best scale, and positive above it.
    middle = -weighted_sum(logarithm, weight) / float(weight.sum())
    low, high = middle - _REACH, middle + _REACH
    for _ in range(_HALVINGS):
        scale = 0.5 * (low + high)
        half = 0.5 * (logarithm + scale)
        rises = weighted_sum(np.sign(half) / np.cosh(half) ** 2, weight) > 0.0
        low, high = (low, scale) if rises else (scale, high)
    return 0.5 * (low + high)


def weighted_sum(values: FloatArray, weight: FloatArray) -> float:
    """Sum of values (n,) times weights (n,)."""
    # Not a product of vectors: BLAS would start threads, which do not pay for a quarter of a million numbers.
    return float(np.sum(weight * values))


DISTANCE_MEASURES: support.Registry[DistanceMeasure] = support.Registry(
    "measure",
    {"gott": gott, "peters": peters, "canters": canters},
    rule="It must be one of gott, peters, canters, or a function of ratios and weights.",
)


# ---- pairs of points -----------------------------------------------------------------------------


class ScatteredPoints(NamedTuple):
    """Points in degrees, and weights for means by true area; all of shape (n,)."""

    lon: FloatArray
    lat: FloatArray
    weight: FloatArray

    def take(self, kept: BoolArray | IntArray) -> ScatteredPoints:
        """The points of a mask, or of numbers."""
        return ScatteredPoints(self.lon[kept], self.lat[kept], self.weight[kept])


def distance_distortion(
    projection: ProjectionLike,
    region: RegionLike | None = None,
    *,
    measure: str | DistanceMeasure = "gott",
    map_distance: MapDistance | None = None,
    tolerance: float = _TOLERANCE,
    seed: int = 0,
) -> FiniteDistortion:
    """How much a map distorts the distances between all pairs of points of a region.

    Four million pairs are taken, a million on an ellipsoid, and four times as many if the standard error is above
    `tolerance` times the value. Of a set of up to a thousand points all pairs are taken, and the error is 0.

    Parameters
    ----------
    projection : ProjectionLike
    region : RegionLike, optional
        Anything that `get_region` takes, also a `PointSet`; by default the area of use of a CRS, or the globe.
    measure : str or callable, default "gott"
        A name of `DISTANCE_MEASURES`, or a function of the ratios d_map / d_globe (n,) and their weights (n,) of sum 1.
    map_distance : callable, optional
        Function of x0, y0, x1, y1, which broadcast, for distances on the map that are not straight, all in metres:
        `worldmaps.distance_around_edge` for maps with two sides.
    tolerance : float, default 5e-3
        Standard error, relative to the value, that is small enough.
    seed : int, default 0
        Seed of the random points.

    Returns
    -------
    FiniteDistortion
        The `value`, its standard `error`, and the number of `pairs`.

    Raises
    ------
    ProjectionError, ValueError
        For an unknown projection, region or measure, or an invalid `map_distance`, tolerance or seed.

    References
    ----------
    - Gott, Mugnolo & Colley 2007, Map projections minimizing distance errors, Cartographica 42:219 (arXiv
      astro-ph/0608500): "gott", which they give as 0.343 for Lambert's azimuthal map ("laea").
    - Peters 1984, Distance-related Maps, The American Cartographer 11:119: "peters".
    - Canters 2002, Small-scale Map Projection Design: "canters".

    Examples
    --------
    Of three pairs on the equator one is 20 degrees apart, and 340 on the map, across its cut; the other two are true.
    The standard deviation of ln(ratio) is ln(17) sqrt(2) / 3.

    >>> import numpy as np
    >>> points = PointSet(np.array([-170.0, 0.0, 170.0]), np.zeros(3), np.ones(3))
    >>> round(distance_distortion("plate-carree", points).value, 8)
    1.33558958
    """
    options: dict[str, Any] = {"map_distance": map_distance, "tolerance": tolerance, "seed": seed}
    return distance_distortions(projection, region, [measure], **options)[0]


def distance_distortions(
    projection: ProjectionLike,
    region: RegionLike | None = None,
    measures: Sequence[str | DistanceMeasure] = tuple(DISTANCE_MEASURES),
    *,
    map_distance: MapDistance | None = None,
    tolerance: float = _TOLERANCE,
    seed: int = 0,
) -> list[FiniteDistortion]:
    """Several measures of the same pairs; the first decides whether more pairs are needed."""
    functions = [measure if callable(measure) else DISTANCE_MEASURES.named(measure) for measure in measures]
    names = [getattr(one, "__name__", type(one).__name__) if callable(one) else one for one in measures]
    if map_distance is not None and not callable(map_distance):
        raise ValueError(f"Invalid map_distance {support.quoted(map_distance)}. It must be a function.")
    figures = functools.partial(_over_pairs, functions, map_distance or _straight)
    return _answers(projection, region, names, figures, _SIZES, tolerance, seed, exact=_EXACT)


def _over_pairs(
    functions: Sequence[DistanceMeasure],
    distance: MapDistance,
    projection: Projection,
    one: ScatteredPoints,
    other: ScatteredPoints,
    rng: np.random.Generator | None = None,
) -> Found:
    """The measures over pairs of a point of one set and a point of another."""
    shown = []
    for points in (one, other):
        x, y = projection(points.lon, points.lat)
        there = np.isfinite(x)
        shown.append((points.take(there), x[there], y[there]))
    (on, x, y), (to, to_x, to_y) = shown
    coverage = (on.weight.sum() + to.weight.sum()) / (one.weight.sum() + other.weight.sum())
    ratios, weights = [], []
    for rows, columns in _groups(on, to, rng):
        globe = _globe_distances(projection, on.take(rows), to.take(columns))
        globe[globe == 0.0] = np.nan  # the same point twice
        apart = distance(x[rows, None], y[rows, None], to_x[columns], to_y[columns])
        ratios.append((apart / globe).ravel())
        weights.append(np.outer(on.weight[rows], to.weight[columns]).ravel())
    ratio, weight = np.concatenate(ratios), np.concatenate(weights)
    counts = ~np.isnan(ratio)
    if not counts.all():
        ratio, weight = ratio[counts], weight[counts]
    if not weight.sum() > 0.0:
        return Found(np.full(len(functions), np.nan), 0, float(coverage))
    weight = weight / weight.sum()
    with np.errstate(divide="ignore", invalid="ignore"):  # where two points coincide on the map
        values = np.array([function(ratio, weight) for function in functions])
    return Found(np.where(np.isfinite(values), values, np.nan), ratio.size, float(coverage))


def _straight(x0: FloatArray, y0: FloatArray, x1: FloatArray, y1: FloatArray) -> FloatArray:
    dx, dy = x0 - x1, y0 - y1
    return np.sqrt(dx * dx + dy * dy)


def _globe_distances(projection: Projection, one: ScatteredPoints, other: ScatteredPoints) -> FloatArray:
    """True distances in metres from points (n,) to points (m,), shape (n, m)."""
    ellipsoid = projection.ellipsoid
    if ellipsoid.is_sphere:
        vectors = earth.unit_vectors(one.lon, one.lat)[:, :, None]
        return ellipsoid.a * earth.chord_angle(vectors, earth.unit_vectors(other.lon, other.lat)[:, None])
    return geodesic_inverse(ellipsoid, one.lon[:, None], one.lat[:, None], other.lon, other.lat)[0]


# ---- great circles -------------------------------------------------------------------------------

_GREAT_CIRCLE_SIZES = dict.fromkeys(_SIZES, (128, 256))  # points in a set
_STATIONS = 8  # on a great circle


def great_circle_bending(
    projection: ProjectionLike, region: RegionLike | None = None, *, tolerance: float = _TOLERANCE, seed: int = 0
) -> FiniteDistortion:
    """How far a map bends the geodesics between all pairs of points of a region.

    It is the mean distance of the image of a geodesic from the straight line between its ends on the map, as a share of
    that line's length, along each geodesic and over all of them: 0 on a gnomonic map. For short arcs of length L it is
    f L / 12 with the flexion f of Goldberg & Gott 2007, its local form. Geodesics that the map tears count as drawn.

    Parameters
    ----------
    projection : ProjectionLike
    region : RegionLike, optional
        Anything that `get_region` takes, also a `PointSet`; by default the area of use of a CRS, or the globe.
    tolerance : float, default 5e-3
        Standard error, relative to the value; if it is larger, four times as many geodesics are taken.
    seed : int, default 0
        Seed of the random geodesics.

    Returns
    -------
    FiniteDistortion
        The `value`, its standard `error` as in `distance_distortion`, and the number of geodesics, `pairs`.

    Raises
    ------
    ProjectionError, ValueError
        For an unknown projection or region, a tolerance that is not positive, or a seed that is no whole number.

    References
    ----------
    Goldberg & Gott 2007, Flexion and Skewness in Map Projections of the Earth, Cartographica 42:297, section 3.

    Examples
    --------
    From 170 to 190 degrees east the equator lies 5 degrees, on average, beyond the ends of a line of 340 degrees.

    >>> import numpy as np
    >>> from projdist import PointSet
    >>> points = PointSet(np.array([170.0, -170.0]), np.zeros(2), np.ones(2))
    >>> round(great_circle_bending("plate-carree", points).value, 4)
    0.0147
    """
    return _answers(projection, region, ["bending"], _over_geodesics, _GREAT_CIRCLE_SIZES, tolerance, seed)[0]


def _over_geodesics(
    projection: Projection, one: ScatteredPoints, other: ScatteredPoints, rng: np.random.Generator | None
) -> Found:
    assert rng is not None
    blocks = [np.ix_(rows, columns) for rows, columns in _groups(one, other, rng)]
    i, j = (np.concatenate([np.broadcast_arrays(*block)[k].ravel() for block in blocks]) for k in (0, 1))
    weight = one.weight[i] * other.weight[j]
    # Stations a step apart, with a random offset for each geodesic, so that their mean has no bias.
    offset = np.mod(_GOLDEN * np.arange(i.size) + rng.random(), 1.0)
    shares = (np.arange(_STATIONS) + offset[:, None]) / _STATIONS
    lon, lat = _along(projection, (one.lon[i], one.lat[i], other.lon[j], other.lat[j]), shares)
    x, y = projection(lon, lat)
    x0, y0 = (values[i, None] for values in projection(one.lon, one.lat))
    x1, y1 = (values[j, None] for values in projection(other.lon, other.lat))
    dx, dy = x1 - x0, y1 - y0
    square = dx * dx + dy * dy
    square[square == 0.0] = np.nan  # the same point twice
    share = np.clip(((x - x0) * dx + (y - y0) * dy) / square, 0.0, 1.0)
    away = np.hypot(x - x0 - share * dx, y - y0 - share * dy) / np.sqrt(square)
    figures = away.mean(axis=1)
    counts = np.isfinite(figures)
    if not weight[counts].sum() > 0.0:
        return Found(np.array([np.nan]), 0, 0.0)
    kept = weight[counts] / weight[counts].sum()
    value = np.array([weighted_sum(figures[counts], kept)])
    return Found(value, int(counts.sum()), float(weight[counts].sum() / weight.sum()))


def _along(
    projection: Projection, ends: tuple[FloatArray, FloatArray, FloatArray, FloatArray], shares: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Longitudes and latitudes (n, k) at shares (n, k) of geodesics."""
    if not projection.ellipsoid.is_sphere:
        length, azimuth, _ = geodesic_inverse(projection.ellipsoid, *ends)
        lon, lat, azimuth, length = (values[:, None] for values in (*ends[:2], azimuth, length))
        return geodesic_direct(projection.ellipsoid, lon, lat, azimuth, length * shares)[:2]
    start, end = earth.unit_vectors(*ends[:2]), earth.unit_vectors(*ends[2:])
    angle = earth.chord_angle(start, end)[:, None]
    # The sum of sines is a multiple of the point; its length does not matter.
    X, Y, Z = start[:, :, None] * np.sin((1.0 - shares) * angle) + end[:, :, None] * np.sin(shares * angle)
    return np.degrees(np.arctan2(Y, X)), np.degrees(np.arctan2(Z, np.hypot(X, Y)))


# ---- means over draws of points ------------------------------------------------------------------

_DRAWS = 16  # the error itself is good to a fifth
_GROUPS = 4  # as many pairs from twice the points: up to half the error, and matrices that fit a processor's cache


class Found(NamedTuple):
    """Figures (m,) of one draw, the number of its pairs, and the share of the points that is on the map."""

    values: FloatArray
    pairs: int
    coverage: float


def _answers(
    projection: ProjectionLike,
    region: RegionLike | None,
    measures: Sequence[str],
    figures: Callable[[Projection, ScatteredPoints, ScatteredPoints, np.random.Generator | None], Found],
    sizes: Mapping[bool, tuple[int, ...]],
    tolerance: float,
    seed: int,
    *,
    exact: int = 0,
) -> list[FiniteDistortion]:
    """Means of figures over draws of sets of larger `sizes` until the error of the first is small enough."""
    # All pairs of at most `exact` given points are taken once, without an error.
    given = projection if isinstance(projection, str) else None
    projection = Projection.from_user_input(projection)
    place = region_for(region, [projection])
    if isinstance(place, PointSet) and place.lon.size <= exact:
        points = ScatteredPoints(place.lon, place.lat, place.weight)
        found, errors = figures(projection, points, points, None), np.zeros(len(measures))
    else:
        if not support.check_number("tolerance", tolerance) > 0.0:
            raise ValueError(f"Invalid tolerance '{tolerance:g}'. It must be positive.")
        rng = np.random.default_rng(support.check_whole_number("seed", seed))
        draw = scatter_over(place, projection.ellipsoid)
        for size in sizes[projection.ellipsoid.is_sphere]:
            draws = [figures(projection, draw(size, rng), draw(size, rng), rng) for _ in range(_DRAWS)]
            values, pairs, coverages = (np.array(column) for column in zip(*draws, strict=True))
            found = Found(values.mean(axis=0), int(pairs.sum()), float(coverages.mean()))
            errors = values.std(axis=0, ddof=1) / np.sqrt(_DRAWS)
            if not errors[0] > tolerance * abs(found.values[0]):
                break
    shared: dict[str, Any] = {"given": given or projection.label, "projection": projection, "region": place}
    shared |= {"pairs": found.pairs, "coverage": found.coverage}
    figures_of = zip(measures, found.values.tolist(), errors.tolist(), strict=True)
    return [FiniteDistortion(measure=name, value=value, error=error, **shared) for name, value, error in figures_of]


def _groups(
    one: ScatteredPoints, other: ScatteredPoints, rng: np.random.Generator | None
) -> Iterator[tuple[IntArray, IntArray]]:
    """Indices of points to be paired each with each: fourths of the sets, or without a generator all points."""
    # Which fourths is random: points come in the order of places, and all pairs of places must be equally likely.
    count, turn = (1, 0) if rng is None else (_GROUPS, int(rng.integers(_GROUPS)))
    for group in range(count):
        yield np.arange(group, one.lon.size, count), np.arange((group + turn) % count, other.lon.size, count)


# ---- points scattered over regions ---------------------------------------------------------------

_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)  # the step, modulo 1, of the sequence that fills an interval most evenly
_CELLS = 200  # of polygons; between a half and nine tenths of them is polygon

Draw = Callable[[int, np.random.Generator], ScatteredPoints]
"""Function that scatters about the given number of points."""


def scatter_over(region: Place, ellipsoid: earth.Ellipsoid) -> Draw:
    """A function that scatters points over a region by area on an ellipsoid, those of a set by their weights."""
    if isinstance(region, PointSet):
        return functools.partial(_among_points, region)
    return functools.partial(_in_cap, region, ellipsoid) if isinstance(region, Cap) else _in_boxes(region, ellipsoid)


def _among_points(points: PointSet, count: int, rng: np.random.Generator) -> ScatteredPoints:
    along, _ = _even(count, rng)
    cumulative = np.cumsum(points.weight) / points.weight.sum()
    # The last sum may be rounded to less than one.
    k = np.minimum(np.searchsorted(cumulative, along, side="right"), points.lon.size - 1)
    return ScatteredPoints(points.lon[k], points.lat[k], np.ones(count))


def _in_cap(cap: Cap, ellipsoid: earth.Ellipsoid, count: int, rng: np.random.Generator) -> ScatteredPoints:
    """Points that are even by area in each direction, on the sphere that has the cap's latitudes."""
    along, across = _even(count, rng)
    azimuth = 360.0 * across
    # The area within c is as sin^2(c / 2).
    widest, reach = (np.sin(np.radians(0.5 * one)) for one in (cap.angle, cap.reach(azimuth)))
    distance = 2.0 * np.degrees(np.arcsin(np.sqrt(along) * reach))
    points = _weighted(*earth.destination(cap.lon, cap.lat, azimuth, distance), ellipsoid)
    return points._replace(weight=points.weight * np.square(reach / widest))


def _in_boxes(region: Region, ellipsoid: earth.Ellipsoid) -> Draw:
    """Points in the boxes that cover a region, for polygons its cells."""
    if isinstance(region, Box):
        boxes = np.array([region.bounds])
    else:
        cells = cells_of(region, ellipsoid, _CELLS)
        u0, u1, v0, v1 = cells.rectangle.T
        # Panels of polygons have longitude for u; v runs north or south.
        ends = region.chart(cells.patch, u0, v0), region.chart(cells.patch, u1, v1)
        lats = np.sort([np.asarray(end.lat) for end in ends], axis=0)
        boxes = np.stack([u0, lats[0], u1, lats[1]], axis=-1)
    wests, souths, easts, norths = boxes.T
    # A difference of sines without cancellation.
    middle, half = np.radians(0.5 * (norths + souths)), np.radians(0.5 * (norths - souths))
    areas = np.radians(easts - wests) * 2.0 * np.cos(middle) * np.sin(half)
    cumulative = np.cumsum(areas) / areas.sum()
    before = np.append(0.0, cumulative)
    is_box = isinstance(region, Box)
    fill = 1.0 if is_box else min(1.0, region.area_km2 * 1e6 / (areas.sum() * region.figure.a**2))

    def draw(count: int, rng: np.random.Generator) -> ScatteredPoints:
        """Points by area: `along` runs through the boxes, and from south to north in each."""
        along, across = _even(int(np.ceil(count / fill)), rng)
        k = np.minimum(np.searchsorted(cumulative, along, side="right"), len(boxes) - 1)
        share = np.clip((along - before[k]) / (cumulative[k] - before[k]), 0.0, 1.0)
        west, south, east, north = boxes[k].T
        low, high = np.sin(np.radians(south)), np.sin(np.radians(north))
        lat = np.degrees(np.arcsin(np.clip(low + share * (high - low), -1.0, 1.0)))
        points = _weighted(west + across * (east - west), np.clip(lat, south, north), ellipsoid)
        # Points beside polygons are dropped, not moved: coasts have their share of points.
        return points if is_box else points.take(region.contains(points.lon, points.lat))

    return draw


def _even(count: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Coordinates of a number of points that fill the unit square evenly."""
    index = np.arange(count)
    return (index + rng.random(count)) / count, np.mod(index * _GOLDEN + rng.random(), 1.0)


def _weighted(lon: FloatArray, lat: FloatArray, ellipsoid: earth.Ellipsoid) -> ScatteredPoints:
    """Points that are even on a sphere, with weights for means by area on the ellipsoid."""
    meridian, vertical = ellipsoid.radii(lat)
    return ScatteredPoints(lon, lat, meridian * vertical / ellipsoid.a**2)
