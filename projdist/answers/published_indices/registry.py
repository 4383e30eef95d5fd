"""The published indices by name and by group."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from projdist.answers.published_indices import terms
from projdist.answers.published_indices.terms import ScaleField, Scales, Value
from projdist.field import FIGURES, Figure
from projdist.numerics import Estimate
from projdist.support import Registry, check_number, check_text, listed_values, quoted


@dataclass(frozen=True, kw_only=True)
class Index:
    """A published index of a whole map.

    `value` (field, scale) is the index of the map enlarged by a scale; `best_scale` (field) the scale that minimises
    it, or maximises it if more is better; None if the index does not depend on the scale. `terms` are the functions of
    a and b whose means it needs, `kinked` is True if they have kinks that move with the scale; `second_order` are the
    measures of second derivatives. `band` is the latitude north and south to which the index restricts the globe,
    `published_within` the one to which the published figures do, if the index does not. `figure` is the one of
    `FIGURES` that the index is made of, if any.
    """

    name: str
    symbol: str
    group: str
    definition: str
    normalisation: str
    source: str
    value: Value
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
        """Text that says whether the index changes with the nominal scale."""
        return "none" if self.best_scale is None else "at the nominal scale, and at the best"


# ---- the score ------------------------------------------------------------------------------


NORMALISERS = {"I": 0.51, "A": 0.41, "F": 0.64, "S": 0.60, "D": 0.449, "B": 0.25}
"""The plate carree's row as Goldberg & Gott (2007) print it, rounded; the published scores are made with it."""


def goldberg_gott_score(values: Mapping[str, float], normalisers: Mapping[str, float] = NORMALISERS) -> float:
    """The score of a map by six indices: the sum over I, A, F, S, D, B of (X / X of the plate carree)^2.

    Parameters
    ----------
    values : mapping of str to float
        The map's indices by symbol: isotropy I, area A, flexion F, skewness S, distances D, boundary cuts B.
    normalisers : mapping of str to float, optional
        The indices of the plate carree, by default as Goldberg & Gott (2007) print them, rounded; the published scores
        are made with these.

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
    - Goldberg & Gott 2007, Flexion and Skewness in Map Projections of the Earth, Cartographica 42:297: the plate
      carree's row.

    Examples
    --------
    The plate carree has six by definition.

    >>> goldberg_gott_score({"I": 0.51, "A": 0.41, "F": 0.64, "S": 0.60, "D": 0.449, "B": 0.25})
    6.0
    """
    for thing, table in (("values", values), ("normalisers", normalisers)):
        if not isinstance(table, Mapping):
            raise ValueError(f"Invalid {thing} {quoted(table)}. They must be figures by symbol, as {{'I': 0.51}}.")
    missing = [symbol for symbol in normalisers if symbol not in values]
    if missing:
        symbols = ", ".join(normalisers)
        raise ValueError(f"Invalid values for the score. There must be {symbols}; {missing[0]} is missing.")
    return sum(
        (check_number("value", values[symbol]) / check_number("normaliser", scale)) ** 2
        for symbol, scale in normalisers.items()
    )


def score_of(values: Mapping[str, Value]) -> Value:
    """The score of a field by the functions of its six indices, by symbol; NaN if one of them is undefined."""

    def score(field: ScaleField, scale: float) -> Estimate:
        found = {symbol: field.once(value) for symbol, value in values.items()}
        # Six errors that may all have one sign.
        error = sum(2.0 * abs(one.value) * one.error / NORMALISERS[symbol] ** 2 for symbol, one in found.items())
        return Estimate(goldberg_gott_score({symbol: one.value for symbol, one in found.items()}), error)

    return score


# ---- the indices ----------------------------------------------------------------------------

_AIRY = "Airy 1861, Explanation of a projection by balance of errors, Philosophical Magazine 22:409"
_GOTT = "Goldberg & Gott 2007, Flexion and Skewness in Map Projections of the Earth, Cartographica 42:297"
_CANTERS = "Canters & Decleir 1989, The World in Perspective"
_CANTERS_2002 = "Canters 2002, Small-scale Map Projection Design"
_GGV = "Gott, Goldberg & Vanderbei 2021, Flat Maps that improve on the Winkel Tripel, arXiv 2102.08176"
_CAPEK = "Capek 2001, Which is the best projection for the world map?, Proceedings of the 20th ICC, Beijing"
_OZERI = "Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications"
_KAVRAYSKIY = "Kavrayskiy 1934, Matematicheskaya kartografiya"
_KUNIMUNE = "Kunimune, Map-Projections, output/parameters.txt"

_WITHOUT_POLES = 88.0  # degrees: found by experiment (published/conventions.csv), not stated by the authors


def _view(
    name: str,
    symbol: str,
    group: str,
    normalisation: str,
    best_scale: Callable[[ScaleField], float] | None = None,
    *,
    figure: str = "",
    factor: float = 1.0,
    definition: str = "",
    source: str = "",
    **options: Any,
) -> Index:
    """An index that is a figure of `FIGURES`, times a factor."""
    made_of = FIGURES[figure or name]
    resolved = () if made_of.measure.name in _RESOLVED else (terms.term_of(made_of),)
    return Index(
        name=name,
        symbol=symbol,
        group=group,
        definition=definition or made_of.description,
        normalisation=normalisation,
        source=source or made_of.source,
        value=terms.value_of(made_of, factor),
        best_scale=best_scale,
        terms=resolved,
        figure=made_of,
        **options,
    )


_RESOLVED = ("fisher", "kavrayskiy")  # measures that all samples resolve
_ISOTROPY = FIGURES["isotropy"]

_SCORED = {
    "I": terms.value_of(_ISOTROPY),
    "A": terms.deviation_of_log_area,
    "F": terms.second_order("flexion"),
    "S": terms.second_order("skewness"),
    "D": terms.spread,
    "B": terms.boundary_cuts,
}

_INDICES = {
    index.name: index
    for index in (
        _view("airy", "E_A", "airy", "half of the sum, root", terms.best_for_airy),
        _view(
            "airy_balance",
            "E_B",
            "airy",
            "half of the sum, root; for small errors twice the square of E_A",
            terms.best_for_balance,
        ),
        _view("jordan", "E_J", "jordan", "mean over directions, root", terms.best_for_jordan),
        _view("jordan_kavrayskiy", "E_JK", "jordan", "mean over directions, root", terms.best_for_jordan_kavrayskiy),
        _view("airy_kavrayskiy", "E_AK", "kavrayskiy", "the sum, root: 1", terms.best_for_logarithms),
        _view(
            "airy_kavrayskiy_half",
            "E_AK/2",
            "kavrayskiy",
            "half of the sum, root: 1/sqrt(2) of E_AK",
            terms.best_for_logarithms,
            figure="kavrayskiy",
        ),
        _view(
            "airy_kavrayskiy_double",
            "2E_AK",
            "kavrayskiy",
            "twice the sum, root: sqrt(2) of E_AK",
            terms.best_for_logarithms,
            figure="airy_kavrayskiy",
            factor=math.sqrt(2.0),
            definition="RMS of sqrt(ln^2(a/b) + ln^2(ab)), which is sqrt(2 (ln^2 a + ln^2 b)).",
            source=f"{_OZERI}, equation 1",
        ),
        *(
            _view(
                f"klingatsch_{name}",
                symbol,
                "klingatsch",
                "weights that sum to 1, root; with equal weights E_AK",
                terms.best_for_logarithms,
            )
            for name, symbol in (("angles", "E_K21"), ("areas", "E_K12"))
        ),
        Index(
            name="chebyshev",
            symbol="C",
            group="chebyshev",
            definition="Largest |ln scale| in any place and direction.",
            normalisation="none; at the best scale half of Milnor's distortion",
            source="Chebyshev 1856, Sur la construction des cartes geographiques",
            value=terms.largest_error,
            best_scale=terms.best_for_largest,
        ),
        Index(
            name="chebyshev_ratio",
            symbol="m/m",
            group="chebyshev",
            definition="Largest scale over smallest, in any place and direction.",
            normalisation="none; exp of Milnor's distortion",
            source="Chebyshev 1856, Sur la construction des cartes geographiques",
            value=terms.scale_ratio,
        ),
        Index(
            name="milnor",
            symbol="delta",
            group="chebyshev",
            definition="ln of the largest scale over the smallest, in any place and direction.",
            normalisation="none; Milnor's own is of finite distances, the same where region and map are convex",
            source="Milnor 1969, A problem in cartography, American Mathematical Monthly 76:1101",
            value=terms.log_scale_ratio,
        ),
        *(
            _view(name, symbol, "canters", "by true area", terms.searched(FIGURES[name]), kinked=True)
            for name, symbol in (("canters_ab", "Dab"), ("canters_ar", "Dar"))
        ),
        _view(
            "canters_an",
            "Dan",
            "canters",
            "by true area; the full angle 2 asin((a - b) / (a + b))",
            figure="mean_omega",
            source=_CANTERS,
        ),
        Index(
            name="capek",
            symbol="Q",
            group="capek",
            definition="Percentage of the area with omega <= 40 degrees and s <= 1.5 times the map's smallest; more is "
            "better.",
            normalisation="per cent",
            source=_CAPEK,
            value=terms.share_above_smallest,
            terms=(terms.omega,),
        ),
        Index(
            name="capek_nominal",
            symbol="Q1",
            group="capek",
            definition="Percentage of the area with omega <= 40 degrees and s within a factor of 1.5 of 1; more is "
            "better.",
            normalisation="per cent",
            source=f"{_CAPEK}; the other reading of its limit of areas",
            value=terms.share_near_nominal,
            best_scale=terms.best_for_share,
            terms=(terms.omega,),
        ),
        _view(
            "francula",
            "E_A85",
            "francula",
            "half of the sum, root; elsewhere than on the globe the whole region counts",
            terms.best_for_airy,
            figure="airy",
            definition="RMS of sqrt(((a - 1)^2 + (b - 1)^2) / 2) on the globe between 85 degrees south and north.",
            source="Francula 1971, Die vorteilhaftesten Abbildungen in der Atlaskartographie",
            band=85.0,
        ),
        Index(
            name="kunimune_area",
            symbol="sd ln s",
            group="kunimune",
            definition="Standard deviation of ln s.",
            normalisation="by true area",
            source=_KUNIMUNE,
            value=terms.deviation_of_log_area,
            terms=(terms.log_area_squared,),
        ),
        _view("kunimune_shape", "|ln a/b|", "kunimune", "by true area"),
        _view("isotropy", "I", "goldberg-gott", "by true area", published_within=_WITHOUT_POLES),
        Index(
            name="area",
            symbol="A",
            group="goldberg-gott",
            definition="Standard deviation of ln(ab).",
            normalisation="by true area",
            source=_GOTT,
            value=_SCORED["A"],
            terms=(terms.log_area_squared,),
            published_within=_WITHOUT_POLES,
        ),
        *(
            Index(
                name=name,
                symbol=name[0].upper(),
                group="goldberg-gott",
                definition=f"Mean over all places and directions of |{product}| / |v|^2 along great circles.",
                normalisation="per radian, by true area",
                source=_GOTT,
                value=_SCORED[name[0].upper()],
                second_order=(name,),
                published_within=_WITHOUT_POLES,
            )
            for name, product in (("flexion", "v x w"), ("skewness", "v . w"))
        ),
        Index(
            name="distances",
            symbol="D",
            group="goldberg-gott",
            definition="Standard deviation of ln(distance on the map / on the globe) over all pairs of points.",
            normalisation="by true area; straight lines on the map as it lies, across its cuts, too; the error is a "
            "standard error",
            source="Gott, Mugnolo & Colley 2007, Map projections minimizing distance errors, Cartographica 42:219",
            value=_SCORED["D"],
        ),
        Index(
            name="boundary_cuts",
            symbol="B",
            group="goldberg-gott",
            definition="Length of the lines along which the globe is cut to be laid flat, over 4 pi; of the globe "
            "only.",
            normalisation="a cut from pole to pole is 0.25",
            source=_GOTT,
            value=_SCORED["B"],
        ),
        Index(
            name="goldberg_gott_score",
            symbol="score",
            group="goldberg-gott",
            definition="Sum over I, A, F, S, D, B of (X / X of the plate carree)^2; of the globe only.",
            normalisation="by the plate carree's row as it was printed, .51 .41 .64 .60 .449 .25, rounded",
            source=_GGV,
            value=score_of(_SCORED),
            terms=(terms.term_of(_ISOTROPY), terms.log_area_squared),
            second_order=("flexion", "skewness"),
            published_within=_WITHOUT_POLES,
        ),
        Index(
            name="peters_distance",
            symbol="DI",
            group="finite",
            definition="Mean of |map - globe| / (map + globe) of the distances of all pairs of points.",
            normalisation="by true area, as D; from 0 to 1",
            source="Peters 1984, Distance-related Maps, The American Cartographer 11:119",
            value=terms.distance_index,
            best_scale=terms.best_for_distances,
        ),
        Index(
            name="canters_finite",
            symbol="K1",
            group="finite",
            definition="Mean finite scale factor (1 + DI) / (1 - DI), of all pairs of points.",
            normalisation="by true area, as D; Canters' own figures are of distances on land that he chose otherwise",
            source=_CANTERS_2002,
            value=terms.finite_scale_factor,
            best_scale=terms.best_for_distances,
        ),
        Index(
            name="great_circle_bending",
            symbol="bend",
            group="finite",
            definition="Mean distance of great circles from the straight lines between their ends, in lengths of "
            "these.",
            normalisation="by true area, of all pairs of points; in short arcs of length L it is F L / 12",
            source="the finite form of the flexion of Goldberg & Gott 2007",
            value=terms.bending,
        ),
    )
}

GROUPS: tuple[str, ...] = tuple(dict.fromkeys(index.group for index in _INDICES.values()))

INDICES: Registry[Index] = Registry(
    "index",
    _INDICES,
    aliases={name: index.name for index in reversed(_INDICES.values()) for name in (index.symbol, index.name)},
    suggested=["all", *GROUPS, *_INDICES],
    rule=f"It must be all, a group ({', '.join(GROUPS)}), or an index (see 'projdist list indices').",
)


def get_index(name: str) -> Index:
    """The index of a name or symbol; raises ValueError with close matches."""
    return INDICES.named(name)


def get_indices(names: str | Iterable[str] = "all") -> list[Index]:
    """The indices of groups, names and symbols, or "all", each once; raises ValueError with close matches.

    A name that a group and an index have is the group's.
    """
    chosen: dict[str, Index] = {}
    for name in listed_values(names):
        check_text("index", name)
        found = [index for index in INDICES.values() if name in ("all", index.group)]
        chosen |= {index.name: index for index in found or [get_index(name)]}
    return list(chosen.values())
