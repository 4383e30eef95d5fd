"""Local corrections: the linear map that a cap about a point would have, from place to place.

About each point the mean distorting transformation T of the Jacobians in a cap is taken. Its rotation is arbitrary; the
correction is the symmetric one, (T T^T)^-1/2, which turns nothing. As the cap shrinks T T^T becomes J J^T, and the
correction undoes the symmetric polar factor of J: what is left of the map there is a rotation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray
from projdist.answer import Answer, plain
from projdist.derivatives import jacobian
from projdist.ellipsoid import MEAN_EARTH_RADIUS
from projdist.linear import Decomposition, decompose
from projdist.mdt import mdt
from projdist.measures import areal_scale
from projdist.projections import Projection
from projdist.sphere import destination

__all__ = ["LocalCorrections", "local_corrections"]

# Nodes of a cap: in azimuth the trapezoidal rule, in the area within a distance Gauss'. On caps of 2000 km of smooth
# maps the corrections are good to 1e-7.
_AZIMUTHS, _RINGS = 12, 5
_ENOUGH = 0.5  # of the cap's area must be on the map
_LARGEST = 10_000.0  # km, nearly half of the globe; one correction is then hardly local


@dataclass(frozen=True)
class LocalCorrections(Answer):
    """The corrections at points, for caps of `radius_km` about them.

    `matrix` (..., 2, 2) is symmetric and positive definite, NaN where less than half of a cap is on
    the map.
    """

    projection: Projection
    radius_km: float
    lon: FloatArray
    lat: FloatArray
    matrix: FloatArray

    @property
    def parts(self) -> Decomposition:
        """Scale, and stretch with its azimuth on the map, of the matrices."""
        return decompose(self.matrix)

    def take(self, keep: BoolArray) -> LocalCorrections:
        """Those that are kept."""
        return LocalCorrections(self.projection, self.radius_km, self.lon[keep], self.lat[keep], self.matrix[keep])

    def to_dict(self) -> dict[str, Any]:
        """`{"projection", "radius_km", "results": [{"lon", "lat", "scale", ..., "matrix"}]}`; undefined is None."""
        columns = self._table()
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        matrices = self.matrix.reshape(-1, 2, 2)
        return {
            "projection": self.projection.definition,
            "radius_km": self.radius_km,
            "results": [
                dict(zip(columns, map(plain, row), strict=True))
                | {"matrix": matrix.tolist() if np.isfinite(matrix).all() else None}
                for row, matrix in zip(rows, matrices, strict=True)
            ],
        }

    def _table(self) -> dict[str, FloatArray]:
        parts = self.parts
        columns = {"lon": self.lon, "lat": self.lat, "scale": parts.scale, "stretch": parts.stretch}
        columns["stretch_azimuth"] = parts.stretch_azimuth
        return {name: np.ravel(values) for name, values in columns.items()}


def local_corrections(projection: Any, lon: ArrayLike, lat: ArrayLike, radius_km: float) -> LocalCorrections:
    """The corrections of a projection over caps about points in degrees.

    The radius is counted as for caps, on the sphere. Raises ProjectionError, and ValueError for a
    radius that is not above 0 and at most 10,000 km.
    """
    if not 0.0 < radius_km <= _LARGEST:
        raise ValueError(f"Invalid radius '{radius_km}'. It must be above 0 and at most {_LARGEST:,.0f} km.")
    projection = Projection.from_user_input(projection)
    lon, lat = np.broadcast_arrays(np.asarray(lon, dtype=float), np.asarray(lat, dtype=float))
    azimuth, distance, share = _cap_nodes(radius_km * 1000.0 / MEAN_EARTH_RADIUS)
    lons, lats = destination(lon.ravel()[:, None], lat.ravel()[:, None], azimuth, distance)
    J = jacobian(projection, lons, lats)
    meridian, vertical = projection.ellipsoid.radii(lats)
    area = share * meridian * vertical
    defined = np.isfinite(J).all(axis=(-1, -2)) & (areal_scale(J) > 0)
    weights = np.where(defined, area, 0.0)
    known = weights.sum(axis=-1) >= _ENOUGH * area.sum(axis=-1)
    matrix = np.full((lon.size, 2, 2), np.nan)
    if known.any():
        T = mdt(np.where(defined[..., None, None], J, np.eye(2))[known], weights[known]).T
        U, scales, _ = np.linalg.svd(T)
        matrix[known] = (U / scales[:, None, :]) @ np.swapaxes(U, 1, 2)
    return LocalCorrections(projection, radius_km, lon, lat, matrix.reshape(*lon.shape, 2, 2))


def _cap_nodes(radius: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Azimuths and distances in degrees, and shares of the area, of the nodes of a cap with a radius in radians."""
    t, gauss = np.polynomial.legendre.leggauss(_RINGS)
    # The area within c is as sin^2(c / 2).
    distance = np.degrees(2.0 * np.arcsin(np.sqrt(0.5 * (1.0 + t)) * np.sin(0.5 * radius)))
    azimuth = 360.0 * np.arange(_AZIMUTHS) / _AZIMUTHS
    azimuth, distance = np.meshgrid(azimuth, distance)
    return azimuth.ravel(), distance.ravel(), np.repeat(0.5 * gauss / _AZIMUTHS, _AZIMUTHS)
