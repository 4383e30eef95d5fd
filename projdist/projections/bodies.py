"""Celestial bodies: which one a CRS is of, and whether two are the same."""

from __future__ import annotations

import functools
import re
from typing import NamedTuple

from pyproj.database import query_crs_info
from pyproj.enums import PJType

from projdist.earth import Ellipsoid

__all__ = ["Body", "body_in", "is_same_body"]

_NAMED = re.compile(r'(?:ELLIPSOID|SPHEROID|DATUM|BASEGEOGCRS|BASEGEODCRS|GEOGCRS|GEODCRS|GEOGCS)\["([^"]*)"')
# Figures of one body that people use differ by up to 3.4 % (the equator and the mean radius of Saturn); those of the
# Moon and Io by 4.8 %. Bodies that are nearer to each other are told apart by names, where there are any.
_SAME_SIZE = 0.04
_WITH_ARTICLE = ("Moon", "Sun")


class Body(NamedTuple):
    """A celestial body by a figure of it, and its name, "" where that is not known."""

    ellipsoid: Ellipsoid
    name: str = ""

    def __str__(self) -> str:
        """In words: the Earth, Mars, a body of radius 1737.4 km."""
        if not self.ellipsoid.is_of_another_body:
            return "the Earth"
        article = "the " if self.name in _WITH_ARTICLE else ""
        return f"{article}{self.name}" if self.name else f"a body of radius {self.ellipsoid.a / 1000.0:.7g} km"


@functools.cache
def _names() -> tuple[str, ...]:
    """The bodies of the International Astronomical Union's CRSs in PROJ's database, the longest names first."""
    found = query_crs_info(auth_name="IAU_2015", pj_types=[PJType.GEOGRAPHIC_2D_CRS, PJType.GEODETIC_CRS])
    names = {info.name.partition(" (")[0] for info in found} - {"Earth"}
    return tuple(sorted(names, key=lambda name: (-len(name), name)))


@functools.cache
def body_in(wkt: str) -> str:
    """The body that the names of a CRS's datum, ellipsoid and base tell, as "Mars_2000_IAU_IAG" does; else ""."""
    words = " ".join(_NAMED.findall(wkt)).replace("_", " ")
    return next((name for name in _names() if re.search(rf"(?<!\w){re.escape(name)}(?!\w)", words, re.IGNORECASE)), "")


def is_same_body(one: Body, other: Body) -> bool:
    """Whether two are one body: by their names, or, where one is not known, by their sizes."""
    foreign = [body.ellipsoid.is_of_another_body for body in (one, other)]
    if not all(foreign):
        return not any(foreign)
    if one.name and other.name:
        return one.name == other.name
    return abs(one.ellipsoid.a - other.ellipsoid.a) < _SAME_SIZE * max(one.ellipsoid.a, other.ellipsoid.a)
