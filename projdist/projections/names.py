"""Bare names of projections; each is the textbook map on the sphere."""

from __future__ import annotations

import re

import pyproj.list

from projdist.earth import SPHERE
from projdist.projections.catalogue import NAMES, NEEDED_PARAMETERS, NOT_IN_METRES, NOT_MAPS, TEXTBOOK_PARAMETERS
from projdist.projections.crs import parse_crs
from projdist.projections.errors import ALLOWED, ProjectionError
from projdist.projections.figures import figure_parameters, own_figure
from projdist.projections.hints import close_codes, close_crs_names, close_names, crs_code, normalised
from projdist.projections.operations import Parts
from projdist.projections.projstrings import parse_proj_string
from projdist.projections.worldmaps import WORLD_MAPS
from projdist.support import did_you_mean, listed, shown


def projection_names() -> dict[str, str]:
    """Every bare name of a projection, and the PROJ string that it stands for.

    Returns
    -------
    dict of str to str
        The PROJ strings by name: an example where the projection has `needed_parameters`. The names of `WORLD_MAPS`,
        which PROJ has no string for, stand for themselves.

    Raises
    ------
    Nothing: there is no input.

    References
    ----------
    PROJ's documentation, Projections, https://proj.org/operations/projections/.

    Examples
    --------
    >>> projection_names()["robinson"]
    '+proj=robin +R=6371008.7714'
    """
    ids = (name for name in pyproj.list.get_proj_operations_map() if name not in {*NOT_MAPS, *NOT_IN_METRES})
    return {name: name if name in WORLD_MAPS else _textbook(name) for name in [*NAMES, *WORLD_MAPS, *ids]}


def needed_parameters(name: str) -> list[str]:
    """The PROJ parameters without which a name is no map, and is refused; for most names there are none."""
    return [token.lstrip("+").partition("=")[0] for token in NEEDED_PARAMETERS.get(name, "").split()]


def parse_name(text: str) -> Parts:
    """The textbook map of a name in any spelling; raises ProjectionError."""
    operations = pyproj.list.get_proj_operations_map()
    name = text if text in operations else normalised(text)
    if name in WORLD_MAPS:
        return Parts(_title(name), name, SPHERE, WORLD_MAPS[name])
    if name not in NAMES and name not in operations:
        close = close_codes(text) or close_names(text)
        code = _utm_code(text) or ("" if close and "/" not in text else crs_code(text))
        if code:
            return parse_crs(code)
        # Names of CRSs have one of these, or are too short to be told from other words.
        hint = did_you_mean(close or (close_crs_names(text) if "/" in text or "_" in text else []))
        raise ProjectionError(f"Invalid projection '{shown(text)}'. {hint}{ALLOWED}")
    if name in NOT_MAPS:
        raise ProjectionError(f"Invalid projection '{text}'. PROJ's {operations[name]} is not a map projection.")
    if name in NOT_IN_METRES:
        raise ProjectionError(f"Invalid projection '{text}'. PROJ's {name} gives {NOT_IN_METRES[name]}, not metres.")
    needed = needed_parameters(name)
    if needed:
        sphere = "has no form on the sphere and " if "ellps" in needed else ""
        raise ProjectionError(
            f"Invalid projection '{text}'. It {sphere}needs {listed(needed, 'and')}: give a PROJ string, such as "
            f"'{_textbook(name)}'."
        )
    parts = parse_proj_string(_textbook(name))
    return parts._replace(name=_title(name)) if name in NAMES else parts


def _utm_code(text: str) -> str:
    """The code of WGS 84's UTM zone of `utm33`, `UTM 33N`, `utm-33s`; north where nothing is said."""
    zone = re.fullmatch(r"utm[\s_-]*(?:zone[\s_-]*)?(0?[1-9]|[1-5]\d|60)[\s_-]*([ns]?)", text, re.IGNORECASE)
    return f"EPSG:32{7 if zone[2].lower() == 's' else 6}{int(zone[1]):02}" if zone else ""


def _title(name: str) -> str:
    return name.replace("-", " ").title()


def _textbook(name: str) -> str:
    operation = NAMES.get(name) or TEXTBOOK_PARAMETERS.get(name, name)
    parameters = [f"+proj={operation}", *NEEDED_PARAMETERS.get(name, "").split()]
    if "ellps" not in needed_parameters(name):
        parameters.append(figure_parameters(own_figure(operation, SPHERE)))
    return " ".join(parameters)
