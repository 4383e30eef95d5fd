"""The command `ldp`."""

from __future__ import annotations

import enum
import functools
import math
import re
from typing import Annotated, Any

import typer

from projdist.cli.errors import fail, refuse
from projdist.cli.formats import csv_text, json_text, notes_text, table_text
from projdist.cli.options import DpiOption, OverwriteOption, SizeOption, choice, number, region_of
from projdist.cli.output import emit, wrote
from projdist.cli.pictures import PictureFile, picture_of
from projdist.decisions import LDP, LDP_FAMILIES, HeightStatistics, ldp, read_heights
from projdist.projections import ProjectionError, number_text
from projdist.regions import PointSet


class _Form(enum.StrEnum):
    TABLE = "table"
    PROJ = "proj"
    WKT = "wkt"
    ESRI = "esri"
    JSON = "json"
    CSV = "csv"


def ldp_command(
    region: Annotated[str, typer.Argument(metavar="REGION", help="As --region of compare.")],
    heights: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Points: .csv with lon, lat and ellipsoidal h, or a .tif (with rasterio)."),
    ] = None,
    height: Annotated[
        str | None, typer.Option(metavar="METRES", help="The ellipsoidal height of the whole region.")
    ] = None,
    families: Annotated[str, typer.Option(metavar="NAMES", help="Which to try, with commas.")] = ",".join(LDP_FAMILIES),
    criterion: Annotated[
        str,
        typer.Option(
            "--criterion",
            "-c",
            metavar="NAME",
            help="share (the most points within the target), max_scale_error_ppm, rms_scale_error_ppm, ...",
        ),
    ] = "share",
    target_ppm: Annotated[str, typer.Option(metavar="PPM", help="The target of the share.")] = "20",
    round_k: Annotated[str, typer.Option(metavar="NUMBER", help="The scale factor is a multiple of it.")] = "1e-6",
    round_axis: Annotated[
        str, typer.Option(metavar="ANGLE", help="The axis is a multiple: 1', 30\", 0.5 (deg).")
    ] = "1'",
    geodetic: Annotated[str, typer.Option(metavar="CRS", help="Geographic CRS to base it on.")] = "EPSG:4326",
    against: Annotated[
        list[str] | None, typer.Option(metavar="PROJECTION", help="A map to compare with; may be repeated.")
    ] = None,
    name: Annotated[str | None, typer.Option(metavar="TEXT", help="The name of the CRS.")] = None,
    format: Annotated[str, typer.Option("--format", "-f", metavar="|".join(_Form), help="How to print.")] = "table",
    output: Annotated[
        str | None, typer.Option("--output", "-o", metavar="FILE", help="Map of the ppm: .png, .svg or .pdf.")
    ] = None,
    size: SizeOption = None,
    dpi: DpiOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Design a low-distortion projection: grid distances as on the ground, at ellipsoidal heights."""
    form, area = _Form(choice("format", format, list(_Form))), region_of(region)
    own = isinstance(area, PointSet) and area.height is not None
    if (heights is not None) + (height is not None) > 1 or not (own or heights or height):
        refuse("Invalid heights. There must be either --heights FILE or --height METRES.")
    picture = picture_of(output, size=size, dpi=dpi, overwrite=overwrite)
    options: dict[str, Any] = {
        "families": [word.strip() for word in families.split(",") if word.strip()],
        "criterion": criterion,
        "target_ppm": number("target", target_ppm, 1e-3, 1e5, " of ppm"),
        "round_k": number("rounding of k_0", round_k, 1e-10, 1e-3),
        "round_axis": _angle(round_axis),
        "geodetic": geodetic,
        "against": against or [],
        "name": name,
    }
    try:
        if height is not None:
            options["height"] = number("height", height, -500.0, 9000.0, " of metres")
        elif heights is not None:
            options["heights"] = read_heights(heights)
        found = ldp(area, **options)
    except ProjectionError as error:
        fail(str(error))
        raise typer.Exit(1) from error
    except ValueError as error:
        refuse(str(error), error)
    text = _text(found, form)
    if picture is not None:
        _draw(found, picture)
        text += wrote(picture.path) if form is _Form.TABLE else ""
    emit(text, None)


def _draw(found: LDP, picture: PictureFile) -> None:
    """The map of the distortion."""
    from projdist import plots  # matplotlib is slow to load, and --help must not wait for it

    picture.save(functools.partial(plots.ldp_figure, found))


def _angle(text: str) -> float:
    """Degrees of `0.5`, `1'` or `30"`."""
    match = re.fullmatch(r"\s*([\d.]+(?:e-?\d+)?)\s*(['\"′″°]?)\s*", text)
    unit = {"'": 60.0, "′": 60.0, '"': 3600.0, "″": 3600.0}.get(match[2] if match else "", 1.0)
    try:
        degrees = float(match[1]) / unit if match else math.nan
    except ValueError:
        degrees = math.nan
    if not 1e-7 <= degrees <= 1.0:
        refuse(f"Invalid rounding of the axis '{text}'. It must be an angle up to 1 degree, as 1', 30\" or 0.5.")
    return degrees


def _text(found: LDP, form: _Form) -> str:
    if form is _Form.TABLE:
        return _report(found)
    if form is _Form.JSON:
        return json_text(found.to_dict())
    if form is _Form.CSV:
        columns = {"lon": found.lon, "lat": found.lat, "height": found.height, "ppm": found.ppm}
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        return csv_text([dict(zip(columns, row, strict=True)) for row in rows], list(columns))
    text = {_Form.PROJ: found.proj, _Form.WKT: found.wkt, _Form.ESRI: found.esri}[form]
    if text is None:
        fail(f"Invalid format '{form}' for {found.projection.name}. There is no such form of it.")
        raise typer.Exit(1)
    return f"{text}\n"


_ANGLES = ("lat_0", "lat_1", "lon_0", "lonc", "alpha")


def _report(found: LDP) -> str:
    lines = [
        f"{found.projection.name} for {found.region.name} ({found.region.area_km2:,.0f} km2), by {found.criterion}",
        *(
            f"{key:6} {_degrees(value) if key in _ANGLES else number_text(value)}"
            for key, value in found.parameters.items()
        ),
        "",
    ]
    maps = [(found.family, found.statistics), *((other.family, other.statistics) for other in found.others)]
    maps += found.baselines
    columns: dict[str, list[str]] = {"map": [label for label, _ in maps]}
    for name in ("min", "max", "mean", "std", "rms"):
        columns[f"{name} ppm"] = [f"{getattr(statistics, name):.2f}" for _, statistics in maps]
    for ppm in found.statistics.within:
        columns[f"within {ppm:g}"] = [_share(statistics, ppm) for _, statistics in maps]
    low, high = found.height.min(), found.height.max()
    notes = [
        f"Heights are ellipsoidal, not orthometric: {low:,.1f} to {high:,.1f} m at {found.lon.size:,} points.",
        *found.notes,
        f"PROJ: {found.proj}",
        *([f"PROJ, {found.simpler.family}: {found.simpler.proj}"] if found.simpler else []),
    ]
    forms = [form for form, text in (("wkt", found.wkt), ("esri", found.esri)) if text]
    notes += [f"WKT: see --format {' or '.join(forms)}"] if forms else []
    return notes_text(lines) + table_text(columns, "") + notes_text(notes)


def _share(statistics: HeightStatistics, ppm: float) -> str:
    return f"{100 * statistics.within[ppm]:.1f} %"


def _degrees(value: float) -> str:
    """Degrees, minutes and seconds, and decimal degrees."""
    seconds: Any = round(abs(value) * 3600.0, 5)
    minutes, seconds = divmod(seconds, 60.0)
    degrees, minutes = divmod(int(minutes), 60)
    sign = "-" if value < 0 else ""
    return (
        f"{sign}{degrees}°{minutes:02d}'{number_text(round(seconds, 5)).zfill(2)}\"  ({number_text(round(value, 9))})"
    )
