"""The distortion of a map at points and along lines, and the elevation factor of distances at a height."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar, overload

import numpy as np

from projdist import earth, matrices, numerics, projections, regions, support
from projdist._typing import AnyArray, ArrayLike, FloatArray, IntArray
from projdist.field import Quality, check_declared_property, derivatives, measure_at, named_measures
from projdist.projections import Projection, ProjectionLike

_OF_MAP = {"projection": "definition", "name": "name"}  # parts of a projection in JSON


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Factors(support.Answer):
    """Distortion at points: arrays of one shape, NaN where undefined."""

    projection: Projection = field(metadata=support.schema(of=_OF_MAP | {"definition": "definition"}, spread=True))
    lon: FloatArray = field(metadata=support.COLUMN)
    lat: FloatArray = field(metadata=support.COLUMN)
    x: FloatArray = field(metadata=support.COLUMN)
    y: FloatArray = field(metadata=support.COLUMN)
    h: FloatArray = field(metadata=support.COLUMN)
    k: FloatArray = field(metadata=support.COLUMN)
    a: FloatArray = field(metadata=support.COLUMN)
    b: FloatArray = field(metadata=support.COLUMN)
    s: FloatArray = field(metadata=support.COLUMN)
    omega: FloatArray = field(metadata=support.COLUMN)
    theta: FloatArray = field(metadata=support.COLUMN)
    convergence: FloatArray = field(metadata=support.COLUMN)
    fisher: FloatArray = field(metadata=support.COLUMN)
    quality: np.typing.NDArray[np.str_] = field(metadata=support.COLUMN)  # labels of `Quality`
    extra: dict[str, FloatArray] = field(metadata=support.schema(column=True, spread=True))  # further measures, by name
    error: FloatArray = field(metadata=support.HIDDEN)  # estimated relative error of the Jacobian
    jacobian: FloatArray = field(metadata=support.HIDDEN)

    def _line(self) -> str:
        return f"{self.projection.name} at {self.lon.size} points"

    def columns(self) -> dict[str, AnyArray]:
        """x, y, the measures and the quality by name, each of shape (n,), as they are added to a frame of points."""
        return {name: values for name, values in self._table().items() if name not in ("lon", "lat")}


_Measures = Iterable[str | matrices.Measure]
_AnyFrame = TypeVar("_AnyFrame", bound=projections.FrameLike)


@overload
def factors(projection: ProjectionLike, lon: ArrayLike, lat: ArrayLike, *, measures: _Measures = ()) -> Factors: ...


@overload
def factors(projection: ProjectionLike, lon: _AnyFrame, *, measures: _Measures = (), prefix: str = "") -> _AnyFrame: ...


def factors(
    projection: ProjectionLike, lon: Any, lat: Any = None, *, measures: _Measures = (), prefix: str = ""
) -> Any:
    """Scales, angles and the other measures of a projection at points in degrees.

    Parameters
    ----------
    projection : ProjectionLike
    lon : array_like, DataFrame or GeoDataFrame
        Longitudes in degrees; or a DataFrame with columns `lon` and `lat`, or a GeoDataFrame of points in any CRS.
    lat : array_like, optional
        Latitudes in degrees, which broadcast with `lon`. Not with a frame.
    measures : iterable of str or Measure, or one of them
        Further measures beside the standard ones.
    prefix : str, optional
        Beginning of the names of the added columns, only for a frame.

    Returns
    -------
    Factors, DataFrame or GeoDataFrame
        Arrays of the shape of the points, NaN where undefined. For a frame, one of the same kind with more columns:
        `x`, `y`, `h`, `k`, `a`, `b`, `s`, `omega`, `theta`, `convergence`, `fisher`, `quality`, and the `measures`.

    Raises
    ------
    ProjectionError, ValueError
        For an unknown projection or measure, shapes that do not broadcast, arrays of xarray along different dimensions
        (for `projdist.gis.factor_arrays`), rows of a frame that are no points, latitudes beside a frame, a prefix
        without a frame, or columns that the frame has already.

    References
    ----------
    - J. P. Snyder 1987, Map Projections: A Working Manual, USGS Professional Paper 1395, equations 4-9 and 4-14.
    - D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the Fisher distortion.

    Examples
    --------
    On a sphere the scale of Mercator's map is 1 / cos(lat).

    >>> round(float(factors("mercator", 10, 60).k), 9)
    2.0
    """
    projection = Projection.from_user_input(projection)
    if isinstance(lon, projections.FrameLike):
        if lat is not None:
            raise ValueError("Invalid latitudes beside a frame. It must be alone: it has its own.")
        at_rows = factors(projection, *projections.places(projection, lon), measures=measures)
        return projections.add_columns(lon, at_rows.columns(), prefix)
    if lat is None or lon is None or not isinstance(prefix, str) or prefix:
        raise ValueError("Invalid points. They must be longitudes and latitudes, or a frame alone.")
    dims = getattr(lon, "dims", ()), getattr(lat, "dims", ())
    if dims[0] and dims[1] and dims[0] != dims[1]:  # as plain arrays they would be taken pair by pair
        raise ValueError(
            f"Invalid points. Their dimensions are {', '.join(map(str, dims[0]))} and {', '.join(map(str, dims[1]))}; "
            "projdist.gis.factor_arrays takes arrays of xarray with their dimensions."
        )
    chosen = named_measures(measures)
    lon, lat = support.check_degrees(lon, lat)
    found = derivatives(projection, lon, lat)
    J = found.jacobian
    _warn_of_points_outside(projection, lon, lat)
    check_declared_property(projection, J)
    worst = found.quality.max(initial=0)
    labels = np.array([quality.label for quality in Quality if quality <= worst])
    return Factors(
        projection=projection,
        lon=lon.copy(),
        lat=lat.copy(),
        x=found.x,
        y=found.y,
        **matrices.factors_of(J),
        quality=labels[found.quality] if worst else np.full(lon.shape, labels[0]),
        error=found.error,
        jacobian=J,
        extra={name: measure_at(projection, measure, lon, lat, J) for name, measure in chosen.items()},
    )


def _warn_of_points_outside(projection: Projection, lon: FloatArray, lat: FloatArray) -> None:
    """Warn of points outside the area of use of a CRS, and say if swapped coordinates would lie inside."""
    if projection.area_of_use is None:
        return
    area = regions.Box(*projection.area_of_use)
    there = np.isfinite(lon) & np.isfinite(lat)
    outside = there & ~area.contains(lon, lat)
    if not outside.any():
        return
    points = "the point lies" if lon.size == 1 else f"{outside.sum()} of {there.sum()} points lie"
    swapped = int(area.contains(lat[outside], lon[outside]).sum())
    inside = "it lies" if lon.size == 1 else f"{swapped} of them lie"
    hint = f" With longitude and latitude swapped {inside} inside: longitudes come first." if swapped else ""
    support.tell(f"{projection.label} is for {area.name}: {points} outside its area of use.{hint}")


# ---- along a line --------------------------------------------------------------------------------

_POINTS = 50  # of a line, approximately, by default
_MOST_POINTS = 1e6
_LOWEST, _HIGHEST = -12_000.0, 9_000.0  # metres
_SMALL = 1e-11  # of a length, the error of derivatives: allowed difference of a piece from the sum of its halves
_HALVINGS = 12
_JUMP = 3.0  # times the length by the scale: a longer step on the map crosses a cut
_IF_KNOWN = support.schema(column=True, optional=True)


def elevation_factor(lat: ArrayLike, height: ArrayLike, ellipsoid: earth.Ellipsoid) -> FloatArray:
    """R_G / (R_G + h), by which distances at a height h are multiplied to get those on the ellipsoid.

    R_G = sqrt(M N) is the Gaussian mean radius of curvature.

    Parameters
    ----------
    lat : array_like (...)
        Latitudes in degrees.
    height : array_like (...)
        Ellipsoidal heights in metres (orthometric ones are lower by the geoid's height).
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray (...)
        A ratio, below 1 above the ellipsoid.

    Raises
    ------
    ValueError
        For values that are no numbers, no ellipsoid, or shapes that do not broadcast.

    References
    ----------
    J. E. Stem 1989, State Plane Coordinate System of 1983, NOAA Manual NOS NGS 5: grid and elevation factors.

    Examples
    --------
    Station CBL 0 at Limon, Colorado, as in its NGS data sheet KJ0588:

    >>> from projdist import WGS84
    >>> round(float(elevation_factor(39.2, 1610.152, WGS84)), 8)
    0.99974744
    """
    support.check_instance("ellipsoid", ellipsoid, earth.Ellipsoid, "an Ellipsoid of projdist")
    lat, height = support.check_numbers("latitudes", lat), support.check_numbers("heights", height)
    lat, height = support.check_degrees(lat, height)
    meridian, vertical = ellipsoid.radii(lat)
    radius = np.sqrt(meridian * vertical)
    return np.asarray(radius / (radius + height))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Profile(support.Answer):
    """A map along a line: arrays (n,) of its points, NaN where undefined, and figures; None without heights."""

    projection: Projection = field(metadata=support.schema(of=_OF_MAP, spread=True))
    vertices: FloatArray = field(metadata=support.HIDDEN)  # (m,), distances of the line's vertices in km
    distance_km: FloatArray = field(metadata=support.COLUMN)  # along the line
    lon: FloatArray = field(metadata=support.COLUMN)
    lat: FloatArray = field(metadata=support.COLUMN)
    x: FloatArray = field(metadata=support.COLUMN)
    y: FloatArray = field(metadata=support.COLUMN)
    azimuth: FloatArray = field(metadata=support.COLUMN)  # degrees clockwise from north, at a vertex of the next edge
    scale: FloatArray = field(metadata=support.COLUMN)  # in this direction
    height: FloatArray | None = field(metadata=_IF_KNOWN)  # metres
    elevation_factor: FloatArray | None = field(metadata=_IF_KNOWN)  # R / (R + h)
    combined_factor: FloatArray | None = field(metadata=_IF_KNOWN)  # the scale times that
    measures: dict[str, FloatArray] = field(metadata=support.schema(column=True, spread=True))  # the others, by name
    length_m: float  # on the ellipsoid
    map_length_m: float  # of the image
    mean_scale: float  # their ratio
    error: float  # of the mean scale
    grid_distance_m: float  # sum of straight distances on the map from vertex to vertex
    ground_length_m: float | None
    mean_combined_factor: float | None

    @property
    def torn(self) -> IntArray:
        """Numbers of the points before which the map is cut; the grid distance goes across."""
        jump = np.hypot(np.diff(self.x), np.diff(self.y))
        scale = np.fmax(self.scale[1:], self.scale[:-1])
        return 1 + np.flatnonzero(jump > _JUMP * scale * 1e3 * np.diff(self.distance_km))

    def _line(self) -> str:
        return f"{self.projection.name} along {self.length_m / 1e3:.6g} km: mean scale {self.mean_scale:.9g}"


def profile(
    projection: ProjectionLike,
    line: str | os.PathLike[str] | ArrayLike | regions.HasGeometry | Mapping[str, Any],
    *,
    measures: Iterable[str | matrices.Measure] = ("convergence",),
    spacing_km: float | None = None,
    height: float | None = None,
) -> Profile:
    """The scale of a map along a line, in the line's direction, its mean, and other measures.

    Edges are geodesics from vertex to vertex on the map's own ellipsoid. Longitudes and latitudes are the map's own;
    files in another CRS are converted through WGS 84.

    Parameters
    ----------
    projection : ProjectionLike
    line : str, path, array_like, geometry
        Vertices (n, 2) in degrees, or (n, 3) with ellipsoidal heights in metres; a text "LON,LAT,LON,LAT,..."; a line
        of shapely, a GeoSeries or GeoDataFrame, in its CRS; GeoJSON; or the path of a vector file, perhaps with
        "#LAYER". Several lines must join end to end.
    measures : iterable of str or Measure, or one of them
        Other measures at the points.
    spacing_km : float, optional
        Distance between points; vertices are points, too. The default is a round number that makes 50 to 125 points.
    height : float, optional
        One ellipsoidal height in metres instead of the line's own.

    Returns
    -------
    Profile
        Values at the points, and figures of the whole line; with heights also the combined factor.

    Raises
    ------
    ProjectionError, ValueError
        For an unknown projection; for an invalid line, an unknown measure, a spacing below 0, or impossible heights.

    References
    ----------
    - J. P. Snyder 1987, Map Projections: A Working Manual, USGS Professional Paper 1395, pages 20 to 26.
    - J. E. Stem 1989, State Plane Coordinate System of 1983, NOAA Manual NOS NGS 5, section 4: factors of lines.

    Examples
    --------
    UTM's scale is 0.9996 on the central meridian, and 1 about 180 km from it.

    >>> found = profile("EPSG:32632", [(9, 50), (12, 50)], spacing_km=100)
    >>> found.scale.round(6).tolist(), round(found.mean_scale, 6)
    ([0.9996, 0.999723, 1.000091, 1.000168], 0.999789)
    """
    projection = Projection.from_user_input(projection)
    chosen = named_measures(measures)
    course = _Course(projection, regions.line_of(line), height)
    at = course.distances(spacing_km)
    lon, lat, azimuth = course.places(at)
    found = derivatives(projection, lon, lat)
    J = found.jacobian
    check_declared_property(projection, J)
    scale = _along(J, azimuth)
    heights = course.heights_at(at)
    reduced = None if heights is None else elevation_factor(lat, heights, projection.ellipsoid)
    map_length, error = _integral(course.scale, course.ends)
    ground = None if heights is None else _integral(course.raised, course.ends)[0]
    x, y = projection(course.lon, course.lat)
    return Profile(
        projection=projection,
        vertices=course.ends / 1e3,
        distance_km=at / 1e3,
        lon=lon,
        lat=lat,
        x=found.x,
        y=found.y,
        azimuth=azimuth,
        scale=scale,
        measures={name: measure_at(projection, measure, lon, lat, J) for name, measure in chosen.items()},
        height=heights,
        elevation_factor=reduced,
        combined_factor=None if reduced is None else scale * reduced,
        length_m=float(course.ends[-1]),
        map_length_m=map_length,
        mean_scale=map_length / float(course.ends[-1]),
        error=error / float(course.ends[-1]),
        grid_distance_m=float(np.hypot(np.diff(x), np.diff(y)).sum()),
        ground_length_m=ground,
        mean_combined_factor=None if ground is None else map_length / ground,
    )


class _Course:
    """A line of geodesics by the distance along it in metres; `ends` (m,) are the distances of its vertices."""

    def __init__(self, projection: Projection, line: FloatArray, height: float | None) -> None:
        self.projection = projection
        lon, lat, own = line.T
        lengths = projections.geodesic_inverse(projection.ellipsoid, lon[:-1], lat[:-1], lon[1:], lat[1:])[0]
        moves = np.append(True, lengths > 0.0)  # a vertex may repeat the one before it, 360 degrees away
        self.lon, self.lat, own = lon[moves], lat[moves], own[moves]
        self.ends = np.append(0.0, np.cumsum(lengths[lengths > 0.0]))
        if len(self.ends) < 2:
            raise ValueError("Invalid line. It must have two places or more.")
        self.heights = _heights(own, height)

    def distances(self, spacing_km: float | None) -> FloatArray:
        """Distances of the points: regular ones, and those of the vertices."""
        total = float(self.ends[-1])
        step = _round_step(total / _POINTS) if spacing_km is None else 1e3 * support.check_number("spacing", spacing_km)
        if not step > 0.0 or total > _MOST_POINTS * step:
            raise ValueError(
                f"Invalid spacing '{spacing_km}'. It must be positive and make at most {_MOST_POINTS:,.0f} points."
            )
        even = step * np.arange(np.ceil(total / step))
        # A regular point within a millionth of the spacing from a vertex is dropped.
        nearest = np.abs(even - self.ends[np.searchsorted(self.ends, even).clip(max=len(self.ends) - 1)])
        before = np.abs(even - self.ends[(np.searchsorted(self.ends, even) - 1).clip(min=0)])
        return np.union1d(self.ends, even[np.minimum(nearest, before) > 1e-6 * step])

    def places(self, at: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Longitudes, latitudes and azimuths at distances; vertices are as given, to the last bit."""
        k = np.clip(np.searchsorted(self.ends, at, side="right") - 1, 0, len(self.ends) - 2)
        ends = (self.lon[k], self.lat[k], self.lon[k + 1], self.lat[k + 1])
        ellipsoid = self.projection.ellipsoid
        start = projections.geodesic_inverse(ellipsoid, *ends)[1]
        lon, lat, azimuth = projections.geodesic_direct(ellipsoid, *ends[:2], start, at - self.ends[k])
        for number in (k, k + 1):
            vertex = at == self.ends[number]
            lon[vertex], lat[vertex] = self.lon[number[vertex]], self.lat[number[vertex]]
        return lon, lat, azimuth

    def scale(self, at: FloatArray) -> FloatArray:
        """Scale along the line."""
        lon, lat, azimuth = self.places(at)
        return _along(derivatives(self.projection, lon, lat).jacobian, azimuth)

    def heights_at(self, at: FloatArray) -> FloatArray | None:
        """Heights, linear from vertex to vertex."""
        return None if self.heights is None else np.interp(at, self.ends, self.heights)

    def raised(self, at: FloatArray) -> FloatArray:
        """(R + h) / R."""
        height = self.heights_at(at)
        assert height is not None
        return 1.0 / elevation_factor(self.places(at)[1], height, self.projection.ellipsoid)


def _heights(own: FloatArray, height: float | None) -> FloatArray | None:
    """The heights of vertices: one for all, or their own if all have one."""
    if height is not None:
        own = np.full(len(own), support.check_number("height", height))
    elif np.isnan(own).any():
        if not np.isnan(own).all():
            support.tell(
                f"{int(np.isnan(own).sum())} of {len(own)} vertices of the line have no height; no heights are used."
            )
        return None
    wrong = own[~((own >= _LOWEST) & (own <= _HIGHEST))]
    if wrong.size:
        raise ValueError(f"Invalid height '{wrong[0]:g}'. It must lie within {_LOWEST:g} and {_HIGHEST:g} m.")
    return own


def _along(J: FloatArray, azimuth: FloatArray) -> FloatArray:
    """The scale in an azimuth for each point: the length of the image of its unit vector."""
    sin, cos = np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))
    return np.hypot(J[:, 0, 0] * sin + J[:, 0, 1] * cos, J[:, 1, 0] * sin + J[:, 1, 1] * cos)


def _round_step(step: float) -> float:
    """The largest 1, 2 or 5 times a power of ten that is not above the step."""
    power = 10.0 ** np.floor(np.log10(step))
    return float(power * max(one for one in (1.0, 2.0, 5.0) if one * power <= step * (1.0 + 1e-12)))


def _integral(function: Callable[[FloatArray], FloatArray], ends: FloatArray) -> tuple[float, float]:
    """The integral over the edges between `ends`, halved as needed, by Gauss's rule of ten nodes, and its error."""
    left, right = ends[:-1], ends[1:]
    whole = _gauss(function, left, right)
    total, error, allowed = 0.0, 0.0, _SMALL * float(ends[-1])
    for _ in range(_HALVINGS):
        middle = 0.5 * (left + right)
        first, second = _gauss(function, left, middle), _gauss(function, middle, right)
        change = np.abs(first + second - whole)
        done = ~(change > np.maximum(allowed, _SMALL * whole))
        total += float((first + second)[done].sum())
        error += float(change[done].sum())
        left, right = np.append(left[~done], middle[~done]), np.append(middle[~done], right[~done])
        whole = np.append(first[~done], second[~done])
        if not len(left):
            return total, error
        left_error = float(change[~done].sum())
    return total + float(whole.sum()), error + left_error


def _gauss(function: Callable[[FloatArray], FloatArray], left: FloatArray, right: FloatArray) -> FloatArray:
    """The integral over each interval by Gauss's rule."""
    half = 0.5 * (right - left)
    at = 0.5 * (left + right)[:, None] + half[:, None] * numerics.NODES
    return half * (function(at.ravel()).reshape(at.shape) @ numerics.WEIGHTS)
