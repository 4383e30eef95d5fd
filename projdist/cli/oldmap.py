"""The command `oldmap`: its report, rectified scans and layers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from projdist import gis, plots
from projdist._typing import FloatArray
from projdist.applications.oldmaps import (
    MODELS,
    OUTLIERS,
    RECTIFIED_BY,
    OldMap,
    common_ground,
    old_map,
    read_control_points,
    rectify,
)
from projdist.cli import options as opt
from projdist.cli.errors import refuse, refusing, working
from projdist.cli.formats import drawing, present
from projdist.cli.number_format import fixed
from projdist.cli.pictures import PictureFile, PictureOptions, check_layer_options, check_libraries, picture_of
from projdist.cli.report import Column, Report, Table
from projdist.designs import mean_plane_map
from projdist.matrices import get_measure
from projdist.support import tell

SHEETS = (".tif", ".tiff")
LAYERS = (".gpkg",)


class OldMapFile:
    """Path and options of a rectified scan or of layers; invalid ones end the command with 2."""

    def __init__(
        self,
        output: str,
        *,
        image: str | None,
        by: str | None,
        resolution: str | None,
        overwrite: bool,
    ) -> None:
        self.path = opt.file_of_kind(output, (*SHEETS, *LAYERS), overwrite)
        self._overwrite = overwrite
        self._is_sheet = self.path.suffix.lower() in SHEETS
        allowed = list(RECTIFIED_BY) if self._is_sheet else [name for name in RECTIFIED_BY if name != "fit"]
        self._by = opt.choice("rectification", by, allowed) if by is not None else "fit" if self._is_sheet else "mdt"
        self._resolution = opt.number("resolution", resolution, 1e-6, 1e7, " of metres")
        if self._is_sheet:
            if image is None:
                refuse(f"Invalid output '{output}'. It needs a scan: --image FILE.")
            if self.path.exists() and Path(image).exists() and self.path.samefile(image):
                refuse(f"Invalid output '{output}'. It is the scan.")
            self._image = image
        else:
            for name, value in (("image", image), ("resolution", resolution)):
                if value is not None:
                    refuse(f"Invalid option '--{name}' for '{output}'. It is for pictures and rectified scans.")
        check_libraries(self.path)

    def save(self, found: OldMap) -> None:
        """Write the file, with a notice if it has no CRS; failure ends the command."""
        with drawing(self.path), working("Drawing"):
            if self._is_sheet:
                sheet = rectify(found, self._image, by=self._by, resolution=self._resolution)
                gis.save_sheet(sheet, self.path, crs=found.points.crs, overwrite=self._overwrite)
            else:
                gis.save_layers(gis.old_map_layers(found, by=self._by), self.path, overwrite=self._overwrite)
        if found.points.crs is None:
            tell(f"'{self.path}' has no CRS, but metres of a plane without a name; --crs states it.")


# ---- oldmaps -------------------------------------------------------------------------------------


_MEAN = "their mean"
_ROUNDING = 1e-12  # of a mean square


def refuse_twice(given: Sequence[str]) -> None:
    """Refuse a file that is given twice."""
    for name in given:
        if given.count(name) > 1:
            refuse(f"Invalid points file '{name}'. It must be given once.")


def several_report(given: Sequence[str], maps: Sequence[OldMap], by: str) -> Report:
    """Report with one row per rectified map, and one for their mean."""
    data = _measured(given, maps, by)
    rows = [*data["maps"], {"map": _MEAN, "distortion": data["mean"]["distortion"]}]
    own = np.mean([row["distortion"] for row in data["maps"]])
    return Report(
        title=f"{len(maps)} old maps, each after its {by}",
        tables=[Table(rows, _COLUMNS)],
        notes=[
            "Mean Dist_F^2: over the ground that all maps show, from the ground to a map, and from the mean to it. The "
            "mean is the map nearest to all: what they have in common.",
            f"In common is {100 * data['mean']['distortion'] / own:.3g} % of the maps' distortion."
            if own > _ROUNDING
            else "The maps have no distortion but what is rounding.",
        ],
        data=lambda: data,
        rows=lambda: rows,
    )


def _rounded(square: float) -> str:
    return f"{square if square > _ROUNDING else 0.0:.4g}"


_COLUMNS: list[Column | str] = [
    "map",
    Column("points", show="{:,}".format),
    Column("left_out", "left out", "{:,}".format),
    Column("distortion", "mean Dist_F^2", _rounded),
    Column("from_mean", "from the mean", _rounded),
]


def _measured(given: Sequence[str], maps: Sequence[OldMap], by: str) -> dict[str, Any]:
    """JSON of several maps: their figures and their mean map."""
    ground = common_ground(maps, by=by)
    mean = mean_plane_map(ground.x, ground.y, ground.jacobians, area=ground.area)
    nearest = mean.jacobian(ground.x, ground.y)

    def mean_square(jacobian: FloatArray) -> float:
        return float(ground.area @ get_measure("fisher")(jacobian) ** 2)

    rows = [
        {
            "map": name,
            "points": len(one.points.old),
            "left_out": len(one.points.old) - len(one.fitted.old),
            "distortion": mean_square(field),
            "from_mean": mean_square(nearest @ np.linalg.inv(field)),
        }
        for name, one, field in zip(given, maps, ground.jacobians, strict=True)
    ]
    return {"by": by, "maps": rows, "mean": {"distortion": mean_square(nearest)} | mean.to_dict()}


# ---- oldmap --------------------------------------------------------------------------------------


PANELS = ("tissot", "heatmap", "rotation", "scale", "grid")
DRAWN_MEASURES = ("fisher", "areal_scale")
_USUAL = 4  # panels, if none is named
_SHOWN = 20  # names in a line


def oldmap_command(
    points: list[str] = opt.argument(
        "POINTS...",
        "Control points: [id], x and y on the old map, x and y in truth in metres; or columns x_old, y_old, "
        "x_new, y_new; or QGIS's, ArcGIS's link tables, or GDAL's -gcp. Files of several maps of one region are "
        "compared with their mean.",
    ),
    model: str = opt.option(MODELS, "What is fitted to the points.", "tps"),
    smoothing: str | None = opt.option(
        "NUMBER", "Of tps: 0 interpolates; without it, by generalized cross-validation."
    ),
    outliers: str = opt.option(OUTLIERS, "Leave wrong points, which are named, out of the fit.", "drop"),
    crs: str | None = opt.option(
        "PROJECTION",
        "The plane of the truth, given as its coordinates or as longitudes and latitudes to be projected; by "
        "default the CRS that the file states.",
    ),
    scan_dpi: str | None = opt.option("NUMBER", "Dots per inch of the scan, for denominators of scales."),
    image: str | None = opt.option("FILE", "The scan, to draw on, or to rectify."),
    by: str | None = opt.option(
        RECTIFIED_BY,
        "The map that rectifies the scan, fit if not given; for displacements, isolines and several maps the "
        "linear map that is taken out first, mdt if not given.",
    ),
    resolution: str | None = opt.option("METRES", "Of the rectified scan's pixels; about the scan's if not given."),
    draw: list[str] | None = opt.option(
        PANELS, "A panel; may be repeated, or with commas. The first four if none. Rotations count clockwise."
    ),
    measure: str = opt.option(DRAWN_MEASURES, "What the heat map shows.", "fisher", *opt.MEASURE),
    format: opt.Format = "table",
    output: str | None = opt.output(
        "Picture: .png, .svg or .pdf; rectified scan: .tif; displacements and isolines: .gpkg."
    ),
    *,
    pictured: PictureOptions,
) -> None:
    """Measure the distortion of an old map by control points, or of several and what they have in common."""
    form = opt.format_of(format)
    fitted = _fitting(crs, model=model, smoothing=smoothing, outliers=outliers, scan_dpi=scan_dpi)
    drawn: dict[str, Any] = {"draw": draw, "measure": None if measure == "fisher" else measure}
    of_pictures = {f"--{name}": value for name, value in drawn.items()} | pictured.given()
    if len(points) > 1:
        of_one = {"--output": output, "--image": image, "--resolution": resolution} | of_pictures
        opt.refuse_given({name: value or None for name, value in of_one.items()}, "It is for one.", " for several maps")
        refuse_twice(points)
        present(_compared(points, fitted, by or "mdt"), form)
        return
    panels = _panels(draw, measure)
    written: OldMapFile | PictureFile | None
    if _is_for_gis(output):
        check_layer_options(Path(str(output)), of_pictures)
        written = OldMapFile(str(output), image=image, by=by, resolution=resolution, overwrite=pictured.overwrite)
    else:
        of_layers = {"--by": by, "--resolution": resolution}
        opt.refuse_given(of_layers, "It needs a sheet or layers to write: -o FILE.tif or FILE.gpkg.")
        beside = (*SHEETS, *LAYERS)
        drawn |= {"image": image}
        written = picture_of(output, pictured, beside=beside, **drawn)
    with refusing():
        found = fitted(points[0])
    if isinstance(written, OldMapFile):
        written.save(found)
    elif written is not None:
        written.save(plots.old_map_figure, found, draw=panels, measure=measure, image=image)
    present(_report(found, points[0], written), form)


# ---- what is asked for ----------------------------------------------------------------------


def _fitting(
    crs: str | None, *, model: str, smoothing: str | None, outliers: str, scan_dpi: str | None
) -> Callable[[str], OldMap]:
    """Function from a file of control points to a fitted old map; invalid options end the command."""
    opt.choice("model", model, MODELS)
    opt.choice("outliers", outliers, OUTLIERS)
    options: dict[str, Any] = {
        "model": model,
        "smoothing": opt.number("smoothing", smoothing, 0.0, 1e9),
        "outliers": outliers,
        "dots_per_inch": opt.number("scan dpi", scan_dpi, 1.0, 1e5),
    }
    return lambda points: old_map(read_control_points(points, crs=crs), **options)


def _panels(draw: Sequence[str] | None, measure: str) -> Sequence[str]:
    """Panels to draw, by default the first ones; invalid ones end the command."""
    opt.choice("measure", measure, DRAWN_MEASURES)
    panels = [opt.choice("panel", word.strip(), list(PANELS)) for text in draw or [] for word in text.split(",")]
    return panels or PANELS[:_USUAL]


def _is_for_gis(output: str | None) -> bool:
    """True if the output is a rectified scan or layers."""
    return output is not None and Path(output).suffix.lower() in (*SHEETS, *LAYERS)


# ---- what is printed ------------------------------------------------------------------------


def _compared(points: Sequence[str], fitted: Callable[[str], OldMap], by: str) -> Report:
    """Report of several maps."""
    with refusing(), working("Fitting"):
        return several_report(points, [fitted(one) for one in points], by)


def _report(found: OldMap, given: str, written: PictureFile | OldMapFile | None) -> Report:
    data = found.to_dict()
    rectifications = [{"map": _NAMES[name]} | row for name, row in data["rectifications"].items()]
    return Report(
        title=f"{given}: {len(found.points.old)} control points, {found.fit.model}",
        tables=[Table(rectifications, [*_columns(data["dots_per_inch"] is not None)])],
        notes=[*_notes(data), f"Modes of the distortion after the MDT: {found.modes.summary}."],
        data=lambda: data,
        rows=lambda: data["points"],
        written=[written.path if written else None],
    )


_NAMES = {"mdt": "MDT", "affine": "affine, least squares", "helmert": "Helmert, least squares"}


def _columns(scanned: bool) -> Iterator[Column | str]:
    """Columns of the rectifications."""
    yield "map"
    yield Column("distortion", "mean Dist_F^2", lambda value: f"{round(value, 12):.4g}")
    yield Column("residual", "RMS at points,", _short, unit="m")
    yield Column("scale", "m per unit", "{:.5g}".format)
    yield Column("scale_error", "±", "{:.2g}".format)
    if scanned:
        yield Column("denominator", "scale 1 :", _short)
    yield Column("stretch", show="{:.5g}".format)
    yield Column("stretch_azimuth", "its azimuth", _degrees)
    yield Column("shear", show=_degrees)
    yield Column("rotation", show=_degrees)
    yield Column("rotation_error", "±", "{:.2g}".format)


def _notes(data: dict[str, Any]) -> list[str]:
    """Notes on the fit, its folds and outliers."""
    lines = [f"The fit has {data['freedom']:.4g} parameters a coordinate"]
    if data["smoothing"] is not None:
        lines[0] += f", with the smoothing {data['smoothing']:.4g}"
    left_out = data["residual_left_out"]
    lines[0] += f"; the points are {_short(data['residual'])} m off it (RMS)"
    lines[0] += "." if left_out is None else f", each {_short(left_out)} m off where the others have it."
    spreads = [
        (name, *(f"{round(data['statistics'][name][key], 9) + 0.0:.3g}" for key in ("p05", "p95")))
        for name in data["statistics"]
    ]
    told = ", ".join(f"{name.replace('_', ' ')} {low} to {high}" for name, low, high in spreads)
    lines.append(f"After the MDT, on nine tenths of the area: {told} degrees.")
    lines.append("Rotation: degrees by which the old map is turned clockwise, its vertical to the west of north.")
    lines.append("±: standard errors by the points' residuals; those of affine and Helmert take distortion for errors.")
    folds = data["folds"]
    if folds["near"]:
        share = f"{100 * folds['share']:.3g} % of the area ({_short(folds['area'])} square units)"
        lines.append(f"The fit folds on {share}, near {_few(folds['near'])}. The figures leave that out.")
    else:
        lines.append("The fit has no folds.")
    if data["outliers"]:
        left_out = ", left out of the fit" if data["outliers_left_out"] else ""
        lines.append(f"Outliers{left_out}, the farthest first: {_few(data['outliers'])}.")
    return lines + data["notes"]


def _degrees(value: float) -> str:
    return fixed(value, 2)


def _short(value: float) -> str:
    """Four significant digits, without an exponent."""
    return f"{float(f'{value:.4g}'):,.12g}"


def _few(names: list[str]) -> str:
    return ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")
