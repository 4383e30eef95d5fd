"""The regions of the atlas, and the measurement of their entries; a batch job's processes import this."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np

from projdist import decisions, designs, earth, regions, support
from projdist.designs import AtlasMap

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
    """Continents, areas by name, oceans, zones, countries and their parts far away, and the states of the USA."""
    return tuple(_areas())


def _areas() -> Iterator[AtlasArea]:
    """The regions in the order of the atlas."""
    for name in regions.region_names():
        kind, _, title = name.partition(":")
        if kind in ("continent", "area"):
            yield AtlasArea(title, kind, name)
    yield from (AtlasArea(title, "ocean", text) for title, text in _BASINS.items())
    yield from (AtlasArea(title, "zone", text) for title, text in _ZONES.items())
    for name in regions.region_names():
        kind, _, title = name.partition(":")
        if kind == "country":
            yield from _parts(title, name)
        elif kind == "state":
            yield AtlasArea(f"{title}, USA", kind, f"{name}@main" if regions.get_region(name).far else name)


def _parts(title: str, name: str) -> Iterator[AtlasArea]:
    """A country, and each of its parts far away by its largest town."""
    whole = regions.get_region(name)
    if not whole.far:
        yield AtlasArea(title, "country", name)
        return
    yield AtlasArea(title, "country", f"{name}@main")
    rest, main = whole, regions.main_part(whole)
    while main is not rest:
        rest = regions.combine("-", rest, main, name)
        main = regions.main_part(rest)
        yield AtlasArea(f"{title}, {_town(main)}", "part", f"{name} & {_box(main)}")


def _box(part: regions.Place) -> str:
    """The box about a part of a country, rounded outwards."""
    west, south, east, north = part.bounds
    west, south = (math.floor(side / _STEP) * _STEP for side in (west, south))
    east, north = (-(math.floor(-side / _STEP) * _STEP) for side in (east, north))
    if part.bounds[2] > 180.0:
        east -= 360.0
    return "box:" + ",".join(f"{side:.1f}".removesuffix(".0") for side in (west, south, east, north))


def _town(part: regions.Place) -> str:
    """The largest town in a part, or its middle where there is none."""
    known = earth.cities()
    west, south, east, north = part.bounds
    eastward = np.mod(known.lon - west + _STEP, 360.0) - _STEP
    near = (eastward < east - west + _STEP) & (known.lat > south - _STEP) & (known.lat < north + _STEP)
    if near.any():
        return str(known.name[near][np.argmax(known.population[near])])
    return f"{0.5 * (south + north):.0f} N {0.5 * (west + east):.0f} E"


# ---- an entry ------------------------------------------------------------------------------------

_SCALE_ERROR = "max_scale_error_ppm"


def measured_entry(region: regions.Region) -> dict[str, Any]:
    """The best CRSs, custom projections and maps made to measure for a region, by purpose, as JSON."""
    # Purposes are those of `recommend`, by the Airy-Kavrayskiy error; "least scale error" is by the largest scale error
    # of any existing map, and of conformal custom projections and maps made to measure. The map made for any purpose
    # keeps neither angles nor areas, so that it is also the compromise.
    best = decisions.recommend(region, limit=1, custom=True)
    others = ("conformal", "equal-area", "compromise")
    by_purpose = {name: decisions.recommend(region, purpose=name, limit=1) for name in others}
    by_scale = decisions.recommend(region, criterion=_SCALE_ERROR, limit=1)
    conformal = decisions.recommend(region, purpose="conformal", criterion=_SCALE_ERROR, limit=1, custom=True)
    made = {kind: _made(region, kind, best.criterion) for kind in designs.KINDS}
    made["compromise"] = made["any"]
    purposes = {
        name: _measured_purpose(found, best.custom, made[name]) for name, found in {"any": best, **by_purpose}.items()
    }
    least = _measured_purpose(by_scale, conformal.custom, _made(region, "conformal", _SCALE_ERROR))
    return {
        "country": best.country,
        "official": None if best.official is None else _measured_crs(best.official),
        "zones": [
            {"name": one.name, "zones": len(one.zones), "national": one.national}
            | {_SCALE_ERROR: _rounded(one.max_scale_error_ppm)}
            for one in best.zones
        ],
        "purposes": {**purposes, "least scale error": least},
    }


def _measured_purpose(
    found: decisions.Recommendation, custom: Sequence[decisions.Custom], made: dict[str, Any]
) -> dict[str, Any]:
    """The best maps for one purpose: the first result, the first custom projection that serves it, and the made map."""
    best = next((one for one in custom if decisions.suits(one.keeps, found.purpose)), None)
    known = best and {"proj": best.proj, "family": best.family, "keeps": list(best.keeps), **_figures(best)}
    existing = _measured_crs(found.results[0]) if found.results else None
    return {"existing": existing, "custom": known, "made": made, "limit": _rounded(found.limit)}


def _measured_crs(one: decisions.Candidate) -> dict[str, Any]:
    named = {"code": one.code, "name": one.name, "method": one.method, "datum": one.datum}
    use = {"keeps": list(one.keeps), "national": one.national, "share": _rounded(one.share)}
    return named | use | _figures(one)


def _figures(one: decisions.Candidate | decisions.Custom) -> dict[str, float | None]:
    names = (known.name for known in fields(AtlasMap) if hasattr(one.distortion, known.name))
    return {name: _rounded(getattr(one.distortion, name)) for name in names}


def _made(region: regions.Region, kind: str, criterion: str) -> dict[str, Any]:
    """A map made to measure, or the reason why there is none, as for regions that are too wide."""
    try:
        found = designs.design(region, kind=kind, criterion=criterion, against=())
    except ValueError as error:
        return {"error": str(error)}
    figures = {"airy_kavrayskiy": _rounded(found.airy_kavrayskiy), _SCALE_ERROR: _rounded(_scale_error(found))}
    return {"proj": found.proj, "degree": found.degree} | figures


def _scale_error(found: designs.Design) -> float:
    """The largest |scale - 1| in any direction, in ppm."""
    return 1e6 * max(1.0 - found.smallest.value, found.largest.value - 1.0)


def _rounded(value: float | None) -> float | None:
    """A number rounded to six digits; NaN and infinity become None."""
    number = support.plain(value)
    return None if number is None else float(f"{number:.6g}")
