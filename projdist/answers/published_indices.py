"""Published indices of whole maps, each with its definition, normalisation, scale and source."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from projdist import earth, matrices, projections, regions, support
from projdist._typing import FloatArray
from projdist.answers import index_terms as terms
from projdist.answers.index_terms import ScaleField, Scales, Value
from projdist.answers.summaries import GROUPS
from projdist.field import FIGURES, Figure, field_resolving


@dataclass(frozen=True, kw_only=True)
class Index:
    """A published index of a whole map."""

    name: str
    symbol: str
    group: str
    definition: str
    normalisation: str
    source: str
    value: Value  # of a field at a scale: the index of the map so enlarged
    best_scale: Callable[[ScaleField], float] | None = None  # if it depends on the scale
    terms: tuple[Scales, ...] = ()  # functions of a and b whose means it needs
    second_order: tuple[str, ...] = ()  # measures of second derivatives
    band: float | None = None  # latitude north and south to which it restricts the globe
    published_within: float | None = None  # latitude of the published figures, if the index itself has no band
    kinked: bool = False  # whether the terms have kinks, which move with the scale
    figure: Figure | None = None  # the one of `FIGURES` that it is made of

    @property
    def published_over(self) -> str:
        """The part of the globe that the published figures are of; "" for all of it."""
        return "" if self.published_within is None else f"|lat| <= {self.published_within:g}"

    @property
    def scale_dependence(self) -> str:
        """Text that says whether the index changes with the nominal scale."""
        return "none" if self.best_scale is None else "at the nominal scale, and at the best"


NORMALISERS = {"I": 0.51, "A": 0.41, "F": 0.64, "S": 0.60, "D": 0.449, "B": 0.25}
"""The plate carree's row as Goldberg & Gott (2007) print it, rounded; the published scores are made with it."""


def goldberg_gott_score(values: Mapping[str, float], normalisers: Mapping[str, float] = NORMALISERS) -> float:
    """The score of a map by six indices: the sum over I, A, F, S, D, B of (X / X of the plate carree)^2.

    Parameters
    ----------
    values : mapping of str to float
        The map's indices by symbol: isotropy I, area A, flexion F, skewness S, distances D, boundary cuts B.
    normalisers : mapping of str to float, optional
        The indices of the plate carree, by default `NORMALISERS`.

    Returns
    -------
    float
        The score; smaller is better.

    Raises
    ------
    ValueError
        If one of the indices is missing or is no number.

    References
    ----------
    - Gott, Goldberg & Vanderbei 2021, Flat Maps that improve on the Winkel Tripel, arXiv 2102.08176: the score.
    - Goldberg & Gott 2007, Cartographica 42:297: the plate carree's row.

    Examples
    --------
    The plate carree has six by definition.

    >>> goldberg_gott_score({"I": 0.51, "A": 0.41, "F": 0.64, "S": 0.60, "D": 0.449, "B": 0.25})
    6.0
    """
    for thing, table in (("values", values), ("normalisers", normalisers)):
        if not isinstance(table, Mapping):
            raise ValueError(
                f"Invalid {thing} {support.quoted(table)}. They must be figures by symbol, such as {{'I': 0.51}}."
            )
    missing = [symbol for symbol in normalisers if symbol not in values]
    if missing:
        symbols = ", ".join(normalisers)
        raise ValueError(f"Invalid values for the score. There must be {symbols}; {missing[0]} is missing.")
    return sum(
        (support.check_number("value", values[symbol]) / support.check_number("normaliser", scale)) ** 2
        for symbol, scale in normalisers.items()
    )


# ---- the indices ---------------------------------------------------------------------------------


def _of_figure(name: str, factor: float = 1.0, **options: Any) -> dict[str, Any]:
    """Fields of an index that is a figure of `FIGURES`, times a factor."""
    figure = FIGURES[name]
    resolved = () if figure.measure.name in _RESOLVED else (terms.term_of(figure),)
    return {"figure": figure, "value": terms.value_of(figure, factor), "terms": resolved} | options


_RESOLVED = ("fisher", "kavrayskiy")  # measures that all samples resolve
_FLEXION, _SKEWNESS = terms.second_order("flexion"), terms.second_order("skewness")
_SCORE: dict[str, Value] = {"I": terms.value_of(FIGURES["isotropy"]), "A": terms.deviation_of_log_area}
_SCORE |= {"F": _FLEXION, "S": _SKEWNESS, "D": lambda field, _: field.once(terms.pairs)[0], "B": terms.boundary_cuts}


def _score(field: ScaleField, scale: float) -> support.Estimate:
    """The score of a field; NaN if one of its six indices is undefined."""
    found = {symbol: field.once(value) for symbol, value in _SCORE.items()}
    # Six errors that may all have one sign.
    error = sum(2.0 * abs(one.value) * one.error / NORMALISERS[symbol] ** 2 for symbol, one in found.items())
    return support.Estimate(goldberg_gott_score({symbol: one.value for symbol, one in found.items()}), error)


# How indices of published/indices.csv are computed that are not just a figure.
_COMPUTED: dict[str, dict[str, Any]] = {
    "jordan": _of_figure("jordan", best_scale=terms.best_for_jordan),
    "airy_kavrayskiy_double": _of_figure("airy_kavrayskiy", 2.0**0.5),
    "chebyshev": {"value": terms.largest_error, "best_scale": terms.best_for_largest},
    "chebyshev_ratio": {"value": terms.scale_ratio},
    "milnor": {"value": terms.log_scale_ratio},
    "canters_ab": _of_figure("canters_ab", best_scale=terms.searched(FIGURES["canters_ab"]), kinked=True),
    "canters_ar": _of_figure("canters_ar", best_scale=terms.searched(FIGURES["canters_ar"]), kinked=True),
    "capek": {"value": terms.share_above_smallest, "terms": (terms.omega,)},
    "capek_nominal": {"value": terms.share_near_nominal, "best_scale": terms.best_for_share, "terms": (terms.omega,)},
    "kunimune_area": {"value": terms.deviation_of_log_area, "terms": (terms.log_area_squared,)},
    "area": {"value": terms.deviation_of_log_area, "terms": (terms.log_area_squared,)},
    "flexion": {"value": _FLEXION, "second_order": ("flexion",)},
    "skewness": {"value": _SKEWNESS, "second_order": ("skewness",)},
    "distances": {"value": _SCORE["D"]},
    "boundary_cuts": {"value": terms.boundary_cuts},
    "goldberg_gott_score": {
        "value": _score,
        "terms": (terms.term_of(FIGURES["isotropy"]), terms.log_area_squared),
        "second_order": ("flexion", "skewness"),
    },
    "peters_distance": {"value": lambda field, scale: field.once(terms.pairs, scale)[1]},
    "canters_finite": {"value": terms.finite_scale_factor},
    "great_circle_bending": {"value": terms.bending},
}


def _index(row: dict[str, str]) -> Index:
    parts: dict[str, Any] = {key: row[key] for key in ("name", "symbol", "group", "normalisation")}
    parts["best_scale"] = terms.BEST_SCALES.get(row["best_scale"])
    parts |= _COMPUTED.get(row["name"]) or _of_figure(row["figure"])
    figure: Figure | None = parts.get("figure")
    return Index(
        definition=row["definition"] or (figure.description if figure else ""),
        source=row["source"] or (figure.source if figure else ""),
        band=float(row["band"]) if row["band"] else None,
        # 88 degrees were found by experiment (published/conventions.csv), the authors do not state it.
        published_within=float(row["published_within"]) if row["published_within"] else None,
        **parts,
    )


_INDICES = {row["name"]: _index(row) for row in earth.data_rows("published/indices.csv")}

INDICES: support.Registry[Index] = support.Registry(
    "index",
    _INDICES,
    aliases={name: index.name for index in reversed(_INDICES.values()) for name in (index.symbol, index.name)},
    suggested=["all", *GROUPS, *_INDICES],
    rule=f"It must be all, a group ({', '.join(GROUPS)}), or an index (see 'projdist list indices').",
)


def get_indices(names: str | Iterable[str] = "all") -> list[Index]:
    """The indices of groups (first), names and symbols, or "all", each once; raises ValueError with close matches."""
    chosen: dict[str, Index] = {}
    for name in support.listed_values(names):
        support.check_text("index", name)
        found = [index for index in INDICES.values() if name in ("all", index.group)]
        chosen |= {index.name: index for index in found or [INDICES.named(name)]}
    return list(chosen.values())


# ---- indices of a map --------------------------------------------------------------------------------

_TOLERANCE = 1e-6
_MAX_EVALUATIONS = 400_000  # a quarter more for each mean; diverging ones take all


@dataclass(frozen=True)
class IndexValue(support.Record):
    """An index at the map's nominal scale, and `best` at the scale that makes it best."""

    value: float
    error: float  # an estimate; NaN if the index diverges, infinite if it has no bound
    best: float  # the value itself if the index does not depend on the scale
    best_error: float
    best_scale: float  # then 1


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class IndexSummary(support.Answer):
    """Indices of a projection over a region, by name."""

    given: str = field(metadata=support.schema("projection"))
    projection: projections.Projection = field(metadata=support.schema(of=("name", "definition"), spread=True))
    region: regions.Place = field(metadata=support.HIDDEN)
    coverage: float
    evaluations: int
    values: dict[str, IndexValue] = field(metadata=support.schema("indices"))

    def __getitem__(self, name: str) -> IndexValue:
        """The index with a name or symbol."""
        return self.values[INDICES.named(name).name]

    def _line(self) -> str:
        return f"{self.projection.name} over {self.region.name}: {', '.join(self.values)}"

    def columns(self) -> dict[str, float]:
        """The figures by name: the value by the name of the index, the others as `canters_ar_best`."""
        parts = ((name, key, part) for name, value in self.values.items() for key, part in vars(value).items())
        return {name if key == "value" else f"{name}_{key}": part for name, key, part in parts}

    def _flat(self) -> dict[str, Any]:
        return super()._flat() | self.columns()


def indices(
    projection: projections.ProjectionLike,
    region: regions.RegionLike | None = None,
    names: str | Iterable[str] = "all",
    *,
    tolerance: float = _TOLERANCE,
) -> IndexSummary:
    """Published indices of a projection over a region, with error estimates.

    Parameters
    ----------
    projection : ProjectionLike
    region : RegionLike, optional
        Anything that `get_region` takes; by default the area of use of a CRS, or the globe for other projections.
    names : str or iterable of str, default "all"
        Names of indices and groups (`INDICES`, `GROUPS`), their symbols, or "all".
    tolerance : float, default 1e-6
        Largest error of the means that the indices are made of.

    Returns
    -------
    IndexSummary
        An `IndexValue` for each, by name or symbol: of the map as it is, and at the best scale, each with its error.

    Raises
    ------
    ProjectionError, ValueError
        For an unknown projection, or if no point of the region can be projected; for an unknown region or index, no
        index at all, or a tolerance that is not positive.

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
    projection = projections.Projection.from_user_input(projection)
    place = regions.region_for(region, [projection])
    chosen = get_indices(names)
    if not chosen:
        raise ValueError(f"Invalid indices {support.quoted(names)}. There must be at least one.")
    fields: dict[float | None, ScaleField] = {}
    values: dict[str, IndexValue] = {}
    for band in dict.fromkeys(index.band for index in chosen):
        together = [index for index in chosen if index.band == band]
        within = regions.Box(-180.0, -band, 180.0, band) if band is not None and place == regions.GLOBE else place
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
    projection: projections.Projection, region: regions.Place, chosen: list[Index], tolerance: float, scale: float = 1.0
) -> ScaleField:
    """The scales at nodes that resolve the means of some indices at a scale."""

    def integrand(term: Scales, J: FloatArray) -> FloatArray:
        """The term of Jacobians, NaN where they are singular."""
        scales = scale * matrices.principal_scales(J)
        scales[~(scales[..., 1] > 0)] = np.nan
        return term(scales[..., 0], scales[..., 1])

    means = dict.fromkeys(term for index in chosen for term in index.terms)
    bent = dict.fromkeys(name for index in chosen for name in index.second_order)
    resolved = [functools.partial(integrand, term) for term in means], [matrices.get_measure(name) for name in bent]
    field = field_resolving(projection, region, *resolved, tolerance=tolerance, max_evaluations=_MAX_EVALUATIONS)
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
    best = index.value(field, scale) if np.isfinite(scale) else support.Estimate(np.nan, np.nan)
    return IndexValue(*nominal, *best, scale)
