"""The bending of great circles: how far geodesics are, on a map, from the straight lines between their ends."""

from __future__ import annotations

import numpy as np

from projdist._typing import FloatArray
from projdist.answers.distance_measures import weighted_sum
from projdist.answers.finite_distortions import DEFAULT_TOLERANCE, FiniteDistortion, Found, Question, groups
from projdist.answers.pairs import GOLDEN, Points
from projdist.earth import chord_angle, unit_vectors
from projdist.projections import Projection, ProjectionLike, geodesic_points
from projdist.regions import RegionLike

__all__ = ["great_circle_bending"]

_SIZES = (128, 256)  # points in a set
_STATIONS = 8  # on a great circle


def great_circle_bending(
    projection: ProjectionLike, region: RegionLike | None = None, *, tolerance: float = DEFAULT_TOLERANCE, seed: int = 0
) -> FiniteDistortion:
    """How far a map bends the geodesics between all pairs of points of a region.

    The mean, along each geodesic and over all of them, of how far its image is from the straight line between its ends
    on the map, in shares of that line's length: 0 on a gnomonic map. A short arc of length L has f L / 12, where f is
    the flexion of Goldberg & Gott 2007, which is its local form; a great circle that a map tears counts as it lies.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    region : RegionLike, optional
        Anything that `get_region` takes, also a `PointSet`. Without one it is the area of use of a CRS, and the globe
        for other projections.
    tolerance : float, default 5e-3
        A standard error, relative to the value, that is small enough; where it is larger, four times as many geodesics
        are taken.
    seed : int, default 0
        Chooses the geodesics.

    Returns
    -------
    FiniteDistortion
        The `value`, its standard `error` as in `distance_distortion`, and the number of geodesics, `pairs`.

    Raises
    ------
    ProjectionError
        For what is no projection.
    ValueError
        For an unknown region, a tolerance that is not positive, and a seed that is no whole number.

    References
    ----------
    Goldberg & Gott 2007, Flexion and Skewness in Map Projections of the Earth, Cartographica 42:297, section 3:
    flexion.

    Examples
    --------
    From 170 to 190 east the equator runs beside the straight line of 340 degrees: up to 10 degrees from its ends, 5 in
    the mean, of 340.

    >>> import numpy as np
    >>> from projdist import PointSet
    >>> points = PointSet(np.array([170.0, -170.0]), np.zeros(2), np.ones(2))
    >>> round(great_circle_bending("plate-carree", points).value, 4)
    0.0147
    """
    ask = Question.of(projection, region)
    (found,) = ask.estimates(
        ["bending"],
        lambda one, other, rng: _over_geodesics(ask.projection, one, other, rng),
        _SIZES,
        tolerance,
        seed,
    )
    return found


def _over_geodesics(projection: Projection, one: Points, other: Points, rng: np.random.Generator) -> Found:
    blocks = [np.ix_(rows, columns) for rows, columns in groups(one, other, rng)]
    i, j = (np.concatenate([np.broadcast_arrays(*block)[k].ravel() for block in blocks]) for k in (0, 1))
    weight = one.weight[i] * other.weight[j]
    # Stations a step apart, with an offset of its own for each geodesic: their mean has no bias.
    offset = np.mod(GOLDEN * np.arange(i.size) + rng.random(), 1.0)
    shares = (np.arange(_STATIONS) + offset[:, None]) / _STATIONS
    lon, lat = _along(projection, (one.lon[i], one.lat[i], other.lon[j], other.lat[j]), shares)
    x, y = projection(lon, lat)
    x0, y0 = (values[i, None] for values in projection(one.lon, one.lat))
    x1, y1 = (values[j, None] for values in projection(other.lon, other.lat))
    dx, dy = x1 - x0, y1 - y0
    square = dx * dx + dy * dy
    square[square == 0.0] = np.nan  # the same point twice
    share = np.clip(((x - x0) * dx + (y - y0) * dy) / square, 0.0, 1.0)
    away = np.hypot(x - x0 - share * dx, y - y0 - share * dy) / np.sqrt(square)
    figures = away.mean(axis=1)
    counts = np.isfinite(figures)
    if not weight[counts].sum() > 0.0:
        return Found(np.array([np.nan]), 0, 0.0)
    kept = weight[counts] / weight[counts].sum()
    value = np.array([weighted_sum(figures[counts], kept)])
    return Found(value, int(counts.sum()), float(weight[counts].sum() / weight.sum()))


def _along(
    projection: Projection, ends: tuple[FloatArray, FloatArray, FloatArray, FloatArray], shares: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Longitudes and latitudes (n, k) at shares (n, k) of geodesics."""
    if not projection.ellipsoid.is_sphere:
        return geodesic_points(projection.ellipsoid, ends, shares)
    start, end = unit_vectors(*ends[:2]), unit_vectors(*ends[2:])
    angle = chord_angle(start, end)[:, None]
    # The sum of sines is a multiple of the point; its length does not matter.
    X, Y, Z = start[:, :, None] * np.sin((1.0 - shares) * angle) + end[:, :, None] * np.sin(shares * angle)
    return np.degrees(np.arctan2(Y, X)), np.degrees(np.arctan2(Z, np.hypot(X, Y)))
