"""Indices of a map over a region: `indices` and its answer."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.answers.published_indices.registry import Index, get_index, get_indices
from projdist.answers.published_indices.terms import ScaleField, Scales
from projdist.field import field_resolving
from projdist.matrices import get_measure, principal_scales
from projdist.numerics import Estimate
from projdist.projections import Projection, ProjectionLike
from projdist.regions import GLOBE, Box, Place, RegionLike, region_for
from projdist.support import HIDDEN, Answer, Record, figure, quoted

_TOLERANCE = 1e-6
_MAX_EVALUATIONS = 400_000  # a quarter more for each mean; diverging ones take all


@dataclass(frozen=True)
class IndexValue(Record):
    """An index at the map's nominal scale, and `best` at the scale that makes it best.

    The errors are estimates; NaN if the index diverges, infinite if it has no bound. If the index does not depend on
    the scale, `best` is the same value and `best_scale` 1.
    """

    value: float
    error: float
    best: float
    best_error: float
    best_scale: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class IndexSummary(Answer):
    """Indices of a projection over a region, by name."""

    given: str = field(metadata=figure("projection"))
    projection: Projection = field(metadata=figure(of=("name", "definition"), spread=True))
    region: Place = field(metadata=HIDDEN)
    coverage: float
    evaluations: int
    values: dict[str, IndexValue] = field(metadata=figure("indices"))

    def __getitem__(self, name: str) -> IndexValue:
        """The index of a name or symbol."""
        return self.values[get_index(name).name]

    def _line(self) -> str:
        return f"{self.projection.name} over {self.region.name}: {', '.join(self.values)}"

    def columns(self) -> dict[str, float]:
        """The figures by name: the value by the name of the index, the others as `canters_ar_best`."""
        parts = ((name, key, part) for name, value in self.values.items() for key, part in vars(value).items())
        return {name if key == "value" else f"{name}_{key}": part for name, key, part in parts}

    def _flat(self) -> dict[str, Any]:
        return super()._flat() | self.columns()


def indices(
    projection: ProjectionLike,
    region: RegionLike | None = None,
    names: str | Iterable[str] = "all",
    *,
    tolerance: float = _TOLERANCE,
) -> IndexSummary:
    """Published indices of a projection over a region, with error estimates.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    region : RegionLike, optional
        Anything that `get_region` takes; by default the area of use of a CRS, or the globe for other projections.
    names : str or iterable of str, default "all"
        Names of indices and groups (`INDICES`, `GROUPS`), their symbols, or "all".
    tolerance : float, default 1e-6
        Largest error of the means that the indices are made of.

    Returns
    -------
    IndexSummary
        An `IndexValue` for each, by name or symbol: the index of the map as it is, and at the best scale, each with its
        error.

    Raises
    ------
    ProjectionError
        For an unknown projection, or if no point of the region can be projected.
    ValueError
        For an unknown region or index, no index at all, or a tolerance that is not positive.

    References
    ----------
    Each index has its own, `INDICES[name].source`.

    Examples
    --------
    The isotropy of Goldberg & Gott, the root of the mean of ln^2(a/b), here is sqrt(2 - 2 ln 2 + ln^2 2 - pi^2 / 12).

    >>> round(indices("plate-carree", names="I")["I"].value, 5)
    0.52124
    """
    given = projection if isinstance(projection, str) else None
    projection = Projection.from_user_input(projection)
    place = region_for(region, [projection])
    chosen = get_indices(names)
    if not chosen:
        raise ValueError(f"Invalid indices {quoted(names)}. There must be at least one.")
    fields: dict[float | None, ScaleField] = {}
    values: dict[str, IndexValue] = {}
    for band in dict.fromkeys(index.band for index in chosen):
        together = [index for index in chosen if index.band == band]
        within = Box(-180.0, -band, 180.0, band) if band is not None and place == GLOBE else place
        fields[band] = _field(projection, within, together, tolerance)
        values |= {index.name: _value(index, fields[band], tolerance) for index in together}
    whole = fields.get(None) or next(iter(fields.values()))
    return IndexSummary(
        projection=projection,
        given=given or projection.label,
        region=place,
        coverage=whole.jacobians.coverage,
        evaluations=sum(field.jacobians.evaluations for field in fields.values()),
        values={index.name: values[index.name] for index in chosen},
    )


def _field(
    projection: Projection, region: Place, chosen: list[Index], tolerance: float, scale: float = 1.0
) -> ScaleField:
    """The scales at nodes that resolve the means of some indices at a scale."""

    def integrand(term: Scales, J: FloatArray) -> FloatArray:
        """The term of Jacobians, NaN where they are singular."""
        scales = scale * principal_scales(J)
        scales[~(scales[..., 1] > 0)] = np.nan
        return term(scales[..., 0], scales[..., 1])

    terms = dict.fromkeys(term for index in chosen for term in index.terms)
    bent = dict.fromkeys(name for index in chosen for name in index.second_order)
    field = field_resolving(
        projection,
        region,
        [functools.partial(integrand, term) for term in terms],
        [get_measure(name) for name in bent],
        tolerance=tolerance,
        max_evaluations=_MAX_EVALUATIONS,
    )
    return ScaleField(projection, region, field)


def _value(index: Index, field: ScaleField, tolerance: float) -> IndexValue:
    nominal = field.once(index.value)
    if index.best_scale is None:
        return IndexValue(*nominal, *nominal, 1.0)
    scale = index.best_scale(field) if np.isfinite(nominal.value) else np.nan
    if index.kinked and np.isfinite(scale):
        # The samples were split at the kinks of the nominal scale; now at those of the best scale.
        field = _field(field.projection, field.region, [index], tolerance, scale)
        scale = index.best_scale(field)
    best = index.value(field, scale) if np.isfinite(scale) else Estimate(np.nan, np.nan)
    return IndexValue(*nominal, *best, scale)
