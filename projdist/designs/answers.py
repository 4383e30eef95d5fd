"""The answer of `design`: a map made to measure, its gain over other maps, and its forms for other programs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist.designs.objectives import DesignObjective
from projdist.field import Extreme, sample
from projdist.projections import DerivedCrs, Projection
from projdist.regions import Place
from projdist.support import Answer, plain


@dataclass(frozen=True, kw_only=True)
class Degree:
    """A degree that was tried: its figure at fixed nodes, and the surroundings' share of the energy."""

    degree: int
    value: float
    share: float


@dataclass(frozen=True, kw_only=True)
class Rival:
    """A map to compare with, by the same criterion; `gain` is the relative saving of the made map."""

    kind: str
    name: str
    projection: Projection
    value: float
    error: float
    gain: float


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """The map around the region: the smallest and the largest scale there, and the share that folds."""

    within_km: float
    smallest_scale: float
    largest_scale: float
    folded: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Design(Answer):
    """A map made to measure.

    `value` is the figure of `criterion` over the region, measured on the finished map by adaptive cubature, with its
    `error`. `projection` is that map as PROJ runs it, `crs` its texts. `base` is the map that is corrected, `degrees`
    the figures of the degrees tried. `limit` is about the least Airy-Kavrayskiy error of any map of the kind, None if
    unknown; `smallest` and `largest` are the extreme scales in any direction. `overlaps` is True if the image of the
    region covers itself (None for points); `inverse_error` is the largest round-trip error in metres over the region,
    infinite where PROJ's inverse fails.
    """

    region: Place
    kind: str
    criterion: str
    unit: str
    degree: int
    balance: float
    exponent: float
    base: Projection
    projection: Projection
    crs: DerivedCrs
    value: float
    error: float
    airy_kavrayskiy: float
    limit: float | None
    smallest: Extreme
    largest: Extreme
    overlaps: bool | None
    surroundings: Surroundings | None
    inverse_error: float
    degrees: tuple[Degree, ...]
    rivals: tuple[Rival, ...]
    notes: tuple[str, ...] = ()

    @property
    def proj(self) -> str:
        """The PROJ pipeline from degrees to metres."""
        return self.crs.pipeline

    @property
    def wkt(self) -> str:
        """WKT2 of a projected CRS."""
        return self.crs.wkt

    def _line(self) -> str:
        figure = f"{self.criterion} {self.value:.4g} ± {self.error:.1g}"
        return f"{self.kind} map of degree {self.degree} for {self.region.name}: {figure}"

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON; NaN and infinity become None."""
        return {
            "region": {"name": self.region.name, "area_km2": self.region.area_km2},
            "kind": self.kind,
            "criterion": self.criterion,
            "unit": self.unit,
            "degree": self.degree,
            "balance": self.balance,
            "exponent": self.exponent,
            "base": self.base.definition,
            "value": plain(self.value),
            "error_estimate": plain(self.error),
            "airy_kavrayskiy": plain(self.airy_kavrayskiy),
            "limit": self.limit,
            "smallest_scale": _place(self.smallest),
            "largest_scale": _place(self.largest),
            "overlaps": self.overlaps,
            "surroundings": None if self.surroundings is None else _plain(vars(self.surroundings)),
            "inverse_error": plain(self.inverse_error),
            "degrees": [_plain(vars(one)) for one in self.degrees],
            "rivals": [
                _plain(vars(one) | {"name": one.name, "projection": one.projection.definition}) for one in self.rivals
            ],
            "notes": list(self.notes),
            "proj": self.proj,
            "wkt": self.wkt,
            "wkt_derived": self.crs.wkt_derived,
        }

    def _table(self) -> list[dict[str, Any]]:
        """A row a map: this one, and its rivals."""
        made = {"map": "made", "name": self.projection.name, self.criterion: self.value, "gain": 0.0}
        rivals = (
            {"map": one.kind, "name": one.name, self.criterion: one.value, "gain": one.gain} for one in self.rivals
        )
        return [made, *rivals]


def _place(extreme: Extreme) -> dict[str, Any]:
    return {"value": plain(extreme.value), "lon": extreme.lon, "lat": extreme.lat, "error": plain(extreme.error)}


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    return {name: plain(value) for name, value in values.items()}


# ---- the finished map, measured ------------------------------------------------------------------


_TOLERANCE = 1e-8


@dataclass(frozen=True, kw_only=True)
class MapFigures:
    """The figure of the objective with its error, the Airy-Kavrayskiy error, and the extreme scales."""

    value: float
    error: float
    airy_kavrayskiy: float
    smallest: Extreme
    largest: Extreme
    coverage: float


def measure_map(
    projection: Projection, region: Place, objective: DesignObjective, *, scaled: bool = False
) -> MapFigures:
    """The figures of a projection over a region; with `scaled` at its best scale."""
    field = sample(projection, region, measures=["a", "b"], tolerance=_TOLERANCE)
    smallest, largest = field.minimum("b"), field.maximum("a")
    found = field.airy_kavrayskiy
    if objective.figure.is_maximum:
        value = _largest(objective, largest.value, smallest.value, scaled)
        error = max(smallest.error, largest.error) * (1e6 if objective.figure.unit == "ppm" else 1.0)
    elif objective.figure.name == "airy_kavrayskiy":
        value, error = (found.scaled if scaled else found.raw), found.error
    else:
        value, error = field.figure(objective.figure)
    return MapFigures(
        value=value,
        error=error,
        airy_kavrayskiy=found.raw,
        smallest=smallest,
        largest=largest,
        coverage=field.coverage,
    )


def _largest(objective: DesignObjective, a: float, b: float, scaled: bool) -> float:
    """Largest error of scales from b to a; with `scaled` at the best scale."""
    in_ppm = objective.figure.unit == "ppm"
    if scaled:
        factor = 2.0 / (a + b) if in_ppm else 1.0 / np.sqrt(a * b)
        a, b = factor * a, factor * b
    return float(1e6 * max(a - 1.0, 1.0 - b) if in_ppm else max(np.log(a), -np.log(b)))
