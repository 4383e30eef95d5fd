"""People's own points, from files and to files, and files of lines and polygons."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from projdist.files import replacing
from projdist.frames import check_degrees, is_geographic, places
from projdist.gis.layers import save_layer
from projdist.gis.libraries import needed_for, one_line
from projdist.projections import Projection, graticule_of

if TYPE_CHECKING:
    import pandas as pd

TABLE_SUFFIXES = (".csv", ".parquet", ".gpkg", ".geojson")


def read_points(path: str | os.PathLike[str]) -> pd.DataFrame:
    """A file of points as a GeoDataFrame, or, where it has no geometries, as a DataFrame.

    `#LAYER` behind the path names one of several layers. Raises ValueError in one line for what
    cannot be read, ImportError without geopandas.
    """
    return _read(os.fspath(path), "points")


def read_data(path: str | os.PathLike[str]) -> Any:
    """A file of lines or polygons as a GeoDataFrame, as `read_points` reads those of points."""
    text = os.fspath(path)
    frame = _read(text, "data")
    if not is_geographic(frame):
        raise ValueError(f"Invalid data file '{text}'. It has no geometries.")
    return frame


def _read(text: str, thing: str) -> Any:
    invalid = f"Invalid {thing} file '{text}'."
    with needed_for(f"{thing} file '{text}'"):
        import geopandas
        import pyogrio
        import pyogrio.errors
    name, _, layer = (text, "", "") if Path(text).exists() else text.partition("#")
    if not Path(name).is_file():
        raise ValueError(f"{invalid} There is no file '{name}'.")
    if name.lower().endswith(".parquet"):
        return _read_parquet(name, thing)
    if name.lower().endswith(".csv"):
        return _read_csv(name, thing)
    try:
        layers = [str(row[0]) for row in pyogrio.list_layers(name)]
        if layer not in layers and (layer or len(layers) != 1):
            shown = ", ".join(layers) or "none"
            raise ValueError(f"{invalid} It must name a layer, as '{name}#LAYER'; it has {shown}.")
        return geopandas.read_file(name, engine="pyogrio", layer=layer or layers[0])
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError) as error:
        raise ValueError(f"{invalid} It cannot be read: {one_line(error)}.") from error


def _read_parquet(name: str, thing: str) -> Any:
    with needed_for(f"{thing} file '{name}'"):
        import geopandas
        import pandas as pd
        import pyarrow as pa
        import pyarrow.parquet
    try:
        with pa.parquet.ParquetFile(name) as file:
            metadata = file.schema_arrow.metadata or {}
        return geopandas.read_parquet(name) if b"geo" in metadata else pd.read_parquet(name)
    except (pa.ArrowException, OSError) as error:
        raise ValueError(f"Invalid {thing} file '{name}'. It cannot be read: {one_line(error)}.") from error


def _read_csv(name: str, thing: str) -> Any:
    import pandas as pd

    try:
        texts = pd.read_csv(name, dtype=str, keep_default_na=False, encoding="utf-8-sig")
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError, OSError) as error:
        raise ValueError(f"Invalid {thing} file '{name}'. It cannot be read: {one_line(error)}.") from error

    return texts.apply(_numbers_where_meant)


def _numbers_where_meant(column: pd.Series) -> pd.Series:
    """A column of text as numbers, if all of it is; what begins with a zero is a code, and stays as it is."""
    if column.str.match(r"\s*[+-]?0\d").any() or not column.str.strip().any():
        return column
    import pandas as pd

    try:
        return pd.to_numeric(column.str.strip().replace("", None))
    except (ValueError, TypeError):
        return column


def save_points(projection: Projection, frame: Any, path: str | os.PathLike[str], *, overwrite: bool = True) -> Path:
    """Write a frame of points by the suffix of its file, whole or not at all.

    Points stay in their CRS, but for GeoJSON, which is in WGS 84, and CSV, whose `lon` and `lat` are on
    the datum of the map, as those of a table are that becomes a layer.
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
    layer = frame if is_geographic(frame) else _with_geometry(projection, frame)
    if suffix == ".geojson":
        try:
            layer = layer.to_crs("EPSG:4326")
        except RuntimeError as error:  # PROJ's; from another body, say
            raise ValueError(
                f"Invalid output '{path}'. GeoJSON is in WGS 84, to which PROJ has no way from {layer.crs.name}."
            ) from error
    return save_layer(layer, path, overwrite=overwrite)


def frame_of(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """A frame of rows; None is NaN among numbers."""
    import pandas as pd

    return pd.DataFrame(list(rows))


def plain_table(projection: Projection, frame: Any) -> pd.DataFrame:
    """A frame without geometries: these as `lon` and `lat` on the datum of the map, unless it has such columns."""
    if not is_geographic(frame):
        return frame
    lon, lat = places(projection, frame)
    others = frame.drop(columns=frame.geometry.name)
    if {"lon", "lat"} & set(others.columns):
        return others
    others.insert(0, "lon", lon)
    others.insert(1, "lat", lat)
    return others


def _with_geometry(projection: Projection, frame: pd.DataFrame) -> Any:
    """The points of the columns `lon` and `lat` in the geographic CRS of the map."""
    import geopandas

    graticule = graticule_of(projection)
    coordinates = graticule.coordinates(*check_degrees(frame["lon"], frame["lat"]))
    return geopandas.GeoDataFrame(frame, geometry=geopandas.points_from_xy(*coordinates), crs=graticule.wkt)
