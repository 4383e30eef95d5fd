"""Regions and lines made of shapes: of files, GeoJSON, geometries and numbers."""

import itertools
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from projdist import earth, projections, support
from projdist._typing import FloatArray
from projdist.earth import WGS84, Ellipsoid
from projdist.regions import files
from projdist.regions.combinations import told_apart
from projdist.regions.files import Shape, Transform
from projdist.regions.language import layer_path
from projdist.regions.polygons import Polygons, area_km2
from projdist.regions.region import PointSet

_ALLOWED = "LON,LAT,LON,LAT,..., positions (n, 2) or (n, 3), a line, or the path of a file with one"
# Degrees (4 cm) that chords may be off edges that are not straight in longitude and latitude; their corrected middles
# are off by a third of that.
_TOLERANCE = 4e-7
_CHANGED = 1e-10  # of the area: smaller changes do not count as repairs
_WIDE, _WIDER = 180.0, 300.0  # degrees: edges whose direction round the Earth is ambiguous

_REPAIRED = (
    "self-intersecting polygon(s) repaired",
    "polygon(s) with holes that leave their shells or overlap repaired by the even-odd rule",
)

_NAMES = ("name", "name_en", "title", "admin", "id", "code")  # fields that name a feature, best first


def polygons_from_file(
    path: Path, layer: str, name: str, *, edges: str = "straight", ellipsoid: Ellipsoid | None = None
) -> Polygons:
    """Union of a vector file's polygons with "straight" edges, or "geodesic" on its body's ellipsoid; ValueError."""
    text = f"Invalid region file '{path}'."
    shapes, transform, crs = files.read(path, layer, text, [], ("Polygon", "MultiPolygon"))
    return _polygons(shapes, transform, name, text, edges, _ellipsoid(crs) or ellipsoid)


def polygons_from_geojson(
    value: dict[str, Any], name: str = "polygons", *, crs: Any = None, edges: str = "straight"
) -> Polygons:
    """The polygons of a GeoJSON object, in longitude and latitude or `crs`; raises ValueError."""
    text = f"Invalid region '{name}'."
    shapes, transform, stated = files.shapes_of_geojson(value, text, crs)
    return _polygons(shapes, transform, name, text, edges, _ellipsoid(stated))


def _ellipsoid(crs: Any) -> Ellipsoid | None:
    """The ellipsoid of a CRS of another body; None for the Earth, as degrees of WGS 84 may be of any body."""
    found = None if crs is None else projections.ground_of(crs)
    return found if found is not None and found.is_of_another_body else None


def features_from_file(path: Path, layer: str = "") -> list[tuple[str, dict[str, Any]]]:
    """The features of a vector file: name, and GeoJSON with the CRS of the file; raises ValueError."""
    shapes, _, crs = files.read(path, layer, f"Invalid region file '{path}'.", None)
    stated = {} if crs is None else {"crs": {"type": "name", "properties": {"name": crs}}}
    features: list[tuple[str, dict[str, Any]]] = []
    for _, group in itertools.groupby(shapes, lambda shape: id(shape.fields)):
        feature = list(group)
        known = [{"type": shape.kind, "coordinates": shape.coordinates} for shape in feature if shape.kind]
        found: dict[str, Any] = {"type": "GeometryCollection", "geometries": known}
        if len(known) < 2:
            found = known[0] if known else {"type": "MultiPolygon", "coordinates": []}
        fields = {
            key.casefold(): str(one) for key, one in feature[0].fields.items() if isinstance(one, str | int) and one
        }
        name = next((fields[key] for key in _NAMES if key in fields), f"{path.stem} {len(features) + 1}")
        features.append((name, found | stated))
    return features


def points_from_file(path: Path, layer: str, name: str, column: str = "weight") -> PointSet:
    """The points of a CSV or vector file, with heights and a column of weights; raises ValueError."""
    text = f"Invalid points file '{path}'."
    if path.suffix.lower() in projections.TEXT_SUFFIXES:
        table = files.read_table(path, text, column)
        weights = table.get("weight", np.ones(len(table["lon"])))
        return _located(table["lon"], table["lat"], weights, name, table.get("height"), text)
    shapes, transform, crs = files.read(path, layer, text, [column, *files.HEIGHTS], ("Point",))
    wrong = {shape.kind for shape in shapes} - {"Point", ""}
    if wrong or not shapes:
        raise ValueError(f"{text} It must hold points; it holds {', '.join(sorted(wrong)) or 'nothing'}.")
    lonlat = np.full((len(shapes), 2), np.nan)
    there = np.array([bool(shape.kind and shape.coordinates != []) for shape in shapes])
    lonlat[there] = files.positions([shapes[k].coordinates for k in np.flatnonzero(there)], text)
    if transform is not None:
        lonlat = np.column_stack(transform(*lonlat.T))
    fields = [shape.fields for shape in shapes]
    if column != "weight" and not any(column in field for field in fields):
        raise ValueError(f"{text} It has no column '{column}' for weights.")
    weight = np.array([_number(field.get(column, 1.0), column, k, text) for k, field in enumerate(fields)])
    named = next((name for name in files.HEIGHTS if any(name in field for field in fields)), files.HEIGHTS[0])
    heights = [field.get(named) for field in fields]
    numbers = None if None in heights else [_number(one, named, k, text) for k, one in enumerate(heights)]
    points = _located(lonlat[:, 0], lonlat[:, 1], weight, name, None if numbers is None else np.array(numbers), text)
    return replace(points, ellipsoid=_ellipsoid(crs))


def _located(
    lon: FloatArray, lat: FloatArray, weight: FloatArray, name: str, height: FloatArray | None, text: str
) -> PointSet:
    """The points with both coordinates, with a note on the others; raises ValueError if none has."""
    known = ~np.isnan(lon + lat)
    if known.all():
        return PointSet(lon, lat, weight, name, height)
    if not known.any():
        raise ValueError(f"{text} It has no points with a longitude and a latitude.")
    note = f"{name}: {np.sum(~known)} of {len(known)} points have no longitude or no latitude, and are left out."
    return PointSet(lon[known], lat[known], weight[known], name, None if height is None else height[known], (note,))


def _number(value: Any, column: str, index: int, text: str) -> float:
    """Value of a column as a number; null is 0."""
    try:
        return float(value or 0.0)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{text} Point {index + 1} must have a number for {column}.") from error


# ---- polygons -------------------------------------------------------------------------------


def _polygons(
    shapes: Sequence[Shape], transform: Transform | None, name: str, text: str, edges: str, ellipsoid: Ellipsoid | None
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
    changes: tuple[list[float], list[float]] = ([], [])  # in km^2, of rings that cross themselves and of other polygons
    for rings in polygons:
        polygon = earth.planar(rings)
        if polygon.is_valid and not any(earth.goes_round(earth.unwrapped(hole)) for hole in rings[1:]):
            pieces += earth.cut_at_antimeridian(polygon)
            continue
        repaired = earth.even_odd(rings)
        if repaired.area > 0.0:
            pieces.append(repaired)
            one_by_one = [earth.planar([ring]) for ring in rings]
            corners = [shapely.get_coordinates(one.exterior) for one in one_by_one]
            # Areas of rings that cross themselves count with their winding numbers.
            shell, *holes = (abs(area_km2(np.hstack([ring[:-1], ring[1:]]), ellipsoid or WGS84)) for ring in corners)
            after = Polygons(earth.merged([repaired]), "", ellipsoid=ellipsoid or WGS84).area_km2
            change = after - (shell - sum(holes))
            if abs(change) > _CHANGED * after:
                changes[all(one.is_valid for one in one_by_one)].append(change)
    if not pieces:
        raise ValueError(f"{text} Its polygons have no area.")
    notes = [f"{empty} feature(s) have no geometry, and are left out."] if empty else []
    repairs = zip(changes, _REPAIRED, strict=True)
    notes += [f"{len(some)} {what}; the area changed by {sum(some):+.6g} km2." for some, what in repairs if some]
    widths = np.concatenate([np.abs(np.diff(ring[:, 0])) for rings in polygons for ring in rings])
    wide = int(np.sum((widths > _WIDE) & (widths < _WIDER)))
    if wide:
        notes.append(f"{wide} edge(s) wider than 180 degrees run the shorter way, across the antimeridian.")
    said = tuple(f"{name}: {note}" for note in notes)
    return told_apart(Polygons(earth.merged(pieces), name, said, ellipsoid=ellipsoid))


def _ring(
    coordinates: Any, transform: Transform | None, text: str, edges: str, ellipsoid: Ellipsoid | None
) -> FloatArray:
    """A ring (m, 2) whose edges are straight in longitude and latitude; raises ValueError."""
    ring = files.positions(coordinates, text)
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
    east, north = ring[-1] - ring[0]
    if north != 0.0 or (east % 360.0 if transform is None else east) != 0.0:  # degrees may close by full turns
        raise ValueError(
            f"{text} Each of its rings must end where it begins; one begins at {ring[0, 0]:g}, {ring[0, 1]:g} and ends "
            f"at {ring[-1, 0]:g}, {ring[-1, 1]:g}."
        )
    if edges == "geodesic":
        curve = projections.geodesics(lonlat, ellipsoid or WGS84)
    elif transform is None:
        return lonlat
    else:

        def curve(t: FloatArray) -> tuple[FloatArray, FloatArray]:
            """Edges straight in the CRS."""
            k = np.minimum(t.astype(int), len(ring) - 2)
            share = (t - k)[:, None]
            return transform(*(ring[k] * (1.0 - share) + ring[k + 1] * share).T)

    return earth.chords(curve, np.arange(len(ring), dtype=float), _TOLERANCE)


# ---- lines ---------------------------------------------------------------------------------------


def line_of(line: Any) -> FloatArray:
    """The vertices (n, 3) of a line in degrees and metres; unknown heights are NaN. Raises ValueError."""
    if isinstance(line, str | os.PathLike):
        return _line_of_text(os.fspath(line))
    shape = getattr(line, "__geo_interface__", line)
    if isinstance(shape, Mapping):
        text = "Invalid line."
        crs = getattr(line, "crs", None)
        shapes, transform, _ = files.shapes_of_geojson(dict(shape), text, crs)
        found = _joined(shapes, transform, text)
        files.tell_of_geojson_in_degrees(shape, crs, text)
        return found
    text = f"Invalid line {support.quoted(line)}."
    if not isinstance(line, list | tuple | np.ndarray):
        raise ValueError(f"{text} It must be {_ALLOWED}.")
    return _checked(_vertices(line, text), text)


def _line_of_text(text: Any) -> FloatArray:
    """The line of numbers with commas, or of a file."""
    said = f"Invalid line {support.quoted(text)}."
    if not isinstance(text, str) or not text:
        raise ValueError(f"{said} It must be {_ALLOWED}.")
    words = [word.strip() for word in text.split(",")]
    unread = [word for word in words if not support.is_number(word)]
    if unread and len(unread) < 0.5 * len(words) and not os.path.exists(text):
        raise ValueError(
            f"{said} Coordinates must be numbers LON,LAT,LON,LAT,...; {support.quoted(unread[0])} is none."
        )
    if unread:
        path, layer = layer_path(text)
        said = f"Invalid line file '{path}'."
        shapes, transform, _ = files.read(path, layer, said, [], ("LineString", "MultiLineString"))
        return _joined(shapes, transform, said)
    if len(words) < 4 or len(words) % 2:
        raise ValueError(f"{said} It must be LON,LAT,LON,LAT,..., two numbers per point.")
    return _checked(_vertices(np.reshape([float(word) for word in words], (-1, 2)), said), said)


def _joined(shapes: Sequence[Shape], transform: Transform | None, text: str) -> FloatArray:
    """The single line that the lines of shapes form, joined end to end; raises ValueError."""
    parts: list[Any] = []
    for shape in shapes:
        if shape.kind not in ("", "LineString", "MultiLineString"):
            raise ValueError(f"{text} It must hold lines only; it holds a {shape.kind}.")
        parts += [shape.coordinates] if shape.kind == "LineString" else shape.coordinates or []
    lines = [_vertices(part, text) for part in parts if part is not None and len(part)]
    if not lines:
        raise ValueError(f"{text} It holds no line.")
    line, rest = lines[0], lines[1:]
    while rest:
        found = next(((k, both) for k, other in enumerate(rest) if (both := _chained(line, other)) is not None), None)
        if found is None:
            raise ValueError(f"{text} It must hold one line, or lines that join end to end; it holds {len(lines)}.")
        line = found[1]
        del rest[found[0]]
    if transform is not None:
        line[:, :2] = np.column_stack(transform(*line[:, :2].T))
    return _checked(line, text)


def _chained(line: FloatArray, other: FloatArray) -> FloatArray | None:
    """Two lines joined in the direction of the first; None if they share no end."""
    for turned in (other, other[::-1]):
        if np.array_equal(line[-1, :2], turned[0, :2]):
            return np.vstack([line, turned[1:]])
        if np.array_equal(turned[-1, :2], line[0, :2]):
            return np.vstack([turned, line[1:]])
    return None


def _vertices(given: Any, text: str) -> FloatArray:
    """Positions with two or three numbers as an array (n, 3)."""
    plane = files.positions(given, text)
    heights = [position[2] if len(position) > 2 else np.nan for position in given]
    try:
        return np.column_stack([plane, np.array(heights, dtype=float)])
    except (TypeError, ValueError) as error:
        raise ValueError(f"{text} Its heights must be numbers.") from error


def _checked(line: FloatArray, text: str) -> FloatArray:
    """The line without repeated vertices; raises ValueError off the globe or for fewer than two places."""
    if not (np.abs(line[:, :2]) <= [360.0, 90.0]).all():
        raise ValueError(
            f"{text} Its longitudes must lie within -360 and 360 degrees, and its latitudes within -90 and 90, or the "
            "file must state another CRS."
        )
    moves = np.append(True, (np.diff(line[:, :2], axis=0) != 0.0).any(axis=1))
    if moves.sum() < 2:
        raise ValueError(f"{text} It must have two places or more.")
    return line[moves]
