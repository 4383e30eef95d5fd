"""The command `info`, with an ASCII map of the scale error."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from projdist import plots
from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.cli import options as opt
from projdist.cli.errors import refusing, working
from projdist.cli.formats import TABLE, present
from projdist.cli.number_format import certain, first_digit, label_of, per_cent, rounded, size_text, with_error
from projdist.cli.pictures import PictureOptions, picture_of
from projdist.cli.report import Column, Mapped, Report, Table
from projdist.cli.screen import room_in, takes_blocks
from projdist.decisions import MapInfo, info
from projdist.earth import land_within, latitude_text, longitude_text
from projdist.matrices import get_measure
from projdist.projections import Projection
from projdist.regions import Box, Place, get_region
from projdist.support import listed
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
    """Lines of an ASCII map of the region: scale errors in four shades, and a legend.

    Empty if the map cannot be drawn, as for a set of points, or in a narrow terminal.
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
    """Cell size in degrees that gives about `_TRIANGLES` triangles."""
    _, south, _, north = region.bounds
    longest = np.cos(np.radians(max(south, -north, 0.0)))
    return float(np.sqrt(longitude_width(region.bounds) * longest * (north - south) / (_TRIANGLES / 2)))


def _in_characters(surface: Surface, region: Place, widest: int) -> tuple[BoolArray, FloatArray, BoolArray]:
    """Per character (rows, columns): on the map, mean scale error, mostly land."""
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
    """Mean of the values in each place; NaN without any."""
    total = np.bincount(place, weights=values, minlength=count.size)
    return np.divide(total, count, out=np.full(count.size, np.nan), where=count > 0)


def _on_land(surface: Surface, lon: FloatArray, lat: FloatArray, chosen: IntArray) -> FloatArray:
    """1.0 for vertices on land, 0.0 for others; other bodies are all land."""
    if surface.domain.projection.is_of_another_body:
        return np.ones(chosen.size)
    outline = land_within(surface.domain.region.bounds, coast_resolution(surface))
    if outline.is_empty:
        return np.zeros(chosen.size)
    return np.asarray(get_region(outline).contains(lon[chosen], lat[chosen]), dtype=float)


def _drawn(cells: BoolArray, values: FloatArray, land: BoolArray, *, unicode: bool) -> list[str]:
    """Lines of the map and its legend."""
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
    """Legend of the shades, each for a quarter of the shaded characters."""
    unit, name = (_PPM_OF_A_PER_CENT, "%") if largest >= _PPM_OF_A_PER_CENT else (1.0, "ppm")
    ends = [*levels, largest]
    texts = [f"{shade} to {certain(float(f'{end / unit:.2g}'))}" for shade, end in zip(shades, ends, strict=True)]
    return f"Scale error: {', '.join(texts)} {name}{f'; {sea} sea' if sea else ''}"


# ---- info ----------------------------------------------------------------------------------------


_SAME = 5  # codes of CRSs of the same map: how many are named
_LONGEST = 100  # characters of a text
_TITLES = {
    "scale_error_ppm": "scale error, ppm",
    "omega": "angular deformation, deg",
    "s": "areal scale",
    "h": "scale along meridians",
    "k": "scale along parallels",
}
_KEEPS = {"conformal": "angles", "equal-area": "areas", "equidistant": "distances"}


def info_command(
    projection: opt.OneProjection,
    region: opt.Region = None,
    format: str | None = opt.report_format(),
    output: str | None = opt.output(
        "A heat map of the scale error: .png, .svg or .pdf; or all as a page with a live map: .html."
    ),
    *,
    pictured: PictureOptions,
) -> None:
    """Show what a projection is, what it keeps as measured, and its errors where it is for."""
    form, page = opt.form_and_page(format, output, pictured.overwrite)
    picture = picture_of(output, pictured, beside=(opt.PAGE_SUFFIX,))
    area = opt.region_given(region, [projection])
    with refusing(), working("Measuring"):
        found = info(projection, area)
    if picture is not None:
        shown: dict[str, Any] = {"measure": _MEASURE, "airy_kavrayskiy": [found.airy_kavrayskiy.raw]}
        picture.save(plots.heatmap_figure, found.projection, region=found.region, **shown)
    sketch = sketch_of(found.projection, found.region, page) if form == TABLE else []
    present(_report(found, sketch, picture.path if picture else None), form, page, pictured.overwrite)


def _report(found: MapInfo, sketch: list[str], picture: Path | None) -> Report:
    stated, label = found.crs_metadata, label_of(found.given, found.projection.name)
    parameters = [one._asdict() for one in stated.parameters]
    title = f"{stated.code or label}: {found.projection.name}"
    return Report(
        title=title if stated.code or label != found.projection.name else label,
        tables=[
            Table([{"what": what, "it is": text} for what, text in _card(found)], ["what", Column("it is")]),
            *([Table(parameters, _PARAMETERS, "Parameters")] if parameters else []),
            _errors(found),
        ],
        sketch=sketch,
        notes=_notes(found),
        data=found.to_dict,
        rows=lambda: [found.row()],
        written=[picture],
        maps=Mapped([found.projection], [stated.code or label], found.region, _MEASURE),
    )


def _value(value: float | str) -> str:
    return f"{value:.12g}" if isinstance(value, float) else value


_PARAMETERS = [Column("name", "parameter"), Column("value", show=_value), Column("unit", left=True)]


# ---- the card -------------------------------------------------------------------------------


def _card(found: MapInfo) -> Iterator[tuple[str, str]]:
    """Rows (label, text) of the card; unknown facts are left out."""
    stated = found.crs_metadata
    yield "kind", stated.kind
    if stated.deprecated:
        instead = f"; use {listed(stated.replaced_by, 'or')} instead" if stated.replaced_by else ""
        yield "status", f"deprecated{instead}"
    yield "keeps", _kept(found)
    if found.promises and found.promises not in found.keeps:
        yield "should keep", f"{_KEEPS[found.promises]}, by its method: it is not {found.promises} as measured"
    if stated.area_name:
        yield "area of use", _short(stated.area_name)
    if found.projection.area_of_use is not None:
        yield "bounds", _bounds(found.projection.area_of_use)
    if stated.scope:
        yield "made for", _short(stated.scope)
    yield from ((name, text) for name, text in (("datum", stated.datum), ("based on", stated.geographic_crs)) if text)
    if stated.prime_meridian:
        yield "prime meridian", stated.prime_meridian
    yield "ellipsoid", _ellipsoid(found)
    if stated.unit:
        yield "coordinates", _coordinates(found)
    if stated.method:
        yield "method", stated.method.replace("_", " ")
    if not stated.code and "\n" not in found.projection.definition and found.projection.definition.startswith("+"):
        yield "PROJ", found.projection.definition
    if found.same_map:
        yield "same map", _same(list(found.same_map))
    if stated.remarks:
        yield "remarks", _short(stated.remarks)


def _kept(found: MapInfo) -> str:
    """Properties kept as measured, with their deviations."""
    kept = [f"{_KEEPS[name]} ({name}, to {first_digit(found.departures[name])})" for name in found.keeps]
    return f"{listed(kept, 'and')}, as measured" if kept else "neither angles, areas nor distances, as measured"


def _short(text: str) -> str:
    """Text shortened to `_LONGEST` characters, or to the colon before a list."""
    text = " ".join(text.split()).rstrip(".")
    if len(text) <= _LONGEST:
        return text
    beginning = text.partition(": ")[0]
    return beginning if len(beginning) <= _LONGEST else f"{beginning[: _LONGEST - 3].rstrip()}..."


def _bounds(bounds: tuple[float, float, float, float]) -> str:
    west, south, east, north = bounds
    return f"{longitude_text(west)} to {longitude_text(east)}, {latitude_text(south)} to {latitude_text(north)}"


def _ellipsoid(found: MapInfo) -> str:
    ellipsoid, name = found.projection.ellipsoid, found.crs_metadata.ellipsoid_name
    if ellipsoid.is_sphere:
        return f"{name or 'sphere'}, {ellipsoid.a:.11g} m"
    return ", ".join(filter(None, (name, f"a {ellipsoid.a:.11g} m", f"1/f {1.0 / ellipsoid.f:.12g}")))


def _coordinates(found: MapInfo) -> str:
    """Axes in order, and their unit."""
    stated = found.crs_metadata
    unit = stated.unit if stated.unit_metres == 1.0 else f"{stated.unit} ({stated.unit_metres:.12g} m)"
    axes = [f"{axis.name.lower()} ({axis.direction})" for axis in stated.axes]
    return f"{', '.join(axes)} in {unit}" if axes else unit


def _same(codes: list[str]) -> str:
    others = len(codes) - _SAME
    if others <= 1:
        return ", ".join(codes)
    return f"{', '.join(codes[:_SAME])} and {others} others"


# ---- the errors -----------------------------------------------------------------------------


def _errors(found: MapInfo) -> Table:
    rows = [{"name": _TITLES[name], **spread.to_dict()} for name, spread in found.measures.items()]
    columns: list[Column | str] = [
        Column("name", "measure"),
        Column("mean", show=_figure, error="mean_error"),
        Column("min", "least", _figure, error="min_error"),
        Column("max", "largest", _figure, error="max_error"),
        Column("at", "largest at", of=_place, left=True),
    ]
    area = found.projection.area_of_use
    where = "its area of use" if area and found.region == Box(*area) else found.region.name
    return Table(rows, columns, f"Over {where} ({size_text(found.region)})")


def _figure(value: float, error: float | None) -> str:
    """Figure with certain digits; ratios near 1 with decimals."""
    if 0.5 < value < 2.0:
        return rounded(value, max(error or 0.0, 1e-6))
    return certain(value, error)


def _place(row: Any) -> str:
    lon, lat, least, most = (row[key] for key in ("max_lon", "max_lat", "min", "max"))
    if None in (lon, lat, least, most) or _figure(most, row["max_error"]) == _figure(least, row["min_error"]):
        return "-"
    return f"{longitude_text(round(lon, 2))} {latitude_text(round(lat, 2))}"


def _notes(found: MapInfo) -> list[str]:
    AK, notes = found.airy_kavrayskiy, []
    scaled, affine = (rounded(value, AK.error) for value in (AK.scaled, AK.affine))
    notes.append(
        f"Airy-Kavrayskiy error, the RMS of sqrt(ln^2 a + ln^2 b): {with_error(AK.raw, AK.error)}, "
        f"after the best scale {scaled}, after the best linear map {affine}."
    )
    if found.coverage < 1.0 - 1e-6:
        notes.append(f"The map covers {per_cent(found.coverage)} of the region; the figures are for that share.")
    if any(spread.maximum.value == float("inf") for spread in found.measures.values()):
        notes.append("-: the measure has no bound, or its mean diverges.")
    return notes
