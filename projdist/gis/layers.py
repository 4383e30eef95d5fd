"""Layers of polygons, lines and points for GIS programs, and the atlas as a file."""

from __future__ import annotations

import contextlib
import csv
import json
import warnings
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from shapely.errors import ShapelyError

from projdist import answers, matrices, support, surfaces
from projdist._typing import AnyPath, FloatArray
from projdist.applications.oldmaps import LOCAL_MEASURES, RECTIFICATIONS, OldMap, isolines
from projdist.projections import ProjectedCrs, Projection, ProjectionLike, projected_crs_of
from projdist.regions import RegionLike, geojson_of, get_region

if TYPE_CHECKING:
    import geopandas

    from projdist.designs import AtlasEntry


@contextlib.contextmanager
def needed_for(thing: str) -> Iterator[None]:
    """Context for imports of optional libraries; an ImportError becomes one line that says what to install."""
    try:
        yield
    except ImportError as error:
        library = (error.name or "the extra gis").partition(".")[0]
        raise ImportError(f"Invalid {thing}. It needs {library}: pip install 'projdist[gis]'.", name=library) from error


def check_libraries(path: Path) -> None:
    """Raise ImportError if a library that writes files of that suffix is missing."""
    suffix = path.suffix.lower()
    names = ["rasterio"] if suffix in (".tif", ".tiff") else ["geopandas", "pyogrio"]
    if suffix in (".parquet", *LAYER_SUFFIXES):  # in which some CRSs are written
        names.append("pyarrow")
    with needed_for(f"output '{path}'"):
        for name in names:
            import_module(name)


def frame_of_geojson(content: bytes) -> geopandas.GeoDataFrame:
    """The features of GeoJSON in longitude and latitude; ValueError for other content, ImportError."""
    with needed_for("file to check"):
        import geopandas
    try:
        document = json.loads(content)
        features = document["features"] if document["type"] == "FeatureCollection" else [document]
        if document["type"] not in ("FeatureCollection", "Feature"):
            features = [{"type": "Feature", "properties": {}, "geometry": document}]
        return geopandas.GeoDataFrame.from_features(features, crs="OGC:CRS84")
    except (ArithmeticError, AttributeError, LookupError, RecursionError, ShapelyError, TypeError, ValueError) as error:
        raise ValueError("Invalid file. It must be GeoJSON: features of lines or polygons.") from error


def frame_of_regions(rows: Sequence[Mapping[str, Any]], regions: Sequence[Any]) -> geopandas.GeoDataFrame:
    """Features in longitude and latitude, one per row and its region; ValueError for regions of points, ImportError."""
    with needed_for("layer of regions"):
        import geopandas
    features = [
        {"type": "Feature", "properties": dict(row), "geometry": geojson_of(get_region(region))}
        for row, region in zip(rows, regions, strict=True)
    ]
    return geopandas.GeoDataFrame.from_features(features, crs="OGC:CRS84")


# ---- layers --------------------------------------------------------------------------------------

LAYER_SUFFIXES = (".gpkg", ".geojson")

DRIVERS = {".gpkg": "GPKG", ".geojson": "GeoJSON", ".fgb": "FlatGeobuf", ".shp": "ESRI Shapefile"}
"""GDAL's drivers by suffix."""

_LOCAL_CRS = 'LOCAL_CS["Plane of a map without a CRS",UNIT["metre",1],AXIS["x",EAST],AXIS["y",NORTH]]'
_VERTICES = 72  # of an indicatrix
_NAMES = ("a", "b", "h", "k", "s", "omega")


def indicatrices(
    projection: ProjectionLike,
    *,
    region: RegionLike | None = None,
    step: float | None = None,
    radius: float | None = None,
) -> geopandas.GeoDataFrame:
    """Tissot's indicatrices as polygons, the same as in a picture of the map.

    Attributes: lon, lat in degrees; x, y in metres; a, b, h, k, s, omega as in `factors`; `azimuth` of the major axis
    on the ground, degrees clockwise from north within [0, 180), NaN for a circle; `radius` of the circles on the ground
    in metres. Without a CRS of the map the polygons are in metres and `crs` is None. Raises ImportError.
    """
    with needed_for("layer"):
        import geopandas
    projection = Projection.from_user_input(projection)
    surface = surfaces.surface_of(projection, region)
    size, (panel,) = surfaces.fit([surfaces.tissot_points(surface, step)], radius)
    plane = projected_crs_of(projection)
    rings = _native(surfaces.ellipses(panel, size, _VERTICES), plane)
    found = answers.factors(projection, panel.lon, panel.lat)
    columns = {"lon": panel.lon, "lat": panel.lat, "x": panel.xy[:, 0], "y": panel.xy[:, 1]}
    columns |= {name: getattr(found, name) for name in _NAMES}
    columns |= {"azimuth": matrices.decompose(panel.J).stretch_azimuth, "radius": np.full(panel.lon.size, size)}
    return geopandas.GeoDataFrame(columns, geometry=shapely.polygons(rings), crs=plane.wkt if plane else None)


def save_layer(
    frame: geopandas.GeoDataFrame, path: AnyPath, *, layer: str | None = None, overwrite: bool = True
) -> Path:
    """Write a GeoDataFrame as GeoPackage or GeoJSON, whole or not at all.

    For a frame without a CRS that of a GeoPackage is undefined, and that of GeoJSON a local plane in metres. Raises
    FileExistsError, OSError for a file that cannot be written, and ImportError without pyogrio.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in LAYER_SUFFIXES:
        raise ValueError(f"Invalid layer file '{path}'. Its suffix must be {' or '.join(LAYER_SUFFIXES)}.")
    check_libraries(path)
    with support.replacing(path, overwrite=overwrite) as new:
        write_layer(frame, new, suffix, layer)
    return path


def save_layers(frames: Mapping[str, geopandas.GeoDataFrame], path: AnyPath, *, overwrite: bool = True) -> Path:
    """Write GeoDataFrames as layers of one GeoPackage, whole or not at all; raises as `save_layer`."""
    path = Path(path)
    if path.suffix.lower() != ".gpkg":
        raise ValueError(f"Invalid layer file '{path}'. Its suffix must be .gpkg, which has room for several layers.")
    check_libraries(path)
    with support.replacing(path, overwrite=overwrite) as new:
        for name, frame in frames.items():
            write_layer(frame, new, ".gpkg", name)
    return path


def write_layer(frame: geopandas.GeoDataFrame, path: Path, suffix: str, layer: str | None = None) -> None:
    """Write a GeoDataFrame in the format of a suffix, also in a CRS that WKT 1 cannot express; raises OSError."""
    if suffix == ".parquet":
        frame.to_parquet(path)
        return
    import pyogrio
    import pyogrio.errors

    options = {"driver": DRIVERS[suffix]} | ({} if layer is None else {"layer": layer})
    if suffix == ".fgb" and (frame.geometry.isna() | frame.geometry.is_empty).any():
        options["SPATIAL_INDEX"] = "NO"  # an index cannot hold features without a geometry
    wkt1 = True
    if frame.crs is not None:
        try:
            frame.crs.to_wkt("WKT1_GDAL")
        except RuntimeError:  # PROJ's
            wkt1 = False
    with warnings.catch_warnings():
        # A missing CRS is intended.
        warnings.filterwarnings("ignore", message="'crs' was not provided", category=UserWarning)
        try:
            if wkt1:
                pyogrio.write_dataframe(frame, path, **options)
            else:  # write_dataframe insists on WKT 1, which cannot express Equal Earth
                import pyarrow as pa

                table = pa.table(frame.to_arrow(index=False, geometry_encoding="WKB"))
                kinds, name = frame.geom_type.dropna().unique(), frame.geometry.name
                options |= {"geometry_type": kinds[0] if len(kinds) == 1 else "Unknown"}
                pyogrio.write_arrow(table, path, geometry_name=name, crs=frame.crs.to_wkt(), **options)
        except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError) as error:
            raise OSError(support.one_line(error)) from error
    if suffix == ".geojson" and (frame.crs is None or frame.crs.to_authority(min_confidence=100) is None):
        # As WKT, which GDAL reads; it writes only codes itself, and GeoJSON without one is in WGS 84.
        crs = {"type": "name", "properties": {"name": _LOCAL_CRS if frame.crs is None else frame.crs.to_wkt()}}
        collection = {"type": None, "crs": None} | json.loads(path.read_text(encoding="utf-8"))
        path.write_text(json.dumps(collection | {"crs": crs}), encoding="utf-8")


# ---- old maps ------------------------------------------------------------------------------------


def old_map_layers(
    found: OldMap, *, by: str = "mdt", crs: ProjectionLike | None = None
) -> dict[str, geopandas.GeoDataFrame]:
    """Displacements of an old map's control points and isolines of its distortion, as layers of lines.

    Parameters
    ----------
    found : OldMap
        The old map.
    by : str
        The rectification, "mdt", "affine" or "helmert", after which displacements and measures are taken.
    crs : ProjectionLike, optional
        The CRS of the true places, by default that of the control points; without one layers are in metres of a plane.

    Returns
    -------
    dict
        "displacements": lines from the rectified control points to their true places, with `id`, `dx`, `dy` and
        `length` in metres and a flag `outlier`; and "fisher", "areal_scale", "scale", "rotation" (degrees clockwise):
        isolines with their `level`. Measures without isolines have no layer.

    Raises
    ------
    ValueError
        For an unknown rectification, and a map without a CRS.
    ImportError
        Without geopandas.

    Examples
    --------
    >>> import geopandas
    >>> from projdist.applications.oldmaps import ControlPoints
    >>> from projdist import old_map
    >>> points = ControlPoints([[0, 0], [1, 0], [0, 1], [1, 1]], [[0, 0], [100, 0], [0, 100], [100, 140]])
    >>> old_map_layers(old_map(points, model="affine"))["displacements"]["length"].round(6).tolist()
    [10.0, 10.0, 10.0, 10.0]
    """
    support.check_instance("old map", found, OldMap, "an OldMap")
    support.check_choice("rectification", by, RECTIFICATIONS)
    given, plane = found.points.crs if crs is None else crs, None
    if given is not None:
        projection = Projection.from_user_input(given)
        plane = projected_crs_of(projection)
        if plane is None:
            raise ValueError(f"Invalid CRS '{projection.label}'. PROJ has no CRS of it.")
    with needed_for("layer"):
        import geopandas
    wkt = None if plane is None else plane.wkt
    start, stop = found.rectifications[by].affine(found.points.old), found.points.new
    dx, dy = (stop - start).T
    columns = {"id": found.points.names, "dx": dx, "dy": dy, "length": np.hypot(dx, dy), "outlier": found.is_outlier}
    lines = shapely.linestrings(_native(np.stack([start, stop], axis=1), plane))
    layers = {"displacements": geopandas.GeoDataFrame(columns, geometry=lines, crs=wkt)}
    for measure in LOCAL_MEASURES:
        levels = isolines(found, measure, by=by)
        merged = [
            shapely.line_merge(shapely.multilinestrings(shapely.linestrings(_native(pieces, plane))))
            for pieces in levels.values()
        ]
        if levels:
            joined = geopandas.GeoDataFrame({"level": list(levels)}, geometry=merged, crs=wkt)
            layers[measure] = joined.explode(ignore_index=True)
    return layers


def _native(places: FloatArray, plane: ProjectedCrs | None) -> FloatArray:
    """Places in metres converted to the unit and axes of the CRS."""
    return places if plane is None else np.asarray(places @ np.linalg.inv(plane.to_metres).T)


# ---- the atlas ------------------------------------------------------------------------------------

ATLAS_SUFFIXES = (".csv", ".parquet", ".gpkg")


def save_atlas(entries: Sequence[AtlasEntry], path: AnyPath, *, overwrite: bool = True) -> Path:
    """Write entries of the atlas in the format of the file's suffix, whole or not at all.

    A `.csv` or `.parquet` file has a row for each map of each purpose, as `AtlasEntry.rows`; a `.gpkg` file has a
    feature for each place, as `atlas_frame`. Only CSV needs no extra libraries. Raises ValueError for another suffix,
    FileExistsError, OSError for a file that cannot be written, and ImportError without the libraries.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in ATLAS_SUFFIXES:
        raise ValueError(f"Invalid output '{path}'. Its suffix must be .csv, .parquet or .gpkg.")
    if suffix == ".gpkg":
        check_libraries(path)
        return save_layer(atlas_frame(entries), path, layer="atlas", overwrite=overwrite)
    rows = [row for entry in entries for row in entry.rows()]
    if suffix == ".parquet":
        with needed_for(f"output '{path}'"):
            import pandas as pd
            import pyarrow  # noqa: F401 whether it is there
        with support.replacing(path, overwrite=overwrite) as new:
            pd.DataFrame(rows).to_parquet(new, compression="zstd", index=False)
        return path
    with support.replacing(path, overwrite=overwrite) as new, new.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return path


def atlas_frame(entries: Sequence[AtlasEntry]) -> geopandas.GeoDataFrame:
    """Outlines of places of the atlas with their summaries, in longitude and latitude; ImportError."""
    return frame_of_regions([entry.summary() for entry in entries], [entry.region for entry in entries])
