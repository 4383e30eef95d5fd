"""The score of Gott, Goldberg and Vanderbei: six indices of a map against those of the plate carree."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from projdist.indices.index import Estimate, Field

__all__ = ["NORMALISERS", "goldberg_gott_score", "score_of"]

NORMALISERS = {"I": 0.51, "A": 0.41, "F": 0.64, "S": 0.60, "D": 0.449, "B": 0.25}
"""The plate carree's row as Goldberg & Gott (2007) print it, rounded, which the published scores are made with."""


def goldberg_gott_score(values: Mapping[str, float], normalisers: Mapping[str, float] = NORMALISERS) -> float:
    """The sum over I, A, F, S, D, B of (X / X of the plate carree)^2; raises ValueError where one is missing.

    Gott, Goldberg & Vanderbei 2021, "Flat Maps that improve on the Winkel Tripel".

    >>> goldberg_gott_score(NORMALISERS)
    6.0
    """
    missing = [symbol for symbol in normalisers if symbol not in values]
    if missing:
        symbols = ", ".join(normalisers)
        raise ValueError(f"Invalid values for the score. There must be {symbols}; {missing[0]} is missing.")
    return sum((values[symbol] / scale) ** 2 for symbol, scale in normalisers.items())


def score_of(values: Mapping[str, Callable[[Field, float], Estimate]]) -> Callable[[Field, float], Estimate]:
    """The score of a field, of what its six indices are by symbol; NaN where one of them is undefined."""

    def score(field: Field, scale: float) -> Estimate:
        found = {symbol: field.once(value) for symbol, value in values.items()}
        # Six errors that may all have one sign.
        error = sum(2.0 * abs(one.value) * one.error / NORMALISERS[symbol] ** 2 for symbol, one in found.items())
        return Estimate(goldberg_gott_score({symbol: one.value for symbol, one in found.items()}), error)

    return score
