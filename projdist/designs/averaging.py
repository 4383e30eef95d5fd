"""The mean of several maps, its bound, and the maps to compare it with."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist import decisions, projections as proj, regions
from projdist._typing import FloatArray
from projdist.designs import plane_maps
from projdist.designs.base_maps import TORN, WIDEST, OnProgress, check_degree, check_extent, overlaps
from projdist.field import FIGURES, Nodes, cut_length, nodes_of, sample
from projdist.projections import AreaOfUse, DerivedCrs, Projection, ProjectionError, ProjectionLike
from projdist.support import HIDDEN, Answer, check_text, schema

_Mean = plane_maps.BoxPolynomials | plane_maps.Corrected


@dataclass(frozen=True)
class Nearness:
    """The distance of a map from the given ones, and its distortion."""

    kind: str  # "bound", "mean", "average" or "given"
    name: str
    projection: Projection | None = field(metadata=HIDDEN)  # None for the bound, which is that of the mean metrics
    total: float  # sum over the given maps of weight times the mean squared Fisher distance
    airy_kavrayskiy: float = field(metadata=schema("airy_kavrayskiy_scaled"))  # at the best scale
    error: float | None = field(metadata=schema("airy_kavrayskiy_error"))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class MeanMap(Answer):
    """The mean of several maps."""

    region: regions.Place = field(metadata=schema(of=("name", "area_km2")))
    maps: tuple[Projection, ...]
    weights: tuple[float, ...]
    degree: int
    base: Projection | None = field(metadata=schema(of="definition"))  #: the map that is corrected, None for the world
    average: Projection = field(metadata=HIDDEN)  #: the plain average of coordinates
    standings: tuple[Nearness, ...]  #: of the bound, the mean, the average and the given maps
    error: float = field(metadata=schema("error_estimate"))  #: the change of their totals with fewer nodes
    notes: tuple[str, ...] = ()
    #: The map; of the world a sum of products of Chebyshev polynomials of longitude and latitude.
    projection: Projection = field(metadata=schema("chebyshev", of="name"))
    crs: DerivedCrs | None = field(
        metadata=schema(of={"proj": "pipeline", "wkt": "wkt", "wkt_derived": "wkt_derived"}, spread=True)
    )

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
        chebyshev = None
        if isinstance(function, plane_maps.BoxPolynomials):  # x and y of T_i T_j
            x, y = function.coefficients
            chebyshev = {"box": list(function.box), "x": x.tolist(), "y": y.tolist()}
        return super().to_dict() | {"maps": [one.definition for one in self.maps], "chebyshev": chebyshev}

    def _table(self) -> list[dict[str, Any]]:
        """A row a map, and the bound."""
        rows = ((one.kind, one.name, one.total, one.airy_kavrayskiy) for one in self.standings)
        return [dict(zip(("map", "name", "total", "airy_kavrayskiy_scaled"), row, strict=True)) for row in rows]


# ---- the mean map --------------------------------------------------------------------------------

_NODES, _FINE = 3000, 10_000
_HIGHEST = 86.0  # degrees of latitude: beyond, poles that are lines pull the mean onto a fold
_WORLD = regions.Box(-180.0, -85.0, 180.0, 85.0)
_DEGREE, _WORLD_DEGREE, _FINEST_OF_WORLD = 8, 9, 12
_TOLERANCE = 1e-8
_ROUNDING = 1e-10  # of totals, by finite differences
_EDGE = 1e-3  # degrees
_LONGEST = 60  # characters of a label
_SAME = 9  # digits of totals that are compared: two maps are equally far from their mean


def mean_map(
    projections: ProjectionLike | Iterable[ProjectionLike],
    *,
    weights: ArrayLike | None = None,
    region: regions.RegionLike | None = None,
    degree: int | None = None,
    datum: str | None = None,
    name: str | None = None,
    progress: OnProgress = None,
) -> MeanMap:
    """The mean of several maps: the map nearest to them, in the geometry of their distortion.

    Of all maps f of a degree it has the least sum, over the maps f_i, of weight_i times the mean of
    Dist_F(J_f J_i^-1)^2 over the region: the distortion of f relative to the plane of f_i, as the Airy-Kavrayskiy error
    is that relative to the ground. The bound is the sum for the Frechet means of the metrics J_i^T J_i at each point.

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
    listed = proj.listed_projections(projections)
    if not listed:
        raise ValueError("Invalid projections. There must be one map or more.")
    maps = tuple(Projection.from_user_input(one) for one in listed)
    labels = [
        given if isinstance(given, str) and len(given) <= _LONGEST else one.label
        for given, one in zip(listed, maps, strict=True)
    ]
    counts = plane_maps.check_counts(weights, len(maps))
    area = regions.region_for(region, maps)
    area = _WORLD if region is None and area == regions.GLOBE else area
    box = _world_box(area)
    order = (_WORLD_DEGREE if box else _DEGREE) if degree is None else check_degree(degree)
    if box and order > _FINEST_OF_WORLD:
        raise ValueError(f"Invalid degree {order}. It must be at most {_FINEST_OF_WORLD} for a map of the world.")
    named = f"mean of {' and '.join(labels)}" if len(labels) <= 2 else f"mean of {len(labels)} maps"
    title = named if name is None else check_text("name", name)
    for one in maps[1:]:
        if not 0.99 < one.ellipsoid.a / maps[0].ellipsoid.a < 1.01:
            raise ProjectionError(f"Invalid map '{one.label}'. It is of another size than '{maps[0].label}'.")
    datum_ellipsoid = None if datum is None else proj.geodetic_ellipsoid(check_text("datum", datum))
    coarse = _Ground.of(area, maps, counts, _NODES)
    west, south, east, north = area.bounds
    goes_round = isinstance(area, regions.Box) and east - west >= 360.0  # along its edge a map may be cut
    inner = regions.Box.between((west + _EDGE, south, east - _EDGE, north)) if goes_round else area
    for one in maps:
        if cut_length(one, inner) > 0.0:
            raise ProjectionError(f"Invalid map '{one.label}'. It is cut within {area.name}.")
    # The average of coordinates, each map turned like the first one.
    turns = [plane_maps.common_turn(J @ coarse.inverses[0], coarse.weight).conjugate() for J in coarse.J]
    function = functools.partial(plane_maps.averaged, maps, counts / counts.sum() * turns)
    average = Projection.from_function(function, name="average of coordinates", ellipsoid=coarse.nodes.ellipsoid)
    base = None if box else _nearest_base(coarse, maps)
    try:
        mean: _Mean
        if base is None:
            mean = _of_world(coarse, area.bounds, order)
        else:  # the nearest polynomials in the plane of the base
            x, y = base(coarse.nodes.lon, coarse.nodes.lat)
            counted = coarse.weight > 0.0
            J = (coarse.J @ np.linalg.inv(coarse.jacobian(base)))[:, counted]
            within = plane_maps.Targets(J, coarse.counts, coarse.weight[counted])
            mean = plane_maps.Corrected(base, plane_maps.polynomial_mean(x[counted], y[counted], within, order))
    except ProjectionError:
        raise
    except ValueError as error:
        raise ValueError(f"Invalid degree {order} for region '{area.name}'. {error}") from error
    if datum_ellipsoid is not None and not (base is not None and base.ellipsoid.is_close(datum_ellipsoid)):
        of_what = "a map of the world" if base is None else f"base '{base.label}'"
        raise ValueError(
            f"Invalid datum '{datum}' for {of_what}. It is for maps of regions, with the base's ellipsoid."
        )
    projection, crs = _placed(mean, coarse, average, title, AreaOfUse(area.name, area.bounds), datum)
    fine = _Ground.of(area, maps, counts, _FINE)
    measured = [("mean", "", projection), ("average", "of coordinates", average)]
    measured += [("given", label, one) for label, one in zip(labels, maps, strict=True)]
    standings, change = _standings(measured, area, coarse, fine, progress)
    found = MeanMap(
        region=area,
        maps=maps,
        weights=tuple(counts.tolist()),
        degree=order,
        projection=projection,
        base=base,
        crs=crs,
        average=average,
        standings=standings,
        error=change,
    )
    return replace(found, notes=tuple(_notes(found, coarse)))


def _world_box(region: regions.Place) -> regions.Box | None:
    """The region if it is a box that needs a map of the world, None if it needs no such map; raises ValueError."""
    if decisions.extent_of(region).radius <= WIDEST:
        check_extent(region)
        return None
    if not isinstance(region, regions.Box) or max(abs(region.south), abs(region.north)) > _HIGHEST:
        raise ValueError(
            f"Invalid region '{region.name}'. What reaches farther than {WIDEST:.0f} degrees from its middle must be "
            f"a box within {_HIGHEST:.0f} degrees of latitude, such as {_WORLD.name}."
        )
    return region


@dataclass(frozen=True, eq=False)
class _Ground(plane_maps.Targets):
    """The given maps at the nodes of a region."""

    nodes: Nodes

    @classmethod
    def of(cls, region: regions.Place, maps: tuple[Projection, ...], counts: FloatArray, count: int) -> _Ground:
        """The ground with about `count` nodes; raises ProjectionError for a map that is torn or mirrored there."""
        # Areas are those of the maps' flattest ellipsoid.
        ellipsoid = max((one.ellipsoid for one in maps), key=lambda ellipsoid: (ellipsoid.f, ellipsoid.a))
        nodes = nodes_of(region, ellipsoid, count)
        J = np.stack([nodes.jacobian(one)[0] for one in maps])
        with np.errstate(invalid="ignore"):
            smooth = np.isfinite(J).all(axis=(2, 3)) & (np.linalg.det(J) > 0.0)
        for one, good in zip(maps, smooth, strict=True):
            lost = float(nodes.weight[~good].sum())
            if lost > TORN:
                raise ProjectionError(
                    f"Invalid map '{one.label}'. It tears, turns over or does not show {100.0 * lost:.3g} % of "
                    f"{region.name}."
                )
        # Nodes next to poles have hardly any weight and may have no Jacobian.
        J[:, ~smooth.all(axis=0)] = np.eye(2)
        return cls(J, counts, np.where(smooth.all(axis=0), nodes.weight, 0.0), nodes)

    def jacobian(self, projection: Projection) -> FloatArray:
        """Jacobians (n, 2, 2) at the nodes, the identity where the weight is 0."""
        J = self.nodes.jacobian(projection)[0]
        return np.where((self.weight > 0.0)[:, None, None], J, np.eye(2))

    def middle(self, projection: Projection) -> complex:
        """The mean of x + i y."""
        x, y = projection(self.nodes.lon, self.nodes.lat)
        return complex(np.sum(self.weight * np.where(self.weight > 0.0, x + 1j * y, 0.0)))


def _of_world(ground: _Ground, box: plane_maps.Sides, degree: int) -> plane_maps.BoxPolynomials:
    """The sum of products of Chebyshev polynomials that is nearest to the maps."""
    nodes, size = ground.nodes, degree + 1
    gradients = plane_maps.box_gradients(box, degree, nodes.lon, nodes.lat, nodes.ellipsoid)
    # The start is linear in longitude and latitude.
    steps = np.zeros((nodes.lon.size, 2, 2))
    steps[:, 0, 0], steps[:, 1, 1] = 1.0 / gradients[:, size, 0], 1.0 / gradients[:, 1, 1]
    linear = plane_maps.Targets(ground.J @ steps, ground.counts, ground.weight).best_linear()
    start = np.zeros((2, size * size))
    start[:, size], start[:, 1] = linear.T
    best = ground.nearest(gradients[:, 1:], start[:, 1:])
    return plane_maps.BoxPolynomials(box, np.hstack([np.zeros((2, 1)), best.place]).reshape(2, size, size))


def _nearest_base(ground: _Ground, maps: tuple[Projection, ...]) -> Projection:
    """The map that is nearest to all, by its PROJ string if it has one."""
    chosen = min(maps, key=lambda one: (float(f"{ground.total(ground.jacobian(one)):.{_SAME}g}"), one.definition))
    text = proj.parameters_of(chosen, np.eye(2))
    return chosen if text is None else Projection.from_user_input(text)


def _placed(
    mean: _Mean, ground: _Ground, average: Projection, title: str, area: AreaOfUse, datum: str | None
) -> tuple[Projection, DerivedCrs | None]:
    """The mean with the orientation and the middle of the average, and its CRS if it has one."""
    ellipsoid = (mean.base if isinstance(mean, plane_maps.Corrected) else average).ellipsoid
    own = Projection.from_function(mean, name=title, ellipsoid=ellipsoid)
    turn = plane_maps.common_turn(ground.jacobian(average) @ np.linalg.inv(ground.jacobian(own)), ground.weight)
    mean = mean.moved(turn, ground.middle(average) - turn * ground.middle(own))
    if isinstance(mean, plane_maps.Corrected):
        with contextlib.suppress(ProjectionError):  # of a base that is no CRS
            crs = proj.derived_crs(mean.base, mean.plane_map.steps, title, area, geodetic=datum)
            return crs.projection, crs
    return Projection.from_function(mean, name=title, ellipsoid=ellipsoid), None


def _standings(
    maps: list[tuple[str, str, Projection]], region: regions.Place, coarse: _Ground, fine: _Ground, progress: OnProgress
) -> tuple[tuple[Nearness, ...], float]:
    """Standings of the bound and of maps (kind, name, map), and the largest change of totals with fewer nodes."""
    J = fine.mean_metric()
    least = FIGURES["airy_kavrayskiy_scaled"](J, fine.weight)
    found, error = [Nearness("bound", "mean metric", None, fine.total(J), least, None)], 0.0
    for number, (kind, name, projection) in enumerate(maps):
        if progress is not None:
            progress(number, len(maps))
        figure = sample(projection, region, measures=[], tolerance=_TOLERANCE).airy_kavrayskiy
        total = fine.total(fine.jacobian(projection))
        found.append(Nearness(kind, name, projection, total, figure.scaled, figure.error))
        error = max(error, abs(total - coarse.total(coarse.jacobian(projection))))
    return tuple(found), error


def _notes(found: MeanMap, ground: _Ground) -> Iterator[str]:
    """Notes on the map."""
    _, mean, *others = (one.total for one in found.standings)
    if mean > min(others) + _ROUNDING:
        yield "The average, or a given map, has a smaller sum: polynomials of this degree do not come near these maps."
    odd = ground.not_elliptic(ground.jacobian(found.projection))
    if odd.any():
        share = 100.0 * float(ground.weight[odd].sum())
        yield (
            f"In {share:.2g} % of the region the maps are so far apart that the energy is not elliptic: there "
            "polynomials of higher degrees might fold or tear to come nearer."
        )
    if found.base is None:
        yield f"The map is defined over {found.region.name} only."
    elif overlaps(found.projection, found.region):
        yield "The image of the region covers itself."
