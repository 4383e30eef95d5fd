"""The score of Gott, Goldberg and Vanderbei: six indices of a map against those of the plate carree."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from projdist.answers.published_indices.index import ScaledField
from projdist.numerics import Estimate
from projdist.support import check_number, quoted

__all__ = ["NORMALISERS", "goldberg_gott_score", "score_of"]

NORMALISERS = {"I": 0.51, "A": 0.41, "F": 0.64, "S": 0.60, "D": 0.449, "B": 0.25}
"""The plate carree's row as Goldberg & Gott (2007) print it, rounded, which the published scores are made with."""


def goldberg_gott_score(values: Mapping[str, float], normalisers: Mapping[str, float] = NORMALISERS) -> float:
    """The score of a map by six indices: the sum over I, A, F, S, D, B of (X / X of the plate carree)^2.

    Parameters
    ----------
    values : mapping of str to float
        The map's indices by symbol: isotropy I, area A, flexion F, skewness S, distances D, boundary cuts B.
    normalisers : mapping of str to float, optional
        Those of the plate carree. Without any they are as Goldberg & Gott (2007) print them, rounded, which the
        published scores are made with.

    Returns
    -------
    float
        The score; smaller is better.

    Raises
    ------
    ValueError
        Where one of the indices is missing or is no number.

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


def score_of(
    values: Mapping[str, Callable[[ScaledField, float], Estimate]],
) -> Callable[[ScaledField, float], Estimate]:
    """The score of a field, of what its six indices are by symbol; NaN where one of them is undefined."""

    def score(field: ScaledField, scale: float) -> Estimate:
        found = {symbol: field.once(value) for symbol, value in values.items()}
        # Six errors that may all have one sign.
        error = sum(2.0 * abs(one.value) * one.error / NORMALISERS[symbol] ** 2 for symbol, one in found.items())
        return Estimate(goldberg_gott_score({symbol: one.value for symbol, one in found.items()}), error)

    return score
