"""Land, ocean, countries, states of the USA, and areas made of countries, as continents, by name."""

import difflib
import functools
import re
import unicodedata

import numpy as np
import shapely

from projdist.earth import WGS84, data_rows, merged, natural_earth, state_outline
from projdist.regions.combinations import OPERATIONS, told_apart
from projdist.regions.polygons import Polygons
from projdist.support import NEAR, did_you_mean

_MOST = 3  # names in a hint
_CODE = 3  # letters or digits in a code, at most
_SOME = 7  # names in a refusal, enough for the continents
# The file with the rows of each kind, and the columns of their names and codes; codes of two kinds are of the first.
_KINDS = {
    "country": ("countries.csv", ("name", "iso_a2", "iso_a3", "iso_n3", "other_names")),
    "state": ("states.csv", ("name", "postal", "fips", "other_names")),
    "continent": ("areas.csv", ("name", "other_names")),
    "area": ("areas.csv", ("name", "other_names")),
}

Row = dict[str, str]


def region_names() -> list[str]:
    """Named regions as `get_region` takes them: globe, land, ocean, countries, continents, areas and states."""
    ordered = ("country", "continent", "area", "state")
    return ["globe", "land", "ocean", *(f"{kind}:{row['name']}" for kind in ordered for row in _rows(kind))]


def _rows(kind: str) -> list[Row]:
    """Rows of a kind, by name."""
    rows = [row for row in data_rows(_KINDS[kind][0]) if row.get("kind", kind) == kind]
    return rows if kind == "state" else sorted(rows, key=lambda row: row["name"])


@functools.cache
def rows_of(kind: str) -> dict[str, Row]:
    """Rows of a kind, country, state, continent or area, by folded names and codes."""
    found: dict[str, Row] = {}
    for column in _KINDS[kind][1]:
        for row in data_rows(_KINDS[kind][0]):
            if row.get("kind", kind) == kind:
                for name in filter(None, row[column].split("|")):
                    found.setdefault(folded(name), row)
    return found


def question(text: str, kind: str) -> str:
    """The question whether a region of another kind with this name was meant, or one of this kind with a close name."""
    other = full_name(text)
    if other is not None:
        return did_you_mean([other])
    given, names = folded(text), {key: name for key, name in names_of(kind).items() if len(key) > _CODE}
    begun = [key for key in names if given and (key.startswith(given) or f" {given}" in f" {key}")]
    near = begun or difflib.get_close_matches(given, names, 1, NEAR)
    return did_you_mean(list(dict.fromkeys(names[key] for key in near))[:_MOST])


def full_names(text: str) -> list[str]:
    """The full names, as in `region_names`, of the places of a name or code (NZ, or state:CA)."""
    kind, colon, name = text.rpartition(":")
    kinds = [one for one in _KINDS if not colon or kind.strip().casefold() == one]
    return [f"{one}:{names_of(one)[folded(name)]}" for one in kinds if folded(name) in names_of(one)]


def full_name(text: str) -> str | None:
    """The first of the full names: countries come before states of the same code or name; None if there is none."""
    return next(iter(full_names(text)), None)


def meant_by(name: str) -> str | None:
    """The full name of the place that a name alone stands for: the only one, the first of a code, or a continent."""
    found = full_names(name)
    if len(found) == 1 or (found and len(folded(name)) <= _CODE):
        return found[0]
    return next((one for one in found if one.startswith("continent:")), None)


@functools.cache
def names_of(kind: str) -> dict[str, str]:
    """Names of the regions of a kind by folded name or code."""
    return {key: row["name"] for key, row in rows_of(kind).items()}


def close_regions(text: str) -> list[str]:
    """Named regions that a text may have meant."""
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


def _row(text: str, kind: str, must: str) -> Row:
    """The row of a name or code; raises ValueError that says what it must be."""
    row = rows_of(kind).get(folded(text))
    if row is None:
        raise ValueError(f"Invalid {kind} '{text}'. {question(text, kind)}It must be {must}.")
    return row


def country(text: str, resolution: str = DEFAULT_RESOLUTION) -> Polygons:
    """A country by its name or ISO 3166 code, with all its parts in Natural Earth; raises ValueError."""
    row = _row(text, "country", "a name in English or the country's own language, or an ISO 3166 code")
    return _country(row["iso_n3"] or row["name"], row["iso_a2"] or row["name"], resolution)


@functools.cache
def _country(key: str, shown: str, resolution: str) -> Polygons:
    geometry = natural_earth.country(key, resolution)
    if geometry is None:
        raise ValueError(f"Invalid country '{shown}' at {resolution}. It is too small for this data: ask for 50m.")
    return told_apart(_outlines(geometry, f"country:{shown}", resolution))


def area(text: str, kind: str, resolution: str = DEFAULT_RESOLUTION) -> Polygons:
    """A continent within its usual limits, or another area made of countries, by its name; raises ValueError."""
    names = [row["name"] for row in _rows(kind)]
    more = ", ... (see 'projdist list regions')" if len(names) > _SOME else ""
    return _area(kind, _row(text, kind, f"one of {', '.join(names[:_SOME])}{more}")["name"], resolution)


@functools.cache
def _area(kind: str, name: str, resolution: str) -> Polygons:
    """The whole countries of an area and its parts of others, without those too small for the resolution."""
    row = rows_of(kind)[folded(name)]
    found = [_shape(code, resolution) for code in row["whole"].split()]
    for part in filter(None, row["parts"].split(";")):
        shape, *steps = re.split(r" ([&-]) ", part.strip())
        geometry = _shape(shape, resolution)
        for operator, other in zip(steps[::2], steps[1::2], strict=True):
            geometry = OPERATIONS[operator](geometry, _shape(other, resolution))
        found.append(geometry)
    return _outlines(merged(found), f"{kind}:{name}", resolution)


def _shape(text: str, resolution: str) -> shapely.Geometry:
    """A country by its code, a continent, a box or a polygon, as named in the table of areas."""
    kind, colon, argument = text.partition(":")
    if kind == "continent":
        return _area(kind, argument, resolution).geometry
    if colon:
        numbers = np.array(argument.split(","), dtype=float)
        return shapely.box(*numbers) if kind == "box" else shapely.Polygon(numbers.reshape(-1, 2))
    row = rows_of("country")[folded(text)]
    return natural_earth.country(row["iso_n3"] or row["name"], resolution) or shapely.MultiPolygon()


def definition(text: str) -> dict[str, str]:
    """Limits of a continent or area in words with their source, and in the language of regions; both "" for others."""
    kind, _, name = text.partition("@")[0].partition(":")
    row = rows_of(kind).get(folded(name)) if kind in ("continent", "area") else None
    if row is None:
        return {"limits": "", "definition": ""}
    whole = [f"country:{code.replace('_', ' ')}" for code in row["whole"].split()]
    parts = [f"(country:{part.strip()})" for part in filter(None, row["parts"].split(";"))]
    return {"limits": row["limits"], "definition": " + ".join([*whole, *parts])}


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
    row = _row(text, "state", "the name or postal code of a state or territory of the USA")
    return _state(row["fips"], row["postal"])


@functools.cache
def _state(fips: str, postal: str) -> Polygons:
    return told_apart(Polygons(state_outline(fips), f"state:{postal}", resolution=RESOLUTION, ellipsoid=WGS84))
