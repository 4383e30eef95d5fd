"""Map sheets with a georeference: what GDAL knows of them, and GeoTIFFs of their mosaics."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import numpy as np

from projdist._typing import AnyArray
from projdist.applications.mosaics import Georeference, MeanGeoreference
from projdist.applications.oldmaps import RectifiedScan
from projdist.gis.layers import needed_for
from projdist.gis.rasters import FLAVOURS, flavour_of
from projdist.projections import Projection, ProjectionLike, projected_crs_of
from projdist.support import one_line, replacing


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
    pixels: AnyArray,
    path: str | os.PathLike[str],
    place: Georeference | MeanGeoreference,
    *,
    flavour: str = FLAVOURS[0],
    overwrite: bool = True,
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
        "GEOTIFF_KEYS_FLAVOR": flavour,
    }
    with replacing(Path(path), overwrite=overwrite) as new:
        try:
            with rasterio.open(new, "w", **options) as file:
                file.write(np.moveaxis(pixels, 2, 0))
                file.colorinterp = [*colours, ColorInterp.alpha]
        except RasterioError as error:
            raise OSError(one_line(error)) from error


def save_sheet(
    sheet: RectifiedScan,
    path: str | os.PathLike[str],
    *,
    crs: ProjectionLike | None = None,
    overwrite: bool = True,
) -> Path:
    """Write the rectified scan of an old map as a GeoTIFF in the CRS of its control points.

    Without a CRS its coordinates are metres of a plane without a name. Raises ValueError for a map that is no CRS, or
    none that a GeoTIFF can hold, FileExistsError, OSError, and ImportError without rasterio.
    """
    place, flavour = place_of_sheet(sheet, crs)
    save_geotiff(sheet.pixels, path, place, flavour=flavour, overwrite=overwrite)
    return Path(path)


def place_of_sheet(sheet: RectifiedScan, crs: ProjectionLike | None) -> tuple[Georeference, str]:
    """Where a sheet lies in the coordinates of a CRS, and how a GeoTIFF holds that."""
    matrix = np.array([[sheet.side, 0.0, sheet.left], [0.0, -sheet.side, sheet.top], [0.0, 0.0, 1.0]])
    if crs is None:
        return Georeference(matrix, ""), FLAVOURS[0]
    projection = Projection.from_user_input(crs)
    plane = projected_crs_of(projection)
    flavour = None if plane is None else flavour_of(projection, plane)
    if plane is None or flavour is None:
        raise ValueError(f"Invalid CRS '{projection.label}'. A GeoTIFF has no room for it.")
    matrix[:2] = np.linalg.solve(plane.to_metres, matrix[:2])
    return Georeference(matrix, plane.wkt), flavour
