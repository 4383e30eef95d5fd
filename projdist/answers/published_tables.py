"""Tables of the literature: figures as they were printed, beside ours."""

from __future__ import annotations

import csv
import functools
import importlib.resources
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist.answers.distances import distance_distortion
from projdist.answers.point_factors import factors
from projdist.answers.published_indices import goldberg_gott_score, indices
from projdist.earth import MEAN_EARTH_RADIUS
from projdist.matrices import get_measure
from projdist.numerics import Estimate
from projdist.projections import distance_around_edge
from projdist.regions import GLOBE, Box, Place, PointSet
from projdist.support import Answer, check_choice, plain

TABLES: dict[str, str] = {
    "goldberg-gott": "Goldberg & Gott 2007, Flexion and Skewness in Map Projections of the Earth",
    "gott-goldberg-vanderbei": "Gott, Goldberg & Vanderbei 2021, Flat Maps that improve on the Winkel Tripel",
    "gott-mugnolo-colley": "Gott, Mugnolo & Colley 2007, Map projections minimizing distance errors",
    "canters-decleir": "Canters & Decleir 1989, The World in Perspective: their indices, from later papers",
    "capek": "Capek 2001, Which is the best projection for the world map?",
    "francula": "Francula 1971, Die vorteilhaftesten Abbildungen in der Atlaskartographie",
    "kunimune": "Kunimune, Map-Projections, output/parameters.txt",
    "snyder": "Snyder 1987, Map Projections: A Working Manual, USGS Professional Paper 1395: its worked tables",
    "proj": "The test suites of PROJ and pyproj",
}
"""The published tables by name."""


@dataclass(frozen=True, kw_only=True)
class Printed:
    """A figure as it was printed: of a projection, and at a point, or of the globe, where `lon` and `lat` are NaN.

    `value` has so many `decimals`. `measure` is the name or symbol of a measure at points, or of an index. `status`
    tells how the figure was read, `convention` by which other convention or sampling it comes out, if not by ours.
    """

    table: str
    source: str
    projection: str
    definition: str
    lon: float
    lat: float
    measure: str
    value: float
    decimals: int
    status: str
    convention: str

    @property
    def at_point(self) -> bool:
        """Whether it is of a point."""
        return not math.isnan(self.lat)


@functools.cache
def printed(table: str) -> tuple[Printed, ...]:
    """The figures of a published table; raises ValueError with close matches."""
    rows = [row for file in ("world.csv", "pointwise.csv") for row in _read(file)]
    return tuple(
        Printed(
            table=table,
            source=row["source"],
            projection=row["projection"],
            definition=row["definition"],
            lon=float(row.get("lon", math.nan)),
            lat=float(row.get("lat", math.nan)),
            measure=row["measure"],
            value=float(row["value"]),
            decimals=int(row["decimals"]),
            status=row.get("status", "read"),
            convention=row["convention"],
        )
        for row in rows
        if row["name"] == table
    )


@functools.cache
def conventions() -> dict[str, tuple[float, str]]:
    """By name, what a convention may be off by (NaN: it has no figure of its own), and the convention in words."""
    return {row["convention"]: (float(row["slack"] or "nan"), row["explanation"]) for row in _read("conventions.csv")}


@functools.cache
def _read(name: str) -> tuple[dict[str, str], ...]:
    file = importlib.resources.files("projdist") / "data" / "published" / name
    return tuple(csv.DictReader(file.read_text(encoding="utf-8").splitlines()))


# ---- figures by others' conventions --------------------------------------------------------------


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


# ---- printed beside computed ---------------------------------------------------------------------


_ROUNDING = 1e-9  # of half a unit of the last decimal


@dataclass(frozen=True)
class PublishedRow:
    """A printed figure, ours with its estimated error, and the figure by the convention that explains the difference.

    `reproduced` is whether the two agree to half a unit of the last decimal printed; `explained` whether the figure by
    the other convention does, which is NaN where there is none, to that and what the convention is said to be off by.
    """

    printed: Printed
    value: float
    error: float
    value_by_convention: float
    explained: bool

    @property
    def difference(self) -> float:
        """Ours less the printed figure."""
        return self.value - self.printed.value

    @property
    def reproduced(self) -> bool:
        """Whether the printed figure comes out."""
        return _agrees(self.printed, self.value)

    @property
    def explanation(self) -> str:
        """By which convention or sampling the printed figure comes out where it does not come out by ours."""
        return conventions()[self.printed.convention][1] if self.printed.convention else ""

    def to_dict(self) -> dict[str, Any]:
        """The figures by name; what is undefined is None."""
        return {name: plain(value) for name, value in self.columns().items()}

    def columns(self) -> dict[str, Any]:
        """The figures by name; what is undefined is NaN."""
        row = self.printed
        return {
            "source": row.source,
            "projection": row.projection,
            "definition": row.definition,
            "lon": row.lon,
            "lat": row.lat,
            "measure": row.measure,
            "published": row.value,
            "decimals": row.decimals,
            "status": row.status,
            "value": self.value,
            "error": self.error,
            "difference": self.difference,
            "reproduced": self.reproduced,
            "convention": row.convention,
            "value_by_convention": self.value_by_convention,
            "explained": self.explained,
            "explanation": self.explanation,
        }


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PublishedTable(Answer):
    """A table of the literature, a row a figure."""

    name: str
    source: str
    rows: tuple[PublishedRow, ...]

    def _line(self) -> str:
        return f"{self.name}: {len(self.rows)} rows"

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON; what is undefined is None."""
        return {"name": self.name, "source": self.source, "results": [row.to_dict() for row in self.rows]}

    def _table(self) -> list[dict[str, Any]]:
        return [row.columns() for row in self.rows]


def tables(name: str) -> PublishedTable:
    """A table of the literature, its figures computed anew.

    Parameters
    ----------
    name : str
        "goldberg-gott", "gott-goldberg-vanderbei", "gott-mugnolo-colley", "canters-decleir", "capek", "francula",
        "kunimune", "snyder" or "proj".

    Returns
    -------
    PublishedTable
        A `PublishedRow` for each figure that was printed: it, ours with its estimated error, and the figure by the
        convention that explains the difference, where there is one.

    Raises
    ------
    ValueError
        For another name, with close matches.

    References
    ----------
    Each table has its own, `source`; Kunimune's is Map-Projections, output/parameters.txt.

    Examples
    --------
    >>> [(round(row.printed.value, 3), round(row.value, 3)) for row in tables("kunimune").rows]
    [(0.259, 0.259), (0.364, 0.364), (0.614, 0.614)]
    """
    rows = printed(check_choice("table", name, TABLES))
    ours = dict(_at_points(rows)) | dict(_of_globe(rows))
    return PublishedTable(name=name, source=TABLES[name], rows=tuple(_row(row, ours[row]) for row in rows))


def _row(row: Printed, ours: Estimate) -> PublishedRow:
    other = figure_of_others(row, ours.value)
    slack = conventions()[row.convention][0] if row.convention else 0.0
    return PublishedRow(row, *ours, other, _agrees(row, other, slack))


def _agrees(row: Printed, value: float, slack: float = 0.0) -> bool:
    half = 0.5 * 10.0**-row.decimals * (1.0 + _ROUNDING)
    return abs(value - row.value) <= half + slack


def _grouped(rows: Iterable[Printed], key: Callable[[Printed], str]) -> dict[str, list[Printed]]:
    groups: dict[str, list[Printed]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    return groups


def _of_globe(rows: Iterable[Printed]) -> Iterator[tuple[Printed, Estimate]]:
    for definition, group in _grouped((row for row in rows if not row.at_point), lambda row: row.definition).items():
        found = index_figures(definition, GLOBE, list(dict.fromkeys(row.measure for row in group)))
        yield from ((row, found[row.measure]) for row in group)


def _at_points(rows: Iterable[Printed]) -> Iterator[tuple[Printed, Estimate]]:
    for definition, group in _grouped((row for row in rows if row.at_point), lambda row: row.definition).items():
        found = factors(definition, [row.lon for row in group], [row.lat for row in group])
        for i, row in enumerate(group):
            measure = get_measure(row.measure)
            value, error = float(measure(found.jacobian[i])), float(found.error[i])
            # A relative error of J, which scales have as it is, and angles as twice so many radians.
            yield row, Estimate(value, math.degrees(2.0 * error) if measure.unit == "deg" else error * abs(value))
