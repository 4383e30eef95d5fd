"""The command `mosaic`: mosaics of images or map sheets in a common plane, and panoramas on maps of the sphere."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import typer

from projdist import gis, plots
from projdist.applications.mosaics import (
    BLENDS,
    CHOICES,
    DEEP_SUFFIXES,
    DEPTHS,
    EXPOSURES,
    FOCALS,
    FRAMES,
    PICTURE_SUFFIXES,
    Canvas,
    Correspondences,
    Georeference,
    MappedPanorama,
    MeanGeoreference,
    Mosaic,
    Panorama,
    Picture,
    Rendered,
    check_frame,
    correspondences_of,
    map_of_sphere,
    match,
    mean_georeference,
    mosaic,
    mosaics_of_groups,
    open_pictures,
    panorama,
    panoramas_of_groups,
    parse_sizes,
    read_correspondences,
    read_world_file,
    render,
    save_mosaic,
    world_file,
    write_world_file,
)
from projdist.cli import options as opt
from projdist.cli.errors import fail, failing, progress_bar, refuse, refusing, working
from projdist.cli.formats import JSON, drawing, json_text, present, put
from projdist.cli.pictures import GraphOptions, PictureFile, check_libraries
from projdist.cli.report import Column, Report, Table
from projdist.matrices import ROTATIONS
from projdist.projections import ProjectionLike

# Usual projections of panoramas; plate carrée is called spherical elsewhere.
_USUAL = {
    "eqc": "plate carrée",
    "merc": "Mercator",
    "cc": "cylindrical",
    "stere": "stereographic",
    "gnom": "plane (gnomonic)",
}
_TOLERANCE = 1e-4  # of figures of three digits


def present_panoramas(
    points: Correspondences,
    *,
    projection: str | None,
    focal: str,
    tolerance: float,
    most_pixels: float,
    all_groups: bool,
    target: MosaicFile | None,
    report: Path | None,
    overwrite: bool,
    form: str,
) -> None:
    """Adjust the cameras, choose the projection, draw and print; failure ends the command with 1."""
    options: dict[str, Any] = {"focal": focal, "tolerance": tolerance}
    with failing(), working("Adjusting"):
        groups = panoramas_of_groups(points, **options) if all_groups else [panorama(points, **options)]
    with failing(), working("Finding the projection"):
        mapped = [_mapped(found, projection, most_pixels) for found in groups]
        results = [_result(found) for found in mapped]
    targets = [] if target is None else [target.of_group(number) for number in range(len(groups))]
    for found, result, picture in zip(mapped, results, targets, strict=False):
        result["picture"] = picture.save_panorama(found)
    data = {"mosaics": results} if all_groups else results[0]
    if report is not None:
        put(json_text(data), report, overwrite)
    present(_panorama_report(results, data, [*(one.path for one in targets), report]), form)
    for note in dict.fromkeys(note for found in groups for note in found.messages(others=not all_groups)):
        fail(note)
    for one in mapped:
        if note := one.canvas().note:
            fail(note)
    if groups[0].alone if all_groups else groups[0].left_out:
        raise typer.Exit(1)


def _mapped(found: Panorama, projection: str | None, most_pixels: float) -> MappedPanorama:
    """Panorama on the requested projection, or on the one that distorts the visible part of the sphere least."""
    if projection is not None:
        return found.mapped(projection, most_pixels=most_pixels)
    from projdist.decisions import optimize  # slow to load

    best = optimize("auto", found, criterion="airy_kavrayskiy_scaled", ellipsoid="sphere")
    return found.mapped(best.projection, most_pixels=most_pixels)


def _result(found: MappedPanorama) -> dict[str, Any]:
    """JSON of a panorama: cameras, projection, and errors of the usual projections."""
    from projdist.answers import compare  # slow to load

    radius = found.projection.ellipsoid.a
    usual = {f"+proj={name} +R={radius}": words for name, words in _USUAL.items()}
    names = usual | {found.projection.definition: "this one"}
    maps: list[ProjectionLike] = [found.projection, *(usual.keys() - {found.projection.definition})]
    others = compare(maps, found.panorama, tolerance=_TOLERANCE)
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
    return found.panorama.to_dict() | {
        "projection": found.projection.definition,
        "projections": rows,
        "canvas": {"width": canvas.width, "height": canvas.height, "scale": canvas.scale},
    }


def _panorama_report(results: list[dict[str, Any]], data: dict[str, Any], written: Sequence[Path | None]) -> Report:
    tables = [table for result in results for table in (_cameras(result), _projections(result))]
    counts = " and ".join(str(len(one["images"]) - len(one["left_out"])) for one in results)
    rows = [row for result in results for row in _cameras(result).rows]
    return Report(
        title=f"{counts} images, rotation",
        tables=tables,
        notes=[note for result in results for note in _panorama_notes(result)],
        data=lambda: data,
        rows=lambda: rows,
        header=["image"],
        written=written,
    )


def _cameras(result: dict[str, Any]) -> Table:
    """One row per image: where its camera points."""
    keys = {"longitude": "longitudes", "latitude": "latitudes", "roll": "rolls", "focal": "focals"}
    rows = [
        {"image": image} | {key: result[column][row] for key, column in keys.items()}
        for row, image in enumerate(result["images"])
        if result["focals"][row] is not None
    ]
    angles = [Column(key, show="{:.2f}".format, unit="(°)") for key in ("longitude", "latitude", "roll")]
    return Table(rows, ["image", *angles, Column("focal", show="{:.1f}".format, unit="(pixels)")])


def _projections(result: dict[str, Any]) -> Table:
    """One row per projection: its error over the visible part of the sphere."""
    columns: list[Column | str] = [
        Column("projection", left=True),
        Column("airy_kavrayskiy_scaled", "Airy-Kavrayskiy error", "{:.3g}".format, best=True),
        Column("coverage", "shown", "{:.0%}".format),
    ]
    return Table(result["projections"], columns)


def _panorama_notes(result: dict[str, Any]) -> list[str]:
    canvas = result["canvas"]
    focals = [value for value in result["focals"] if value is not None]
    errors = [value for value in result["focal_errors"] if value is not None]
    one = max(focals) - min(focals) < 1e-9 * max(focals)
    focal = f"Focal length {focals[0]:.1f} ± {errors[0]:.1g} pixels" if one else "Focal lengths as they are above"
    rms = f"the points fit to {result['rms_pixels']:.3g} pixels RMS"
    notes = [f"{focal}; {rms} ({result['rms_pixels_of_homographies']:.3g} with a homography a pair)."]
    notes.append(f"Projection: {result['projection']}.")
    if "picture" in result:
        return notes + picture_notes(result["picture"])
    return [*notes, f"The panorama has {canvas['width']} x {canvas['height']} pixels."]


# ---- mosaic --------------------------------------------------------------------------------------


_MODELS = (*CHOICES, "rotation")
_FIGURES = {
    "affine": "Dist_F of each image in the plane of one of them and in that of the MDT; below, the sum of squares.",
    "homography": "Dist_F of each image, RMS over it; below, the mean of squares. -: an image reaches infinity.",
}


def mosaic_command(
    images: list[str] | None = opt.argument(
        "IMAGE...", "Overlapping pictures or map sheets, in any format that Pillow reads.", None
    ),
    correspondences: str | None = opt.option(
        "FILE",
        "Points in common, in place of those that are found in the images: CSV with model,i,j,xi,yi,xj,yj in pixels.",
    ),
    sizes: str | None = opt.option(
        "WxH,...",
        "Pixels of the images where there are none, one for all or one each; else a comment line of FILE has them.",
    ),
    model: str = opt.option(
        _MODELS,
        "The maps of the images; auto: affine maps or homographies, as the points ask for; rotation: a camera "
        "that only turns, drawn in a map projection of the sphere that it sees.",
        "affine",
    ),
    projection: str | None = opt.option(
        "PROJECTION", "That of --model rotation; if not given the one that distorts least what was seen."
    ),
    focal: str | None = opt.option(FOCALS, "For --model rotation: one focal length for all images, or one each."),
    frame: str = opt.option(f"{'|'.join(FRAMES)}|INDEX", "The common frame: the MDT's, or an image's plane.", "mdt"),
    rotation: str = opt.option(ROTATIONS, "How the MDT's frame is turned.", "chordal"),
    tolerance: str = opt.option(
        "PIXELS", "Points farther off are wrong; pixels of what is looked at: of photos, 2.4 million.", "4"
    ),
    weights: str | None = opt.option("NUMBERS", "Weights of the images, with commas."),
    output: str | None = opt.output("The mosaic to draw: .png, .tif, or .jpg."),
    blend: str | None = opt.option(
        BLENDS,
        "How images overlap: by bands of frequencies along seams where they differ least, by weights that "
        "fall to their rims, or later ones on earlier ones. multiband if not given.",
    ),
    exposure: str | None = opt.option(
        EXPOSURES,
        "Make images equally bright (gain), their parts, too, as vignettes need (blocks), or leave them.",
    ),
    depth: str | None = opt.option(
        map(str, DEPTHS),
        "Bits a colour of the mosaic. 8 if not given; with 16 images of 12 or 16 bits keep their values.",
    ),
    crop: bool = opt.flag("--crop", "Crop the mosaic to the largest box without gaps."),
    all_groups: bool = opt.flag(
        "--all", "A mosaic of each group of images that hang together: FILE, FILE-2, and so on."
    ),
    pixels: str = opt.option("NUMBER", "The most pixels of the mosaic.", "1e8"),
    compare: str | None = opt.option("FILE", "Figure to draw of all frames side by side: .png, .svg or .pdf."),
    format: opt.Format = "table",
    report: str | None = opt.option("FILE", "Report to write, JSON."),
    *,
    pictured: GraphOptions,
) -> None:
    """Bring overlapping images or map sheets into the common frame that distorts them least."""
    form = opt.format_of(format)
    if compare is None:
        opt.refuse_given(pictured.given(), "It needs a figure to draw: --compare FILE.")
    options: dict[str, Any] = {
        "model": opt.choice("model", model, _MODELS),
        "rotation": opt.choice("rotation", rotation, ROTATIONS),
        "tolerance": opt.number("tolerance", tolerance, 1e-3, 1e4, " of pixels"),
        "most_pixels": opt.number("pixels", pixels, 1e3, 4e8),
        "weights": None if weights is None else [opt.number("weight", word, 0.0, 1e12) for word in weights.split(",")],
    }
    if output is None:
        drawn = {"--blend": blend, "--exposure": exposure, "--depth": depth, "--crop": crop or None}
        opt.refuse_given(drawn, "It needs a mosaic to draw: -o FILE.")
    turning = options["model"] == "rotation"
    _refuse_others(turning, {"--projection": projection, "--focal": focal}, frame, weights, compare)
    path = opt.printed_or_file(report, pictured.overwrite)
    opt.format_for(None, path, [JSON])
    with refusing():
        if projection is not None:
            map_of_sphere(projection)
        pictures = open_pictures(images or [])
        given = _given(pictures, correspondences, sizes, "auto" if turning else options["model"])
        count = len(pictures) if given is None else len(given.sizes)
        options["frame"] = check_frame(frame, count)
        if all_groups and not isinstance(options["frame"], str):
            raise ValueError(f"Invalid frame '{frame}'. With --all it must be {', '.join(FRAMES)}.")
        if weights is not None and len(options["weights"]) != count:
            raise ValueError(f"Invalid weights '{weights}'. There must be {count}, one an image.")
    target = None
    if output is not None:
        words = {"blend": blend or BLENDS[0], "exposure": exposure or EXPOSURES[0], "depth": depth or "8"}
        target = MosaicFile(output, pictures, **words, crop=crop, overwrite=pictured.overwrite, sheets=not turning)
    figure = None if compare is None else PictureFile(compare, pictured)
    points = _matched(pictures) if given is None else given
    if turning:
        present_panoramas(
            points,
            projection=projection,
            focal=opt.choice("focal", focal or FOCALS[0], FOCALS),
            tolerance=options["tolerance"],
            most_pixels=options["most_pixels"],
            all_groups=all_groups,
            target=target,
            report=path,
            overwrite=pictured.overwrite,
            form=form,
        )
        return
    with failing(), working("Adjusting"):
        groups = mosaics_of_groups(points, **options) if all_groups else [mosaic(points, **options)]
    numbers = range(len(groups))
    mosaics = [] if target is None else [target.of_group(number) for number in numbers]
    figures = [] if figure is None else [figure_of_group(figure, number) for number in numbers]
    results = [found.to_dict() for found in groups]
    for found, result, picture in zip(groups, results, mosaics, strict=False):
        result["picture"] = picture.save(found)
    for found, result, target_figure in zip(groups, results, figures, strict=False):
        draw_frames(found, pictures, target_figure)
        result["compare"] = str(target_figure.path)
    if path is not None:
        put(json_text(_data(results, all_groups)), path, pictured.overwrite)
    written = [*(one.path for one in mosaics), *(one.path for one in figures), path]
    present(_report(results, all_groups, written), form)
    left_out = groups[0].alone if all_groups else groups[0].left_out
    for note in dict.fromkeys(note for found in groups for note in found.messages(others=not all_groups)):
        fail(note)
    if left_out:
        raise typer.Exit(1)


def _refuse_others(
    turning: bool, own: dict[str, str | None], frame: str, weights: str | None, compare: str | None
) -> None:
    """Refuse options of panoramas for mosaics, and vice versa."""
    if turning:
        planar = {"--frame": frame if frame != "mdt" else None, "--weights": weights, "--compare": compare}
        opt.refuse_given(planar, "A panorama has no frame in a plane; it has a --projection.")
    else:
        opt.refuse_given(own, "It needs a camera that only turns: --model rotation.")


def _matched(pictures: Sequence[Picture]) -> Correspondences:
    """Correspondences found in the pictures."""
    with failing(), progress_bar("images and pairs matched") as progress:
        return match(pictures, progress=progress)


def _given(
    pictures: Sequence[Picture], correspondences: str | None, sizes: str | None, model: str
) -> Correspondences | None:
    """Correspondences of a file, None if they are to be found in the pictures."""
    if pictures and sizes is not None:
        raise ValueError(f"Invalid sizes '{sizes}'. The images have their own.")
    if correspondences is None:
        if len(pictures) < 2:
            raise ValueError(f"Invalid images. There must be two or more, not {len(pictures)}.")
        return None
    if pictures:
        return correspondences_of(pictures, correspondences, model=model)
    return read_correspondences(correspondences, model=model, sizes=None if sizes is None else parse_sizes(sizes))


def _data(results: list[dict[str, Any]], all_groups: bool) -> dict[str, Any]:
    """JSON of one mosaic, or of all groups."""
    return {"mosaics": results} if all_groups else results[0]


def _report(results: list[dict[str, Any]], all_groups: bool, written: Sequence[Path | None]) -> Report:
    tables = [_table(result, all_groups) for result in results]
    rows = [row for table in tables for row in table.rows if row["image"] != "all"]
    counts = " and ".join(str(len(one["images"]) - len(one["left_out"])) for one in results)
    notes = [note for result in results for note in _notes(result)]
    return Report(
        title=f"{counts} images, {results[0]['model']}",
        tables=tables,
        notes=[_FIGURES[results[0]["model"]], *notes],
        data=lambda: _data(results, all_groups),
        rows=lambda: rows,
        header=["image"],
        written=written,
    )


def _table(result: dict[str, Any], own_images: bool) -> Table:
    """One row per image; with several groups only the group's own images."""
    rows = [
        {"image": image} | {frame: of_images and of_images[row] for frame, of_images in result["distortions"].items()}
        for row, image in enumerate(result["images"])
        if result["matrices"][row] is not None or not own_images
    ]
    references = {frame: f"{frame} ({image})" for frame, image in result["references"].items()}
    columns: list[Column | str] = ["image"]
    columns += [Column(frame, references.get(frame, ""), "{:.4g}".format) for frame in result["frames"]]
    return Table([*rows, {"image": "all"} | result["frames"]], columns)


def _notes(result: dict[str, Any]) -> Iterator[str]:
    if result["impossible"]:
        count = f"{len(result['impossible'])} of {len(result['images']) - len(result['left_out'])} images"
        yield f"The planes of {count} send others through infinity."
    canvas = result["canvas"]
    yield (
        f"Frame {result['frame']}: {canvas['width']} x {canvas['height']} pixels; the points fit to "
        f"{result['rms_pixels']:.3g} pixels RMS; mean resultant length {result['resultant_length']:.4f}."
    )
    if "picture" in result:
        yield from picture_notes(result["picture"])


# ---- what is written -----------------------------------------------------------------------------


_GEOTIFF = (".tif", ".tiff")


class MosaicFile:
    """Path and drawing options of a mosaic; invalid ones end the command with 2."""

    def __init__(
        self,
        output: str,
        pictures: Sequence[Picture],
        *,
        blend: str,
        exposure: str,
        depth: str,
        crop: bool,
        overwrite: bool,
        sheets: bool,
    ) -> None:
        """Check the options; `sheets` tells if images may be georeferenced."""
        if not pictures:
            refuse(f"Invalid output '{output}'. A mosaic is drawn from images, and there are none.")
        self.path = opt.file_of_kind(output, PICTURE_SUFFIXES, overwrite, "picture file")
        if any(one.path is not None and self.path.exists() and self.path.samefile(one.path) for one in pictures):
            refuse(f"Invalid output '{output}'. It is one of the images.")
        self._options: dict[str, Any] = {
            "blend": opt.choice("blend", blend, BLENDS),
            "exposure": opt.choice("exposure", exposure, EXPOSURES),
            "depth": int(opt.choice("depth", depth, [str(bits) for bits in DEPTHS])),
            "crop": crop,
        }
        if self._options["depth"] > 8 and self.path.suffix.lower() not in DEEP_SUFFIXES:
            refuse(f"Invalid output '{output}'. For 16 bits a colour its suffix must be .png, .tif or .tiff.")
        self._pictures, self._overwrite = pictures, overwrite
        with refusing():
            self._sheets = [_georeference(picture) if sheets else None for picture in pictures]
        self._world = None
        if any(self._sheets):
            if self.path.suffix.lower() in _GEOTIFF:
                check_libraries(self.path)
            else:
                self._world = opt.output_file(str(world_file(self.path)), overwrite)

    def of_group(self, number: int) -> MosaicFile:
        """The file of a group of images: FILE, FILE-2, ..."""
        new = copy.copy(self)
        new.path = _of_group(self.path, number, self._overwrite)
        if self._world is not None:
            new._world = _of_group(self._world, number, self._overwrite)
        return new

    def save(self, found: Mosaic) -> dict[str, Any]:
        """Draw and write the mosaic; returns its entry in the report."""
        drawn = self._drawn(found)
        canvas = drawn.canvas
        place = self._place(found, canvas) if isinstance(canvas, Canvas) else None
        with drawing(self.path):
            self._write(drawn, place)
        matrices = canvas.matrices.tolist() if isinstance(canvas, Canvas) else None
        sheet = None if place is None else {**place._asdict(), "matrix": place.matrix.tolist()}
        return self._written(drawn) | {"matrices": matrices, "georeference": sheet}

    def save_panorama(self, found: MappedPanorama) -> dict[str, Any]:
        """Draw and write a panorama; returns its entry in the report."""
        drawn = self._drawn(found)
        with drawing(self.path):
            save_mosaic(drawn, self.path, overwrite=self._overwrite)
        return self._written(drawn) | {"georeference": None}

    def _written(self, drawn: Rendered) -> dict[str, Any]:
        return {"file": str(self.path), "width": drawn.canvas.width, "height": drawn.canvas.height}

    def _drawn(self, found: Mosaic | MappedPanorama) -> Rendered:
        """Rendered mosaic; failure ends the command."""
        try:
            with failing():
                return render(found, self._pictures, **self._options)
        except MemoryError as error:
            refuse(f"Invalid picture '{self.path}'. It needs more memory than there is: take fewer --pixels.", error)

    def _place(self, found: Mosaic, canvas: Canvas) -> MeanGeoreference | None:
        sheets = [self._sheets[image] for image in found.images]
        try:
            return mean_georeference(canvas, found.registration.sizes, sheets)
        except ValueError as error:
            fail(f"{error} The mosaic has none.")
            return None

    def _write(self, drawn: Rendered, place: MeanGeoreference | None) -> None:
        if place is not None and self._world is None:
            gis.save_geotiff(drawn.bands, self.path, place, overwrite=self._overwrite)
            return
        save_mosaic(drawn, self.path, overwrite=self._overwrite)
        if place is not None and self._world is not None:
            write_world_file(self._world, place.matrix, overwrite=self._overwrite)


def figure_of_group(figure: PictureFile, number: int) -> PictureFile:
    """The figure of a group of images: FILE, FILE-2, ..."""
    new = copy.copy(figure)
    new.path = _of_group(figure.path, number, figure.overwrite)
    return new


def _of_group(path: Path, number: int, overwrite: bool) -> Path:
    return opt.output_file(str(path.with_stem(f"{path.stem}-{number + 1}")), overwrite) if number else path


def draw_frames(found: Mosaic, pictures: Sequence[Picture], target: PictureFile) -> None:
    """Draw the frames side by side, with the images or, without any, their outlines."""
    with refusing():
        target.save(plots.mosaic_figure, found, pictures or None)


def picture_notes(written: dict[str, Any]) -> list[str]:
    """Notes on the written mosaic."""
    notes = [f"The mosaic has {written['width']} x {written['height']} pixels."]
    place = written["georeference"]
    if place is not None:
        notes.append(
            f"Georeference: the mean of {place['sheets']} sheets by least squares of their corners, which are "
            f"{place['rms']:.4g} off (RMS, in the coordinates' unit)."
        )
    return notes


def _georeference(picture: Picture) -> Georeference | None:
    """Georeference of a sheet, by GDAL if rasterio is installed, else by its world file."""
    if picture.path is None or picture.is_turned:
        return None
    own = read_world_file(picture.path)
    try:
        return gis.georeference_of(picture.path) or own
    except ImportError:
        return own
