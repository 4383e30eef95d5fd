"""What is asked of a map that is to be made, checked."""

from __future__ import annotations

from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.decisions import Extent, extent_of
from projdist.designs.kinds import Kind, Wish
from projdist.field import FIGURES, Figure
from projdist.matrices import Energy, Measure
from projdist.regions import Place
from projdist.support import check_choice, check_number, quoted

__all__ = ["CRITERIA_OF_DESIGNS", "check_degree", "check_extent", "check_within", "wish_of"]

CRITERIA_OF_DESIGNS = ("airy_kavrayskiy", "max_scale_error_ppm", "max_log_scale")

_POINT = 1e-6  # degrees: 10 cm
_WIDEST = 100.0  # degrees from the middle: what reaches farther needs a map of the world
_FINEST = 20  # degree: monomials of a horner of PROJ are good to a nanometre


def wish_of(kind: Kind, criterion: str, balance: float, norm: float | None) -> Wish:
    """What is made small; raises ValueError for what does not go together."""
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
        return Wish(figure, share, np.inf)
    return Wish(figure, share, 2.0 if norm is None else check_within("norm", norm, 2.0, 64.0))


def _balanced(share: float) -> Figure:
    """The Airy-Kavrayskiy error in which areas have another share than a half."""
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
    """A number within limits, which may be left out."""
    number = check_number(thing, value)
    if not (low < number < high if open else low <= number <= high):
        between = f"above {low:g} and below {high:g}" if open else f"from {low:g} to {high:g}"
        raise ValueError(f"Invalid {thing} {quoted(value)}. It must be a number {between}.")
    return number


def check_degree(value: Any) -> int:
    """A degree that PROJ can carry."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not 1 <= value <= _FINEST:
        raise ValueError(f"Invalid degree {quoted(value)}. It must be auto, or a whole number from 1 to {_FINEST}.")
    return int(value)


def check_extent(region: Place) -> Extent:
    """The extent of a region that is neither a point nor the world."""
    extent = extent_of(region)
    if not extent.radius > _POINT:
        raise ValueError(f"Invalid region '{region.name}'. It is a point: all maps are right there.")
    if extent.radius > _WIDEST:
        raise ValueError(
            f"Invalid region '{region.name}'. It reaches {extent.radius:.0f} degrees from its middle, and must reach "
            f"at most {_WIDEST:.0f}: maps of the world are another task, as they must be cut."
        )
    return extent
