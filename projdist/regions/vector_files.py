"""Regions from the shapes of files: GeoJSON, WKT and other vector formats."""

from __future__ import annotations

import contextlib
import importlib
import itertools
import json
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely

from projdist._typing import AnyArray, FloatArray
from projdist.earth import (
    WGS84,
    Ellipsoid,
    chords,
    cut_at_antimeridian,
    even_odd,
    goes_round,
    merged,
    planar,
    unwrapped,
)
from projdist.projections import TEXT_SUFFIXES, crs_of, geodesics, ground_of, tell_of_degrees, to_lonlat
from projdist.regions.chains import area_km2
from projdist.regions.parts import told_apart
from projdist.regions.points import HEIGHTS, PointSet, placed, read_csv
from projdist.regions.polygons import Polygons
from projdist.support import one_line, read_text, shown, tell

Transform = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]

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
    crs: str | None = None


def read(path: Path, layer: str, text: str, columns: list[str] | None, kinds: tuple[str, ...] = ()) -> ReadShapes:
    """The shapes of a vector file with some or (None) all columns; raises ValueError that begins with `text`.

    The default layer is the first, or, if that has nothing of these `kinds`, the only one that has. Warns of
    coordinates that look like degrees if the file states metres.
    """
    found = _read(path, layer, text, columns, kinds)
    tell_of_shapes_in_degrees(found.shapes, found.crs, f"'{path}'")
    return found


def _read(path: Path, layer: str, text: str, columns: list[str] | None, kinds: tuple[str, ...]) -> ReadShapes:
    if path.suffix.lower() == ".wkt":
        return _read_wkt(path, text)
    if path.suffix.lower() not in (".geojson", ".json"):
        return _read_vector(path, layer, text, columns, kinds)
    value = _read_json(path, text)
    return ReadShapes(list(shapes_of(value, text)), stated_transform(value, text), crs_name(value.get("crs"), text))


def tell_of_shapes_in_degrees(shapes: Iterable[Shape], crs: Any, thing: str) -> None:
    """Warn of shapes that look like degrees in a projected CRS."""
    if crs is not None and crs_of(crs).is_projected:
        tell_of_degrees(crs, [_bounds(shape) for shape in shapes], thing)


def tell_of_geojson_in_degrees(value: Any, crs: Any, text: str) -> None:
    """`tell_of_shapes_in_degrees` for a GeoJSON object in a CRS, or in the one that it names."""
    crs = crs_name(value.get("crs"), text) if crs is None else crs
    if crs is not None:
        tell_of_shapes_in_degrees(shapes_of(value, text), crs, "the geometries")


def _bounds(shape: Shape) -> tuple[float, float, float, float]:
    """Minimum and maximum x, y of a shape, NaN if empty; of a shape beyond 360 perhaps of a part of it."""
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


def stated_transform(value: Any, text: str) -> Transform | None:
    """Transformation to longitude and latitude from the CRS in the member `crs`; None without one."""
    name = crs_name(value.get("crs"), text)
    return None if name is None else to_lonlat(name)


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
    with _refusing(text):
        path.stat()
        likely = [layer] if layer else _likely_layers(pyogrio, path, kinds)
    if len(likely) > 1:
        raise ValueError(f"{text} It must name a layer, as '{path}#{likely[0]}'; it has {', '.join(likely)}.")
    with _refusing(text):
        with warnings.catch_warnings():
            # GDAL and pyogrio warn of details of formats; only the geometries matter here.
            warnings.simplefilter("ignore")
            meta, _, wkb, values = pyogrio.raw.read(path, layer=likely[0] if likely else None, columns=columns)
        geometries = with_gpx_heights(path, "".join(likely), shapely.from_wkb(wkb))
        crs = to_lonlat(meta["crs"]) if meta["crs"] else None
    if wkb is None:  # a table
        raise ValueError(f"{text} It has no geometries.")
    rows = zip(*values, strict=True) if len(values) else ((),) * len(geometries)
    names = [str(field) for field in meta["fields"]]
    found = [
        Shape("", None, dict(zip(names, row, strict=True)))
        if geometry is None or geometry.is_empty
        else _shape(geometry, dict(zip(names, row, strict=True)))
        for geometry, row in zip(geometries, rows, strict=True)
    ]
    return ReadShapes(found, crs, meta["crs"] or None)


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
    """Layers with geometries of some kinds if the first has none; empty if the first is meant.

    A GPX file has layers for waypoints, routes and tracks, and mostly only one is not empty.
    """
    layers = pyogrio.list_layers(path).tolist() if kinds else []
    if len(layers) < 2:
        return []
    of_kind = [name for name, kind in layers if kind is not None and kind.partition(" ")[0] in (*kinds, "Unknown")]
    full = [name for name in of_kind if pyogrio.read_info(path, layer=name, force_feature_count=True)["features"]]
    return [] if full[:1] == [layers[0][0]] else full


_GPX_POINTS = {"tracks": "track_points", "routes": "route_points"}


def with_gpx_heights(path: Path, layer: str, geometries: AnyArray) -> AnyArray:
    """Tracks or routes of a GPX file with their heights, which GDAL has only in a layer of points.

    If some points lack a height no heights are used, with a warning.
    """
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


def _shape(geometry: shapely.Geometry, fields: dict[str, Any]) -> Shape:
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
    return ReadShapes(shapes, None if code is None else to_lonlat(code), code)


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


# ---- regions of files ----------------------------------------------------------------------------


# Degrees, 4 cm: of chords for edges that are not straight in longitude and latitude; their corrected middles are off
# by a third of it.
_TOLERANCE = 4e-7
_CHANGED = 1e-10  # of the area: smaller changes do not count as repairs
_WIDE, _WIDER = 180.0, 300.0  # degrees: edges whose direction round the Earth is ambiguous

Rings = list[FloatArray]

_NAMES = ("name", "name_en", "title", "admin", "id", "code")  # fields that name a feature, best first


def polygons_from_file(
    path: Path, layer: str, name: str, *, edges: str = "straight", ellipsoid: Ellipsoid | None = None
) -> Polygons:
    """The union of the polygons of a vector file; raises ValueError.

    `edges`: "straight" in the file's coordinates, or "geodesic", on the ellipsoid of the file's body if that is not the
    Earth, else on the one given.
    """
    text = f"Invalid region file '{path}'."
    shapes, transform, crs = read(path, layer, text, [], ("Polygon", "MultiPolygon"))
    return _polygons(shapes, transform, name, text, edges, _ellipsoid(crs) or ellipsoid)


def polygons_from_geojson(
    value: dict[str, Any], name: str = "polygons", *, crs: Any = None, edges: str = "straight"
) -> Polygons:
    """The polygons of a GeoJSON object, in longitude and latitude or `crs`; raises ValueError."""
    text = f"Invalid region '{name}'."
    stated = crs_name(value.get("crs"), text) if crs is None else crs
    transform = None if stated is None else to_lonlat(stated)
    return _polygons(list(shapes_of(value, text)), transform, name, text, edges, _ellipsoid(stated))


def _ellipsoid(crs: Any) -> Ellipsoid | None:
    """The ellipsoid of a CRS of another body; None for the Earth, as degrees of WGS 84 may be of any body."""
    found = None if crs is None else ground_of(crs)
    return found if found is not None and found.is_of_another_body else None


def features_from_file(path: Path, layer: str = "") -> list[tuple[str, dict[str, Any]]]:
    """The features of a vector file: name, and GeoJSON with the CRS of the file; raises ValueError."""
    shapes, _, crs = read(path, layer, f"Invalid region file '{path}'.", None)
    grouped = [list(group) for _, group in itertools.groupby(shapes, lambda shape: id(shape.fields))]
    return [
        (_feature_name(group[0].fields) or f"{path.stem} {number}", _feature(group, crs))
        for number, group in enumerate(grouped, start=1)
    ]


def _feature_name(fields: dict[str, Any]) -> str:
    """Name of a feature from its fields; "" without one."""
    known = {key.casefold(): str(value) for key, value in fields.items() if isinstance(value, str | int) and value}
    return next((known[key] for key in _NAMES if key in known), "")


def _feature(shapes: Sequence[Shape], crs: str | None) -> dict[str, Any]:
    """GeoJSON of the shapes of a feature; an empty MultiPolygon without a geometry."""
    known = [{"type": shape.kind, "coordinates": shape.coordinates} for shape in shapes if shape.kind]
    found: dict[str, Any] = {"type": "GeometryCollection", "geometries": known}
    if len(known) < 2:
        found = known[0] if known else {"type": "MultiPolygon", "coordinates": []}
    return found if crs is None else found | {"crs": {"type": "name", "properties": {"name": crs}}}


def points_from_file(path: Path, layer: str, name: str, column: str = "weight") -> PointSet:
    """The points of a CSV or vector file, with heights and a column of weights; raises ValueError."""
    if path.suffix.lower() in TEXT_SUFFIXES:
        return read_csv(path, name, column)
    text = f"Invalid points file '{path}'."
    shapes, transform, crs = read(path, layer, text, [column, *HEIGHTS], ("Point",))
    wrong = {shape.kind for shape in shapes} - {"Point", ""}
    if wrong or not shapes:
        raise ValueError(f"{text} It must hold points; it holds {', '.join(sorted(wrong)) or 'nothing'}.")
    lonlat = np.full((len(shapes), 2), np.nan)
    there = np.array([bool(shape.kind and shape.coordinates != []) for shape in shapes])
    lonlat[there] = positions([shape.coordinates for shape, known in zip(shapes, there, strict=True) if known], text)
    if transform is not None:
        lonlat = np.column_stack(transform(*lonlat.T))
    fields = [shape.fields for shape in shapes]
    if column != "weight" and not any(column in field for field in fields):
        raise ValueError(f"{text} It has no column '{column}' for weights.")
    weight = np.array([_number(field.get(column, 1.0), column, k, text) for k, field in enumerate(fields)])
    named = next((name for name in HEIGHTS if any(name in field for field in fields)), HEIGHTS[0])
    heights = [field.get(named) for field in fields]
    numbers = None if None in heights else [_number(one, named, k, text) for k, one in enumerate(heights)]
    points = placed(lonlat[:, 0], lonlat[:, 1], weight, name, None if numbers is None else np.array(numbers), text)
    return replace(points, ellipsoid=_ellipsoid(crs))


def _number(value: Any, column: str, index: int, text: str) -> float:
    """Value of a column as a number; null is 0."""
    try:
        return float(value or 0.0)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{text} Point {index + 1} must have a number for {column}.") from error


# ---- polygons -------------------------------------------------------------------------------


def _polygons(
    shapes: Sequence[Shape],
    transform: Transform | None,
    name: str,
    text: str,
    edges: str,
    ellipsoid: Ellipsoid | None,
) -> Polygons:
    given: list[Any] = []
    empty = 0
    for shape in shapes:
        if not shape.kind or shape.coordinates == []:
            empty += 1
            continue
        if shape.kind not in ("Polygon", "MultiPolygon"):
            raise ValueError(f"{text} It must hold polygons only; it holds a {shape.kind}.")
        parts = [shape.coordinates] if shape.kind == "Polygon" else shape.coordinates
        if not (isinstance(parts, list | tuple) and all(isinstance(rings, list | tuple) for rings in parts)):
            raise ValueError(f"{text} Its polygons must have coordinates, lists of rings.")
        given += parts
    polygons = [[_ring(ring, transform, text, edges, ellipsoid) for ring in rings] for rings in given if rings]
    if not polygons:
        raise ValueError(f"{text} It holds no polygons.")
    pieces: list[shapely.Geometry] = []
    repairs: list[_Repair] = []
    for rings in polygons:
        polygon = planar(rings)
        if polygon.is_valid and not any(goes_round(unwrapped(hole)) for hole in rings[1:]):
            pieces += cut_at_antimeridian(polygon)
            continue
        repaired = even_odd(rings)
        if repaired.area > 0.0:
            pieces.append(repaired)
            repairs += _repairs(rings, repaired, ellipsoid or WGS84)
    if not pieces:
        raise ValueError(f"{text} Its polygons have no area.")
    notes = [f"{empty} feature(s) have no geometry, and are left out."] if empty else []
    notes += _notes(polygons, repairs)
    said = tuple(f"{name}: {note}" for note in notes)
    return told_apart(Polygons(merged(pieces), name, said, ellipsoid=ellipsoid))


class _Repair(NamedTuple):
    """A repair: True if a ring crosses itself (else a hole leaves its shell), and the change of area in km^2."""

    crosses: bool
    change: float


def _repairs(rings: Rings, repaired: shapely.Geometry, ellipsoid: Ellipsoid) -> Iterator[_Repair]:
    """The repair of a polygon by the even-odd rule, if it changed the area."""
    one_by_one = [planar([ring]) for ring in rings]
    shell, *holes = (_ground_area(one, ellipsoid) for one in one_by_one)
    after = Polygons(merged([repaired]), "", ellipsoid=ellipsoid).area_km2
    change = after - (shell - sum(holes))
    if abs(change) > _CHANGED * after:
        yield _Repair(not all(one.is_valid for one in one_by_one), change)


def _notes(polygons: list[Rings], repairs: list[_Repair]) -> Iterator[str]:
    for crosses, what in (
        (True, "self-intersecting polygon(s) repaired"),
        (False, "polygon(s) with holes that leave their shells or overlap repaired by the even-odd rule"),
    ):
        changes = [repair.change for repair in repairs if repair.crosses == crosses]
        if changes:
            yield f"{len(changes)} {what}; the area changed by {sum(changes):+.6g} km2."
    widths = np.concatenate([np.abs(np.diff(ring[:, 0])) for rings in polygons for ring in rings])
    wide = int(np.sum((widths > _WIDE) & (widths < _WIDER)))
    if wide:
        yield f"{wide} edge(s) wider than 180 degrees run the shorter way, across the antimeridian."


def _ring(
    coordinates: Any, transform: Transform | None, text: str, edges: str, ellipsoid: Ellipsoid | None
) -> FloatArray:
    """A ring (m, 2) whose edges are straight in longitude and latitude; raises ValueError."""
    ring = positions(coordinates, text)
    if len(ring) < 4:
        raise ValueError(f"{text} Each of its rings must have four positions or more; one has {len(ring)}.")
    lonlat = ring if transform is None else np.column_stack(transform(*ring.T))
    wrong = ~((np.abs(lonlat[:, 0]) <= 360.0) & (np.abs(lonlat[:, 1]) <= 90.0))
    if wrong.any():
        x, y = ring[np.argmax(wrong)]
        raise ValueError(
            f"{text} Its coordinates must be longitudes within -360 and 360 and latitudes within -90 and 90, or the "
            f"file must state another CRS; it has {x:.10g}, {y:.10g}."
        )
    if not _is_closed(ring, degrees=transform is None):
        raise ValueError(
            f"{text} Each of its rings must end where it begins; one begins at {ring[0, 0]:g}, {ring[0, 1]:g} and ends "
            f"at {ring[-1, 0]:g}, {ring[-1, 1]:g}."
        )
    if edges == "geodesic":
        return chords(geodesics(lonlat, ellipsoid or WGS84), np.arange(len(ring), dtype=float), _TOLERANCE)
    return lonlat if transform is None else _straight_in(ring, transform)


def _is_closed(ring: FloatArray, *, degrees: bool) -> bool:
    """True if a ring is closed, in degrees also up to full turns."""
    east, north = ring[-1] - ring[0]
    return bool(north == 0.0 and (east % 360.0 == 0.0 if degrees else east == 0.0))


def _straight_in(ring: FloatArray, transform: Transform) -> FloatArray:
    """Chords in longitude and latitude of edges straight in a CRS."""

    def curve(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        k = np.minimum(t.astype(int), len(ring) - 2)
        share = (t - k)[:, None]
        return transform(*(ring[k] * (1.0 - share) + ring[k + 1] * share).T)

    return chords(curve, np.arange(len(ring), dtype=float), _TOLERANCE)


def _ground_area(polygon: shapely.Polygon, ellipsoid: Ellipsoid) -> float:
    """Area in km^2 enclosed by a shell, counted with its winding number."""
    ring = shapely.get_coordinates(polygon.exterior)
    return abs(area_km2(np.hstack([ring[:-1], ring[1:]]), ellipsoid))
