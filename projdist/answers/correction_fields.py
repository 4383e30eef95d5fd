"""Local corrections: the linear map that a cap about a point would have, from place to place.

About each point the mean distorting transformation T of the Jacobians in a cap is taken. Its rotation is arbitrary; the
correction is the symmetric one, (T T^T)^-1/2, which turns nothing. As the cap shrinks T T^T becomes J J^T, and the
correction undoes the symmetric polar factor of J: what is left of the map there is a rotation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray
from projdist.earth import Ellipsoid, destination
from projdist.field import jacobian
from projdist.matrices import Decomposition, areal_scale, decompose, factor_distance, mdt
from projdist.projections import Projection, ProjectionLike
from projdist.regions import reaches
from projdist.support import Answer, check_degrees, check_number, plain

# Nodes of a cap: in azimuth the trapezoidal rule, in the area within a distance Gauss'. On caps of 2000 km of smooth
# maps the corrections are good to 1e-6; on caps that hold a pole line, a seam or an edge to a few per cent.
_AZIMUTHS, _RINGS = 12, 5
_NODES, _GAUSS = np.polynomial.legendre.leggauss(_RINGS)


def _poorer_rules() -> FloatArray:
    """The weights of poorer rules over those of the whole one: half of the azimuths, the other half, three rings."""
    even = np.tile(np.arange(_AZIMUTHS) % 2 == 0, _RINGS)
    # Of the first, the middle and the last node, at -t, 0 and t, the weights that are exact for parabolas.
    outer = 1.0 / (3.0 * _NODES[-1] ** 2)
    rings = np.array([outer, 0.0, 2.0 - 2.0 * outer, 0.0, outer]) / _GAUSS
    return np.stack([even, ~even, np.repeat(rings, _AZIMUTHS)])


_POORER = _poorer_rules()
_ENOUGH = 0.5  # of the cap's area must be on the map
_LARGEST = 10_000.0  # km, nearly half of the globe; one correction is then hardly local


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class LocalCorrections(Answer):
    """The corrections at points, for caps of `radius_km` about them.

    `matrix` (..., 2, 2) is symmetric and positive definite, NaN where less than half of a cap is on
    the map. `error` (...) estimates its relative error, by how much it changes with fewer nodes.
    """

    projection: Projection
    radius_km: float
    lon: FloatArray
    lat: FloatArray
    matrix: FloatArray
    error: FloatArray

    @property
    def parts(self) -> Decomposition:
        """Scale, and stretch with its azimuth on the map, of the matrices."""
        return decompose(self.matrix)

    def take(self, keep: BoolArray) -> LocalCorrections:
        """Those that are kept."""
        return replace(
            self,
            lon=self.lon[keep],
            lat=self.lat[keep],
            matrix=self.matrix[keep],
            error=self.error[keep],
        )

    def _line(self) -> str:
        return f"{self.projection.name}: {self.lon.size} caps of {self.radius_km:g} km"

    def to_dict(self) -> dict[str, Any]:
        """`{"projection", "name", "definition", "radius_km", "results": [{"lon", "lat", "scale", ..., "matrix"}]}`."""
        columns = self._table()
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        matrices = self.matrix.reshape(-1, 2, 2)
        return {
            "projection": self.projection.label,
            "name": self.projection.name,
            "definition": self.projection.definition,
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
        columns |= {"stretch_azimuth": parts.stretch_azimuth, "error": self.error}
        return {name: np.ravel(values) for name, values in columns.items()}


def local_corrections(projection: ProjectionLike, lon: ArrayLike, lat: ArrayLike, radius_km: float) -> LocalCorrections:
    """The corrections of a projection over caps about points in degrees.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    lon, lat : array_like (...)
        The middles of the caps in degrees, of shapes that broadcast.
    radius_km : float
        The radius of the caps in km, above 0 and at most 10,000. It is counted as for caps, on the sphere.

    Returns
    -------
    LocalCorrections
        Its `matrix` (..., 2, 2) is the symmetric one, (T T^T)^-1/2 with T the mean distorting transformation of the
        cap, which turns nothing. It is NaN where less than half of a cap is on the map. `error` (...) estimates its
        relative error.

    Raises
    ------
    ProjectionError
        For what is no projection.
    ValueError
        For a radius that is not above 0 and at most 10,000 km, and shapes that do not broadcast.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the mean distorting
    transformation.

    Examples
    --------
    At 60 degrees north the plate carree is twice too wide. A small cap has the inverse of the Jacobian's stretch.

    >>> local_corrections("plate-carree", 0, 60, radius_km=1).matrix.round(6)
    array([[0.5, 0. ],
           [0. , 1. ]])
    """
    radius_km = check_number("radius", radius_km)
    if not 0.0 < radius_km <= _LARGEST:
        raise ValueError(f"Invalid radius '{radius_km}'. It must be above 0 and at most {_LARGEST:,.0f} km.")
    projection = Projection.from_user_input(projection)
    lon, lat = check_degrees(lon, lat)
    lons, lats, share = _cap_nodes(projection.ellipsoid.ground, lon.ravel(), lat.ravel(), radius_km)
    J = jacobian(projection, lons, lats)
    meridian, vertical = projection.ellipsoid.radii(lats)
    area = share * meridian * vertical
    defined = np.isfinite(J).all(axis=(-1, -2)) & (areal_scale(J) > 0)
    weights = np.where(defined, area, 0.0)
    known = (weights.sum(axis=-1) >= _ENOUGH * area.sum(axis=-1)) & (np.abs(lat.ravel()) <= 90.0)
    matrix, error = np.full((lon.size, 2, 2), np.nan), np.full(lon.size, np.nan)
    if known.any():
        J, weights = np.where(defined[..., None, None], J, np.eye(2))[known], weights[known]
        T = mdt(J, weights).T
        matrix[known] = _symmetric_inverse(T)
        error[known] = _change(T, J, weights)
    shape = lon.shape
    return LocalCorrections(
        projection=projection,
        radius_km=radius_km,
        lon=lon,
        lat=lat,
        matrix=matrix.reshape(*shape, 2, 2),
        error=error.reshape(shape),
    )


def _symmetric_inverse(T: FloatArray) -> FloatArray:
    """(T T^T)^-1/2."""
    U, scales, _ = np.linalg.svd(T)
    return np.asarray((U / scales[:, None, :]) @ np.swapaxes(U, 1, 2))


def _change(T: FloatArray, J: FloatArray, weights: FloatArray) -> FloatArray:
    """The largest distance of each T from those of the poorer rules; infinite where one has no node on the map."""
    change = np.zeros(len(T))
    for rule in _POORER:
        part = weights * rule
        some = part.sum(axis=-1) > 0
        change[some] = np.maximum(change[some], 0.5 * factor_distance(T[some], mdt(J[some], part[some]).T))
        change[~some] = np.inf
    return change


def _cap_nodes(
    ellipsoid: Ellipsoid, lon: FloatArray, lat: FloatArray, radius_km: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Longitudes, latitudes and weights (n, nodes) of the nodes of caps about places (n,).

    The weights are those of areas on a sphere that has the latitudes.
    """
    azimuth = 360.0 * np.arange(_AZIMUTHS) / _AZIMUTHS
    # Caps are the same on both sides of their meridian.
    half = reaches(ellipsoid, lon[:, None], lat[:, None], azimuth[: _AZIMUTHS // 2 + 1], 1000.0 * radius_km)
    sine = np.sin(np.radians(0.5 * np.hstack([half, half[:, -2:0:-1]])))[:, None, :]
    # The area within c is as sin^2(c / 2).
    distance = np.degrees(2.0 * np.arcsin(np.sqrt(0.5 * (1.0 + _NODES))[:, None] * sine))
    lons, lats = destination(lon[:, None, None], lat[:, None, None], azimuth, distance)
    share = 0.5 * _GAUSS[:, None] / _AZIMUTHS * np.square(sine / sine.max(initial=0.0))
    shape = lon.size, _NODES.size * _AZIMUTHS
    return lons.reshape(shape), lats.reshape(shape), share.reshape(shape)
