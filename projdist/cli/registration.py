"""The commands that bring images (`mosaic`) or point clouds (`clouds`) into a common frame."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from projdist import answers, decisions, gis, matrices, plots, projections, support
from projdist._typing import FloatArray
from projdist.applications import mosaics, pointclouds
from projdist.cli import options as opt
from projdist.cli.errors import fail, progress_bar, refuse, refusing, working
from projdist.cli.report import JSON, Column, Columns, Report, Table, drawing, emit, json_text, present
from projdist.cli.wording import rms_text

_MODELS = (*mosaics.CHOICES, "rotation")
_FIGURES = {
    "affine": "Dist_F of each image in the plane of one of them and in that of the MDT; below, the sum of squares.",
    "homography": "Dist_F of each image, RMS over it; below, the mean of squares. -: an image reaches infinity.",
}
# Usual projections of panoramas; plate carrée is called spherical elsewhere.
_USUAL = {
    "eqc": "plate carrée",
    "merc": "Mercator",
    "cc": "cylindrical",
    "stere": "stereographic",
    "gnom": "plane (gnomonic)",
}
_TOLERANCE = 1e-4  # of figures of three digits
_Group = mosaics.Mosaic | mosaics.Panorama
_Shown = mosaics.Mosaic | mosaics.MappedPanorama


@dataclass(frozen=True, kw_only=True)
class DrawnMosaic:
    """Options for drawing a mosaic."""

    blend: str | None = opt.option(
        mosaics.BLENDS,
        "How to blend images: in bands of frequencies along the seams where they differ least, by weights that "
        "fall towards their edges, or later images over earlier ones; multiband if not given.",
    )
    exposure: str | None = opt.option(
        mosaics.EXPOSURES,
        "Make images equally bright (gain), or also their parts, against vignettes (blocks), or leave them.",
    )
    depth: str | None = opt.option(
        map(str, mosaics.DEPTHS),
        "Bits per colour of the mosaic, 8 if not given; with 16, images of 12 or 16 bits keep their values.",
    )
    crop: bool = opt.flag("--crop", "Crop the mosaic to the largest box without gaps.")


def mosaic_command(
    images: list[str] | None = opt.argument(
        "IMAGE...", "Overlapping pictures or map sheets, in any format that Pillow reads.", None
    ),
    correspondences: str | None = opt.option(
        "FILE",
        "Points in common, instead of those found in the images: CSV with model,i,j,xi,yi,xj,yj in pixels.",
    ),
    sizes: str | None = opt.option(
        "WxH,...",
        "Pixel sizes if there are no images, one for all or one each; by default from a comment line of FILE.",
    ),
    model: str = opt.option(
        _MODELS,
        "The maps of the images; auto: affine maps or homographies, whichever suits the points; rotation: a camera "
        "that only turns, drawn in a map projection of the sphere that it sees.",
        "affine",
    ),
    projection: str | None = opt.option(
        "PROJECTION", "For --model rotation; by default the one that distorts least what was seen."
    ),
    focal: str | None = opt.option(
        mosaics.FOCALS, "For --model rotation: one focal length for all images, or one each."
    ),
    frame: str = opt.option(
        f"{'|'.join(mosaics.FRAMES)}|INDEX", "The common frame: the MDT's, or an image's plane.", "mdt"
    ),
    rotation: str = opt.option(matrices.ROTATIONS, "How to turn the MDT's frame.", "chordal"),
    tolerance: str = opt.option(
        "PIXELS", "Points farther off are wrong; in pixels of the images searched (photos: 2.4 megapixels).", "4"
    ),
    weights: str | None = opt.option("NUMBERS", "Weights of the images, with commas."),
    output: str | None = opt.output("The mosaic to draw: .png, .tif, or .jpg."),
    all_groups: bool = opt.flag("--all", "Draw a mosaic of each group of connected images: FILE, FILE-2 and so on."),
    pixels: str = opt.option("NUMBER", "The most pixels that the mosaic may have.", "1e8"),
    compare: str | None = opt.option("FILE", "Draw all frames side by side: .png, .svg or .pdf."),
    format: opt.Format = "table",
    report: str | None = opt.option("FILE", "Write a report: JSON."),
    *,
    drawn: DrawnMosaic,
    pictured: opt.GraphOptions,
) -> None:
    """Bring overlapping images or map sheets into the common frame that distorts them least."""
    form, turning = opt.format_of(format), opt.choice("model", model, _MODELS) == "rotation"
    if compare is None:
        opt.refuse_given(pictured.given(), "It needs a figure to draw: --compare FILE.")
    options: dict[str, Any] = {
        "model": model,
        "rotation": opt.choice("rotation", rotation, matrices.ROTATIONS),
        "tolerance": opt.number("tolerance", tolerance, 1e-3, 1e4, " of pixels"),
        "most_pixels": opt.number("pixels", pixels, 1e3, 4e8),
        "weights": None if weights is None else [opt.number("weight", word, 0.0, 1e12) for word in weights.split(",")],
    }
    if output is None:
        of_mosaics = {f"--{name}": value or None for name, value in vars(drawn).items()}
        opt.refuse_given(of_mosaics, "It needs a mosaic to draw: -o FILE.")
    if turning:
        planar = {"--frame": frame if frame != "mdt" else None, "--weights": weights, "--compare": compare}
        opt.refuse_given(planar, "A panorama has no frame in a plane; it has a --projection.")
    else:
        of_cameras = {"--projection": projection, "--focal": focal}
        opt.refuse_given(of_cameras, "It needs a camera that only turns: --model rotation.")
    path = opt.target(None, report, pictured.overwrite, [JSON]).path
    with refusing():
        if projection is not None:
            mosaics.map_of_sphere(projection)
        pictures = mosaics.open_pictures(images or [])
        points = _given(pictures, correspondences, sizes, "auto" if turning else model)
        count = len(pictures) if points is None else len(points.sizes)
        options["frame"] = mosaics.check_frame(frame, count)
        if all_groups and not isinstance(options["frame"], str):
            raise ValueError(f"Invalid frame '{frame}'. With --all it must be {', '.join(mosaics.FRAMES)}.")
        if weights is not None and len(options["weights"]) != count:
            raise ValueError(f"Invalid weights '{weights}'. There must be {count}, one per image.")
    target = None
    if output is not None:
        target = MosaicFile(output, pictures, drawn, overwrite=pictured.overwrite, sheets=not turning)
    figure = None if compare is None else opt.PictureFile(compare, pictured)
    if points is None:
        with refusing(code=1), progress_bar("images and pairs matched") as progress:
            points = mosaics.match(pictures, progress=progress)
    length = opt.choice("focal", focal or mosaics.FOCALS[0], mosaics.FOCALS) if turning else None
    groups, shown, results = _adjusted(points, options, all_groups, length, projection)
    files, figures = ([] if one is None else _of_groups(one, len(groups)) for one in (target, figure))
    for one, result, file in zip(shown, results, files, strict=False):
        result["picture"] = file.save(one)
    for one, result, of_group in zip(shown, results, figures, strict=False):
        with refusing():
            of_group.save(plots.mosaic_figure, one, pictures or None)
        result["compare"] = str(of_group)
    data = {"mosaics": results} if all_groups else results[0]
    if path is not None:
        emit(json_text(data), path, pictured.overwrite, told=False)
    present(_report(results, data, turning, all_groups, [*files, *figures, path]), form)
    for note in dict.fromkeys(note for one in groups for note in one.messages(others=not all_groups)):
        fail(note)
    for one in shown:
        if isinstance(one, mosaics.MappedPanorama) and (note := one.canvas().note):
            fail(note)
    if groups[0].alone if all_groups else groups[0].left_out:
        raise typer.Exit(1)


def _given(
    pictures: Sequence[mosaics.Picture], correspondences: str | None, sizes: str | None, model: str
) -> mosaics.Correspondences | None:
    """Correspondences of a file, None if they are to be found in the pictures."""
    if pictures and sizes is not None:
        raise ValueError(f"Invalid sizes '{sizes}'. The images have their own.")
    if correspondences is None:
        if len(pictures) < 2:
            raise ValueError(f"Invalid images. At least two are needed, not {len(pictures)}.")
        return None
    if pictures:
        return mosaics.correspondences_of(pictures, correspondences, model=model)
    given = None if sizes is None else mosaics.parse_sizes(sizes)
    return mosaics.read_correspondences(correspondences, model=model, sizes=given)


def _adjusted(
    points: mosaics.Correspondences, options: dict[str, Any], every: bool, focal: str | None, projection: str | None
) -> tuple[Sequence[_Group], Sequence[_Shown], list[dict[str, Any]]]:
    """Mosaics or, with a focal length, panoramas; what to draw of them; their JSON. Failure ends the command."""
    if focal is None:
        with refusing(code=1), working("Adjusting"):
            found = mosaics.mosaics_of_groups(points, **options) if every else [mosaics.mosaic(points, **options)]
        return found, found, [one.to_dict() for one in found]
    cameras: dict[str, Any] = {"focal": focal, "tolerance": options["tolerance"]}
    with refusing(code=1), working("Adjusting"):
        groups = mosaics.panoramas_of_groups(points, **cameras) if every else [mosaics.panorama(points, **cameras)]
    mapped = []
    with refusing(code=1), working("Finding the projection"):
        for one in groups:
            target: projections.ProjectionLike | None = projection
            if target is None:  # the one that distorts the visible part of the sphere least
                best = decisions.optimize("auto", one, criterion="airy_kavrayskiy_scaled", ellipsoid="sphere")
                target = best.projection
            mapped.append(one.mapped(target, most_pixels=options["most_pixels"]))
        return groups, mapped, [_panorama_result(one) for one in mapped]


def _report(
    results: list[dict[str, Any]], data: dict[str, Any], turning: bool, all_groups: bool, written: Sequence[object]
) -> Report:
    counts = " and ".join(str(len(one["images"]) - len(one["left_out"])) for one in results)
    if turning:
        model, tables, notes = "rotation", _panorama_tables(results), []
    else:
        model, tables = results[0]["model"], [_mosaic_table(result, all_groups) for result in results]
        notes = [_FIGURES[model]]
    for one in results:
        notes += [*(_panorama_notes if turning else _mosaic_notes)(one)]
        notes += _picture_notes(one["picture"]) if "picture" in one else []
    return Report(
        answer=[*map(_panorama_answer if turning else _mosaic_answer, results)],
        title=f"{counts} images, {model}",
        tables=tables,
        notes=notes,
        data=lambda: data,
        rows=lambda: [row for table in tables for row in table.rows if row.get("image", "all") != "all"],
        header=["image"],
        written=written,
    )


def _mosaic_answer(result: dict[str, Any]) -> str:
    """How much the images are distorted in their mean frame, and in that of the best image."""
    count = len(result["images"]) - len(result["left_out"])
    told = [
        f"in {words} by {rms_text((total / count) ** 0.5)}"
        for frame, words in (("mdt", "their mean frame (MDT)"), ("best", "the frame of the best one"))
        if (total := result["frames"].get(frame)) is not None
    ]
    fit = f"are distorted {support.listed(told, 'and')} (RMS)" if told else "have no frame"
    return f"{count} images {fit}."


def _mosaic_table(result: dict[str, Any], own_images: bool) -> Table:
    """One row per image; with several groups only the group's own images."""
    rows = [
        {"image": image} | {frame: of_images and of_images[row] for frame, of_images in result["distortions"].items()}
        for row, image in enumerate(result["images"])
        if result["matrices"][row] is not None or not own_images
    ]
    references = {frame: f"{frame} ({image})" for frame, image in result["references"].items()}
    columns = [Column(frame, references.get(frame, ""), "{:.4g}".format) for frame in result["frames"]]
    return Table([*rows, {"image": "all"} | result["frames"]], ["image", *columns])


def _mosaic_notes(result: dict[str, Any]) -> Iterator[str]:
    if result["impossible"]:
        count = f"{len(result['impossible'])} of {len(result['images']) - len(result['left_out'])} images"
        yield f"The planes of {count} send others through infinity."
    canvas = result["canvas"]
    yield (
        f"Frame {result['frame']}: {canvas['width']} x {canvas['height']} pixels; the points fit to "
        f"{result['rms_pixels']:.3g} pixels RMS; mean resultant length {result['resultant_length']:.4f}."
    )


def _picture_notes(written: dict[str, Any]) -> Iterator[str]:
    """Notes on the written mosaic."""
    yield f"The mosaic has {written['width']} x {written['height']} pixels."
    place = written["georeference"]
    if place is not None:
        yield (
            f"Georeference: the mean of {place['sheets']} sheets by least squares of their corners, which are "
            f"{place['rms']:.4g} off (RMS, in the coordinates' unit)."
        )


# ---- panoramas -----------------------------------------------------------------------------------


def _panorama_result(found: mosaics.MappedPanorama) -> dict[str, Any]:
    """JSON of a panorama: cameras, projection, and errors of the usual projections."""
    definition = found.projection.definition
    usual = {f"+proj={name} +R={found.projection.ellipsoid.a}": words for name, words in _USUAL.items()}
    names = usual | {definition: "this one"}
    maps: list[projections.ProjectionLike] = [found.projection, *(usual.keys() - {definition})]
    others = answers.compare(maps, found.panorama, tolerance=_TOLERANCE)
    rows = [
        {
            "projection": names.get(one.projection.definition, one.projection.name),
            "definition": one.projection.definition,
            "airy_kavrayskiy_scaled": one.airy_kavrayskiy_scaled,
            "coverage": one.coverage,
        }
        for one in others.results
    ]
    canvas = found.canvas()
    size = {"width": canvas.width, "height": canvas.height, "scale": canvas.scale}
    return found.panorama.to_dict() | {"projection": definition, "projections": rows, "canvas": size}


def _panorama_answer(result: dict[str, Any]) -> str:
    """How well the images fit, and the projection."""
    count = len(result["images"]) - len(result["left_out"])
    return f"{count} images fit to {result['rms_pixels']:.3g} pixels (RMS), in the projection {result['projection']}."


def _panorama_tables(results: Sequence[dict[str, Any]]) -> list[Table]:
    """For each panorama, where the camera points in each image, and errors of projections over the visible part."""
    *angles, focal = keys = ("longitude", "latitude", "roll", "focal")
    shown = [Column(key, f"{key} (°)", "{:.2f}".format) for key in angles]
    cameras: Columns = ["image", *shown, Column(focal, f"{focal} (pixels)", "{:.1f}".format)]
    error = Column("airy_kavrayskiy_scaled", "Airy-Kavrayskiy error", "{:.3g}".format, best=True)
    projections: Columns = ["projection", error, Column("coverage", "shown", "{:.0%}".format)]
    tables = []
    for result in results:
        cells = zip(result["images"], *(result[f"{key}s"] for key in keys), strict=True)
        rows = [dict(zip(("image", *keys), row, strict=True)) for row in cells if row[-1] is not None]
        tables += [Table(rows, cameras), Table(result["projections"], projections)]
    return tables


def _panorama_notes(result: dict[str, Any]) -> Iterator[str]:
    canvas = result["canvas"]
    focals = [value for value in result["focals"] if value is not None]
    errors = [value for value in result["focal_errors"] if value is not None]
    one = max(focals) - min(focals) < 1e-9 * max(focals)
    focal = f"Focal length {focals[0]:.1f} ± {errors[0]:.1g} pixels" if one else "Focal lengths as they are above"
    rms = f"the points fit to {result['rms_pixels']:.3g} pixels RMS"
    yield f"{focal}; {rms} ({result['rms_pixels_of_homographies']:.3g} with a homography a pair)."
    yield f"Projection: {result['projection']}."
    if "picture" not in result:
        yield f"The panorama has {canvas['width']} x {canvas['height']} pixels."


class MosaicFile(opt.OutputFile):
    """Path and drawing options of a mosaic; invalid ones end the command with 2."""

    def __init__(
        self, output: str, pictures: Sequence[mosaics.Picture], drawn: DrawnMosaic, *, overwrite: bool, sheets: bool
    ) -> None:
        """Check the options; with `sheets`, images may be georeferenced."""
        if not pictures:
            refuse(f"Invalid output '{output}'. A mosaic is drawn from images, and there are none.")
        super().__init__(opt.file_of_kind(output, mosaics.PICTURE_SUFFIXES, overwrite, "picture file"), overwrite)
        if any(one.path is not None and self.path.exists() and self.path.samefile(one.path) for one in pictures):
            refuse(f"Invalid output '{output}'. It is one of the images.")
        self._options: dict[str, Any] = {
            "blend": opt.choice("blend", drawn.blend or mosaics.BLENDS[0], mosaics.BLENDS),
            "exposure": opt.choice("exposure", drawn.exposure or mosaics.EXPOSURES[0], mosaics.EXPOSURES),
            "depth": int(opt.choice("depth", drawn.depth or "8", map(str, mosaics.DEPTHS))),
            "crop": drawn.crop,
        }
        if self._options["depth"] > 8 and self.path.suffix.lower() not in mosaics.DEEP_SUFFIXES:
            refuse(f"Invalid output '{output}'. For 16 bits a colour its suffix must be .png, .tif or .tiff.")
        self._pictures = pictures
        with refusing():
            self._sheets = [_georeference(picture) if sheets else None for picture in pictures]
        self.world = None
        if any(self._sheets):
            if self.path.suffix.lower() in opt.RASTER_SUFFIXES:
                opt.check_libraries(self.path)
            else:
                self.world = opt.output_file(str(mosaics.world_file(self.path)), overwrite)

    def save(self, found: _Shown) -> dict[str, Any]:
        """Draw and write the mosaic, in its place on Earth if it has one; returns its entry in the report."""
        try:
            with refusing(code=1):
                drawn = mosaics.render(found, self._pictures, **self._options)
        except MemoryError as error:
            refuse(f"Invalid picture '{self.path}'. It needs more memory than there is: take fewer --pixels.", error)
        canvas, place = drawn.canvas, None
        entry: dict[str, Any] = {"file": str(self.path), "width": canvas.width, "height": canvas.height}
        if isinstance(found, mosaics.Mosaic) and isinstance(canvas, mosaics.Canvas):
            entry["matrices"] = canvas.matrices.tolist()
            try:
                sheets = [self._sheets[image] for image in found.images]
                place = mosaics.mean_georeference(canvas, found.registration.sizes, sheets)
            except ValueError as error:
                fail(f"{error} The mosaic has none.")
        with drawing(self.path):
            if place is not None and self.world is None:
                gis.save_geotiff(drawn.bands, self.path, place, overwrite=self.overwrite)
            else:
                mosaics.save_mosaic(drawn, self.path, overwrite=self.overwrite)
            if place is not None and self.world is not None:
                mosaics.write_world_file(self.world, place.matrix, overwrite=self.overwrite)
        return entry | {"georeference": None if place is None else {**place._asdict(), "matrix": place.matrix.tolist()}}


def _of_groups(file: Any, count: int) -> list[Any]:
    """The mosaics or figures of groups of images: FILE, FILE-2, ..."""
    files = [file, *(copy.copy(file) for _ in range(count - 1))]
    for number, new in enumerate(files[1:], start=2):
        new.path = opt.output_file(str(file.path.with_stem(f"{file.path.stem}-{number}")), file.overwrite)
        if isinstance(new, MosaicFile) and new.world is not None:
            new.world = opt.output_file(str(mosaics.world_file(new.path)), new.overwrite)
    return files


def _georeference(picture: mosaics.Picture) -> mosaics.Georeference | None:
    """Georeference of a sheet, by GDAL if rasterio is installed, else by its world file."""
    if picture.path is None or picture.is_turned:
        return None
    own = mosaics.read_world_file(picture.path)
    try:
        return gis.georeference_of(picture.path) or own
    except ImportError:
        return own


# ---- clouds -------------------------------------------------------------------------------------


_FARTHEST = 3  # points named as the farthest off


def clouds_command(
    files: list[str] = opt.argument("FILE...", "Two or more clouds: .csv (any dimension), .xyz, .asc, .ply or .pcd."),
    frame: str = opt.option(
        "mdt|best|first|last|central|FILE|INDEX",
        "The common frame: the mean distorting transformation (MDT) of all, or the coordinates of one cloud: "
        "the one that distorts the others least, the first, the last, the middle one, or one by its name or "
        "number, from 1.",
        "mdt",
    ),
    correspond: str | None = opt.option(
        pointclouds.CORRESPONDENCES,
        "Which points correspond: those in equal rows, those with equal ids, or, if that is unknown, the closest "
        "ones of clouds that lie roughly right. By default id if all files have a column id, otherwise rows.",
    ),
    method: str = opt.option(
        pointclouds.FITS, "A fit that prefers no cloud and shrinks none, or least squares onto the first.", "symmetric"
    ),
    robust: bool = opt.flag("--robust", "Leave out points that do not match those with the same row or id."),
    weights: str | None = opt.option(
        "COLUMN|FILE",
        "Weights of the points: a column of the clouds' files, or a file with a number for each row, or id and "
        "number. 2 counts as two points, 0 as none. In a cloud without the column, points count like their partners.",
    ),
    format: opt.Format = "table",
    output: str | None = opt.output("Directory for the moved clouds, each in the format of its file.", metavar="DIR"),
    overwrite: opt.Overwrite = False,
) -> None:
    """Register point clouds or landmarks by affine maps, in the frame that distorts them least."""
    form = opt.format_of(format)
    opt.choice("method", method, pointclouds.FITS)
    if correspond is not None:
        opt.choice("correspondence", correspond, pointclouds.CORRESPONDENCES)
    targets = _targets(files, output, overwrite)
    with refusing():
        numbers = pointclouds.read_weights(weights) if weights is not None and Path(weights).is_file() else None
        if weights is not None and numbers is None and (Path(weights).suffix or len(Path(weights).parts) > 1):
            refuse(f"Invalid weights '{weights}'. There is no such file.")
        clouds = [pointclouds.read_cloud(file, weights=weights if numbers is None else None) for file in files]
        ids = [cloud.ids for cloud in clouds if cloud.ids is not None]
        if correspond is None:
            correspond = "id" if len(ids) == len(clouds) else "rows"
        if correspond == "id" and len(ids) < len(clouds):
            without = next(cloud.path for cloud in clouds if cloud.ids is None)
            refuse(f"Invalid cloud '{without}'. For the correspondence id it must be a .csv with a column id.")
        found = pointclouds.register(
            [cloud.points for cloud in clouds],
            correspond=correspond,
            ids=ids if correspond == "id" else None,
            frame=_frame_of(frame, files),
            method=method,
            names=files,
            robust=robust,
            weights=None if weights is None else _weights(clouds, numbers or weights, correspond),
        )
    if output is not None:
        folder, by_name = Path(output), dict(zip(targets, clouds, strict=True))
        with drawing(folder):
            folder.mkdir(exist_ok=True)
            for name, M, t in zip(found.names, found.matrices, found.shifts, strict=True):
                by_name[name].write(targets[name], M, t, overwrite=overwrite)
    present(_clouds_report(found, output), form)
    for told in (*(f"Left out '{one.name}': {one.reason}." for one in found.left_out), *found.warnings):
        fail(told)
    if found.left_out:
        raise typer.Exit(1)


def _weights(
    clouds: Sequence[pointclouds.CloudFile], given: pointclouds.WeightsFile | str, correspond: str
) -> list[FloatArray]:
    """Weights of each cloud, from the file or from a column."""
    if isinstance(given, str):
        return pointclouds.column_weights(clouds, given, correspond)
    if correspond == "icp":
        refuse(f"Invalid weights '{given.path}'. With the correspondence icp they must be a column of clouds.")
    return [given.numbers if correspond == "rows" else given.of_ids(cloud) for cloud in clouds]


def _frame_of(text: str, files: Sequence[str]) -> str | int:
    """Frame from a keyword, a file's name (with or without directory) or its number from 1."""
    if text.isdecimal():
        if not 1 <= int(text) <= len(files):
            refuse(f"Invalid frame '{text}'. There are {len(files)} clouds, from 1 on.")
        return int(text) - 1
    same = [file for file in files if Path(file).name == text]
    return same[0] if len(same) == 1 and text not in files else text


def _targets(files: Sequence[str], output: str | None, overwrite: bool) -> dict[str, Path]:
    """Output path of each cloud; refuses existing files without `overwrite`."""
    for file in files:
        if files.count(file) > 1:
            refuse(f"Invalid cloud '{file}'. It must be given once.")
    if output is None:
        return {}
    folder = Path(output)
    if folder.exists() and not folder.is_dir():
        refuse(f"Invalid output '{output}'. It must be a directory.")
    if not folder.parent.is_dir():
        refuse(f"Invalid output '{output}'. There is no directory '{folder.parent}'.")
    targets = {file: folder / Path(file).name for file in files}
    for file, target in targets.items():
        if list(targets.values()).count(target) > 1:
            refuse(f"Invalid cloud '{file}'. Another has its name, and '{output}' has room for one.")
        if target.exists() and target.samefile(file):
            refuse(f"Invalid output '{output}'. It holds the clouds themselves.")
        if not overwrite:
            with refusing():
                support.refuse_existing(target)
    return targets


def _clouds_report(found: pointclouds.Registration, output: str | None) -> Report:
    answer = found.to_dict()
    rows = [{name: value for name, value in row.items() if name not in ("matrix", "shift")} for row in answer["clouds"]]
    clouds = [
        Column("name", "cloud", left=True),
        Column("used", "points", of=lambda row: f"{row['used']} of {row['points']}"),
        Column("distortion", "Dist_F", "{:.6f}".format),
        Column("sum_as_frame", "as frame", "{:.6g}".format),
        Column("rms", show="{:.4g}".format),
    ]
    cloud = Column("cloud", "is", of=lambda row: row["cloud"] or "the mean of all", left=True)
    frames: Columns = ["frame", cloud, Column("sum", "sum of Dist_F^2", "{:.6g}".format)]
    notes = [
        "Dist_F: distortion of a cloud's matrix, 0 for a rotation; as frame: the sum of Dist_F^2 if all were "
        "brought to that cloud; rms: distance from the points' mean places in the frame. Matrices: --format json."
    ]
    far = sorted((one for each in found.worst for one in each), key=lambda one: -one.distance)[:_FARTHEST]
    if far:
        told = ", ".join(f"{one.point} of {Path(one.cloud).name} {one.distance:.3g}" for one in far)
        notes.append(f"Farthest from where the others have them, by the fit without them: {told}.")
    weighted = ", by weights" if answer["weighted"] else ""
    place = answer["reference"] or "their mean (MDT)"
    return Report(
        answer=[
            f"{len(rows)} clouds are brought to the frame of {place}: points lie {found.rms_total:.4g} from their mean "
            "places (RMS)."
        ],
        next={} if output else {"-o FOLDER": "To save the moved clouds, the same command with"},
        title=f"{len(rows)} clouds in {answer['dimension']} dimensions, by {found.correspond} ({found.method}), in the "
        f"frame {answer['reference'] or found.frame}{weighted}: rms {found.rms_total:.4g}",
        tables=[Table(rows, clouds), Table([{"frame": name, **one} for name, one in answer["frames"].items()], frames)],
        notes=[*notes, f"Modes, in which the clouds differ: {found.modes.summary}."],
        data=lambda: answer,
        written=[Path(output) if output else None],
    )
