"""Linear corrections of a map: one for a region, and local ones for caps about points.

The best linear map is T^-1, where T is the mean distorting transformation of the projection's Jacobians by true area.
The best one of determinant 1 is T^-1 sqrt(det T), and the best uniform scale 1 / sqrt(det T), because the distortion is
the sum of the squares of the logarithm of the areal scale and of the shape (D. Ozeri, "Riemannian Geometry Approach for
Minimizing Distortion and its Applications"). This minimises the mean square; the geometric median of the Jacobians
minimises the mean, on which the few places of the largest distortion have little influence.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from projdist import earth, matrices, projections, regions, support
from projdist._typing import ArrayLike, BoolArray, FloatArray
from projdist.field import Spread, field_resolving, jacobian, sample

# The matrix is as good as the integrals: near the minimum the cost changes in second order, its gradient in first.
_TOLERANCE = 1e-10
_POOR = 0.1  # relative uncertainty of the distortion from which on no digit of the matrix is certain
_TURNED_OVER = 1e-6  # share of the area that rounding may mirror, as at the antipode of Lambert's azimuthal map
_LEAST_ANGLE, _DIGITS = 1e-7, 7  # in words: smallest angle in degrees, most digits of scales

CORRECTION_CRITERIA = ("mean", "median")
"""What a correction minimises: the mean square of the Fisher distortion (T is the Frechet mean), or its mean."""

CONSTRAINTS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "affine": lambda T: np.asarray(np.linalg.inv(T)),  # any linear map
    "stretch": lambda T: np.asarray(np.linalg.inv(T) * np.sqrt(np.linalg.det(T))),  # determinant 1, keeps areas
    "scale": lambda T: np.eye(2) / np.sqrt(np.linalg.det(T)),  # uniform scales, keep angles
}
"""The linear maps that are allowed, each with the best one for a mean T."""


_FISHER, _FISHER_AFFINE, _FISHER_CORRECTED = (
    support.schema(of={f"fisher_{name}{suffix}": f"{name}.value" for name in Spread._fields}, spread=True)
    for suffix in ("", "_affine", "_corrected")
)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Correction(support.Answer):
    """A projection, the linear map that corrects it, and the corrected map."""

    given: str = field(metadata=support.schema("projection"))
    projection: projections.Projection = field(metadata=support.schema(of=("name", "definition"), spread=True))
    region: regions.Place = field(metadata=support.schema(of=("name", "area_km2")))
    criterion: str
    constraint: str
    keep_north: bool
    coverage: float
    matrix: FloatArray  # (2, 2), by which x, y in metres are multiplied
    corrected: projections.Projection = field(metadata=support.HIDDEN)
    airy_kavrayskiy: float  # of the projection as it is
    airy_kavrayskiy_scaled: float  # after the best uniform scale
    airy_kavrayskiy_affine: float  # after the best linear map
    airy_kavrayskiy_corrected: float  # of the corrected map, measured anew
    error_estimate: float  # bound of the error of all four
    matrix_error: float  # of the logarithms of the matrix's scales
    # The mean and the median of the Fisher distortion by area, with the criterion "median" only.
    spread: Spread | None = field(metadata=_FISHER)
    spread_affine: Spread | None = field(metadata=_FISHER_AFFINE)
    spread_corrected: Spread | None = field(metadata=_FISHER_CORRECTED)
    parts: matrices.Decomposition = field(metadata=support.schema(spread=True))  # of the matrix
    note: str
    parameters: str | None  # the corrected map by the projection's own parameters, if possible
    pipeline: str | None  # as a pipeline of PROJ, if possible
    wkt: str | None  # WKT2, if possible
    wkt_reason: str | None  # why it is not

    @property
    def words(self) -> str:
        """The parts of the matrix in one line, with the digits that are certain."""
        parts = self.parts
        digits = min(max(-math.floor(math.log10(self.matrix_error or 1e-16)), 1), _DIGITS)
        said = [f"scale {parts.scale:.{digits}g}"]
        stretch = f"{parts.stretch:.{digits}g}"
        stretched = np.isfinite(parts.stretch_azimuth) and stretch != "1"
        said.append(f"stretch {stretch} {_direction(float(parts.stretch_azimuth))}" if stretched else "no stretch")
        for name, degrees in (("shear", parts.shear), ("rotation", parts.rotation)):
            said.append(f"{name} {degrees:.5g} degrees" if abs(degrees) > _LEAST_ANGLE else f"no {name}")
        return ", ".join(said)

    def _line(self) -> str:
        figures = f"AK {self.airy_kavrayskiy:.4g} to {self.airy_kavrayskiy_corrected:.4g}"
        by = self.constraint if self.criterion == "mean" else f"{self.constraint} ({self.criterion})"
        return f"{self.projection.name} over {self.region.name}: {figures}, by {by}"

    def _table(self) -> list[dict[str, Any]]:
        """One row, the matrix and the region in columns of their own."""
        row = self.to_dict()
        region, matrix = row.pop("region"), row.pop("matrix")
        entries = dict(zip(("xx", "xy", "yx", "yy"), np.ravel(matrix).tolist(), strict=True))
        return [row | {"region": region["name"]} | entries]


def _direction(azimuth: float) -> str:
    off = min(azimuth, 180.0 - azimuth)
    if off < _LEAST_ANGLE:
        return "along the vertical"
    return "along the horizontal" if 90.0 - off < _LEAST_ANGLE else f"along azimuth {azimuth:.5g} of the map"


def correct(
    projection: projections.ProjectionLike,
    region: regions.RegionLike | None = None,
    *,
    criterion: str = "mean",
    constraint: str = "affine",
    keep_north: bool = True,
    tolerance: float = _TOLERANCE,
) -> Correction:
    """The linear correction that distorts a projection least over a region, and the corrected map.

    Parameters
    ----------
    projection : ProjectionLike
    region : RegionLike, optional
        Anything that `get_region` takes; by default the area of use of a CRS, or the globe for other projections.
    criterion : {"mean", "median"}, default "mean"
        "mean" minimises the mean square of the Fisher distortion, the Airy-Kavrayskiy error; "median" its mean, by the
        geometric median of the Jacobians, good to 1e-5 to 1e-4: less in the better half, more in the worst places.
    constraint : {"affine", "stretch", "scale"}, default "affine"
        "affine" allows any linear map, "stretch" those of determinant 1 (an equal-area map stays equal-area at its
        scale), "scale" uniform scales. With the median only "affine"; it leaves conformal maps conformal and
        equal-area maps equal-area.
    keep_north : bool, default True
        Whether vertical directions on the map stay vertical; else the map is turned so that north is up on average.
    tolerance : float, default 1e-10
        Largest error of the integrals.

    Returns
    -------
    Correction
        The `matrix` (2, 2) by which x, y in metres are multiplied, the map `corrected`, the errors of both, and the
        corrected map as parameters, PROJ pipeline and WKT2, if they exist.

    Raises
    ------
    ProjectionError, ValueError
        For an unknown projection, if no point can be projected, and without `keep_north` if the map mirrors a part; for
        an unknown region, criterion or constraint, another constraint than "affine" with the median, a `keep_north`
        that is neither True nor False, or a tolerance that is not positive.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the matrix is the inverse of
    the mean distorting transformation.
    Fletcher, Venkatasubramanian & Joshi 2009, The geometric median on Riemannian manifolds, NeuroImage 45.

    Examples
    --------
    The correction of the plate carree shrinks x by 2 / e.

    >>> found = correct("plate-carree")
    >>> found.words
    'scale 0.8577639, stretch 1.359141 along the vertical, no shear, no rotation'
    >>> round(float(found.matrix[0, 0]), 7)
    0.7357589

    The median is 2 / sqrt(3), the scale at 30 degrees, as half of the globe lies nearer to the equator.

    >>> round(float(correct("plate-carree", criterion="median").matrix[0, 0]), 3)
    0.866
    """
    support.check_choice("criterion of a correction", criterion, CORRECTION_CRITERIA)
    support.check_choice("constraint", constraint, CONSTRAINTS)
    if criterion == "median" and constraint != "affine":
        raise ValueError(f"Invalid constraint '{constraint}' with the median. It must be affine.")
    support.check_bool("keep_north", keep_north)
    given = projection if isinstance(projection, str) else None
    projection = projections.Projection.from_user_input(projection)
    place = regions.region_for(region, [projection])
    before = sample(projection, place, tolerance=tolerance)
    AK, notes, field = before.airy_kavrayskiy, [], None
    T, matrix_error = AK.mdt, AK.error
    if before.mirrored > _TURNED_OVER:
        notes.append(f"The map mirrors {100.0 * before.mirrored:.4g} % of the region; no distortion sees that.")
    if criterion == "median":
        field = sample(projection, place)
        T, matrix_error, unique = field.geometric_median
        if not unique:
            notes.append("There are other medians that are as good; this one lies in their middle.")
    matrix = CONSTRAINTS[constraint](T)
    if not keep_north:
        rotation = _rotation(projection, place, T, tolerance)
        matrix = rotation.q @ matrix
        notes.append(rotation.note)
    matrix = _without_noise(matrix, max(tolerance, AK.error, matrix_error))
    name = f"{projection.name}, corrected"
    corrected = projections.compose(projection, matrix, name)
    after = sample(corrected, place, tolerance=tolerance).airy_kavrayskiy
    error = max(AK.error, after.error)
    if error > _POOR * AK.raw:
        notes.append("The errors are hardly known, and neither is the matrix.")
    matrix.setflags(write=False)
    base, total = projections.uncomposed(projection, matrix)
    wkt, reason = projections.wkt_of(base, total, name)
    return Correction(
        projection=projection,
        given=given or projection.label,
        region=place,
        criterion=criterion,
        constraint=constraint,
        keep_north=keep_north,
        coverage=before.coverage,
        matrix=matrix,
        parts=matrices.decompose(matrix),
        corrected=corrected,
        airy_kavrayskiy=AK.raw,
        airy_kavrayskiy_scaled=AK.scaled,
        airy_kavrayskiy_affine=AK.affine,
        airy_kavrayskiy_corrected=after.raw,
        error_estimate=error,
        matrix_error=error if field is None else matrix_error,
        spread=None if field is None else field.spread(),
        spread_affine=None if field is None else field.spread(AK.mdt),
        spread_corrected=None if field is None else field.spread(np.linalg.inv(matrix)),
        note=" ".join(filter(None, notes)),
        parameters=projections.parameters_of(base, total),
        pipeline=projections.pipeline_of(base, total),
        wkt=wkt,
        wkt_reason=reason,
    )


def _without_noise(matrix: FloatArray, noise: float) -> FloatArray:
    """The matrix without rotation, shear or stretch below the noise, so that simple maps stay simple."""
    scale = float(np.sqrt(matrices.areal_scale(matrix)))
    cleaned = np.where(np.abs(matrix) > noise * scale, matrix, 0.0)
    return scale * np.eye(2) if np.abs(cleaned - scale * np.eye(2)).max() <= noise * scale else cleaned


def _rotation(
    projection: projections.Projection, region: regions.Place, T: FloatArray, tolerance: float
) -> matrices.Rotation:
    """The rotation after which the corrected map's mean orientation is north."""
    field = field_resolving(projection, region, tolerance=tolerance)
    side = matrices.orientation(field.jacobian)
    # Mirrored maps get their east reversed, so that their north gives the orientation.
    common = 1.0 if np.sum(field.weight * np.nan_to_num(side)) > 0 else -1.0
    defined = side == common
    if field.weight[side == -common].sum() > _TURNED_OVER * field.weight.sum():
        raise projections.ProjectionError(
            f"Invalid projection '{projection.label}' for a free rotation. It mirrors a part of the region, so that "
            "it has no mean orientation; keep north."
        )
    return matrices.field_rotation(field.jacobian[defined] * [common, 1.0], field.weight[defined], T)


# ---- local corrections ---------------------------------------------------------------------------

# About each point the mean distorting transformation T of the Jacobians in a cap is taken. Because its rotation is
# arbitrary, the correction is the symmetric (T T^T)^-1/2, which turns nothing. As the cap shrinks, T T^T becomes J J^T,
# and the correction undoes the symmetric polar factor of J, so that only a rotation is left.

# Nodes of a cap: the trapezoidal rule in azimuth, Gauss' rule in the area within a distance. On caps of 2000 km of
# smooth maps the corrections are good to 1e-6; on caps with a pole line, a seam or an edge to a few per cent.
_AZIMUTHS, _RINGS = 12, 5
_NODES, _GAUSS = np.polynomial.legendre.leggauss(_RINGS)
# Poorer rules, as weights relative to the whole one: half of the azimuths, the other half, and three rings, the first,
# the middle and the last node at -t, 0 and t with the weights that are exact for parabolas.
_EVEN = np.tile(np.arange(_AZIMUTHS) % 2 == 0, _RINGS)
_OUTER = 1.0 / (3.0 * _NODES[-1] ** 2)
_THREE = np.array([_OUTER, 0.0, 2.0 - 2.0 * _OUTER, 0.0, _OUTER]) / _GAUSS
_POORER = np.stack([_EVEN, ~_EVEN, np.repeat(_THREE, _AZIMUTHS)])
_ENOUGH = 0.5  # share of a cap's area that must be on the map
_LARGEST = 10_000.0  # km, nearly half of the globe: a larger correction is hardly local


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class LocalCorrections(support.Answer):
    """Corrections at points, for caps of `radius_km` about them; NaN where less than half of a cap is on the map."""

    projection: projections.Projection = field(
        metadata=support.schema(of={"projection": "label", "name": "name", "definition": "definition"}, spread=True)
    )
    radius_km: float
    lon: FloatArray = field(metadata=support.COLUMN)
    lat: FloatArray = field(metadata=support.COLUMN)
    parts: matrices.Decomposition = field(
        metadata=support.schema(of=("scale", "stretch", "stretch_azimuth"), column=True, spread=True)
    )
    error: FloatArray = field(metadata=support.COLUMN)  # estimate of the relative error, by the change with fewer nodes
    matrix: FloatArray = field(metadata=support.HIDDEN)  # (..., 2, 2), symmetric and positive definite

    def take(self, keep: BoolArray) -> LocalCorrections:
        """The corrections at some of the points."""
        taken = {name: getattr(self, name)[keep] for name in ("lon", "lat", "matrix", "error")}
        return replace(self, **taken, parts=matrices.decompose(taken["matrix"]))

    def _line(self) -> str:
        return f"{self.projection.name}: {self.lon.size} caps of {self.radius_km:g} km"

    def to_dict(self) -> dict[str, Any]:
        """`{"projection", "name", "definition", "radius_km", "results": [{"lon", "lat", "scale", ..., "matrix"}]}`."""
        found = super().to_dict()
        for row, matrix in zip(found["results"], self.matrix.reshape(-1, 2, 2), strict=True):
            row["matrix"] = matrix.tolist() if np.isfinite(matrix).all() else None
        return found


def local_corrections(
    projection: projections.ProjectionLike, lon: ArrayLike, lat: ArrayLike, radius_km: float
) -> LocalCorrections:
    """The corrections of a projection over caps about points in degrees.

    Parameters
    ----------
    projection : ProjectionLike
    lon, lat : array_like (...)
        Centres of the caps in degrees, of shapes that broadcast.
    radius_km : float
        Radius of the caps in km, above 0 and at most 10,000, measured as for `Cap`.

    Returns
    -------
    LocalCorrections
        Its `matrix` (..., 2, 2) is the symmetric (T T^T)^-1/2, which turns nothing, T the cap's mean distorting
        transformation; NaN where less than half of a cap is on the map. `error` (...) is its relative error.

    Raises
    ------
    ProjectionError, ValueError
        For an unknown projection; for a radius not above 0 and at most 10,000 km, or shapes that do not broadcast.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the MDT.

    Examples
    --------
    At 60 degrees north the plate carree is twice too wide. The correction of a small cap is the inverse of the stretch.

    >>> local_corrections("plate-carree", 0, 60, radius_km=1).matrix.round(6)
    array([[0.5, 0. ],
           [0. , 1. ]])
    """
    radius_km = support.check_number("radius", radius_km)
    if not 0.0 < radius_km <= _LARGEST:
        raise ValueError(f"Invalid radius '{radius_km}'. It must be above 0 and at most {_LARGEST:,.0f} km.")
    projection = projections.Projection.from_user_input(projection)
    lon, lat = support.check_degrees(lon, lat)
    lons, lats, share = _cap_nodes(projection.ellipsoid.ground, lon.ravel(), lat.ravel(), radius_km)
    J = jacobian(projection, lons, lats)
    meridian, vertical = projection.ellipsoid.radii(lats)
    area = share * meridian * vertical
    defined = np.isfinite(J).all(axis=(-1, -2)) & (matrices.areal_scale(J) > 0)
    weights = np.where(defined, area, 0.0)
    known = (weights.sum(axis=-1) >= _ENOUGH * area.sum(axis=-1)) & (np.abs(lat.ravel()) <= 90.0)
    matrix, error = np.full((lon.size, 2, 2), np.nan), np.full(lon.size, np.nan)
    if known.any():
        J, weights = np.where(defined[..., None, None], J, np.eye(2))[known], weights[known]
        T = matrices.mdt(J, weights).T
        U, scales, _ = np.linalg.svd(T)
        matrix[known] = (U / scales[:, None, :]) @ np.swapaxes(U, 1, 2)
        error[known] = _change(T, J, weights)
    matrix = matrix.reshape(*lon.shape, 2, 2)
    parts, places = matrices.decompose(matrix), {"lon": lon.copy(), "lat": lat.copy()}
    return LocalCorrections(
        projection=projection, radius_km=radius_km, **places, matrix=matrix, parts=parts, error=error.reshape(lon.shape)
    )


def _change(T: FloatArray, J: FloatArray, weights: FloatArray) -> FloatArray:
    """The largest distance of each T from those by poorer rules; infinite where one has no node on the map."""
    change = np.zeros(len(T))
    for rule in _POORER:
        part = weights * rule
        some = part.sum(axis=-1) > 0
        other = matrices.mdt(J[some], part[some]).T
        change[some] = np.maximum(change[some], 0.5 * matrices.factor_distance(T[some], other))
        change[~some] = np.inf
    return change


def _cap_nodes(
    ellipsoid: earth.Ellipsoid, lon: FloatArray, lat: FloatArray, radius_km: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Longitudes, latitudes and weights (n, nodes) of nodes of caps about places (n,), as on a sphere."""
    azimuth = 360.0 * np.arange(_AZIMUTHS) / _AZIMUTHS
    # Caps are symmetric about their meridian.
    half = regions.reaches(ellipsoid, lon[:, None], lat[:, None], azimuth[: _AZIMUTHS // 2 + 1], 1000.0 * radius_km)
    sine = np.sin(np.radians(0.5 * np.hstack([half, half[:, -2:0:-1]])))[:, None, :]
    # The area within c is as sin^2(c / 2).
    distance = np.degrees(2.0 * np.arcsin(np.sqrt(0.5 * (1.0 + _NODES))[:, None] * sine))
    lons, lats = earth.destination(lon[:, None, None], lat[:, None, None], azimuth, distance)
    share = 0.5 * _GAUSS[:, None] / _AZIMUTHS * np.square(sine / sine.max(initial=0.0))
    shape = lon.size, _NODES.size * _AZIMUTHS
    return lons.reshape(shape), lats.reshape(shape), share.reshape(shape)
