"""Fields at fixed nodes, and fields whose Jacobians are given by arrays or by a function."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import WGS84, Ellipsoid
from projdist.field.at_points import jacobian
from projdist.field.cubature import Samples
from projdist.field.field import Field
from projdist.field.stencils import fourth_order
from projdist.projections import Projection
from projdist.regions import Place, PointSet, Region, RegionLike, cells_of, get_region
from projdist.support import check_numbers

# Radians. Where the truncation of the fourth order, step^4 / 30, meets rounding, 1e-16 / step; and, where a pole that
# is drawn as a line is near, as a part of the distance to it.
_STEP, _POLAR_STEP, _SHORTEST = 5e-4, 0.05, 1e-8
# The second and the fourth order differ by a seventh or more of the derivative across a seam, and by step^2 / 3 d^2 at
# the distance d of a singular point. There the careful differences of `derivatives` step in.
_DOUBTFUL = 0.02
_NOTHING = 1e-10  # of the area: nodes next to a pole, which cost much to settle and mean nothing
_HIGHEST = 20  # Gauss nodes along a side of a panel: enough for whole hemispheres of smooth maps


@dataclass(frozen=True, kw_only=True)
class Nodes:
    """Points in degrees, their share of the area, and stencils (8, n) about them.

    Nodes of weight 0 lie on the edges of panels; they count for extremes only.
    """

    lon: FloatArray
    lat: FloatArray
    weight: FloatArray
    ellipsoid: Ellipsoid
    stencil_lon: FloatArray = field(repr=False)
    stencil_lat: FloatArray = field(repr=False)
    step: FloatArray = field(repr=False)

    def jacobian(self, projection: Projection) -> tuple[FloatArray, BoolArray]:
        """Jacobians (n, 2, 2), NaN where the map is torn or undefined; and where it is defined."""
        x, y = projection(self.stencil_lon, self.stencil_lat)
        J = np.empty((self.lon.size, 2, 2))
        change = np.zeros(self.lon.size)
        meridian, vertical = self.ellipsoid.radii(self.lat)
        for column, radius in enumerate((vertical, meridian)):
            metre = 1.0 / (self.step * radius)
            for row, value in enumerate((x, y)):
                J[:, row, column], third = fourth_order(value[4 * column : 4 * column + 4], metre)
                change += np.abs(third)
        with np.errstate(invalid="ignore"):
            doubtful = np.flatnonzero(~(change <= _DOUBTFUL * np.abs(J).sum(axis=(1, 2))))
        if doubtful.size == self.lon.size:
            J[:] = np.nan
        elif doubtful.size:
            J[doubtful] = np.nan
            matter = doubtful[(self.weight[doubtful] > _NOTHING) | (self.weight[doubtful] == 0.0)]
            J[matter] = jacobian(projection, self.lon[matter], self.lat[matter])
        shown = np.ones(self.lon.size, dtype=bool)
        shown[doubtful] = np.isfinite(projection(self.lon[doubtful], self.lat[doubtful])[0])
        return J, shown

    def joined(self, lon: float, lat: float) -> Nodes:
        """These nodes and one of no weight."""
        return nodes_at(np.append(self.lon, lon), np.append(self.lat, lat), np.append(self.weight, 0.0), self.ellipsoid)

    def meridional_scale(self, projection: Projection) -> FloatArray:
        """The scale along the meridian, at half the cost; on a conformal map it is that in all directions."""
        x, y = projection(self.stencil_lon[4:], self.stencil_lat[4:])
        meridian, _ = self.ellipsoid.radii(self.lat)
        moved = [(8.0 * (value[0] - value[1]) - (value[2] - value[3])) / 12.0 for value in (x, y)]
        return np.hypot(*moved) / (self.step * meridian)


def nodes_at(lon: FloatArray, lat: FloatArray, weight: FloatArray, ellipsoid: Ellipsoid) -> Nodes:
    """Nodes at points in degrees, with weights of any sum."""
    lam, phi = np.radians(lon), np.radians(lat)
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
    away = np.degrees(np.arctan2(Y, X)) - lon
    return Nodes(
        lon=lon,
        lat=lat,
        weight=weight / weight.sum(),
        ellipsoid=ellipsoid,
        stencil_lon=lon + np.mod(away + 180.0, 360.0) - 180.0,
        stencil_lat=np.degrees(np.arctan2(Z, np.hypot(X, Y))),
        step=step,
    )


_ALONG, _MOST_ALONG = 100, 1500  # points on an edge that is as long as the region; on all edges
_ALL_ALONG = 20_000  # points on all edges, besides their ends
_POLE = 90.0 - 1e-9  # degrees


def nodes_of(region: Place, ellipsoid: Ellipsoid, count: int, *, edges: bool = False, all_ends: bool = False) -> Nodes:
    """About `count` nodes of a region; with `edges` also nodes of no weight where it ends.

    Of the edges of polygons those are some, so that small islands may have none; with `all_ends` every vertex is one.

    Where its panels lie wholly in it, as those of boxes and caps do, the nodes are the panels' Gauss points. Else there
    is a node in each of so many cells, at the middle of the cell's part of the region and with its area: means are good
    to the square of a cell, and an island counts for what it is. Of a set of points the nodes are points.
    """
    if isinstance(region, PointSet):
        every = max(1, region.lon.size // count)
        return nodes_at(region.lon[::every], region.lat[::every], region.weight[::every], ellipsoid)
    patch, rectangles = region.panels()
    if region.edges.size:
        return _cell_nodes(region, ellipsoid, count, edges, all_ends)
    patch, rectangles = _split(patch, rectangles, count)
    order = int(np.clip(round(np.sqrt(count / len(rectangles))), 2, _HIGHEST))
    lon, lat, weight = (values.ravel() for values in _panel_nodes(region, patch, rectangles, order))
    weight = weight * _radii_squared(ellipsoid, lat)
    if edges:
        lon, lat, weight = _appended((lon, lat, weight), _edge_nodes(region, patch, rectangles, 4 * order + 1))
    return nodes_at(lon, lat, weight, ellipsoid)


def _radii_squared(ellipsoid: Ellipsoid, lat: FloatArray) -> FloatArray:
    meridian, vertical = ellipsoid.radii(lat)
    return meridian * vertical


def _appended(
    nodes: tuple[FloatArray, FloatArray, FloatArray], more: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Nodes, and more of no weight."""
    lon, lat, weight = nodes
    return np.append(lon, more[0]), np.append(lat, more[1]), np.append(weight, np.zeros(more[0].size))


def _cell_nodes(region: Region, ellipsoid: Ellipsoid, count: int, edges: bool, all_ends: bool) -> Nodes:
    """The middles of cells, and points on the region's edges."""
    cells = cells_of(region, ellipsoid, count)
    points = region.chart(cells.patch, cells.u, cells.v)
    nodes = np.asarray(points.lon), np.asarray(points.lat), cells.area
    if edges:
        nodes = _appended(nodes, _all_along(region) if all_ends else _some_along(region))
    return nodes_at(*nodes, ellipsoid)


def _some_along(region: Region) -> tuple[FloatArray, FloatArray]:
    """Some of the points on the edges, each at an end or a step from the next one."""
    west, south, east, north = region.bounds
    lon, lat = _stepped(region.edges, max(east - west, north - south) / _ALONG)
    every = max(1, lon.size // _MOST_ALONG)
    return lon[::every], lat[::every]


def _all_along(region: Region) -> tuple[FloatArray, FloatArray]:
    """All ends of the edges, and points between where these are far apart."""
    lon0, lat0, lon1, lat1 = region.edges.T
    return _stepped(region.edges, float(np.hypot(lon1 - lon0, lat1 - lat0).sum()) / _ALL_ALONG)


def _stepped(edges: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """Points on edges (n, 4), each at an end or a step from the next one.

    None at a pole, where polygons around it have edges that are no ends of theirs.
    """
    lon0, lat0, lon1, lat1 = edges.T
    parts = np.maximum(np.ceil(np.hypot(lon1 - lon0, lat1 - lat0) / step), 1.0).astype(int)
    which = np.repeat(np.arange(parts.size), parts)
    share = (np.arange(which.size) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[which]
    lon, lat = lon0[which] + share * (lon1 - lon0)[which], lat0[which] + share * (lat1 - lat0)[which]
    apart = np.abs(lat) < _POLE
    return lon[apart], lat[apart]


def _split(patch: IntArray, rectangles: FloatArray, count: int) -> tuple[IntArray, FloatArray]:
    """Panels in so many equal parts that none needs more nodes than the highest order has."""
    parts = int(np.ceil(np.sqrt(count / (len(rectangles) * _HIGHEST**2))))
    if parts == 1:
        return patch, rectangles
    ends = np.linspace(0.0, 1.0, parts + 1)
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(parts), np.arange(parts), indexing="ij"))
    u0, u1, v0, v1 = (side[:, None] for side in rectangles.T)
    u, v = u0 + (u1 - u0) * ends, v0 + (v1 - v0) * ends
    return np.repeat(patch, parts**2), np.stack([u[:, i], u[:, i + 1], v[:, j], v[:, j + 1]], axis=-1).reshape(-1, 4)


def _panel_nodes(
    region: Region, patch: IntArray, rectangles: FloatArray, order: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Longitudes, latitudes and areas on the unit sphere of the Gauss nodes, shape (n, order^2)."""
    nodes, weights = np.polynomial.legendre.leggauss(order)
    r, s = (axis.ravel() for axis in np.meshgrid(nodes, nodes, indexing="ij"))
    lon, lat, density = _chart(region, patch, rectangles, r, s)
    return lon, lat, density * np.outer(weights, weights).ravel()


def _edge_nodes(region: Region, patch: IntArray, rectangles: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Points on the four sides of panels, denser towards the corners, which are among them."""
    t = -np.cos(np.pi * np.arange(count) / (count - 1))
    one = np.ones(count)
    lon, lat, _ = _chart(
        region, patch, rectangles, np.concatenate([t, t, one, -one]), np.concatenate([one, -one, t, t])
    )
    return lon.ravel(), lat.ravel()


def _chart(
    region: Region, patch: IntArray, rectangles: FloatArray, r: FloatArray, s: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points of panels at r, s in [-1, 1], and their area on the unit sphere by dr ds; shape (n, r.size)."""
    u0, u1, v0, v1 = (side[:, None] for side in rectangles.T)
    u, v = 0.5 * (u0 + u1 + (u1 - u0) * r), 0.5 * (v0 + v1 + (v1 - v0) * s)
    points = region.chart(patch[:, None], u, v)
    density = np.abs(points.east_u * points.north_v - points.east_v * points.north_u)
    lon, lat, density = np.broadcast_arrays(points.lon, points.lat, density * 0.25 * (u1 - u0) * (v1 - v0))
    return lon, lat, density


# ---- given fields --------------------------------------------------------------------------------


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
        What each Jacobian counts, not negative; equal ones if there are none. Not with a function.
    lon, lat : array_like (n,), optional
        Where they are in degrees, for the places of extremes. Not with a function.
    hessian : array_like (n, 2, 2, 2), optional
        Second derivatives per radian of the semi-major axis, for measures that need them. Not with a function.
    region : RegionLike, optional
        Anything that `get_region` takes, for a function: it is asked at 10,000 nodes of it, and the figures' errors are
        what 2,500 would change.

    Returns
    -------
    Field
        Of arrays the figures are those of the Jacobians themselves, each extreme the largest of them.

    Raises
    ------
    ValueError
        For arrays of other shapes, weights that are negative or all 0, Jacobians of which none is finite, and a
        function without a region.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the mean distorting
    transformation of any Jacobians.

    Examples
    --------
    >>> import numpy as np
    >>> field = field_of([np.diag([1.1, 1.0]), np.diag([1.2, 1.0])], weight=[3, 1])
    >>> round(field.mean("s").value, 12), field.maximum("s").value
    (1.125, 1.2)
    """
    if not callable(jacobian):
        return _field_of_points(jacobian, weight, lon, lat, hessian)
    if region is None or not (weight is lon is lat is hessian is None):
        raise ValueError("Invalid field. A function of longitude and latitude goes with a region and nothing else.")
    place = get_region(region)
    fine, coarse = (nodes_of(place, WGS84, count) for count in (_FINE, _COARSE))
    fields = [_field_of_points(jacobian(at.lon, at.lat), at.weight, at.lon, at.lat, None) for at in (fine, coarse)]
    return replace(fields[0], _coarser=fields[1])


def _field_of_points(jacobian: Any, weight: Any, lon: Any, lat: Any, hessian: Any) -> Field:
    J = check_numbers("Jacobians", jacobian)
    if J.ndim != 3 or J.shape[1:] != (2, 2) or not len(J):
        raise ValueError(f"Invalid shape {J.shape} of Jacobians. It must be (n, 2, 2) with n at least 1.")
    shapes = {
        "weight": (weight, 1.0, ()),
        "lon": (lon, np.nan, ()),
        "lat": (lat, np.nan, ()),
        "hessian": (hessian, 0.0, (2, 2, 2)),
    }
    arrays = {name: _of_shape(name, given, (len(J), *rest), usual) for name, (given, usual, rest) in shapes.items()}
    w = arrays["weight"]
    if not (w.min() >= 0.0 and 0.0 < w.sum() < np.inf):
        raise ValueError("Invalid weights. They must be finite and not negative, and not all 0.")
    H = None if hessian is None else arrays["hessian"]
    samples = Samples.of_points(arrays["lon"], arrays["lat"], w, J, H, doubt=np.zeros(len(J)), evaluations=0)
    if samples is None:
        raise ValueError("Invalid Jacobians. None of those with a weight is finite.")
    return Field(projection=None, region=None, measures={}, _samples=samples)


def _of_shape(name: str, given: Any, shape: tuple[int, ...], usual: float) -> FloatArray:
    if given is None:
        return np.full(shape, usual)
    values = check_numbers(name, given)
    if values.shape != shape:
        raise ValueError(f"Invalid shape {values.shape} of {name}. It must be {shape}.")
    return values
