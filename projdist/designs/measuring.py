"""A finished map over its region, measured by adaptive cubature as any other map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from projdist.designs.kinds import Wish
from projdist.field import Extreme, sample
from projdist.projections import Projection
from projdist.regions import Place

__all__ = ["Measured", "measured"]

_TOLERANCE = 1e-8


@dataclass(frozen=True, kw_only=True)
class Measured:
    """The figure that was wished for, with its error, the Airy-Kavrayskiy error, and the extreme scales."""

    value: float
    error: float
    airy_kavrayskiy: float
    smallest: Extreme
    largest: Extreme
    coverage: float


def measured(projection: Projection, region: Place, wish: Wish, *, scaled: bool = False) -> Measured:
    """A projection over a region; `scaled` in the scale that is best for it."""
    field = sample(projection, region, measures=["a", "b"], tolerance=_TOLERANCE)
    smallest, largest = field.minimum("b"), field.maximum("a")
    found = field.airy_kavrayskiy
    if wish.figure.is_maximum:
        error = max(smallest.error, largest.error)
        value, error = (
            _largest(wish, largest.value, smallest.value, scaled),
            error * (1e6 if wish.figure.unit == "ppm" else 1.0),
        )
    elif wish.figure.name == "airy_kavrayskiy":
        value, error = (found.scaled if scaled else found.raw), found.error
    else:
        estimate = field.figure(wish.figure)
        value, error = estimate.value, estimate.error
    return Measured(
        value=value,
        error=error,
        airy_kavrayskiy=found.raw,
        smallest=smallest,
        largest=largest,
        coverage=field.coverage,
    )


def _largest(wish: Wish, a: float, b: float, scaled: bool) -> float:
    """The largest error of scales from b to a; `scaled` after the best scale."""
    in_ppm = wish.figure.unit == "ppm"
    if scaled:
        factor = 2.0 / (a + b) if in_ppm else 1.0 / np.sqrt(a * b)
        a, b = factor * a, factor * b
    return float(1e6 * max(a - 1.0, 1.0 - b) if in_ppm else max(np.log(a), -np.log(b)))
