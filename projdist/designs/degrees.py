"""Maps of one kind, degree by degree: as fine as pays, with as much care for the surroundings as keeps them whole."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray
from projdist.decisions import Objective
from projdist.designs.kinds import Kind, Wish, exponentiated, needs_exponent
from projdist.designs.plane_maps import PlaneMap
from projdist.designs.sites import Site
from projdist.matrices import principal_scales

__all__ = ["Stage", "stage_of", "stages"]

SHARES = (0.0, 1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3)
"""Of the energy, that the surroundings may have; the first is taken that keeps them whole."""

_LEAST, _LARGEST = 0.5, 2.0  # scales of surroundings that are whole
_PAYS = 0.01  # of the figure, that a degree gains


@dataclass(frozen=True, kw_only=True)
class Stage:
    """A map of a degree: its figure at the nodes, the share that the surroundings had, and how it was wished for."""

    degree: int
    value: float
    share: float
    wish: Wish
    plane_map: PlaneMap
    around: tuple[float, float, float]  # the smallest and the largest scale of the surroundings, and what of them folds

    @property
    def is_whole_around(self) -> bool:
        """Whether the surroundings do not fold, and their scales stay near 1."""
        return _is_whole(self.around)


def stages(site: Site, kind: Kind, wish: Wish, share: float | None) -> Iterator[Stage]:
    """Maps of ascending degrees until some in a row do not pay, or nodes do not tell more."""
    idle, least = 0, np.inf
    shares: tuple[float, ...] = SHARES if share is None else (share,)
    for degree in kind.degrees:
        try:
            stage = stage_of(site, kind, wish, degree, shares)
        except ValueError:
            if degree == kind.degrees[0]:
                raise
            return
        yield stage
        idle = idle + 1 if stage.value > (1.0 - _PAYS) * least else 0
        if idle == kind.idle:
            return
        least, wish = min(least, stage.value), stage.wish
        shares = tuple(one for one in shares if one >= stage.share)  # finer maps need no less care


def best_of(found: Sequence[Stage]) -> Stage:
    """The one after which no finer one pays, degree by degree."""
    return min(found, key=lambda one: one.value * (1.0 + _PAYS) ** one.degree)


def stage_of(site: Site, kind: Kind, wish: Wish, degree: int, shares: Sequence[float] = SHARES) -> Stage:
    """The map of one degree, with the first share that keeps the surroundings whole; ValueError for few nodes."""
    for share in shares:
        plane_map, wish = _fitted(site, kind, wish, degree, share)
        J = plane_map.at(site.x, site.y)[2] @ site.J
        plane_map, J = _scaled(site, kind, wish, plane_map, J)
        around = _around(site, J)
        if not site.around.any() or _is_whole(around):
            break
    inside = site.in_region
    value = wish.figure(J[inside], site.weight[inside])
    return Stage(degree=degree, value=value, share=share, wish=wish, plane_map=plane_map, around=around)


def _fitted(site: Site, kind: Kind, wish: Wish, degree: int, share: float) -> tuple[PlaneMap, Wish]:
    """The best map, with the exponentiated energy where a node leaves the range in which the plain one is elliptic."""
    plane_map = kind.fit(site, degree, share, wish)
    if kind.name == "any" and needs_exponent(plane_map.at(site.x, site.y)[2] @ site.J, site.weight, wish):
        wish = exponentiated(wish)
        plane_map = kind.fit(site, degree, share, wish)
    return plane_map, wish


def _scaled(site: Site, kind: Kind, wish: Wish, plane_map: PlaneMap, J: FloatArray) -> tuple[PlaneMap, FloatArray]:
    """The map in the scale that is best for the region."""
    if not kind.free_scale:
        return plane_map, J
    inside = site.in_region
    factor = Objective(wish.figure).scale(J[inside], site.weight[inside])
    return plane_map.moved(complex(factor), 0j), factor * J


def _around(site: Site, J: FloatArray) -> tuple[float, float, float]:
    """The smallest and the largest scale of the surroundings, and the share of them that folds."""
    beside = site.around > 0.0
    if not beside.any():
        return np.nan, np.nan, np.nan
    with np.errstate(over="ignore", invalid="ignore"):  # far outside a high degree's scales are beyond numbers
        folds = np.linalg.det(J[beside]) <= 0.0
    a, b = np.moveaxis(principal_scales(J[beside]), -1, 0)
    return float(b.min()), float(a.max()), float(site.around[beside][folds].sum())


def _is_whole(around: tuple[float, float, float]) -> bool:
    least, largest, folded = around
    return folded == 0.0 and least >= _LEAST and largest <= _LARGEST
