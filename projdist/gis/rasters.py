"""Rasters of measures, as arrays and as GeoTIFFs; the home of rasterio."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from projdist._typing import FloatArray
from projdist.field import jacobian, measure_at
from projdist.gis.grids import GRIDS, Coordinates, OnPlane, Pixels, graticule_grid, pixels, plane_extent
from projdist.gis.libraries import needed_for
from projdist.matrices import Measure, get_measure
from projdist.projections import Plane, Projection, ProjectionLike, plane_of, same_map
from projdist.regions import Place, RegionLike, region_for
from projdist.support import replacing

RASTER_SUFFIXES = (".tif", ".tiff")

_INSTEAD = "the raster is in longitude and latitude."
_AT_ONCE = 1_000_000  # pixels; 200 MB


@dataclass(frozen=True, kw_only=True)
class Raster:
    """Measures at the centres of pixels: `values` (bands, rows, columns), NaN outside the map and the region.

    `wkt` is the CRS, `flavour` how GDAL writes it in a GeoTIFF; `note` says why it is not the map's own
    where that was asked for, or what else there is to know, else "".
    """

    projection: Projection
    measures: tuple[Measure, ...]
    values: FloatArray
    pixels: Pixels
    wkt: str
    flavour: str
    note: str


def raster(
    projection: ProjectionLike,
    measures: Iterable[str | Measure] = ("fisher",),
    *,
    region: RegionLike | None = None,
    grid: str = "map",
    size: int | tuple[int, int] | None = None,
    resolution: float | None = None,
) -> Raster:
    """Measures on pixels of the map's own CRS, or of longitude and latitude where `grid` is "lonlat".

    A map that has no CRS that a GeoTIFF can hold, or no inverse, is laid on longitude and latitude.
    `size` is the pixels of the longer side or (columns, rows), `resolution` the side of a pixel in
    the CRS's unit. Raises ValueError for options that are none and a region without any value,
    ProjectionError, and ImportError without rasterio.
    """
    projection = Projection.from_user_input(projection)
    if grid not in GRIDS:
        raise ValueError(f"Invalid grid '{grid}'. It must be {' or '.join(GRIDS)}.")
    chosen = tuple(dict.fromkeys(_named(measure) for measure in measures))
    area = region_for(region, [projection])
    plane, flavour, note = _held_plane(projection) if grid == "map" else (None, FLAVOURS[0], "")
    coordinates: Coordinates
    if plane is not None:
        found = pixels(plane_extent(projection, plane, area), len(chosen), size, resolution)
        coordinates = OnPlane(projection, plane, min(found.width, found.height))
        values = _values(projection, chosen, area, coordinates, found)
        if not np.isfinite(values).any():
            note = f"PROJ's inverse of {projection.name} leads to other points; {_INSTEAD}"
            plane, flavour = None, FLAVOURS[0]
    if plane is None:
        coordinates, extent = graticule_grid(projection, area)
        found = pixels(extent, len(chosen), size, resolution)
        values = _values(projection, chosen, area, coordinates, found)
        if not np.isfinite(values).any():
            raise ValueError(
                f"Invalid region '{area.name}'. No pixel's centre in it has a value; it needs smaller pixels."
            )
    return Raster(
        projection=projection,
        measures=chosen,
        values=values,
        pixels=found,
        wkt=coordinates.wkt,
        flavour=flavour,
        note=note,
    )


def _named(measure: str | Measure) -> Measure:
    """A measure by the name it was asked for, which is its band's."""
    found = get_measure(measure)
    if not isinstance(measure, str) or measure == found.name:
        return found
    return replace(found, name=measure)


def _values(
    projection: Projection, measures: tuple[Measure, ...], region: Place, coordinates: Coordinates, grid: Pixels
) -> FloatArray:
    values = np.full((len(measures), grid.rows, grid.columns), np.nan)
    step = max(1, _AT_ONCE // grid.columns)
    for first in range(0, grid.rows, step):
        last = min(first + step, grid.rows)
        lon, lat = coordinates.places(*grid.centres(first, last))
        inside = np.isfinite(lon)
        inside[inside] = region.contains(lon[inside], lat[inside])
        lon, lat = lon[inside], lat[inside]
        J = jacobian(projection, lon, lat)
        for band, measure in zip(values, measures, strict=True):
            found = measure_at(projection, measure, lon, lat, J)
            band[first:last][inside] = np.where(np.isfinite(found), found, np.nan)
    return values


# ---- GeoTIFF --------------------------------------------------------------------------------


FLAVOURS = ("STANDARD", "ESRI_PE")  # of GeoTIFF keys: the second holds more, Equal Earth for one, and fewer read it
BESIDE = ".aux.xml"  # where GDAL puts what a GeoTIFF cannot hold


def _held_plane(projection: Projection) -> tuple[Plane | None, str, str]:
    """The CRS of a map, how a GeoTIFF can hold it, and a note; None where it cannot, or has no inverse."""
    plane = plane_of(projection)
    if plane is None:
        return None, FLAVOURS[0], f"{projection.name} has no CRS; {_INSTEAD}"
    if not plane.has_inverse:
        return None, FLAVOURS[0], f"{projection.name} has no inverse in PROJ; {_INSTEAD}"
    flavour = flavour_of(projection, plane)
    if flavour is not None:
        return plane, flavour, ""
    if _is_held(projection, plane, FLAVOURS[0], beside=True):
        return (
            plane,
            FLAVOURS[0],
            f"A GeoTIFF has no room for the CRS of {projection.name}; it is in the {BESIDE} file.",
        )
    return None, FLAVOURS[0], f"A GeoTIFF cannot hold the CRS of {projection.name}; {_INSTEAD}"


def flavour_of(projection: Projection, plane: Plane) -> str | None:
    """How a GeoTIFF can hold the CRS of a map by itself; None where it cannot."""
    return next((flavour for flavour in FLAVOURS if _is_held(projection, plane, flavour, beside=False)), None)


def _is_held(projection: Projection, plane: Plane, flavour: str, beside: bool) -> bool:
    """Whether the CRS read back from a GeoTIFF, and from what may lie beside it, is the same map."""
    with needed_for("raster"):
        import rasterio
        import rasterio.errors
    options = {"driver": "GTiff", "width": 1, "height": 1, "count": 1, "dtype": "uint8"}
    transform = rasterio.Affine(2, 0, 0, 0, -2, 0)
    try:
        crs = rasterio.CRS.from_wkt(plane.wkt)
        with rasterio.Env(GDAL_PAM_ENABLED=beside), rasterio.MemoryFile() as file:
            with file.open(crs=crs, transform=transform, GEOTIFF_KEYS_FLAVOR=flavour, **options):
                pass
            with file.open() as image:
                found = image.crs.to_wkt() if image.crs else ""
    except (rasterio.errors.CRSError, rasterio.errors.RasterioError):
        return False
    return bool(found) and same_map(projection, found) is not None


def save_raster(raster: Raster, path: str | os.PathLike[str], *, overwrite: bool = True) -> Path:
    """Write a raster as GeoTIFF: 64-bit floats, a band a measure with its name and unit, NaN as nodata.

    The file is whole or not there; a CRS that it has no room for is in a second one, `.aux.xml`, as
    GDAL has it. Raises FileExistsError where there is one and it is not to be
    overwritten, ImportError without rasterio.
    """
    path = Path(path)
    if path.suffix.lower() not in RASTER_SUFFIXES:
        raise ValueError(f"Invalid raster file '{path}'. Its suffix must be {' or '.join(RASTER_SUFFIXES)}.")
    with needed_for(f"output '{path}'"):
        import rasterio
    with (
        replacing(path, overwrite=overwrite, beside=[path.suffix + BESIDE]) as new,
        rasterio.open(
            new,
            "w",
            driver="GTiff",
            width=raster.pixels.columns,
            height=raster.pixels.rows,
            count=len(raster.measures),
            dtype="float64",
            nodata=np.nan,
            crs=rasterio.CRS.from_wkt(raster.wkt),
            transform=rasterio.Affine(*raster.pixels.transform),
            compress="deflate",
            predictor=3,
            BIGTIFF="IF_SAFER",
            GEOTIFF_KEYS_FLAVOR=raster.flavour,
        ) as image,
    ):
        image.update_tags(TIFFTAG_SOFTWARE="projdist", projection=raster.projection.definition)
        for number, measure in enumerate(raster.measures, start=1):
            image.write(raster.values[number - 1], number)
            image.set_band_description(number, measure.name)
            image.set_band_unit(number, measure.unit)
    return path
