"""Regions from files: GeoJSON by itself, other vector formats by pyogrio."""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from projdist._typing import FloatArray
from projdist.projections.geodesy import geodesics, to_lonlat
from projdist.regions.chains import area_km2
from projdist.regions.points import PointSet, read_csv
from projdist.regions.polygons import Polygons
from projdist.rings import chords, cut_at_antimeridian, merged, planar

_TOLERANCE = 1e-7  # degrees, 1 cm: of chords for edges that are not straight in longitude and latitude
_WIDE, _WIDER = 180.0, 300.0  # an edge as wide as that may be meant to go either way round

Rings = list[FloatArray]
Transform = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]


def polygons_from_file(path: Path, layer: str, name: str, *, edges: str = "straight") -> Polygons:
    """The polygons of a vector file, what overlaps counted once; raises ValueError.

    `edges`: "straight" in the file's own coordinates, or "geodesic" from vertex to vertex.
    """
    text = f"Invalid region file '{path}'."
    shapes, transform = _shapes(path, layer, text)
    return _polygons(shapes, transform, name, text, edges)


def polygons_from_geojson(value: dict[str, Any], name: str = "polygons", *, edges: str = "straight") -> Polygons:
    """The polygons of a GeoJSON object; raises ValueError."""
    text = f"Invalid region '{name}'."
    return _polygons(list(_geometries(value, text)), None, name, text, edges)


def points_from_file(path: Path, layer: str, name: str, column: str = "weight") -> PointSet:
    """The points of a CSV or vector file, with its height column, and that for weights; raises ValueError."""
    if path.suffix.lower() in (".csv", ".tsv", ".txt"):
        return read_csv(path, name, column)
    text = f"Invalid points file '{path}'."
    if _is_geojson(path):
        value = _read_json(path, text)
        features = value.get("features", [value]) if isinstance(value, dict) else []
        shapes = [shape for feature in features for shape in _geometries(feature, text)]
        fields = [feature.get("properties") or {} for feature in features]
        transform = _geojson_transform(value)
    else:
        shapes, fields, transform = _read_vector(path, layer, text, [column, "height"])
    wrong = {shape["type"] for shape in shapes} - {"Point"}
    if wrong or not shapes:
        raise ValueError(f"{text} It must hold points; it holds {_listed(wrong) or 'nothing'}.")
    lonlat = np.array([shape["coordinates"][:2] for shape in shapes], dtype=float)
    if transform is not None:
        lonlat = np.column_stack(transform(*lonlat.T))
    if column != "weight" and not any(column in field for field in fields):
        raise ValueError(f"{text} It has no column '{column}' for weights.")
    weight = np.array([float(field.get(column, 1.0) or 0.0) for field in fields])
    heights = [field.get("height") for field in fields]
    height = None if None in heights else np.array(heights, dtype=float)
    return PointSet(lonlat[:, 0], lonlat[:, 1], weight, name, height)


def _listed(kinds: set[str]) -> str:
    return ", ".join(sorted(kinds))


# ---- reading --------------------------------------------------------------------------------


def _is_geojson(path: Path) -> bool:
    return path.suffix.lower() in (".geojson", ".json")


def _shapes(path: Path, layer: str, text: str) -> tuple[list[dict[str, Any]], Transform | None]:
    """The GeoJSON geometries of a file, and the function from its coordinates to longitude and latitude."""
    if _is_geojson(path):
        value = _read_json(path, text)
        return list(_geometries(value, text)), _geojson_transform(value)
    shapes, _, transform = _read_vector(path, layer, text, [])
    return shapes, transform


def _read_json(path: Path, text: str) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ValueError(f"{text} It cannot be read: {error.strerror}.") from error
    except ValueError as error:
        raise ValueError(f"{text} It must be GeoJSON: {error}.") from error


def _geojson_transform(value: Any) -> Transform | None:
    """The transformation that the member `crs` asks for, which files from before RFC 7946 may have."""
    name = ((value.get("crs") or {}).get("properties") or {}).get("name") if isinstance(value, dict) else None
    return to_lonlat(name) if name else None


def _geometries(value: Any, text: str) -> Iterator[dict[str, Any]]:
    """The simple geometries in a GeoJSON object."""
    kind = value.get("type") if isinstance(value, dict) else None
    if kind == "FeatureCollection":
        for feature in value.get("features") or []:
            yield from _geometries(feature, text)
    elif kind == "Feature":
        if value.get("geometry"):
            yield from _geometries(value["geometry"], text)
    elif kind == "GeometryCollection":
        for geometry in value.get("geometries") or []:
            yield from _geometries(geometry, text)
    elif kind in ("Point", "MultiPoint", "LineString", "MultiLineString", "Polygon", "MultiPolygon"):
        yield value
    else:
        raise ValueError(f"{text} It must be GeoJSON; it has an object of type {kind!r}.")


def _read_vector(
    path: Path, layer: str, text: str, columns: list[str]
) -> tuple[list[dict[str, Any]], list[dict[str, Any]], Transform | None]:
    """Geometries, fields and transformation of a file in another format."""
    try:
        pyogrio = importlib.import_module("pyogrio")
    except ImportError as error:
        raise ValueError(
            f"{text} Without pyogrio only GeoJSON can be read: pip install 'projdist[gis]' reads other formats."
        ) from error
    if not path.exists():
        raise ValueError(f"{text} It cannot be read: No such file or directory.")
    try:
        meta, _, wkb, values = pyogrio.raw.read(path, layer=layer or None, columns=columns)
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, ValueError) as error:
        raise ValueError(f"{text} It cannot be read: {' '.join(str(error).split()).rstrip('.')}.") from error
    shapes = [json.loads(shapely.to_geojson(shape)) for shape in shapely.from_wkb(wkb) if shape is not None]
    names = [str(field) for field in meta["fields"]]
    fields = [dict(zip(names, row, strict=True)) for row in zip(*values, strict=True)] if names else [{}] * len(shapes)
    return shapes, fields, to_lonlat(meta["crs"]) if meta["crs"] else None


# ---- polygons -------------------------------------------------------------------------------


def _polygons(
    shapes: Sequence[dict[str, Any]], transform: Transform | None, name: str, text: str, edges: str
) -> Polygons:
    given: list[Rings] = []
    for shape in shapes:
        if shape["type"] not in ("Polygon", "MultiPolygon"):
            raise ValueError(f"{text} It must hold polygons only; it holds a {shape['type']}.")
        given += [shape["coordinates"]] if shape["type"] == "Polygon" else shape["coordinates"]
    polygons = [[_ring(ring, transform, text, edges) for ring in rings] for rings in given if rings]
    if not polygons:
        raise ValueError(f"{text} It holds no polygons.")
    parts: list[shapely.Polygon] = []
    change, repaired = 0.0, 0
    for rings in polygons:
        polygon = planar(rings)
        valid = polygon if polygon.is_valid else shapely.make_valid(polygon)
        pieces = list(cut_at_antimeridian(valid))
        if valid is not polygon and pieces:
            before = _ground_area(polygon)
            after = Polygons(merged(pieces), name).area_km2
            repaired, change = repaired + 1, change + after - before
        parts += pieces
    if not parts:
        raise ValueError(f"{text} Its polygons have no area.")
    notes = _notes(polygons, repaired, change)
    return Polygons(merged(parts), name, tuple(f"{name}: {note}" for note in notes))


def _notes(polygons: list[Rings], repaired: int, change: float) -> Iterator[str]:
    if repaired:
        yield f"{repaired} self-intersecting polygon(s) repaired; the area changed by {change:+.6g} km2."
    widths = np.concatenate([np.abs(np.diff(ring[:, 0])) for rings in polygons for ring in rings])
    wide = int(np.sum((widths > _WIDE) & (widths < _WIDER)))
    if wide:
        yield f"{wide} edge(s) wider than 180 degrees run the shorter way, across the antimeridian."


def _ring(coordinates: Any, transform: Transform | None, text: str, edges: str) -> FloatArray:
    """A ring of longitudes and latitudes (m, 2), whose edges are straight in these."""
    try:
        ring = np.array([position[:2] for position in coordinates], dtype=float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{text} Its coordinates must be numbers.") from error
    if ring.ndim != 2 or ring.shape[1] != 2 or len(ring) < 4:
        raise ValueError(f"{text} Each of its rings must have four positions or more; one has {len(ring)}.")
    if not np.isfinite(ring).all():
        raise ValueError(f"{text} Its coordinates must be finite numbers.")
    if (ring[0] != ring[-1]).any():
        raise ValueError(
            f"{text} Each of its rings must end where it begins; one begins at {ring[0, 0]:g}, {ring[0, 1]:g} and ends "
            f"at {ring[-1, 0]:g}, {ring[-1, 1]:g}."
        )
    if transform is not None:
        ring = _straight_in(ring, transform) if edges == "straight" else np.column_stack(transform(*ring.T))
    wrong = ~((np.abs(ring[:, 0]) <= 360.0) & (np.abs(ring[:, 1]) <= 90.0))
    if wrong.any():
        x, y = ring[np.argmax(wrong)]
        raise ValueError(
            f"{text} Its coordinates must be longitudes within -360 and 360 and latitudes within -90 and 90, or the "
            f"file must state another CRS; it has {x:.10g}, {y:.10g}."
        )
    if edges == "geodesic":
        ring = chords(geodesics(ring), np.arange(len(ring), dtype=float), _TOLERANCE)
    return ring


def _straight_in(ring: FloatArray, transform: Transform) -> FloatArray:
    """The chords of edges that are straight in the coordinates of a CRS."""

    def curve(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        k = np.minimum(t.astype(int), len(ring) - 2)
        share = (t - k)[:, None]
        return transform(*(ring[k] * (1.0 - share) + ring[k + 1] * share).T)

    return chords(curve, np.arange(len(ring), dtype=float), _TOLERANCE)


def _ground_area(polygon: shapely.Polygon) -> float:
    """Area in km^2 that a shell goes round, as often as it does, less that of the holes."""
    shell, *holes = (shapely.get_coordinates(ring) for ring in (polygon.exterior, *polygon.interiors))
    return abs(_area_within(shell)) - sum(abs(_area_within(hole)) for hole in holes)


def _area_within(ring: FloatArray) -> float:
    return area_km2(np.hstack([ring[:-1], ring[1:]]))
