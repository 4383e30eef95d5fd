"""Finite distortion: distances between all pairs of points of a region, and the bending of great circles.

Distances on the globe are geodesics. Distances on the map are straight lines in its plane as it lies,
also across its cuts and outside its outline, as the authors of these measures count them: two points
on either side of the antimeridian are far from each other on most maps. A map is never cut and pasted.

All means are by true area over pairs of points that are independent of each other. Two sets of points are
strewn (`scatter`), and a quarter of one is paired with a quarter of the other, each with each; that sixteen
times. The spread of the sixteen makes the error, a standard error, so that it is honest for maps with
cuts and with poles at infinity, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.answers.pairs import GOLDEN, Points, Scatter
from projdist.earth import chord_angle, unit_vectors
from projdist.projections import Projection, ProjectionLike, geodesic_lengths, geodesic_points
from projdist.regions import Place, PointSet, RegionLike, region_for
from projdist.support import Answer, check_choice, check_number, check_whole_number, plain, quoted

__all__ = [
    "DISTANCE_MEASURES",
    "FiniteDistortion",
    "best_scale_of_distances",
    "distance_distortion",
    "distance_distortions",
    "great_circle_bending",
]

DistanceMeasure = Callable[[FloatArray, FloatArray], float]
MapDistance = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]

DEFAULT_TOLERANCE = 5e-3  # of the value, for polygons; on whole globes the first sets give 1e-4 of a distance measure
_DRAWS = 16  # the error itself is good to a fifth
_GROUPS = 4  # for as many pairs, twice the points: up to half the error, and matrices that fit a processor's cache
# Points in a set, by whether it is a sphere, where distances cost a twentieth.
_SIZES = {True: (1024, 2048), False: (512, 1024)}
_BENDING_SIZES = (128, 256)
_EXACT = 1000  # points whose pairs are all taken
_STATIONS = 8  # on a great circle


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class FiniteDistortion(Answer):
    """A measure of finite distortion: its value, its standard error, and what it was taken over.

    `pairs` of points were measured. `coverage` is the share of the region's area that is on the map,
    of `great_circle_bending` that of geodesics; pairs beyond do not count. What is undefined is NaN.
    """

    projection: Projection
    given: str
    region: Place
    measure: str
    value: float
    error: float
    pairs: int
    coverage: float

    def _line(self) -> str:
        return f"{self.projection.name} over {self.region.name}: {self.measure} {self.value:.4g} ± {self.error:.1g}"

    def to_dict(self) -> dict[str, Any]:
        """The fields by name; what is undefined is None."""
        return self._row() | {
            "region": {"name": self.region.name, "area_km2": self.region.area_km2},
            "value": plain(self.value),
            "error": plain(self.error),
        }

    def _row(self) -> dict[str, Any]:
        return {
            "projection": self.given,
            "name": self.projection.name,
            "definition": self.projection.definition,
            "region": self.region.name,
            "measure": self.measure,
            "value": self.value,
            "error": self.error,
            "pairs": self.pairs,
            "coverage": self.coverage,
        }

    def _table(self) -> list[dict[str, Any]]:
        return [self._row()]


# ---- distances ------------------------------------------------------------------------------


def gott(ratio: FloatArray, weight: FloatArray) -> float:
    """Standard deviation of ln(d_map / d_globe): the sigma, or D, of Gott, Mugnolo & Colley 2007.

    "Map projections minimizing distance errors", Cartographica 42 (arXiv astro-ph/0608500). It does
    not change with the map's scale.
    """
    logarithm = np.log(ratio)
    logarithm -= _mean(logarithm, weight)
    return float(np.sqrt(_mean(np.square(logarithm), weight)))


def peters(ratio: FloatArray, weight: FloatArray) -> float:
    """Mean of |d_map - d_globe| / (d_map + d_globe), the distance index of Peters 1984, from 0 to 1.

    It is of the map as it stands, and changes with its scale.
    """
    return _mean(np.abs(ratio - 1.0) / (ratio + 1.0), weight)


def canters(ratio: FloatArray, weight: FloatArray) -> float:
    """Mean finite scale factor K1 = (1 + D) / (1 - D) of Canters 2002, with D the index of Peters.

    A map whose distances are all K times the true ones, or all 1 / K times, has K. Canters' own figures are
    of distances that he chose otherwise: on land but for Antarctica his pseudocylindrical map with six
    coefficients has 1.143, and over all pairs of points there 1.18.
    """
    index = peters(ratio, weight)
    return (1.0 + index) / (1.0 - index) if index < 1.0 else np.inf


_THINNED = 61  # of the pairs, for a search; a prime, as pairs come in rows
_REACH, _HALVINGS = 4.0, 32  # of ln scale to either side of the geometric mean


def best_scale_of_distances(ratio: FloatArray, weight: FloatArray) -> float:
    """The logarithm of the scale that makes the indices of Peters and of Canters least.

    Of every 61st pair: where the indices are least, what is lost by that is of second order.
    """
    logarithm, weight = np.log(ratio[::_THINNED]), weight[::_THINNED]
    # The index is the mean of |tanh(ln(r) / 2)|; its slope is negative below the best scale, and positive above it.
    middle = -_mean(logarithm, weight) / float(weight.sum())
    low, high = middle - _REACH, middle + _REACH
    for _ in range(_HALVINGS):
        scale = 0.5 * (low + high)
        half = 0.5 * (logarithm + scale)
        rises = _mean(np.sign(half) / np.cosh(half) ** 2, weight) > 0.0
        low, high = (low, scale) if rises else (scale, high)
    return 0.5 * (low + high)


def _mean(values: FloatArray, weight: FloatArray) -> float:
    # Not a product of vectors, for which BLAS wakes threads that a quarter of a million numbers do not pay for.
    return float(np.sum(weight * values))


DISTANCE_MEASURES: dict[str, DistanceMeasure] = {"gott": gott, "peters": peters, "canters": canters}


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
    ask = _Question.of(projection, region)
    if isinstance(ask.region, PointSet) and ask.region.lon.size <= _EXACT:
        points = Points(ask.region.lon, ask.region.lat, ask.region.weight)
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


class _Found(NamedTuple):
    """Figures (m,) of one draw, the number of its pairs, and the share of what was drawn that is on the map."""

    values: FloatArray
    pairs: int
    coverage: float


def _over_pairs(
    projection: Projection,
    functions: Sequence[DistanceMeasure],
    distance: MapDistance,
    one: Points,
    other: Points,
    rng: np.random.Generator | None = None,
) -> _Found:
    """The measures over pairs of a point of one set and a point of another."""
    on, (x, y) = _on_map(projection, one)
    to, (to_x, to_y) = _on_map(projection, other)
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
        return _Found(np.full(len(functions), np.nan), 0, float(coverage))
    weight = weight / weight.sum()
    with np.errstate(divide="ignore", invalid="ignore"):  # where a map lays two points on one
        values = np.array([function(ratio, weight) for function in functions])
    return _Found(np.where(np.isfinite(values), values, np.nan), ratio.size, float(coverage))


def _straight(x0: FloatArray, y0: FloatArray, x1: FloatArray, y1: FloatArray) -> FloatArray:
    dx, dy = x0 - x1, y0 - y1
    return np.sqrt(dx * dx + dy * dy)


def _groups(one: Points, other: Points, rng: np.random.Generator | None) -> Iterator[tuple[IntArray, IntArray]]:
    """The numbers of the points that are paired each with each: every fourth of one set, every fourth of the other.

    Which fourths are paired is random: points come in the order of places, and all pairs of places must be as
    likely. Without a generator all points are paired.
    """
    count, turn = (1, 0) if rng is None else (_GROUPS, int(rng.integers(_GROUPS)))
    for group in range(count):
        yield np.arange(group, one.lon.size, count), np.arange((group + turn) % count, other.lon.size, count)


def _on_map(projection: Projection, points: Points) -> tuple[Points, tuple[FloatArray, FloatArray]]:
    """The points that are on a map, and their coordinates."""
    x, y = projection(points.lon, points.lat)
    shown = np.isfinite(x)
    return points.take(shown), (x[shown], y[shown])


def _globe_distances(projection: Projection, one: Points, other: Points) -> FloatArray:
    """True distances in metres from points (n,) to points (m,), shape (n, m)."""
    ellipsoid = projection.ellipsoid
    if ellipsoid.is_sphere:
        vectors = unit_vectors(one.lon, one.lat)[:, :, None]
        return ellipsoid.a * chord_angle(vectors, unit_vectors(other.lon, other.lat)[:, None])
    ends = np.broadcast_arrays(one.lon[:, None], one.lat[:, None], other.lon, other.lat)
    return geodesic_lengths(ellipsoid, *ends)


# ---- great circles --------------------------------------------------------------------------


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
    >>> points = PointSet(np.array([170.0, -170.0]), np.zeros(2), np.ones(2))
    >>> round(great_circle_bending("plate-carree", points).value, 4)
    0.0147
    """
    ask = _Question.of(projection, region)
    (found,) = ask.estimates(
        ["bending"],
        lambda one, other, rng: _over_geodesics(ask.projection, one, other, rng),
        _BENDING_SIZES,
        tolerance,
        seed,
    )
    return found


def _over_geodesics(projection: Projection, one: Points, other: Points, rng: np.random.Generator) -> _Found:
    blocks = [np.ix_(rows, columns) for rows, columns in _groups(one, other, rng)]
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
        return _Found(np.array([np.nan]), 0, 0.0)
    kept = weight[counts] / weight[counts].sum()
    value = np.array([_mean(figures[counts], kept)])
    return _Found(value, int(counts.sum()), float(weight[counts].sum() / weight.sum()))


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


# ---- draws ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Question:
    """A map and a region, as they were given and as they are."""

    projection: Projection
    given: str
    region: Place

    @staticmethod
    def of(projection: ProjectionLike, region: RegionLike | None) -> _Question:
        """Raises ProjectionError, and ValueError for an unknown region."""
        given = projection if isinstance(projection, str) else None
        projection = Projection.from_user_input(projection)
        return _Question(projection, given or projection.label, region_for(region, [projection]))

    def answers(self, measures: Sequence[str], found: _Found, errors: FloatArray) -> list[FiniteDistortion]:
        """The answers to it."""
        return [
            FiniteDistortion(
                projection=self.projection,
                given=self.given,
                region=self.region,
                measure=measure,
                value=value,
                error=error,
                pairs=found.pairs,
                coverage=found.coverage,
            )
            for measure, value, error in zip(measures, found.values.tolist(), errors.tolist(), strict=True)
        ]

    def estimates(
        self,
        measures: Sequence[str],
        figures: Callable[[Points, Points, np.random.Generator], _Found],
        sizes: tuple[int, ...],
        tolerance: float,
        seed: int,
    ) -> list[FiniteDistortion]:
        """The means of figures of two sets of points over draws, and their standard errors."""
        if not check_number("tolerance", tolerance) > 0.0:
            raise ValueError(f"Invalid tolerance '{tolerance:g}'. It must be positive.")
        rng = np.random.default_rng(check_whole_number("seed", seed))
        scatter = Scatter(self.region, self.projection.ellipsoid)
        for size in sizes:
            found = [figures(scatter.draw(size, rng), scatter.draw(size, rng), rng) for _ in range(_DRAWS)]
            values, pairs, coverages = (np.array(column) for column in zip(*found, strict=True))
            means, errors = values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(_DRAWS)
            if not errors[0] > tolerance * abs(means[0]):
                break
        return self.answers(measures, _Found(means, int(pairs.sum()), float(coverages.mean())), errors)
