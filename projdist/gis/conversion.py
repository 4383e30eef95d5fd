"""Conversion of data to another CRS, even one made by `design`: of layers by PROJ, of rasters by GDAL's warp."""

from __future__ import annotations

import contextlib
import os
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
import shapely

from projdist import projections, regions, support
from projdist._typing import AnyPath, FloatArray, IntArray
from projdist.gis import layers
from projdist.gis.rasters import BESIDE, FLAVOURS, RASTER_SUFFIXES, flavour_of, geotiff_options
from projdist.gis.reading import first_of, read_data
from projdist.projections import CRS, Projection, crs_of

RESAMPLINGS = ("nearest", "bilinear", "cubic", "average", "mode")
"""Methods for the values of new pixels."""

_PARTS = (".shx", ".dbf", ".prj", ".cpg")  # of a shapefile
CONVERTED_SUFFIXES = (".gpkg", ".fgb", ".shp", ".geojson", ".parquet", *RASTER_SUFFIXES)
"""Suffixes of the files that `convert` writes."""

_CRS_SUFFIXES = (".wkt", ".prj", ".json")
_METHOD = "PROJ-based operation method"  # in the WKT of CRSs that WKT 1 cannot express
_DEGREE_KM = 111.0  # along a meridian; 110.6 at the equator, 111.7 at the poles
_LOOKS = 21  # points along the side of a raster
_MOST_PIXELS, _MANY = 1e9, 100  # pixels, or times those of the source, as GDAL's warp cannot be interrupted
_MOST_PIECES = 1e7  # of edges; they take 1 GB and eight seconds


@dataclass(frozen=True, kw_only=True)
class Conversion:
    """Paths of the converted data and of their CRS in WKT, if that was written, and a note, or ""."""

    path: Path
    wkt: Path | None
    note: str


def convert(
    data: AnyPath,
    to: Any,
    output: AnyPath,
    *,
    source: Any = None,
    densify: float | None = None,
    resampling: str = "nearest",
    resolution: float | None = None,
    overwrite: bool = True,
) -> Conversion:
    """Convert a file of points, lines, polygons or pixels to another CRS.

    All formats except GeoParquet store a CRS made by `design` in an older WKT that other programs misread; projdist
    still reads it, except from GeoTIFFs. It is therefore also written to a `.wkt` file beside the data, and for a
    GeoTIFF to its `.aux.xml`. Data outside the area of use of the CRS are converted, with a notice.

    Parameters
    ----------
    data : str or path
        A GeoPackage, GeoJSON, FlatGeobuf, shapefile, GeoParquet or GeoTIFF; `#LAYER` behind it names a layer.
    to : str, path or pyproj.CRS
        The CRS: a code, WKT, a PROJ string, or a file with WKT such as `design` writes.
    output : str or path
        The new file: .gpkg, .geojson, .fgb, .shp, .parquet, .tif.
    source : str, path or pyproj.CRS, optional
        The CRS of the data, instead of the one in their file.
    densify : float, optional
        The longest edge in kilometres: longer ones are divided, so that they follow the curves of the new map. By
        default no vertices are added.
    resampling : str
        The method for the values of pixels, one of `RESAMPLINGS`.
    resolution : float, optional
        The side of a pixel in the unit of the CRS; by default about that of the data.
    overwrite : bool
        Replace an existing file.

    Returns
    -------
    Conversion
        The files written, and a note where the CRS is not safe in its file.

    Raises
    ------
    ValueError
        For data that cannot be read or have no CRS, an invalid CRS, and CRSs between which PROJ cannot convert.
    FileExistsError
        For an existing file that is not to be overwritten.
    ImportError
        Without the extra `gis`.

    References
    ----------
    OGC 18-010r11, Well-known text representation of coordinate reference systems (WKT2).

    Examples
    --------
    >>> import geopandas, tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> bern = geopandas.GeoDataFrame(geometry=geopandas.points_from_xy([7.43864], [46.95108]), crs="EPSG:4326")
    >>> bern.to_file(folder / "bern.geojson")
    >>> convert(folder / "bern.geojson", "EPSG:2056", folder / "bern.gpkg").note
    ''
    >>> geopandas.read_file(folder / "bern.gpkg").crs.name
    'CH1903+ / LV95'
    """
    path, target = Path(output), _crs(to)
    given = None if source is None else _crs(source)
    if path.suffix.lower() not in CONVERTED_SUFFIXES:
        raise ValueError(f"Invalid output '{path}'. Its suffix must be one of {', '.join(CONVERTED_SUFFIXES)}.")
    beside = _beside(path, target, overwrite)
    if path.suffix.lower() in RASTER_SUFFIXES:
        if densify is not None:
            raise ValueError(f"Invalid distance '{densify}' for '{path}'. Pixels have no edges to divide.")
        lost, note = _warp(os.fspath(data), target, path, given, resampling, resolution, overwrite)
    else:
        lost, note = _convert_layer(os.fspath(data), target, path, given, densify, overwrite), ""
    kept = ""
    if lost and beside is not None:
        with support.replacing(beside) as new:
            new.write_text(target.to_wkt(pretty=True) + "\n", encoding="utf-8")
        kept = f"It is in '{beside.name}'."
    return Conversion(path=path, wkt=beside if lost else None, note=" ".join(filter(None, (lost, kept, note))))


def convert_frame(frame: Any, to: Any, *, source: Any = None, densify: float | None = None) -> Any:
    """A GeoDataFrame in another CRS, as by `convert`; features that it cannot show lose their geometry."""
    target, given = _crs(to), frame.crs if source is None else source
    if given is None:
        raise ValueError("Invalid data. They have no CRS; it must be given (--from, source=).")
    frame = frame.set_crs(_crs(given), allow_override=True)
    projections.tell_of_frame_in_degrees(frame, "the data")
    points, owner = shapely.get_coordinates(frame.geometry.array, return_index=True)
    _tell_of_elsewhere(frame.crs, target, points, owner, "feature(s) of the data lie")
    if densify is not None:
        if not support.check_number("distance", densify) > 0.0:
            raise ValueError(f"Invalid distance '{densify}'. It must be above 0, in kilometres.")
        # Degrees are taken along meridians.
        length = densify / _DEGREE_KM * np.radians(1.0) if frame.crs.is_geographic else 1000.0 * densify
        piece = float(length / frame.crs.axis_info[0].unit_conversion_factor)
        count = float(np.nansum(shapely.length(frame.geometry.array)) / piece)
        if count > _MOST_PIECES:
            raise ValueError(
                f"Invalid distance '{densify}'. It makes {count:.3g} pieces; at most {_MOST_PIECES:g} are allowed."
            )
        frame = frame.set_geometry(shapely.segmentize(frame.geometry.array, piece), crs=frame.crs)
    try:
        moved = frame.to_crs(target)
    except RuntimeError as error:  # PROJ's
        raise ValueError(_NO_WAY.format(frame.crs.name, target.name)) from error
    points, owner = shapely.get_coordinates(moved.geometry.array, return_index=True)
    lost = np.unique(owner[~np.isfinite(points).all(axis=1)])
    if lost.size:
        if lost.size == np.unique(owner).size:
            raise ValueError(_NO_WAY.format(frame.crs.name, target.name))
        shown = first_of((lost + 1).tolist())
        support.tell(
            f"{lost.size} feature(s) cannot be drawn in {target.name}, and are left without a geometry: {shown}."
        )
        shapes = np.asarray(moved.geometry.array).copy()
        shapes[lost] = None
        moved = moved.set_geometry(shapes).set_crs(target)
    return moved


def _tell_of_elsewhere(source: CRS, target: CRS, points: FloatArray, owner: IntArray, things: str) -> None:
    """Warn of things with most of their points (n, 2), in the CRS of the data, outside the target's area of use."""
    is_for_place = target.area_of_use is not None and _is_map(target) and len(points) > 0
    area = Projection.from_user_input(target).area_of_use if is_for_place else None
    if area is None:
        return
    box, in_degrees = regions.Box(*area), projections.to_lonlat(source)
    lon, lat = points.T if in_degrees is None else in_degrees(*points.T)
    outside = np.isfinite(lon) & np.isfinite(lat) & ~box.contains(lon, lat)
    mostly = np.bincount(owner, outside) > np.bincount(owner) / 2
    if mostly.any():
        count = f"{mostly.sum()} of {np.unique(owner).size}"
        support.tell(f"{target.name} is for {box.name}: {count} {things} mostly outside its area of use.")


def _is_map(crs: CRS) -> bool:
    """True for a projected CRS, also one with a method of PROJ's own."""
    return bool(crs.is_projected or _METHOD in crs.to_wkt())


_NO_WAY = "Invalid CRS '{}'. PROJ has no way from it to '{}' for these data; a lost CRS is named by --from (source=)."


def _crs(given: Any) -> CRS:
    """The CRS of a user's input, which may be a file with WKT; raises ValueError."""
    path = Path(given) if isinstance(given, str | os.PathLike) else None
    if path is None or path.suffix.lower() not in _CRS_SUFFIXES or "[" in str(path):
        return crs_of(given)
    try:
        return crs_of(path.read_text(encoding="utf-8-sig").strip())
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"Invalid CRS '{path}'. It cannot be read as text: {support.one_line(error)}.") from error


def _beside(path: Path, target: CRS, overwrite: bool) -> Path | None:
    """The .wkt file for a CRS that the data's format spoils, or None; FileExistsError if it has another CRS."""
    if _METHOD not in target.to_wkt() or path.suffix.lower() == ".parquet":
        return None
    beside = path.with_suffix(".wkt")
    if not overwrite and beside.exists():
        with contextlib.suppress(ValueError):
            if _crs(beside) == target:
                return beside
        support.refuse_existing(beside)
    return beside


def _convert_layer(data: str, target: CRS, path: Path, source: CRS | None, densify: float | None, new: bool) -> str:
    """Write a layer in another CRS; returns a note if the file has lost the CRS, else ""."""
    frame = convert_frame(read_data(data), target, source=source, densify=densify)
    suffix = path.suffix.lower()
    if suffix in (".geojson", ".parquet"):
        layers.check_libraries(path)
    with support.replacing(path, overwrite=new, beside=_PARTS if suffix == ".shp" else ()) as file:
        layers.write_layer(frame, file, suffix)
    if suffix == ".parquet":
        return ""
    import geopandas

    found = geopandas.read_file(path, rows=0).crs
    given = Projection.from_user_input(target) if found is not None and _is_map(target) else None
    if found is None or (given is not None and projections.same_map(given, found.to_wkt()) is None):
        return f"'{path.name}' cannot hold this CRS."
    is_plain = _METHOD not in target.to_wkt() or _METHOD in found.to_wkt()
    return "" if is_plain else f"Other programs than projdist do not understand this CRS in '{path.name}'."


# ---- rasters --------------------------------------------------------------------------------


def _warp(
    data: str, target: CRS, path: Path, source: CRS | None, resampling: str, resolution: float | None, overwrite: bool
) -> tuple[str, str]:
    """Write a raster in another CRS; returns notes on where the CRS is and on pixels outside, or ""."""
    support.check_choice("resampling", resampling, RESAMPLINGS)
    with layers.needed_for(f"output '{path}'"):
        import rasterio
        import rasterio.warp
        from rasterio._err import CPLE_BaseError
        from rasterio.errors import CRSError, NotGeoreferencedWarning, RasterioError, RasterioIOError
    try:
        # By default GDAL passes CRSs on in WKT 1, which loses methods of PROJ's own.
        with (
            warnings.catch_warnings(action="ignore", category=PendingDeprecationWarning),  # between affine and rasterio
            warnings.catch_warnings(action="ignore", category=NotGeoreferencedWarning),
            rasterio.Env(OSR_WKT_FORMAT="WKT2_2019"),
            rasterio.open(data) as image,
        ):
            if source is None and image.crs is None:
                raise ValueError(f"Invalid data '{data}'. They have no CRS; it must be given (--from, source=).")
            support.check_raster(image, (), f"Invalid data '{data}'.")
            types = sorted(set(image.dtypes))
            if len(types) > 1:
                several = support.listed(types, "and")
                raise ValueError(f"Invalid data '{data}'. Their bands must be of one type, not of {several}.")
            given = image.crs if source is None else rasterio.CRS.from_wkt(source.to_wkt())
            projections.tell_of_degrees(given.to_wkt(), image.bounds, f"'{data}'", "raster")
            across, down = np.meshgrid(*(np.linspace(0, size, _LOOKS) for size in (image.width, image.height)))
            points = np.column_stack(image.transform @ (across.ravel(), down.ravel()))
            _tell_of_elsewhere(crs_of(given.to_wkt()), target, points, np.zeros(len(points), int), "raster(s) lie")
            wanted = rasterio.CRS.from_wkt(target.to_wkt())
            transform, width, height = rasterio.warp.calculate_default_transform(
                given, wanted, image.width, image.height, *image.bounds, resolution=resolution
            )
            most = max(_MOST_PIXELS, _MANY * image.width * image.height)
            if resolution is not None and width * height > most:
                raise ValueError(
                    f"Invalid resolution '{resolution:g}'. It makes {width * height:.3g} pixels of {image.width} x "
                    f"{image.height}; at most {_MOST_PIXELS:g}, or {_MANY} times as many, are allowed."
                )
            flavour = None if _METHOD in target.to_wkt() else FLAVOURS[0]
            if flavour and target.is_projected and target.to_authority(auth_name="EPSG") is None:
                projection = Projection.from_user_input(target)
                plane = projections.projected_crs_of(projection)
                flavour = None if plane is None else flavour_of(projection, plane)
            dtype, nodata = types[0], image.nodata
            if nodata is None and dtype.startswith("float"):
                nodata = np.nan
            options = geotiff_options((image.count, height, width), dtype, wanted, transform, flavour or FLAVOURS[0])
            with support.replacing(path, overwrite=overwrite, beside=[path.suffix + BESIDE]) as new:
                with rasterio.open(new, "w", **options, nodata=nodata, BIGTIFF="IF_SAFER") as written:
                    _copy_metadata(image, written)
                    for band in range(1, image.count + 1):
                        rasterio.warp.reproject(
                            rasterio.band(image, band),
                            rasterio.band(written, band),
                            src_crs=given,
                            dst_crs=wanted,
                            dst_nodata=nodata,
                            resampling=rasterio.warp.Resampling[resampling],
                        )
                if flavour is None:
                    _put_beside(new, target)
    except RasterioIOError as error:
        raise ValueError(f"Invalid data '{data}'. They cannot be read: {support.one_line(error)}.") from error
    except (CRSError, RasterioError, CPLE_BaseError) as error:
        name = "of the data" if source is None else source.name
        raise ValueError(_NO_WAY.format(name, target.name)) from error
    lost = "" if flavour is not None else f"'{path.name}' keeps this CRS in '{path.name}{BESIDE}' only."
    return lost, "" if nodata is not None else "Pixels outside the data are 0."


def _copy_metadata(image: Any, written: Any) -> None:
    """Copy tags, descriptions, scales, units and colours of a raster and its bands."""
    written.update_tags(**{key: value for key, value in image.tags().items() if key != "AREA_OR_POINT"})
    written.descriptions, written.scales, written.offsets = image.descriptions, image.scales, image.offsets
    for band, unit in enumerate(image.units, start=1):
        if unit:
            written.set_band_unit(band, unit)
    if written.count == image.count and image.dtypes[0] == "uint8" and image.colorinterp[0].name == "palette":
        written.write_colormap(1, image.colormap(1))


def _put_beside(path: Path, target: CRS) -> None:
    """Write the CRS to the .aux.xml file of an image, which GDAL reads first, with axes in the order of pixels."""
    text = f'<PAMDataset>\n  <SRS dataAxisToSRSAxisMapping="1,2">{escape(target.to_wkt())}</SRS>\n</PAMDataset>\n'
    file = path.with_name(path.name + BESIDE)
    if not file.exists():
        file.write_text(text, encoding="utf-8")
        return
    kept = file.read_text(encoding="utf-8")  # other metadata that GDAL put there
    if "<SRS" not in kept:
        file.write_text(kept.replace("<PAMDataset>\n", text.removesuffix("</PAMDataset>\n"), 1), encoding="utf-8")
