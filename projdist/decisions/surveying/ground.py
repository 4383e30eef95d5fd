"""Distances on the ground against distances on a map.

The combined factor of a point is k R_G / (R_G + h): the scale factor of a conformal map, reduced from the
ellipsoid to the ellipsoidal height h (not an orthometric one: that is lower by the geoid's height) with the
Gaussian mean radius of curvature R_G = sqrt(M N). The distortion is combined factor - 1, in parts per million.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.answers import elevation_factor
from projdist.earth import Ellipsoid
from projdist.field import Nodes, nodes_at, nodes_of
from projdist.matrices import areal_scale
from projdist.projections import Projection, ProjectionLike
from projdist.regions import Place, PointSet
from projdist.support import check_degrees, check_number, check_numbers

__all__ = ["Ground", "HeightStatistics", "distortion_ppm", "ground_of", "statistics_of"]

_NODES, _SEARCHED = 4000, 400  # points of a region of one height, and about how many a search looks at


def distortion_ppm(projection: ProjectionLike, lon: ArrayLike, lat: ArrayLike, height: ArrayLike) -> FloatArray:
    """How far grid distances are off those on the ground: combined factor - 1, in ppm.

    The scale factor is the geometric mean of the principal scales, which a conformal map has in all directions; the
    combined factor is that times `elevation_factor`.

    Parameters
    ----------
    projection : ProjectionLike
        Whatever `Projection.from_user_input` takes.
    lon, lat : array_like (...)
        Degrees.
    height : array_like (...)
        Ellipsoidal heights in metres. The three are broadcast against each other.

    Returns
    -------
    ndarray (...)
        Parts per million; NaN where the map is undefined.

    Raises
    ------
    ValueError
        For values that are no numbers, and shapes that do not go together.
    ProjectionError
        For a projection that PROJ refuses.

    References
    ----------
    J. E. Stem 1989, State Plane Coordinate System of 1983, NOAA Manual NOS NGS 5: grid and elevation factors.

    Examples
    --------
    UTM's scale on its central meridian is 0.9996; up there it is less:

    >>> distortion_ppm("EPSG:32632", 9, 48, [0, 500]).round(2)
    array([-400.  , -478.33])
    """
    projection = Projection.from_user_input(projection)
    lon, lat = check_degrees(lon, lat)
    lat, height = check_degrees(lat, check_numbers("heights", height))
    lon = np.broadcast_to(lon, lat.shape)
    nodes = nodes_at(lon.ravel(), lat.ravel(), np.ones(lon.size), projection.ellipsoid)
    scale = np.sqrt(areal_scale(nodes.jacobian(projection)[0])).reshape(lon.shape)
    return 1e6 * (scale * elevation_factor(lat, height, projection.ellipsoid) - 1.0)


# ---- points of the ground -------------------------------------------------------------------


class Ground(NamedTuple):
    """Points with weights that sum to 1, and their ellipsoidal heights; `is_level` for a region of one height."""

    nodes: Nodes
    height: FloatArray
    is_level: bool

    def ppm(self, projection: ProjectionLike) -> FloatArray:
        """The distortion at the points."""
        return distortion_ppm(projection, self.nodes.lon, self.nodes.lat, self.height)

    def fewer(self, region: Place) -> Ground:
        """Fewer points of the same kind, or the same where there are few."""
        nodes = self.nodes
        if self.is_level:
            few = nodes_of(region, nodes.ellipsoid, _SEARCHED, edges=True)
            return Ground(few, np.full(few.lon.size, self.height[0]), True)
        step = nodes.lon.size // _SEARCHED
        if step <= 1:
            return self
        lon, lat, weight = (values[::step] for values in (nodes.lon, nodes.lat, nodes.weight))
        return Ground(nodes_at(lon, lat, weight, nodes.ellipsoid), self.height[::step], False)


def ground_of(region: Place, ellipsoid: Ellipsoid, heights: ArrayLike | None, height: float | None) -> Ground:
    """The points (n, 3) of `heights` that lie in a region, the region at one height, or a set of points with its own.

    Raises ValueError.
    """
    if isinstance(region, PointSet) and region.height is not None and heights is None and height is None:
        return Ground(nodes_at(region.lon, region.lat, region.weight, ellipsoid), region.height, False)
    if (heights is None) == (height is None):
        raise ValueError("Invalid heights. There must be either points with heights, or one height.")
    if height is not None:
        height = check_number("height", height)
        if not -500.0 <= height <= 9000.0:
            raise ValueError(f"Invalid height '{height}'. It must lie within -500 and 9000 m.")
        nodes = nodes_of(region, ellipsoid, _NODES, edges=True)
        return Ground(nodes, np.full(nodes.lon.size, float(height)), True)
    points = check_numbers("heights", heights)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise ValueError("Invalid heights. They must be rows of longitude, latitude and height, all finite.")
    points = points[region.contains(points[:, 0], points[:, 1])]
    if not len(points):
        raise ValueError(f"Invalid heights for {region.name}. No point lies in the region.")
    return Ground(nodes_at(points[:, 0], points[:, 1], np.ones(len(points)), ellipsoid), points[:, 2], False)


# ---- statistics -----------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class HeightStatistics:
    """Distortion at heights, in ppm; `within` the share of the points, or of the area, within so many ppm."""

    min: float
    max: float
    mean: float
    std: float
    rms: float
    within: dict[float, float]

    def to_dict(self) -> dict[str, Any]:
        """The fields by name."""
        within = {f"{ppm:g}": share for ppm, share in self.within.items()}
        return {"min": self.min, "max": self.max, "mean": self.mean, "std": self.std, "rms": self.rms, "within": within}


def statistics_of(ppm: FloatArray, weight: FloatArray, limits: Iterable[float]) -> HeightStatistics:
    """Statistics of distortions with weights that sum to 1, and the shares within the limits."""
    mean = float(np.sum(weight * ppm))
    std = float(np.sqrt(np.sum(weight * (ppm - mean) ** 2)))
    rms = float(np.sqrt(np.sum(weight * ppm * ppm)))
    within = {float(limit): float(np.sum(weight[np.abs(ppm) <= limit])) for limit in sorted(set(limits))}
    return HeightStatistics(min=float(ppm.min()), max=float(ppm.max()), mean=mean, std=std, rms=rms, within=within)
