"""An index, and the principal scales that it is computed from."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from projdist._typing import FloatArray
from projdist.field import Extreme, Field, Figure
from projdist.matrices import principal_scales
from projdist.numerics import Estimate
from projdist.projections import Projection
from projdist.regions import Place

T = TypeVar("T")
Scales = Callable[[FloatArray, FloatArray], FloatArray]
"""A function of the principal scales a >= b."""

_STEP = 1e-3  # of the logarithms of the scales, for slopes that enter errors only


@dataclass(frozen=True)
class ScaleField:
    """The principal scales of a field, whose means, extremes and shares the indices are made of."""

    projection: Projection
    region: Place
    jacobians: Field
    known: dict[Any, Any] = field(default_factory=dict, repr=False, compare=False)

    def once(self, figure: Callable[[ScaleField, float], T], scale: float = 1.0) -> T:
        """A figure of the field at a scale, computed when first asked for."""
        if (figure, scale) not in self.known:
            self.known[figure, scale] = figure(self, scale)
        return self.known[figure, scale]

    @functools.cached_property
    def scales(self) -> tuple[FloatArray, FloatArray]:
        """The principal scales a and b (n,) at the nodes; NaN where the map is singular."""
        scales = principal_scales(self.jacobians.jacobian)
        scales[~(scales[..., 1] > 0)] = np.nan
        return scales[..., 0], scales[..., 1]

    def mean(self, term: Scales, scale: float = 1.0) -> Estimate:
        """The mean of a term by true area, of the map enlarged by a scale."""
        if not np.isfinite(scale):
            return Estimate(np.nan, np.nan)
        a, b = (scale * value for value in self.scales)
        up, down = 1.0 + _STEP, 1.0 - _STEP
        slope = np.abs(term(up * a, b) - term(down * a, b)) + np.abs(term(a, up * b) - term(a, down * b))
        return self.jacobians.mean(term(a, b), slope=slope / (2.0 * _STEP))

    def sum(self, term: Scales, scale: float) -> float:
        """The sum over the nodes that the mean is made of, and nothing else: for searches."""
        a, b = self.scales
        return float(np.nansum(self.jacobians.weight * term(scale * a, scale * b)))

    @functools.cached_property
    def largest(self) -> Extreme:
        """The largest scale in any direction; infinite where there is no bound."""
        return self.jacobians.maximum("tissot_semimajor")

    @functools.cached_property
    def smallest(self) -> Extreme:
        """The smallest scale in any direction."""
        return self.jacobians.minimum("tissot_semiminor")

    @functools.cached_property
    def dense(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The scales a, b and weights that sum to 1 at many points, for shares of the area."""
        # The Jacobian is smooth where its principal scales cross, and they are not.
        J, weights = self.jacobians.dense_jacobian
        a, b = principal_scales(J).T
        return a, b, weights / weights.sum()


@dataclass(frozen=True, kw_only=True)
class Index:
    """A published index of a whole map.

    `value` (field, scale) is the index of the map made larger by a scale; `best_scale` (field) the scale that makes it
    least, or most where more is better, and None where the index does not depend on it. `terms` are the functions of a
    and b whose means it needs, `kinked` where those have kinks that move with the scale; `second_order` are the
    measures of second derivatives. `band` are the latitudes, to either side of the equator, to which the index
    restricts the globe, and `published_within` those over which the published figures come out, where it does not.
    `figure` is the one of `FIGURES` that it is made of, if it is made of one.
    """

    name: str
    symbol: str
    group: str
    definition: str
    normalisation: str
    source: str
    value: Callable[[ScaleField, float], Estimate]
    best_scale: Callable[[ScaleField], float] | None = None
    terms: tuple[Scales, ...] = ()
    second_order: tuple[str, ...] = ()
    band: float | None = None
    published_within: float | None = None
    kinked: bool = False
    figure: Figure | None = None

    @property
    def published_over(self) -> str:
        """The part of the globe that the published figures are of; "" for all of it."""
        return "" if self.published_within is None else f"|lat| <= {self.published_within:g}"

    @property
    def scale_dependence(self) -> str:
        """Whether it changes with the nominal scale."""
        return "none" if self.best_scale is None else "at the nominal scale, and at the best"
