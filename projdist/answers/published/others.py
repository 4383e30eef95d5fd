"""Figures by the conventions and the samplings of others, where those are not ours."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence

import numpy as np

from projdist.answers.distances import distance_distortion
from projdist.answers.published.rows import Printed, printed
from projdist.answers.published_indices import goldberg_gott_score, indices
from projdist.earth import MEAN_EARTH_RADIUS
from projdist.numerics import Estimate
from projdist.projections import distance_around_edge
from projdist.regions import GLOBE, Box, Place, PointSet

__all__ = ["figure_of_others", "index_figures"]

_COARSE = 1e-6  # of means; printed are four digits at most


def index_figures(definition: str, region: Place, symbols: Sequence[str]) -> dict[str, Estimate]:
    """Indices of a map over a region, by symbol, at the scale that their authors take."""
    found = indices(definition, region, symbols, tolerance=_COARSE)
    # Of those with a scale to choose, Francula's is at the best, and Canters and Decleir's are at the nominal.
    return {
        symbol: Estimate(found[symbol].best, found[symbol].best_error)
        if symbol == "E_A85"
        else Estimate(found[symbol].value, found[symbol].error)
        for symbol in symbols
    }


def figure_of_others(row: Printed, value: float) -> float:
    """What a row's convention makes of its figure, of which `value` is ours; NaN where it makes none."""
    if row.convention in _REGIONS:
        same = tuple(one.measure for one in printed(row.table) if _key(one) == _key(row))
        return _elsewhere(row.definition, row.convention, same)[row.measure].value
    other = _OTHERS.get(row.convention)
    return other(row, value) if other else math.nan


def _key(row: Printed) -> tuple[str, str]:
    return row.definition, row.convention


@functools.lru_cache(maxsize=64)
def _elsewhere(definition: str, convention: str, symbols: tuple[str, ...]) -> dict[str, Estimate]:
    return index_figures(definition, _REGIONS[convention], symbols)


def _cells(step: float) -> PointSet:
    """The centres of cells of the globe, with their areas for weights."""
    lon, lat = np.meshgrid(np.arange(-180.0 + step / 2, 180.0, step), np.arange(-90.0 + step / 2, 90.0, step))
    return PointSet(lon.ravel(), lat.ravel(), np.cos(np.radians(lat)).ravel())


_REGIONS: dict[str, Place] = {
    "without-poles": Box(-180.0, -88.0, 180.0, 88.0),
    "band-85.05": Box(-180.0, -85.0511287798066, 180.0, 85.0511287798066),
    "cells-2.5": _cells(2.5),
}


def _cut_off(row: Printed, value: float) -> float:
    """The figure with its further digits cut off."""
    unit = 10.0**row.decimals
    return math.floor(value * unit) / unit


def _of_printed_row(row: Printed, value: float) -> float:
    """The score of the figures that Goldberg and Gott print of the map."""
    figures = {one.measure: one.value for one in printed("goldberg-gott") if one.definition == row.definition}
    return goldberg_gott_score(figures)


def _over_the_edge(row: Printed, value: float) -> float:
    """The score of a map with two sides, of which nothing is cut."""
    found = index_figures(row.definition, GLOBE, [*"IAFS"])
    edge = 0.5 * math.pi * MEAN_EARTH_RADIUS
    distances = distance_distortion(row.definition, map_distance=functools.partial(distance_around_edge, edge=edge))
    figures = {symbol: one.value for symbol, one in found.items()} | {"D": distances.value, "B": 0.0}
    return goldberg_gott_score(figures)


_OTHERS: dict[str, Callable[[Printed, float], float]] = {
    "cut-off": _cut_off,
    "printed-row": _of_printed_row,
    "over-the-edge": _over_the_edge,
}
