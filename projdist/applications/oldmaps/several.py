"""Several old maps of one region, as Jacobian fields over the ground that they have in common."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.applications.oldmaps.field import OldMap, hull_nodes
from projdist.applications.oldmaps.rectifying import old_places
from projdist.projections import Projection, projected_crs_of
from projdist.support import check_choice, check_instance

_SAME_PLACE = 0.01  # metres: zones in feet have their origins rounded to 0.1 mm
_ROWS = 50  # of places, and places in a row
_BY = ("mdt", "affine", "helmert")


class CommonGround(NamedTuple):
    """Places x, y (n,) in metres of the true plane, Jacobians (k, n, 2, 2) of k maps, and what each place counts."""

    x: FloatArray
    y: FloatArray
    jacobians: FloatArray
    area: FloatArray


def common_ground(maps: Sequence[OldMap], *, by: str = "mdt") -> CommonGround:
    """Several old maps over the ground that all of them show: what `mean_plane_map` takes.

    Each is a map of the same true plane, in its own unit, turned and stretched as its paper is. So each is taken after
    its own rectification, which has the scale 1 on average; what is left is the distortion that no affine map mends.
    The mean of these fields is the map that is nearest to all the old ones: what they have in common, as maps that were
    copied from one another, or surveyed in the same way, do. Its own distortion is the common part, its mean distance
    from them what each has for itself.

    Parameters
    ----------
    maps : sequence of OldMap
        Two or more, whose control points' truth is in one plane.
    by : str
        The rectification that each is taken after: "mdt", "affine" or "helmert", which leaves a stretch as it is.

    Returns
    -------
    CommonGround
        x, y, jacobians and area, by area in truth, where the hulls of all maps' control points overlap and none folds.

    Raises
    ------
    ValueError
        For fewer than two maps, an unknown rectification, truth in planes that are not the same, and maps that have no
        ground in common.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the mean of linear maps.

    Examples
    --------
    Two sheets of which one grows to the east and one to the north; their mean grows half as fast to both.

    >>> import numpy as np
    >>> from projdist.applications.oldmaps import ControlPoints
    >>> from projdist import mean_plane_map, old_map
    >>> x, y = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9))
    >>> true = np.stack([x.ravel(), y.ravel()], axis=-1)
    >>> east, north = (np.stack(m, axis=-1) for m in ((np.exp(0.4 * true[:, 0]), true[:, 1]),
    ...                                               (true[:, 0], np.exp(0.4 * true[:, 1]))))
    >>> ground = common_ground([old_map(ControlPoints(old, true), model="polynomial3") for old in (east, north)])
    >>> mean = mean_plane_map(ground.x, ground.y, ground.jacobians, area=ground.area, degree=4)
    >>> J = mean.jacobian([0.1, 0.9], [0.5, 0.5])
    >>> round(float(np.log(J[1, 0, 0] / J[0, 0, 0]) / 0.8), 1)
    0.2
    """
    check_choice("rectification", by, _BY)
    for one in maps:
        check_instance("old map", one, OldMap, "an OldMap")
    if len(maps) < 2:
        raise ValueError(f"Invalid old maps. There must be two or more, not {len(maps)}.")
    _check_one_plane(maps)
    places, weights, _ = min((hull_nodes(one.fitted.new, _ROWS) for one in maps), key=lambda found: found[2])
    inside = np.all([_is_within(places, one.fitted.new) for one in maps], axis=0)
    places, weights = places[inside], weights[inside]
    fields = np.array([one.corrected(one.local_jacobian(old_places(one, places)), by) for one in maps])
    known = np.isfinite(fields).all(axis=(0, 2, 3))
    if not known.any():
        raise ValueError("Invalid old maps. There is no ground that all of them show.")
    x, y = places[known].T
    return CommonGround(x, y, fields[:, known], weights[known] / weights[known].sum())


def _check_one_plane(maps: Sequence[OldMap]) -> None:
    """Raise ValueError where the control points are in CRSs in which the same ground is elsewhere, in metres."""
    known = [(one.points.new, one.points.crs) for one in maps if one.points.crs is not None]
    for (new, crs), (_, other) in itertools.pairwise(known):
        if not _is_same_ground(new, crs, other):
            both = f"{crs.label} and {other.label}"
            raise ValueError(f"Invalid old maps. Their truth is in {both}; it must be in one plane (--crs, crs=).")


def _is_same_ground(new: FloatArray, crs: Projection, other: Projection) -> bool:
    """Whether places in metres of the plane of a CRS have the same in that of another."""
    plane = projected_crs_of(crs)
    if crs.definition == other.definition or plane is None or not plane.has_inverse:
        return True
    u, v = np.linalg.solve(plane.to_metres, new.T)
    x, y = other(*plane.inverse(u, v, np.inf))
    return bool((np.hypot(x - new[:, 0], y - new[:, 1]) <= _SAME_PLACE).all())


def _is_within(places: FloatArray, points: FloatArray) -> BoolArray:
    """Which places lie in the convex hull of points."""
    from scipy.spatial import ConvexHull  # slow to load, and few need it

    hull = ConvexHull(points)
    rounding = 1e-9 * float(np.ptp(points))
    return np.asarray((places @ hull.equations[:, :2].T + hull.equations[:, 2] <= rounding).all(axis=1))
