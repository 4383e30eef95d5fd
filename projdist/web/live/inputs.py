"""What a page may name: projections and regions that need no file, for a page may be asked by anybody to open it.

Files are read where they were named on the command line, which is what `Doors.opened` are.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

from projdist.earth import Ellipsoid
from projdist.projections import (
    Projection,
    ProjectionError,
    ProjectionLike,
    close_parameters,
    environment_without_files,
    file_named_in,
)
from projdist.regions import Place, get_region, is_region_text, region_of_text
from projdist.support import did_you_mean, shown

_LONGEST = 20_000  # characters

_FILES = ("file", "geodesic", "points")  # kinds of regions


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
        return _region(text, ellipsoid) if text in self.opened else _closed_region(text, ellipsoid)

    def environment(self) -> dict[str, str]:
        """Variables for processes that work behind the door: without the user's grids, unless he named a file."""
        return {} if any(map(_is_of_files, self.opened)) else environment_without_files()


class OpenDoors(Doors):
    """Doors of who may read files anyway, as in a notebook's own kernel."""

    def projection(self, text: str) -> Projection:
        """The projection of any text; raises ProjectionError."""
        return _projection(text)

    def region(self, text: str, ellipsoid: Ellipsoid | None = None) -> Place:
        """The region of any text, on the body of an ellipsoid; raises ValueError."""
        return _region(text, ellipsoid)

    def environment(self) -> dict[str, str]:
        """No variables: what runs is the user's own."""
        return {}


def check_projection(text: str) -> None:
    """Refuse what names a file: allowed are names, PROJ strings, codes, WKT and PROJJSON; raises ProjectionError."""
    if len(text) > _LONGEST:
        raise ProjectionError(f"Invalid projection '{shown(text)}'. It must have at most {_LONGEST} characters.")
    named = file_named_in(text)
    if named:
        hint = did_you_mean(close_parameters(named))
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. {hint}On this page it must need no file, as '{shown(named)}' may: "
            "name files on the command line, as in 'projdist explore FILE'."
        )


def _check_atom(kind: str, argument: str) -> None:
    """Refuse a part of a region that names a file; raises ValueError."""
    if kind.strip() in _FILES or (kind.strip() == "crs" and file_named_in(argument)):
        raise ValueError(
            f"Invalid region '{shown(f'{kind}:{argument}')}'. On this page it must need no file: name files on the "
            "command line, as in 'projdist explore --region file:PATH'."
        )


@functools.lru_cache(maxsize=256)
def _projection(text: str) -> Projection:
    return Projection.from_user_input(text)


@functools.lru_cache(maxsize=32)
def _region(text: str, ellipsoid: Ellipsoid | None) -> Place:
    return get_region(text, ellipsoid)


@functools.lru_cache(maxsize=32)
def _closed_region(text: str, ellipsoid: Ellipsoid | None) -> Place:
    return region_of_text(text, _check_atom, ellipsoid)


def _is_of_files(text: str) -> bool:
    """Whether a projection or a region names a file."""
    try:
        if is_region_text(text):
            _closed_region(text, None)
            return False
        return bool(file_named_in(text))
    except ValueError:
        return True
