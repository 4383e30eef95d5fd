"""The distortion of an old map: its field of scales and rotations, affine rectifications, folds, outliers, isolines.

The old map is a map of the true plane; its Jacobian J is the inverse of that of the fit, which goes from the old map to
true places. Means are by area on the old map, over the hull of the control points.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist import matrices, numerics
from projdist._typing import AnyArray, BoolArray, FloatArray
from projdist.applications.oldmaps.control_points import ControlPoints
from projdist.applications.oldmaps.fits import Fit, affine_fit, fit, helmert_fit, wrong_points
from projdist.support import Answer, check_choice, check_instance, check_number, plain

OUTLIERS = ("drop", "keep")
"""Leave wrong points out of the fit, or keep them."""

RECTIFICATIONS = ("mdt", "affine", "helmert")
"""By the MDT, and by affine and Helmert least squares."""

_ROWS = 100  # of nodes, and nodes in a row
_INCH = 0.0254  # metres
_SHARES = {"p05": 0.05, "median": 0.5, "p95": 0.95}


def rotation(J: FloatArray) -> FloatArray:
    """Clockwise rotation of the map in degrees, that of the polar factor of J."""
    return -np.degrees(np.arctan2(J[..., 1, 0] - J[..., 0, 1], J[..., 0, 0] + J[..., 1, 1]))


LOCAL_MEASURES = {  # of a map after its rectification
    "fisher": matrices.Measure("fisher", matrices.fisher),
    "areal_scale": matrices.Measure("areal_scale", matrices.areal_scale, "s", kind="ratio"),
    # The geometric mean of the principal scales.
    "scale": matrices.Measure("scale", lambda J: np.sqrt(matrices.areal_scale(J)), kind="ratio"),
    "rotation": matrices.Measure("rotation", rotation, unit="deg", kind="signed"),
}


@dataclass(frozen=True, eq=False)
class Rectification:
    """An affine map from the old map's plane to a plane in metres."""

    name: str
    affine: matrices.Affine
    distortion: float  #: mean of Dist_F^2 of the rectified map over the nodes
    residual: float  #: RMS distance in metres of the rectified control points from the true places
    scale_error: float  #: metres per unit, a standard error from the residuals of the fit; NaN if it leaves none
    rotation_error: float  #: degrees, likewise

    @property
    def parts(self) -> matrices.Decomposition:
        """Scale in metres per unit, stretch and its azimuth on the old map, shear, and the old map's rotation.

        The old map's rotation, in degrees clockwise, is what the rectification reverses: true north is so far to the
        right of its vertical. If the old map is mirrored, its y axis is reversed before.
        """
        M = self.affine.matrix
        parts = matrices.decompose(M @ np.diag([1.0, np.sign(np.linalg.det(M))]))
        return parts._replace(rotation=0.0 - parts.rotation)  # no -0

    def to_dict(self) -> dict[str, Any]:
        """The fields by name."""
        parts = {name: plain(float(value)) for name, value in self.parts._asdict().items()}
        given = {"matrix": self.affine.matrix.tolist(), "shift": self.affine.shift.tolist()}
        errors = {"scale_error": plain(self.scale_error), "rotation_error": plain(self.rotation_error)}
        return {"distortion": self.distortion, "residual": self.residual, **given, **parts, **errors}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class OldMap(Answer):
    """An old map as its control points show it."""

    points: ControlPoints
    is_outlier: BoolArray  #: (n,), wrong points
    is_fitted: BoolArray  #: (n,), points used by the fit and the rectifications
    fit: Fit
    is_mirrored: bool
    nodes: FloatArray  #: (m, 2), which fill the hull of the points on the old map
    weights: FloatArray  #: (m,), of sum 1
    jacobian: FloatArray  #: (m, 2, 2), the old map's at the nodes, in its units per metre, NaN where the fit folds
    rectifications: dict[str, Rectification]  #: by "mdt", "affine" and "helmert" (least squares)
    area: float  #: of the hull, in square units
    rotation_note: str
    dots_per_inch: float | None = None  #: of the scan whose pixels are the units, if known

    @property
    def fold_share(self) -> float:
        """Share of the hull's area on which the fit folds."""
        return float(self.weights[np.isnan(self.jacobian[:, 0, 0])].sum())

    @property
    def folds_near(self) -> tuple[str, ...]:
        """Names of the control points nearest to folds, by the area of folds near them, largest first."""
        folded, points = np.isnan(self.jacobian[:, 0, 0]), self.fitted
        nearest = ((self.nodes[folded][:, None] - points.old) ** 2).sum(axis=-1).argmin(axis=1)
        share = np.bincount(nearest, self.weights[folded], len(points.old))
        at_points = np.isnan(self.local_jacobian(points.old)[:, 0, 0])
        return tuple(points.names[k] for k in np.argsort(-share, kind="stable") if share[k] > 0 or at_points[k])

    @property
    def outliers(self) -> tuple[str, ...]:
        """Names of the wrong points, those farthest from the fit without them first."""
        order = np.argsort(-np.hypot(*self.residuals_left_out.T), kind="stable")
        return tuple(self.points.names[k] for k in order if self.is_outlier[k])

    @functools.cached_property
    def fitted(self) -> ControlPoints:
        """The points used by the fit."""
        return self.points.chosen(self.is_fitted)

    @functools.cached_property
    def residuals(self) -> FloatArray:
        """True minus fitted places of the points, (n, 2)."""
        return self._of_all(self.fit.residuals)

    @functools.cached_property
    def residuals_left_out(self) -> FloatArray:
        """True minus fitted places, each by the fit without the point, (n, 2); NaN if the others do not suffice."""
        return self._of_all(self.fit.left_out)

    def _of_all(self, of_fitted: FloatArray) -> FloatArray:
        """Residuals of all points: those given for fitted points, and of the others those from the fit."""
        residuals = self.points.new - self.fit(self.points.old)
        residuals[self.is_fitted] = of_fitted
        return np.asarray(residuals)

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks besides the figures."""
        mirrored = (
            "The old map is mirrored as a whole: its y axis points down, as that of images (or its axes are "
            "swapped). It is turned about; that is no fold."
        )
        return tuple(filter(None, [self.points.note, self.rotation_note, mirrored if self.is_mirrored else ""]))

    def local_jacobian(self, old: FloatArray) -> FloatArray:
        """The old map's Jacobian (m, 2, 2) at places (m, 2) on it; NaN on folds."""
        return _jacobian(self.fit, old, self.is_mirrored)[0]

    def corrected(self, J: FloatArray, by: str = "mdt") -> FloatArray:
        """Jacobians after a rectification, whose scales are 1 on average."""
        return np.asarray(self.rectifications[by].affine.matrix @ J)

    def _known(self) -> tuple[FloatArray, FloatArray]:
        """The Jacobians after the MDT at nodes without folds, and the weights of these nodes."""
        known = ~np.isnan(self.jacobian[:, 0, 0])
        return self.corrected(self.jacobian[known]), self.weights[known]

    def denominator(self, metres_per_unit: float) -> float | None:
        """N of the scale 1 : N; None if the scan's resolution is unknown."""
        return None if self.dots_per_inch is None else metres_per_unit * self.dots_per_inch / _INCH

    @property
    def modes(self) -> matrices.Modes:
        """Principal components of the distortion after the MDT, on its axes, by area on the old map."""
        return matrices.field_modes(*self._known(), np.eye(2))

    def statistics(self) -> dict[str, dict[str, float]]:
        """Percentiles of the measures after the MDT, by area on the old map."""
        J, weights = self._known()
        return {
            name: dict(zip(_SHARES, numerics.quantiles(measure(J), weights, [*_SHARES.values()]), strict=True))
            for name, measure in LOCAL_MEASURES.items()
        }

    def _line(self) -> str:
        return f"{len(self.points.names)} points, {len(self.nodes)} nodes"

    def to_dict(self) -> dict[str, Any]:
        """The values with the keys of the command line's JSON; undefined ones are None."""
        corrections = {
            name: one.to_dict() | {"denominator": self.denominator(float(one.parts.scale))}
            for name, one in self.rectifications.items()
        }
        return {
            "model": self.fit.model,
            "smoothing": self.fit.smoothing,
            "freedom": self.fit.freedom,
            "residual": _rms(self.fit.residuals),
            "residual_left_out": plain(_rms(self.fit.left_out)),
            "mirrored": self.is_mirrored,
            "area": self.area,
            "dots_per_inch": self.dots_per_inch,
            "rectifications": corrections,
            "folds": {"share": self.fold_share, "area": self.fold_share * self.area, "near": list(self.folds_near)},
            "outliers": list(self.outliers),
            "outliers_left_out": bool(self.is_outlier.any() and not self.is_fitted.all()),
            "statistics": self.statistics(),
            "modes": self.modes.rows,
            "notes": list(self.notes),
            "points": self.plain_rows(),
        }

    def _table(self) -> dict[str, Any]:
        """A row per control point: its places, its residuals in metres, and the measures there after the MDT."""
        J = self.corrected(self.local_jacobian(self.points.old))
        pairs = np.hstack([self.points.old, self.points.new, self.residuals]).T
        places = zip(("x_old", "y_old", "x_new", "y_new", "residual_x", "residual_y"), pairs, strict=True)
        flags = {"outlier": self.is_outlier, "fold": np.isnan(J[:, 0, 0])}
        columns = {"id": list(self.points.names), **dict(places), "left_out": np.hypot(*self.residuals_left_out.T)}
        return columns | flags | {name: measure(J) for name, measure in LOCAL_MEASURES.items()}


def old_map(
    points: ControlPoints,
    *,
    model: str = "tps",
    smoothing: float | None = None,
    outliers: str = "drop",
    dots_per_inch: float | None = None,
) -> OldMap:
    """The distortion of an old map, by a model fitted to its control points.

    Parameters
    ----------
    points : ControlPoints
        Three or more; a model needs as many as it has parameters per coordinate, tps four.
    model : str
        "helmert", "affine", "polynomial2" or "polynomial3", by least squares, or "tps", the thin-plate spline.
    smoothing : float, optional
        Of tps, not negative: the weight of its bending against the sum of squares, with lengths in units of the points'
        standard deviation along an axis after the affine fit. The default minimises the generalized cross-validation.
    outliers : str
        "drop" or "keep". Wrong control points are always named, and fitted only if they are kept. For all models they
        are found by splines of two orders with cross-validated smoothing: the point with the largest externally
        studentised residual is left out and the splines are fitted anew, as long as such a residual has a probability
        below 5 % among normal errors of all points. Those that fit the others in the end are taken back. Eight points
        are needed, and at most a quarter may be wrong.
    dots_per_inch : float, optional
        The resolution of the scan whose pixels are the unit of the old places; it gives denominators of scales.

    Returns
    -------
    OldMap
        The fit, the old map's Jacobians over the hull of its points, in its units per metre, and three rectifications:
        by the MDT, and by affine and Helmert least squares.

    Raises
    ------
    ValueError
        For points that do not determine the model, an unknown model, numbers out of range, a fit that folds everywhere.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications (mdt).
    Duchon 1977 (the spline), Craven & Wahba 1979 (its cross-validation), Wahba 1990 (its errors).
    Rosner 1983, Technometrics 25 (several outliers, one after the other).

    Examples
    --------
    A sheet whose unit is 300 m to the right and 100 m upwards is stretched by a factor of 3:

    >>> sheet = ControlPoints([[0, 0], [1, 0], [0, 1], [1, 1]], [[0, 0], [300, 0], [0, 100], [300, 100]])
    >>> round(float(old_map(sheet, model="affine").rectifications["mdt"].parts.stretch), 9)
    3.0
    """
    check_instance("control points", points, ControlPoints, "ControlPoints")
    if dots_per_inch is not None and not 0.0 < check_number("dots per inch", dots_per_inch) < np.inf:
        raise ValueError(f"Invalid dots per inch '{dots_per_inch:g}'. They must be positive.")
    is_outlier = wrong_points(points)
    is_fitted = np.ones_like(is_outlier) if check_choice("outliers", outliers, OUTLIERS) == "keep" else ~is_outlier
    given, points = points, points.chosen(is_fitted)
    fitted, linear = fit(points, model, smoothing), affine_fit(points)
    is_mirrored = bool(np.linalg.det(linear.matrix) < 0)
    # The nodes are laid out in the plane of the affine fit, so as not to depend on the old map's units and axes.
    registered, weights, area = hull_nodes(linear(points.old))
    nodes = linear.inverse()(registered)
    jacobian, folded = _jacobian(fitted, nodes, is_mirrored)
    if folded.all():
        raise ValueError(f"Invalid control points for model '{model}'. The fitted map folds everywhere.")
    J, w = jacobian[~folded], weights[~folded]
    flip = np.diag([1.0, -1.0 if is_mirrored else 1.0])
    T = matrices.field_mdt(flip @ J, w / w.sum()).T
    turn = matrices.field_rotation(flip @ J, w, T)
    matrix = turn.q @ np.linalg.inv(T) @ flip
    mean = matrices.Affine(matrix, (points.new - points.old @ matrix.T).mean(axis=0))
    helmert = helmert_fit(points), fit(points, "helmert")
    maps = {"mdt": (mean, fitted), "affine": (linear, fit(points, "affine")), "helmert": helmert}
    rectifications = {}
    for name, (one, of_model) in maps.items():
        by_scale, by_turn = _errors(of_model, nodes[~folded], w)
        rectifications[name] = Rectification(
            name=name,
            affine=one,
            distortion=float(w @ matrices.fisher(one.matrix @ J) ** 2 / w.sum()),
            residual=_rms(points.new - one(points.old)),
            scale_error=by_scale * float(np.sqrt(abs(np.linalg.det(one.matrix)))),
            rotation_error=float(np.degrees(by_turn)),
        )
    return OldMap(
        points=given,
        is_outlier=is_outlier,
        is_fitted=is_fitted,
        fit=fitted,
        is_mirrored=is_mirrored,
        nodes=nodes,
        weights=weights,
        jacobian=jacobian,
        rectifications=rectifications,
        area=area / float(abs(np.linalg.det(linear.matrix))),
        rotation_note=turn.note,
        dots_per_inch=dots_per_inch,
    )


def _jacobian(fitted: Fit, old: FloatArray, is_mirrored: bool) -> tuple[FloatArray, BoolArray]:
    """The old map's Jacobians, NaN on folds, and flags of folds."""
    back = fitted.jacobian(old)
    folded = np.asarray(np.linalg.det(back) * (-1.0 if is_mirrored else 1.0) <= 0.0)
    back[folded] = np.eye(2)
    jacobian = np.asarray(np.linalg.inv(back), dtype=float)
    jacobian[folded] = np.nan
    return jacobian, folded


def _errors(fitted: Fit, nodes: FloatArray, w: FloatArray) -> tuple[float, float]:
    """Standard errors of the mean logarithm of the scale, which is the MDT's, and of the mean rotation in radians."""
    back, w = fitted.jacobian(nodes), (w / w.sum())[:, None, None]
    by_scale = 0.5 * np.swapaxes(np.linalg.inv(back), 1, 2)
    # The second column is along the y axis of the old map, or against it if that is mirrored; the angle is the same.
    x, y = back[:, 0, 1], back[:, 1, 1]
    by_turn = np.zeros_like(back)
    by_turn[:, 0, 1], by_turn[:, 1, 1] = -y / (x**2 + y**2), x / (x**2 + y**2)
    return fitted.standard_error(nodes, w * by_scale), fitted.standard_error(nodes, w * by_turn)


def hull_nodes(points: FloatArray, rows: int = _ROWS) -> tuple[FloatArray, FloatArray, float]:
    """Nodes (m, 2) and weights of sum 1 of a midpoint rule over the convex hull of points, and its area."""
    from scipy.spatial import ConvexHull  # imported here: scipy is slow to load, and few need it

    hull = ConvexHull(points)
    low, high = points[:, 1].min(), points[:, 1].max()
    y = low + (high - low) * (np.arange(rows) + 0.5) / rows
    # Each side of the hull bounds x from the left or from the right: nx x + ny y + c <= 0 inside.
    nx, ny, c = hull.equations.T
    with np.errstate(divide="ignore", invalid="ignore"):
        bound = -(c + ny * y[:, None]) / nx
    left = np.where(nx < 0, bound, -np.inf).max(axis=1)
    right = np.where(nx > 0, bound, np.inf).min(axis=1)
    x = left[:, None] + (right - left)[:, None] * (np.arange(rows) + 0.5) / rows
    weights = np.repeat(np.maximum(right - left, 0.0), rows)
    return np.stack([x.ravel(), np.repeat(y, rows)], axis=-1), weights / weights.sum(), float(hull.volume)


def _rms(residuals: FloatArray) -> float:
    """RMS length of the finite ones of vectors (n, 2)."""
    square = (residuals**2).sum(axis=1)
    known = square[np.isfinite(square)]
    return float(np.sqrt(known.mean())) if known.size else float("nan")


# ---- isolines ------------------------------------------------------------------------------------

_LEVELS = 12  # at most
_CONSTANT = 1e-9  # of a value: a measure that varies less has no isolines


def isolines(found: OldMap, measure: str, *, by: str = "mdt") -> dict[float, FloatArray]:
    """Segments (m, 2, 2) of isolines by their levels, round numbers, in metres of the true plane.

    `measure`: a name in LOCAL_MEASURES, taken after the rectification `by`. Folds have no isolines.
    """
    places, triangles = _mesh(found)
    values = LOCAL_MEASURES[measure](found.corrected(found.local_jacobian(places), by))
    true = found.fit(places)
    triangles = triangles[np.isfinite(values[triangles]).all(axis=1)]
    known = values[np.isfinite(values)]
    low, high = float(known.min()), float(known.max())
    if not high - low > _CONSTANT * max(abs(low), abs(high)):
        return {}
    # At most twelve levels, multiples of 1, 2 or 5 times a power of ten.
    least = (high - low) / _LEVELS
    power = 10.0 ** np.floor(np.log10(least))
    step = next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= least * (1.0 - 1e-9))
    levels = [float(f"{k * step:.12g}") for k in range(int(np.floor(low / step)) + 1, int(np.ceil(high / step)))]
    return {level: pieces for level in levels if len(pieces := _pieces(true, values, triangles, level))}


def _mesh(found: OldMap) -> tuple[FloatArray, AnyArray]:
    """Places (m, 2) on the old map that fill the hull and its rim, and their triangles (k, 3)."""
    from scipy.spatial import ConvexHull, Delaunay  # slow to load, and few need it

    linear = found.rectifications["affine"].affine
    hull = ConvexHull(linear(found.fitted.old))
    corners = linear(found.fitted.old)[hull.vertices]
    step = float(np.sqrt(hull.volume / len(found.nodes)))
    rim = [
        start + (stop - start) * np.arange(count := int(np.ceil(np.hypot(*(stop - start)) / step)))[:, None] / count
        for start, stop in zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ]
    inner = linear(found.nodes)
    inner = inner[(inner @ hull.equations[:, :2].T + hull.equations[:, 2] < -0.2 * step).all(axis=1)]
    places = np.concatenate([inner, *rim])
    return linear.inverse()(places), Delaunay(places - places.mean(axis=0)).simplices


def _pieces(places: FloatArray, values: FloatArray, triangles: AnyArray, level: float) -> FloatArray:
    """Segments (m, 2, 2) where a level crosses triangles, which end at the same points as those of their neighbours."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=-1)
    above = values[sides] >= level
    one, other = np.moveaxis(sides[above[..., 0] != above[..., 1]], -1, 0)
    share = (level - values[one]) / (values[other] - values[one])
    return np.asarray((places[one] + share[:, None] * (places[other] - places[one])).reshape(-1, 2, 2))
