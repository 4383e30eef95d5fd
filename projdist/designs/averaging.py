"""The mean of several maps, with the bound of its total and the maps beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.decisions import extent_of
from projdist.designs.objectives import check_degree, check_extent
from projdist.designs.plane_maps import Average, BoxPolynomials, Corrected, box_gradients
from projdist.designs.plane_means import Targets, check_counts, common_turn, polynomial_mean
from projdist.designs.sites import overlaps
from projdist.earth import Ellipsoid
from projdist.field import FIGURES, Nodes, cut_length, nodes_of, sample
from projdist.projections import (
    AreaOfUse,
    DerivedCrs,
    Projection,
    ProjectionError,
    ProjectionLike,
    derived_crs,
    geodetic_ellipsoid,
    listed_projections,
    parameters_of,
)
from projdist.regions import GLOBE, Box, Place, RegionLike, region_for
from projdist.support import Answer, check_text, plain


@dataclass(frozen=True, kw_only=True)
class Nearness:
    """The distance of a map from the given ones, and its distortion.

    `kind` is "bound", "mean", "average" or "given". `total` is the sum over the given maps of weight times the mean of
    the squared Fisher distance, `airy_kavrayskiy` the Airy-Kavrayskiy error at the best scale, with its `error`. The
    bound is that of the mean metrics, which no map has: its `projection` is None.
    """

    kind: str
    name: str
    projection: Projection | None
    total: float
    airy_kavrayskiy: float
    error: float | None


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class MeanMap(Answer):
    """The mean of several maps.

    `projection` is the map, `crs` its texts for other programs, None if it has none: a map of the world is a sum of
    products of Chebyshev polynomials of longitude and latitude. `base` is the map that is corrected, None for the
    world. `average` is the plain average of coordinates. `standings` are those of the bound, the mean, the average and
    the given maps; `error` is the change of their totals with fewer nodes.
    """

    region: Place
    maps: tuple[Projection, ...]
    weights: tuple[float, ...]
    degree: int
    projection: Projection
    base: Projection | None
    crs: DerivedCrs | None
    average: Projection
    standings: tuple[Nearness, ...]
    error: float
    notes: tuple[str, ...] = ()

    @property
    def bound(self) -> float:
        """The total of the mean metrics, a lower bound for all maps."""
        return self.standing("bound").total

    @property
    def total(self) -> float:
        """The total of the mean."""
        return self.standing("mean").total

    @property
    def airy_kavrayskiy(self) -> float:
        """The Airy-Kavrayskiy error of the mean at its best scale."""
        return self.standing("mean").airy_kavrayskiy

    def standing(self, kind: str) -> Nearness:
        """The first standing of a kind."""
        return next(one for one in self.standings if one.kind == kind)

    def _line(self) -> str:
        return (
            f"mean of {len(self.maps)} maps over {self.region.name}: total {self.total:.6g}, bound {self.bound:.6g}, "
            f"Airy-Kavrayskiy {self.airy_kavrayskiy:.4g}"
        )

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON; NaN and infinity become None."""
        function = self.projection.function
        return {
            "region": {"name": self.region.name, "area_km2": self.region.area_km2},
            "maps": [one.definition for one in self.maps],
            "weights": list(self.weights),
            "degree": self.degree,
            "base": None if self.base is None else self.base.definition,
            "standings": [
                {
                    "kind": one.kind,
                    "name": one.name,
                    "total": plain(one.total),
                    "airy_kavrayskiy_scaled": plain(one.airy_kavrayskiy),
                    "airy_kavrayskiy_error": plain(one.error),
                }
                for one in self.standings
            ],
            "error_estimate": plain(self.error),
            "notes": list(self.notes),
            "chebyshev": _series(function) if isinstance(function, BoxPolynomials) else None,
            "proj": None if self.crs is None else self.crs.pipeline,
            "wkt": None if self.crs is None else self.crs.wkt,
            "wkt_derived": None if self.crs is None else self.crs.wkt_derived,
        }

    def _table(self) -> list[dict[str, Any]]:
        """A row a map, and the bound."""
        return [
            {
                "map": one.kind,
                "name": one.name,
                "total": one.total,
                "airy_kavrayskiy_scaled": one.airy_kavrayskiy,
            }
            for one in self.standings
        ]


def _series(function: BoxPolynomials) -> dict[str, Any]:
    """The coefficients of a map of the world, x and y of T_i T_j, and the box of its polynomials."""
    x, y = function.coefficients
    return {"box": list(function.box), "x": x.tolist(), "y": y.tolist()}


# ---- the mean map --------------------------------------------------------------------------------


_NODES, _FINE = 3000, 10_000
_WIDEST = 100.0  # degrees from the middle: wider regions need a map of the world
_HIGHEST = 86.0  # degrees of latitude: beyond, poles that are lines pull the mean onto a fold
_WORLD = Box(-180.0, -85.0, 180.0, 85.0)
_DEGREE, _WORLD_DEGREE, _FINEST_OF_WORLD = 8, 9, 12
_TOLERANCE = 1e-8
_ROUNDING = 1e-10  # of totals, by finite differences
_TORN = 1e-9  # of the region's area
_EDGE = 1e-3  # degrees
_LONGEST = 60  # characters of a label
_SAME = 9  # digits to which totals are compared, as two maps are equally far from their mean


def mean_map(
    projections: ProjectionLike | Iterable[ProjectionLike],
    *,
    weights: ArrayLike | None = None,
    region: RegionLike | None = None,
    degree: int | None = None,
    datum: str | None = None,
    name: str | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> MeanMap:
    """The mean of several maps: the map nearest to them, in the geometry of their distortion.

    Of all maps f of a degree it has the least sum, over the maps f_i, of weight_i times the mean of
    Dist_F(J_f J_i^-1)^2 over the region: the distortion of f relative to the plane of f_i, as the Airy-Kavrayskiy error
    is that relative to the ground. The Frechet means of the metrics J_i^T J_i at each point have a smaller sum or the
    same, which is the bound.

    Parameters
    ----------
    projections : iterable of ProjectionLike
        The maps, also functions of longitude and latitude; none may be cut, or turn over, within the region. The mean
        is turned as the first one.
    weights : array_like, optional
        Positive weights of the maps; by default 1.
    region : RegionLike, optional
        Whatever `get_region` takes; by default the area of use that all maps have in common, else the world between
        85 degrees of latitude. A region that reaches farther than 100 degrees from its middle must be a box within 86
        degrees of latitude.
    degree : int, optional
        Degree of the polynomials: for a region in the plane of the map nearest to all, by default 8; for the world in
        longitude and in latitude, by default 9, at most 12.
    datum : str, optional
        The geographic CRS that the map of a region is based on, as EPSG:4258, with the ellipsoid of the map that it
        corrects; by default WGS 84, or none for another ellipsoid.
    name : str, optional
        Name of the map.
    progress : callable, optional
        Called with the numbers of maps measured and of all, once the mean is found.

    Returns
    -------
    MeanMap
        The map, as a projection, and its sum beside the bound, the plain average of coordinates and the given maps.

    Raises
    ------
    ValueError
        For weights that are not positive, a degree that the region does not resolve, and a region of the world that is
        no box.
    ProjectionError
        For maps that are cut or mirrored within the region, and maps of another body or size.

    References
    ----------
    - D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the mean of linear maps.
    - O. Winkel 1921, Petermanns Mitteilungen 67: the plain average of two maps.

    Examples
    --------
    A conformal map's scale is the geometric mean of two conformal maps' scales, which is that of a conformal map: the
    mean of Mercator's cylinder and the stereographic map of the pole is Lambert's cone in the middle.

    >>> pole = "+proj=stere +lat_0=90 +R=6371008.7714"
    >>> found = mean_map(["mercator", pole], region="box:-10,40,10,60")
    >>> cone = mean_map(["+proj=lcc +lat_1=30 +R=6371008.7714"], region="box:-10,40,10,60")
    >>> round(found.airy_kavrayskiy / cone.airy_kavrayskiy, 5)
    1.0
    """
    listed = listed_projections(projections)
    if not listed:
        raise ValueError("Invalid projections. There must be one map or more.")
    maps = tuple(Projection.from_user_input(one) for one in listed)
    labels = [_label(*pair) for pair in zip(listed, maps, strict=True)]
    counts = check_counts(weights, len(maps))
    area = region_for(region, maps)
    area = _WORLD if region is None and area == GLOBE else area
    box = _world_box(area)
    order = _degree(degree, of_world=box is not None)
    named = f"mean of {' and '.join(labels)}" if len(labels) <= 2 else f"mean of {len(labels)} maps"
    title = named if name is None else check_text("name", name)
    _check_sizes(maps)
    ground = None if datum is None else geodetic_ellipsoid(check_text("datum", datum))
    coarse = _Ground.of(area, maps, counts, _NODES)
    for one in maps:
        _check_whole(one, area)
    average = _average(maps, counts, coarse.targets)
    try:
        found = _of_world(coarse, box, order) if box else _of_region(coarse, maps, order, title)
    except ValueError as error:
        if isinstance(error, ProjectionError):
            raise
        raise ValueError(f"Invalid degree {order} for region '{area.name}'. {error}") from error
    if ground is not None and not (found.base is not None and found.base.ellipsoid.is_close(ground)):
        base = "a map of the world" if found.base is None else f"base '{found.base.label}'"
        raise ValueError(f"Invalid datum '{datum}' for {base}. It is for maps of regions, with the base's ellipsoid.")
    found = found.turned_as(average, coarse, title, AreaOfUse(area.name, area.bounds), datum)
    fine = _Ground.of(area, maps, counts, _FINE)
    measured = [("mean", "", found.projection), ("average", "of coordinates", average)]
    measured += [("given", label, one) for label, one in zip(labels, maps, strict=True)]
    standings = []
    for number, chosen in enumerate(measured):
        if progress is not None:
            progress(number, len(measured))
        standings.append(_standing(*chosen, area, fine))
    return MeanMap(
        region=area,
        maps=maps,
        weights=tuple(counts.tolist()),
        degree=order,
        projection=found.projection,
        base=found.base,
        crs=found.crs,
        average=average,
        standings=(_bound(fine), *standings),
        error=max(abs(one.total - coarse.total(made)) for one, (_, _, made) in zip(standings, measured, strict=True)),
        notes=tuple(_notes(found, area, coarse, standings)),
    )


def _world_box(region: Place) -> Box | None:
    """The region as the box of a map of the world, None if it needs no such map; raises ValueError."""
    if extent_of(region).radius <= _WIDEST:
        check_extent(region)
        return None
    if not isinstance(region, Box) or max(abs(region.south), abs(region.north)) > _HIGHEST:
        raise ValueError(
            f"Invalid region '{region.name}'. What reaches farther than {_WIDEST:.0f} degrees from its middle must be "
            f"a box within {_HIGHEST:.0f} degrees of latitude, as {_WORLD.name}."
        )
    return region


def _degree(given: int | None, *, of_world: bool) -> int:
    if given is None:
        return _WORLD_DEGREE if of_world else _DEGREE
    degree = check_degree(given)
    if of_world and degree > _FINEST_OF_WORLD:
        raise ValueError(f"Invalid degree {degree}. It must be at most {_FINEST_OF_WORLD} for a map of the world.")
    return degree


def _label(given: Any, projection: Projection) -> str:
    """The map's text as given if short, else its label."""
    return given if isinstance(given, str) and len(given) <= _LONGEST else projection.label


def _check_sizes(maps: Iterable[Projection]) -> None:
    first, *others = maps
    for other in others:
        if not 0.99 < other.ellipsoid.a / first.ellipsoid.a < 1.01:
            raise ProjectionError(f"Invalid map '{other.label}'. It is of another size than '{first.label}'.")


def _check_whole(projection: Projection, region: Place) -> None:
    """Raise ProjectionError for a map that is cut within a region; along the edge of a box it may be."""
    west, south, east, north = region.bounds
    goes_round = isinstance(region, Box) and east - west >= 360.0
    inner = Box.between((west + _EDGE, south, east - _EDGE, north)) if goes_round else region
    if cut_length(projection, inner) > 0.0:
        raise ProjectionError(f"Invalid map '{projection.label}'. It is cut within {region.name}.")


@dataclass(frozen=True, eq=False)
class _Ground:
    """Nodes of a region with the Jacobians of the given maps."""

    nodes: Nodes
    targets: Targets

    @classmethod
    def of(cls, region: Place, maps: tuple[Projection, ...], counts: FloatArray, count: int) -> _Ground:
        """The ground with about `count` nodes; raises ProjectionError for a map that is torn or mirrored there."""
        nodes = nodes_of(region, _ellipsoid(maps), count)
        J = np.stack([nodes.jacobian(one)[0] for one in maps])
        with np.errstate(invalid="ignore"):
            smooth = np.isfinite(J).all(axis=(2, 3)) & (np.linalg.det(J) > 0.0)
        for one, good in zip(maps, smooth, strict=True):
            lost = float(nodes.weight[~good].sum())
            if lost > _TORN:
                raise ProjectionError(
                    f"Invalid map '{one.label}'. It tears, turns over or does not show {100.0 * lost:.2g} % of "
                    f"{region.name}."
                )
        # Nodes next to poles have hardly any weight and may have no Jacobian.
        J[:, ~smooth.all(axis=0)] = np.eye(2)
        return cls(nodes, Targets(J, counts, np.where(smooth.all(axis=0), nodes.weight, 0.0)))

    def jacobian(self, projection: Projection) -> FloatArray:
        """Jacobians (n, 2, 2) at the nodes, the identity where the weight is 0."""
        J = self.nodes.jacobian(projection)[0]
        return np.where((self.targets.weight > 0.0)[:, None, None], J, np.eye(2))

    def total(self, projection: Projection) -> float:
        """The total of a map."""
        return self.targets.total(self.jacobian(projection))

    def middle(self, projection: Projection) -> complex:
        """The mean of x + i y."""
        x, y = projection(self.nodes.lon, self.nodes.lat)
        w = self.targets.weight
        return complex(np.sum(w * np.where(w > 0.0, x + 1j * y, 0.0)))


def _ellipsoid(maps: Iterable[Projection]) -> Ellipsoid:
    """The flattest ellipsoid of the maps, by which areas are weighted."""
    return max((one.ellipsoid for one in maps), key=lambda ellipsoid: (ellipsoid.f, ellipsoid.a))


def _average(maps: tuple[Projection, ...], counts: FloatArray, targets: Targets) -> Projection:
    """The average of coordinates, each map turned like the first one."""
    turns = [common_turn(J @ targets.inverses[0], targets.weight).conjugate() for J in targets.J]
    function = Average(maps, counts / counts.sum(), tuple(turns))
    return Projection.from_function(function, name="average of coordinates", ellipsoid=_ellipsoid(maps))


class _Found(NamedTuple):
    """A mean as a function and a projection; for a region with the base that it corrects, and its CRS if it has one."""

    function: BoxPolynomials | Corrected
    projection: Projection
    base: Projection | None = None
    crs: DerivedCrs | None = None

    def turned_as(self, other: Projection, ground: _Ground, title: str, area: AreaOfUse, datum: str | None) -> _Found:
        """The same map with the orientation and the middle of another; its CRS is for the area."""
        turn = common_turn(
            ground.jacobian(other) @ np.linalg.inv(ground.jacobian(self.projection)), ground.targets.weight
        )
        shift = ground.middle(other) - turn * ground.middle(self.projection)
        if isinstance(self.function, BoxPolynomials):
            return _Found.of_function(self.function.moved(turn, shift), title, other)
        base = self.function.base
        function = Corrected(base, self.function.plane_map.moved(turn, shift))
        try:
            crs = derived_crs(base, function.plane_map.steps, title, area, geodetic=datum)
        except ProjectionError:  # the base is no CRS: the map is a function
            return _Found.of_function(function, title, base)._replace(base=base)
        return _Found(function, crs.projection, base, crs)

    @classmethod
    def of_function(cls, function: BoxPolynomials | Corrected, title: str, like: Projection) -> _Found:
        """A function as a projection on the ellipsoid of another."""
        return cls(function, Projection.from_function(function, name=title, ellipsoid=like.ellipsoid))


def _of_world(ground: _Ground, region: Box, degree: int) -> _Found:
    """The nearest sum of products of Chebyshev polynomials."""
    nodes, box, size = ground.nodes, region.bounds, degree + 1
    west, south, east, north = box
    gradients = box_gradients(box, degree, nodes.lon, nodes.lat, nodes.ellipsoid)
    # The start is linear in longitude and latitude.
    steps = np.zeros((nodes.lon.size, 2, 2))
    steps[:, 0, 0], steps[:, 1, 1] = 1.0 / gradients[:, size, 0], 1.0 / gradients[:, 1, 1]
    linear = Targets(ground.targets.J @ steps, ground.targets.counts, ground.targets.weight).best_linear()
    start = np.zeros((2, size * size))
    start[:, size], start[:, 1] = linear.T
    best = ground.targets.nearest(gradients[:, 1:], start[:, 1:])
    coefficients = np.hstack([np.zeros((2, 1)), best.place]).reshape(2, size, size)
    function = BoxPolynomials((west, south, east, north), coefficients)
    return _Found(function, Projection.from_function(function, ellipsoid=nodes.ellipsoid))


def _of_region(ground: _Ground, maps: tuple[Projection, ...], degree: int, title: str) -> _Found:
    """The nearest polynomials in the plane of the map that is nearest to all."""
    chosen = min(maps, key=lambda one: (float(f"{ground.total(one):.{_SAME}g}"), one.definition))
    text = parameters_of(chosen, np.eye(2))
    base = chosen if text is None else Projection.from_user_input(text)
    J = ground.jacobian(base)
    x, y = base(ground.nodes.lon, ground.nodes.lat)
    counted = ground.targets.weight > 0.0
    targets = ground.targets
    within = Targets((targets.J @ np.linalg.inv(J))[:, counted], targets.counts, targets.weight[counted])
    plane_map = polynomial_mean(x[counted], y[counted], within, degree)
    function = Corrected(base, plane_map)
    return _Found.of_function(function, title, base)._replace(base=base)


def _bound(ground: _Ground) -> Nearness:
    """The bound, by the mean metrics."""
    J = ground.targets.mean_metric()
    return Nearness(
        kind="bound",
        name="mean metric",
        projection=None,
        total=ground.targets.total(J),
        airy_kavrayskiy=FIGURES["airy_kavrayskiy_scaled"](J, ground.targets.weight),
        error=None,
    )


def _standing(kind: str, name: str, projection: Projection, region: Place, ground: _Ground) -> Nearness:
    figure = sample(projection, region, measures=[], tolerance=_TOLERANCE).airy_kavrayskiy
    return Nearness(
        kind=kind,
        name=name,
        projection=projection,
        total=ground.total(projection),
        airy_kavrayskiy=figure.scaled,
        error=figure.error,
    )


def _notes(found: _Found, region: Place, ground: _Ground, standings: list[Nearness]) -> Iterator[str]:
    """Notes on the map."""
    mean, *others = (one.total for one in standings)
    if mean > min(others) + _ROUNDING:
        yield "The average, or a given map, has a smaller sum: polynomials of this degree do not come near these maps."
    odd = ground.targets.not_elliptic(ground.jacobian(found.projection))
    if odd.any():
        share = 100.0 * float(ground.targets.weight[odd].sum())
        yield (
            f"In {share:.2g} % of the region the maps are so far apart that the energy is not elliptic: there "
            "polynomials of higher degrees might fold or tear to come nearer."
        )
    if found.crs is None and found.base is None:
        yield f"The map is defined over {region.name} only."
    elif overlaps(found.projection, region):
        yield "The image of the region covers itself."
