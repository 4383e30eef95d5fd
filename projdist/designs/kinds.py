"""The kinds of maps that can be made to measure: how each is fitted, from which families, and to which degree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from projdist._typing import FloatArray
from projdist.designs.conformal_maps import conformal_map
from projdist.designs.equal_area_maps import equal_area_map
from projdist.designs.general_maps import general_map
from projdist.designs.plane_maps import PlaneMap
from projdist.designs.sites import Site
from projdist.field import Figure
from projdist.matrices import EXPONENT, Energy
from projdist.support import check_choice

__all__ = ["KINDS", "Kind", "Wish", "get_kind"]


@dataclass(frozen=True)
class Wish:
    """What is made small: a figure, areas' share of the energy from 0 to 1, the norm of ln k; exponentiated or not."""

    figure: Figure
    balance: float = 0.5
    norm: float = 2.0
    exponent: float = 0.0

    @property
    def energy(self) -> Energy:
        """That of a general map."""
        return Energy(2.0 * self.balance, 2.0 - 2.0 * self.balance, self.exponent)


Fit = Callable[[Site, int, float, Wish], PlaneMap]


@dataclass(frozen=True)
class Kind:
    """A kind of map: families of PROJ to start from, degrees, and how to fit one (site, degree, surroundings, wish).

    After `idle` degrees in a row that do not pay finer ones are not tried.
    """

    name: str
    purpose: str
    families: tuple[str, ...]
    degrees: tuple[int, ...]
    fit: Fit
    free_scale: bool = True
    idle: int = 3  # of two islands only the fifth may gain, and a lot


def _general(site: Site, degree: int, share: float, wish: Wish) -> PlaneMap:
    return general_map(site, wish.energy, degree, share)


def _conformal(site: Site, degree: int, share: float, wish: Wish) -> PlaneMap:
    return conformal_map(site, degree, wish.norm, share)


def _equal_area(site: Site, degree: int, share: float, wish: Wish) -> PlaneMap:
    return equal_area_map(site, degree, share)


KINDS = {
    kind.name: kind
    for kind in (
        Kind("any", "any", ("aeqd", "eqdc", "laea", "aea", "lcc", "stere", "omerc"), tuple(range(2, 11)), _general),
        Kind("conformal", "conformal", ("lcc", "tmerc", "omerc", "stere"), tuple(range(1, 13)), _conformal, idle=12),
        Kind("equal-area", "equal-area", ("laea", "aea", "cea"), tuple(range(1, 9)), _equal_area, free_scale=False),
    )
}


def get_kind(name: str) -> Kind:
    """The kind of a name; raises ValueError with those there are."""
    check_choice("kind", name, KINDS)
    return KINDS[name]


def needs_exponent(J: FloatArray, weight: FloatArray, wish: Wish) -> bool:
    """Whether the energy is not elliptic at a node that counts, so that a finer map could tear there."""
    counts = weight > 0.0
    return wish.exponent == 0.0 and not bool(np.all(wish.energy.expansion(J[counts]).is_elliptic()))


def exponentiated(wish: Wish) -> Wish:
    """The same with the energy that is elliptic everywhere."""
    return replace(wish, exponent=EXPONENT)
