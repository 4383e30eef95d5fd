"""The published indices by name and by group."""

from __future__ import annotations

from collections.abc import Iterable

from projdist.answers.published_indices import boundary, finite, score, terms
from projdist.answers.published_indices.index import Index
from projdist.support import check_text, hints, listed_values, quoted

__all__ = ["GROUPS", "INDICES", "get_index", "get_indices"]

_AIRY = "Airy 1861, Explanation of a projection by balance of errors, Philosophical Magazine 22:409"
_GOTT = "Goldberg & Gott 2007, Flexion and Skewness in Map Projections of the Earth, Cartographica 42:297"
_CANTERS = "Canters & Decleir 1989, The World in Perspective"
_CANTERS_2002 = "Canters 2002, Small-scale Map Projection Design"
_GGV = "Gott, Goldberg & Vanderbei 2021, Flat Maps that improve on the Winkel Tripel, arXiv 2102.08176"
_CAPEK = "Capek 2001, Which is the best projection for the world map?, Proceedings of the 20th ICC, Beijing"
_OZERI = "Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications"
_KAVRAYSKIY = "Kavrayskiy 1934, Matematicheskaya kartografiya"
_KUNIMUNE = "Kunimune, Map-Projections, output/parameters.txt"

_WITHOUT_POLES = 88.0  # degrees: found by experiment (published/conventions.csv), the authors do not say it

_SCORED = {
    "I": terms.rms_of(terms.log_shape_squared),
    "A": terms.deviation_of_log_area,
    "F": terms.second_order("flexion"),
    "S": terms.second_order("skewness"),
    "D": finite.spread,
    "B": boundary.boundary_cuts,
}

INDICES: dict[str, Index] = {
    index.name: index
    for index in (
        Index(
            "airy",
            "E_A",
            "airy",
            "Root of the mean of ((a - 1)^2 + (b - 1)^2) / 2.",
            "half of the sum, root",
            _AIRY,
            terms.rms_of(terms.airy),
            terms.best_for_airy,
            (terms.airy,),
        ),
        Index(
            "airy_balance",
            "E_B",
            "airy",
            "Root of the mean of ((a/b - 1)^2 + (ab - 1)^2) / 2, Airy's balance of the errors of shape and of area.",
            "half of the sum, root; for small errors twice the square of E_A",
            _AIRY,
            terms.rms_of(terms.balance),
            terms.best_for_balance,
            (terms.balance,),
        ),
        Index(
            "jordan",
            "E_J",
            "jordan",
            "Root of the mean over all places and directions of (scale - 1)^2.",
            "mean over directions, root",
            "Jordan 1896, Zeitschrift fuer Vermessungswesen 25:249",
            terms.rms_of(terms.jordan_squared),
            terms.best_for_jordan,
            (terms.jordan_squared,),
        ),
        Index(
            "jordan_kavrayskiy",
            "E_JK",
            "jordan",
            "Root of the mean over all places and directions of ln^2 of the scale.",
            "mean over directions, root",
            _KAVRAYSKIY,
            terms.rms_of(terms.jordan_kavrayskiy),
            terms.best_for_jordan_kavrayskiy,
            (terms.jordan_kavrayskiy,),
        ),
        Index(
            "airy_kavrayskiy",
            "E_AK",
            "kavrayskiy",
            "Root of the mean of ln^2 a + ln^2 b, the RMS Fisher distortion.",
            "the sum, root: 1",
            _OZERI,
            terms.rms_of(terms.kavrayskiy, 2.0),
            terms.best_for_logarithms,
        ),
        Index(
            "airy_kavrayskiy_half",
            "E_AK/2",
            "kavrayskiy",
            "Root of the mean of (ln^2 a + ln^2 b) / 2, the form of most of the literature.",
            "half of the sum, root: 1/sqrt(2) of E_AK",
            _KAVRAYSKIY,
            terms.rms_of(terms.kavrayskiy),
            terms.best_for_logarithms,
        ),
        Index(
            "airy_kavrayskiy_double",
            "2E_AK",
            "kavrayskiy",
            "Root of the mean of ln^2(a/b) + ln^2(ab), which is 2 (ln^2 a + ln^2 b).",
            "twice the sum, root: sqrt(2) of E_AK",
            f"{_OZERI}, equation 1",
            terms.rms_of(terms.kavrayskiy, 4.0),
            terms.best_for_logarithms,
        ),
        *(
            Index(
                f"klingatsch_{name}",
                f"E_K{angles:g}{areas:g}",
                "klingatsch",
                f"Root of the mean of (p ln^2(a/b) + q ln^2(ab)) / (p + q), p = {angles:g}, q = {areas:g}: {what}",
                "weights that sum to 1, root; with equal weights E_AK",
                "weights of angles and areas as Klingatsch has them, of logarithms; not read in the original",
                terms.rms_of(terms.weighted(angles, areas)),
                terms.best_for_logarithms,
                (terms.weighted(angles, areas),),
            )
            for name, angles, areas, what in (
                ("angles", 2.0, 1.0, "angles count twice."),
                ("areas", 1.0, 2.0, "areas count twice."),
            )
        ),
        Index(
            "chebyshev",
            "C",
            "chebyshev",
            "Largest |ln scale| in any place and direction.",
            "none; at the best scale half of Milnor's distortion",
            "Chebyshev 1856, Sur la construction des cartes geographiques",
            terms.largest_error,
            terms.best_for_largest,
        ),
        Index(
            "chebyshev_ratio",
            "m/m",
            "chebyshev",
            "Largest scale over smallest, in any place and direction.",
            "none; exp of Milnor's distortion",
            "Chebyshev 1856, Sur la construction des cartes geographiques",
            terms.scale_ratio,
        ),
        Index(
            "milnor",
            "delta",
            "chebyshev",
            "ln of the largest scale over the smallest, in any place and direction.",
            "none; Milnor's own is of finite distances, the same where region and map are convex",
            "Milnor 1969, A problem in cartography, American Mathematical Monthly 76:1101",
            terms.log_scale_ratio,
        ),
        Index(
            "canters_ab",
            "Dab",
            "canters",
            "Mean of (max(a, 1/a) + max(b, 1/b)) / 2 - 1.",
            "by true area",
            _CANTERS,
            terms.mean_of(terms.relative_scales),
            terms.searched(terms.relative_scales),
            (terms.relative_scales,),
            kinked=True,
        ),
        Index(
            "canters_ar",
            "Dar",
            "canters",
            "Mean of max(s, 1/s) - 1.",
            "by true area",
            _CANTERS,
            terms.mean_of(terms.relative_area),
            terms.searched(terms.relative_area),
            (terms.relative_area,),
            kinked=True,
        ),
        Index(
            "canters_an",
            "Dan",
            "canters",
            "Mean of the maximum angular deformation omega, in degrees.",
            "by true area; the full angle 2 asin((a - b) / (a + b))",
            _CANTERS,
            terms.mean_of(terms.omega),
            terms=(terms.omega,),
        ),
        Index(
            "capek",
            "Q",
            "capek",
            "Percentage of the area with omega <= 40 degrees and s <= 1.5 times the map's smallest; more is better.",
            "per cent",
            _CAPEK,
            terms.share_above_smallest,
            terms=(terms.omega,),
        ),
        Index(
            "capek_nominal",
            "Q1",
            "capek",
            "Percentage of the area with omega <= 40 degrees and s within a factor of 1.5 of 1; more is better.",
            "per cent",
            f"{_CAPEK}; the other reading of its limit of areas",
            terms.share_near_nominal,
            terms.best_for_share,
            (terms.omega,),
        ),
        Index(
            "francula",
            "E_A85",
            "francula",
            "Root of the mean of ((a - 1)^2 + (b - 1)^2) / 2 on the globe between 85 degrees south and north.",
            "half of the sum, root; elsewhere than on the globe the whole region counts",
            "Francula 1971, Die vorteilhaftesten Abbildungen in der Atlaskartographie",
            terms.rms_of(terms.airy),
            terms.best_for_airy,
            (terms.airy,),
            band=85.0,
        ),
        Index(
            "kunimune_area",
            "sd ln s",
            "kunimune",
            "Standard deviation of ln s.",
            "by true area",
            _KUNIMUNE,
            terms.deviation_of_log_area,
            terms=(terms.log_area_squared,),
        ),
        Index(
            "kunimune_shape",
            "|ln a/b|",
            "kunimune",
            "Mean of |ln(a/b)|.",
            "by true area",
            _KUNIMUNE,
            terms.mean_of(terms.log_shape),
            terms=(terms.log_shape,),
        ),
        Index(
            "isotropy",
            "I",
            "goldberg-gott",
            "Root of the mean of ln^2(a/b).",
            "by true area",
            _GOTT,
            _SCORED["I"],
            terms=(terms.log_shape_squared,),
            published_within=_WITHOUT_POLES,
        ),
        Index(
            "area",
            "A",
            "goldberg-gott",
            "Standard deviation of ln(ab).",
            "by true area",
            _GOTT,
            _SCORED["A"],
            terms=(terms.log_area_squared,),
            published_within=_WITHOUT_POLES,
        ),
        *(
            Index(
                name,
                name[0].upper(),
                "goldberg-gott",
                f"Mean over all places and directions of |{product}| / |v|^2 along great circles.",
                "per radian, by true area",
                _GOTT,
                _SCORED[name[0].upper()],
                second_order=(name,),
                published_within=_WITHOUT_POLES,
            )
            for name, product in (("flexion", "v x w"), ("skewness", "v . w"))
        ),
        Index(
            "distances",
            "D",
            "goldberg-gott",
            "Standard deviation of ln(distance on the map / on the globe) over all pairs of points.",
            "by true area; straight lines on the map as it lies, across its cuts, too; the error is a standard error",
            "Gott, Mugnolo & Colley 2007, Map projections minimizing distance errors, Cartographica 42:219",
            _SCORED["D"],
        ),
        Index(
            "boundary_cuts",
            "B",
            "goldberg-gott",
            "Length of the lines along which the globe is cut to be laid flat, over 4 pi; of the globe only.",
            "a cut from pole to pole is 0.25",
            _GOTT,
            _SCORED["B"],
        ),
        Index(
            "goldberg_gott_score",
            "score",
            "goldberg-gott",
            "Sum over I, A, F, S, D, B of (X / X of the plate carree)^2; of the globe only.",
            "by the plate carree's row as it was printed, .51 .41 .64 .60 .449 .25, rounded",
            _GGV,
            score.score_of(_SCORED),
            terms=(terms.log_shape_squared, terms.log_area_squared),
            second_order=("flexion", "skewness"),
            published_within=_WITHOUT_POLES,
        ),
        Index(
            "peters_distance",
            "DI",
            "finite",
            "Mean of |map - globe| / (map + globe) of the distances of all pairs of points.",
            "by true area, as D; from 0 to 1",
            "Peters 1984, Distance-related Maps, The American Cartographer 11:119",
            finite.distance_index,
            finite.best_for_distances,
        ),
        Index(
            "canters_finite",
            "K1",
            "finite",
            "Mean finite scale factor (1 + DI) / (1 - DI), of all pairs of points.",
            "by true area, as D; Canters' own figures are of distances on land that he chose otherwise",
            _CANTERS_2002,
            finite.finite_scale_factor,
            finite.best_for_distances,
        ),
        Index(
            "great_circle_bending",
            "bend",
            "finite",
            "Mean distance of great circles from the straight lines between their ends, in lengths of these.",
            "by true area, of all pairs of points; in short arcs of length L it is F L / 12",
            "the finite form of the flexion of Goldberg & Gott 2007",
            finite.bending,
        ),
    )
}

GROUPS: tuple[str, ...] = tuple(dict.fromkeys(index.group for index in INDICES.values()))

_ALLOWED = f"It must be all, a group ({', '.join(GROUPS)}), or an index (see 'projdist list indices')."


def get_index(name: str) -> Index:
    """The index of a name or symbol; raises ValueError with close matches."""
    for index in INDICES.values():
        if name in (index.name, index.symbol):
            return index
    hint = hints.suggestion(name, ["all", *GROUPS, *INDICES]) if isinstance(name, str) else ""
    raise ValueError(f"Invalid index {quoted(name)}. {hint}{_ALLOWED}")


def get_indices(names: str | Iterable[str] = "all") -> list[Index]:
    """The indices of groups, names and symbols, each once, and of "all"; raises ValueError with close matches.

    What is the name of a group and of an index is the group.
    """
    chosen: dict[str, Index] = {}
    for name in listed_values(names):
        check_text("index", name)
        found = [index for index in INDICES.values() if name in ("all", index.group)]
        chosen |= {index.name: index for index in found or [get_index(name)]}
    return list(chosen.values())
