"""The geometries and fields of files: GeoJSON and WKT by themselves, other vector formats by pyogrio."""

from __future__ import annotations

import importlib
import json
import re
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely

from projdist._typing import FloatArray
from projdist.projections import to_lonlat
from projdist.support import one_line, read_text, shown

Transform = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]

_SIMPLE = ("Point", "MultiPoint", "LineString", "MultiLineString", "Polygon", "MultiPolygon")
_COLLECTIONS = {"FeatureCollection": "features", "GeometryCollection": "geometries"}


class Shape(NamedTuple):
    """A simple geometry of GeoJSON and the fields of its feature; one without a geometry is of no kind."""

    kind: str
    coordinates: Any
    fields: dict[str, Any]


class Source(NamedTuple):
    """What is in a file, the function from its coordinates to longitude and latitude, and their CRS if stated."""

    shapes: list[Shape]
    transform: Transform | None
    crs: str | None = None


def read(path: Path, layer: str, text: str, columns: list[str] | None) -> Source:
    """The shapes of a vector file with these columns, or with all; raises ValueError, which begins with a text."""
    if path.suffix.lower() == ".wkt":
        return _read_wkt(path, text)
    if path.suffix.lower() not in (".geojson", ".json"):
        return _read_vector(path, layer, text, columns)
    value = _read_json(path, text)
    return Source(list(shapes_of(value, text)), stated_transform(value, text), crs_name(value.get("crs"), text))


def shapes_of(value: Any, text: str) -> Iterator[Shape]:
    """The shapes in an object of GeoJSON, in order; raises ValueError."""
    # A stack rather than recursion: files may be nested deeper than Python.
    stack: list[tuple[Any, dict[str, Any]]] = [(value, {})]
    while stack:
        one, fields = stack.pop()
        kind = one.get("type") if isinstance(one, dict) else None
        if kind in _SIMPLE:
            yield Shape(kind, one.get("coordinates"), fields)
        elif kind == "Feature":
            properties = _object(one, "properties", text)
            if one.get("geometry"):
                stack.append((one["geometry"], properties))
            else:
                yield Shape("", None, properties)
        elif isinstance(kind, str) and kind in _COLLECTIONS:
            inner = one.get(_COLLECTIONS[kind]) or []
            if not isinstance(inner, list):
                raise ValueError(f"{text} It must be GeoJSON; its {_COLLECTIONS[kind]} must be a list.")
            stack += [(member, fields) for member in reversed(inner)]
        else:
            raise ValueError(f"{text} It must be GeoJSON; it has an object of type {shown(repr(kind))}.")


def _object(value: dict[str, Any], member: str, text: str) -> dict[str, Any]:
    """A member that is an object or null."""
    found = value.get(member) or {}
    if not isinstance(found, dict):
        raise ValueError(f"{text} It must be GeoJSON; its {member} must be an object.")
    return found


def _read_json(path: Path, text: str) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ValueError(f"{text} It cannot be read: {error.strerror}.") from error
    except RecursionError as error:
        raise ValueError(f"{text} It must be GeoJSON; it is nested too deep.") from error
    except ValueError as error:
        raise ValueError(f"{text} It must be GeoJSON: {error}.") from error


def stated_transform(value: Any, text: str) -> Transform | None:
    """The transformation that the member `crs` asks for."""
    name = crs_name(value.get("crs"), text)
    return None if name is None else to_lonlat(name)


def crs_name(crs: Any, text: str) -> str | None:
    """The CRS that a member `crs` names, which GeoJSON from before RFC 7946 may have; raises ValueError for others."""
    if crs is None:
        return None
    if not isinstance(crs, dict):
        raise ValueError(f"{text} It must be GeoJSON; its crs must be an object.")
    properties = _object(crs, "properties", text)
    if crs.get("type") == "EPSG" and isinstance(properties.get("code"), int):  # of GeoJSON before 2008
        return f"EPSG:{properties['code']}"
    name = properties.get("name")
    if not isinstance(name, str) or not name:
        raise ValueError(f"{text} It must be GeoJSON; its crs must have properties with the name of a CRS, a text.")
    return name


def _read_vector(path: Path, layer: str, text: str, columns: list[str] | None) -> Source:
    try:
        pyogrio = importlib.import_module("pyogrio")
    except ImportError as error:
        raise ValueError(
            f"{text} Without pyogrio only GeoJSON can be read: pip install 'projdist[gis]' reads other formats."
        ) from error
    if path.suffix.lower() == ".parquet" and "Parquet" not in pyogrio.list_drivers():
        raise ValueError(f"{text} The GDAL of pyogrio here reads no Parquet; GeoPackage and GeoJSON are read.")
    try:
        path.stat()
        with warnings.catch_warnings():
            # GDAL's and pyogrio's, of details of the format: what matters here is whether there are geometries.
            warnings.simplefilter("ignore")
            meta, _, wkb, values = pyogrio.raw.read(path, layer=layer or None, columns=columns)
        geometries = shapely.from_wkb(wkb)
        crs = to_lonlat(meta["crs"]) if meta["crs"] else None
    except OSError as error:
        raise ValueError(f"{text} It cannot be read: {error.strerror}.") from error
    except IndexError as error:  # pyogrio's, where a file says that it has other geometries than it has
        raise ValueError(f"{text} It cannot be read: it is damaged.") from error
    except (RuntimeError, ValueError, shapely.errors.ShapelyError) as error:  # pyogrio's are RuntimeErrors
        raise ValueError(f"{text} It cannot be read: {one_line(error)}.") from error
    if wkb is None:  # of a table
        raise ValueError(f"{text} It has no geometries.")
    rows = zip(*values, strict=True) if len(values) else ((),) * len(geometries)
    names = [str(field) for field in meta["fields"]]
    found = [
        Shape("", None, dict(zip(names, row, strict=True)))
        if geometry is None or geometry.is_empty
        else _shape(geometry, dict(zip(names, row, strict=True)))
        for geometry, row in zip(geometries, rows, strict=True)
    ]
    return Source(found, crs, meta["crs"] or None)


def _shape(geometry: shapely.Geometry, fields: dict[str, Any]) -> Shape:
    if geometry.geom_type.endswith("LineString"):  # whose heights old versions of GEOS leave out of GeoJSON
        return Shape(geometry.geom_type, shapely.geometry.mapping(geometry)["coordinates"], fields)
    found = json.loads(shapely.to_geojson(geometry))
    return Shape(found["type"], found.get("coordinates"), fields)


_SRID = re.compile(r"\s*SRID\s*=\s*(\d+)\s*;", re.IGNORECASE)


def _read_wkt(path: Path, text: str) -> Source:
    """Geometries of well-known text, one after the other, perhaps with `SRID=4326;` before them, which must be one."""
    words = read_text(path, text)
    codes = set(_SRID.findall(words))
    if len(codes) > 1:
        raise ValueError(f"{text} Its geometries must have one SRID; they have {', '.join(sorted(codes, key=int))}.")
    # Each begins with a word before a bracket that is in no other bracket.
    parts = [part for part in re.split(r"(?<=\))\s*(?=[A-Za-z])", _SRID.sub(" ", words).strip()) if part]
    shapes: list[Shape] = []
    for part in parts:
        try:
            with np.errstate(over="ignore"):  # infinite coordinates are refused with those of other files
                geometry = shapely.from_wkt(part)
            members = geometry.geoms if geometry.geom_type == "GeometryCollection" else [geometry]
        except (shapely.errors.GEOSException, NotImplementedError) as error:  # the latter for arcs
            raise ValueError(f"{text} It must hold WKT of geometries: {one_line(error)}.") from error
        shapes += [_shape(member, {}) for member in members if not member.is_empty]
    code = f"EPSG:{codes.pop()}" if codes else None
    return Source(shapes, None if code is None else to_lonlat(code), code)


def positions(given: Any, text: str) -> FloatArray:
    """Positions as an array (m, 2) of finite numbers; raises ValueError."""
    try:
        found = np.array([position[:2] for position in given], dtype=float)
    except (TypeError, ValueError, LookupError, OverflowError) as error:
        raise ValueError(f"{text} Its coordinates must be numbers.") from error
    if len(found) and (found.ndim != 2 or found.shape[1] != 2):
        raise ValueError(f"{text} Its coordinates must be numbers.")
    if not np.isfinite(found).all():
        raise ValueError(f"{text} Its coordinates must be finite numbers.")
    return found.reshape(-1, 2)
