"""The regions of the atlas, as texts in the language of regions."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from projdist.earth import cities
from projdist.regions import Place, combine, get_region, main_part, region_names

__all__ = ["AtlasArea", "atlas_areas"]

_BASINS = {
    "North Atlantic": "ocean@110m & box:-75,0,-6,66",
    "South Atlantic": "ocean@110m & box:-65,-60,15,0",
    "North Pacific": "ocean@110m & box:125,0,-98,62",
    "South Pacific": "ocean@110m & box:147,-60,-70,0",
    "Indian Ocean": "ocean@110m & (box:20,-60,115,0 + box:38,0,98,25)",
    "Southern Ocean": "ocean@110m & box:-180,-90,180,-60",
    "Arctic Ocean": "ocean@110m & cap:0,90,2650",
    "Mediterranean Sea": "ocean@110m & (box:-5.6,30,36.2,41 + box:0,41,20,46)",
}
# All zones are these, turned about the axis of the Earth.
_ZONES = {"UTM zone 33N": "box:12,0,18,84", "UTM zone 33S": "box:12,-80,18,0"}
_STEP = 0.1  # degrees, to which the boxes of parts are rounded outwards


class AtlasArea(NamedTuple):
    """A region of the atlas: its title, what it is, and its text."""

    title: str
    kind: str
    text: str


@functools.cache
def atlas_areas() -> tuple[AtlasArea, ...]:
    """Continents, oceans, zones, countries and their parts far away, and the states of the USA."""
    return tuple(_areas())


def _areas() -> Iterator[AtlasArea]:
    for name in region_names():
        kind, _, title = name.partition(":")
        if kind == "continent":
            yield AtlasArea(title, kind, name)
    yield from (AtlasArea(title, "ocean", text) for title, text in _BASINS.items())
    yield from (AtlasArea(title, "zone", text) for title, text in _ZONES.items())
    for name in region_names():
        kind, _, title = name.partition(":")
        if kind == "country":
            yield from _parts(title, name)
        elif kind == "state":
            yield AtlasArea(f"{title}, USA", kind, f"{name}@main" if get_region(name).far else name)


def _parts(title: str, name: str) -> Iterator[AtlasArea]:
    """A country, and each of its parts far away by its largest town."""
    whole = get_region(name)
    if not whole.far:
        yield AtlasArea(title, "country", name)
        return
    yield AtlasArea(title, "country", f"{name}@main")
    rest, main = whole, main_part(whole)
    while main is not rest:
        rest = combine("-", rest, main, name)
        main = main_part(rest)
        yield AtlasArea(f"{title}, {_town(main)}", "part", f"{name} & {_box(main)}")


def _box(part: Place) -> str:
    """The box about a part of a country."""
    west, south, east, north = part.bounds
    sides = [_down(west), _down(south), -_down(-east), -_down(-north)]
    if east > 180.0:
        sides[2] -= 360.0
    return "box:" + ",".join(f"{side:.1f}".removesuffix(".0") for side in sides)


def _down(degrees: float) -> float:
    return math.floor(degrees / _STEP) * _STEP


def _town(part: Place) -> str:
    """The largest town in a part, or its middle where there is none."""
    known = cities()
    west, south, east, north = part.bounds
    eastward = np.mod(known.lon - west + _STEP, 360.0) - _STEP
    near = (eastward < east - west + _STEP) & (known.lat > south - _STEP) & (known.lat < north + _STEP)
    if near.any():
        return str(known.name[near][np.argmax(known.population[near])])
    return f"{0.5 * (south + north):.0f} N {0.5 * (west + east):.0f} E"
