"""Jacobians of projections at points, by formulas or by differences, each with a check.

Where a map has a closed form with its coordinates, J is that of the formula. Elsewhere a cheap first stage is enough
for nearly all points: a fourth-order stencil along the parallel and the meridian with a step of 4e-4 rad, where
rounding (eps / step = 5e-13) and truncation (step^4) balance, so that eight evaluations a point give about 1e-12.
Points where its check fails, and those near the poles, go to `stencils`, which tries ever smaller steps and then one
side only. The rest is NaN, with the reason.
"""

from __future__ import annotations

import enum
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from projdist._typing import ArrayLike, BoolArray, FloatArray, IntArray, NDArray
from projdist.field.stencils import TANGENT_LATITUDE, StencilPoints, fourth_order, hessian, is_torn, refine
from projdist.matrices import Measure, principal_scales
from projdist.projections import Projection, ProjectionLike
from projdist.support import check_degrees


class Quality(enum.IntEnum):
    """How good the derivative at a point is, or why there is none."""

    OK = 0
    ONE_SIDED = 1  # at a seam or an edge; taken from the side that the point belongs to
    ROUGH = 2  # the stencils agree to no better than 1e-8 of J
    SEAM = 3  # the map is torn here on all sides
    SINGULAR = 4  # no finite, linear derivative: the end of a pole line, the apex of a cone
    OUTSIDE = 5  # the projection is not defined here

    @property
    def label(self) -> str:
        """The name as printed, such as "one-sided"."""
        return self.name.lower().replace("_", "-")


@dataclass(frozen=True)
class Derivatives:
    """Coordinates x, y in metres, the Jacobian (..., 2, 2), quality codes, and J's estimated relative error."""

    x: FloatArray
    y: FloatArray
    jacobian: FloatArray
    quality: NDArray[np.int8]
    error: FloatArray

    def reshaped(self, shape: tuple[int, ...]) -> Derivatives:
        """The derivatives with their arrays (m,) reshaped to (...)."""
        J, quality = self.jacobian.reshape(*shape, 2, 2), self.quality.reshape(shape)
        return Derivatives(self.x.reshape(shape), self.y.reshape(shape), J, quality, self.error.reshape(shape))


_FAST_STEP = 4e-4  # radians at the equator; towards the poles, where most maps are singular, times sqrt(cos lat)
_FAST_LATITUDE = 85.0
_FAST_TARGET = 3e-12
_TOGETHER = 8192  # points whose arrays stay in the processor's cache
_NOISE = 3e-9  # of J; smooth maps seem to have a noise of 1e-11
_ROUGH, _HOPELESS = 1e-8, 1e-5  # relative errors of J
_POOR, _LOST = 1e-6, 1e-2  # relative errors of b


def jacobian(projection: ProjectionLike, lon: ArrayLike, lat: ArrayLike) -> FloatArray:
    """The Jacobian at points in degrees; NaN where there is none.

    Parameters
    ----------
    projection : ProjectionLike
    lon, lat : array_like (...)
        The points in degrees, of shapes that broadcast.

    Returns
    -------
    ndarray (..., 2, 2)
        Metre per metre. `derivatives` tells how good each is.

    Raises
    ------
    ProjectionError, ValueError
        For what is no projection; for points that are no numbers, or whose shapes do not broadcast.

    References
    ----------
    B. Fornberg 1988, Mathematics of Computation 51:699, table 1: the weights of the central differences.

    Examples
    --------
    At 60 degrees north a plate carree is 1 / cos(lat) = 2 times too wide.

    >>> J = jacobian("plate-carree", 0, 60)
    >>> round(float(J[0, 0]), 9), round(float(J[1, 1]), 9)
    (2.0, 1.0)
    """
    return derivatives(projection, lon, lat).jacobian


def measure_at(
    projection: Projection, measure: Measure, lon: FloatArray, lat: FloatArray, J: FloatArray | None = None
) -> FloatArray:
    """A measure at points in degrees, where J may be known."""
    J = jacobian(projection, lon, lat) if J is None else J
    return measure(J, hessian(projection, lon, lat)) if measure.needs_hessian else measure(J)


def derivatives(projection: ProjectionLike, lon: ArrayLike, lat: ArrayLike) -> Derivatives:
    """Coordinates, Jacobian, quality and error estimate at points in degrees.

    Parameters
    ----------
    projection : ProjectionLike
    lon, lat : array_like (...)
        The points in degrees, of shapes that broadcast.

    Returns
    -------
    Derivatives
        `x` and `y` (...) in metres, `jacobian` (..., 2, 2), `quality` (...) in the codes of `Quality`, and `error`
        (...), the Jacobian's estimated relative error: truncation, rounding, and the noise that x and y show. Where
        PROJ's own arithmetic loses digits in steps too wide to look like noise, the true error is larger.

    Raises
    ------
    ProjectionError, ValueError
        For what is no projection; for points that are no numbers, or whose shapes do not broadcast.

    References
    ----------
    B. Fornberg 1988, Mathematics of Computation 51:699, table 1: the weights of the central differences.

    Examples
    --------
    At its seam a map has the derivative from the point's own side.

    >>> found = derivatives("mercator", [0, 180], 60)
    >>> [Quality(code).label for code in found.quality], found.jacobian[:, 0, 0].round(9).tolist()
    (['ok', 'one-sided'], [2.0, 2.0])
    """
    projection = Projection.from_user_input(projection)
    lon, lat = check_degrees(lon, lat)
    shape, lon, lat = lon.shape, lon.ravel(), lat.ravel()
    J, error = _empty(lon.size)
    found = Derivatives(*projection(lon, lat), J, np.zeros(lon.size, dtype=np.int8), error)
    done = _formula_stage(projection, lon, lat, found)
    if done.all():
        return found.reshaped(shape)
    rest = np.flatnonzero(~done)
    for chunk in _parts_of(rest.size):
        part = rest[chunk]
        done[part], J[part], error[part] = _fast_stage(projection, lon[part], lat[part], found.x[part], found.y[part])
    hard = np.flatnonzero(~done)
    if hard.size:
        _hard_stage(projection, lon, lat, found, hard)
    _flag_lost_digits(found, rest)
    return found.reshaped(shape)


def _empty(count: int) -> tuple[FloatArray, FloatArray]:
    """Empty Jacobians (n, 2, 2), each entry contiguous over the points as measures read it, and errors, all NaN."""
    room = np.empty((5, count))  # one array: the system is slow to give many
    room[4] = np.nan
    return room[:4].reshape(2, 2, count).transpose(2, 0, 1), room[4]


def _parts_of(count: int) -> Iterator[slice]:
    return (slice(start, start + _TOGETHER) for start in range(0, count, _TOGETHER))


def _flag_lost_digits(found: Derivatives, rest: IntArray) -> None:
    """Mark those of an index ROUGH if good against a but not against a much smaller b, SINGULAR if b is lost."""
    J, error, quality = found.jacobian, found.error, found.quality
    parts = []
    for part in _parts_of(rest.size):
        # a / b is at most (a^2 + b^2) / |det J|, which is quick to compute.
        (xx, xy), (yx, yy) = J[rest[part]].transpose(1, 2, 0)
        with np.errstate(invalid="ignore"):
            square = xx * xx + xy * xy + yx * yx + yy * yy
            parts.append(error[rest[part]] * square >= 0.9 * _POOR * np.abs(xx * yy - xy * yx))
    suspect = rest[np.concatenate(parts)]
    suspect = suspect[quality[suspect] < Quality.SEAM]
    if not suspect.size:
        return
    a, b = principal_scales(J[suspect]).T
    of_a = error[suspect] * a
    quality[suspect[(of_a > _POOR * b) & (quality[suspect] == Quality.OK)]] = Quality.ROUGH
    lost = suspect[of_a > _LOST * b]
    J[lost], error[lost], quality[lost] = np.nan, np.nan, Quality.SINGULAR


def _formula_stage(projection: Projection, lon: FloatArray, lat: FloatArray, found: Derivatives) -> BoolArray:
    """Write the derivatives of the map's closed form into `found`; True where it agrees with the map's x and y."""
    form, J = projection.closed_form, found.jacobian
    if form is not None:
        for part in _parts_of(lon.size):
            plane, found.error[part] = form.checked(lon[part], lat[part], found.x[part], found.y[part])
            for j, along in enumerate((plane.east, plane.north)):
                J[part, 0, j], J[part, 1, j] = along.real, along.imag
    return np.isfinite(found.error)


def _fast_stage(
    projection: Projection, lon: FloatArray, lat: FloatArray, x_0: FloatArray, y_0: FloatArray
) -> tuple[BoolArray, FloatArray, FloatArray]:
    """True where fourth-order differences along the parallel and the meridian are good; J by them, and its error."""
    n = lon.size
    J, error = _empty(n)
    cos = np.cos(np.radians(np.clip(lat, -_FAST_LATITUDE, _FAST_LATITUDE)))
    step = _FAST_STEP * np.sqrt(cos)
    east_step = step / cos
    east_degrees, north_degrees = np.degrees(east_step), np.degrees(step)
    lons, lats = np.empty((2, 8, n))
    lons[4:], lats[:4] = lon, lat
    for row, offset in enumerate((1.0, -1.0, 2.0, -2.0)):
        np.add(lon, offset * east_degrees, out=lons[row])
        np.add(lat, offset * north_degrees, out=lats[4 + row])
    x, y = projection(lons, lats)
    meridian, vertical = projection.ellipsoid.radii(lat)
    metre = (1.0 / (east_step * vertical * cos), 1.0 / (step * meridian))
    gap, size = np.zeros((2, n))
    for i, value in enumerate((x, y)):
        for j in (0, 1):
            column, change = fourth_order(value[4 * j : 4 * j + 4], metre[j])
            J[:, i, j] = column
            gap += np.abs(change)
            size += np.abs(column)
    # One sum of x and y, with odd weights, shows a kink in either at half the cost.
    both = x + 0.7 * y
    middle = 6.0 * (x_0 + 0.7 * y_0)
    kink = np.abs(both[2] + both[3] - 4.0 * (both[0] + both[1]) + middle) * metre[0]
    kink += np.abs(both[6] + both[7] - 4.0 * (both[4] + both[5]) + middle) * metre[1]
    with np.errstate(invalid="ignore", divide="ignore"):
        # The fourth-order error is the square of the second-order one, at a logarithmic singularity 7 times that.
        truncation = 10.0 * (gap / size) ** 2
        away = np.hypot(x_0, y_0)
        rounding = 1.5 * np.finfo(float).eps * (away * (metre[0] + metre[1]) / size + 1.0 / step)
        # On smooth maps the fourth difference is below a fiftieth of the third; white noise has 8 times what reaches J.
        noise = np.where(kink > 0.02 * 6.0 * gap, kink / (8.0 * size), 0.0)
        error[:] = truncation + rounding + noise
        good = (truncation <= _FAST_TARGET) & (noise <= _NOISE) & (np.abs(lat) <= _FAST_LATITUDE)
    return good, J, error


def _hard_stage(projection: Projection, lon: FloatArray, lat: FloatArray, found: Derivatives, hard: IntArray) -> None:
    """Write derivatives at the points of the index `hard`, and their quality, into `found`."""
    J, error, quality = found.jacobian, found.error, found.quality
    defined = np.isfinite(found.x[hard])
    outside, hard = hard[~defined], hard[defined]
    J[outside], error[outside], quality[outside] = np.nan, np.nan, Quality.OUTSIDE
    points = StencilPoints(projection, lon[hard], lat[hard], np.abs(lat[hard]) > TANGENT_LATITUDE)
    centre = np.stack([found.x[hard], found.y[hard]])
    best = refine(points, centre)
    code = np.where(best.one_sided, Quality.ONE_SIDED, Quality.OK).astype(np.int8)
    code[best.error > _ROUGH] = Quality.ROUGH
    lost = np.flatnonzero(~(best.error <= _HOPELESS))
    if lost.size:
        best.jacobian[lost], best.error[lost] = np.nan, np.nan
        code[lost] = np.where(is_torn(points.take(lost), centre[:, lost]), Quality.SEAM, Quality.SINGULAR)
    J[hard], error[hard], quality[hard] = best.jacobian, best.error, code
