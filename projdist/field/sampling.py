"""Fields of maps over regions, with a check; Jacobians at fixed nodes; and fields of given Jacobians."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from projdist import earth
from projdist._typing import ArrayLike, BoolArray, FloatArray, IntArray
from projdist.field.at_points import derivatives, jacobian
from projdist.field.cubature import STENCIL, Integrand, Mesh, MeshGoal
from projdist.field.field import AnyMeasure, Field
from projdist.field.panels import Pieces
from projdist.field.stencils import fourth_order, hessian
from projdist.matrices import Measure, get_measure, log_scales
from projdist.projections import Projection, ProjectionError, ProjectionLike, declared_property_of, native_pole_of
from projdist.regions import Box, Place, PointSet, Region, RegionLike, TurnedGlobe, cells_of, get_region, region_for
from projdist.support import check_number, check_numbers, listed_values, tell

# ---- fields of maps ------------------------------------------------------------------------------

DEFAULT_TOLERANCE = 1e-8
_SLACK = 0.5  # share of the tolerance that would do if errors were proportional to it
_MAX_EVALUATIONS = 1_500_000
_MEAN_TOLERANCE = 1e-6  # measures have kinks, which cost more
# For second derivatives: where J has a jump they grow as panels shrink, so that splitting gains nothing.
_SECOND_TOLERANCE = 1e-5
_STUCK = 1.5  # for means of integrands: kinks may keep nearly all of their error, rounding doubles it


def named_measures(measures: Any) -> dict[str, Measure]:
    """Measures by the names that they were asked for; raises ValueError if two have the same name."""
    if isinstance(measures, Mapping):
        return {str(name): get_measure(given) for name, given in measures.items()}
    chosen: dict[str, Measure] = {}
    for given in [] if measures is None else listed_values(measures, (str, Measure)):
        measure = get_measure(given)
        name = given if isinstance(given, str) else measure.name
        if chosen.get(name, measure) != measure:
            raise ValueError(f"Invalid measures. Two are called '{name}'; each must have a name of its own.")
        chosen[name] = measure
    return chosen


def sample(
    projection: ProjectionLike,
    region: RegionLike | None = None,
    *,
    measures: Iterable[AnyMeasure] = (),
    tolerance: float = DEFAULT_TOLERANCE,
) -> Field:
    """The Jacobian field of a projection over a region, sampled finely enough for its figures.

    Parameters
    ----------
    projection : ProjectionLike
    region : RegionLike, optional
        Anything that `get_region` takes. By default the area of use of a CRS, else the globe.
    measures : iterable of str, Measure or callable, or one of them
        Measures whose means m are resolved to max(tolerance, 1e-6) * max(1, abs(m)), those of second derivatives to
        1e-5. The field gives other measures, too; their errors tell how well they are resolved.
    tolerance : float, default 1e-8
        The error to which the Airy-Kavrayskiy errors are resolved, if the projection's rounding allows.

    Returns
    -------
    Field
        Its `mean`, `rms`, `statistic`, `maximum`, `minimum` and `figure` are those of the region, each with its error.

    Raises
    ------
    ValueError
        For an unknown region or measure, and a tolerance that is not positive.
    ProjectionError
        For what is no projection, and if no point of the region can be projected.

    References
    ----------
    - V. V. Kavrayskiy 1934, Matematicheskaya kartografiya.
    - D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications.

    Examples
    --------
    On Mercator's map s is 1 / cos^2(lat): from 0 to 60 degrees 4 at most, and ln(2 + sqrt(3)) / sin(60) on average.

    >>> field = sample("mercator", "box:0,0,10,60", measures=["s"])
    >>> round(field.mean("s").value, 6), round(field.maximum("s").value, 6)
    (1.520692, 4.0)
    """
    projection = Projection.from_user_input(projection)
    place, chosen = region_for(region, [projection]), named_measures(measures)
    of_J = [measure for measure in chosen.values() if not measure.needs_hessian]
    # The squares of flexion and skewness diverge on most maps.
    of_H = [measure for measure in chosen.values() if measure.needs_hessian]
    integrands = [integrand for one in of_J for integrand in (one, lambda J, one=one: one(J) ** 2)]
    field = replace(field_resolving(projection, place, integrands, of_H, tolerance=tolerance), measures=chosen)
    error = field.airy_kavrayskiy.error
    J, weight = field._pieces.jacobian, field._pieces.weight
    check_declared_property(projection, J, weight, max(tolerance, error))
    if error > tolerance and not field.limit:
        # The affine error is no goal of the refinement, and seldom larger than the others.
        finer = _SLACK * tolerance * tolerance / error
        field = replace(field_resolving(projection, place, integrands, of_H, tolerance=finer), measures=chosen)
    if isinstance(place, PointSet) and place.coarse is not None:
        coarse = sample(projection, place.coarse, measures=chosen, tolerance=tolerance)
        field = replace(field, evaluations=field.evaluations + coarse.evaluations, _coarser=coarse)
    return field


def field_resolving(
    projection: Projection,
    region: Place,
    integrands: Sequence[Integrand] = (),
    second_order: Sequence[Measure] = (),
    *,
    tolerance: float = DEFAULT_TOLERANCE,
    max_evaluations: int = _MAX_EVALUATIONS,
) -> Field:
    """The field of a projection over a region, without `sample`'s notice and second pass."""
    # The raw and the scaled Airy-Kavrayskiy error are resolved to `tolerance`, the mean m of each integrand, a function
    # of J (n, p, p, 2, 2), to max(tolerance, 1e-6) * max(1, |m|), and that of each measure of `second_order` to 1e-5.
    # Each mean may take another quarter of `max_evaluations`. Raises ValueError and ProjectionError as `sample`.
    if not check_number("tolerance", tolerance) > 0:
        raise ValueError(f"Invalid tolerance '{tolerance}'. It must be above 0.")
    nothing = f"Invalid region '{region.name}' for {projection.name}. No point of it can be projected."
    if isinstance(region, PointSet):
        at = derivatives(projection, region.lon, region.lat)
        H = hessian(projection, region.lon, region.lat) if second_order else None
        field = _field_at_points(region.lon, region.lat, region.weight, at.jacobian, H, at.error)
        if field is None:
            raise ProjectionError(nothing)
        return replace(field, projection=projection, region=region, evaluations=STENCIL * region.lon.size)
    # The globe gets a chart about the map's own pole, if that is known; not for second derivatives, as east and north
    # turn without bound about the Earth's poles, which its panels hold.
    is_globe = isinstance(region, Box) and region.is_globe
    pole = native_pole_of(projection) if is_globe and not second_order else None
    charted = TurnedGlobe(*pole) if pole else region
    mesh = Mesh(projection, charted, integrands, second_order)
    limit = mesh.refine(MeshGoal(0, tolerance), max_evaluations)
    for column in range(2, len(mesh.peaks)):
        goal = MeshGoal(column, max(tolerance, _MEAN_TOLERANCE), _STUCK)
        if column >= 2 + len(integrands):
            goal = MeshGoal(column, max(tolerance, _SECOND_TOLERANCE), gives_up=True)
        mesh.refine(goal, mesh.evaluations + max_evaluations // 4)
    pieces = mesh.leaves()
    if not len(pieces.panel):
        raise ProjectionError(nothing)
    panels, area = mesh.panels, mesh.region_area
    return Field(
        projection=projection,
        region=region,
        measures={},
        coverage=min(1.0, float(pieces.weight.sum()) / area),
        evaluations=mesh.evaluations,
        limit=limit,
        _pieces=pieces,
        _charted=charted,
        _undecided=float(panels.area[panels.alive & panels.undecided].sum()) / area,
    )


def _field_at_points(
    lon: FloatArray, lat: FloatArray, weight: FloatArray, J: FloatArray, H: FloatArray | None, doubt: FloatArray
) -> Field | None:
    """The field of Jacobians at those of n points that have a weight and a Jacobian; None if none has."""
    defined = np.isfinite(J).all(axis=(1, 2)) & (weight > 0.0)
    if not defined.any():
        return None
    u, v, own = (values[defined, None, None] for values in (lon, lat, weight))
    n, nothing = len(own), np.empty((len(own), 0))
    pieces = Pieces(
        panel=np.arange(n),
        patch=np.zeros(n, dtype=int),
        u=u,
        v=v,
        lon=u,
        lat=v,
        jacobian=J[defined, None, None],
        hessian=nothing if H is None else H[defined, None, None],
        sides=nothing,
        density=own,
        weight=own,
        share=np.ones(n),
        unresolved=np.zeros(n),
        doubt=doubt[defined, None],
    )
    coverage = float(own.sum() / weight.sum())
    return Field(projection=None, region=None, measures={}, coverage=coverage, evaluations=0, limit="", _pieces=pieces)


_MOST_CHECKED = 60  # Jacobians, so that the check costs next to nothing
# PROJ's iterations and elliptic functions leave 1e-6; the wrong ellipsoid, or a series far from home, 1e-4 and more.
_AS_DECLARED = 1e-5


def check_declared_property(
    projection: Projection, J: FloatArray, weight: FloatArray | None = None, error: float = 0.0
) -> None:
    """Give a notice if most Jacobians, good to `error`, lack the property that the map's method declares."""
    # The heaviest weights (...) count, because nodes crowd where a map is singular and PROJ's rounding is large.
    declared = declared_property_of(projection)
    if declared is None:
        return
    J = J.reshape(-1, 2, 2)
    if weight is not None:
        J = J[np.argsort(-np.abs(weight), axis=None)[: max(_MOST_CHECKED, len(J) // 4)]]
    J = J[:: max(1, len(J) // _MOST_CHECKED)]
    J = J[np.isfinite(J).all(axis=(-1, -2))]
    if not len(J):
        return
    # How far most Jacobians are from the property, as a logarithm of scales.
    squares, log_areas = log_scales(J)
    if declared.keeps == "conformal":  # ln(a / b)^2 = 2 (ln^2 a + ln^2 b) - ln(a b)^2
        off = float(np.sqrt(max(np.median(2.0 * squares - log_areas**2), 0.0)))
    else:  # equal-area maps have one areal scale, which need not be 1: the range of half of the points
        values = np.sort(log_areas)  # `np.quantile` takes ten times as long for so few
        low, high = np.interp([0.25 * (values.size - 1), 0.75 * (values.size - 1)], np.arange(values.size), values)
        off = float(high - low) if np.isfinite(values[-1]) else np.nan
    if not off > max(_AS_DECLARED, error):
        return
    if declared.keeps == "conformal":  # tan^2 of (90 degrees + omega) / 4 is the ratio of the scales
        size, text = np.degrees(2.0 * np.arcsin(np.tanh(off / 2.0))), "angles are off by {} degrees"
    else:
        size, text = 100.0 * np.expm1(off), "areas differ by {} %"
    digits = f"{size:.2g}" if size < 99.5 else f"{size:,.0f}"
    tell(
        f"{projection.label} is not {declared.keeps} here, as {declared.name} should be: {text.format(digits)}. "
        "It may be too far from where the map is meant for."
    )


# ---- fixed nodes ---------------------------------------------------------------------------------

# Radians: where truncation (step^4 / 30) equals rounding (1e-16 / step). Near a pole, which may be drawn as a line, a
# share of the distance to it.
_STEP, _POLAR_STEP, _SHORTEST = 5e-4, 0.05, 1e-8
# Second and fourth order differ by a seventh of the derivative or more across a seam, and by step^2 / 3 d^2 at a
# distance d from a singular point. There the careful differences of `derivatives` take over.
_DOUBTFUL = 0.02
_NOTHING = 1e-10  # of the area: weights of nodes next to a pole, which take long and make no difference
_HIGHEST = 20  # Gauss nodes along a side of a panel: enough for whole hemispheres of smooth maps


@dataclass(frozen=True, kw_only=True)
class Nodes:
    """Points (n,) in degrees with their shares of the area; those of weight 0 on edges count for extremes only."""

    lon: FloatArray
    lat: FloatArray
    weight: FloatArray
    ellipsoid: earth.Ellipsoid

    def jacobian(self, projection: Projection) -> tuple[FloatArray, BoolArray]:
        """Jacobians (n, 2, 2), NaN where the map is torn or undefined, and a mask of where it is defined."""
        form = projection.closed_form
        if form is None:
            J, good = self._by_differences(projection)
        else:  # which has PROJ's coordinates on a wide grid: searches look at thousands of maps, not at each node
            plane, error = form.plane(self.lon, self.lat)
            J, good = plane.jacobian, error >= 0.0
        doubtful = np.flatnonzero(~good)
        if doubtful.size:
            J[doubtful] = np.nan
            if form is not None or good.any():
                matter = doubtful[(self.weight[doubtful] > _NOTHING) | (self.weight[doubtful] == 0.0)]
                J[matter] = jacobian(projection, self.lon[matter], self.lat[matter])
        shown = np.ones(self.lon.size, dtype=bool)
        shown[doubtful] = np.isfinite(projection(self.lon[doubtful], self.lat[doubtful])[0])
        return J, shown

    def _by_differences(self, projection: Projection) -> tuple[FloatArray, BoolArray]:
        """J by differences of one step, and a mask of where they are good enough."""
        lon, lat, step = self._stencil
        J = np.empty((self.lon.size, 2, 2))
        change = np.zeros(self.lon.size)
        meridian, vertical = self.ellipsoid.radii(self.lat)
        values = projection(lon, lat)
        for column, radius in enumerate((vertical, meridian)):
            metre = 1.0 / (step * radius)
            for row, value in enumerate(values):
                J[:, row, column], third = fourth_order(value[4 * column : 4 * column + 4], metre)
                change += np.abs(third)
        with np.errstate(invalid="ignore"):
            return J, change <= _DOUBTFUL * np.abs(J).sum(axis=(1, 2))

    @functools.cached_property
    def _stencil(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Degrees (8, n) of points along the parallel and the meridian, and the steps (n,) in radians."""
        lam, phi = np.radians(self.lon), np.radians(self.lat)
        sin_lam, cos_lam, sin_phi, cos_phi = np.sin(lam), np.cos(lam), np.sin(phi), np.cos(phi)
        point = np.stack([cos_phi * cos_lam, cos_phi * sin_lam, sin_phi])
        east = np.stack([-sin_lam, cos_lam, np.zeros_like(lam)])
        north = np.stack([-sin_phi * cos_lam, -sin_phi * sin_lam, cos_phi])
        step = np.clip(_POLAR_STEP * np.abs(cos_phi), _SHORTEST, _STEP)
        moved = [
            np.cos(k * step) * point + np.sin(k * step) * direction
            for direction in (east, north)
            for k in (1.0, -1.0, 2.0, -2.0)
        ]
        X, Y, Z = np.moveaxis(np.array(moved), 1, 0)
        away = np.degrees(np.arctan2(Y, X)) - self.lon
        lon = self.lon + np.mod(away + 180.0, 360.0) - 180.0
        return lon, np.degrees(np.arctan2(Z, np.hypot(X, Y))), step

    def joined(self, lon: float, lat: float) -> Nodes:
        """These nodes and one of weight 0."""
        return nodes_at(np.append(self.lon, lon), np.append(self.lat, lat), np.append(self.weight, 0.0), self.ellipsoid)


def nodes_at(lon: FloatArray, lat: FloatArray, weight: FloatArray, ellipsoid: earth.Ellipsoid) -> Nodes:
    """Nodes at points in degrees; their weights need not add up to 1."""
    return Nodes(lon=lon, lat=lat, weight=weight / weight.sum(), ellipsoid=ellipsoid)


_ALONG, _MOST_ALONG = 100, 1500  # points on an edge as long as the region, and on all edges
_ALL_ALONG = 20_000  # points on all edges, besides their ends
_POLE = 90.0 - 1e-9  # degrees


def nodes_of(
    region: Place, ellipsoid: earth.Ellipsoid, count: int, *, edges: bool = False, all_ends: bool = False
) -> Nodes:
    """About `count` nodes of a region; `edges` adds some of weight 0 on its edges, `all_ends` all ends of edges."""
    # Where the panels lie wholly in the region, as those of boxes and caps do, the nodes are the panels' Gauss points.
    # Otherwise each of `count` cells has a node at the middle of its part of the region, with the area of that part, so
    # that means are good to the square of a cell, and islands count.
    if isinstance(region, PointSet):
        every = max(1, region.lon.size // count)
        return nodes_at(region.lon[::every], region.lat[::every], region.weight[::every], ellipsoid)
    if region.edges.size:
        cells = cells_of(region, ellipsoid, count)
        points = region.chart(cells.patch, cells.u, cells.v)
        lon, lat, weight = np.asarray(points.lon), np.asarray(points.lat), cells.area
        beside = _along_edges(region, all_ends) if edges else None
    else:
        patch, rectangles = _split(*region.panels(), count)
        order = int(np.clip(round(np.sqrt(count / len(rectangles))), 2, _HIGHEST))
        nodes, weights = np.polynomial.legendre.leggauss(order)
        r, s = (axis.ravel() for axis in np.meshgrid(nodes, nodes, indexing="ij"))
        lon, lat, density = _chart(region, patch, rectangles, r, s)
        weight = (density * np.outer(weights, weights).ravel()).ravel()
        lon, lat = lon.ravel(), lat.ravel()
        meridian, vertical = ellipsoid.radii(lat)
        weight = weight * (meridian * vertical)
        beside = None
        if edges:  # denser towards the corners, which are among them
            t = -np.cos(np.pi * np.arange(4 * order + 1) / (4 * order))
            one = np.ones_like(t)
            r, s = np.concatenate([t, t, one, -one]), np.concatenate([one, -one, t, t])
            beside = _chart(region, patch, rectangles, r, s)[:2]
    if beside:
        lon, lat = np.append(lon, beside[0]), np.append(lat, beside[1])
        weight = np.append(weight, np.zeros(beside[0].size))
    return nodes_at(lon, lat, weight, ellipsoid)


def _along_edges(region: Region, all_ends: bool) -> tuple[FloatArray, FloatArray]:
    """Points on the edges: all ends, and points between ends that are far apart; or a selection of these."""
    lon0, lat0, lon1, lat1 = region.edges.T
    length = np.hypot(lon1 - lon0, lat1 - lat0)
    west, south, east, north = region.bounds
    step = float(length.sum()) / _ALL_ALONG if all_ends else max(east - west, north - south) / _ALONG
    parts = np.maximum(np.ceil(length / step), 1.0).astype(int)
    which = np.repeat(np.arange(parts.size), parts)
    share = (np.arange(which.size) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[which]
    lon, lat = lon0[which] + share * (lon1 - lon0)[which], lat0[which] + share * (lat1 - lat0)[which]
    apart = np.abs(lat) < _POLE  # polygons around a pole have edges there at which they do not end
    lon, lat = lon[apart], lat[apart]
    every = 1 if all_ends else max(1, lon.size // _MOST_ALONG)
    return lon[::every], lat[::every]


def _split(patch: IntArray, rectangles: FloatArray, count: int) -> tuple[IntArray, FloatArray]:
    """Panels cut into equal parts, so that none needs more nodes than the highest order."""
    parts = int(np.ceil(np.sqrt(count / (len(rectangles) * _HIGHEST**2))))
    if parts == 1:
        return patch, rectangles
    ends = np.linspace(0.0, 1.0, parts + 1)
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(parts), np.arange(parts), indexing="ij"))
    u0, u1, v0, v1 = (side[:, None] for side in rectangles.T)
    u, v = u0 + (u1 - u0) * ends, v0 + (v1 - v0) * ends
    return np.repeat(patch, parts**2), np.stack([u[:, i], u[:, i + 1], v[:, j], v[:, j + 1]], axis=-1).reshape(-1, 4)


def _chart(
    region: Region, patch: IntArray, rectangles: FloatArray, r: FloatArray, s: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points (n, m) of panels at r, s (m,) in [-1, 1], and areas on the unit sphere per area of r and s."""
    u0, u1, v0, v1 = (side[:, None] for side in rectangles.T)
    u, v = 0.5 * (u0 + u1 + (u1 - u0) * r), 0.5 * (v0 + v1 + (v1 - v0) * s)
    points = region.chart(patch[:, None], u, v)
    density = np.abs(points.east_u * points.north_v - points.east_v * points.north_u)
    lon, lat, density = np.broadcast_arrays(points.lon, points.lat, density * 0.25 * (u1 - u0) * (v1 - v0))
    return lon, lat, density


_FINE, _COARSE = 10_000, 2_500  # nodes of a region


def field_of(
    jacobian: Any,
    weight: ArrayLike | None = None,
    *,
    lon: ArrayLike | None = None,
    lat: ArrayLike | None = None,
    hessian: ArrayLike | None = None,
    region: RegionLike | None = None,
) -> Field:
    """The field of given Jacobians, or of a function of longitude and latitude that gives them over a region.

    Parameters
    ----------
    jacobian : array_like (n, 2, 2), or callable
        Jacobians; or a function of lon (n,) and lat (n,) in degrees that gives them, with a region.
    weight : array_like (n,), optional
        The weight of each Jacobian, not negative; equal by default. Not with a function.
    lon, lat : array_like (n,), optional
        The points in degrees, for the places of extremes. Not with a function.
    hessian : array_like (n, 2, 2, 2), optional
        Second derivatives per radian of the semi-major axis, for measures that need them. Not with a function.
    region : RegionLike, optional
        For a function, which is evaluated at 10,000 nodes of it. Errors are differences from figures of 2,500 nodes.

    Returns
    -------
    Field
        Figures of arrays are those of the given Jacobians, and an extreme is the largest of their values.

    Raises
    ------
    ValueError
        For other shapes, weights that are negative or all 0, no finite Jacobian, and a function without region.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the MDT of any Jacobians.

    Examples
    --------
    >>> import numpy as np
    >>> field = field_of([np.diag([1.1, 1.0]), np.diag([1.2, 1.0])], weight=[3, 1])
    >>> round(field.mean("s").value, 12), field.maximum("s").value
    (1.125, 1.2)
    """
    if callable(jacobian):
        if region is None or not (weight is lon is lat is hessian is None):
            raise ValueError("Invalid field. A function of longitude and latitude goes with a region and nothing else.")
        fine, coarse = (nodes_of(get_region(region), earth.WGS84, count) for count in (_FINE, _COARSE))
        both = [field_of(jacobian(at.lon, at.lat), at.weight, lon=at.lon, lat=at.lat) for at in (fine, coarse)]
        return replace(both[0], _coarser=both[1])
    J = check_numbers("Jacobians", jacobian)
    if J.ndim != 3 or J.shape[1:] != (2, 2) or not len(J):
        raise ValueError(f"Invalid shape {J.shape} of Jacobians. It must be (n, 2, 2) with n at least 1.")
    arrays: dict[str, FloatArray] = {}
    given_by_name = {"weight": (weight, 1.0), "lon": (lon, np.nan), "lat": (lat, np.nan), "hessian": (hessian, 0.0)}
    for name, (given, default) in given_by_name.items():
        shape = (len(J), 2, 2, 2) if name == "hessian" else (len(J),)
        arrays[name] = np.full(shape, default) if given is None else check_numbers(name, given)
        if arrays[name].shape != shape:
            raise ValueError(f"Invalid shape {arrays[name].shape} of {name}. It must be {shape}.")
    w = arrays["weight"]
    if not (w.min() >= 0.0 and 0.0 < w.sum() < np.inf):
        raise ValueError("Invalid weights. They must be finite and not negative, and not all 0.")
    H = None if hessian is None else arrays["hessian"]
    found = _field_at_points(arrays["lon"], arrays["lat"], w, J, H, np.zeros(len(J)))
    if found is None:
        raise ValueError("Invalid Jacobians. None of those with a weight is finite.")
    return found
