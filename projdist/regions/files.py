"""Files of points, lines and polygons: GeoJSON, WKT, text tables, and all that GDAL reads. New formats belong here.

The regions in them are made in `projdist.regions.shapes`, frames of geopandas in `projdist.gis.reading`.
"""

import contextlib
import importlib
import json
import re
import warnings
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely

from projdist import projections
from projdist._typing import AnyArray, FloatArray
from projdist.support import MISSING, comma_hint, number_of, one_line, read_text, shown, tell

Transform = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]

HEIGHTS = ("height", "h", "elevation", "ele")
"""Names of height columns, likeliest first; the last is GPX's."""

_WEIGHTS = ("weight", "weights", "w")
_TURN = 360.0  # degrees
_SIMPLE = ("Point", "MultiPoint", "LineString", "MultiLineString", "Polygon", "MultiPolygon")
_COLLECTIONS = {"FeatureCollection": "features", "GeometryCollection": "geometries"}


class Shape(NamedTuple):
    """A simple GeoJSON geometry and the fields of its feature; `kind` is "" for a feature without geometry."""

    kind: str
    coordinates: Any
    fields: dict[str, Any]


class ReadShapes(NamedTuple):
    """Shapes of a file, the function from their coordinates to longitude and latitude, and the CRS if stated."""

    shapes: list[Shape]
    transform: Transform | None
    crs: Any = None


def read(path: Path, layer: str, text: str, columns: list[str] | None, kinds: tuple[str, ...] = ()) -> ReadShapes:
    """The shapes of a vector file with some or (None) all columns; raises ValueError that begins with `text`."""
    # The default layer is the first, or, if that has nothing of these `kinds`, the only one that does. Warns of
    # coordinates that look like degrees in a file that states metres.
    if path.suffix.lower() == ".wkt":
        found = _read_wkt(path, text)
    elif path.suffix.lower() in (".geojson", ".json"):
        found = shapes_of_geojson(_read_json(path, text), text)
    else:
        found = _read_vector(path, layer, text, columns, kinds)
    _tell_of_degrees(found.shapes, found.crs, f"'{path}'")
    return found


def shapes_of_geojson(value: Any, text: str, crs: Any = None) -> ReadShapes:
    """The shapes of a GeoJSON object in a CRS, or in that which it names; raises ValueError."""
    shapes = list(_shapes_in(value, text))
    stated = crs_name(value.get("crs"), text) if crs is None else crs
    return ReadShapes(shapes, None if stated is None else projections.to_lonlat(stated), stated)


def _tell_of_degrees(shapes: Iterable[Shape], crs: Any, thing: str) -> None:
    """Warn of shapes that look like degrees though their CRS is projected."""
    if crs is not None and projections.crs_of(crs).is_projected:
        projections.tell_of_degrees(crs, [_bounds(shape) for shape in shapes], thing)


def tell_of_geojson_in_degrees(value: Any, crs: Any, text: str) -> None:
    """Warn of a GeoJSON object that looks like degrees though its CRS, given or named in it, is projected."""
    crs = crs_name(value.get("crs"), text) if crs is None else crs
    _tell_of_degrees(_shapes_in(value, text), crs, "the geometries")


def _bounds(shape: Shape) -> tuple[float, float, float, float]:
    """Minimum and maximum x, y of a shape, or of a part of it that goes beyond 360; NaN if it is empty."""
    x0 = y0 = np.inf
    x1 = y1 = -np.inf
    stack = [shape.coordinates]
    while stack and max(x1, y1, -x0, -y0) <= _TURN:  # beyond it they are not degrees anyway
        one = stack.pop()
        if not isinstance(one, list | tuple) or not one:
            continue
        if isinstance(one[0], int | float):
            x, y = one[0], one[1] if len(one) > 1 and isinstance(one[1], int | float) else np.nan
            x0, y0, x1, y1 = min(x0, x), min(y0, y), max(x1, x), max(y1, y)
        else:
            stack += one
    return (x0, y0, x1, y1) if x1 >= x0 and y1 >= y0 else (np.nan,) * 4


def _shapes_in(value: Any, text: str) -> Iterator[Shape]:
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
    """A member as a dictionary, {} for null; raises ValueError for other types."""
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


def crs_name(crs: Any, text: str) -> str | None:
    """The CRS named by a member `crs`, as in GeoJSON before RFC 7946; raises ValueError if it is malformed."""
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


def _read_vector(path: Path, layer: str, text: str, columns: list[str] | None, kinds: tuple[str, ...]) -> ReadShapes:
    try:
        pyogrio = importlib.import_module("pyogrio")
    except ImportError as error:
        raise ValueError(
            f"{text} Without pyogrio only GeoJSON can be read: pip install 'projdist[gis]' reads other formats."
        ) from error
    if path.suffix.lower() == ".parquet" and "Parquet" not in pyogrio.list_drivers():
        raise ValueError(f"{text} The GDAL of pyogrio here reads no Parquet; GeoPackage and GeoJSON are read.")
    with _refusing(text), warnings.catch_warnings(action="ignore"):  # as below
        path.stat()
        likely = [layer] if layer else _likely_layers(pyogrio, path, kinds)
    if len(likely) > 1:
        raise ValueError(f"{text} It must name a layer, such as '{path}#{likely[0]}'; it has {', '.join(likely)}.")
    with _refusing(text):
        with warnings.catch_warnings(action="ignore"):  # of details of formats; only the geometries matter here
            meta, _, wkb, values = pyogrio.raw.read(path, layer=likely[0] if likely else None, columns=columns)
        geometries = with_gpx_heights(path, "".join(likely), shapely.from_wkb(wkb))
        crs = projections.to_lonlat(meta["crs"]) if meta["crs"] else None
    if wkb is None:  # a table
        raise ValueError(f"{text} It has no geometries.")
    rows = zip(*values, strict=True) if len(values) else ((),) * len(geometries)
    fields = [dict(zip(map(str, meta["fields"]), row, strict=True)) for row in rows]
    return ReadShapes(list(map(_shape, geometries, fields)), crs, meta["crs"] or None)


@contextlib.contextmanager
def _refusing(text: str) -> Iterator[None]:
    """Turn errors of GDAL into a ValueError in one line that begins with `text`."""
    try:
        yield
    except OSError as error:
        raise ValueError(f"{text} It cannot be read: {error.strerror}.") from error
    except IndexError as error:  # from pyogrio, if a file declares other geometries than it has
        raise ValueError(f"{text} It cannot be read: it is damaged.") from error
    except (RuntimeError, ValueError, shapely.errors.ShapelyError) as error:  # pyogrio's are RuntimeErrors
        raise ValueError(f"{text} It cannot be read: {one_line(error)}.") from error


def _likely_layers(pyogrio: Any, path: Path, kinds: tuple[str, ...]) -> list[str]:
    """Layers with geometries of some kinds if the first has none, as in GPX files; no layers if the first is meant."""
    layers = pyogrio.list_layers(path).tolist() if kinds else []
    if len(layers) < 2:
        return []
    of_kind = [name for name, kind in layers if kind is not None and kind.partition(" ")[0] in (*kinds, "Unknown")]
    full = [name for name in of_kind if pyogrio.read_info(path, layer=name, force_feature_count=True)["features"]]
    return [] if full[:1] == [layers[0][0]] else full


_GPX_POINTS = {"tracks": "track_points", "routes": "route_points"}


def with_gpx_heights(path: Path, layer: str, geometries: AnyArray) -> AnyArray:
    """Tracks or routes of a GPX file with their heights, which GDAL has only in a layer of points."""
    # If some points lack a height no heights are used, with a warning.
    if path.suffix.lower() != ".gpx" or layer not in _GPX_POINTS or not len(geometries):
        return geometries
    pyogrio = importlib.import_module("pyogrio")
    heights = pyogrio.raw.read(path, layer=_GPX_POINTS[layer], columns=["ele"], read_geometry=False)[3][0]
    xy = shapely.get_coordinates(geometries)
    known = int(np.isfinite(heights).sum())
    if known == len(heights) == len(xy):
        xyz = np.column_stack([xy, heights])
        return np.asarray(shapely.transform(shapely.force_3d(geometries), lambda _: xyz, include_z=True))
    if known:
        tell(f"{len(xy) - known} of {len(xy)} points of '{path}#{layer}' have no height; no heights are used.")
    return geometries


def _shape(geometry: shapely.Geometry | None, fields: dict[str, Any]) -> Shape:
    if geometry is None or geometry.is_empty:
        return Shape("", None, fields)
    if geometry.geom_type.endswith("LineString"):  # old versions of GEOS omit its heights in GeoJSON
        return Shape(geometry.geom_type, shapely.geometry.mapping(geometry)["coordinates"], fields)
    found = json.loads(shapely.to_geojson(geometry))
    return Shape(found["type"], found.get("coordinates"), fields)


_SRID = re.compile(r"\s*SRID\s*=\s*(\d+)\s*;", re.IGNORECASE)


def _read_wkt(path: Path, text: str) -> ReadShapes:
    """Shapes of a file of WKT geometries, optionally with one SRID (`SRID=4326;`)."""
    words = read_text(path, text)
    codes = set(_SRID.findall(words))
    if len(codes) > 1:
        raise ValueError(f"{text} Its geometries must have one SRID; they have {', '.join(sorted(codes, key=int))}.")
    # Each begins with a word after the closing bracket of the one before.
    parts = [part for part in re.split(r"(?<=\))\s*(?=[A-Za-z])", _SRID.sub(" ", words).strip()) if part]
    shapes: list[Shape] = []
    for part in parts:
        try:
            with np.errstate(over="ignore"):  # infinite coordinates are rejected later
                geometry = shapely.from_wkt(part)
            members = geometry.geoms if geometry.geom_type == "GeometryCollection" else [geometry]
        except (shapely.errors.GEOSException, NotImplementedError) as error:  # the latter for arcs
            raise ValueError(f"{text} It must hold WKT of geometries: {one_line(error)}.") from error
        shapes += [_shape(member, {}) for member in members if not member.is_empty]
    code = f"EPSG:{codes.pop()}" if codes else None
    return ReadShapes(shapes, None if code is None else projections.to_lonlat(code), code)


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


def read_table(path: Path, text: str, column: str = "weight") -> dict[str, FloatArray]:
    """The columns lon, lat (NaN if missing), and weight (or `column`) and height if it has them; raises ValueError."""
    table = projections.read_point_table(path, text, ragged=True)
    words = [word.lower() for word in table.header]
    places = {"lon": table.lon, "lat": table.lat}
    for key, names in {"weight": _WEIGHTS if column == "weight" else (column.lower(),), "height": HEIGHTS}.items():
        place = next((words.index(name) for name in names if name in words), None)
        if place is not None:
            places[key] = place
    if column != "weight" and "weight" not in places:
        raise ValueError(f"{text} It has no column '{column}' for weights; it has {', '.join(table.header)}.")
    numbers = []
    for number, row in table.rows:
        try:
            numbers.append(
                [
                    np.nan if key in ("lon", "lat") and row[place].strip() in MISSING else number_of(row[place])
                    for key, place in places.items()
                ]
            )
        except (ValueError, IndexError) as error:
            hint = comma_hint(row)
            raise ValueError(f"{text} Line {number} must have numbers for {', '.join(places)}.{hint}") from error
    if not numbers:
        raise ValueError(f"{text} It has no points.")
    return dict(zip(places, np.array(numbers).T, strict=True))
