"""Maps of the plane that correct a projection, PROJ's operations for them, and the mean of several."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray
from projdist.designs.base_maps import check_degree
from projdist.designs.newton import EnergyMinimum, minimise_energy
from projdist.earth import Ellipsoid, wrapped
from projdist.matrices import Energy, check_weights, mdt
from projdist.numerics import PlanePolynomials
from projdist.projections import Projection
from projdist.support import Answer, check_numbers, schema

_LIMITS = "+range=1e8 +inv_tolerance=1e-6"  # metres


def _similar(coefficients: FloatArray, similarity: complex, shift: complex) -> FloatArray:
    """Coefficients (2, d + 1, d + 1) of x and y after a similarity of x + i y."""
    c, s = similarity.real, similarity.imag
    found = np.tensordot(np.array([[c, -s], [s, c]]), coefficients, axes=1)
    found[:, 0, 0] += (shift.real, shift.imag)
    return found


@dataclass(frozen=True)
class PolynomialMap:
    """x and y as polynomials of u = (x - x0) / size, v = (y - y0) / size: coefficients (2, d + 1, d + 1) of u^i v^j."""

    origin: complex
    size: float
    coefficients: FloatArray

    def at(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New coordinates and Jacobians."""
        u, v = (x - self.origin.real) / self.size, (y - self.origin.imag) / self.size
        polyval, polyder = np.polynomial.polynomial.polyval2d, np.polynomial.polynomial.polyder
        new_x, new_y = (polyval(u, v, c) for c in self.coefficients)
        slopes = (polyder(self.coefficients, axis=axis) for axis in (1, 2))  # by u and by v
        J = np.stack([np.stack([polyval(u, v, c) for c in slope], axis=-1) for slope in slopes], axis=-1)
        return new_x, new_y, J / self.size

    def moved(self, similarity: complex, shift: complex) -> PolynomialMap:
        """The map followed by a similarity."""
        return replace(self, coefficients=_similar(self.coefficients, similarity, shift))

    @property
    def steps(self) -> tuple[str, ...]:
        """PROJ's operations: one horner."""
        degree = self.coefficients.shape[1] - 1
        powers = np.add.outer(np.arange(degree + 1), np.arange(degree + 1))
        u, v = self.coefficients / self.size**powers
        origin = _listed(self.origin.real, self.origin.imag)
        return (f"+proj=horner +deg={degree} {_LIMITS} {_horner('fwd', origin, u, v)}",)


def _horner(way: str, origin: str, u: FloatArray, v: FloatArray) -> str:
    """PROJ's parameters of a polynomial with coefficients (d + 1, d + 1) of x^i y^j."""
    count = len(u)
    by_u = [u[i, j] for j in range(count) for i in range(count - j)]
    by_v = [v[i, j] for i in range(count) for j in range(count - i)]
    return f"+{way}_origin={origin} +{way}_u={_listed(*by_u)} +{way}_v={_listed(*by_v)}"


def _listed(*values: float) -> str:
    """Numbers as the shortest texts that are read back unchanged."""
    return ",".join(repr(float(value)) for value in values)


@dataclass(frozen=True)
class ComplexPolynomial:
    """A conformal map: x + i y as a polynomial of t = (z - z0) / size, z = x + i y; coefficients (d + 1,) of t^k."""

    origin: complex
    size: float
    coefficients: Any
    _: KW_ONLY
    limits: str = _LIMITS

    def at(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New coordinates and Jacobians."""
        return _parts(*self.value(x + 1j * y))

    def value(self, z: Any) -> tuple[Any, Any]:
        """The complex coordinates and their derivatives."""
        t, polynomial = (z - self.origin) / self.size, np.polynomial.polynomial
        return polynomial.polyval(t, self.coefficients), (
            polynomial.polyval(t, polynomial.polyder(self.coefficients)) / self.size
        )

    def moved(self, similarity: complex, shift: complex) -> ComplexPolynomial:
        """The map followed by a similarity."""
        coefficients = similarity * self.coefficients
        coefficients[0] += shift
        return replace(self, coefficients=coefficients)

    @property
    def steps(self) -> tuple[str, ...]:
        """PROJ's operations: one complex horner, whose real part is north."""
        k = np.arange(len(self.coefficients))
        northern = 1j * (-1j) ** k * np.conj(self.coefficients / self.size**k)
        pairs = np.stack([northern.real, northern.imag], axis=-1).ravel()
        return (
            f"+proj=horner +deg={k[-1]} {self.limits} +fwd_origin={_listed(self.origin.real, self.origin.imag)} "
            f"+fwd_c={_listed(*pairs)}",
        )


def _parts(z: Any, slope: Any) -> tuple[FloatArray, FloatArray, FloatArray]:
    """x, y and the Jacobians (n, 2, 2) of complex coordinates and their derivatives."""
    columns = [np.stack([w.real, w.imag], axis=-1) for w in (slope, 1j * slope)]
    return z.real, z.imag, np.stack(columns, axis=-1)


@dataclass(frozen=True)
class ContinuedFraction:
    """A conformal map: complex polynomials one after the other, with 1 / z between them."""

    terms: tuple[ComplexPolynomial, ...]

    def at(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New coordinates and Jacobians."""
        return _parts(*self.value(x + 1j * y))

    def value(self, z: Any) -> tuple[Any, Any]:
        """The complex coordinates and their derivatives."""
        z, slope = self.terms[0].value(z)
        for term in self.terms[1:]:
            slope, z = -slope / z**2, 1.0 / z
            z, own = term.value(z)
            slope = slope * own
        return z, slope

    def then(self, last: ComplexPolynomial) -> ContinuedFraction:
        """The map followed by a polynomial, which replaces the similarity at its end."""
        end = self.terms[-1]
        (shift, factor), size = end.coefficients, end.size * last.size
        given = replace(last, origin=(last.origin - shift) * end.size / factor.real, size=size / factor.real)
        return replace(self, terms=(*self.terms[:-1], replace(given, limits=end.limits)))

    def moved(self, similarity: complex, shift: complex) -> ContinuedFraction:
        """The map followed by a similarity."""
        return replace(self, terms=(*self.terms[:-1], self.terms[-1].moved(similarity, shift)))

    @property
    def steps(self) -> tuple[str, ...]:
        """PROJ's operations: a complex horner a term; between them two polar stereographic maps, which give 1 / z."""
        inversion = ("+inv +proj=stere +lat_0=90 +R=0.5", "+proj=stere +lat_0=-90 +R=0.5")
        first, *others = (term.steps for term in self.terms)
        return (*first, *(step for own in others for step in (*inversion, *own)))


@dataclass(frozen=True)
class Shears:
    """An equal-area map: shears one after the other, about an origin, then a similarity.

    Each turns the plane by minus its angle, moves x by size times a polynomial (d + 1,) of y / size, and turns back.
    """

    origin: complex
    size: float
    angles: FloatArray
    coefficients: FloatArray
    _: KW_ONLY
    similarity: complex = 1.0
    shift: complex = 0.0

    def at(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New coordinates and Jacobians."""
        z = (x + 1j * y - self.origin) / self.size
        columns = np.stack([np.ones_like(z), np.full_like(z, 1j)], axis=-1)
        for angle, coefficients in zip(self.angles, self.coefficients, strict=True):
            turn = np.exp(-1j * angle)
            z, columns = z * turn, columns * turn
            slope = np.polynomial.polynomial.polyval(z.imag, np.polynomial.polynomial.polyder(coefficients))
            z = z + np.polynomial.polynomial.polyval(z.imag, coefficients)
            columns = columns + slope[..., None] * columns.imag
            z, columns = z / turn, columns / turn
        z, columns = self.size * self.similarity * z + self.shift, columns * self.similarity
        return z.real, z.imag, np.stack([columns.real, columns.imag], axis=-2)

    def moved(self, similarity: complex, shift: complex) -> Shears:
        """The map followed by a similarity."""
        return replace(self, similarity=similarity * self.similarity, shift=similarity * self.shift + shift)

    @property
    def steps(self) -> tuple[str, ...]:
        """PROJ's operations: for each shear a rotation and a horner with its exact inverse, then the similarity."""
        steps, turned = [_affine(np.exp(-1j * self.angles[0]), -self.origin * np.exp(-1j * self.angles[0]))], 0.0
        for k, (angle, coefficients) in enumerate(zip(self.angles, self.coefficients, strict=True)):
            if k:
                steps.append(_affine(np.exp(1j * (turned - angle)), 0.0))
            steps.append(_shear(self.size * coefficients / self.size ** np.arange(len(coefficients))))
            turned = angle
        steps.append(_affine(self.similarity * np.exp(1j * turned), self.shift))
        return tuple(steps)


def _affine(similarity: complex, shift: complex) -> str:
    c, s = float(np.real(similarity)), float(np.imag(similarity))
    x, y = float(np.real(shift)), float(np.imag(shift))
    return f"+proj=affine +xoff={x!r} +yoff={y!r} +s11={c!r} +s12={-s!r} +s21={s!r} +s22={c!r}"


def _shear(coefficients: FloatArray) -> str:
    """PROJ's horner for x + f(y), y, with its inverse."""
    degree = len(coefficients) - 1
    moved, kept = np.zeros((2, degree + 1, degree + 1))
    moved[0] = coefficients
    back = -moved
    moved[1, 0] = back[1, 0] = kept[0, 1] = 1.0
    texts = f"{_horner('fwd', '0,0', moved, kept)} {_horner('inv', '0,0', back, kept)}"
    return f"+proj=horner +deg={degree} +range=1e8 {texts}"


PlaneMap = PolynomialMap | ComplexPolynomial | ContinuedFraction | Shears


# ---- projections as functions --------------------------------------------------------------------

Sides = tuple[float, float, float, float]
_BESIDE = 1e-9  # degrees: rounding of points on the edge


def averaged(
    maps: Sequence[Projection], factors: Iterable[complex], lon: FloatArray, lat: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """x, y in metres: the sum of x + i y of maps, each times a complex factor, its share and turn."""
    z = np.zeros(np.shape(lon), dtype=complex)
    for projection, factor in zip(maps, factors, strict=True):
        x, y = projection(lon, lat)
        z = z + factor * (x + 1j * y)
    return z.real, z.imag


@dataclass(frozen=True, eq=False)
class Corrected:
    """A base projection followed by a map of its plane."""

    base: Projection
    plane_map: PolynomialMap

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, y in metres."""
        x, y = self.base(lon, lat)
        return self.plane_map.at(x, y)[:2]

    def moved(self, turn: complex, shift: complex) -> Corrected:
        """The map followed by a rotation and a shift of x + i y."""
        return Corrected(self.base, self.plane_map.moved(turn, shift))


@dataclass(frozen=True, eq=False)
class BoxPolynomials:
    """x, y in metres as sums of T_i(s) T_j(t), Chebyshev's polynomials, with coefficients (2, d + 1, d + 1).

    s and t run from -1 to 1 from west to east and from south to north of a box in degrees; beyond x and y are NaN.
    """

    box: Sides
    coefficients: FloatArray

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, y in metres; NaN outside of the box."""
        s, t = _in_box(self.box, lon, lat)
        x, y = (np.polynomial.chebyshev.chebval2d(s, t, c) for c in self.coefficients)
        west, south, east, north = self.box
        reach = 1.0 + 2.0 * _BESIDE / min(east - west, north - south)
        outside = ~((np.abs(s) <= reach) & (np.abs(t) <= reach))
        return np.where(outside, np.nan, x), np.where(outside, np.nan, y)

    def moved(self, turn: complex, shift: complex) -> BoxPolynomials:
        """The map followed by a rotation and a shift of x + i y."""
        return replace(self, coefficients=_similar(self.coefficients, turn, shift))


def box_gradients(box: Sides, degree: int, lon: FloatArray, lat: FloatArray, ellipsoid: Ellipsoid) -> FloatArray:
    """Derivatives (n, (degree + 1)^2, 2) of T_i(s) T_j(t) by metres east and north, T_0 T_0 first."""
    s, t = _in_box(box, lon, lat)
    west, south, east, north = box
    meridian, vertical = ellipsoid.radii(lat)
    chebyshev = np.polynomial.chebyshev
    slopes = chebyshev.chebder(np.eye(degree + 1), axis=0)
    by_s = chebyshev.chebvander(s, degree - 1) @ slopes / (0.5 * np.radians(east - west))
    by_t = chebyshev.chebvander(t, degree - 1) @ slopes / (0.5 * np.radians(north - south))
    of_s, of_t = chebyshev.chebvander(s, degree), chebyshev.chebvander(t, degree)
    eastward = by_s[:, :, None] * of_t[:, None, :] / (vertical * np.cos(np.radians(lat)))[:, None, None]
    northward = of_s[:, :, None] * by_t[:, None, :] / meridian[:, None, None]
    return np.stack([eastward, northward], axis=-1).reshape(lon.size, -1, 2)


def _in_box(box: Sides, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
    west, south, east, north = box
    away = wrapped(np.asarray(lon, dtype=float) - 0.5 * (west + east))
    return away / (0.5 * (east - west)), (lat - 0.5 * (south + north)) / (0.5 * (north - south))


# ---- plane means ---------------------------------------------------------------------------------

_ENERGY = Energy()


@dataclass(frozen=True, eq=False)
class Targets:
    """Jacobians J (k, n, 2, 2) of maps at points, weights (k,) of the maps, and weights (n,) of sum 1 of the points."""

    J: FloatArray
    counts: FloatArray
    weight: FloatArray

    @functools.cached_property
    def inverses(self) -> FloatArray:
        """J^-1 (k, n, 2, 2)."""
        return np.asarray(np.linalg.inv(self.J), dtype=float)

    def total(self, J: FloatArray) -> float:
        """The sum over the maps of their weight times the mean of Dist_F(J J_i^-1)^2, for Jacobians (n, 2, 2)."""
        squares = _ENERGY.value((J @ self.inverses).reshape(-1, 2, 2)).reshape(self.J.shape[:2])
        return float(self.counts @ squares @ self.weight)

    def mean_metric(self) -> FloatArray:
        """Upper triangular J (n, 2, 2) whose metrics J^T J are the Frechet means of the maps' metrics at each point."""
        return np.swapaxes(mdt(self.J.transpose(1, 0, 3, 2), self.counts).T, 1, 2)

    def best_linear(self) -> FloatArray:
        """The upper triangular J (2, 2) of the least total, one for all points."""
        every = np.swapaxes(self.J, 2, 3).reshape(-1, 2, 2)
        return np.asarray(mdt(every, np.outer(self.counts, self.weight).ravel()).T.T)

    def nearest(self, gradients: FloatArray, start: FloatArray) -> EnergyMinimum:
        """The coefficients C (2, m) of J = C g, with g (n, m, 2), of the least total, from a start without folds."""
        stacked = np.concatenate([gradients @ inverse for inverse in self.inverses])
        return minimise_energy(_ENERGY, stacked, np.outer(self.counts, self.weight).ravel(), start)

    def not_elliptic(self, J: FloatArray) -> BoolArray:
        """True for points (n,) at which the energy is not elliptic for one of the maps."""
        energies = _ENERGY.expansion((J @ self.inverses).reshape(-1, 2, 2))
        return np.asarray(~energies.is_elliptic().reshape(self.J.shape[:2]).all(axis=0))


def common_turn(J: FloatArray, weight: FloatArray) -> complex:
    """The mean rotation of Jacobians (n, 2, 2), by their polar factors; 1 if undefined."""
    z = (J[:, 0, 0] + J[:, 1, 1]) + 1j * (J[:, 1, 0] - J[:, 0, 1])
    mean = complex(np.sum(weight * z / np.abs(z)))
    return mean / abs(mean) if abs(mean) > 0.0 else 1.0 + 0.0j


# ---- means of Jacobians in a plane ---------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PlaneMean(Answer):
    """The mean of maps of a plane, as polynomials of it; call it with coordinates x, y for the map's.

    Its mean over the points is 0, 0, and its rotation the mean of the maps'.
    """

    degree: int
    weights: tuple[float, ...]
    total: float  #: sum over the maps of weight times the mean squared Fisher distance at the points
    bound: float  #: the same for the mean metric of each point
    #: With coefficients (2, d + 1, d + 1) of u^i v^j, u = (x - x0) / size, v = (y - y0) / size.
    plane_map: PolynomialMap = field(metadata=schema(of=("origin", "size", "coefficients"), spread=True))

    def __call__(self, x: ArrayLike, y: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """The map's coordinates."""
        return self.plane_map.at(np.asarray(x, dtype=float), np.asarray(y, dtype=float))[:2]

    def jacobian(self, x: ArrayLike, y: ArrayLike) -> FloatArray:
        """Derivatives (n, 2, 2) by x and y."""
        return self.plane_map.at(np.asarray(x, dtype=float), np.asarray(y, dtype=float))[2]

    @property
    def coefficients(self) -> FloatArray:
        """Coefficients of u^i v^j."""
        return self.plane_map.coefficients

    def _line(self) -> str:
        return f"mean of {len(self.weights)} maps, degree {self.degree}: total {self.total:.6g}, bound {self.bound:.6g}"

    def to_dict(self) -> dict[str, Any]:
        """The fields, and the polynomials' origin, size and coefficients."""
        origin = self.plane_map.origin
        return super().to_dict() | {"origin": [origin.real, origin.imag]}

    def _table(self) -> list[dict[str, Any]]:
        return [{"map": "bound", "total": self.bound}, {"map": "mean", "total": self.total}]


def mean_plane_map(
    x: ArrayLike,
    y: ArrayLike,
    jacobians: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    area: ArrayLike | None = None,
    degree: int = 8,
) -> PlaneMean:
    """The mean of maps of one plane domain, given by their Jacobians at points: the analogue of the MDT for C^1 maps.

    Of all polynomials f of a degree it has the least sum, over the maps i, of weight_i times the mean of
    Dist_F(J_f J_i^-1)^2 over the points. It is for maps what `mdt` is for matrices: for linear maps it is the
    transposed mean distorting transformation of their transposed matrices. That the minimum is unique is not proven.

    Parameters
    ----------
    x, y : array_like (n,)
        Points of the domain, such as the nodes of a quadrature rule, in any unit.
    jacobians : array_like (k, n, 2, 2)
        Jacobians of k maps by x and y: of homographies, an old map, a projection after another. All determinants must
        be positive; mirrored maps must be mirrored back first.
    weights : array_like (k,), optional
        Weights of the maps; by default 1.
    area : array_like (n,), optional
        Weights of the points; by default equal.
    degree : int, default 8
        Degree of the polynomials.

    Returns
    -------
    PlaneMean

    Raises
    ------
    ValueError
        For other shapes, Jacobians that are not finite or mirrored, and points that do not determine the polynomials.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the mean of linear maps.
    H. Karcher 1977, Communications on Pure and Applied Mathematics 30: the mean of points of a Riemannian manifold.

    Examples
    --------
    The mean of a map that doubles x and one that doubles y enlarges both by the root of 2:

    >>> import numpy as np
    >>> x, y = np.random.default_rng(1).uniform(-1, 1, (2, 50))
    >>> J = np.tile([[[[2.0, 0], [0, 1]]], [[[1.0, 0], [0, 2]]]], (1, 50, 1, 1))
    >>> found = mean_plane_map(x, y, J, degree=2)
    >>> np.round(found.jacobian([0], [0]), 6) + 0.0
    array([[[1.414214, 0.      ],
            [0.      , 1.414214]]])
    """
    x, y = (check_numbers("coordinates", values) for values in (x, y))
    J = check_numbers("Jacobians", jacobians)
    if x.ndim != 1 or x.shape != y.shape or J.ndim != 4 or J.shape[1:] != (x.size, 2, 2) or not J.size:
        raise ValueError(
            f"Invalid shapes {x.shape} and {y.shape} of coordinates and {J.shape} of Jacobians. They must be (n,), "
            "(n,) and (k, n, 2, 2)."
        )
    if not (np.isfinite(J).all() and (np.linalg.det(J) > 0.0).all() and np.isfinite(x + y).all()):
        raise ValueError("Invalid Jacobians or coordinates. All must be finite, and all determinants positive.")
    weight = np.array(check_weights(area, x.shape))
    counts = check_counts(weights, len(J))
    targets = Targets(J, counts, weight)
    plane_map = polynomial_mean(x, y, targets, check_degree(degree))
    return PlaneMean(
        degree=degree,
        weights=tuple(counts.tolist()),
        total=targets.total(plane_map.at(x, y)[2]),
        bound=targets.total(targets.mean_metric()),
        plane_map=plane_map,
    )


def check_counts(weights: Any, count: int) -> FloatArray:
    """The weights of maps: 1, or the given positive numbers; raises ValueError."""
    if weights is None:
        return np.ones(count)
    counts = check_numbers("weights", weights)
    if counts.shape != (count,):
        raise ValueError(f"Invalid shape {counts.shape} of weights. It must be ({count},), as many as maps.")
    if not (np.isfinite(counts) & (counts > 0.0)).all():
        raise ValueError("Invalid weights. They must be finite and positive.")
    return counts


def polynomial_mean(x: FloatArray, y: FloatArray, targets: Targets, degree: int) -> PolynomialMap:
    """The polynomials nearest to maps of a plane; raises ValueError if the points do not determine them."""
    w = targets.weight
    origin = complex(w @ x, w @ y)
    size = float(np.abs(x + 1j * y - origin)[w > 0.0].max(initial=0.0))
    if not size > 0.0:
        raise ValueError("All points are one.")
    u, v = (x - origin.real) / size, (y - origin.imag) / size
    basis = PlanePolynomials.over(u, v, w, degree)
    plain = (targets.best_linear() @ np.stack([u, v]) * w) @ basis.values[:, 1:]
    best = targets.nearest(basis.gradients[:, 1:] / size, size * plain)
    found = PolynomialMap(origin, size, basis.powers(np.hstack([np.zeros((2, 1)), best.place])))
    turned = (found.at(x, y)[2] @ targets.inverses).reshape(-1, 2, 2)
    turn = common_turn(turned, np.outer(targets.counts, w).ravel())
    return found.moved(turn.conjugate(), 0j)
