"""The command `ldp`."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from projdist import plots
from projdist.cli import options as opt
from projdist.cli.errors import refuse, refusing, working
from projdist.cli.formats import CSV, HTML, JSON, TABLE, present
from projdist.cli.number_format import size_text
from projdist.cli.pictures import PictureFile, PictureOptions, picture_of
from projdist.cli.report import Column, Copy, Mapped, Report, Row, Table
from projdist.decisions import LDP, LDP_FAMILIES, ldp, read_heights
from projdist.projections import ProjectionLike, number_text
from projdist.regions import Box, PointSet

_FORMS = (TABLE, "proj", "wkt", "esri", JSON, CSV, HTML)


def ldp_command(
    region: opt.RegionArgument,
    heights: str | None = opt.option(
        "FILE", "Points: .csv with lon, lat and ellipsoidal h, or a .tif (with rasterio)."
    ),
    height: str | None = opt.option("METRES", "The ellipsoidal height of the whole region."),
    families: str = opt.option("NAMES", "Which to try, with commas.", ",".join(LDP_FAMILIES)),
    criterion: str = opt.option(
        "NAME",
        "share (the most points within the target), max_scale_error_ppm, rms_scale_error_ppm, ...",
        "share",
        *opt.CRITERION,
    ),
    target_ppm: str = opt.option("PPM", "The target of the share.", "20"),
    round_k: str = opt.option("NUMBER", "The scale factor is a multiple of it.", "1e-6"),
    round_axis: str = opt.option("ANGLE", "The axis is a multiple: 1', 30\", 0.5 (deg).", "1'"),
    geodetic: str = opt.option("CRS", "Geographic CRS to base it on.", "EPSG:4326"),
    against: list[str] | None = opt.option("PROJECTION", "A map to compare with; may be repeated."),
    name: str | None = opt.option("TEXT", "The name of the CRS."),
    format: str | None = opt.report_format(_FORMS),
    output: str | None = opt.output("Map of the ppm: .png, .svg or .pdf; or a page: .html."),
    *,
    pictured: PictureOptions,
) -> None:
    """Design a low-distortion projection: grid distances as on the ground, at ellipsoidal heights."""
    form, page = opt.form_and_page(format, output, pictured.overwrite, _FORMS)
    area = opt.region_of(region)
    own = isinstance(area, PointSet) and area.height is not None
    if (heights is not None) + (height is not None) > 1 or not (own or heights or height):
        refuse("Invalid heights. There must be either --heights FILE or --height METRES.")
    picture = picture_of(output, pictured, beside=(opt.PAGE_SUFFIX,))
    options: dict[str, Any] = {
        "families": [word.strip() for word in families.split(",") if word.strip()],
        "criterion": criterion,
        "target_ppm": opt.number("target", target_ppm, 1e-3, 1e5, " of ppm"),
        "round_k": opt.number("rounding of k_0", round_k, 1e-10, 1e-3),
        "round_axis": _angle(round_axis),
        "geodetic": geodetic,
        "against": against or [],
        "name": name,
    }
    with refusing(), working("Designing"):
        if height is not None:
            options["height"] = opt.number("height", height, -500.0, 9000.0, " of metres")
        elif heights is not None:
            options["heights"] = read_heights(heights)
        found = ldp(area, **options)
    if picture is not None:
        picture.save(plots.ldp_figure, found)
    present(_report(found, picture, against or []), form, page, pictured.overwrite)


def _angle(text: str) -> float:
    """Angle in degrees, given as `0.5`, `1'` or `30"`."""
    match = re.fullmatch(r"\s*([\d.]+(?:e-?\d+)?)\s*(['\"′″°]?)\s*", text)
    unit = {"'": 60.0, "′": 60.0, '"': 3600.0, "″": 3600.0}.get(match[2] if match else "", 1.0)
    try:
        degrees = float(match[1]) / unit if match else math.nan
    except ValueError:
        degrees = math.nan
    if not 1e-7 <= degrees <= 1.0:
        refuse(f"Invalid rounding of the axis '{text}'. It must be an angle up to 1 degree, as 1', 30\" or 0.5.")
    return degrees


_ANGLES = ("lat_0", "lat_1", "lon_0", "lonc", "alpha")


def _report(found: LDP, picture: PictureFile | None, against: Sequence[str]) -> Report:
    name, region = found.projection.name, found.region
    return Report(
        title=f"{name} for {region.name} ({size_text(region)}), by {found.criterion}",
        lead=[
            f"{key:6} {_degrees(value) if key in _ANGLES else number_text(value)}"
            for key, value in found.parameters.items()
        ],
        tables=[_maps(found)],
        notes=[*_notes(found)],
        data=found.to_dict,
        rows=lambda: _points(found),
        copies={
            form: Copy(text, "There is no such form of it.")
            for form, text in (("proj", found.proj), ("wkt", found.wkt), ("esri", found.esri))
        },
        about=name,
        written=[picture.path if picture else None],
        maps=_mapped(found, against),
    )


def _mapped(found: LDP, against: Sequence[str]) -> Mapped:
    """The design and its baselines, with scales on the ground at the mean height."""
    height = float(np.average(found.height, weights=found.weight))
    at = f"at {height:,.0f} m" if np.ptp(found.height) < 0.5 else f"at the mean height, {height:,.0f} m"
    labels = [found.family, *(label for label, _ in found.baselines)]
    maps: list[ProjectionLike] = [found.projection, *against]
    titles = [f"{label}, on the ground {at}" for label, _ in zip(labels, maps, strict=False)]
    region = Box.between(found.region.bounds) if isinstance(found.region, PointSet) else found.region
    return Mapped(maps, titles, region, "scale_error_ppm", height)


def _maps(found: LDP) -> Table:
    """Table of ppm statistics of the design, other families and baselines."""
    maps = [(found.family, found.statistics), *((other.family, other.statistics) for other in found.others)]
    rows = [
        {"map": label} | vars(statistics) | {f"within {ppm:g}": share for ppm, share in statistics.within.items()}
        for label, statistics in (*maps, *found.baselines)
    ]
    figures = [Column(name, show="{:.2f}".format, unit="ppm") for name in ("min", "max", "mean", "std", "rms")]
    shares = [Column(f"within {ppm:g}", show=_share) for ppm in found.statistics.within]
    return Table(rows, ["map", *figures, *shares])


def _notes(found: LDP) -> Iterator[str]:
    low, high = found.height.min(), found.height.max()
    yield f"Heights are ellipsoidal, not orthometric: {low:,.1f} to {high:,.1f} m at {found.lon.size:,} points."
    yield from found.notes
    yield f"PROJ: {found.proj}"
    if found.simpler:
        yield f"PROJ, {found.simpler.family}: {found.simpler.proj}"
    forms = [form for form, text in (("wkt", found.wkt), ("esri", found.esri)) if text]
    if forms:
        yield f"WKT: see --format {' or '.join(forms)}"


def _points(found: LDP) -> list[Row]:
    """One row per point of the region."""
    columns = {"lon": found.lon, "lat": found.lat, "height": found.height, "ppm": found.ppm}
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def _share(share: float) -> str:
    return f"{100.0 * share:.1f} %"


def _degrees(value: float) -> str:
    """Angle in degrees, minutes and seconds, and in decimal degrees."""
    seconds: Any = round(abs(value) * 3600.0, 5)
    minutes, seconds = divmod(seconds, 60.0)
    degrees, minutes = divmod(int(minutes), 60)
    sign = "-" if value < 0 else ""
    return (
        f"{sign}{degrees}°{minutes:02d}'{number_text(round(seconds, 5)).zfill(2)}\"  ({number_text(round(value, 9))})"
    )
