"""The command `check`."""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

from projdist import gis
from projdist.cli import options as opt
from projdist.cli.errors import fail, progress_bar, refuse, refusing
from projdist.cli.formats import drawing, present
from projdist.cli.number_format import area_text
from projdist.cli.pictures import LAYER_SUFFIXES, check_libraries
from projdist.cli.report import Column, Mapped, Report, Table
from projdist.decisions import FAIL_ON, OUTSIDE, PURPOSES, TORN, Check, check, get_purpose
from projdist.regions import Box, Place

ABOVE = 3
"""The exit code where an error is above the limit."""

_UNITS = {"": 1.0, "%": 1e-2, "ppm": 1e-6}
_MARKED = 9  # features on maps
_MARGIN, _LEAST_MARGIN = 0.05, 1e-3  # about the data: of their extent, and degrees
_NAMED = 5  # features that cannot be drawn, by name


def check_command(
    data: str = opt.argument("DATA[#LAYER]", "Lines or polygons in any format that GDAL or pyarrow reads."),
    crs: str | None = opt.option("PROJECTION", "What to check the data in, as for compare; by default their own CRS."),
    fail_above: str | None = opt.option("SHARE", "End with 3 if an area or length is off by more: 1%, 0.01 or 500ppm."),
    fail_above_bearing: str | None = opt.option("DEGREES", "End with 3 if bearings are off by more, as RMS."),
    fail_on: str = opt.option(FAIL_ON, "Any feature's error, or that of the totals.", "worst"),
    worst: str = opt.option("NUMBER", "How many of the worst features to print.", "5"),
    id: str | None = opt.option("COLUMN", "The column with the names; else the usual one, or the only one of texts."),
    purpose: str = opt.option(PURPOSES, "What the recommended CRS shall keep.", "any"),
    no_recommend: bool = opt.flag("--no-recommend", "Recommend no CRS, which takes most of the time."),
    format: str | None = opt.report_format(),
    output: str | None = opt.output("The data with their errors: .gpkg or .geojson; or the report as a page: .html."),
    overwrite: opt.Overwrite = False,
) -> None:
    """Check areas, lengths and bearings of data in a CRS against the ellipsoid."""
    form, page = opt.form_and_page(format, output, overwrite)
    count = opt.whole_number("number of features", worst, 0, 1_000_000)
    limit = None if fail_above is None else _share(fail_above)
    turn = opt.number("bearing", fail_above_bearing, 0.0, 180.0, " of degrees")
    opt.choice("thing to fail on", fail_on, FAIL_ON)
    with refusing():
        get_purpose(purpose)
    path = None if output is None or page else opt.file_of_kind(output, (*LAYER_SUFFIXES, opt.PAGE_SUFFIX), overwrite)
    if path is not None:
        check_libraries(path)
    with refusing(), progress_bar("maps") as progress:
        frame = gis.read_data(data)
        options = {} if no_recommend else {"progress": progress}
        result = check(frame, crs, column=id, purpose=None if no_recommend else purpose, **options)
    if path is not None:
        _save(result, frame, path, overwrite)
    report = check_report(result, data, count, path)
    present(replace(report, maps=_mapped(result, frame, count)), form, page, overwrite)
    if result.above(limit, bearing=turn, on=fail_on):
        fail(_reason(result, fail_on, fail_above, fail_above_bearing))
        raise typer.Exit(ABOVE)
    if not result.overall.measured:
        refuse(_unmeasured(result, data))


def _reason(result: Check, fail_on: str, share: str | None, bearing: str | None) -> str:
    """Reason for the exit code 3."""
    if result.overall.undrawn:
        return f"{result.overall.undrawn} feature(s) cannot be drawn in this CRS, which is above every limit."
    limits = [text for text in (share, bearing and f"{bearing} degrees") if text]
    what = "The worst feature is" if fail_on == "worst" else "The totals are"
    return f"{what} above {' or '.join(limits)}."


def _unmeasured(result: Check, data: str) -> str:
    """Reason why no feature could be measured."""
    notes = Counter(str(note).split("; ")[-1] for note in result.features["note"])
    reasons = ", ".join(f"{text} ({times})" for text, times in notes.items())
    return f"Invalid CRS '{result.projection.label}' for '{data}'. None of the features can be drawn in it: {reasons}."


def _share(text: str) -> float:
    """Share given as 1%, 0.01 or 500ppm."""
    match = re.fullmatch(r"\s*(\d+\.?\d*(?:e[-+]?\d+)?|\.\d+)\s*(%|ppm|)\s*", text, re.IGNORECASE)
    share = float(match[1]) * _UNITS[match[2].lower()] if match else math.nan
    if not math.isfinite(share):
        refuse(f"Invalid limit '{text}'. It must be a share, as 1%, 0.01 or 500ppm.")
    return share


def _save(result: Check, frame: Any, path: Path, overwrite: bool) -> None:
    """Write the data with their errors as columns; columns of an earlier check are replaced."""
    columns = {name: values for name, values in result.features.items() if name not in ("index", "name")}
    present = {str(name).lower(): name for name in frame.columns}
    taken = [present[name] for name in columns if name in present]
    # All columns present: from an earlier check. Some: the user's own.
    if 0 < len(taken) < len(columns):
        refuse(f"Invalid data for '{path}'. They have a column '{taken[0]}' already; rename it.")
    with drawing(path):
        gis.save_layer(frame.drop(columns=taken).assign(**columns), path, overwrite=overwrite)


def _mapped(result: Check, frame: Any, count: int) -> Mapped | None:
    """Maps around the data in the checked and the recommended CRS, with the worst features marked."""
    if result.region is None:
        return None
    maps = (
        [result.projection]
        if _is_best(result) or result.recommended is None
        else [result.projection, result.recommended.projection]
    )
    worst = result.worst(min(count, _MARKED))
    shapes = frame.geometry.iloc[worst].to_crs(frame.crs.geodetic_crs)
    rows = result.rows(worst)
    marks = {
        f"{k}. {row['name'] or row['index']}": shape for k, (row, shape) in enumerate(zip(rows, shapes, strict=True), 1)
    }
    return Mapped(maps, [one.label for one in maps], _about(result.region), marks=marks)


def _about(box: Place) -> Box:
    """The box with a margin, at least `_LEAST_MARGIN` wide."""
    west, south, east, north = box.bounds
    margin = max(_MARGIN * max(east - west, north - south), _LEAST_MARGIN)
    return Box.between((west - margin, max(south - margin, -90.0), east + margin, min(north + margin, 90.0)))


# ---- the report -----------------------------------------------------------------------------


def check_report(result: Check, data: str, count: int, written: Path | None = None) -> Report:
    """Report of the totals in each CRS and of the worst features."""
    total = result.overall
    measured = [f"{total.measured} of {len(result.features['note'])} features"]
    measured += [area_text(total.area_km2)] if math.isfinite(total.area_km2) else []
    measured += [f"{total.length_km:,.6g} km"] if total.measured else []
    worst = result.rows(result.worst(count))
    return Report(
        title=f"{data} ({result.data_crs}): {', '.join(measured)}",
        tables=[_totals(result), *([Table(worst, _FEATURES, "The worst features")] if worst else [])],
        notes=_notes(result),
        data=lambda: {"data": data} | result.to_dict() | {"worst": worst},
        rows=lambda: result.rows(range(len(result.features["note"]))),
        header=list(result.features),
        written=[written],
    )


def _totals(result: Check) -> Table:
    """Totals, one row per CRS: the checked one, and the recommended one if it is another."""
    other = None if _is_best(result) else result.recommended
    rows = [
        {"map": one.projection.label, "name": one.projection.name} | vars(one.overall)
        for one in (result, *([other] if other else []))
    ]
    return Table(rows, _TOTALS)


def _error(value: float) -> str:
    """Relative error in per cent, or below 0.1 % in parts per million."""
    if abs(value) < 5e-10:
        return "0"
    return f"{1e6 * value:+.4g} ppm" if abs(value) < 1e-3 else f"{100.0 * value:+.4g} %"


def _ratio(error: float) -> str:
    return f"{1.0 + error:.6f}"


_degrees = "{:.4f}".format
_TOTALS = (
    "map",
    "name",
    "measured",
    Column("area_error", "area ratio", _ratio),
    Column("worst_area_error", "area worst", _error),
    Column("rms_area_error", "area RMS", _error),
    Column("length_error", "length ratio", _ratio),
    Column("worst_length_error", "length worst", _error),
    Column("rms_length_error", "length RMS", _error),
    Column("bearing_error", "bearing RMS", _degrees),
    Column("worst_bearing_error", "bearing worst", _degrees),
    Column("largest_bearing_error", "bearing largest", _degrees),
)
_FEATURES = (
    Column("index", "feature", left=True),
    Column("name", left=True),
    Column("area_km2", "area", lambda km2: area_text(km2).removesuffix(" km2"), unit="km2"),
    Column("area_error", "area error", _error),
    Column("length_error", "length error", _error),
    Column("bearing_error", "bearing RMS", _degrees),
    Column("largest_bearing_error", "bearing largest", _degrees),
    Column("note", left=True),
)


def _notes(result: Check) -> list[str]:
    """Notes on the columns and on what was not measured."""
    notes = [
        "Ratios and errors: the map over the ellipsoid, along the same lines; worst: of the worst feature; RMS: of the "
        "features. Bearings: degrees, grid less true; RMS: along the lines; largest: anywhere on them."
    ]
    if _is_best(result):
        notes.append(f"The recommended CRS for the box about the data is this one, {result.projection.label}.")
    elif result.recommended:
        notes.append("The second line: the recommended CRS for the box about the data, with the same data in it.")
    undrawn = result.rows(result.undrawn())
    for text in (OUTSIDE, TORN):
        those = [" ".join(filter(None, (str(row["index"]), row["name"]))) for row in undrawn if text in row["note"]]
        if those:
            more = f" and {len(those) - _NAMED} more" if len(those) > _NAMED else ""
            notes.append(f"Not measured, as {text}: {', '.join(those[:_NAMED])}{more}.")
    others = Counter(part for note in result.features["note"] for part in str(note).split("; "))
    notes += [
        f"{text[:1].upper()}{text[1:]}: {times} feature(s)."
        for text, times in others.items()
        if text not in ("", OUTSIDE, TORN)
    ]
    return notes + list(result.notes)


def _is_best(result: Check) -> bool:
    """True if the checked CRS is the recommended one."""
    return result.recommended is not None and result.recommended.projection.definition == result.projection.definition
