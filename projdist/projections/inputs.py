"""Projections from everything that names one: text, files, dictionaries, pyproj's objects."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from pyproj import CRS, Proj

from projdist.projections.cf_conventions import grid_mapping_in
from projdist.projections.crs import parse_crs
from projdist.projections.errors import ALLOWED, ProjectionError
from projdist.projections.names import parse_name
from projdist.projections.operations import Parts
from projdist.projections.projstrings import (
    is_proj_string,
    parse_proj_string,
    proj_string_of_crs,
    proj_string_of_parameters,
)
from projdist.projections.wkt import is_wkt
from projdist.support import shown

_LONGEST_PATH = 300  # characters


def parse(value: Any) -> Parts:
    """The projection of a name, PROJ string, CRS code, WKT, PROJJSON, file or pyproj CRS; raises ProjectionError."""
    if isinstance(value, str):
        return _parse_text(value.strip())
    if isinstance(value, os.PathLike):
        return _parse_file(Path(value))
    if isinstance(value, Mapping) and "proj" in value:
        return parse_proj_string(proj_string_of_parameters(value))
    if isinstance(value, Proj):
        value = value.crs
    if isinstance(value, CRS) and is_proj_string(value.srs):
        return parse_proj_string(proj_string_of_crs(value))
    return parse_crs(value)


def listed_projections(value: Any) -> list[Any]:
    """The projections of an iterable, as they are given, or one alone; a pair such as ("EPSG", 3035) is one."""
    pair = isinstance(value, tuple) and len(value) == 2 and isinstance(value[1], int)
    one = isinstance(value, str | bytes | os.PathLike | Mapping | CRS | Proj) or callable(value) or pair
    return [value] if one or not isinstance(value, Iterable) else list(value)


def _parse_text(text: str) -> Parts:
    if text.lower().endswith((".prj", ".wkt", ".json")) and not re.search(r"[\[{]|proj=", text):
        return _parse_file(Path(text))
    return _parse_contents(text)


def _parse_contents(text: str) -> Parts:
    """Text that is no path."""
    if "\0" in text:  # where PROJ would stop reading
        raise ProjectionError(f"Invalid projection '{shown(text)}'. It has a null character.")
    init = re.fullmatch(r"\+?init=(\w+:\w+)(?:\s+\+no_defs|\s+\+type=crs)*", text)
    if init:
        return parse_crs(init[1].upper())
    if text.startswith("{"):
        return _parse_json(text)
    if is_wkt(text):
        return parse_crs(text)
    if is_proj_string(text):
        return parse_proj_string(" ".join(text.split()))
    if ":" not in text:
        return parse_name(text)
    if re.fullmatch(r"\w+:\w+\s*(?:\+\s*[A-Za-z]\w*\s*(?:[=+@].*)?|@.*,.*)", text):
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. Parameters and centres are for names, as robinson+lon_0=150 and "
            "mollweide@45,-100; a CRS has its own."
        )
    return parse_crs(text)


def _parse_json(text: str) -> Parts:
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ProjectionError(f"Invalid projection '{shown(text)}'. It is no JSON: {error}. {ALLOWED}") from error
    return parse(value) if "proj" in value or grid_mapping_in(value) else parse_crs(text)


def _shown_path(path: Path) -> str:
    """A path for a message; of a long one the name of the file."""
    text = " ".join(str(path).split())
    return text if len(text) <= _LONGEST_PATH else f".../{shown(path.name)}"


def _parse_file(path: Path) -> Parts:
    complaint = f"Invalid projection file '{_shown_path(path)}'."
    try:
        text = path.read_text(encoding="utf-8-sig").strip()
    except (OSError, ValueError) as error:  # a ValueError for what is not UTF-8, and for a null character in the path
        reason = error.strerror if isinstance(error, OSError) else error
        raise ProjectionError(f"{complaint} It cannot be read as text: {reason}.") from error
    if not text:
        raise ProjectionError(f"{complaint} It must hold WKT, PROJJSON or a PROJ string.")
    try:
        return _parse_contents(text)
    except ProjectionError as error:
        raise ProjectionError(f"{complaint} {error}") from error
