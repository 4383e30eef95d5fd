"""What a page may name: projections and regions that need no file, for a page may be asked by anybody to open it.

Files are read where they were named on the command line, which is what `Doors.opened` are.
"""

from __future__ import annotations

import functools
import json
import re
from dataclasses import dataclass

from projdist.earth import Ellipsoid
from projdist.projections import Projection, ProjectionError, ProjectionLike
from projdist.regions import Place, get_region
from projdist.support import shown

_LONGEST = 20_000  # characters

# Operations and parameters of PROJ that read files.
_READING = re.compile(
    r"(?:^|[\s+])(?:[xyzht]*_?\w*grids?|file|model|catalog\w*|datum_catalog\w*|init)\s*=|"
    r"=\s*(?:\w*gridshift|tinshift|defmodel|deformation)\b",
    re.IGNORECASE,
)
_INIT = re.compile(r"\+?init=epsg:\w+(\s+\+(no_defs|type=crs))*", re.IGNORECASE)
# What WKT and PROJJSON have of files: EPSG's names of parameters that are files end with that word.
_STRUCTURED = re.compile(r"PARAMETERFILE|PROJ4_GRIDS|NTV|\bfile\b", re.IGNORECASE)
_NULL = re.compile(r"\+nadgrids=@null(?=[\s\"]|$)")  # no file
_SUFFIX = re.compile(r"\.(?:prj|wkt|json)$", re.IGNORECASE)
_PATH = re.compile(r"[/\\~@]")
_RATIO = re.compile(r"=\s*[\d.]+/[\d.]+(?=\s|$)")  # as in +to_meter=1200/3937
_FILES = re.compile(r"\b(file|geodesic|points)\s*:", re.IGNORECASE)
_CRS = re.compile(r"\bcrs\s*:(?!\s*\"?\w+:\w+)", re.IGNORECASE)


@dataclass(frozen=True)
class Doors:
    """The door to projections and regions; `opened` are the texts that the user gave where files may be named."""

    opened: frozenset[str] = frozenset()

    def projection(self, text: str) -> Projection:
        """The projection of a text; raises ProjectionError."""
        if text not in self.opened:
            check_projection(text)
        return _projection(text)

    def source(self, text: str) -> ProjectionLike:
        """What the projection of a text was given as."""
        return text

    def region(self, text: str, ellipsoid: Ellipsoid | None = None) -> Place:
        """The region of a text, on the body of an ellipsoid; raises ValueError."""
        if text not in self.opened:
            check_region(text)
        return _region(text, ellipsoid)


class OpenDoors(Doors):
    """Doors of who may read files anyway, as in a notebook's own kernel."""

    def projection(self, text: str) -> Projection:
        """The projection of any text; raises ProjectionError."""
        return _projection(text)

    def region(self, text: str, ellipsoid: Ellipsoid | None = None) -> Place:
        """The region of any text, on the body of an ellipsoid; raises ValueError."""
        return _region(text, ellipsoid)


def check_projection(text: str) -> None:
    """Refuse what names a file: allowed are names, PROJ strings, codes, WKT and PROJJSON; raises ProjectionError."""
    if len(text) > _LONGEST:
        raise ProjectionError(f"Invalid projection '{shown(text)}'. It must have at most {_LONGEST} characters.")
    if _reads(text.strip()):
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. On this page it must need no file: name files on the command line, "
            "as in 'projdist explore FILE'."
        )


def _reads(text: str) -> bool:
    """Whether a projection needs a file, or may need one."""
    if text.startswith("{"):
        return _json_reads(text)
    if re.match(r"\w+\s*[\[(]", text):
        return bool(_STRUCTURED.search(text) or _READING.search(_NULL.sub("", text)))
    plain = _RATIO.sub("", _NULL.sub("", text))
    if _SUFFIX.search(text) or (_READING.search(plain) and not _INIT.fullmatch(plain)):
        return True
    return bool(re.search(r"(?:proj|init)\s*=", text, re.IGNORECASE) and _PATH.search(plain))


def _json_reads(text: str) -> bool:
    """Whether PROJJSON, or the parameters of a PROJ string in JSON, need a file, however they are spelt."""
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return False  # it is no projection either
    if "proj" in value or "init" in value:
        return _reads(" ".join(f"+{key}={word}" for key, word in value.items()))
    plain = json.dumps(value, ensure_ascii=False)
    return bool(_STRUCTURED.search(plain) or _READING.search(_NULL.sub("", plain)))


def check_region(text: str) -> None:
    """Refuse what names a file; raises ValueError."""
    if len(text) > _LONGEST:
        raise ValueError(f"Invalid region '{shown(text)}'. It must have at most {_LONGEST} characters.")
    if _FILES.search(text) or _CRS.search(text):
        raise ValueError(
            f"Invalid region '{shown(text)}'. On this page it must need no file: name files on the command line, as in "
            "'projdist explore --region file:PATH'."
        )


@functools.lru_cache(maxsize=256)
def _projection(text: str) -> Projection:
    return Projection.from_user_input(text)


@functools.lru_cache(maxsize=32)
def _region(text: str, ellipsoid: Ellipsoid | None) -> Place:
    return get_region(text, ellipsoid)
