"""Corrected maps: a projection times the linear map that lessens its distortion over a region most.

The best linear map is T^-1, T the mean distorting transformation of the projection's Jacobians by true area. Of
determinant 1 the best one is T^-1 sqrt(det T), and of uniform scales 1 / sqrt(det T), because the logarithm of the
areal scale and the shape add their squares to the distortion (D. Ozeri, "Riemannian Geometry Approach for Minimizing
Distortion and its Applications"). That is the linear map of the least mean square; the geometric median of the
Jacobians is that of the least mean, which the few places that are distorted most move little.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.answers.summaries import Summary, summary_of
from projdist.field import Spread, field_resolving, sample
from projdist.matrices import Decomposition, Rotation, areal_scale, decompose, field_rotation, orientation
from projdist.projections import (
    Projection,
    ProjectionError,
    ProjectionLike,
    compose,
    parameters_of,
    pipeline_of,
    uncomposed,
    wkt_of,
)
from projdist.regions import Place, RegionLike, region_for
from projdist.support import Answer, check_bool, check_choice, plain

# The matrix is as good as the integrals are: the cost has no first order about it, but its gradient has.
_TOLERANCE = 1e-10
_POOR = 0.1  # of an error: an estimate as large leaves no digit of the matrix
_TURNED_OVER = 1e-6  # share of the area that may be mirrored by rounding, as Lambert's azimuthal map is at its antipode


_LEAST_ANGLE, _DIGITS = 1e-7, 7  # degrees; of scales


def _affine(T: FloatArray) -> FloatArray:
    """Any linear map: the least Airy-Kavrayskiy error."""
    return np.asarray(np.linalg.inv(T))


def _stretch(T: FloatArray) -> FloatArray:
    """Linear maps of determinant 1, which keep areas."""
    return np.asarray(np.linalg.inv(T) * np.sqrt(np.linalg.det(T)))


def _scale(T: FloatArray) -> FloatArray:
    """Uniform scales, which keep angles."""
    return np.eye(2) / np.sqrt(np.linalg.det(T))


CORRECTION_CRITERIA = ("mean", "median")
"""What a correction makes least: the mean square of the Fisher distortion (T is the Frechet mean), or its mean."""

CONSTRAINTS: dict[str, Callable[[FloatArray], FloatArray]] = {"affine": _affine, "stretch": _stretch, "scale": _scale}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Correction(Answer):
    """A projection, the linear map that corrects it, and the map that comes of it.

    `matrix` (2, 2) is what x, y in metres are multiplied with. The Airy-Kavrayskiy errors are those of
    the projection as it is, after the best uniform scale, after the best linear map, and that of
    `corrected`, measured anew; `error_estimate` bounds the error of all four. `parameters` is the
    corrected map by the projection's own parameters, `pipeline` its PROJ pipeline, `wkt` its WKT2;
    each is None where there is none, and `wkt_reason` tells why. `matrix_error` is by how much the logarithms of the
    matrix's scales may be wrong. With the criterion "median" the three of `spread`, else None, have the mean Fisher
    distortion by area, and what half of the area is below: as the projection is, after the best linear map (the MDT),
    and corrected.
    """

    projection: Projection
    given: str
    region: Place
    criterion: str
    constraint: str
    keep_north: bool
    coverage: float
    matrix: FloatArray = field(compare=False)
    corrected: Projection
    airy_kavrayskiy: float
    airy_kavrayskiy_scaled: float
    airy_kavrayskiy_affine: float
    airy_kavrayskiy_corrected: float
    error_estimate: float
    matrix_error: float
    spread: Spread | None
    spread_affine: Spread | None
    spread_corrected: Spread | None
    note: str
    parameters: str | None
    pipeline: str | None
    wkt: str | None
    wkt_reason: str | None

    @property
    def parts(self) -> Decomposition:
        """Scale, stretch and its azimuth on the map, shear and rotation of the matrix."""
        return decompose(self.matrix)

    @property
    def words(self) -> str:
        """What the matrix does, in one line, with no more digits than are known."""
        parts = self.parts
        digits = min(max(-math.floor(math.log10(self.matrix_error or 1e-16)), 1), _DIGITS)
        said = [f"scale {parts.scale:.{digits}g}"]
        stretch = f"{parts.stretch:.{digits}g}"
        if np.isfinite(parts.stretch_azimuth) and stretch != "1":
            said.append(f"stretch {stretch} {_direction(float(parts.stretch_azimuth))}")
        else:
            said.append("no stretch")
        for name, degrees in (("shear", parts.shear), ("rotation", parts.rotation)):
            said.append(f"{name} {degrees:.5g} degrees" if abs(degrees) > _LEAST_ANGLE else f"no {name}")
        return ", ".join(said)

    def _line(self) -> str:
        figures = f"AK {self.airy_kavrayskiy:.4g} to {self.airy_kavrayskiy_corrected:.4g}"
        by = self.constraint if self.criterion == "mean" else f"{self.constraint} ({self.criterion})"
        return f"{self.projection.name} over {self.region.name}: {figures}, by {by}"

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON; what is undefined is None."""
        return {
            "projection": self.given,
            "name": self.projection.name,
            "definition": self.projection.definition,
            "region": {"name": self.region.name, "area_km2": self.region.area_km2},
            "criterion": self.criterion,
            "constraint": self.constraint,
            "keep_north": self.keep_north,
            "coverage": self.coverage,
            "matrix": self.matrix.tolist(),
            "airy_kavrayskiy": plain(self.airy_kavrayskiy),
            "airy_kavrayskiy_scaled": plain(self.airy_kavrayskiy_scaled),
            "airy_kavrayskiy_affine": plain(self.airy_kavrayskiy_affine),
            "airy_kavrayskiy_corrected": plain(self.airy_kavrayskiy_corrected),
            "error_estimate": plain(self.error_estimate),
            "matrix_error": plain(self.matrix_error),
            **self._spreads(),
            **{name: plain(float(value)) for name, value in self.parts._asdict().items()},
            "note": self.note,
            "parameters": self.parameters,
            "pipeline": self.pipeline,
            "wkt": self.wkt,
            "wkt_reason": self.wkt_reason,
        }

    def _spreads(self) -> dict[str, float | None]:
        """Mean and median Fisher distortions by name, None where they were not asked for."""
        spreads = {"": self.spread, "_affine": self.spread_affine, "_corrected": self.spread_corrected}
        return {
            f"fisher_{name}{suffix}": None if spread is None else plain(getattr(spread, name).value)
            for suffix, spread in spreads.items()
            for name in Spread._fields
        }

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
    projection: ProjectionLike,
    region: RegionLike | None = None,
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
        Anything that `Projection.from_user_input` takes.
    region : RegionLike, optional
        Anything that `get_region` takes. Without one it is the area of use of a CRS, and the globe for other
        projections.
    criterion : {"mean", "median"}, default "mean"
        "mean": the least mean square of the Fisher distortion, which is the Airy-Kavrayskiy error; "median": its least
        mean, by the geometric median of the Jacobians, good to 1e-5 to 1e-4. Half of the area then mostly has less,
        and the places that are distorted most, as those about poles, have more.
    constraint : {"affine", "stretch", "scale"}, default "affine"
        "affine" allows any linear map, "stretch" those of determinant 1 (an equal-area map stays equal-area at its
        scale), "scale" uniform scales. With the median "affine" alone; it leaves conformal maps conformal and
        equal-area maps equal-area.
    keep_north : bool, default True
        Whether what is vertical on the map stays vertical; else the map is turned so that north is up on average.
    tolerance : float, default 1e-10
        That of the integrals.

    Returns
    -------
    Correction
        The `matrix` (2, 2) that x, y in metres are multiplied with, the map `corrected`, the errors of both, and the
        corrected map as parameters, PROJ pipeline and WKT2, where there are such.

    Raises
    ------
    ProjectionError
        For what is no projection, where no point of the region can be projected, and without `keep_north` for a map
        that mirrors a part of the region.
    ValueError
        For an unknown region, criterion or constraint, another constraint than "affine" with the median, a `keep_north`
        that is neither True nor False, and a tolerance that is not positive.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the matrix is the inverse of
    the mean distorting transformation.
    Fletcher, Venkatasubramanian & Joshi 2009, The geometric median on Riemannian manifolds, NeuroImage 45.

    Examples
    --------
    Of the plate carree x shrinks by 2 / e.

    >>> found = correct("plate-carree")
    >>> found.words
    'scale 0.8577639, stretch 1.359141 along the vertical, no shear, no rotation'
    >>> round(float(found.matrix[0, 0]), 7)
    0.7357589

    The median is 2 / sqrt(3), the scale at 30 degrees, as half of the globe lies nearer to the equator.

    >>> round(float(correct("plate-carree", criterion="median").matrix[0, 0]), 3)
    0.866
    """
    check_choice("criterion of a correction", criterion, CORRECTION_CRITERIA)
    check_choice("constraint", constraint, CONSTRAINTS)
    if criterion == "median" and constraint != "affine":
        raise ValueError(f"Invalid constraint '{constraint}' with the median. It must be affine.")
    check_bool("keep_north", keep_north)
    given = projection if isinstance(projection, str) else None
    projection = Projection.from_user_input(projection)
    place = region_for(region, [projection])
    before = summary_of(projection, place, tolerance=tolerance)
    T, matrix_error, notes = before.mdt, before.error_estimate, [_orientation(before)]
    field = None
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
    matrix = _without_noise(matrix, max(tolerance, before.error_estimate, matrix_error))
    name = f"{projection.name}, corrected"
    corrected = compose(projection, matrix, name)
    after = summary_of(corrected, place, tolerance=tolerance)
    error = max(before.error_estimate, after.error_estimate)
    if error > _POOR * before.airy_kavrayskiy:
        notes.append("The errors are hardly known, and neither is the matrix.")
    matrix.setflags(write=False)
    base, total = uncomposed(projection, matrix)
    wkt, reason = wkt_of(base, total, name)
    return Correction(
        projection=projection,
        given=given or projection.label,
        region=place,
        criterion=criterion,
        constraint=constraint,
        keep_north=keep_north,
        coverage=before.coverage,
        matrix=matrix,
        corrected=corrected,
        airy_kavrayskiy=before.airy_kavrayskiy,
        airy_kavrayskiy_scaled=before.airy_kavrayskiy_scaled,
        airy_kavrayskiy_affine=before.airy_kavrayskiy_affine,
        airy_kavrayskiy_corrected=after.airy_kavrayskiy,
        error_estimate=error,
        matrix_error=error if field is None else matrix_error,
        spread=None if field is None else field.spread(),
        spread_affine=None if field is None else field.spread(before.mdt),
        spread_corrected=None if field is None else field.spread(np.linalg.inv(matrix)),
        note=" ".join(filter(None, notes)),
        parameters=parameters_of(base, total),
        pipeline=pipeline_of(base, total),
        wkt=wkt,
        wkt_reason=reason,
    )


def _orientation(before: Summary) -> str:
    """What is to be said of a map that mirrors."""
    if before.mirrored <= _TURNED_OVER:
        return ""
    return f"The map mirrors {100.0 * before.mirrored:.4g} % of the region; no distortion sees that."


def _without_noise(matrix: FloatArray, noise: float) -> FloatArray:
    """The matrix without turn, shear or stretch that are not known to be there: simple maps then stay simple."""
    scale = float(np.sqrt(areal_scale(matrix)))
    cleaned = np.where(np.abs(matrix) > noise * scale, matrix, 0.0)
    return scale * np.eye(2) if np.abs(cleaned - scale * np.eye(2)).max() <= noise * scale else cleaned


def _rotation(projection: Projection, region: Place, T: FloatArray, tolerance: float) -> Rotation:
    """The rotation after which the corrected map's mean orientation is north."""
    field = field_resolving(projection, region, tolerance=tolerance)
    side = orientation(field.jacobian)
    # Mirrored maps have their east turned about, so that their north tells the orientation.
    common = 1.0 if np.sum(field.weight * np.nan_to_num(side)) > 0 else -1.0
    defined = side == common
    if field.weight[side == -common].sum() > _TURNED_OVER * field.weight.sum():
        raise ProjectionError(
            f"Invalid projection '{projection.label}' for a free rotation. It mirrors a part of the region, so that "
            "it has no mean orientation; keep north."
        )
    return field_rotation(field.jacobian[defined] * [common, 1.0], field.weight[defined], T)
