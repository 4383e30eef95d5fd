"""Distances on a map compared with those on the ground, at points with heights."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from projdist import answers, earth, matrices, projections, regions, support
from projdist._typing import AnyPath, ArrayLike, FloatArray
from projdist.field import Nodes, nodes_at, nodes_of

_GEOID = 120.0  # metres: the Earth's geoid lies -107 to 86 m above the ellipsoid
_NODES, _SEARCHED = 4000, 400  # about how many points a region of one height has, and a search uses


def distortion_ppm(
    projection: projections.ProjectionLike, lon: ArrayLike, lat: ArrayLike, height: ArrayLike
) -> FloatArray:
    """Relative error of grid distances against those on the ground, in ppm: combined factor - 1.

    The combined factor is `elevation_factor` times the geometric mean of the principal scales.

    Parameters
    ----------
    projection : ProjectionLike
        Whatever `Projection.from_user_input` takes.
    lon, lat : array_like (...)
        Degrees.
    height : array_like (...)
        Ellipsoidal heights in metres. The three are broadcast against each other.

    Returns
    -------
    ndarray (...)
        Parts per million; NaN where the map is undefined.

    Raises
    ------
    ValueError
        For values that are no numbers, and shapes that do not go together.
    ProjectionError
        For a projection that PROJ refuses.

    References
    ----------
    J. E. Stem 1989, State Plane Coordinate System of 1983, NOAA Manual NOS NGS 5: grid and elevation factors.

    Examples
    --------
    UTM's scale on its central meridian is 0.9996; up there it is less:

    >>> distortion_ppm("EPSG:32632", 9, 48, [0, 500]).round(2)
    array([-400.  , -478.33])
    """
    projection = projections.Projection.from_user_input(projection)
    lon, lat = support.check_degrees(lon, lat)
    lat, height = support.check_degrees(lat, support.check_numbers("heights", height))
    lon = np.broadcast_to(lon, lat.shape)
    nodes = nodes_at(lon.ravel(), lat.ravel(), np.ones(lon.size), projection.ellipsoid)
    scale = np.sqrt(matrices.areal_scale(nodes.jacobian(projection)[0])).reshape(lon.shape)
    return 1e6 * (scale * answers.elevation_factor(lat, height, projection.ellipsoid) - 1.0)


# ---- points of the ground -------------------------------------------------------------------


class Ground(NamedTuple):
    """Points with weights that sum to 1, and their ellipsoidal heights; `is_level` if they are all the same.

    `geoid_height` is what was added to orthometric heights.
    """

    nodes: Nodes
    height: FloatArray
    is_level: bool
    geoid_height: FloatArray | None = None

    def ppm(self, projection: projections.ProjectionLike) -> FloatArray:
        """The distortion at the points."""
        return distortion_ppm(projection, self.nodes.lon, self.nodes.lat, self.height)

    def raised(self, geoid: AnyPath | float) -> Ground:
        """The ground with a geoid's heights, from a grid or one in metres, added to its orthometric heights."""
        lon, lat = self.nodes.lon, self.nodes.lat
        if isinstance(geoid, str | os.PathLike):
            added, is_level = projections.geoid_heights(geoid, lon, lat), False
        else:
            added, is_level = np.full(lon.size, support.check_number("height of the geoid", geoid)), self.is_level
        if not np.abs(added).max() <= _GEOID:
            raise ValueError(f"Invalid geoid '{geoid}'. Its heights must lie within -{_GEOID:g} and {_GEOID:g} m.")
        return Ground(self.nodes, self.height + added, is_level, added)

    def fewer(self, region: regions.Place) -> Ground:
        """About 400 of the points, or all if there are few."""
        nodes = self.nodes
        if self.is_level:
            few = nodes_of(region, nodes.ellipsoid, _SEARCHED, edges=True)
            return Ground(few, np.full(few.lon.size, self.height[0]), True)
        step = nodes.lon.size // _SEARCHED
        if step <= 1:
            return self
        lon, lat, weight = (values[::step] for values in (nodes.lon, nodes.lat, nodes.weight))
        return Ground(nodes_at(lon, lat, weight, nodes.ellipsoid), self.height[::step], False)


def ground_of(
    region: regions.Place, ellipsoid: earth.Ellipsoid, heights: ArrayLike | None, height: float | None
) -> Ground:
    """The ground of `heights` (n, 3) in a region, of one height, or of points with heights; raises ValueError."""
    if isinstance(region, regions.PointSet) and region.height is not None and heights is None and height is None:
        return Ground(nodes_at(region.lon, region.lat, region.weight, ellipsoid), region.height, False)
    if (heights is None) == (height is None):
        raise ValueError("Invalid heights. Either points with heights or one height must be given.")
    if height is not None:
        height = support.check_number("height", height)
        if not -500.0 <= height <= 9000.0:
            raise ValueError(f"Invalid height '{height}'. It must lie within -500 and 9000 m.")
        nodes = nodes_of(region, ellipsoid, _NODES, edges=True)
        return Ground(nodes, np.full(nodes.lon.size, float(height)), True)
    points = support.check_numbers("heights", heights)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise ValueError("Invalid heights. They must be rows of longitude, latitude and height, all finite.")
    points = points[region.contains(points[:, 0], points[:, 1])]
    if not len(points):
        raise ValueError(f"Invalid heights for {region.name}. No point lies in the region.")
    return Ground(nodes_at(points[:, 0], points[:, 1], np.ones(len(points)), ellipsoid), points[:, 2], False)


# ---- statistics -----------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class HeightStatistics:
    """Distortion at heights, in ppm; `within` are the shares of the points, or of the area, by a limit in ppm."""

    min: float
    max: float
    mean: float
    std: float
    rms: float
    within: dict[float, float]

    def to_dict(self) -> dict[str, Any]:
        """The fields by name."""
        return asdict(self) | {"within": {f"{ppm:g}": share for ppm, share in self.within.items()}}


def statistics_of(ppm: FloatArray, weight: FloatArray, limits: Iterable[float]) -> HeightStatistics:
    """Statistics of distortions in ppm with weights that sum to 1, and the shares within limits."""
    mean = float(np.sum(weight * ppm))
    std = float(np.sqrt(np.sum(weight * (ppm - mean) ** 2)))
    rms = float(np.sqrt(np.sum(weight * ppm * ppm)))
    within = {float(limit): float(np.sum(weight[np.abs(ppm) <= limit])) for limit in sorted(set(limits))}
    return HeightStatistics(min=float(ppm.min()), max=float(ppm.max()), mean=mean, std=std, rms=rms, within=within)


# ---- false origins --------------------------------------------------------------------------


def span_of(values: FloatArray) -> FloatArray:
    """The smallest and the largest value (2,), NaN ignored."""
    return np.array([np.nanmin(values), np.nanmax(values)])


def overlap(one: FloatArray, other: FloatArray) -> bool:
    """True if two spans (2,) have numbers in common."""
    return bool(max(one[0], other[0]) <= min(one[1], other[1]))


def false_origin_for(x: FloatArray, y: FloatArray, step: float, stated: Mapping[str, float]) -> dict[str, float]:
    """The stated x_0 and y_0, and else multiples of `step`, for spans (2,) of coordinates without them, in metres."""
    # All coordinates are positive, and no easting is a possible northing, as surveyors want it: eastings are larger.

    def above(least: float, span: FloatArray) -> float:
        return float(np.ceil((least - span[0]) / step) * step)

    def beyond(other: FloatArray, span: FloatArray) -> float:
        return float((np.floor((other[1] - span[0]) / step) + 1.0) * step)

    east, north = stated.get("x_0"), stated.get("y_0")
    if north is None:
        north = max(0.0, above(0.0, y))
        if east is not None and overlap(x + east, y + north):
            north = beyond(x + east, y)
    if east is None:
        east = above(step, x)
        if overlap(x + east, y + north):
            east = beyond(y + north, x)
    return {"x_0": east, "y_0": north}


# ---- test points ----------------------------------------------------------------------------

_CORNERS = ((-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0))  # directions in x and y of the farthest points
_LINES = ((0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1))


def points_to_test(
    projection: projections.Projection, unit: float, points: Mapping[str, FloatArray]
) -> list[dict[str, Any]]:
    """The middle one of some points, those in the corners, and those of least and most ppm, to whole seconds."""
    # Eastings and northings are in a unit of so many metres, heights in metres.
    lon, lat, height, ppm = (points[name] for name in ("lon", "lat", "height", "ppm"))
    x, y = projection(lon, lat)
    x, y = x - x.mean(), y - y.mean()
    chosen = [np.argmin(np.hypot(x, y)), *(np.argmax(u * x + v * y) for u, v in _CORNERS), ppm.argmin(), ppm.argmax()]
    seconds = np.rint(3600.0 * np.column_stack([earth.wrapped(lon), lat])[chosen])
    _, first = np.unique(seconds, axis=0, return_index=True)
    (east, north), at = seconds[np.sort(first)].T / 3600.0, np.array(chosen)[np.sort(first)]
    found = answers.factors(projection, east, north)
    h = height[at].round(4)
    elevation = answers.elevation_factor(north, h, projection.ellipsoid)
    columns = {
        **{"lon": east, "lat": north, "height": h, "easting": found.x / unit, "northing": found.y / unit},
        **{"grid_scale_factor": found.k, "elevation_factor": elevation, "combined_factor": found.k * elevation},
        "convergence": found.convergence,
    }
    if "geoid_height" in points:
        columns["geoid_height"] = points["geoid_height"][at].round(4)
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    return [{"point": k} | dict(zip(columns, row, strict=True)) for k, row in enumerate(rows, 1)]


def lines_to_test(
    projection: projections.Projection, unit: float, points: list[dict[str, Any]]
) -> list[dict[str, Any]]:
    """Lines between test points: straight on the map, and geodesics raised to heights that are linear between both."""
    rows = []
    for i, j in _LINES:
        if max(i, j) < len(points):
            ends = [[points[k][name] for name in ("lon", "lat", "height")] for k in (i, j)]
            line = answers.profile(projection, ends, measures=())
            grid, ground = line.grid_distance_m, line.ground_length_m
            assert ground is not None  # as both ends have heights
            distances = {"grid_distance": grid / unit, "ground_distance": ground / unit}
            rows.append({"line": f"{i + 1} to {j + 1}"} | distances | {"ppm": 1e6 * (grid / ground - 1.0)})
    return rows


# ---- heights -------------------------------------------------------------------------------------

_NAMES = (
    ("lon", "longitude", "long", "lng", "x"),
    ("lat", "latitude", "y"),
    ("h", "height", "ellipsoidal_height", "hae", "z", "elevation"),
)
_RASTER = (".tif", ".tiff")
_MOST_CELLS = 200  # along a side of a raster: forty thousand points


def read_heights(path: AnyPath) -> FloatArray:
    """Longitudes, latitudes and ellipsoidal heights of points, from a table or a raster.

    Parameters
    ----------
    path : str or path
        A .csv or .txt file with columns of any usual names, or, without a header, in that order; or a .tif, a raster of
        heights, read with rasterio (the extra `gis`) at 200 by 200 cells at most.

    Returns
    -------
    ndarray (n, 3)
        Degrees, degrees and metres, as `ldp` takes them.

    Raises
    ------
    ValueError
        For files that cannot be read, have no such columns or no points, lines without a point, missing rasterio.

    References
    ----------
    Of the rasters: OGC GeoTIFF Standard 1.1, OGC 19-008r4.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "heights.csv")
    ...     _ = path.write_text("lat;lon;name;height" + chr(10) + "50;10;a;100.5")
    ...     read_heights(path)
    array([[ 10. ,  50. , 100.5]])
    """
    path = support.check_path("heights", path)
    points = _read_raster(path) if path.suffix.lower() in _RASTER else _read_table(path)
    if not (len(points) and (np.abs(points[:, 1]) <= 90).all() and (np.abs(points[:, 0]) <= 720).all()):
        raise ValueError(f"Invalid heights '{path}'. There must be points, with longitudes and latitudes in degrees.")
    return points


def _read_table(path: Path) -> FloatArray:
    rows = support.numbered_rows(path, f"Invalid heights '{path}'.")
    header = rows[0][1]
    names = [name.strip().lower() for name in header]
    found = [next((names.index(name) for name in allowed if name in names), None) for allowed in _NAMES]
    columns = [column for column in found if column is not None]
    if len(header) >= 3 and all(map(support.is_number, header[:3])):
        columns = [0, 1, 2]
    elif len(columns) < 3:
        raise ValueError(f"Invalid heights '{path}'. Its header must name columns lon, lat and h.")
    if not support.is_number(rows[0][1][columns[0]]):
        rows = rows[1:]
    points = []
    for number, row in rows:
        try:
            point = [support.number_of(row[column]) for column in columns]
        except (ValueError, IndexError):
            point = [np.nan]
        if not np.isfinite(point).all():
            hint = support.comma_hint(row)
            raise ValueError(
                f"Invalid heights '{path}'. Line {number} must have a longitude, a latitude and a height.{hint}"
            )
        points.append(point)
    return np.array(points).reshape(-1, 3)


def _read_raster(path: Path) -> FloatArray:
    try:
        import rasterio
        from rasterio.errors import NotGeoreferencedWarning, RasterioError
    except ImportError as error:
        raise ValueError(f"Invalid heights '{path}'. Rasters need rasterio: pip install 'projdist[gis]'.") from error
    try:
        with warnings.catch_warnings(action="ignore", category=NotGeoreferencedWarning), rasterio.open(path) as raster:
            support.check_raster(raster, [1], f"Invalid heights '{path}'.")
            shape = min(raster.height, _MOST_CELLS), min(raster.width, _MOST_CELLS)
            heights = raster.read(1, out_shape=shape, masked=True).astype(float).filled(np.nan)
            row, column = np.meshgrid(*((np.arange(n) + 0.5) / n for n in shape), indexing="ij")
            x, y = raster.transform @ (column.ravel() * raster.width, row.ravel() * raster.height)
            crs = raster.crs.to_wkt() if raster.crs else "EPSG:4326"
            bounds = raster.bounds
    except RasterioError as error:
        raise ValueError(f"Invalid heights '{path}'. The raster cannot be read: {support.one_line(error)}.") from error
    projections.tell_of_degrees(crs, bounds, f"'{path}'", "raster")
    lon, lat = projections.unprojected(crs, np.asarray(x), np.asarray(y))
    points = np.stack([lon, lat, heights.ravel()], axis=-1)
    return points[np.isfinite(points).all(axis=1)]
