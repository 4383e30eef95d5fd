"""A map over a region as a value: polynomials on panels, which cost matrix products instead of calls of the map."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray
from projdist.field.at_points import FAST_TARGET, Derivatives, Quality, derivatives, flag_lost_digits
from projdist.field.chebyshev_panels import Panels, evaluate_points, interpolate_points, panels_over
from projdist.projections import Projection, ProjectionLike
from projdist.regions import RegionLike, region_for
from projdist.support import check_degrees

_HELD_OUT = np.array([[-0.83, 0.31], [0.13, -0.71], [0.57, 0.89]])  # of a panel, where no node is
_APART = 1e-11  # of J


@dataclass(frozen=True)
class Interpolant:
    """A map, and its polynomials on panels over the bounds of a region; without any where there is no smooth place."""

    projection: Projection
    panels: Panels | None

    def __call__(self, lon: ArrayLike, lat: ArrayLike) -> Derivatives:
        """Coordinates, Jacobian, quality and error at points (...) in degrees, as `derivatives` has them.

        Where there is a polynomial they are its own, and the map is not called.
        """
        lon, lat = check_degrees(lon, lat)
        shape, lon, lat = lon.shape, lon.ravel(), lat.ravel()
        x, y, error = np.full((3, lon.size), np.nan)
        J = np.empty((lon.size, 2, 2))
        quality = np.full(lon.size, Quality.OK, dtype=np.int8)
        found: BoolArray = np.zeros(lon.size, dtype=bool)
        if self.panels is not None:
            found = interpolate_points(self.panels, lon, lat, (x, y), J, error)
            found &= error <= FAST_TARGET
        rest = np.flatnonzero(~found)
        if rest.size:
            other = derivatives(self.projection, lon[rest], lat[rest])
            x[rest], y[rest], J[rest] = other.x, other.y, other.jacobian
            quality[rest], error[rest] = other.quality, other.error
        flag_lost_digits(J, error, quality)
        return Derivatives(
            x.reshape(shape), y.reshape(shape), J.reshape(*shape, 2, 2), quality.reshape(shape), error.reshape(shape)
        )


def interpolant(projection: ProjectionLike, region: RegionLike | None = None) -> Interpolant:
    """A piecewise polynomial of a map over the bounds of a region, with J as its derivative.

    A panel is taken where its Chebyshev coefficients have died away and three points between its nodes have the map's
    x and y, to rounding, and J. What is smaller than a panel, 2.5 to 360 degrees wide, and on none of these, is not
    seen; `derivatives` looks at each of its points.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    region : RegionLike, optional
        Anything that names a region; by default the map's area of use, else the globe.

    Returns
    -------
    Interpolant
        A function of longitudes and latitudes (...) in degrees that returns `Derivatives`; elsewhere, and where the map
        is not smooth, those of the map.

    Raises
    ------
    ProjectionError
        For what is no projection.
    ValueError
        For what is no region.

    References
    ----------
    A. Townsend & L. N. Trefethen 2013, An extension of Chebfun to two dimensions, SIAM Journal on Scientific Computing
    35:C495: the coefficients that tell whether a function is resolved.

    Examples
    --------
    On a sphere Mercator's scale is 1 / cos(lat).

    >>> mercator = interpolant("mercator", (0, 50, 20, 70))
    >>> round(float(mercator(10, 60).jacobian[0, 0]), 9)
    2.0
    """
    projection = Projection.from_user_input(projection)
    west, south, east, north = region_for(region, [projection]).bounds
    panels = panels_over(projection, (float(west), float(south), float(east), float(north)))
    return Interpolant(projection, None if panels is None else _held(panels))


def _held(panels: Panels) -> Panels:
    """The panels that agree with the map at places between their nodes; the others are struck from the index."""
    lon, lat = (panels.centre[:, None] + panels.half[:, None] * _HELD_OUT).reshape(-1, 2).T
    truth = derivatives(panels.projection, lon, lat)
    J, error = np.empty((lon.size, 2, 2)), np.full(lon.size, np.nan)
    found, _, _ = evaluate_points(panels, lon, lat, (truth.x, truth.y), J, error)
    size: FloatArray = np.abs(truth.jacobian).sum(axis=(1, 2))
    close = np.abs(J - truth.jacobian).sum(axis=(1, 2)) <= (_APART + 10.0 * (error + truth.error)) * size
    agree = found & (close | (truth.quality != Quality.OK))
    good = np.append(agree.reshape(-1, len(_HELD_OUT)).all(axis=1), False)
    return replace(panels, index=np.where(good[panels.index], panels.index, -1))
