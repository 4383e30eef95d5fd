"""Points read from and written to files, and files of lines and polygons."""

from __future__ import annotations

import contextlib
import json
import os
import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from projdist import projections, regions
from projdist._typing import AnyPath
from projdist.gis.layers import needed_for, save_layer
from projdist.projections import Projection, ProjectionLike, is_geographic
from projdist.support import one_line, replacing, tell

if TYPE_CHECKING:
    import pandas as pd

_NAMED = 5  # features or texts in a notice
_HEAD = 65_536  # characters at the beginning of a file that are searched for its crs

TABLE_SUFFIXES = (".csv", ".parquet", ".gpkg", ".geojson")


def read_points(path: AnyPath) -> pd.DataFrame:
    """A file of points as a GeoDataFrame, or as a DataFrame if it has no geometries.

    `#LAYER` behind the path names one of several layers. Raises ValueError for a file that cannot be read, ImportError.
    """
    return _read(os.fspath(path), "points")


def read_data(path: AnyPath) -> Any:
    """A file of lines or polygons as a GeoDataFrame; raises as `read_points`, and for data without geometries."""
    text = os.fspath(path)
    frame = _read(text, "data")
    if not is_geographic(frame):
        raise ValueError(f"Invalid data file '{text}'. It has no geometries.")
    return frame


def _read(text: str, thing: str) -> Any:
    """The frame of a file of points or data, which `thing` says."""
    invalid = f"Invalid {thing} file '{text}'."
    with needed_for(f"{thing} file '{text}'"):
        import geopandas  # noqa: F401
        import pyogrio
        import pyogrio.errors
    name, _, layer = (text, "", "") if Path(text).exists() else text.partition("#")
    if not Path(name).is_file():
        raise ValueError(f"{invalid} There is no file '{name}'.")
    if name.lower().endswith(".parquet"):
        return _read_parquet(name, thing)
    if thing == "points" and name.lower().endswith(projections.TEXT_SUFFIXES):
        return _read_table(name)
    if name.lower().endswith(".csv"):
        raise ValueError(f"{invalid} It has no geometries.")
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            layers = [str(row[0]) for row in pyogrio.list_layers(name)]
            if layer not in layers and (layer or len(layers) != 1):
                shown = ", ".join(layers) or "none"
                raise ValueError(f"{invalid} It must name a layer, such as '{name}#LAYER'; it has {shown}.")
            frame, lost = _read_layer(name, layer or layers[0])
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError) as error:
        raise ValueError(f"{invalid} It cannot be read: {one_line(error)}.") from error
    for said in list(dict.fromkeys(one_line(warning.message) for warning in caught))[:_NAMED]:
        tell(f"GDAL says of '{name}': {said}.")
    if lost:
        numbers = first_of(lost)
        tell(f"{len(lost)} feature(s) of '{name}' have a geometry that cannot be read and is left out: {numbers}.")
    if is_geographic(frame):
        understood = None if frame.crs is None else projections.crs_of(frame.crs)
        frame = frame.set_geometry(regions.with_gpx_heights(Path(name), layer, frame.geometry.array))
        frame = frame.set_crs(understood, allow_override=True)
    crs = _stated_crs(name)
    if isinstance(crs, dict):
        projections.crs_of(regions.crs_name(crs, invalid))  # GDAL ignores an invalid one
    elif crs is not None:
        tell(f"The member crs of '{name}' is not an object, as GeoJSON needs: the data are taken as {frame.crs.name}.")
    return frame


def first_of(numbers: Sequence[int]) -> str:
    """The first few numbers of features, for a notice."""
    return ", ".join(map(str, numbers[:_NAMED])) + (", ..." if len(numbers) > _NAMED else "")


def _read_layer(name: str, layer: str) -> tuple[Any, list[int]]:
    """A layer as GDAL reads it, and the numbers, from 1, of features that GEOS cannot make (a line of one point)."""
    import geopandas
    import pyogrio

    with np.errstate(invalid="ignore"):  # NaN among coordinates
        try:
            return geopandas.read_file(name, engine="pyogrio", layer=layer), []
        except shapely.errors.GEOSException:
            found, _, stored, columns = pyogrio.raw.read(name, layer=layer)
            shapes = shapely.from_wkb(stored, on_invalid="ignore")
    lost = [k + 1 for k, (shape, bytes_) in enumerate(zip(shapes, stored, strict=True)) if bytes_ and shape is None]
    table = dict(zip(found["fields"], columns, strict=True))
    return geopandas.GeoDataFrame(table, geometry=shapes, crs=found["crs"] or None), lost


_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[{}\[\]]')


def _stated_crs(name: str) -> Any:
    """The member crs of a GeoJSON file; None unless it is near the beginning."""
    if not name.lower().endswith((".geojson", ".json")):
        return None
    with open(name, encoding="utf-8-sig", errors="replace") as file:
        text = file.read(_HEAD)
    depth = 0
    for token in _TOKEN.finditer(text):
        depth += {"{": 1, "[": 1, "}": -1, "]": -1}.get(token[0], 0)
        value = re.compile(r"\s*:\s*").match(text, token.end()) if depth == 1 and token[0] == '"crs"' else None
        if value is not None:
            with contextlib.suppress(ValueError):  # the file ends there; GDAL will refuse it
                return json.JSONDecoder().raw_decode(text, value.end())[0]
    return None


def _read_parquet(name: str, thing: str) -> Any:
    """A Parquet file as a GeoDataFrame, or as a DataFrame if it has no geometries."""
    with needed_for(f"{thing} file '{name}'"):
        import geopandas
        import pandas as pd
        import pyarrow as pa
        import pyarrow.parquet
    try:
        with pa.parquet.ParquetFile(name) as file:
            metadata = file.schema_arrow.metadata or {}
        return geopandas.read_parquet(name) if b"geo" in metadata else pd.read_parquet(name)
    except (pa.ArrowException, shapely.errors.GEOSException, OSError) as error:
        raise ValueError(f"Invalid {thing} file '{name}'. It cannot be read: {one_line(error)}.") from error


def _read_table(name: str) -> Any:
    """A text file as a DataFrame, with numbers in the columns that have only numbers."""
    import pandas as pd

    table = projections.read_point_table(Path(name), f"Invalid points file '{name}'.")

    def parsed(column: pd.Series) -> pd.Series:
        """A column as numbers if all are numbers; one with leading zeros has codes, and stays text."""
        if column.str.match(r"\s*[+-]?0\d").any() or not column.str.strip().any():
            return column
        try:
            return pd.to_numeric(column.str.strip().replace("", None))
        except (ValueError, TypeError):
            return column

    return pd.DataFrame([row for _, row in table.rows], columns=table.header, dtype=str).apply(parsed)


def save_points(projection: ProjectionLike, frame: Any, path: AnyPath, *, overwrite: bool = True) -> Path:
    """Write a frame of points in the format of the file's suffix, whole or not at all.

    Points keep their CRS, except in GeoJSON, which is in WGS 84, and in CSV, with `lon` and `lat` on the datum of the
    map. A frame without geometries becomes a layer on that datum, too.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in TABLE_SUFFIXES:
        raise ValueError(f"Invalid output '{path}'. Its suffix must be {', '.join(TABLE_SUFFIXES)}.")
    if suffix == ".csv":
        with replacing(path, overwrite=overwrite) as new:
            plain_table(projection, frame).to_csv(new, index=False)
        return path
    if suffix == ".parquet":
        with needed_for(f"output '{path}'"):
            import pyarrow as pa
        try:
            with replacing(path, overwrite=overwrite) as new:
                frame.to_parquet(new)
        except pa.ArrowException as error:  # columns of several types
            raise ValueError(f"Invalid output '{path}'. It cannot hold the table: {one_line(error)}.") from error
        return path
    layer = frame
    if not is_geographic(frame):
        with needed_for(f"output '{path}'"):
            import geopandas
        given = Projection.from_user_input(projection)
        graticule = projections.graticule_of(given)
        points = geopandas.points_from_xy(*graticule.angles.from_degrees(*projections.places(given, frame)))
        layer = geopandas.GeoDataFrame(frame, geometry=points, crs=graticule.wkt)
    if suffix == ".geojson":
        try:
            layer = layer.to_crs("EPSG:4326")
        except RuntimeError as error:  # PROJ's; from another body, say
            raise ValueError(
                f"Invalid output '{path}'. GeoJSON is in WGS 84, to which PROJ has no way from {layer.crs.name}."
            ) from error
    return save_layer(layer, path, overwrite=overwrite)


def plain_table(projection: ProjectionLike, frame: Any) -> pd.DataFrame:
    """A frame with `lon` and `lat`, on the datum of the map, instead of geometries; columns of these names are kept."""
    if not is_geographic(frame):
        return frame
    lon, lat = projections.places(Projection.from_user_input(projection), frame)
    others = frame.drop(columns=frame.geometry.name)
    if not {"lon", "lat"} & set(others.columns):
        others.insert(0, "lon", lon)
        others.insert(1, "lat", lat)
    return others
