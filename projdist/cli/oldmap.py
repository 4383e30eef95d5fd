"""The command `oldmap`: its report, rectified scans and layers."""

import functools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from projdist import designs, gis, matrices, plots, support
from projdist._typing import FloatArray
from projdist.applications import oldmaps
from projdist.cli import options as opt
from projdist.cli.errors import refuse, refusing, working
from projdist.cli.report import Column, Columns, Report, Table, drawing, present
from projdist.cli.wording import fixed, rms_text

SHEETS, LAYERS = (".tif", ".tiff"), (".gpkg",)
PANELS = ("tissot", "heatmap", "rotation", "scale", "grid")
DRAWN_MEASURES = ("fisher", "areal_scale")
_USUAL = 4  # panels if none are named
_SHOWN = 20  # names in a line
_ROUNDING = 1e-12  # a mean square up to this is shown as 0
_degrees = functools.partial(fixed, decimals=2)


def oldmap_command(
    points: list[str] = opt.argument(
        "POINTS...",
        "Control points: [id], x and y on the old map, true x and y in metres; or columns x_old, y_old, x_new, "
        "y_new; or points of QGIS, link tables of ArcGIS, or GDAL's -gcp. Files of several maps of one region are "
        "compared with their mean.",
    ),
    model: str = opt.option(oldmaps.MODELS, "What is fitted to the points.", "tps"),
    smoothing: str | None = opt.option(
        "NUMBER", "Smoothing of tps, 0 to interpolate; by default from generalized cross-validation."
    ),
    outliers: str = opt.option(oldmaps.OUTLIERS, "Leave out wrong points (they are named), or keep them.", "drop"),
    crs: str | None = opt.option(
        "PROJECTION",
        "The CRS of the true coordinates, which may also be longitudes and latitudes; by default the one that "
        "the file states.",
    ),
    scan_dpi: str | None = opt.option("NUMBER", "Dots per inch of the scan, to print scales as 1 : N."),
    image: str | None = opt.option("FILE", "The scan, to draw on, or to rectify."),
    by: str | None = opt.option(
        oldmaps.RECTIFIED_BY,
        "The map that rectifies the scan, fit if not given; for displacements, isolines and several maps, the "
        "linear map that is removed first, mdt if not given.",
    ),
    resolution: str | None = opt.option("METRES", "Pixel size of the rectified scan; by default about the scan's."),
    draw: list[str] | None = opt.option(
        PANELS, "Panels, with commas; may be repeated. The first four if not given. Rotations count clockwise."
    ),
    measure: str = opt.option(DRAWN_MEASURES, "What the heat map shows.", "fisher", *opt.MEASURE),
    format: opt.Format = "table",
    output: str | None = opt.output(
        "A picture: .png, .svg or .pdf; the rectified scan: .tif; displacements and isolines: .gpkg."
    ),
    *,
    pictured: opt.PictureOptions,
) -> None:
    """Measure the distortion of an old map from control points, or of several and what they have in common."""
    form = opt.format_of(format)
    opt.choice("model", model, oldmaps.MODELS)
    opt.choice("outliers", outliers, oldmaps.OUTLIERS)
    fitting: dict[str, Any] = {
        "model": model,
        "smoothing": opt.number("smoothing", smoothing, 0.0, 1e9),
        "outliers": outliers,
        "dots_per_inch": opt.number("scan dpi", scan_dpi, 1.0, 1e5),
    }

    def fitted(name: str) -> oldmaps.OldMap:
        return oldmaps.old_map(oldmaps.read_control_points(name, crs=crs), **fitting)

    drawn: dict[str, Any] = {"draw": draw, "measure": None if measure == "fisher" else measure}
    of_pictures = {f"--{name}": value for name, value in drawn.items()} | pictured.given()
    if len(points) > 1:
        of_one = {"--output": output, "--image": image, "--resolution": resolution} | of_pictures
        opt.refuse_given({name: value or None for name, value in of_one.items()}, "It is for one.", " for several maps")
        for name in points:
            if points.count(name) > 1:
                refuse(f"Invalid points file '{name}'. It must be given once.")
        with refusing(), working("Fitting"):
            report = _several_report(points, [fitted(one) for one in points], by or "mdt")
        present(report, form)
        return
    opt.choice("measure", measure, DRAWN_MEASURES)
    panels = [opt.choice("panel", word.strip(), PANELS) for text in draw or [] for word in text.split(",")]
    path, picture = None, None
    if output is not None and Path(output).suffix.lower() in (*SHEETS, *LAYERS):
        opt.refuse_given(of_pictures, "It is for pictures.", f" for '{output}'")
        path = opt.file_of_kind(output, (*SHEETS, *LAYERS), pictured.overwrite)
        is_sheet = path.suffix.lower() in SHEETS
        allowed = [name for name in oldmaps.RECTIFIED_BY if is_sheet or name != "fit"]
        method = opt.choice("rectification", ("fit" if is_sheet else "mdt") if by is None else by, allowed)
        side = opt.number("resolution", resolution, 1e-6, 1e7, " of metres")
        if not is_sheet:
            of_sheets = {"--image": image, "--resolution": resolution}
            opt.refuse_given(of_sheets, "It is for pictures and rectified scans.", f" for '{output}'")
        elif image is None:
            refuse(f"Invalid output '{output}'. It needs a scan: --image FILE.")
        elif path.exists() and Path(image).exists() and path.samefile(image):
            refuse(f"Invalid output '{output}'. It is the scan.")
        opt.check_libraries(path)
    else:
        of_layers = {"--by": by, "--resolution": resolution}
        opt.refuse_given(of_layers, "It needs a sheet or layers to write: -o FILE.tif or FILE.gpkg.")
        picture = opt.picture_of(output, pictured, beside=(*SHEETS, *LAYERS), **drawn, image=image)
    with refusing():
        found = fitted(points[0])
    if path is not None:
        with drawing(path), working("Drawing"):
            if image is not None:
                sheet = oldmaps.rectify(found, image, by=method, resolution=side)
                gis.save_sheet(sheet, path, crs=found.points.crs, overwrite=pictured.overwrite)
            else:
                gis.save_layers(gis.old_map_layers(found, by=method), path, overwrite=pictured.overwrite)
        if found.points.crs is None:
            support.tell(f"'{path}' has no CRS, only metres in an unnamed plane; --crs states it.")
    if picture is not None:
        shown: dict[str, Any] = {"draw": panels or PANELS[:_USUAL], "measure": measure, "image": image}
        picture.save(plots.old_map_figure, found, **shown)
    present(_report(found, points[0], path or picture), form)


# ---- several maps --------------------------------------------------------------------------------


def _several_report(given: Sequence[str], maps: Sequence[oldmaps.OldMap], by: str) -> Report:
    """Report with one row per rectified map, and one for their mean."""
    ground = oldmaps.common_ground(maps, by=by)
    mean = designs.mean_plane_map(ground.x, ground.y, ground.jacobians, area=ground.area)
    nearest = mean.jacobian(ground.x, ground.y)

    def mean_square(jacobian: FloatArray) -> float:
        return float(ground.area @ matrices.get_measure("fisher")(jacobian) ** 2)

    measured = [
        {
            "map": name,
            "points": len(one.points.old),
            "left_out": len(one.points.old) - len(one.fitted.old),
            "distortion": mean_square(field),
            "from_mean": mean_square(nearest @ np.linalg.inv(field)),
        }
        for name, one, field in zip(given, maps, ground.jacobians, strict=True)
    ]
    common, own = mean_square(nearest), float(np.mean([mean_square(field) for field in ground.jacobians]))
    rows = [*measured, {"map": "their mean", "distortion": common}]

    def rounded(square: float) -> str:
        return f"{square if square > _ROUNDING else 0.0:.4g}"

    counts = [Column("points", show="{:,}".format), Column("left_out", "left out", "{:,}".format)]
    squares = [Column("distortion", "mean Dist_F^2", rounded), Column("from_mean", "from the mean", rounded)]
    return Report(
        title=f"{len(maps)} old maps, each after its {by}",
        tables=[Table(rows, ["map", *counts, *squares])],
        notes=[
            "Mean Dist_F^2: over the ground that all maps show, from the ground to a map, and from the mean to it. The "
            "mean is the map nearest to all: what they have in common.",
            f"They share {100 * common / own:.3g} % of their distortion."
            if own > _ROUNDING
            else "The maps have no distortion beyond rounding.",
        ],
        data=lambda: {"by": by, "maps": measured, "mean": {"distortion": common} | mean.to_dict()},
    )


_NAMES = {"mdt": "MDT", "affine": "affine, least squares", "helmert": "Helmert, least squares"}


def _report(found: oldmaps.OldMap, given: str, written: object) -> Report:
    data = found.to_dict()
    rectifications = [{"map": _NAMES[name]} | row for name, row in data["rectifications"].items()]
    columns: Columns = [
        "map",
        Column("distortion", "mean Dist_F^2", lambda value: f"{round(value, 12):.4g}"),
        Column("residual", "RMS at points, m", _short),
        Column("scale", "m per unit", "{:.5g}".format),
        Column("scale_error", "±", "{:.2g}".format),
        *([] if data["dots_per_inch"] is None else [Column("denominator", "scale 1 :", _short)]),
        Column("stretch", show="{:.5g}".format),
        Column("stretch_azimuth", "its azimuth", _degrees),
        Column("shear", show=_degrees),
        Column("rotation", show=_degrees),
        Column("rotation_error", "±", "{:.2g}".format),
    ]
    mdt = data["rectifications"]["mdt"]
    way = "clockwise" if mdt["rotation"] > 0.0 else "anticlockwise"
    return Report(
        answer=[
            f"After its best linear map (MDT), the old map's scales are off by {rms_text(mdt['distortion'] ** 0.5)} "
            f"(RMS). It has {mdt['scale']:.5g} m per unit, and is turned by {abs(mdt['rotation']):.2f}° {way}.",
            f"Its {len(found.points.old)} control points lie {_short(data['residual'])} m off the fit (RMS).",
        ],
        next={} if written else {"-o map.png": "To draw it, the same command with"},
        title=f"{given}: {len(found.points.old)} control points, {found.fit.model}",
        tables=[Table(rectifications, columns)],
        notes=[*_notes(data), f"Modes of the distortion after the MDT: {found.modes.summary}."],
        data=lambda: data,
        rows=lambda: data["points"],
        written=[written],
    )


def _notes(data: dict[str, Any]) -> Iterator[str]:
    """Notes on the fit, its folds and outliers."""
    smoothing, left_out = data["smoothing"], data["residual_left_out"]
    smoothed = "" if smoothing is None else f", with the smoothing {smoothing:.4g}"
    without = "" if left_out is None else f", each {_short(left_out)} m off where the others have it"
    yield (
        f"The fit has {data['freedom']:.4g} parameters per coordinate{smoothed}; the points are "
        f"{_short(data['residual'])} m off it (RMS){without}."
    )
    spreads = []
    for name, figures in data["statistics"].items():
        low, high = (f"{round(figures[key], 9) + 0.0:.3g}" for key in ("p05", "p95"))
        spreads.append(f"{name.replace('_', ' ')} {low} to {high}")
    yield f"After the MDT, on nine tenths of the area: {', '.join(spreads)} degrees."
    yield "Rotation: degrees by which the old map is turned clockwise, its vertical to the west of north."
    yield "±: standard errors by the points' residuals; those of affine and Helmert take distortion for errors."
    folds = data["folds"]
    if folds["near"]:
        share = f"{100 * folds['share']:.3g} % of the area ({_short(folds['area'])} square units)"
        yield f"The fit folds on {share}, near {_few(folds['near'])}. The figures leave that out."
    else:
        yield "The fit has no folds."
    if data["outliers"]:
        of_the_fit = ", left out of the fit" if data["outliers_left_out"] else ""
        yield f"Outliers{of_the_fit}, the farthest first: {_few(data['outliers'])}."
    yield from data["notes"]


def _short(value: float) -> str:
    """Four significant digits, without an exponent."""
    return f"{float(f'{value:.4g}'):,.12g}"


def _few(names: list[str]) -> str:
    return ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")
