"""Jacobians of projections at points, by central differences that watch themselves.

Two stages. The first is cheap and settles nearly all points: a fourth-order stencil along the
parallel and the meridian, with a step of 4e-4 rad where rounding (eps / step = 5e-13) and the
truncated term (step^4) balance, so that eight evaluations a point give about 1e-12. Points
where the stencil's own check fails, and those near the poles, go to `stencils`, which tries ever
smaller steps and then one side only; what is left is NaN, with the reason.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.field.chebyshev_panels import evaluate_points, panels_for
from projdist.field.stencils import StencilPoints, fourth_order, is_torn, settle
from projdist.matrices import principal_scales
from projdist.projections import Projection, ProjectionLike
from projdist.support import check_degrees


class Quality(enum.IntEnum):
    """What is known of the derivative at a point."""

    OK = 0
    ONE_SIDED = 1  # at a seam or an edge; taken from the side that the point belongs to
    ROUGH = 2  # the stencils agree to no better than 1e-8 of J
    SEAM = 3  # the map is torn here on all sides
    SINGULAR = 4  # no finite, linear derivative: the end of a pole line, the apex of a cone
    OUTSIDE = 5  # the projection is not defined here

    @property
    def label(self) -> str:
        """The name as printed: "ok", "one-sided", ..."""
        return self.name.lower().replace("_", "-")


@dataclass(frozen=True)
class Derivatives:
    """Coordinates x, y in metres, the Jacobian (..., 2, 2), quality codes, and J's estimated relative error."""

    x: FloatArray
    y: FloatArray
    jacobian: FloatArray
    quality: NDArray[np.int8]
    error: FloatArray


_FAST_STEP = 4e-4  # at the equator; towards the poles, where most maps are singular, times sqrt(cos lat)
_FAST_LATITUDE = 85.0
FAST_TARGET = 3e-12
_MANY = 5_000  # points; polynomials on panels may pay for more
_APART = 1e-11  # of J; differences and polynomials are good to 1e-12 each
_CHUNK = 8192  # points at a time: the stencil's arrays stay in the cache
_NOISE = 3e-9  # of J; on smooth maps what looks like noise to the first stage is 1e-11
_ROUGH, _HOPELESS = 1e-8, 1e-5  # relative errors of J
_POOR, _LOST = 1e-6, 1e-2  # relative errors of b


def jacobian(projection: ProjectionLike, lon: ArrayLike, lat: ArrayLike) -> FloatArray:
    """The Jacobian at points in degrees; NaN where there is none.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    lon, lat : array_like (...)
        The points in degrees, of shapes that broadcast.

    Returns
    -------
    ndarray (..., 2, 2)
        Metre per metre. `derivatives` tells how good each is.

    Raises
    ------
    ProjectionError
        For what is no projection.
    ValueError
        For points that are no numbers, or of shapes that do not broadcast.

    References
    ----------
    B. Fornberg 1988, Generation of finite difference formulas on arbitrarily spaced grids, Mathematics of Computation
    51:699, table 1: the weights of the central differences.

    Examples
    --------
    At 60 degrees north a plate carree is 1 / cos(lat) = 2 times too wide.

    >>> J = jacobian("plate-carree", 0, 60)
    >>> round(float(J[0, 0]), 9), round(float(J[1, 1]), 9)
    (2.0, 1.0)
    """
    return derivatives(projection, lon, lat).jacobian


def derivatives(projection: ProjectionLike, lon: ArrayLike, lat: ArrayLike) -> Derivatives:
    """Coordinates, Jacobian, quality and error estimate at points in degrees.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    lon, lat : array_like (...)
        The points in degrees, of shapes that broadcast.

    Returns
    -------
    Derivatives
        `x` and `y` (...) in metres, `jacobian` (..., 2, 2), `quality` (...) in the codes of `Quality`, and `error`
        (...), the Jacobian's estimated relative error. That is the error of the differences, with the rounding of x and
        y and what noise they show; where PROJ's own arithmetic loses digits in steps too wide to be seen as noise, the
        true one is larger.

    Raises
    ------
    ProjectionError
        For what is no projection.
    ValueError
        For points that are no numbers, or of shapes that do not broadcast.

    References
    ----------
    B. Fornberg 1988, Generation of finite difference formulas on arbitrarily spaced grids, Mathematics of Computation
    51:699, table 1: the weights of the central differences.

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
    x, y = projection(lon, lat)
    J, error = _laid_out(lon.size)
    settled = np.zeros(lon.size, dtype=bool)
    if lon.size >= _MANY and np.isfinite(lon).any():
        _panel_stage(projection, lon, lat, (x, y), J, error, settled)
    _point_stage(projection, lon, lat, (x, y), J, error, settled)
    quality = np.zeros(lon.size, dtype=np.int8)
    hard = np.flatnonzero(~settled)
    if hard.size:
        _hard_stage(projection, lon, lat, x, y, hard, J, error, quality)
    flag_lost_digits(J, error, quality)
    return Derivatives(
        x.reshape(shape), y.reshape(shape), J.reshape(*shape, 2, 2), quality.reshape(shape), error.reshape(shape)
    )


def _laid_out(count: int) -> tuple[FloatArray, FloatArray]:
    """Room for Jacobians (n, 2, 2), each of whose entries lies together, as measures take them; and errors, NaN."""
    room = np.empty((5, count))  # one array: the system is slow to give many
    room[4] = np.nan
    return room[:4].reshape(2, 2, count).transpose(2, 0, 1), room[4]


def flag_lost_digits(J: FloatArray, error: FloatArray, quality: NDArray[np.int8]) -> None:
    """Call ROUGH what is good against a but not against a much smaller b, and SINGULAR where b is lost."""
    suspect = np.flatnonzero(np.concatenate([_may_lose_digits(J[part], error[part]) for part in _chunks(error.size)]))
    suspect = suspect[quality[suspect] < Quality.SEAM]
    if not suspect.size:
        return
    a, b = principal_scales(J[suspect]).T
    of_a = error[suspect] * a
    quality[suspect[(of_a > _POOR * b) & (quality[suspect] == Quality.OK)]] = Quality.ROUGH
    lost = suspect[of_a > _LOST * b]
    J[lost], error[lost], quality[lost] = np.nan, np.nan, Quality.SINGULAR


def _may_lose_digits(J: FloatArray, error: FloatArray) -> BoolArray:
    """Which may be POOR: a / b is (a^2 + b^2) / |det J| at most, which is soon told."""
    (xx, xy), (yx, yy) = J.transpose(1, 2, 0)
    with np.errstate(invalid="ignore"):
        return error * (xx * xx + xy * xy + yx * yx + yy * yy) >= 0.9 * _POOR * np.abs(xx * yy - xy * yx)


def _chunks(count: int) -> list[slice]:
    """Parts of so many points, one at least, whose arrays stay in the cache."""
    return [slice(start, min(start + _CHUNK, count)) for start in range(0, max(count, 1), _CHUNK)]


def _panel_stage(
    projection: Projection,
    lon: FloatArray,
    lat: FloatArray,
    centre: tuple[FloatArray, FloatArray],
    J: FloatArray,
    error: FloatArray,
    settled: BoolArray,
) -> None:
    """Derivatives of polynomials where many points are, written into J, error and `settled`.

    In each panel all points must have the x and y of the map, and a few the derivatives that differences have.
    """
    panels = panels_for(projection, lon, lat)
    if panels is None:
        return
    found, number, at = evaluate_points(panels, lon, lat, centre, J, error)
    found &= error <= FAST_TARGET
    truth, doubt = np.empty((at.size, 2, 2)), np.empty(at.size)
    sound = _fast_stage(projection, lon[at], lat[at], (centre[0][at], centre[1][at]), truth, doubt)
    gap, size = np.abs(J[at] - truth).sum(axis=(1, 2)), np.abs(truth).sum(axis=(1, 2))
    wrong = sound & found[at] & ~(gap <= (_APART + 10.0 * (doubt + error[at])) * size)
    if wrong.any():
        found &= ~np.isin(number, number[at[wrong]])
    settled |= found


def _point_stage(
    projection: Projection,
    lon: FloatArray,
    lat: FloatArray,
    centre: tuple[FloatArray, FloatArray],
    J: FloatArray,
    error: FloatArray,
    settled: BoolArray,
) -> None:
    """Differences at the points that are not settled yet."""
    rest = np.flatnonzero(~settled)
    whole = rest.size == lon.size
    for chunk in _chunks(rest.size):
        part = chunk if whole else rest[chunk]
        place = lon[part], lat[part], (centre[0][part], centre[1][part])
        if whole:
            settled[part] = _fast_stage(projection, *place, J[part], error[part])
            continue
        there, doubt = _laid_out(place[0].size)
        settled[part] = _fast_stage(projection, *place, there, doubt)
        for i in (0, 1):
            for j in (0, 1):
                J[:, i, j][part] = there[:, i, j]
        error[part] = doubt


def _fast_stage(
    projection: Projection,
    lon: FloatArray,
    lat: FloatArray,
    centre: tuple[FloatArray, FloatArray],
    J: FloatArray,
    error: FloatArray,
) -> BoolArray:
    """Fourth-order differences along the parallel and the meridian, written into J and error; which are settled."""
    n = lon.size
    cos = np.cos(np.radians(np.clip(lat, -_FAST_LATITUDE, _FAST_LATITUDE)))
    step = _FAST_STEP * np.sqrt(cos)
    east_step = step / cos
    east_degrees, north_degrees = np.degrees(east_step), np.degrees(step)
    lons = np.empty((8, n))
    lats = np.empty((8, n))
    lons[4:] = lon
    lats[:4] = lat
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
    middle = 6.0 * (centre[0] + 0.7 * centre[1])
    kink = np.abs(both[2] + both[3] - 4.0 * (both[0] + both[1]) + middle) * metre[0]
    kink += np.abs(both[6] + both[7] - 4.0 * (both[4] + both[5]) + middle) * metre[1]
    with np.errstate(invalid="ignore", divide="ignore"):
        # The fourth-order error falls as the square of the second-order one. At a logarithmic singularity
        # the factor is 7; 10 leaves a margin.
        truncation = 10.0 * (gap / size) ** 2
        rounding = (
            1.5
            * np.finfo(float).eps
            * (np.sqrt(centre[0] ** 2 + centre[1] ** 2) * (metre[0] + metre[1]) / size + 1.0 / step)
        )
        # On smooth maps the fourth difference is below a fiftieth of the third; white noise in f has it larger, and
        # 8 times as large as what reaches the derivative.
        noise = np.where(kink > 0.02 * 6.0 * gap, kink / (8.0 * size), 0.0)
        error[:] = truncation + rounding + noise
        settled = (truncation <= FAST_TARGET) & (noise <= _NOISE) & (np.abs(lat) <= _FAST_LATITUDE)
    return np.asarray(settled)


def _hard_stage(
    projection: Projection,
    lon: FloatArray,
    lat: FloatArray,
    x: FloatArray,
    y: FloatArray,
    hard: IntArray,
    J: FloatArray,
    error: FloatArray,
    quality: NDArray[np.int8],
) -> None:
    """Settle the points of index `hard`; results are written into J, error and quality."""
    defined = np.isfinite(x[hard])
    outside, hard = hard[~defined], hard[defined]
    J[outside], error[outside], quality[outside] = np.nan, np.nan, Quality.OUTSIDE
    points = StencilPoints.of(projection, lon[hard], lat[hard])
    centre = np.stack([x[hard], y[hard]])
    found = settle(points, centre)
    code = np.where(found.one_sided, Quality.ONE_SIDED, Quality.OK).astype(np.int8)
    code[found.error > _ROUGH] = Quality.ROUGH
    lost = np.flatnonzero(~(found.error <= _HOPELESS))
    if lost.size:
        found.jacobian[lost], found.error[lost] = np.nan, np.nan
        code[lost] = np.where(is_torn(points.take(lost), centre[:, lost]), Quality.SEAM, Quality.SINGULAR)
    J[hard], error[hard], quality[hard] = found.jacobian, found.error, code
