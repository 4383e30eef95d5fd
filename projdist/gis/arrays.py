"""Measures as arrays of xarray, with coordinates and CRS."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from projdist.answers import Factors, factors
from projdist.gis.layers import needed_for
from projdist.gis.rasters import raster
from projdist.matrices import Measure, get_measure
from projdist.projections import ProjectionLike, cf_attributes
from projdist.regions import RegionLike

if TYPE_CHECKING:
    import xarray

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
    mapping, x_attributes, y_attributes = cf_attributes(found.wkt)
    width, _, left, _, height, top = found.pixels.transform
    mapping["GeoTransform"] = " ".join(map(repr, (left, width, 0.0, top, 0.0, height)))
    return xarray.Dataset(
        {
            measure.name: (("y", "x"), values, _attributes(measure) | {"grid_mapping": _MAPPING})
            for measure, values in zip(found.measures, found.values, strict=True)
        },
        coords={
            "x": ("x", x[0], x_attributes),
            "y": ("y", y[:, 0], y_attributes),
            _MAPPING: ((), 0, mapping),
        },
        attrs={"projection": found.projection.definition} | ({"note": found.note} if found.note else {}),
    )


def factor_arrays(
    projection: ProjectionLike,
    lon: xarray.DataArray,
    lat: xarray.DataArray,
    *,
    measures: Iterable[str | Measure] = (),
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
    found = factors(projection, lon.values.ravel(), lat.values.ravel(), measures=measures)
    columns = {name: values.reshape(lat.shape) for name, values in found.columns().items()}
    return xarray.Dataset(
        {name: (lat.dims, values, _column_attributes(found, name)) for name, values in columns.items()},
        coords=lat.coords,
        attrs={"projection": found.projection.definition},
    )


def _column_attributes(found: Factors, name: str) -> dict[str, str]:
    """The attributes of a column of factors."""
    if name in ("x", "y"):
        return {"units": "metre"}
    return {} if name == "quality" or name in found.extra else _attributes(get_measure(name))


def _attributes(measure: Measure) -> dict[str, str]:
    """The attributes of a measure by the CF conventions."""
    return {"units": measure.unit or "1", "long_name": measure.description}
