"""Tables of the literature: printed figures beside computed ones."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from projdist import earth, matrices, projections, regions, support
from projdist.answers.distances import distance_distortion
from projdist.answers.points_and_lines import factors
from projdist.answers.published_indices import goldberg_gott_score, indices

TABLES = {row["name"]: row["source"] for row in earth.data_rows("published/tables.csv")}
"""The sources of the published tables, by name."""


@dataclass(frozen=True, kw_only=True)
class Printed:
    """A printed figure of a projection, at a point or of the globe."""

    table: str = field(metadata=support.HIDDEN)
    source: str
    projection: str
    definition: str
    lon: float  # NaN for the globe, as the latitude
    lat: float
    measure: str  # name or symbol of a measure at points, or of an index
    value: float = field(metadata=support.schema("published"))
    decimals: int
    status: str  # how the figure was read
    convention: str = field(metadata=support.HIDDEN)  # by which it comes out, if not by ours

    @property
    def at_point(self) -> bool:
        """True for a figure at a point."""
        return not math.isnan(self.lat)


@functools.cache
def printed(table: str) -> tuple[Printed, ...]:
    """The figures of a published table."""
    rows = [row for name in ("world", "pointwise") for row in earth.data_rows(f"published/{name}.csv")]
    return tuple(
        Printed(
            table=table,
            lon=float(row.get("lon", math.nan)),
            lat=float(row.get("lat", math.nan)),
            value=float(row["value"]),
            decimals=int(row["decimals"]),
            status=row.get("status", "read"),
            **{key: row[key] for key in ("source", "projection", "definition", "measure", "convention")},
        )
        for row in rows
        if row["name"] == table
    )


@functools.cache
def conventions() -> dict[str, tuple[float, str]]:
    """By name, the allowed difference of a convention (NaN if it has no figure of its own), and its description."""
    return {
        row["convention"]: (float(row["slack"] or "nan"), row["explanation"])
        for row in earth.data_rows("published/conventions.csv")
    }


# ---- figures by others' conventions --------------------------------------------------------------

_COARSE = 1e-6  # tolerance of means; at most four digits are printed


@functools.lru_cache(maxsize=64)
def index_figures(definition: str, region: regions.Place, symbols: tuple[str, ...]) -> dict[str, support.Estimate]:
    """Indices of a map over a region, by symbol, at the scale that their authors take."""
    found = indices(definition, region, symbols, tolerance=_COARSE)
    values = {symbol: support.Estimate(found[symbol].value, found[symbol].error) for symbol in symbols}
    if "E_A85" in values:  # Francula's is at the best scale, Canters and Decleir's are at the nominal one
        values["E_A85"] = support.Estimate(found["E_A85"].best, found["E_A85"].best_error)
    return values


def figure_of_others(row: Printed, value: float) -> float:
    """The figure of a row by its convention, NaN if that gives none; `value` is ours."""
    if row.convention in _REGIONS:
        same = (one for one in printed(row.table) if one.definition == row.definition)
        symbols = tuple(one.measure for one in same if one.convention == row.convention)
        return index_figures(row.definition, _REGIONS[row.convention], symbols)[row.measure].value
    if row.convention == "cut-off":  # not rounded
        unit = 10.0**row.decimals
        return math.floor(value * unit) / unit
    if row.convention == "printed-row":  # the score of the figures that Goldberg and Gott print for the map
        figures = {one.measure: one.value for one in printed("goldberg-gott") if one.definition == row.definition}
        return goldberg_gott_score(figures)
    if row.convention == "over-the-edge":  # the score of a map with two sides, which has no cuts
        found = index_figures(row.definition, regions.GLOBE, tuple("IAFS"))
        figures = {symbol: one.value for symbol, one in found.items()}
        edge = functools.partial(projections.distance_around_edge, edge=0.5 * math.pi * earth.MEAN_EARTH_RADIUS)
        distances = distance_distortion(row.definition, map_distance=edge)
        return goldberg_gott_score(figures | {"D": distances.value, "B": 0.0})
    return math.nan


_LON, _LAT = (axis.ravel() for axis in np.meshgrid(np.arange(-178.75, 180.0, 2.5), np.arange(-88.75, 90.0, 2.5)))
_REGIONS: dict[str, regions.Place] = {
    "without-poles": regions.Box(-180.0, -88.0, 180.0, 88.0),
    "band-85.05": regions.Box(-180.0, -85.0511287798066, 180.0, 85.0511287798066),
    "cells-2.5": regions.PointSet(_LON, _LAT, np.cos(np.radians(_LAT))),  # the centres of cells, weighted by area
}


# ---- printed beside computed ---------------------------------------------------------------------

_ROUNDING = 1e-9  # relative, of half a unit of the last decimal


@dataclass(frozen=True, kw_only=True)
class PublishedRow(support.Record):
    """A printed figure, ours, its estimated error, and the figure by the convention that explains a difference."""

    printed: Printed = field(metadata=support.schema(spread=True))
    value: float
    error: float
    difference: float  # our figure less the printed one
    reproduced: bool  # they agree to half a unit of the last printed decimal
    convention: str
    value_by_convention: float  # NaN if there is none
    explained: bool  # that and the printed one agree, with the allowed difference of the convention
    explanation: str  # convention or sampling by which the printed figure comes out, "" if it does by ours


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PublishedTable(support.Answer):
    """A table of the literature, a row for each figure."""

    name: str
    source: str
    rows: tuple[PublishedRow, ...] = field(metadata=support.schema("results"))

    def _line(self) -> str:
        return f"{self.name}: {len(self.rows)} rows"

    def _table(self) -> list[dict[str, Any]]:
        return [support.values_of(row) for row in self.rows]


def tables(name: str) -> PublishedTable:
    """A table of the literature beside figures computed anew.

    Parameters
    ----------
    name : str
        One of `TABLES`, such as "goldberg-gott" or "snyder".

    Returns
    -------
    PublishedTable
        A `PublishedRow` for each printed figure: it, ours, and that by the convention that explains a difference.

    Raises
    ------
    ValueError
        For another name, with close matches.

    References
    ----------
    That of a table is its `source`; Kunimune's is Map-Projections, output/parameters.txt.

    Examples
    --------
    >>> [(round(row.printed.value, 3), round(row.value, 3)) for row in tables("kunimune").rows]
    [(0.259, 0.259), (0.364, 0.364), (0.614, 0.614)]
    """
    rows = printed(support.check_choice("table", name, TABLES))
    groups: dict[tuple[str, bool], list[Printed]] = {}
    for row in rows:
        groups.setdefault((row.definition, row.at_point), []).append(row)
    ours: dict[Printed, support.Estimate] = {}
    for (definition, at_point), group in groups.items():
        if at_point:
            ours |= _at_points(definition, group)
        else:
            found = index_figures(definition, regions.GLOBE, tuple(dict.fromkeys(row.measure for row in group)))
            ours |= {row: found[row.measure] for row in group}
    compared = []
    for row in rows:
        other = figure_of_others(row, ours[row].value)
        slack, explanation = conventions()[row.convention] if row.convention else (0.0, "")
        value, error = ours[row]
        compared.append(
            PublishedRow(
                printed=row,
                value=value,
                error=error,
                difference=value - row.value,
                reproduced=_agrees(row, value),
                convention=row.convention,
                value_by_convention=other,
                explained=_agrees(row, other, slack),
                explanation=explanation,
            )
        )
    return PublishedTable(name=name, source=TABLES[name], rows=tuple(compared))


def _agrees(row: Printed, value: float, slack: float = 0.0) -> bool:
    half = 0.5 * 10.0**-row.decimals * (1.0 + _ROUNDING)
    return abs(value - row.value) <= half + slack


def _at_points(definition: str, rows: Sequence[Printed]) -> dict[Printed, support.Estimate]:
    """Our figures of a map at the points of printed ones."""
    found = factors(definition, [row.lon for row in rows], [row.lat for row in rows])
    ours = {}
    for row, J, error in zip(rows, found.jacobian, found.error.tolist(), strict=True):
        measure = matrices.get_measure(row.measure)
        value = float(measure(J))
        # The error of J is the relative error of scales; twice that is the error of angles in radians.
        ours[row] = support.Estimate(value, math.degrees(2.0 * error) if measure.unit == "deg" else error * abs(value))
    return ours
