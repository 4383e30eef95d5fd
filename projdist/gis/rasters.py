"""Rasters of measures on a map's plane or on longitude and latitude: as GeoTIFFs, arrays of xarray, and map sheets."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from projdist import answers, earth, field, projections, support, surfaces
from projdist._typing import AnyArray, AnyPath, FloatArray
from projdist.applications.mosaics import Georeference
from projdist.applications.oldmaps import RectifiedScan
from projdist.gis.layers import needed_for
from projdist.matrices import Measure, get_measure
from projdist.projections import ProjectedCrs, Projection, ProjectionLike, projected_crs_of
from projdist.regions import Place, RegionLike, region_for

if TYPE_CHECKING:
    import xarray

GRIDS = ("map", "lonlat")
"""Names of the map's own CRS and of longitude and latitude as the CRS of a raster."""

DEFAULT_SIZE = 1000  # pixels of the longer side

_MOST_VALUES = 1e8  # of all bands; 800 MB
_WHOLE = 1e-9  # of a pixel: an extent that ends this near to a pixel's edge ends at it
# A pixel's centre is on the map if its inverse comes back within a share of a pixel, limited to shares of the Earth's
# radius: at least 6 mm, more than inverses lose, and at most 6 m, which limits pixels of several km.
_BACK, _BACK_LEAST, _BACK_MOST = 1e-3, 1e-9, 1e-6

Extent = tuple[float, float, float, float]
"""The smallest and largest coordinates along x and y: x0, y0, x1, y1."""


@dataclass(frozen=True)
class RasterPixels:
    """Rows from north to south of pixels `width` by `height` units from the corner at `left`, `top`."""

    left: float
    top: float
    width: float
    height: float
    rows: int
    columns: int

    @property
    def transform(self) -> tuple[float, float, float, float, float, float]:
        """The affine transformation from (column, row) to x, y, in the order of the package affine: a .. f."""
        return self.width, 0.0, self.left, 0.0, -self.height, self.top

    def centres(self, first: int, last: int) -> tuple[FloatArray, FloatArray]:
        """x, y of the centres of the pixels in rows `first` to `last` (excluded), shape (last - first, columns)."""
        x = self.left + (np.arange(self.columns) + 0.5) * self.width
        y = self.top - (np.arange(first, last) + 0.5) * self.height
        u, v = np.meshgrid(x, y)
        return u, v


def pixels(extent: Extent, bands: int, size: int | tuple[int, int] | None, resolution: float | None) -> RasterPixels:
    """The pixels of an extent, by `size` (of the longer side, or columns and rows) or by a side in the CRS's unit."""
    # The pixels of a longer side are square. Those of a `resolution` have edges on its multiples.
    x0, y0, x1, y1 = extent
    width, height = x1 - x0, y1 - y0
    if resolution is not None:
        if size is not None:
            raise ValueError(f"Invalid size '{size}' with resolution '{resolution:g}'. It must be one of the two.")
        if not 0.0 < resolution < np.inf:
            raise ValueError(f"Invalid resolution '{resolution}'. It must be a positive number of the CRS's units.")
        west, south = (float(np.floor(low / resolution + _WHOLE)) for low in (x0, y0))
        east, north = (float(np.ceil(high / resolution - _WHOLE)) for high in (x1, y1))
        _check_number((east - west) * (north - south) * bands, f"resolution '{resolution:g}'")
        corner, sides = (west * resolution, north * resolution), (resolution, resolution)
        return RasterPixels(*corner, *sides, int(north - south), int(east - west))
    if isinstance(size, tuple):
        columns, rows = size
        _check_number(columns * rows * bands, f"size '{columns},{rows}'")
        return RasterPixels(x0, y1, width / columns, height / rows, rows, columns)
    longer = DEFAULT_SIZE if size is None else size
    if longer < 1:
        raise ValueError(f"Invalid size '{longer}'. It must be a positive number of pixels.")
    side = max(width, height) / longer
    columns, rows = (max(1, int(np.ceil(length / side - _WHOLE))) for length in (width, height))
    _check_number(columns * rows * bands, f"size '{longer}'")
    left, top = 0.5 * (x0 + x1 - columns * side), 0.5 * (y0 + y1 + rows * side)
    return RasterPixels(left, top, side, side, rows, columns)


def _check_number(values: float, what: str) -> None:
    """Raise ValueError for too few or too many values."""
    if not 1 <= values <= _MOST_VALUES:
        raise ValueError(f"Invalid {what}. It makes {values:.3g} values; there must be 1 to {_MOST_VALUES:.0e}.")


def on_plane(
    projection: Projection, plane: ProjectedCrs, side: float, u: FloatArray, v: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Degrees of coordinates in a map's CRS, of pixels `side` units wide; NaN off the map."""
    radius = projection.ellipsoid.a / float(np.abs(plane.to_metres).max())
    tolerance = float(np.clip(_BACK * side, _BACK_LEAST * radius, _BACK_MOST * radius))
    return plane.inverse(u, v, tolerance)


# ---- rasters -------------------------------------------------------------------------------------

RASTER_SUFFIXES = (".tif", ".tiff")

_INSTEAD = "the raster is in longitude and latitude."
_AT_ONCE = 1_000_000  # pixels; 200 MB


@dataclass(frozen=True, kw_only=True)
class Raster:
    """Measures at the centres of pixels."""

    projection: Projection
    measures: tuple[Measure, ...]
    values: FloatArray  #: (bands, rows, columns), NaN outside the map and the region
    pixels: RasterPixels
    wkt: str  #: the CRS
    flavour: str  #: of the GeoTIFF keys
    note: str  #: why the CRS is not the map's own although that was requested, or another remark; else ""


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

    A map without an inverse, or without a CRS that a GeoTIFF can hold, is sampled on longitude and latitude. `size` is
    the number of pixels of the longer side or (columns, rows), `resolution` the side of a pixel in the CRS's unit.
    Raises ValueError for invalid options and a region without values, ProjectionError, ImportError without rasterio.
    """
    projection = Projection.from_user_input(projection)
    if grid not in GRIDS:
        raise ValueError(f"Invalid grid '{grid}'. It must be {' or '.join(GRIDS)}.")
    chosen = tuple(dict.fromkeys(_named(measure) for measure in measures))
    area = region_for(region, [projection])
    plane, flavour, note = _held_plane(projection) if grid == "map" else (None, FLAVOURS[0], "")
    if plane is not None:
        x0, x1, y0, y1 = surfaces.surface_of(projection, area).extent  # that of its picture where the map has no end
        x, y = np.linalg.solve(plane.to_metres, np.array([[x0, x0, x1, x1], [y0, y1, y0, y1]]))
        extent = float(x.min()), float(y.min()), float(x.max()), float(y.max())
        found, wkt = pixels(extent, len(chosen), size, resolution), plane.wkt
        places = functools.partial(on_plane, projection, plane, min(found.width, found.height))
        values = _values(projection, chosen, area, places, found)
        if not np.isfinite(values).any():
            note = f"PROJ's inverse of {projection.name} leads to other points; {_INSTEAD}"
            plane, flavour = None, FLAVOURS[0]
    if plane is None:
        graticule = projections.graticule_of(projection)

        def on_earth(u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
            """Degrees of coordinates; NaN beyond the poles, where outer pixels may lie."""
            lon, lat = graticule.angles.to_degrees(u, v)
            outside = np.abs(lat) > 90.0
            return np.where(outside, np.nan, earth.wrapped(lon)), np.where(outside, np.nan, lat)

        west, south, east, north = area.bounds
        (x0, x1), (y0, y1) = graticule.angles.from_degrees(np.array([west, east]), np.array([south, north]))
        extent = float(x0), float(y0), float(x1), float(y1)
        found, wkt = pixels(extent, len(chosen), size, resolution), graticule.wkt
        values = _values(projection, chosen, area, on_earth, found)
        if not np.isfinite(values).any():
            raise ValueError(
                f"Invalid region '{area.name}'. No pixel's centre in it has a value; it needs smaller pixels."
            )
    return Raster(
        projection=projection, measures=chosen, values=values, pixels=found, wkt=wkt, flavour=flavour, note=note
    )


def _named(measure: str | Measure) -> Measure:
    """A measure under the name that was requested, which becomes the name of its band."""
    return replace(get_measure(measure), name=measure) if isinstance(measure, str) else get_measure(measure)


_ToDegrees = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]


def _values(
    projection: Projection, measures: tuple[Measure, ...], region: Place, places: _ToDegrees, grid: RasterPixels
) -> FloatArray:
    """Measures at the centres of pixels, (bands, rows, columns), at `places` in degrees; NaN outside the region."""
    values = np.full((len(measures), grid.rows, grid.columns), np.nan)
    step = max(1, _AT_ONCE // grid.columns)
    for first in range(0, grid.rows, step):
        last = min(first + step, grid.rows)
        lon, lat = places(*grid.centres(first, last))
        inside = np.isfinite(lon)
        inside[inside] = region.contains(lon[inside], lat[inside])
        lon, lat = lon[inside], lat[inside]
        J = field.jacobian(projection, lon, lat)
        for band, measure in zip(values, measures, strict=True):
            found = field.measure_at(projection, measure, lon, lat, J)
            band[first:last][inside] = np.where(np.isfinite(found), found, np.nan)
    return values


# ---- GeoTIFF --------------------------------------------------------------------------------

# Of GeoTIFF keys; the second holds more CRSs, such as Equal Earth, but fewer programs read it.
FLAVOURS = ("STANDARD", "ESRI_PE")
BESIDE = ".aux.xml"  # suffix of the file where GDAL puts what a GeoTIFF cannot hold


def geotiff_options(shape: tuple[int, int, int], dtype: str, crs: Any, transform: Any, flavour: str) -> dict[str, Any]:
    """rasterio's options for a new GeoTIFF of bands, rows and columns."""
    count, height, width = shape
    size = {"width": width, "height": height, "count": count}
    place = {"crs": crs, "transform": transform, "GEOTIFF_KEYS_FLAVOR": flavour}
    return {"driver": "GTiff", "dtype": dtype, "compress": "deflate"} | size | place


def _held_plane(projection: Projection) -> tuple[ProjectedCrs | None, str, str]:
    """The plane of a map if it has an inverse and fits a GeoTIFF, the flavour of the keys, and a note."""
    plane = projected_crs_of(projection)
    if plane is None:
        return None, FLAVOURS[0], f"{projection.name} has no CRS; {_INSTEAD}"
    if not plane.has_inverse:
        return None, FLAVOURS[0], f"{projection.name} has no inverse in PROJ; {_INSTEAD}"
    flavour = flavour_of(projection, plane)
    if flavour is not None:
        return plane, flavour, ""
    if _is_held(projection, plane, FLAVOURS[0], beside=True):
        note = f"A GeoTIFF has no room for the CRS of {projection.name}; it is in the {BESIDE} file."
        return plane, FLAVOURS[0], note
    return None, FLAVOURS[0], f"A GeoTIFF cannot hold the CRS of {projection.name}; {_INSTEAD}"


def flavour_of(projection: Projection, plane: ProjectedCrs) -> str | None:
    """The flavour of GeoTIFF keys that can hold the CRS of a map; None if none can."""
    return next((flavour for flavour in FLAVOURS if _is_held(projection, plane, flavour, beside=False)), None)


def _is_held(projection: Projection, plane: ProjectedCrs, flavour: str, beside: bool) -> bool:
    """True if the CRS read back from a GeoTIFF, or from the file beside it, gives the same map."""
    with needed_for("raster"):
        import rasterio
        import rasterio.errors
    transform = rasterio.Affine(2, 0, 0, 0, -2, 0)
    try:
        options = geotiff_options((1, 1, 1), "uint8", rasterio.CRS.from_wkt(plane.wkt), transform, flavour)
        with rasterio.Env(GDAL_PAM_ENABLED=beside), rasterio.MemoryFile() as file:
            with file.open(**options):
                pass
            with file.open() as image:
                found = image.crs.to_wkt() if image.crs else ""
    except (rasterio.errors.CRSError, rasterio.errors.RasterioError):
        return False
    return bool(found) and projections.same_map(projection, found) is not None


def save_raster(raster: Raster, path: AnyPath, *, overwrite: bool = True) -> Path:
    """Write a raster as GeoTIFF, whole or not at all: 64-bit floats, a named band per measure, NaN as nodata.

    A CRS that a GeoTIFF cannot hold goes into a second file, `.aux.xml`, as GDAL does it. Raises FileExistsError for an
    existing file that is not to be overwritten, ImportError without rasterio.
    """
    path = Path(path)
    if path.suffix.lower() not in RASTER_SUFFIXES:
        raise ValueError(f"Invalid raster file '{path}'. Its suffix must be {' or '.join(RASTER_SUFFIXES)}.")
    with needed_for(f"output '{path}'"):
        import rasterio
    crs, transform = rasterio.CRS.from_wkt(raster.wkt), rasterio.Affine(*raster.pixels.transform)
    options = geotiff_options(raster.values.shape, "float64", crs, transform, raster.flavour)
    with (
        support.replacing(path, overwrite=overwrite, beside=[path.suffix + BESIDE]) as new,
        rasterio.open(new, "w", **options, nodata=np.nan, predictor=3, BIGTIFF="IF_SAFER") as image,
    ):
        image.update_tags(TIFFTAG_SOFTWARE="projdist", projection=raster.projection.definition)
        for number, measure in enumerate(raster.measures, start=1):
            image.write(raster.values[number - 1], number)
            image.set_band_description(number, measure.name)
            image.set_band_unit(number, measure.unit)
    return path


# ---- map sheets -----------------------------------------------------------------------------------


def georeference_of(path: AnyPath) -> Georeference | None:
    """The georeference that GDAL reads from an image or the world file beside it, None without one; ImportError."""
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
    pixels: AnyArray, path: AnyPath, place: Georeference, *, flavour: str = FLAVOURS[0], overwrite: bool = True
) -> None:
    """Write pixels (height, width, 2 or 4), alpha last, as a GeoTIFF; raises OSError, FileExistsError, ImportError."""
    with needed_for(f"output '{path}'"):
        import rasterio
        from rasterio.enums import ColorInterp
        from rasterio.errors import RasterioError
    bands, transform = np.moveaxis(pixels, 2, 0), rasterio.Affine(*place.matrix[:2].reshape(-1))
    grey, colours = [ColorInterp.gray], [ColorInterp.red, ColorInterp.green, ColorInterp.blue]
    photometric, interpreted = ("MINISBLACK", grey) if len(bands) == 2 else ("RGB", colours)
    options = geotiff_options(bands.shape, pixels.dtype.name, place.crs or None, transform, flavour)
    with support.replacing(Path(path), overwrite=overwrite) as new:
        try:
            with rasterio.open(new, "w", **options, tiled=True, photometric=photometric, alpha="YES") as file:
                file.write(bands)
                file.colorinterp = [*interpreted, ColorInterp.alpha]
        except RasterioError as error:
            raise OSError(support.one_line(error)) from error


def save_sheet(
    sheet: RectifiedScan, path: AnyPath, *, crs: ProjectionLike | None = None, overwrite: bool = True
) -> Path:
    """Write the rectified scan of an old map as a GeoTIFF in the CRS of its control points.

    Without a CRS its coordinates are metres of an unnamed plane. Raises ValueError for a map without a CRS, or with one
    that a GeoTIFF cannot hold, FileExistsError, OSError, and ImportError without rasterio.
    """
    matrix = np.array([[sheet.side, 0.0, sheet.left], [0.0, -sheet.side, sheet.top], [0.0, 0.0, 1.0]])
    place, flavour = Georeference(matrix, ""), FLAVOURS[0]
    if crs is not None:
        projection = Projection.from_user_input(crs)
        plane = projected_crs_of(projection)
        held = None if plane is None else flavour_of(projection, plane)
        if plane is None or held is None:
            raise ValueError(f"Invalid CRS '{projection.label}'. A GeoTIFF has no room for it.")
        matrix[:2] = np.linalg.solve(plane.to_metres, matrix[:2])
        place, flavour = Georeference(matrix, plane.wkt), held
    save_geotiff(sheet.pixels, path, place, flavour=flavour, overwrite=overwrite)
    return Path(path)


# ---- arrays --------------------------------------------------------------------------------------

_MAPPING = "spatial_ref"  # the name in rioxarray


def measure_arrays(
    projection: ProjectionLike,
    measures: str | Measure | Iterable[str | Measure] = ("fisher",),
    *,
    region: RegionLike | None = None,
    grid: str = "map",
    size: int | tuple[int, int] | None = None,
    resolution: float | None = None,
) -> xarray.Dataset:
    """Measures at the centres of pixels as a Dataset of xarray, as `raster`, with coordinates and CRS.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    measures : str, Measure, or iterable of them
        One variable each.
    region : RegionLike, optional
        Values outside are NaN; by default the area of use of a CRS, else the globe.
    grid : str
        "map" for the CRS of the map, "lonlat" for longitude and latitude.
    size : int or (int, int), optional
        Pixels of the longer side, or columns and rows; 1000 if not given.
    resolution : float, optional
        The side of a pixel in the unit of the CRS.

    Returns
    -------
    xarray.Dataset
        With the dimensions y, x, rows from north to south, and the CRS in the coordinate `spatial_ref`, following the
        CF conventions and rioxarray. The attribute `note` gives the reason if the CRS is not the map's.

    Raises
    ------
    ValueError
        As `raster` does.
    ProjectionError
        For an invalid projection.
    ImportError
        Without xarray or rasterio.

    References
    ----------
    NetCDF Climate and Forecast (CF) Metadata Conventions 1.11, section 5.6: grid mappings.

    Examples
    --------
    >>> import rasterio
    >>> import xarray
    >>> found = measure_arrays("EPSG:3035", ["omega", "s"], size=100)
    >>> found.omega.dims, found.omega.attrs["units"], found.sizes["x"]
    (('y', 'x'), 'deg', 100)
    """
    with needed_for("arrays"):
        import xarray
    chosen = [measures] if isinstance(measures, str | Measure) else measures
    found = raster(projection, chosen, region=region, grid=grid, size=size, resolution=resolution)
    x, y = found.pixels.centres(0, found.pixels.rows)
    mapping, x_attributes, y_attributes = projections.cf_attributes(found.wkt)
    width, _, left, _, height, top = found.pixels.transform
    mapping["GeoTransform"] = " ".join(map(repr, (left, width, 0.0, top, 0.0, height)))
    return xarray.Dataset(
        {
            measure.name: (("y", "x"), values, _attributes(measure) | {"grid_mapping": _MAPPING})
            for measure, values in zip(found.measures, found.values, strict=True)
        },
        coords={"x": ("x", x[0], x_attributes), "y": ("y", y[:, 0], y_attributes), _MAPPING: ((), 0, mapping)},
        attrs={"projection": found.projection.definition} | ({"note": found.note} if found.note else {}),
    )


def factor_arrays(
    projection: ProjectionLike, lon: xarray.DataArray, lat: xarray.DataArray, *, measures: Iterable[str | Measure] = ()
) -> xarray.Dataset:
    """The factors of a projection at points given as arrays of xarray, with their dimensions and coordinates.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    lon, lat : xarray.DataArray
        Degrees; broadcast by the names of dimensions, those of `lat` first.
    measures : iterable of str or Measure, or one of them
        Further measures besides the standard ones.

    Returns
    -------
    xarray.Dataset
        The columns that `factors` gives, as variables.

    Raises
    ------
    ValueError
        For points that are not DataArrays, and as `factors` does.
    ProjectionError
        For an invalid projection.
    ImportError
        Without xarray.

    Examples
    --------
    >>> import xarray
    >>> lat = xarray.DataArray([0.0, 60.0], dims="lat", coords={"lat": [0.0, 60.0]})
    >>> lon = xarray.DataArray([5.0, 10.0, 15.0], dims="lon", coords={"lon": [5.0, 10.0, 15.0]})
    >>> factor_arrays("mercator", lon, lat).k.sel(lat=60.0).round(9).values.tolist()
    [2.0, 2.0, 2.0]
    """
    with needed_for("arrays"):
        import xarray
    if not (isinstance(lon, xarray.DataArray) and isinstance(lat, xarray.DataArray)):
        raise ValueError("Invalid points. They must be longitudes and latitudes, two DataArrays of xarray.")
    lat, lon = xarray.broadcast(lat, lon)
    found = answers.factors(projection, lon.values.ravel(), lat.values.ravel(), measures=measures)
    known = {"x": {"units": "metre"}, "y": {"units": "metre"}, "quality": {}} | {name: {} for name in found.extra}
    variables = {}
    for name, values in found.columns().items():
        attributes = known[name] if name in known else _attributes(get_measure(name))
        variables[name] = (lat.dims, values.reshape(lat.shape), attributes)
    return xarray.Dataset(variables, coords=lat.coords, attrs={"projection": found.projection.definition})


def _attributes(measure: Measure) -> dict[str, str]:
    """The attributes of a measure by the CF conventions."""
    return {"units": measure.unit or "1", "long_name": measure.description}
