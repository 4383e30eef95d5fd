"""Land, ocean, countries, continents and states of the USA by name."""

from __future__ import annotations

import difflib
import functools
import unicodedata

import shapely

from projdist.earth import WGS84, data_rows, merged, natural_earth, state_outline
from projdist.regions.combinations import told_apart
from projdist.regions.polygons import Polygons
from projdist.support import NEAR, did_you_mean

_MOST = 3  # names in a hint
_CODE = 3  # letters or digits in a code
_KINDS = ("country", "state", "continent")  # that with a name in two kinds is meant first

_COLUMNS = {
    "country": ("countries.csv", ("name", "iso_a2", "iso_a3", "iso_n3", "other_names")),
    "state": ("states.csv", ("name", "postal", "fips", "other_names")),
}

Row = dict[str, str]


def region_names() -> list[str]:
    """Named regions as `get_region` takes them: globe, land, ocean, countries, continents and states."""
    countries = sorted(row["name"] for row in data_rows("countries.csv"))
    return [
        *("globe", "land", "ocean"),
        *(f"country:{name}" for name in countries),
        *(f"continent:{name}" for name in sorted(names_of("continent").values())),
        *(f"state:{row['name']}" for row in data_rows("states.csv")),
    ]


@functools.cache
def rows_of(kind: str) -> dict[str, Row]:
    """Rows of the countries, or of the states of the USA, by folded names and codes."""
    file, columns = _COLUMNS[kind]
    found: dict[str, Row] = {}
    for column in columns:
        for row in data_rows(file):
            for name in filter(None, row[column].split("|")):
                found.setdefault(folded(name), row)
    return found


def question(text: str, kind: str) -> str:
    """A question for a region of another kind with this name, or for close names of the same kind."""
    other = full_name(text)
    if other is not None:
        return did_you_mean([other])
    given, names = folded(text), {key: name for key, name in names_of(kind).items() if len(key) > _CODE}
    begun = [key for key in names if given and (key.startswith(given) or f" {given}" in f" {key}")]
    near = begun or difflib.get_close_matches(given, names, 1, NEAR)
    return did_you_mean(list(dict.fromkeys(names[key] for key in near))[:_MOST])


def full_names(text: str) -> list[str]:
    """The full names in `region_names` of the country, state and continent of a name or code (NZ, or state:CA)."""
    kind, colon, name = text.rpartition(":")
    kinds = [one for one in _KINDS if not colon or kind.strip().casefold() == one]
    return [f"{one}:{names_of(one)[folded(name)]}" for one in kinds if folded(name) in names_of(one)]


def full_name(text: str) -> str | None:
    """The first of the full names: countries come before states of the same code or name; None if there is none."""
    return next(iter(full_names(text)), None)


def meant_by(name: str) -> str | None:
    """The full name of the place that a name alone stands for: the only one, or of a code the first."""
    found = full_names(name)
    return found[0] if len(found) == 1 or (found and len(folded(name)) <= _CODE) else None


@functools.cache
def names_of(kind: str) -> dict[str, str]:
    """Names of the regions of a kind by folded name or code."""
    if kind == "continent":
        return {folded(row["continent"]): row["continent"] for row in data_rows("countries.csv")}
    return {key: row["name"] for key, row in rows_of(kind).items()}


def close_regions(text: str) -> list[str]:
    """Named regions that a text may have been meant for."""
    known: dict[str, list[str]] = {name: [name] for name in ("globe", "land", "ocean")}
    for kind in _KINDS:
        for key, name in names_of(kind).items():
            known.setdefault(key, []).append(f"{kind}:{name}")
    given = folded(text)
    near = difflib.get_close_matches(given, [key for key in known if len(key) > _CODE], 1, NEAR)
    return list(dict.fromkeys(name for key in (given, *near) for name in known.get(key, [])))


def folded(text: str) -> str:
    """Text in lower case without accents; punctuation becomes blanks."""
    plain = unicodedata.normalize("NFKD", text.casefold().replace("&", "and"))
    kept = "".join(c if c.isalnum() else " " for c in plain if not unicodedata.combining(c))
    return " ".join(kept.split())


# ---- countries -----------------------------------------------------------------------------------

DEFAULT_RESOLUTION = "50m"


@functools.cache
def land(resolution: str = DEFAULT_RESOLUTION) -> Polygons:
    """The land, Antarctica with its ice shelves included."""
    return _outlines(natural_earth.land(resolution), "land", resolution)


@functools.cache
def ocean(resolution: str = DEFAULT_RESOLUTION) -> Polygons:
    """The complement of the land, including the Caspian Sea."""
    globe = shapely.box(-180.0, -90.0, 180.0, 90.0)
    return _outlines(merged([shapely.difference(globe, natural_earth.land(resolution))]), "ocean", resolution)


def country(text: str, resolution: str = DEFAULT_RESOLUTION) -> Polygons:
    """A country by its name or ISO 3166 code, with all its parts in Natural Earth; raises ValueError."""
    row = rows_of("country").get(folded(text))
    if row is None:
        near = question(text, "country")
        raise ValueError(f"Invalid country '{text}'. {near}It must be a name in English or an ISO 3166 code.")
    return _country(row["iso_n3"] or row["name"], row["iso_a2"] or row["name"], resolution)


@functools.cache
def _country(key: str, shown: str, resolution: str) -> Polygons:
    geometry = natural_earth.country(key, resolution)
    if geometry is None:
        raise ValueError(f"Invalid country '{shown}' at {resolution}. It is too small for this data: ask for 50m.")
    return told_apart(_outlines(geometry, f"country:{shown}", resolution))


def continent(text: str, resolution: str = DEFAULT_RESOLUTION) -> Polygons:
    """The countries of a continent, each as a whole: Russia is in Europe, French Guiana with France; ValueError."""
    name = names_of("continent").get(folded(text))
    if name is None:
        near = question(text, "continent")
        allowed = ", ".join(sorted(names_of("continent").values()))
        raise ValueError(f"Invalid continent '{text}'. {near}It must be one of {allowed}.")
    return _continent(name, resolution)


@functools.cache
def _continent(name: str, resolution: str) -> Polygons:
    keys = [row["iso_n3"] or row["name"] for row in data_rows("countries.csv") if row["continent"] == name]
    parts = [natural_earth.country(key, resolution) for key in keys]
    return _outlines(merged([part for part in parts if part is not None]), f"continent:{name}", resolution)


def _outlines(geometry: shapely.MultiPolygon, text: str, resolution: str) -> Polygons:
    """A shipped geometry as a region, with its resolution in the name if that is not the default."""
    name = text if resolution == DEFAULT_RESOLUTION else f"{text}@{resolution}"
    return Polygons(geometry, name, resolution=resolution, ellipsoid=WGS84)


# ---- states --------------------------------------------------------------------------------------

RESOLUTION = "10m"


def state(text: str, resolution: str = RESOLUTION) -> Polygons:
    """A state by its name, postal or FIPS code, with all its islands; raises ValueError."""
    if resolution != RESOLUTION:
        raise ValueError(f"Invalid suffix '@{resolution}' of a state. It must be one of @{RESOLUTION}, @main and @all.")
    row = rows_of("state").get(folded(text))
    if row is None:
        near = question(text, "state")
        raise ValueError(
            f"Invalid state '{text}'. {near}It must be the name or postal code of a state or territory of the USA."
        )
    return _state(row["fips"], row["postal"])


@functools.cache
def _state(fips: str, postal: str) -> Polygons:
    return told_apart(Polygons(state_outline(fips), f"state:{postal}", resolution=RESOLUTION, ellipsoid=WGS84))
