"""The objective of a map made to measure: its kind, criterion and degree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.decisions import Extent, extent_of
from projdist.designs.fits import conformal_map, equal_area_map, general_map
from projdist.designs.plane_maps import PlaneMap
from projdist.designs.sites import BaseNodes
from projdist.field import FIGURES, Figure
from projdist.matrices import EXPONENT, Energy, Measure
from projdist.regions import Place
from projdist.support import Registry, check_choice, check_number, quoted


@dataclass(frozen=True)
class DesignObjective:
    """A figure to minimise, the share of areas in the energy, the norm of ln k, and the energy's exponent."""

    figure: Figure
    balance: float = 0.5
    norm: float = 2.0
    exponent: float = 0.0

    @property
    def energy(self) -> Energy:
        """The energy of a general map."""
        return Energy(2.0 * self.balance, 2.0 - 2.0 * self.balance, self.exponent)


Fit = Callable[[BaseNodes, int, float, DesignObjective], PlaneMap]


@dataclass(frozen=True)
class Kind:
    """A kind of map: the PROJ families to start from, the degrees to try, and the function that fits one.

    The search stops after `idle` degrees in a row that gain too little.
    """

    name: str
    families: tuple[str, ...]
    degrees: tuple[int, ...]
    fit: Fit
    free_scale: bool = True
    idle: int = 3  # for two islands the fifth degree may be the first to gain, and a lot


KINDS = {
    kind.name: kind
    for kind in (
        Kind(
            "any",
            ("aeqd", "eqdc", "laea", "aea", "lcc", "stere", "omerc"),
            tuple(range(2, 11)),
            lambda nodes, degree, share, objective: general_map(nodes, objective.energy, degree, share),
        ),
        Kind(
            "conformal",
            ("lcc", "tmerc", "omerc", "stere"),
            tuple(range(1, 13)),
            lambda nodes, degree, share, objective: conformal_map(nodes, degree, objective.norm, share),
            idle=12,
        ),
        Kind(
            "equal-area",
            ("laea", "aea", "cea"),
            tuple(range(1, 9)),
            lambda nodes, degree, share, objective: equal_area_map(nodes, degree, share),
            free_scale=False,
        ),
    )
}


def get_kind(name: str) -> Kind:
    """The kind of a name; raises ValueError with those there are."""
    return Registry("kind", KINDS).named(name)


def needs_exponent(J: FloatArray, weight: FloatArray, objective: DesignObjective) -> bool:
    """True if the energy is not elliptic at a node with weight, so that a finer map could tear there."""
    counts = weight > 0.0
    return objective.exponent == 0.0 and not bool(np.all(objective.energy.expansion(J[counts]).is_elliptic()))


def exponentiated(objective: DesignObjective) -> DesignObjective:
    """The objective with the exponentiated energy, which is elliptic everywhere."""
    return replace(objective, exponent=EXPONENT)


# ---- input, checked ------------------------------------------------------------------------------


CRITERIA_OF_DESIGNS = ("airy_kavrayskiy", "max_scale_error_ppm", "max_log_scale")

_POINT = 1e-6  # degrees: 10 cm
_WIDEST = 100.0  # degrees from the middle: wider regions need a map of the world
_FINEST = 20  # largest degree at which the monomials of PROJ's horner are accurate to a nanometre


def design_objective(kind: Kind, criterion: str, balance: float, norm: float | None) -> DesignObjective:
    """The checked objective; raises ValueError for options that do not go together."""
    check_choice("criterion", criterion, CRITERIA_OF_DESIGNS)
    share = check_within("balance", balance, 0.0, 1.0, open=True)
    if kind.name != "any" and share != 0.5:
        raise ValueError(f"Invalid balance '{balance}' for {kind.name} maps. It is for maps of any kind.")
    if kind.name != "conformal" and (norm is not None or criterion != "airy_kavrayskiy"):
        what, given = ("norm", norm) if norm is not None else ("criterion", criterion)
        raise ValueError(f"Invalid {what} '{given}' for maps of kind {kind.name}. It is for conformal maps.")
    figure = FIGURES[criterion] if share == 0.5 else _balanced(share)
    if figure.is_maximum:
        if norm is not None:
            raise ValueError(f"Invalid norm '{norm}' with criterion {criterion}. It is for airy_kavrayskiy.")
        return DesignObjective(figure, share, np.inf)
    return DesignObjective(figure, share, 2.0 if norm is None else check_within("norm", norm, 2.0, 64.0))


def _balanced(share: float) -> Figure:
    """The Airy-Kavrayskiy error with another share of areas than a half."""
    energy = Energy(2.0 * share, 2.0 - 2.0 * share)

    def root(J: FloatArray) -> FloatArray:
        return np.sqrt(energy.value(J.reshape(-1, 2, 2))).reshape(J.shape[:-2])

    return Figure(
        name=f"balanced_{share:g}",
        description=f"RMS of the distortion in which areas have a share of {share:g}.",
        measure=Measure(f"balanced_{share:g}", root),
        statistic="rms",
        aspect="distortion",
    )


def check_within(thing: str, value: Any, low: float, high: float, *, open: bool = False) -> float:
    """A number within limits, with `open` without them; raises ValueError."""
    number = check_number(thing, value)
    if not (low < number < high if open else low <= number <= high):
        between = f"above {low:g} and below {high:g}" if open else f"from {low:g} to {high:g}"
        raise ValueError(f"Invalid {thing} {quoted(value)}. It must be a number {between}.")
    return number


def check_degree(value: Any) -> int:
    """A degree that PROJ's horner can have; raises ValueError."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not 1 <= value <= _FINEST:
        raise ValueError(f"Invalid degree {quoted(value)}. It must be auto, or a whole number from 1 to {_FINEST}.")
    return int(value)


def check_extent(region: Place) -> Extent:
    """The extent of a region; raises ValueError for a point or a region that is too wide."""
    extent = extent_of(region)
    if not extent.radius > _POINT:
        raise ValueError(f"Invalid region '{region.name}'. It is a point: all maps are right there.")
    if extent.radius > _WIDEST:
        raise ValueError(
            f"Invalid region '{region.name}'. It reaches {extent.radius:.0f} degrees from its middle, and must reach "
            f"at most {_WIDEST:.0f}: maps of the world are another task, as they must be cut."
        )
    return extent
