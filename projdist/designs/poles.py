"""Poles around a region, for conformal maps that polynomials do not come near."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely

from projdist import regions
from projdist._typing import ComplexArray, FloatArray, IntArray
from projdist.designs.base_maps import MOST_POLES, BaseNodes
from projdist.designs.plane_maps import ComplexPolynomial, ContinuedFraction
from projdist.numerics import ComplexPolynomials, least_range

# ln k of a conformal base map may be changed by the real part of any analytic function: a polynomial, and multiples of
# (d / (z - p))^n, n > 1, with poles p at a distance d from the region. The linear programme that finds the least range
# of ln k has weights along the border, and a function lowers the range if it is not orthogonal to them. So the poles
# that are least orthogonal are added, a few at a time.

_DISTANCES = 0.04 * 2.0 ** np.arange(4)  # of poles from the region, over its size
_APART, _SIMPLER = 0.7, 0.2  # over that distance: between places along a line; simplification of the outline
_ORDERS = (2, 3)
_AT_ONCE = 8  # poles
_NEXT, _AGAIN = 1.0, 0.3  # over the larger distance: between poles added together, and between all
_DIFFERENT = 1e-4  # of the largest singular value; functions that differ less have large factors
_FOR_FRAME = 4000  # nodes
_TINY = 1e-4  # of the largest weight
_PAYS = 0.01  # least relative gain of poles that counts
_TIGHT = "+range=1e8 +inv_tolerance=1e-11"  # in a plane in which the region has the size 1
_EDGE = 500  # edges are divided to lengths of the region's size over this


@dataclass(frozen=True)
class Poles:
    """Poles (k,), their distances from the region, and factors (k, n) of (d / (z - p))^2, ... in the slope of a map."""

    places: ComplexArray
    distances: FloatArray
    factors: Any = None

    def some(self, chosen: IntArray) -> Poles:
        """The poles of an index, without factors."""
        return Poles(self.places[chosen], self.distances[chosen])

    def functions(self, z: ComplexArray) -> list[Any]:
        """The functions of each order, (n, k), at z (n,)."""
        ratio = self.distances / (z[:, None] - self.places)
        return [ratio**order for order in _ORDERS]


def with_poles(
    nodes: BaseNodes, region: regions.Place, count: int | None, degree: int
) -> tuple[BaseNodes, ContinuedFraction] | None:
    """A conformal map of the base's plane with poles outside of a region, and nodes in its plane; None without poles.

    ln k has the least range of all with as many poles and a polynomial of a degree, which is to follow. Without a count
    some are added while that pays.
    """
    u, v = nodes.plane
    inside, counts = nodes.in_region, nodes.weight > 0.0
    z, log_k = u + 1j * v, 0.5 * np.log(np.linalg.det(nodes.J[inside]))
    powers = ComplexPolynomials.over(z[counts], nodes.weight[counts], degree).at(z[inside])[:, 1:]
    chosen = _chosen(z[inside], log_k, powers, _places(nodes, region), count)
    if not chosen.places.size:
        return None
    found = _composed(nodes, chosen)
    x, y, J = found.at(nodes.x, nodes.y)
    return replace(nodes, x=x, y=y, J=J @ nodes.J), found


def _places(nodes: BaseNodes, region: regions.Place) -> Poles:
    """Places for poles around the region and in its holes."""
    step = float(np.degrees(nodes.size / nodes.base.ellipsoid.a)) / _EDGE
    polygons = shapely.segmentize(regions.polygons_of(region), step)

    def on_plane(points: FloatArray) -> FloatArray:
        z = (np.array(nodes.base(*points.T)).T - (nodes.origin.real, nodes.origin.imag)) / nodes.size
        return np.asarray(z, dtype=float)

    area = shapely.make_valid(shapely.transform(polygons, on_plane))
    found, far = [], []
    for distance in _DISTANCES.tolist():
        around = area.simplify(_SIMPLER * distance).buffer(distance)
        for ring in shapely.get_rings(shapely.get_parts(around)):
            steps = np.arange(0.0, ring.length, _APART * distance)
            found.append(shapely.get_coordinates(shapely.line_interpolate_point(ring, steps)))
            far.append(np.full(steps.size, distance))
    x, y = np.concatenate(found).T
    return Poles(x + 1j * y, np.concatenate(far))


def _chosen(z: ComplexArray, log_k: FloatArray, powers: ComplexArray, places: Poles, count: int | None) -> Poles:
    """The poles that lower the range of ln k most, with their factors in the slope of the map."""
    taken, likely, best, least = np.zeros(0, dtype=int), np.zeros(0, dtype=int), places, np.inf
    while True:
        poles = places.some(taken)
        functions = np.hstack([powers, *poles.functions(z)])
        columns = np.hstack([functions.real, functions.imag])
        middle = columns.mean(axis=0)
        _, values, axes = np.linalg.svd((columns - middle)[:: max(1, z.size // _FOR_FRAME)], full_matrices=False)
        kept = values > _DIFFERENT * values[0]
        frame = axes[kept].T / values[kept]
        x, weights = least_range(log_k, columns @ frame - middle @ frame, likely)
        now = float(weights @ log_k)
        if count is None and now > (1.0 - _PAYS) * least:
            return best
        real, imag = (frame @ x).reshape(2, -1)[:, powers.shape[1] :]
        best, least = replace(poles, factors=(real - 1j * imag).reshape(len(_ORDERS), taken.size).T), now
        likely = np.flatnonzero(np.abs(weights) > _TINY * np.abs(weights).max())
        gains = np.abs([weights[likely] @ one for one in places.functions(z[likely])])
        wanted = min(_AT_ONCE, (MOST_POLES if count is None else count) - taken.size)
        more = _best(np.linalg.norm(gains, axis=0), places, taken, wanted)
        if not more:
            return best
        taken = np.append(taken, more)


def _best(gain: FloatArray, places: Poles, taken: IntArray, count: int) -> list[int]:
    """The numbers of the poles with the largest gains that are far enough from each other and those taken."""
    free, new = gain.copy(), list[int]()
    for _ in range(count):
        for others, apart in ((taken, _AGAIN), (new, _NEXT)):
            for other in others:
                reach = apart * np.maximum(places.distances, places.distances[other])
                free[np.abs(places.places - places.places[other]) <= reach] = -1.0
        best = int(free.argmax())
        if free[best] <= 0.0:
            break
        new.append(best)
    return new


def _composed(nodes: BaseNodes, poles: Poles) -> ContinuedFraction:
    """The map z + the integrals of the poles' functions, to first order, one pole after the other."""
    # Of w = 1 / (z - p) the map z + a w + b w^2 is a polynomial: w - a w^3 - b w^4. From one pole to the next
    # 1 / (1 / w + s) = (1 - 1 / (1 + s w)) / s: if s is not small no digits are lost.
    order = _far_apart(poles.places)
    places, distances, factors = poles.places[order].copy(), poles.distances[order], poles.factors[order]
    orders = np.array(_ORDERS)
    terms = [ComplexPolynomial(nodes.origin + nodes.size * places[0], nodes.size, np.array([0.0, 1.0 + 0.0j]))]
    origin, unit = 0.0 + 0.0j, 1.0 + 0.0j  # of the plane before a term: w = (plane - origin) / unit
    for k in range(places.size):
        own = np.zeros(orders[-1] + 2, dtype=complex)
        own[1] = 1.0
        own[orders + 1] = factors[k] * distances[k] ** orders / (orders - 1)
        later = 1.0 / (places[k + 1 :] - places[k])
        places[k + 1 :] = places[k] + 1.0 / np.polynomial.polynomial.polyval(later, own)
        last = k + 1 == places.size
        shift = 1.0 if last else places[k] - places[k + 1]
        given = own * shift / unit ** np.arange(own.size)
        if not last:
            given[0] += 1.0
        terms.append(ComplexPolynomial(origin, 1.0, given, limits=_TIGHT))
        origin, unit = 1.0 + 0.0j, -shift
    end = nodes.origin + nodes.size * places[-1]
    return ContinuedFraction((*terms, ComplexPolynomial(0.0, 1.0 / nodes.size, np.array([end, 1.0]), limits=_TIGHT)))


def _far_apart(places: ComplexArray) -> list[int]:
    """An order in which each place is far from the one before."""
    order, left = [0], set(range(1, places.size))
    while left:
        order.append(max(left, key=lambda k: abs(places[k] - places[order[-1]])))
        left.discard(order[-1])
    return order
