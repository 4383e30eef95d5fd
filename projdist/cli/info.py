"""The command `info`, with an ASCII map of the scale error."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from projdist import plots, surfaces
from projdist._typing import BoolArray, FloatArray
from projdist.cli import number_format
from projdist.cli import options as opt
from projdist.cli.errors import refusing, working
from projdist.cli.formats import TABLE, present, room_in, takes_blocks
from projdist.cli.number_format import certain, first_digit, label_of, per_cent, rounded, size_text, with_error
from projdist.cli.report import Column, Mapped, Report, Table
from projdist.decisions import MapInfo, info
from projdist.earth import land_within, latitude_text, longitude_text
from projdist.matrices import get_measure
from projdist.projections import Projection
from projdist.regions import Box, Place, get_region
from projdist.support import listed

_SAME = 5  # codes of CRSs of the same map: how many are named
_LONGEST = 100  # characters of a text
_MEASURE = "scale_error_ppm"
_TITLES = {
    _MEASURE: "scale error, ppm",
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
    pictured: opt.PictureOptions,
) -> None:
    """Show what a projection is, what it keeps as measured, and its errors where it is for."""
    target = opt.page_target(format, output, pictured.overwrite)
    picture = opt.picture_of(output, pictured, beside=(opt.PAGE_SUFFIX,))
    area = opt.region_given(region, [projection])
    with refusing(), working("Measuring"):
        found = info(projection, area)
    if picture is not None:
        shown: dict[str, Any] = {"measure": _MEASURE, "airy_kavrayskiy": [found.airy_kavrayskiy.raw]}
        picture.save(plots.heatmap_figure, found.projection, region=found.region, **shown)
    stated, label, name = found.crs_metadata, label_of(found.given, found.projection.name), found.projection.name
    parameters = [one._asdict() for one in stated.parameters]
    value = Column("value", show=lambda value: f"{value:.12g}" if isinstance(value, float) else value)
    columns = [Column("name", "parameter"), value, Column("unit", left=True)]
    report = Report(
        title=f"{stated.code or label}: {name}" if stated.code or label != name else label,
        tables=[
            Table([{"what": what, "it is": text} for what, text in _card(found) if text], ["what", "it is"]),
            *([Table(parameters, columns, "Parameters")] if parameters else []),
            _errors(found),
        ],
        sketch=sketch_of(found.projection, found.region, target.path) if target.form == TABLE else [],
        notes=[*_notes(found)],
        data=found.to_dict,
        rows=lambda: [found.row()],
        written=[picture],
        maps=Mapped([found.projection], [stated.code or label], found.region, _MEASURE),
    )
    present(report, *target)


# ---- the card -------------------------------------------------------------------------------


def _card(found: MapInfo) -> Iterator[tuple[str, str | None]]:
    """Rows (label, text) of the card; unknown facts have no text."""
    stated, definition = found.crs_metadata, found.projection.definition
    yield "kind", stated.kind
    if stated.deprecated:
        instead = f"; use {listed(stated.replaced_by, 'or')} instead" if stated.replaced_by else ""
        yield "status", f"deprecated{instead}"
    kept = [f"{_KEEPS[name]} ({name}, to {first_digit(found.departures[name])})" for name in found.keeps]
    yield "keeps", f"{listed(kept, 'and') if kept else 'neither angles, areas nor distances'}, as measured"
    if found.promises and found.promises not in found.keeps:
        yield "should keep", f"{_KEEPS[found.promises]}, by its method: it is not {found.promises} as measured"
    yield "area of use", _short(stated.area_name)
    if found.projection.area_of_use is not None:
        west, south, east, north = found.projection.area_of_use
        longitudes = f"{longitude_text(west)} to {longitude_text(east)}"
        yield "bounds", f"{longitudes}, {latitude_text(south)} to {latitude_text(north)}"
    yield "made for", _short(stated.scope)
    yield "datum", stated.datum
    yield "based on", stated.geographic_crs
    yield "prime meridian", stated.prime_meridian
    ellipsoid, name = found.projection.ellipsoid, stated.ellipsoid_name
    if ellipsoid.is_sphere:
        yield "ellipsoid", f"{name or 'sphere'}, {ellipsoid.a:.11g} m"
    else:
        parts = (name, f"a {ellipsoid.a:.11g} m", f"1/f {1.0 / ellipsoid.f:.12g}")
        yield "ellipsoid", ", ".join(filter(None, parts))
    if stated.unit:
        unit = stated.unit if stated.unit_metres == 1.0 else f"{stated.unit} ({stated.unit_metres:.12g} m)"
        axes = ", ".join(f"{axis.name.lower()} ({axis.direction})" for axis in stated.axes)
        yield "coordinates", f"{axes} in {unit}" if axes else unit
    yield "method", (stated.method or "").replace("_", " ")
    if not stated.code and "\n" not in definition and definition.startswith("+"):
        yield "PROJ", definition
    codes, others = [*found.same_map], len(found.same_map) - _SAME
    yield "same map", ", ".join(codes) if others <= 1 else f"{', '.join(codes[:_SAME])} and {others} others"
    yield "remarks", _short(stated.remarks)


def _short(text: str | None) -> str:
    """Text shortened to `_LONGEST` characters, or to the colon before a list."""
    text = " ".join((text or "").split()).rstrip(".")
    return text if len(text) <= _LONGEST else number_format.shortened(text.partition(": ")[0], _LONGEST)


# ---- the errors -----------------------------------------------------------------------------


def _errors(found: MapInfo) -> Table:
    rows = [{"name": _TITLES[name], **spread.to_dict()} for name, spread in found.measures.items()]
    columns = [
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
    return rounded(value, max(error or 0.0, 1e-6)) if 0.5 < value < 2.0 else certain(value, error)


def _place(row: Any) -> str:
    lon, lat, least, most = (row[key] for key in ("max_lon", "max_lat", "min", "max"))
    if None in (lon, lat, least, most) or _figure(most, row["max_error"]) == _figure(least, row["min_error"]):
        return "-"
    return f"{longitude_text(round(lon, 2))} {latitude_text(round(lat, 2))}"


def _notes(found: MapInfo) -> Iterator[str]:
    AK = found.airy_kavrayskiy
    yield (
        f"Airy-Kavrayskiy error, the RMS of sqrt(ln^2 a + ln^2 b): {with_error(AK.raw, AK.error)}, after the best "
        f"scale {rounded(AK.scaled, AK.error)}, after the best linear map {rounded(AK.affine, AK.error)}."
    )
    if found.coverage < 1.0 - 1e-6:
        yield f"The map covers {per_cent(found.coverage)} of the region; the figures are for that share."
    if any(spread.maximum.value == float("inf") for spread in found.measures.values()):
        yield "-: the measure has no bound, or its mean diverges."


# ---- the ASCII map -------------------------------------------------------------------------------


_WIDEST, _HIGHEST = 64, 18  # characters
_NARROWEST = 16
_TALL = 2.0  # a character's height over its width
_TRIANGLES = 16_000  # of a map: some fifteen for each character
_PPM_OF_A_PER_CENT = 1e4
_LAND = 0.02  # of the characters, from which on land is told from sea


def sketch_of(projection: Projection, region: Place, output: Path | None = None) -> list[str]:
    """Lines of an ASCII map of the region: scale errors in four shades, and a legend.

    Empty if the map cannot be drawn, as for a set of points, or in a narrow terminal.
    """
    widest = min(_WIDEST, room_in(output) or _WIDEST)
    if not region.area_km2 or widest < _NARROWEST:
        return []
    place = surfaces.shown_part(region)
    _, south, _, north = place.bounds
    longest = np.cos(np.radians(max(south, -north, 0.0)))
    step = np.sqrt(surfaces.longitude_width(place.bounds) * longest * (north - south) / (_TRIANGLES / 2))
    try:
        surface = surfaces.surface_of(projection, place, float(step))
    except ValueError:  # nothing of it is drawn, and the figures say so
        return []
    cells, values, land = _in_characters(surface, place, widest)
    if not np.isfinite(values).any():
        return []
    return _drawn(cells, values, land, unicode=takes_blocks(output))


def _in_characters(surface: surfaces.Surface, region: Place, widest: int) -> tuple[BoolArray, FloatArray, BoolArray]:
    """Per character (rows, columns): on the map, mean scale error, mostly land."""
    lon, lat = (values[surface.source] for values in surface.lonlat())
    measured = surfaces.field(surface, get_measure(_MEASURE))
    triangles = surface.triangles[np.isfinite(measured[surface.triangles]).all(axis=1)]
    triangles = triangles[np.asarray(region.contains(lon[triangles[:, 0]], lat[triangles[:, 0]]))]
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

    def mean(values: FloatArray) -> FloatArray:
        """Mean of the triangles' values in each character; NaN without any."""
        total = np.bincount(place, weights=values, minlength=count.size)
        return np.divide(total, count, out=np.full(count.size, np.nan), where=count > 0).reshape(rows, columns)

    land = np.ones(len(triangles))  # as all is on other bodies
    if not surface.domain.projection.is_of_another_body:
        outline, first = land_within(surface.domain.region.bounds, surfaces.coast_resolution(surface)), triangles[:, 0]
        land *= False if outline.is_empty else get_region(outline).contains(lon[first], lat[first])
    return (count > 0).reshape(rows, columns), mean(measured[triangles].mean(axis=1)), mean(land) > 0.5


def _drawn(cells: BoolArray, values: FloatArray, land: BoolArray, *, unicode: bool) -> list[str]:
    """Lines of the map and its legend: four shades, each for a quarter of the shaded characters."""
    shades, sea = ("░▒▓█", "·") if unicode else ("-+x#", ".")
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
    ends = [*levels, float(known.max())]
    unit, name = (_PPM_OF_A_PER_CENT, "%") if ends[-1] >= _PPM_OF_A_PER_CENT else (1.0, "ppm")
    texts = [f"{shade} to {certain(float(f'{end / unit:.2g}'))}" for shade, end in zip(shades, ends, strict=True)]
    legend = f"Scale error: {', '.join(texts)} {name}{f'; {sea} sea' if apart else ''}"
    return [*("".join(line).rstrip() for line in picture), legend]
