"""What a measure of one map is against that of another, at the same places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from projdist._typing import FloatArray
from projdist.matrices import Measure
from projdist.plots.colours import ColourScale
from projdist.projections import Projection
from projdist.surfaces import Surface, ValuesAt, field, measured

_TURN = 360.0
_DIRECTIONS = ("meridian_convergence",)  # which go round


def field_against(surface: Surface, measure: Measure, other: Projection | None) -> FloatArray:
    """Values of a measure at the vertices of a surface: less those of another map there, or, of a ratio, over them."""
    values = field(surface, measure)
    if other is None:
        return values
    others = field(replace(surface, domain=replace(surface.domain, projection=other)), measure)
    return _against(values, others, measure)


def values_against(projection: Projection, measure: Measure, other: Projection | None) -> ValuesAt:
    """The same as a function of longitudes and latitudes."""

    def values_at(lon: FloatArray, lat: FloatArray) -> FloatArray:
        values = measured(projection, measure, lon, lat)
        return values if other is None else _against(values, measured(other, measure, lon, lat), measure)

    return values_at


def _against(values: FloatArray, others: FloatArray, measure: Measure) -> FloatArray:
    """Values less others, or, of a ratio, over them."""
    if measure.kind == "ratio":
        with np.errstate(divide="ignore", invalid="ignore"):
            found = values / others
        return np.where(np.isfinite(found), found, np.nan)
    found = values - others
    return np.mod(found + _TURN / 2, _TURN) - _TURN / 2 if measure.name in _DIRECTIONS else found


def measure_against(measure: Measure, other: Projection | None) -> Measure:
    """What the colours are of: a ratio is neutral at 1, a difference at 0."""
    if other is None or measure.kind == "ratio":
        return measure
    return replace(measure, name=f"difference_of_{measure.name}", kind="signed")


def label_against(scale: ColourScale, measure: Measure, maps: Sequence[str], other: Projection | None) -> str:
    """The words of the colour bar: `Angular distortion omega (degrees): Robinson less Mollweide`."""
    if other is None:
        return scale.label
    label = replace(scale, measure=measure).label
    one = maps[0] if len(maps) == 1 else "each map"
    return f"{label}: {one} {'over' if measure.kind == 'ratio' else 'less'} {other.name}"
