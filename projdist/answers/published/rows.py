"""Figures as they were printed, from the data that are shipped with the package."""

from __future__ import annotations

import csv
import functools
import importlib.resources
import math
from dataclasses import dataclass

__all__ = ["TABLES", "Printed", "conventions", "printed"]

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
