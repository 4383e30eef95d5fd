"""The map nearest to several: the least sum of squared Fisher distances between Jacobians at the same points.

The Jacobians J_f of the map and J_i of one of several at a point of the ground are compared plane to plane:
Dist_F(J_f J_i^-1). That is half the distance of the metrics G = J^T J in the geometry of positive definite matrices, so
that the Frechet mean of the G_i at each point is the best that a map could have there. A map has that metric only where
it is flat; its curvature accounts for the excess of a map's sum.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray
from projdist.designs.base_maps import check_degree
from projdist.designs.newton import EnergyMinimum, minimise_energy
from projdist.designs.plane_maps import PolynomialMap
from projdist.matrices import Energy, check_weights, mdt
from projdist.numerics import PlanePolynomials
from projdist.support import Answer, check_numbers

_ENERGY = Energy()


@dataclass(frozen=True, eq=False)
class Targets:
    """Jacobians J (k, n, 2, 2) of maps at points, the weights (k,) of maps, and those (n,) of points, of sum 1."""

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
        """Upper triangular J (n, 2, 2) whose J^T J are the Frechet means of the maps' at each point."""
        transposed = np.swapaxes(self.J, 2, 3)
        return np.swapaxes(mdt(np.swapaxes(transposed, 0, 1), self.counts).T, 1, 2)

    def best_linear(self) -> FloatArray:
        """The upper triangular J (2, 2) of the least total, one for all points."""
        every = np.swapaxes(self.J, 2, 3).reshape(-1, 2, 2)
        return np.asarray(mdt(every, np.outer(self.counts, self.weight).ravel()).T.T)

    def nearest(self, gradients: FloatArray, start: FloatArray) -> EnergyMinimum:
        """The coefficients C (2, m) of the least total of J = C g, g (n, m, 2), from a start without folds."""
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
    """The mean of maps of a plane, as polynomials of it.

    `total` is the sum over the maps of weight times the mean squared Fisher distance at the points, `bound` the same
    for the mean metric of each point. Call it with coordinates x, y for the map's; `jacobian` has its derivatives.
    `coefficients` (2, d + 1, d + 1) are those of u^i v^j, u = (x - x0) / size, v = (y - y0) / size with the origin
    x0, y0. Its mean over the points is 0, 0, and its rotation the mean of the maps'.
    """

    degree: int
    weights: tuple[float, ...]
    total: float
    bound: float
    plane_map: PolynomialMap

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
        return {
            "degree": self.degree,
            "weights": list(self.weights),
            "total": self.total,
            "bound": self.bound,
            "origin": [origin.real, origin.imag],
            "size": self.plane_map.size,
            "coefficients": self.coefficients.tolist(),
        }

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
    transposed mean distorting transformation of their transposed matrices. But no map need have the mean metric, and
    that the minimum is unique is not proven.

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
        For other shapes, Jacobians that are not finite or mirrored, and points that do not determine polynomials of
        the degree.

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
    """The polynomials nearest to maps of a plane; raises ValueError if points do not determine them."""
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
