"""Smooth maps from the plane of an old map to true places, fitted to control points, and wrong control points.

The models are linear in the true coordinates: a matrix H takes these to the fitted ones, and its diagonal gives the
residual of each point from the fit without it. Polynomials and splines are fitted in the coordinates of the old map's
affine fit, so that no result depends on the old map's units and axes.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from projdist._typing import AnyArray, BoolArray, FloatArray
from projdist.applications.oldmaps.control_points import ControlPoints
from projdist.matrices import Affine
from projdist.support import check_choice, check_number

_CHUNK = 1 << 20  # values of terms computed at a time
_SMALLEST = 1e-13  # of the largest eigenvalue of a spline: smaller ones are rounding
_LEAST_REST = 1e-9  # residual degrees of freedom: fewer are rounding
_SMOOTHINGS = 121  # tried between interpolation and the affine map, and again between the neighbours of the best


def affine_fit(points: ControlPoints) -> Affine:
    """The least-squares affine map from the old map to the true places."""
    middle, truth = points.old.mean(axis=0), points.new.mean(axis=0)
    matrix = np.linalg.lstsq(points.old - middle, points.new - truth, rcond=None)[0].T
    return Affine(matrix, truth - matrix @ middle)


def helmert_fit(points: ControlPoints) -> Affine:
    """The least-squares similarity: rotation, scale and shift, after a reflection of y if the old map is mirrored."""
    middle, truth = points.old.mean(axis=0), points.new.mean(axis=0)
    flip = np.diag([1.0, np.sign(np.linalg.det(affine_fit(points).matrix))])
    z, w = ((places @ [1.0, 1.0j]) for places in ((points.old - middle) @ flip, points.new - truth))
    factor = np.vdot(z, w) / np.vdot(z, z)
    matrix = np.array([[factor.real, -factor.imag], [factor.imag, factor.real]]) @ flip
    return Affine(matrix, truth - matrix @ middle)


@dataclass(frozen=True)
class Monomials:
    """The terms x^i y^j of degree i + j up to `degree`."""

    degree: int

    @property
    def powers(self) -> list[tuple[int, int]]:
        """The exponents i, j."""
        return [(total - j, j) for total in range(self.degree + 1) for j in range(total + 1)]

    def values(self, u: FloatArray) -> FloatArray:
        """Values (m, k) at places (m, 2)."""
        return np.stack([u[:, 0] ** i * u[:, 1] ** j for i, j in self.powers], axis=-1)

    def gradients(self, u: FloatArray) -> FloatArray:
        """Gradients (m, k, 2) at places (m, 2)."""
        x, y = u.T
        along = [(i * x ** max(i - 1, 0) * y**j, j * x**i * y ** max(j - 1, 0)) for i, j in self.powers]
        return np.moveaxis(np.array(along), -1, 0)


@dataclass(frozen=True, eq=False)
class Spline:
    """The terms of the thin-plate spline (Duchon 1977): 1, x, y, and r^2 ln r about each of the knots (n, 2)."""

    knots: FloatArray

    def values(self, u: FloatArray) -> FloatArray:
        """Values (m, 3 + n) at places (m, 2)."""
        return np.concatenate([np.ones((len(u), 1)), u, _kernel(u, self.knots)], axis=1)

    def gradients(self, u: FloatArray) -> FloatArray:
        """Gradients (m, 3 + n, 2) at places (m, 2)."""
        away = u[:, None] - self.knots
        plane = np.broadcast_to([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], (len(u), 3, 2))
        return np.concatenate([plane, (_log((away**2).sum(axis=-1)) + 1.0)[..., None] * away], axis=1)


def _log(square: FloatArray) -> FloatArray:
    """The logarithm, 0 at 0, where it is multiplied by 0."""
    return np.log(np.where(square > 0, square, 1.0))


@dataclass(frozen=True, eq=False, kw_only=True)
class Fit:
    """A map from the plane of an old map to true places."""

    model: str
    smoothing: float | None  #: of a spline
    freedom: float  #: parameters per coordinate, for a smooth spline the effective number, the trace of H
    rest: float  #: residual degrees of freedom, the trace of (1 - H)^2
    plane: Affine
    terms: Monomials | Spline
    coefficients: FloatArray
    residuals: FloatArray  #: (n, 2), true minus fitted places of the points
    left_out: FloatArray  #: the same for the map fitted to the other points; NaN if these do not suffice
    #: Turns derivatives (k, 2) of a number by the coefficients into those by the points' true coordinates (n, 2).
    influence: Callable[[FloatArray], FloatArray]

    @property
    def noise(self) -> float:
        """Standard deviation of a true coordinate, from the residuals; NaN without residual degrees of freedom."""
        if not self.rest > _LEAST_REST:
            return float("nan")
        return float(np.sqrt((self.residuals**2).sum() / (2.0 * self.rest)))

    def __call__(self, old: FloatArray) -> FloatArray:
        """True places (m, 2) of places on the old map."""
        return np.concatenate([self.terms.values(part) @ self.coefficients for part in self._parts(self.plane(old))])

    def jacobian(self, old: FloatArray) -> FloatArray:
        """Derivatives (m, 2, 2) of the true place by the place on the old map, at places (m, 2)."""
        found = [self.terms.gradients(part).swapaxes(1, 2) @ self.coefficients for part in self._parts(self.plane(old))]
        return np.asarray(np.concatenate(found).swapaxes(1, 2) @ self.plane.matrix)

    def standard_error(self, old: FloatArray, by_jacobian: FloatArray) -> float:
        """Standard error of a number with the derivatives (m, 2, 2) by the Jacobians at places (m, 2)."""
        # The errors of the points' true coordinates are taken as independent and equally large, as the residuals are.
        u, slopes = self.plane(old), by_jacobian @ self.plane.matrix.T
        parts = np.zeros_like(self.coefficients)
        for part, slope in zip(self._parts(u), self._parts(slopes), strict=True):
            parts += np.einsum("mkj,mcj->kc", self.terms.gradients(part), slope)
        return self.noise * float(np.sqrt((self.influence(parts) ** 2).sum()))

    def _parts(self, u: FloatArray) -> list[FloatArray]:
        """Places in portions whose terms fit into memory."""
        return np.array_split(u, u.shape[0] * len(self.coefficients) // _CHUNK + 1)


def fit(points: ControlPoints, model: str = "tps", smoothing: float | None = None) -> Fit:
    """The map of a model, fitted to control points.

    "helmert", "affine", "polynomial2" and "polynomial3" minimise the sum of squares; "tps", the thin-plate spline,
    that plus `smoothing` times its bending, with lengths in units of the points' standard deviation along an axis after
    the affine fit, by default the least by generalized cross-validation (Craven & Wahba 1979). Raises ValueError.
    """
    check_choice("model", model, MODELS)
    if smoothing is not None and (not 0.0 <= check_number("smoothing", smoothing) < np.inf or model != "tps"):
        message = f"Invalid smoothing '{smoothing:g}' of model '{model}'. It is for tps, finite and not negative."
        raise ValueError(message)
    return MODELS[model](points, smoothing)


def normalised(points: ControlPoints, linear: Affine | None = None) -> Affine:
    """A linear fit, by default affine, followed by a shift and a scale that give the points mean 0 and variance 1."""
    linear = affine_fit(points) if linear is None else linear
    registered = linear(points.old)
    middle = registered.mean(axis=0)
    unit = np.sqrt(((registered - middle) ** 2).mean())
    return Affine(linear.matrix / unit, (linear.shift - middle) / unit)


def _least_squares(points: ControlPoints, leverage: FloatArray, freedom: int, **parts: Any) -> Fit:
    """The fit with the given parts; `leverage` is the diagonal of H."""
    residuals = points.new - parts["terms"].values(parts["plane"](points.old)) @ parts["coefficients"]
    rest = 1.0 - leverage
    left_out = residuals / np.where(rest > 1e-9, rest, np.nan)[:, None]
    parts |= {"freedom": float(freedom), "rest": float(len(residuals) - freedom)}
    return Fit(smoothing=None, residuals=residuals, left_out=left_out, **parts)


def _similarity(points: ControlPoints, smoothing: None) -> Fit:
    """The fit of the model helmert."""
    plane = normalised(points, helmert_fit(points))
    u = plane(points.old)
    leverage = 1.0 / len(u) + (u**2).sum(axis=1) / (u**2).sum()
    unit = np.sqrt(abs(np.linalg.det(helmert_fit(points).matrix) / np.linalg.det(plane.matrix)))
    coefficients = np.vstack([points.new.mean(axis=0), unit * np.eye(2)])

    def influence(parts: FloatArray) -> FloatArray:
        scaled, turned = (u, u @ [[0.0, 1.0], [-1.0, 0.0]])
        by_scale, by_turn = parts[1, 0] + parts[2, 1], parts[1, 1] - parts[2, 0]
        return np.asarray(parts[0] / len(u) + (by_scale * scaled + by_turn * turned) / (u**2).sum())

    parts = {"model": "helmert", "plane": plane, "terms": Monomials(1), "coefficients": coefficients}
    return _least_squares(points, leverage, 2, influence=influence, **parts)


def _polynomial(degree: int, model: str, points: ControlPoints, smoothing: None) -> Fit:
    """The fit of polynomials of a degree."""
    plane, terms = normalised(points), Monomials(degree)
    basis = terms.values(plane(points.old))
    count = basis.shape[1]
    if np.linalg.matrix_rank(basis) < count:
        message = f"Invalid control points for model '{model}'. At least {count} that determine it are needed."
        raise ValueError(message)
    Q, R = np.linalg.qr(basis)

    def influence(parts: FloatArray) -> FloatArray:
        return np.asarray(Q @ np.linalg.solve(R.T, parts))

    parts = {"model": model, "plane": plane, "terms": terms, "coefficients": np.linalg.solve(R, Q.T @ points.new)}
    return _least_squares(points, (Q**2).sum(axis=1), count, influence=influence, **parts)


class SplineModes:
    """The modes of splines of an order (2: thin-plate) through places u, and the bending of each (Wahba 1990).

    The weights of the knots are M (B + smoothing)^-1 M^T y, with B the bending and the columns of M a basis of the
    space orthogonal to polynomials below the order; `flat` is the number of these polynomials.
    """

    def __init__(self, u: FloatArray, order: int = 2) -> None:
        polynomials = Monomials(order - 1).values(u)
        self.flat = polynomials.shape[1]
        self.Q, self.R = np.linalg.qr(polynomials)
        self.kernel = _kernel(u, u, order)
        part = self.kernel @ self.Q
        part -= 0.5 * self.Q @ (self.Q.T @ part)
        bent = self.kernel - part @ self.Q.T - self.Q @ part.T
        # The polynomials, which do not bend, get a bending below 0, so that they come first.
        bending, modes = np.linalg.eigh(bent - np.linalg.norm(bent) * (self.Q @ self.Q.T))
        self.bending, self.modes = bending[self.flat :], modes[:, self.flat :]
        self.is_singular = bool(self.bending.size and self.bending[0] <= _SMALLEST * self.bending[-1])
        self.bending = np.maximum(self.bending, _SMALLEST * self.bending.max(initial=0.0))

    def cross_validated(self, y: AnyArray) -> float:
        """The smoothing with the least n RSS / tr(1 - H)^2, between interpolation and the polynomial."""
        parts = self.modes.T @ y
        square = (np.abs(parts.reshape(len(parts), -1)) ** 2).sum(axis=1)
        low, high = np.log(1e-2 * self.bending[0]), np.log(1e4 * self.bending[-1])
        for _ in range(2):
            tried = np.linspace(low, high, _SMOOTHINGS)
            rest = 1.0 / (1.0 + np.exp(np.log(self.bending) - tried[:, None]))  # share that each mode leaves
            score = (rest**2 @ square) / rest.sum(axis=1) ** 2
            best = int(np.argmin(score))
            low, high = tried[max(best - 1, 0)], tried[min(best + 1, _SMOOTHINGS - 1)]
        return float(np.exp(tried[best]))

    def root(self, smoothing: float) -> FloatArray:
        """F with 1 - H = F F^T, the matrix from true coordinates to residuals."""
        return np.asarray(self.modes * np.sqrt(smoothing / (self.bending + smoothing)))


def _kernel(u: FloatArray, knots: FloatArray, order: int = 2) -> FloatArray:
    """r^(2 order - 2) ln r, with the sign that makes bending positive."""
    square = ((u[:, None] - knots) ** 2).sum(axis=-1)
    return np.asarray(0.5 * (-1.0) ** order * square ** (order - 1) * _log(square))


def _spline(points: ControlPoints, smoothing: float | None) -> Fit:
    """The fit of the model tps."""
    if len(points.old) <= 3:
        raise ValueError("Invalid control points for model 'tps'. There must be 4 or more.")
    plane = normalised(points)
    u = plane(points.old)
    spline = SplineModes(u)
    if smoothing == 0.0 and spline.is_singular:
        distance = ((u[:, None] - u) ** 2).sum(axis=-1)
        np.fill_diagonal(distance, np.inf)
        one, other = divmod(int(np.argmin(distance)), len(u))
        both = f"'{points.names[one]}' and '{points.names[other]}'"
        raise ValueError(f"Invalid smoothing '0'. Points {both} are too close on the old map to be interpolated.")
    if smoothing is None:
        smoothing = spline.cross_validated(points.new)
    inverse = 1.0 / (spline.bending + smoothing)
    weights = (spline.modes * inverse) @ (spline.modes.T @ points.new)
    flat = np.linalg.solve(spline.R, spline.Q.T @ (points.new - spline.kernel @ weights))

    def influence(parts: FloatArray) -> FloatArray:
        flat = spline.Q @ np.linalg.solve(spline.R.T, parts[:3])
        return np.asarray(flat + (spline.modes * inverse) @ (spline.modes.T @ (parts[3:] - spline.kernel @ flat)))

    return Fit(
        model="tps",
        smoothing=smoothing,
        freedom=len(u) - float((smoothing * inverse).sum()),
        rest=float(((smoothing * inverse) ** 2).sum()),
        plane=plane,
        terms=Spline(u),
        coefficients=np.vstack([flat, weights]),
        residuals=smoothing * weights,
        left_out=weights / (spline.modes**2 @ inverse)[:, None],
        influence=influence,
    )


MODELS: dict[str, Callable[..., Fit]] = {
    "helmert": _similarity,
    "affine": functools.partial(_polynomial, 1, "affine"),
    "polynomial2": functools.partial(_polynomial, 2, "polynomial2"),
    "polynomial3": functools.partial(_polynomial, 3, "polynomial3"),
    "tps": _spline,
}


# ---- outliers ------------------------------------------------------------------------------------

FALSE_ALARM = 0.05  # probability that a point is named in a set without wrong ones
_ORDERS = (2, 3)
_MOST = 4  # one point in four may be wrong
_HIDDEN = 10  # one point in ten is left out to find others that it masks
_ROUNDING = 1e-9  # of the extent of true places: residuals below it are rounding


class _Residuals(NamedTuple):
    """Squared residuals from one spline, their variances and degrees of freedom."""

    square: FloatArray
    variance: FloatArray
    freedom: int


def wrong_points(points: ControlPoints) -> BoolArray:
    """True for wrong points."""
    # The worst points are left out one by one, a tenth of all points beyond the last wrong one, so that none masks
    # another. A quarter of those up to the last wrong one are removed and the splines' smoothing is found anew, until
    # no point is wrong. Points that then fit the others are taken back.
    kept = np.ones(len(points.old), dtype=bool)
    while len(found := _worst(points.chosen(kept))):
        kept[np.flatnonzero(kept)[found]] = False
    while not kept.all() and (fitting := _fitting(points, kept)).any():
        kept |= fitting
    return np.asarray(~kept)


def _plane(points: ControlPoints, kept: BoolArray) -> tuple[FloatArray, AnyArray, float]:
    """Places normalised by the kept points, true places as complex numbers about their mean, and their rounding."""
    chosen = points.chosen(kept)
    truth = points.new - chosen.new.mean(axis=0)
    return normalised(chosen)(points.old), truth @ [1.0, 1.0j], _ROUNDING * float(np.ptp(chosen.new))


def _worst(points: ControlPoints) -> list[int]:
    """Numbers of the wrong points, only the worst quarter of them, by splines through all points."""
    count = len(points.old)
    u, z, rounding = _plane(points, np.ones(count, dtype=bool))
    splines = [SplineModes(u, order) for order in _ORDERS]
    flat = max(spline.flat for spline in splines)
    if count - 1 <= flat:
        return []
    most = count // _MOST
    others = [_ReducedSpline(spline, z, most) for spline in splines]
    out: list[int] = []
    wrong = 0
    while len(out) < min(most, wrong + max(count // _HIDDEN, 1)) and count - len(out) - 1 > flat:
        chance = _log_probability([one.residuals() for one in others], rounding)
        chance[out] = np.inf
        worst = int(np.argmin(chance))
        out.append(worst)
        if chance[worst] < np.log(FALSE_ALARM / (count - len(out) + 1)):
            wrong = len(out)
        for one in others:
            one.leave_out(worst)
    return out[: -(-wrong // _MOST)]


class _ReducedSpline:
    """The spline of cross-validated smoothing through points, of which up to `most` are left out one by one.

    Without the points D the matrix G = 1 - H is G - G_D (G_DD)^-1 G_D^T: each is a step of a Cholesky factorisation.
    """

    def __init__(self, spline: SplineModes, z: AnyArray, most: int) -> None:
        self._z, self._flat = z, spline.flat
        self._root = spline.root(spline.cross_validated(z))
        self._diagonal = (self._root**2).sum(axis=1)
        self._product = self._root @ (self._root.T @ z)
        self._out: list[int] = []
        self._columns, self._pivots = np.empty((len(z), most), order="F"), np.empty(most)

    def leave_out(self, point: int) -> None:
        """Leave out one more point, with the same smoothing."""
        known = len(self._out)
        columns, pivots = self._columns[:, :known], self._pivots[:known]
        column = self._root @ self._root[point] - columns @ (columns[point] / pivots)
        pivot = column[point]
        self._product -= column * (self._product[point] / pivot)
        self._diagonal -= column**2 / pivot
        self._columns[:, known], self._pivots[known] = column, pivot
        self._out.append(point)

    def residuals(self) -> _Residuals:
        """Residuals of the points that remain, each from the spline through the others; 0 for points left out."""
        square, diagonal = np.abs(self._product) ** 2, self._diagonal.copy()
        square[self._out], diagonal[self._out] = 0.0, 1.0
        own = square / diagonal
        freedom = len(self._z) - len(self._out) - self._flat - 1
        kept = np.vdot(self._z, self._product) - np.vdot(self._z[self._out], self._product[self._out])
        return _Residuals(own / diagonal, np.maximum(kept.real - own, 0.0) / freedom / diagonal, freedom)


def _fitting(points: ControlPoints, kept: BoolArray) -> BoolArray:
    """True for the points that are not kept although they fit the kept ones."""
    u, z, rounding = _plane(points, kept)
    out, count = np.flatnonzero(~kept), int(kept.sum())
    residuals = []
    for order in _ORDERS:
        spline = SplineModes(u, order)
        root = spline.root(SplineModes(u[kept], order).cross_validated(z[kept]))
        product = root @ (root.T @ z)
        # Block by block: the residuals of all these points from the spline through the others.
        covariance = np.linalg.inv(root[out] @ root[out].T)
        away = covariance @ product[out]
        rest = max(np.vdot(z, product).real - np.vdot(product[out], away).real, 0.0)
        freedom = count - spline.flat
        residuals.append(_Residuals(np.abs(away) ** 2, rest / freedom * covariance.diagonal(), freedom))
    fitting = np.zeros(len(kept), dtype=bool)
    fitting[out] = _log_probability(residuals, rounding) >= np.log(FALSE_ALARM / (count + 1))
    return fitting


def _log_probability(residuals: list[_Residuals], rounding: float) -> FloatArray:
    """Logarithms of the probabilities of residuals as large, by each point's smallest residual and largest variance."""
    squares, variances, freedoms = zip(*residuals, strict=True)
    variance, freedom = np.maximum(np.max(variances, axis=0), rounding**2), min(freedoms)
    return np.asarray(-freedom * np.log1p(np.min(squares, axis=0) / variance / freedom))
