"""Distances between all pairs of points of a region, and the bending of great circles."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from projdist._typing import FloatArray
from projdist.answers.finite_distortions import (
    DEFAULT_TOLERANCE,
    DISTANCE_MEASURES,
    GOLDEN,
    DistanceMeasure,
    FiniteDistortion,
    Found,
    Question,
    ScatteredPoints,
    groups,
    weighted_sum,
)
from projdist.earth import chord_angle, unit_vectors
from projdist.projections import Projection, ProjectionLike, geodesic_lengths, geodesic_points
from projdist.regions import PointSet, RegionLike
from projdist.support import check_choice, quoted

MapDistance = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]

# Points in a set, by whether it is a sphere, where distances cost a twentieth.
_SIZES = {True: (1024, 2048), False: (512, 1024)}
_EXACT = 1000  # points whose pairs are all taken


def distance_distortion(
    projection: ProjectionLike,
    region: RegionLike | None = None,
    *,
    measure: str | DistanceMeasure = "gott",
    map_distance: MapDistance | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    seed: int = 0,
) -> FiniteDistortion:
    """How much a map distorts the distances between all pairs of points of a region.

    Four million pairs are taken, a million on an ellipsoid, and four times as many where the standard error is above
    `tolerance` times the value. Of a set of up to a thousand points, all pairs are taken, and the error is 0.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    region : RegionLike, optional
        Anything that `get_region` takes, also a `PointSet`. Without one it is the area of use of a CRS, and the globe
        for other projections.
    measure : str or callable, default "gott"
        A name of `DISTANCE_MEASURES`, or a function of the ratios d_map / d_globe (n,) and their weights (n,), whose
        sum is 1, that gives a number.
    map_distance : callable, optional
        Gives the distances in metres on the map of points x0, y0 and x1, y1 in metres, which broadcast, where these are
        not straight lines: `worldmaps.distance_around_edge` of maps with two sides.
    tolerance : float, default 5e-3
        A standard error, relative to the value, that is small enough.
    seed : int, default 0
        Chooses the points.

    Returns
    -------
    FiniteDistortion
        The `value`, its standard `error`, and the number of `pairs`.

    Raises
    ------
    ProjectionError
        For what is no projection.
    ValueError
        For an unknown region or measure, a `map_distance` that is no function, a tolerance that is not positive, and a
        seed that is no whole number.

    References
    ----------
    - Gott, Mugnolo & Colley 2007, Map projections minimizing distance errors, Cartographica 42:219 (arXiv
      astro-ph/0608500): "gott", which they give as 0.343 for Lambert's azimuthal map ("laea").
    - Peters 1984, Distance-related Maps, The American Cartographer 11:119: "peters".
    - Canters 2002, Small-scale Map Projection Design: "canters".

    Examples
    --------
    Of three pairs on the equator one is 20 degrees apart, and 340 on the map across its cut; the other two are true.
    Then the standard deviation of ln(ratio) is ln(17) sqrt(2) / 3.

    >>> import numpy as np
    >>> points = PointSet(np.array([-170.0, 0.0, 170.0]), np.zeros(3), np.ones(3))
    >>> round(distance_distortion("plate-carree", points).value, 8)
    1.33558958
    """
    (found,) = distance_distortions(
        projection, region, [measure], map_distance=map_distance, tolerance=tolerance, seed=seed
    )
    return found


def distance_distortions(
    projection: ProjectionLike,
    region: RegionLike | None = None,
    measures: Sequence[str | DistanceMeasure] = tuple(DISTANCE_MEASURES),
    *,
    map_distance: MapDistance | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    seed: int = 0,
) -> list[FiniteDistortion]:
    """The same for several measures, of the same pairs; the first tells whether there must be more of these."""
    names, functions = zip(*map(_named, measures), strict=True)
    if map_distance is not None and not callable(map_distance):
        raise ValueError(f"Invalid map_distance {quoted(map_distance)}. It must be a function.")
    distance = map_distance or _straight
    ask = Question.of(projection, region)
    if isinstance(ask.region, PointSet) and ask.region.lon.size <= _EXACT:
        points = ScatteredPoints(ask.region.lon, ask.region.lat, ask.region.weight)
        found = _over_pairs(ask.projection, functions, distance, points, points)
        return ask.answers(names, found, np.zeros(len(names)))
    return ask.estimates(
        names,
        lambda one, other, rng: _over_pairs(ask.projection, functions, distance, one, other, rng),
        _SIZES[ask.projection.ellipsoid.is_sphere],
        tolerance,
        seed,
    )


def _named(measure: str | DistanceMeasure) -> tuple[str, DistanceMeasure]:
    if callable(measure):
        return getattr(measure, "__name__", type(measure).__name__), measure
    check_choice("measure", measure, DISTANCE_MEASURES, also=", or a function of ratios and weights")
    return measure, DISTANCE_MEASURES[measure]


def _over_pairs(
    projection: Projection,
    functions: Sequence[DistanceMeasure],
    distance: MapDistance,
    one: ScatteredPoints,
    other: ScatteredPoints,
    rng: np.random.Generator | None = None,
) -> Found:
    """The measures over pairs of a point of one set and a point of another."""
    on, (x, y) = _on_map(projection, one)
    to, (to_x, to_y) = _on_map(projection, other)
    coverage = (on.weight.sum() + to.weight.sum()) / (one.weight.sum() + other.weight.sum())
    ratios, weights = [], []
    for rows, columns in groups(on, to, rng):
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
    with np.errstate(divide="ignore", invalid="ignore"):  # where a map lays two points on one
        values = np.array([function(ratio, weight) for function in functions])
    return Found(np.where(np.isfinite(values), values, np.nan), ratio.size, float(coverage))


def _straight(x0: FloatArray, y0: FloatArray, x1: FloatArray, y1: FloatArray) -> FloatArray:
    dx, dy = x0 - x1, y0 - y1
    return np.sqrt(dx * dx + dy * dy)


def _on_map(projection: Projection, points: ScatteredPoints) -> tuple[ScatteredPoints, tuple[FloatArray, FloatArray]]:
    """The points that are on a map, and their coordinates."""
    x, y = projection(points.lon, points.lat)
    shown = np.isfinite(x)
    return points.take(shown), (x[shown], y[shown])


def _globe_distances(projection: Projection, one: ScatteredPoints, other: ScatteredPoints) -> FloatArray:
    """True distances in metres from points (n,) to points (m,), shape (n, m)."""
    ellipsoid = projection.ellipsoid
    if ellipsoid.is_sphere:
        vectors = unit_vectors(one.lon, one.lat)[:, :, None]
        return ellipsoid.a * chord_angle(vectors, unit_vectors(other.lon, other.lat)[:, None])
    ends = np.broadcast_arrays(one.lon[:, None], one.lat[:, None], other.lon, other.lat)
    return geodesic_lengths(ellipsoid, *ends)


# ---- great circles -------------------------------------------------------------------------------


_GREAT_CIRCLE_SIZES = (128, 256)  # points in a set
_STATIONS = 8  # on a great circle


def great_circle_bending(
    projection: ProjectionLike, region: RegionLike | None = None, *, tolerance: float = DEFAULT_TOLERANCE, seed: int = 0
) -> FiniteDistortion:
    """How far a map bends the geodesics between all pairs of points of a region.

    The mean, along each geodesic and over all of them, of how far its image is from the straight line between its ends
    on the map, in shares of that line's length: 0 on a gnomonic map. A short arc of length L has f L / 12, where f is
    the flexion of Goldberg & Gott 2007, which is its local form; a great circle that a map tears counts as it lies.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    region : RegionLike, optional
        Anything that `get_region` takes, also a `PointSet`. Without one it is the area of use of a CRS, and the globe
        for other projections.
    tolerance : float, default 5e-3
        A standard error, relative to the value, that is small enough; where it is larger, four times as many geodesics
        are taken.
    seed : int, default 0
        Chooses the geodesics.

    Returns
    -------
    FiniteDistortion
        The `value`, its standard `error` as in `distance_distortion`, and the number of geodesics, `pairs`.

    Raises
    ------
    ProjectionError
        For what is no projection.
    ValueError
        For an unknown region, a tolerance that is not positive, and a seed that is no whole number.

    References
    ----------
    Goldberg & Gott 2007, Flexion and Skewness in Map Projections of the Earth, Cartographica 42:297, section 3:
    flexion.

    Examples
    --------
    From 170 to 190 east the equator runs beside the straight line of 340 degrees: up to 10 degrees from its ends, 5 in
    the mean, of 340.

    >>> import numpy as np
    >>> from projdist import PointSet
    >>> points = PointSet(np.array([170.0, -170.0]), np.zeros(2), np.ones(2))
    >>> round(great_circle_bending("plate-carree", points).value, 4)
    0.0147
    """
    ask = Question.of(projection, region)
    (found,) = ask.estimates(
        ["bending"],
        lambda one, other, rng: _over_geodesics(ask.projection, one, other, rng),
        _GREAT_CIRCLE_SIZES,
        tolerance,
        seed,
    )
    return found


def _over_geodesics(
    projection: Projection, one: ScatteredPoints, other: ScatteredPoints, rng: np.random.Generator
) -> Found:
    blocks = [np.ix_(rows, columns) for rows, columns in groups(one, other, rng)]
    i, j = (np.concatenate([np.broadcast_arrays(*block)[k].ravel() for block in blocks]) for k in (0, 1))
    weight = one.weight[i] * other.weight[j]
    # Stations a step apart, with an offset of its own for each geodesic: their mean has no bias.
    offset = np.mod(GOLDEN * np.arange(i.size) + rng.random(), 1.0)
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
        return geodesic_points(projection.ellipsoid, ends, shares)
    start, end = unit_vectors(*ends[:2]), unit_vectors(*ends[2:])
    angle = chord_angle(start, end)[:, None]
    # The sum of sines is a multiple of the point; its length does not matter.
    X, Y, Z = start[:, :, None] * np.sin((1.0 - shares) * angle) + end[:, :, None] * np.sin(shares * angle)
    return np.degrees(np.arctan2(Y, X)), np.degrees(np.arctan2(Z, np.hypot(X, Y)))
