"""The regions of the atlas, and the measurement of their entries."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from projdist.decisions import Candidate, Custom, Recommendation, recommend, suits
from projdist.designs.making import Design, design
from projdist.earth import cities
from projdist.regions import Place, Region, combine, get_region, main_part, region_names
from projdist.support import plain

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
# All other zones are these, rotated about the Earth's axis.
_ZONES = {"UTM zone 33N": "box:12,0,18,84", "UTM zone 33S": "box:12,-80,18,0"}
_STEP = 0.1  # degrees, to which the boxes of parts are rounded outwards


class AtlasArea(NamedTuple):
    """A region of the atlas: its title, its kind, and its text for `get_region`."""

    title: str
    kind: str
    text: str


@functools.cache
def atlas_areas() -> tuple[AtlasArea, ...]:
    """Continents, oceans, zones, countries and their parts far away, and the states of the USA."""
    return tuple(_areas())


def _areas() -> Iterator[AtlasArea]:
    """The regions in the order of the atlas."""
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
    """The box about a part of a country, rounded outwards."""
    west, south, east, north = part.bounds
    west, south = (math.floor(side / _STEP) * _STEP for side in (west, south))
    east, north = (-(math.floor(-side / _STEP) * _STEP) for side in (east, north))
    if part.bounds[2] > 180.0:
        east -= 360.0
    return "box:" + ",".join(f"{side:.1f}".removesuffix(".0") for side in (west, south, east, north))


def _town(part: Place) -> str:
    """The largest town in a part, or its middle where there is none."""
    known = cities()
    west, south, east, north = part.bounds
    eastward = np.mod(known.lon - west + _STEP, 360.0) - _STEP
    near = (eastward < east - west + _STEP) & (known.lat > south - _STEP) & (known.lat < north + _STEP)
    if near.any():
        return str(known.name[near][np.argmax(known.population[near])])
    return f"{0.5 * (south + north):.0f} N {0.5 * (west + east):.0f} E"


# ---- an entry ------------------------------------------------------------------------------------


_SCALE_ERROR = "max_scale_error_ppm"

_PURPOSES = ("any", "conformal", "equal-area", "compromise")
_KINDS = ("any", "conformal", "equal-area")  # of maps made to measure
_FIGURES = (
    "airy_kavrayskiy",
    "max_scale_error_ppm",
    "mean_scale_error_ppm",
    "max_omega",
    "mean_omega",
    "max_areal_error_ppm",
    "mean_areal_error_ppm",
    "cut_km",
)
_DIGITS = 6


def measured_entry(region: Region) -> dict[str, Any]:
    """The best CRSs, custom projections and maps made to measure for a region, by purpose, as JSON.

    Purposes are those of `recommend`, by the Airy-Kavrayskiy error; "least scale error" is by the largest scale error
    of any existing map, and of conformal custom projections and maps made to measure. The map made for any purpose
    keeps neither angles nor areas, so that it is also the compromise.
    """
    best = recommend(region, limit=1, custom=True)
    by_purpose = {name: recommend(region, purpose=name, limit=1) for name in _PURPOSES[1:]}
    by_scale = recommend(region, criterion=_SCALE_ERROR, limit=1)
    conformal = recommend(region, purpose="conformal", criterion=_SCALE_ERROR, limit=1, custom=True)
    made = {kind: _made(region, kind, best.criterion) for kind in _KINDS}
    made["compromise"] = made["any"]
    purposes = {name: _purpose(found, best.custom, made[name]) for name, found in {"any": best, **by_purpose}.items()}
    least = _purpose(by_scale, conformal.custom, _made(region, "conformal", _SCALE_ERROR))
    return {
        "country": best.country,
        "official": None if best.official is None else _existing(best.official),
        "zones": [
            {
                "name": system.name,
                "zones": len(system.zones),
                "national": system.national,
                _SCALE_ERROR: _rounded(system.max_scale_error_ppm),
            }
            for system in best.zones
        ],
        "purposes": {**purposes, "least scale error": least},
    }


def _purpose(found: Recommendation, custom: Sequence[Custom], made: dict[str, Any]) -> dict[str, Any]:
    """The best maps for one purpose: the first result, the first custom projection that serves it, and the made map."""
    best = next((one for one in custom if suits(one.keeps, found.purpose)), None)
    known = best and {"proj": best.proj, "family": best.family, "keeps": list(best.keeps), **_figures(best)}
    return {
        "existing": _existing(found.results[0]) if found.results else None,
        "custom": known,
        "made": made,
        "limit": _rounded(found.limit),
    }


def _existing(one: Candidate) -> dict[str, Any]:
    return {
        "code": one.code,
        "name": one.name,
        "method": one.method,
        "datum": one.datum,
        "keeps": list(one.keeps),
        "national": one.national,
        "share": _rounded(one.share),
        **_figures(one),
    }


def _figures(one: Candidate | Custom) -> dict[str, float | None]:
    return {name: _rounded(getattr(one.distortion, name)) for name in _FIGURES}


def _made(region: Region, kind: str, criterion: str) -> dict[str, Any]:
    """A map made to measure, or the reason why there is none, as for regions that are too wide."""
    try:
        found = design(region, kind=kind, criterion=criterion, against=())
    except ValueError as error:
        return {"error": str(error)}
    return {
        "proj": found.proj,
        "degree": found.degree,
        "airy_kavrayskiy": _rounded(found.airy_kavrayskiy),
        _SCALE_ERROR: _rounded(_scale_error(found)),
    }


def _scale_error(found: Design) -> float:
    """The largest |scale - 1| in any direction, in ppm."""
    return 1e6 * max(1.0 - found.smallest.value, found.largest.value - 1.0)


def _rounded(value: float | None) -> float | None:
    """A number rounded to six digits; NaN and infinity become None."""
    number = plain(value)
    return None if number is None else float(f"{number:.{_DIGITS}g}")
