"""What is searched for, and what is found."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray
from projdist.field.at_points import jacobian
from projdist.field.second_derivatives import hessian
from projdist.matrices import Measure
from projdist.projections import Projection


class Extreme(NamedTuple):
    """A largest or smallest value and its place; infinite where the measure grows without bound towards it.

    `error` is by how much the true extreme may lie beyond the value, rounding included; NaN for what is infinite.
    """

    value: float
    lon: float
    lat: float
    error: float = math.nan


@dataclass(frozen=True)
class Goal:
    """A measure, its `values` (n, p, p) at samples, and whether its largest or its smallest value is wanted."""

    measure: Measure
    values: FloatArray
    largest: bool = True

    @property
    def sign(self) -> float:
        """What makes the value wanted the largest."""
        return 1.0 if self.largest else -1.0

    @property
    def bounded(self) -> bool:
        """Whether there is a bound in any case: only a signed measure, as a logarithm, may fall without one."""
        return self.measure.bounded or not (self.largest or self.measure.kind == "signed")

    @property
    def limit(self) -> float:
        """What the value times the sign never exceeds, whatever the map."""
        low, high = self.measure.limits
        return high if self.largest else -low

    def of(self, field: FloatArray) -> FloatArray:
        """What shall be large, from J's entries and those of H where they are needed, on the last axis; or -inf."""
        J = field[..., :4].reshape(*field.shape[:-1], 2, 2)
        H = field[..., 4:].reshape(*field.shape[:-1], 2, 2, 2) if self.measure.needs_hessian else None
        return defined(self.sign * self.measure(J, H))

    def change(self, field: FloatArray, error: FloatArray) -> FloatArray:
        """By how much it may change as each entry of fields (n, k) does by its error; infinite where it gets lost."""
        k = field.shape[-1] if self.measure.needs_hessian else 4
        moved = np.where(np.eye(k, dtype=bool), error[..., None, :k], 0.0)
        moved = np.stack([field[..., None, :k] + moved, field[..., None, :k] - moved])
        with np.errstate(invalid="ignore", over="ignore"):
            changes = np.abs(self.of(moved) - self.of(field)[..., None]).max(axis=0)
        return np.where(np.isnan(changes), np.inf, changes).sum(axis=-1)


def defined(values: FloatArray) -> FloatArray:
    """Values with -inf where they are none."""
    return np.where(np.isfinite(values), values, -np.inf)


def measure_at(
    projection: Projection, measure: Measure, lon: FloatArray, lat: FloatArray, J: FloatArray | None = None
) -> FloatArray:
    """A measure at points in degrees, where J may be known; H is per radian of the semi-major axis."""
    J = jacobian(projection, lon, lat) if J is None else J
    if not measure.needs_hessian:
        return measure(J)
    return measure(J, hessian(projection, lon, lat))
