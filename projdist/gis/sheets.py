"""Map sheets with a georeference: what GDAL knows of them, and GeoTIFFs of their mosaics."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import numpy as np

from projdist._typing import AnyArray
from projdist.applications.mosaics import Georeference, MeanGeoreference
from projdist.gis.libraries import needed_for
from projdist.support import one_line, replacing

__all__ = ["georeference_of", "save_geotiff"]


def georeference_of(path: str | os.PathLike[str]) -> Georeference | None:
    """Where GDAL says that an image lies (a GeoTIFF, or a world file beside it), None where it does not.

    Raises ImportError without rasterio.
    """
    with needed_for(f"image '{path}'"):
        import rasterio
        from rasterio.errors import NotGeoreferencedWarning, RasterioIOError
    try:
        with warnings.catch_warnings(action="ignore", category=NotGeoreferencedWarning), rasterio.open(path) as image:
            transform, crs = image.transform, image.crs
    except RasterioIOError:  # Pillow reads more formats than GDAL
        return None
    if transform.is_identity or transform.is_degenerate:
        return None
    return Georeference(np.array(transform, dtype=float).reshape(3, 3), "" if crs is None else crs.to_wkt())


def save_geotiff(
    pixels: AnyArray, path: str | os.PathLike[str], place: MeanGeoreference, *, overwrite: bool = True
) -> None:
    """Write pixels (height, width, 2 or 4) with alpha as a GeoTIFF; raises OSError, FileExistsError, ImportError."""
    with needed_for(f"output '{path}'"):
        import rasterio
        from rasterio.enums import ColorInterp
        from rasterio.errors import RasterioError
    bands = pixels.shape[2]
    colours = [ColorInterp.gray] if bands == 2 else [ColorInterp.red, ColorInterp.green, ColorInterp.blue]
    options = {
        "driver": "GTiff",
        "width": pixels.shape[1],
        "height": pixels.shape[0],
        "count": bands,
        "dtype": pixels.dtype.name,
        "crs": place.crs or None,
        "transform": rasterio.Affine(*place.matrix[:2].reshape(-1)),
        "compress": "deflate",
        "tiled": True,
        "photometric": "MINISBLACK" if bands == 2 else "RGB",
        "alpha": "YES",
    }
    with replacing(Path(path), overwrite=overwrite) as new:
        try:
            with rasterio.open(new, "w", **options) as file:
                file.write(np.moveaxis(pixels, 2, 0))
                file.colorinterp = [*colours, ColorInterp.alpha]
        except RasterioError as error:
            raise OSError(one_line(error)) from error
