"""Regions from the shapes of files: polygons and points."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely

from projdist._typing import FloatArray
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
from projdist.projections import TEXT_SUFFIXES, geodesics, ground_of, to_lonlat
from projdist.regions.chains import area_km2
from projdist.regions.parts import told_apart
from projdist.regions.points import HEIGHTS, PointSet, placed, read_csv
from projdist.regions.polygons import Polygons
from projdist.regions.reading import Shape, Transform, crs_name, positions, read, shapes_of

# Degrees, 4 cm: of chords for edges that are not straight in longitude and latitude, which their moved middles then
# leave by a third.
_TOLERANCE = 4e-7
_CHANGED = 1e-10  # of the area: a repair that changes less is none
_WIDE, _WIDER = 180.0, 300.0  # an edge as wide as that may be meant to go either way round

Rings = list[FloatArray]

_NAMES = ("name", "name_en", "title", "admin", "id", "code")  # of the fields that name a feature, the best first


def polygons_from_file(
    path: Path, layer: str, name: str, *, edges: str = "straight", ellipsoid: Ellipsoid | None = None
) -> Polygons:
    """The polygons of a vector file, what overlaps counted once; raises ValueError.

    `edges`: "straight" in the file's own coordinates, or "geodesic" from vertex to vertex, on the ellipsoid of the
    file's body, or, where its CRS is not another one's, on the one given.
    """
    text = f"Invalid region file '{path}'."
    shapes, transform, crs = read(path, layer, text, [], ("Polygon", "MultiPolygon"))
    return _polygons(shapes, transform, name, text, edges, _ellipsoid(crs) or ellipsoid)


def polygons_from_geojson(
    value: dict[str, Any], name: str = "polygons", *, crs: Any = None, edges: str = "straight"
) -> Polygons:
    """The polygons of a GeoJSON object, in a CRS if not in longitude and latitude; raises ValueError."""
    text = f"Invalid region '{name}'."
    stated = crs_name(value.get("crs"), text) if crs is None else crs
    transform = None if stated is None else to_lonlat(stated)
    return _polygons(list(shapes_of(value, text)), transform, name, text, edges, _ellipsoid(stated))


def _ellipsoid(crs: Any) -> Ellipsoid | None:
    """The ellipsoid of the body that what is in a CRS is on: another one's, as degrees of WGS 84 are anybody's."""
    found = None if crs is None else ground_of(crs)
    return found if found is not None and found.is_of_another_body else None


def features_from_file(path: Path, layer: str = "") -> list[tuple[str, dict[str, Any]]]:
    """The features of a vector file, each by its name and as GeoJSON with the CRS of the file; raises ValueError."""
    shapes, _, crs = read(path, layer, f"Invalid region file '{path}'.", None)
    grouped = [list(group) for _, group in itertools.groupby(shapes, lambda shape: id(shape.fields))]
    return [
        (_feature_name(group[0].fields) or f"{path.stem} {number}", _feature(group, crs))
        for number, group in enumerate(grouped, start=1)
    ]


def _feature_name(fields: dict[str, Any]) -> str:
    """What a feature calls itself, "" if it does not."""
    known = {key.casefold(): str(value) for key, value in fields.items() if isinstance(value, str | int) and value}
    return next((known[key] for key in _NAMES if key in known), "")


def _feature(shapes: Sequence[Shape], crs: str | None) -> dict[str, Any]:
    """GeoJSON of the shapes of a feature; of one without a geometry, polygons that are none."""
    known = [{"type": shape.kind, "coordinates": shape.coordinates} for shape in shapes if shape.kind]
    found: dict[str, Any] = {"type": "GeometryCollection", "geometries": known}
    if len(known) < 2:
        found = known[0] if known else {"type": "MultiPolygon", "coordinates": []}
    return found if crs is None else found | {"crs": {"type": "name", "properties": {"name": crs}}}


def points_from_file(path: Path, layer: str, name: str, column: str = "weight") -> PointSet:
    """The points of a CSV or vector file, with its height column, and that for weights; raises ValueError."""
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
    """A value of a column; what is null is 0."""
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
    """Whether a ring crosses itself (or a hole leaves its shell), and by how many km^2 the area changed."""

    crosses: bool
    change: float


def _repairs(rings: Rings, repaired: shapely.Geometry, ellipsoid: Ellipsoid) -> Iterator[_Repair]:
    """What the even-odd rule has changed of a polygon, if anything."""
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
    """A ring of longitudes and latitudes (m, 2), whose edges are straight in these."""
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
    """Whether a ring ends where it begins; in degrees that may be a turn on."""
    east, north = ring[-1] - ring[0]
    return bool(north == 0.0 and (east % 360.0 == 0.0 if degrees else east == 0.0))


def _straight_in(ring: FloatArray, transform: Transform) -> FloatArray:
    """The chords of edges that are straight in the coordinates of a CRS."""

    def curve(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        k = np.minimum(t.astype(int), len(ring) - 2)
        share = (t - k)[:, None]
        return transform(*(ring[k] * (1.0 - share) + ring[k + 1] * share).T)

    return chords(curve, np.arange(len(ring), dtype=float), _TOLERANCE)


def _ground_area(polygon: shapely.Polygon, ellipsoid: Ellipsoid) -> float:
    """Area in km^2 that a shell goes round, as often as it does."""
    ring = shapely.get_coordinates(polygon.exterior)
    return abs(area_km2(np.hstack([ring[:-1], ring[1:]]), ellipsoid))
