"""Errors for input that is not a map projection, what their messages say, and the authorities of CRSs."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from projdist import support

AUTHORITIES = ("EPSG", "ESRI", "IGNF")
"""Authorities with projected CRSs of the Earth; IAU_2015's are of other planets."""

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


def check_authorities(authorities: Iterable[str] | str, known: Sequence[str] = AUTHORITIES) -> tuple[str, ...]:
    """Names of authorities in capitals, each once; raises ValueError for unknown ones, and for none."""
    given = (support.check_text("authority", name) for name in support.listed_values(authorities))
    names = tuple(dict.fromkeys(name.strip().upper() for name in given))
    for name in names or ("",):
        if name not in known:
            hint = support.did_you_mean(support.close_words(name, known))
            raise ValueError(
                f"Invalid authority '{support.shown(name)}'. {hint}It must be {support.listed(known, 'or')}."
            )
    return names
