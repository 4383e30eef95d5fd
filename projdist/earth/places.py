"""Cities of the Earth from the shipped GeoNames data, and rows of shipped tables."""

from __future__ import annotations

import csv
import functools
import importlib.resources
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from projdist._typing import BoolArray, FloatArray, IntArray


def data_rows(name: str) -> list[dict[str, str]]:
    """The rows of a CSV file shipped in projdist/data, by column."""
    file = importlib.resources.files("projdist") / "data" / name
    return list(csv.DictReader(file.read_text(encoding="utf-8").splitlines()))


@dataclass(frozen=True, kw_only=True, eq=False)
class Cities:
    """Cities as columns, ordered by population times the number of names in other languages."""

    name: NDArray[np.str_]
    """English if there is an English name, else local with accents."""
    lon: FloatArray
    """Degrees, to 0.001, -180 to 180."""
    lat: FloatArray
    """Degrees, to 0.001."""
    population: IntArray
    country: NDArray[np.str_]
    """ISO 3166 codes of two letters, also of territories (GF for French Guiana)."""
    is_capital: BoolArray
    """True for the capital of the country or territory."""


@functools.cache
def cities() -> Cities:
    """All capitals, and towns at a distance from better known ones.

    The distance is 12 km for 100,000 people or more, 25 km for 15,000, 80 km for fewer: no suburbs, but the village of
    a remote island. The data is GeoNames (https://www.geonames.org), CC BY 4.0.
    """
    file = importlib.resources.files("projdist") / "data" / "cities.csv"
    _, *rows = csv.reader(file.read_text(encoding="utf-8").splitlines())
    name, lon, lat, population, country, capital = zip(*rows, strict=True)
    return Cities(
        name=np.array(name),
        lon=np.array(lon, dtype=float),
        lat=np.array(lat, dtype=float),
        population=np.array(population, dtype=int),
        country=np.array(country),
        is_capital=np.array(capital) == "1",
    )
