"""Finite distortion of a map over a region: pairs of points, and means over them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import Ellipsoid, destination
from projdist.projections import Projection, ProjectionLike
from projdist.regions import Box, Cap, Place, PointSet, Region, RegionLike, cells_of, region_for
from projdist.support import Answer, check_number, check_whole_number, plain

GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
"""The step of the sequence, modulo 1, that fills an interval most evenly."""
_CELLS = 200  # of polygons; between a half and nine tenths of them is polygon


class ScatteredPoints(NamedTuple):
    """Points in degrees, and weights to make means those by true area; all of shape (n,)."""

    lon: FloatArray
    lat: FloatArray
    weight: FloatArray

    def take(self, kept: BoolArray | IntArray) -> ScatteredPoints:
        """The points of a mask, or of numbers."""
        return ScatteredPoints(self.lon[kept], self.lat[kept], self.weight[kept])


class Scatter(Protocol):
    """What strews points over a region."""

    def draw(self, count: int, rng: np.random.Generator) -> ScatteredPoints:
        """About `count` points."""


def scatter_over(region: Place, ellipsoid: Ellipsoid) -> Scatter:
    """What strews points over a region by area on an ellipsoid, and those of a set of points by their weights."""
    if isinstance(region, PointSet):
        return _OfPoints(region)
    return _OfCap(region, ellipsoid) if isinstance(region, Cap) else _OfBoxes(region, ellipsoid)


class _OfPoints:
    """Points of a set, by their weights."""

    def __init__(self, points: PointSet) -> None:
        self._points = points
        self._cumulative = np.cumsum(points.weight) / points.weight.sum()

    def draw(self, count: int, rng: np.random.Generator) -> ScatteredPoints:
        along, _ = _even(count, rng)
        # The last sum may be rounded to less than one.
        k = np.minimum(np.searchsorted(self._cumulative, along, side="right"), self._points.lon.size - 1)
        return ScatteredPoints(self._points.lon[k], self._points.lat[k], np.ones(count))


@dataclass(frozen=True)
class _OfCap:
    """Points of a cap, in each direction evenly by area on the sphere that has its latitudes."""

    cap: Cap
    ellipsoid: Ellipsoid

    def draw(self, count: int, rng: np.random.Generator) -> ScatteredPoints:
        along, across = _even(count, rng)
        azimuth = 360.0 * across
        # The area within c is as sin^2(c / 2).
        widest, reach = (np.sin(np.radians(0.5 * one)) for one in (self.cap.angle, self.cap.reach(azimuth)))
        distance = 2.0 * np.degrees(np.arcsin(np.sqrt(along) * reach))
        points = _weighted(*destination(self.cap.lon, self.cap.lat, azimuth, distance), self.ellipsoid)
        return points._replace(weight=points.weight * np.square(reach / widest))


class _OfBoxes:
    """Points of the boxes that cover a region.

    Polygons are covered by cells, and what falls beside them is dropped: no point is moved, so that coasts
    have their share, at the cost of some more points and of a count that is about what was asked for.
    """

    def __init__(self, region: Region, ellipsoid: Ellipsoid) -> None:
        self._region, self._ellipsoid = region, ellipsoid
        self._boxes = _boxes(region, ellipsoid)
        west, south, east, north = self._boxes.T
        # A difference of sines without cancellation.
        middle, half = np.radians(0.5 * (north + south)), np.radians(0.5 * (north - south))
        areas = np.radians(east - west) * 2.0 * np.cos(middle) * np.sin(half)
        self._cumulative = np.cumsum(areas) / areas.sum()
        self._is_box = isinstance(region, Box)
        self._fill = 1.0 if self._is_box else min(1.0, region.area_km2 * 1e6 / (areas.sum() * region.figure.a**2))

    def draw(self, count: int, rng: np.random.Generator) -> ScatteredPoints:
        lon, lat = self._places(*_even(int(np.ceil(count / self._fill)), rng))
        points = _weighted(lon, lat, self._ellipsoid)
        return points if self._is_box else points.take(self._region.contains(lon, lat))

    def _places(self, along: FloatArray, across: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points by area: `along` runs through the boxes, and from south to north in each."""
        k = np.minimum(np.searchsorted(self._cumulative, along, side="right"), len(self._boxes) - 1)
        before = np.append(0.0, self._cumulative)
        share = np.clip((along - before[k]) / (self._cumulative[k] - before[k]), 0.0, 1.0)
        west, south, east, north = self._boxes[k].T
        low, high = np.sin(np.radians(south)), np.sin(np.radians(north))
        lat = np.degrees(np.arcsin(np.clip(low + share * (high - low), -1.0, 1.0)))
        return west + across * (east - west), np.clip(lat, south, north)


def _even(count: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """So many points that fill the unit square evenly."""
    index = np.arange(count)
    return (index + rng.random(count)) / count, np.mod(index * GOLDEN + rng.random(), 1.0)


def _weighted(lon: FloatArray, lat: FloatArray, ellipsoid: Ellipsoid) -> ScatteredPoints:
    """Points that are even on a sphere, with the weights that make means those on the ellipsoid."""
    meridian, vertical = ellipsoid.radii(lat)
    return ScatteredPoints(lon, lat, meridian * vertical / ellipsoid.a**2)


def _boxes(region: Region, ellipsoid: Ellipsoid) -> FloatArray:
    """West, south, east, north (n, 4) of what covers a region."""
    if isinstance(region, Box):
        return np.array([region.bounds])
    cells = cells_of(region, ellipsoid, _CELLS)
    u0, u1, v0, v1 = cells.rectangle.T
    # Panels of polygons have longitude for u; v runs north or south.
    ends = region.chart(cells.patch, u0, v0), region.chart(cells.patch, u1, v1)
    lats = np.sort([np.asarray(end.lat) for end in ends], axis=0)
    return np.stack([u0, lats[0], u1, lats[1]], axis=-1)


# ---- distance measures ---------------------------------------------------------------------------


DistanceMeasure = Callable[[FloatArray, FloatArray], float]


def gott(ratio: FloatArray, weight: FloatArray) -> float:
    """Standard deviation of ln(d_map / d_globe): the sigma, or D, of Gott, Mugnolo & Colley 2007.

    "Map projections minimizing distance errors", Cartographica 42 (arXiv astro-ph/0608500). It does
    not change with the map's scale.
    """
    logarithm = np.log(ratio)
    logarithm -= weighted_sum(logarithm, weight)
    return float(np.sqrt(weighted_sum(np.square(logarithm), weight)))


def peters(ratio: FloatArray, weight: FloatArray) -> float:
    """Mean of |d_map - d_globe| / (d_map + d_globe), the distance index of Peters 1984, from 0 to 1.

    It is of the map as it stands, and changes with its scale.
    """
    return weighted_sum(np.abs(ratio - 1.0) / (ratio + 1.0), weight)


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
    middle = -weighted_sum(logarithm, weight) / float(weight.sum())
    low, high = middle - _REACH, middle + _REACH
    for _ in range(_HALVINGS):
        scale = 0.5 * (low + high)
        half = 0.5 * (logarithm + scale)
        rises = weighted_sum(np.sign(half) / np.cosh(half) ** 2, weight) > 0.0
        low, high = (low, scale) if rises else (scale, high)
    return 0.5 * (low + high)


def weighted_sum(values: FloatArray, weight: FloatArray) -> float:
    """The sum of values (n,) times weights (n,)."""
    # Not a product of vectors, for which BLAS wakes threads that a quarter of a million numbers do not pay for.
    return float(np.sum(weight * values))


DISTANCE_MEASURES: dict[str, DistanceMeasure] = {"gott": gott, "peters": peters, "canters": canters}


# ---- means over pairs ----------------------------------------------------------------------------


DEFAULT_TOLERANCE = 5e-3  # of the value, for polygons; on whole globes the first sets give 1e-4 of a distance measure
_DRAWS = 16  # the error itself is good to a fifth
_GROUPS = 4  # for as many pairs, twice the points: up to half the error, and matrices that fit a processor's cache


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


class Found(NamedTuple):
    """Figures (m,) of one draw, the number of its pairs, and the share of what was drawn that is on the map."""

    values: FloatArray
    pairs: int
    coverage: float


def groups(
    one: ScatteredPoints, other: ScatteredPoints, rng: np.random.Generator | None
) -> Iterator[tuple[IntArray, IntArray]]:
    """The numbers of the points that are paired each with each: every fourth of one set, every fourth of the other.

    Which fourths are paired is random: points come in the order of places, and all pairs of places must be as
    likely. Without a generator all points are paired.
    """
    count, turn = (1, 0) if rng is None else (_GROUPS, int(rng.integers(_GROUPS)))
    for group in range(count):
        yield np.arange(group, one.lon.size, count), np.arange((group + turn) % count, other.lon.size, count)


@dataclass(frozen=True)
class Question:
    """A map and a region, as they were given and as they are."""

    projection: Projection
    given: str
    region: Place

    @staticmethod
    def of(projection: ProjectionLike, region: RegionLike | None) -> Question:
        """Raises ProjectionError, and ValueError for an unknown region."""
        given = projection if isinstance(projection, str) else None
        projection = Projection.from_user_input(projection)
        return Question(projection, given or projection.label, region_for(region, [projection]))

    def answers(self, measures: Sequence[str], found: Found, errors: FloatArray) -> list[FiniteDistortion]:
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
        figures: Callable[[ScatteredPoints, ScatteredPoints, np.random.Generator], Found],
        sizes: tuple[int, ...],
        tolerance: float,
        seed: int,
    ) -> list[FiniteDistortion]:
        """The means of figures of two sets of points over draws, and their standard errors."""
        if not check_number("tolerance", tolerance) > 0.0:
            raise ValueError(f"Invalid tolerance '{tolerance:g}'. It must be positive.")
        rng = np.random.default_rng(check_whole_number("seed", seed))
        scatter = scatter_over(self.region, self.projection.ellipsoid)
        for size in sizes:
            found = [figures(scatter.draw(size, rng), scatter.draw(size, rng), rng) for _ in range(_DRAWS)]
            values, pairs, coverages = (np.array(column) for column in zip(*found, strict=True))
            means, errors = values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(_DRAWS)
            if not errors[0] > tolerance * abs(means[0]):
                break
        return self.answers(measures, Found(means, int(pairs.sum()), float(coverages.mean())), errors)
