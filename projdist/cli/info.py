"""The command `info`."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from projdist import plots
from projdist.cli.cells import certain, first_digit, label_of, per_cent, rounded, size_text, with_error
from projdist.cli.errors import refusing
from projdist.cli.formats import TABLE
from projdist.cli.options import (
    PAGE_SUFFIX,
    DpiOption,
    OverwriteOption,
    RegionOption,
    ReportFormatOption,
    SizeOption,
    form_and_page,
    output_option,
    region_given,
)
from projdist.cli.output import present
from projdist.cli.pictures import LookWords, PictureFile, picture_of, with_looks
from projdist.cli.progress import working
from projdist.cli.report import Column, Mapped, Report, Table
from projdist.cli.sketches import sketch_of
from projdist.decisions import MapInfo, info
from projdist.earth import latitude_text, longitude_text
from projdist.regions import Box
from projdist.support import listed

_SAME = 5  # codes of CRSs of the same map: how many are named
_LONGEST = 100  # characters of a text
_MEASURE = "scale_error_ppm"
_TITLES = {
    "scale_error_ppm": "scale error, ppm",
    "omega": "angular deformation, deg",
    "s": "areal scale",
    "h": "scale along meridians",
    "k": "scale along parallels",
}
_KEEPS = {"conformal": "angles", "equal-area": "areas", "equidistant": "distances"}


@with_looks
def info_command(
    projection: Annotated[str, typer.Argument(metavar="PROJECTION", help="As for compare.")],
    region: RegionOption = None,
    format: ReportFormatOption = None,
    output: Annotated[
        str | None,
        output_option("A heat map of the scale error: .png, .svg or .pdf; or all as a page with a live map: .html."),
    ] = None,
    size: SizeOption = None,
    dpi: DpiOption = None,
    overwrite: OverwriteOption = False,
    look: LookWords | None = None,
) -> None:
    """Show what a projection is, what it keeps as measured, and its errors where it is for."""
    form, page = form_and_page(format, output, overwrite)
    picture = picture_of(output, size=size, dpi=dpi, overwrite=overwrite, look=look, beside=(PAGE_SUFFIX,))
    area = region_given(region, [projection])
    with refusing(), working("Measuring"):
        found = info(projection, area)
    if picture is not None:
        _draw(found, picture)
    sketch = sketch_of(found.projection, found.region, page) if form == TABLE else []
    present(_report(found, sketch, picture.path if picture else None), form, page, overwrite)


def _draw(found: MapInfo, picture: PictureFile) -> None:
    """A heat map of the scale error."""
    options: dict[str, Any] = {"measure": _MEASURE, "region": found.region}
    options["airy_kavrayskiy"] = [found.airy_kavrayskiy.raw]
    picture.save(functools.partial(plots.heatmap_figure, [found.projection], **options))


def _report(found: MapInfo, sketch: list[str], picture: Path | None) -> Report:
    stated, label = found.particulars, label_of(found.given, found.projection.name)
    parameters = [one._asdict() for one in stated.parameters]
    title = f"{stated.code or label}: {found.projection.name}"
    return Report(
        title=title if stated.code or label != found.projection.name else label,
        tables=[
            Table([{"what": what, "it is": text} for what, text in _card(found)], [Column("what"), Column("it is")]),
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
    """What is said of a map, a line each; what nobody states is left out."""
    stated = found.particulars
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
    """What is kept, and how well."""
    kept = [f"{_KEEPS[name]} ({name}, to {first_digit(found.departures[name])})" for name in found.keeps]
    return f"{listed(kept, 'and')}, as measured" if kept else "neither angles, areas nor distances, as measured"


def _short(text: str) -> str:
    """The beginning of a text: to a colon before a long list, or as much as is read."""
    text = " ".join(text.split()).rstrip(".")
    if len(text) <= _LONGEST:
        return text
    beginning = text.partition(": ")[0]
    return beginning if len(beginning) <= _LONGEST else f"{beginning[: _LONGEST - 3].rstrip()}..."


def _bounds(bounds: tuple[float, float, float, float]) -> str:
    west, south, east, north = bounds
    return f"{longitude_text(west)} to {longitude_text(east)}, {latitude_text(south)} to {latitude_text(north)}"


def _ellipsoid(found: MapInfo) -> str:
    ellipsoid, name = found.projection.ellipsoid, found.particulars.ellipsoid_name
    if ellipsoid.is_sphere:
        return f"{name or 'sphere'}, {ellipsoid.a:.11g} m"
    return ", ".join(filter(None, (name, f"a {ellipsoid.a:.11g} m", f"1/f {1.0 / ellipsoid.f:.12g}")))


def _coordinates(found: MapInfo) -> str:
    """The unit and the axes in their order."""
    stated = found.particulars
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
    """Ratios near 1 keep the digits that tell them from it."""
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
