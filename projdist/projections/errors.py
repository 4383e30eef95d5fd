"""Errors for input that is not a map projection, and texts of their messages."""

from __future__ import annotations

import re

ALLOWED = (
    "It must be a PROJ id or a name (see 'projdist list projections'), a PROJ string, an EPSG: or ESRI: code, "
    "WKT, PROJJSON, the path of a .prj or .wkt file, a pyproj CRS, or a function of (lon, lat)."
)


class ProjectionError(ValueError):
    """The input is not a map projection that can be measured."""


class GridError(ProjectionError):
    """PROJ cannot read a grid that the coordinates need; the input itself is valid."""


def proj_reason(error: BaseException) -> str:
    """The core of one of PROJ's nested messages."""
    text = " ".join(str(error).split())
    inner = re.search(r"\(Internal Proj Error: (.*)\)$", text)
    reason = inner[1] if inner else text
    reason = re.sub(r"^proj_create: ", "", reason)
    return re.sub(r"^Error \d+ \((.*?)\)(?:: (.*))?$", lambda match: match[2] or match[1], reason).rstrip(".")
