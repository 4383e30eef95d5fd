"""Land, ocean, countries, continents: Natural Earth at 1 : 50 million; at 1 : 110 or 1 : 10 million on request."""

from __future__ import annotations

import functools

import shapely

from projdist.earth import WGS84, merged, natural_earth
from projdist.regions.names import continents, countries, folded, names_of, question
from projdist.regions.parts import told_apart
from projdist.regions.polygons import Polygons

DEFAULT_RESOLUTION = "50m"


@functools.cache
def land(resolution: str = DEFAULT_RESOLUTION) -> Polygons:
    """The land, Antarctica with its ice shelves included."""
    return Polygons(natural_earth.land(resolution), _named("land", resolution), resolution=resolution, ellipsoid=WGS84)


@functools.cache
def ocean(resolution: str = DEFAULT_RESOLUTION) -> Polygons:
    """All that is not land, the Caspian Sea included."""
    globe = shapely.box(-180.0, -90.0, 180.0, 90.0)
    water = merged([shapely.difference(globe, natural_earth.land(resolution))])
    return Polygons(water, _named("ocean", resolution), resolution=resolution, ellipsoid=WGS84)


def country(text: str, resolution: str = DEFAULT_RESOLUTION) -> Polygons:
    """A country by its name or ISO 3166 code, with all its parts in Natural Earth; raises ValueError."""
    row = countries().get(folded(text))
    if row is None:
        near = question(text, names_of(countries()))
        raise ValueError(f"Invalid country '{text}'. {near}It must be a name in English or an ISO 3166 code.")
    return _country(row["iso_n3"] or row["name"], row["iso_a2"] or row["name"], resolution)


@functools.cache
def _country(key: str, shown: str, resolution: str) -> Polygons:
    geometry = natural_earth.country(key, resolution)
    if geometry is None:
        raise ValueError(f"Invalid country '{shown}' at {resolution}. It is too small for this data: ask for 50m.")
    return told_apart(
        Polygons(geometry, _named(f"country:{shown}", resolution), resolution=resolution, ellipsoid=WGS84)
    )


def continent(text: str, resolution: str = DEFAULT_RESOLUTION) -> Polygons:
    """The countries of a continent, each as a whole: Russia is in Europe, French Guiana with France; ValueError."""
    name = continents().get(folded(text))
    if name is None:
        near = question(text, continents())
        allowed = ", ".join(sorted(continents().values()))
        raise ValueError(f"Invalid continent '{text}'. {near}It must be one of {allowed}.")
    return _continent(name, resolution)


@functools.cache
def _continent(name: str, resolution: str) -> Polygons:
    keys = [row["iso_n3"] or row["name"] for row in natural_earth.country_keys() if row["continent"] == name]
    parts = [natural_earth.country(key, resolution) for key in keys]
    whole = merged([part for part in parts if part is not None])
    return Polygons(whole, _named(f"continent:{name}", resolution), resolution=resolution, ellipsoid=WGS84)


def _named(text: str, resolution: str) -> str:
    return text if resolution == DEFAULT_RESOLUTION else f"{text}@{resolution}"
