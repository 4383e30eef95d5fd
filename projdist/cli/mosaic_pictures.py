"""Output of the command `mosaic`: the mosaic, its georeference, and figures of its frames."""

from __future__ import annotations

import copy
import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer

from projdist import gis, plots
from projdist.applications.mosaics import (
    BLENDS,
    DEEP_SUFFIXES,
    DEPTHS,
    EXPOSURES,
    PICTURE_SUFFIXES,
    Canvas,
    Georeference,
    MappedPanorama,
    MeanGeoreference,
    Mosaic,
    Picture,
    Rendered,
    mean_georeference,
    read_world_file,
    render,
    save_mosaic,
    world_file,
    write_world_file,
)
from projdist.cli import options as opt
from projdist.cli.errors import fail, refuse, refusing
from projdist.cli.formats import drawing
from projdist.cli.pictures import PictureFile, check_libraries

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
            "blend": opt.choice("blend", blend, list(BLENDS)),
            "exposure": opt.choice("exposure", exposure, list(EXPOSURES)),
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
            return render(found, self._pictures, **self._options)
        except ImportError as error:
            refuse(str(error), error)
        except ValueError as error:
            fail(str(error))
            raise typer.Exit(1) from error
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
        target.save(functools.partial(plots.mosaic_figure, found, pictures or None))


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
