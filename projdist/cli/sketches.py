"""A map in a few lines of characters: where its scale errors are how large, on land and beside it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.cli.cells import certain
from projdist.cli.screen import room_in, takes_blocks
from projdist.earth import land_within
from projdist.matrices import get_measure
from projdist.projections import Projection
from projdist.regions import Place, get_region
from projdist.surfaces import Surface, coast_resolution, field, longitude_width, shown_part, surface_of

_WIDEST, _HIGHEST = 64, 18  # characters
_NARROWEST = 16
_TALL = 2.0  # a character's height over its width
_TRIANGLES = 16_000  # of a map: some fifteen for each character
_MEASURE = "scale_error_ppm"
_PPM_OF_A_PER_CENT = 1e4
_LAND = 0.02  # of the characters, from which on land is told from sea
_SHADES, _SEA = "░▒▓█", "·"
_PLAIN_SHADES, _PLAIN_SEA = "-+x#", "."


def sketch_of(projection: Projection, region: Place, output: Path | None = None) -> list[str]:
    """Lines for a terminal, or for a file: the map of a region in four shades of scale error, and what they mean.

    Nothing where the map cannot be drawn, as about a set of points, or where there is no room.
    """
    widest = min(_WIDEST, room_in(output) or _WIDEST)
    if not region.area_km2 or widest < _NARROWEST:
        return []
    place = shown_part(region)
    try:
        surface = surface_of(projection, place, _step(place))
    except ValueError:  # nothing of it is drawn, and the figures say so
        return []
    cells, values, land = _in_characters(surface, place, widest)
    if not np.isfinite(values).any():
        return []
    return _drawn(cells, values, land, unicode=takes_blocks(output))


def _step(region: Place) -> float:
    """Degrees of the cells of a surface, of two triangles each."""
    _, south, _, north = region.bounds
    longest = np.cos(np.radians(max(south, -north, 0.0)))
    return float(np.sqrt(longitude_width(region.bounds) * longest * (north - south) / (_TRIANGLES / 2)))


def _in_characters(surface: Surface, region: Place, widest: int) -> tuple[BoolArray, FloatArray, BoolArray]:
    """Arrays (rows, columns): whether a character is on the map, its mean error, and whether it is mostly land."""
    lon, lat = (values[surface.source] for values in surface.lonlat())
    measured = field(surface, get_measure(_MEASURE))
    triangles = surface.triangles[np.isfinite(measured[surface.triangles]).all(axis=1)]
    first = triangles[:, 0]
    here = np.asarray(region.contains(lon[first], lat[first]))
    triangles, first = triangles[here], first[here]
    x, y = surface.x[triangles].mean(axis=1), surface.y[triangles].mean(axis=1)
    if not x.size:
        return (np.zeros((1, 1), dtype=bool), np.full((1, 1), np.nan), np.zeros((1, 1), dtype=bool))
    width, height = max(np.ptp(x), 1e-9), max(np.ptp(y), 1e-9)
    columns = int(np.clip(_HIGHEST * _TALL * width / height, 1, widest))
    rows = int(np.clip(round(columns * height / width / _TALL), 1, _HIGHEST))
    column = np.minimum((columns * (x - x.min()) / width).astype(int), columns - 1)
    row = np.minimum((rows * (y.max() - y) / height).astype(int), rows - 1)
    place = row * columns + column
    count = np.bincount(place, minlength=rows * columns)
    mean, share = (
        _mean(place, values, count) for values in (measured[triangles].mean(axis=1), _on_land(surface, lon, lat, first))
    )
    shape = (rows, columns)
    return (count > 0).reshape(shape), mean.reshape(shape), (share > 0.5).reshape(shape)


def _mean(place: IntArray, values: FloatArray, count: IntArray) -> FloatArray:
    """Means of values by places; NaN where there is none."""
    total = np.bincount(place, weights=values, minlength=count.size)
    return np.divide(total, count, out=np.full(count.size, np.nan), where=count > 0)


def _on_land(surface: Surface, lon: FloatArray, lat: FloatArray, chosen: IntArray) -> FloatArray:
    """1.0 for vertices on land, 0.0 for others; on other bodies all are land."""
    if surface.domain.projection.is_of_another_body:
        return np.ones(chosen.size)
    outline = land_within(surface.domain.region.bounds, coast_resolution(surface))
    if outline.is_empty:
        return np.zeros(chosen.size)
    return np.asarray(get_region(outline).contains(lon[chosen], lat[chosen]), dtype=float)


def _drawn(cells: BoolArray, values: FloatArray, land: BoolArray, *, unicode: bool) -> list[str]:
    """The lines of the map, and one that tells what the shades mean."""
    shades, sea = (_SHADES, _SEA) if unicode else (_PLAIN_SHADES, _PLAIN_SEA)
    apart = land.sum() >= _LAND * cells.sum() and not (land | ~cells).all()
    shaded = land if apart else cells
    known = values[shaded & np.isfinite(values)]
    if not known.size:
        return []
    levels = np.quantile(known, [0.25, 0.5, 0.75])
    picture = np.full(cells.shape, " ")
    picture[cells] = sea if apart else " "
    number = np.searchsorted(levels, values)
    for k, shade in enumerate(shades):
        picture[shaded & np.isfinite(values) & (number == k)] = shade
    lines = ["".join(line).rstrip() for line in picture]
    return [*lines, _legend(shades, levels, float(known.max()), sea if apart else "")]


def _legend(shades: str, levels: Sequence[float] | FloatArray, largest: float, sea: str) -> str:
    """What the shades mean: a quarter of what is shaded each."""
    unit, name = (_PPM_OF_A_PER_CENT, "%") if largest >= _PPM_OF_A_PER_CENT else (1.0, "ppm")
    ends = [*levels, largest]
    texts = [f"{shade} to {certain(float(f'{end / unit:.2g}'))}" for shade, end in zip(shades, ends, strict=True)]
    return f"Scale error: {', '.join(texts)} {name}{f'; {sea} sea' if sea else ''}"
