"""Bare names of projections; each is the textbook map on the sphere."""

from __future__ import annotations

import pyproj.list

from projdist.catalogue import NAMES, NEEDED_PARAMETERS, NOT_MAPS, TEXTBOOK_PARAMETERS
from projdist.ellipsoid import MEAN_EARTH_RADIUS, SPHERE
from projdist.hints import did_you_mean, listed
from projdist.projections.errors import ALLOWED, ProjectionError, shown
from projdist.projections.hints import close_codes, close_names, normalised
from projdist.projections.operations import Parts
from projdist.projections.projstrings import parse_proj_string
from projdist.worldmaps import WORLD_MAPS


def projection_names() -> dict[str, str]:
    """Every bare name, and the PROJ string that it stands for: an example where it has `needed_parameters`.

    Those of `WORLD_MAPS`, which PROJ has no string for, stand for themselves.
    """
    ids = (name for name in pyproj.list.get_proj_operations_map() if name not in NOT_MAPS)
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
        hint = did_you_mean(close_codes(text) or close_names(text))
        raise ProjectionError(f"Invalid projection '{shown(text)}'. {hint}{ALLOWED}")
    if name in NOT_MAPS:
        raise ProjectionError(f"Invalid projection '{text}'. PROJ's {operations[name]} is not a map projection.")
    needed = needed_parameters(name)
    if needed:
        sphere = "has no form on the sphere and " if "ellps" in needed else ""
        raise ProjectionError(
            f"Invalid projection '{text}'. It {sphere}needs {listed(needed, 'and')}: give a PROJ string, such as "
            f"'{_textbook(name)}'."
        )
    parts = parse_proj_string(_textbook(name))
    return parts._replace(name=_title(name)) if name in NAMES else parts


def _title(name: str) -> str:
    return name.replace("-", " ").title()


def _textbook(name: str) -> str:
    operation = NAMES.get(name) or TEXTBOOK_PARAMETERS.get(name, name)
    parameters = [f"+proj={operation}", *NEEDED_PARAMETERS.get(name, "").split()]
    if "ellps" not in needed_parameters(name):
        parameters.append(f"+R={MEAN_EARTH_RADIUS}")
    return " ".join(parameters)
