"""An entry of the atlas, measured: one task of the batch that `tools/measure_atlas.py` runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from projdist.decisions import Candidate, Custom, Recommendation, ZoneSystem, recommend, suits
from projdist.designs.answers import Design
from projdist.designs.making import design
from projdist.regions import Region
from projdist.support import plain

__all__ = ["measured_entry"]

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
    """The best CRSs, custom projections and maps made to measure for a region, for each purpose, in plain JSON.

    Purposes are those of `recommend`, by the Airy-Kavrayskiy error; "least scale error" is by the largest scale error
    of any existing map, and of conformal ones among the custom projections and those made to measure. The map made for
    any purpose keeps neither angles nor areas, so that it is the compromise, too.
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
        "zones": [_zones(system) for system in best.zones],
        "purposes": {**purposes, "least scale error": least},
    }


def _purpose(found: Recommendation, custom: Sequence[Custom], made: dict[str, Any]) -> dict[str, Any]:
    """What is best for one purpose: the first of some custom projections that serves it, and a map made to measure."""
    serving = [one for one in custom if suits(one.keeps, found.purpose)]
    return {
        "existing": _existing(found.results[0]) if found.results else None,
        "custom": _custom(serving[0]) if serving else None,
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


def _custom(one: Custom) -> dict[str, Any]:
    return {"proj": one.proj, "family": one.family, "keeps": list(one.keeps), **_figures(one)}


def _figures(one: Candidate | Custom) -> dict[str, float | None]:
    return {name: _rounded(getattr(one.distortion, name)) for name in _FIGURES}


def _zones(system: ZoneSystem) -> dict[str, Any]:
    return {
        "name": system.name,
        "zones": len(system.zones),
        "national": system.national,
        _SCALE_ERROR: _rounded(system.max_scale_error_ppm),
    }


def _made(region: Region, kind: str, criterion: str) -> dict[str, Any]:
    """A map made to measure, or why there is none, as for regions that are too wide."""
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
    """A number to the digits that are told; None for what is not finite."""
    told = plain(value)
    return None if told is None else float(f"{told:.{_DIGITS}g}")
