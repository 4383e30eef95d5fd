"""The commands for people's data: `check` of areas, lengths and bearings in a CRS, and `convert` to another CRS."""

import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

from projdist import decisions, gis, regions
from projdist.cli import options as opt
from projdist.cli.errors import fail, note, progress_bar, refuse, refusing, working
from projdist.cli.report import Column, Mapped, Report, Table, drawing, present, tell_written
from projdist.cli.wording import angle_error, area_error, area_text, distance_error, error_sentence, named

ABOVE = 3
"""Exit code if an error is above the limit."""

_UNITS = {"": 1.0, "%": 1e-2, "ppm": 1e-6}
_MARKED = 9  # features on maps
_MARGIN, _LEAST_MARGIN = 0.05, 1e-3  # around the data: share of their extent, and at least so many degrees
_NAMED = 5  # features named in a note


def check_command(
    data: str = opt.argument("DATA[#LAYER]", "Lines or polygons in any format that GDAL or pyarrow reads."),
    crs: str | None = opt.option("PROJECTION", "The CRS to check the data in, as in compare; by default their own."),
    fail_above: str | None = opt.option("SHARE", "Exit with 3 if an area or length is off by more: 1%, 0.01, 500ppm."),
    fail_above_bearing: str | None = opt.option("DEGREES", "Exit with 3 if the RMS error of bearings is larger."),
    fail_on: str = opt.option(decisions.FAIL_ON, "The worst feature's error, or that of the totals.", "worst"),
    worst: str = opt.option("NUMBER", "How many of the worst features to print.", "5"),
    id: str | None = opt.option("COLUMN", "The column of names; by default the usual one, or the only text column."),
    suggest: bool = opt.flag("--suggest", "Also find a better CRS for the data, which takes a few seconds."),
    purpose: str | None = opt.option(decisions.PURPOSES, "What the suggested CRS must keep; any if not given."),
    format: str | None = opt.report_format(),
    output: str | None = opt.output("The data with their errors: .gpkg or .geojson; or the report as a page: .html."),
    overwrite: opt.Overwrite = False,
) -> None:
    """Check areas, lengths and bearings of data in a CRS against the ellipsoid."""
    form, page, _ = opt.page_target(format, output, overwrite)
    count = opt.whole_number("number of features", worst, 0, 1_000_000)
    limit = None if fail_above is None else _share(fail_above)
    turn = opt.number("bearing", fail_above_bearing, 0.0, 180.0, " of degrees")
    opt.choice("thing to fail on", fail_on, decisions.FAIL_ON)
    if not suggest:
        opt.refuse_given({"--purpose": purpose}, "It is for --suggest.")
    with refusing():
        kept = decisions.get_purpose(purpose or "any") if suggest else None
    path = None
    if output is not None and page is None:
        path = opt.file_of_kind(output, (*opt.LAYER_SUFFIXES, opt.PAGE_SUFFIX), overwrite)
        opt.check_libraries(path)
    with refusing(), progress_bar("maps") as progress:
        frame = gis.read_data(data)
        options = {"progress": progress} if suggest else {}
        result = decisions.check(frame, crs, column=id, purpose=kept, **options)
    if path is not None:
        columns = {name: values for name, values in result.features.items() if name not in ("index", "name")}
        known = {str(name).lower(): name for name in frame.columns}
        taken = [known[name] for name in columns if name in known]
        # If all are there, they are from an earlier check, and are replaced; if some, they are the user's own.
        if 0 < len(taken) < len(columns):
            refuse(f"Invalid data for '{path}'. They have a column '{taken[0]}' already; rename it.")
        with drawing(path):
            gis.save_layer(frame.drop(columns=taken).assign(**columns), path, overwrite=overwrite)
    report = check_report(result, data, count, path)
    present(replace(report, maps=_mapped(result, frame, count)), form, page, overwrite)
    total = result.overall
    if result.above(limit, bearing=turn, on=fail_on):
        limits = [fail_above, fail_above_bearing and f"{fail_above_bearing} degrees"]
        what = "The worst feature is" if fail_on == "worst" else "The totals are"
        undrawn = f"{total.undrawn} feature(s) cannot be drawn in this CRS, which is above every limit."
        fail(undrawn if total.undrawn else f"{what} above {' or '.join(filter(None, limits))}.")
        raise typer.Exit(ABOVE)
    if not total.measured:
        reasons = Counter(str(text).split("; ")[-1] for text in result.features["note"])
        told = ", ".join(f"{text} ({times})" for text, times in reasons.items())
        named = f"'{result.projection.label}' for '{data}'"
        refuse(f"Invalid CRS {named}. None of the features can be drawn in it: {told}.")


def _share(text: str) -> float:
    """Share given as 1%, 0.01 or 500ppm."""
    match = re.fullmatch(r"\s*(\d+\.?\d*(?:e[-+]?\d+)?|\.\d+)\s*(%|ppm|)\s*", text, re.IGNORECASE)
    share = float(match[1]) * _UNITS[match[2].lower()] if match else math.nan
    if not math.isfinite(share):
        refuse(f"Invalid limit '{text}'. It must be a share, such as 1%, 0.01 or 500ppm.")
    return share


def _mapped(result: decisions.Check, frame: Any, count: int) -> Mapped | None:
    """Maps around the data in the checked and the recommended CRS, with the worst features marked."""
    if result.region is None:
        return None
    maps = [one.projection for one in _checks(result)]
    worst = result.worst(min(count, _MARKED))
    shapes, rows = frame.geometry.iloc[worst].to_crs(frame.crs.geodetic_crs), result.rows(worst)
    names = [f"{k}. {row['name'] or row['index']}" for k, row in enumerate(rows, 1)]
    west, south, east, north = result.region.bounds
    margin = max(_MARGIN * max(east - west, north - south), _LEAST_MARGIN)
    about = regions.Box.between((west - margin, max(south - margin, -90.0), east + margin, min(north + margin, 90.0)))
    return Mapped(maps, [one.label for one in maps], about, marks=dict(zip(names, shapes, strict=True)))


def check_report(result: decisions.Check, data: str, count: int, written: Path | None = None) -> Report:
    """Report of the totals in each CRS and of the worst features."""
    total = result.overall
    measured = [f"{total.measured} of {len(result.features['note'])} features"]
    measured += [area_text(total.area_km2)] if math.isfinite(total.area_km2) else []
    measured += [f"{total.length_km:,.6g} km"] if total.measured else []
    worst = result.rows(result.worst(count))
    totals = [{"map": one.projection.label, "name": one.projection.name} | vars(one.overall) for one in _checks(result)]
    return Report(
        answer=[*_answer(result)],
        brief=[Table(worst, _FEATURES, "The worst features")],
        next=({"-o errors.gpkg": "For the errors of every feature, the same command with"} if total.measured else {})
        | ({} if result.recommended else {"--suggest": "For a better CRS, the same command with"}),
        title=f"{data} ({result.data_crs}): {', '.join(measured)}",
        tables=[Table(totals, _TOTALS), *([Table(worst, _FEATURES, "The worst features")] if worst else [])],
        notes=[*_notes(result)],
        data=lambda: {"data": data} | result.to_dict() | {"worst": worst},
        rows=lambda: result.rows(range(len(result.features["note"]))),
        header=list(result.features),
        written=[written],
    )


def _answer(result: decisions.Check) -> Iterator[str]:
    """Sentences: the largest errors of areas, lengths and bearings in the CRS, and in a better one."""
    for one in _checks(result):
        total = one.overall
        figures = {
            "areas": (area_error, total.worst_area_error),
            "lengths": (distance_error, total.worst_length_error),
            "bearings": (angle_error, total.largest_bearing_error),
        }
        told = {what: words(abs(error)) for what, (words, error) in figures.items() if math.isfinite(error)}
        if told:
            better = "" if one is result else "A better CRS for them, "
            yield f"{better}{named(one.projection.label, one.projection.name)}: {error_sentence(told)}."
    if result.overall.undrawn:
        count = result.overall.undrawn
        yield f"{count} feature{'s' * (count > 1)} cannot be drawn in this CRS."


def _checks(result: decisions.Check) -> list[decisions.Check]:
    """The check in its CRS, and in the recommended one if that is another."""
    other = result.recommended
    return [result] if other is None or other.projection.definition == result.projection.definition else [result, other]


def _error(value: float) -> str:
    """Relative error in per cent, or below 0.1 % in parts per million."""
    if abs(value) < 5e-10:
        return "0"
    return f"{1e6 * value:+.4g} ppm" if abs(value) < 1e-3 else f"{100.0 * value:+.4g} %"


_degrees = "{:.4f}".format
_TOTALS = (
    "map",
    "name",
    "measured",
    Column("area_error", "area ratio", lambda error: f"{1.0 + error:.6f}"),
    Column("worst_area_error", "area worst", _error),
    Column("rms_area_error", "area RMS", _error),
    Column("length_error", "length ratio", lambda error: f"{1.0 + error:.6f}"),
    Column("worst_length_error", "length worst", _error),
    Column("rms_length_error", "length RMS", _error),
    Column("bearing_error", "bearing RMS", _degrees),
    Column("worst_bearing_error", "bearing worst", _degrees),
    Column("largest_bearing_error", "bearing largest", _degrees),
)
_FEATURES = (
    Column("index", "feature", left=True),
    "name",
    Column("area_km2", "area km2", lambda km2: area_text(km2).removesuffix(" km2")),
    Column("area_error", "area error", _error),
    Column("length_error", "length error", _error),
    Column("bearing_error", "bearing RMS", _degrees),
    Column("largest_bearing_error", "bearing largest", _degrees),
    Column("note", left=True),
)


def _notes(result: decisions.Check) -> Iterator[str]:
    """Notes on the columns and on what was not measured."""
    yield (
        "Ratios and errors: the map over the ellipsoid, along the same lines; worst: of the worst feature; RMS: of the "
        "features. Bearings: degrees, grid less true; RMS: along the lines; largest: anywhere on them."
    )
    if len(_checks(result)) > 1:
        yield "The second line: the recommended CRS for the box around the data, with the same data in it."
    elif result.recommended:
        yield f"The recommended CRS for the box around the data is this one, {result.projection.label}."
    undrawn = result.rows(result.undrawn())
    for text in (decisions.OUTSIDE, decisions.TORN):
        those = [" ".join(filter(None, (str(row["index"]), row["name"]))) for row in undrawn if text in row["note"]]
        if those:
            more = f" and {len(those) - _NAMED} more" if len(those) > _NAMED else ""
            yield f"Not measured, as {text}: {', '.join(those[:_NAMED])}{more}."
    others = Counter(part for text in result.features["note"] for part in str(text).split("; "))
    for text, times in others.items():
        if text not in ("", decisions.OUTSIDE, decisions.TORN):
            yield f"{text[:1].upper()}{text[1:]}: {times} feature(s)."
    yield from result.notes


_RESAMPLINGS = ("nearest", "bilinear", "cubic", "average", "mode")
_CONVERTED_SUFFIXES = (".gpkg", ".geojson", ".fgb", ".shp", ".parquet", ".tif", ".tiff")


def convert_command(
    data: str = opt.argument("DATA[#LAYER]", "Points, lines, polygons or pixels that GDAL reads."),
    crs: str | None = opt.argument("[CRS]", "A code, WKT, a PROJ string, or a .wkt file of 'projdist design'.", None),
    to: str | None = opt.option("CRS", "The CRS, as an option."),
    source: str | None = opt.option("CRS", "The CRS of the data, if their file has lost it.", None, "--from"),
    densify: str | None = opt.option("KM", "Divide edges into pieces of at most this many kilometres."),
    resampling: str = opt.option(_RESAMPLINGS, "How pixels get their values.", "nearest"),
    resolution: str | None = opt.option("NUMBER", "The side of a pixel in the unit of the CRS."),
    output: str | None = opt.output("A new .gpkg, .geojson, .fgb, .shp, .parquet or .tif."),
    overwrite: opt.Overwrite = False,
) -> None:
    """Transform layers and rasters to another CRS, even one made by design, and back."""
    wanted = [one for one in (crs, to) if one is not None]
    if len(wanted) != 1:
        refuse("Invalid CRS. It must be given once, after the data or after --to.")
    if output is None:
        refuse("Invalid option '--output'. It must name a file.")
    path = opt.file_of_kind(output, _CONVERTED_SUFFIXES, overwrite)
    options: dict[str, Any] = {
        "source": source,
        "resampling": opt.choice("resampling", resampling, _RESAMPLINGS),
        "densify": opt.number("distance", densify, 1e-6, 1e5, " of kilometres"),
        "resolution": opt.number("resolution", resolution, 1e-12, 1e12),
    }
    opt.check_libraries(path)
    with drawing(path), working("Converting"):
        found = gis.convert(data, wanted[0], path, **options, overwrite=overwrite)
    note(found.note)
    tell_written(found.path, *([found.wkt] if found.wkt else []))
