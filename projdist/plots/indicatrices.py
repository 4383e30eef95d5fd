"""Tissot's indicatrices: the ellipses that the Jacobian makes of equal small circles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.derivatives import jacobian
from projdist.measures import principal_scales
from projdist.plots.domain import Bounds, Domain, longitude_width, normalised

_FILL = 0.8  # of the size at which the first two ellipses would touch
_CROWDED = 0.6  # of the usual distance; closer ones give way, so that they do not shrink all others
_DIRECTIONS = 48  # a right angle to the best direction is missed by 2 degrees at most
_RINGS, _AZIMUTHS = 24, 36
_BEND = 0.5  # of a step between rings: a jump of 2 % of the radius; smooth maps stay below but for pole lines
_OFFSET = 2.2  # of the semi-minor axis
_TRIALS = 15


@dataclass(frozen=True)
class Indicatrices:
    """Points, their images in metres, and the Jacobians there."""

    domain: Domain
    lon: FloatArray
    lat: FloatArray
    xy: FloatArray
    J: FloatArray

    def take(self, keep: BoolArray) -> Indicatrices:
        """Those that are kept."""
        return Indicatrices(self.domain, self.lon[keep], self.lat[keep], self.xy[keep], self.J[keep])


def even_grid(bounds: Bounds, step: float, central_meridian: float | None = None) -> tuple[FloatArray, FloatArray]:
    """Points about `step` degrees apart on the ground, in rings of latitude.

    The rings lie half steps off the middle latitude, the points symmetrical to the middle meridian.
    """
    west, south, _, north = bounds
    width = longitude_width(bounds)
    rows = max(round((north - south) / step), 1)
    lats = south + (north - south) * (np.arange(rows) + 0.5) / rows
    start = west if width < 360.0 or central_meridian is None else central_meridian - 180.0
    lons, points = [], []
    for lat in lats:
        count = max(round(width * np.cos(np.radians(lat)) / step), 3 if width == 360.0 else 1)
        lons.append(start + width * (np.arange(count) + 0.5) / count)
        points.append(np.full(count, lat))
    return normalised(np.concatenate(lons)), np.concatenate(points)


def indicatrices(domain: Domain, step: float, central_meridian: float | None = None) -> Indicatrices:
    """The indicatrices of a domain on an even grid of `step` degrees."""
    lon, lat = even_grid(domain.region.bounds, step, central_meridian)
    xy = np.column_stack(domain(lon, lat))
    J = jacobian(domain.projection, lon, lat)
    with np.errstate(invalid="ignore"):
        keep = np.isfinite(xy[:, 0]) & np.isfinite(J).all(axis=(1, 2)) & (np.abs(np.linalg.det(J)) > 1e-12)
    return Indicatrices(domain, lon, lat, xy, J).take(keep)


def radius_limits(indicatrices: Indicatrices) -> FloatArray:
    """The greatest radius in metres at which each pair does not overlap, shape (n, n); inf on the diagonal.

    Two convex shapes are apart if their shadows are apart in some direction d. The half width of
    an ellipse in that direction is r |J^T d|.
    """
    xy, J = indicatrices.xy, indicatrices.J
    limits = np.zeros((len(xy), len(xy)))
    for angle in np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS:
        d = np.array([np.cos(angle), np.sin(angle)])
        centre, half = xy @ d, np.linalg.norm(np.swapaxes(J, 1, 2) @ d, axis=1)
        np.maximum(limits, np.abs(centre[:, None] - centre) / (half[:, None] + half), out=limits)
    np.fill_diagonal(limits, np.inf)
    return limits


def fit(panels: Sequence[Indicatrices], radius: float | None = None) -> tuple[float, list[Indicatrices]]:
    """One radius in metres for all panels, and the indicatrices that are drawn with it.

    No two of a panel overlap, unless a radius is given; those that would touch a seam or an edge,
    or bend far from the ellipse, are left out.
    """
    if radius is not None:
        if not radius > 0:
            raise ValueError(f"Invalid radius '{radius}'. It must be a positive number of metres.")
        return radius, [panel.take(_fits(panel, radius)) for panel in panels]
    all_panels = [_without_crowding(panel) for panel in panels]
    size = _common_radius(all_panels)
    for _ in range(_TRIALS):
        kept = [panel.take(_fits(panel, size)) for panel in all_panels]
        # Where most of a panel is lost, the circles are too large for it: a narrow region, small lobes.
        if all(2 * few.lon.size >= many.lon.size for few, many in zip(kept, all_panels, strict=True)):
            break
        size *= 0.8
    return size, kept


def _common_radius(panels: Sequence[Indicatrices]) -> float:
    limits = [float(radius_limits(panel).min()) for panel in panels if panel.lon.size > 1]
    if limits:
        return _FILL * min(limits)
    domains = [panel.domain for panel in panels]
    return min(float(0.05 * d.radius * np.radians(longitude_width(d.region.bounds))) for d in domains)


def _without_crowding(panel: Indicatrices) -> Indicatrices:
    """The panel without the more distorted one of each pair that is far closer than usual."""
    if panel.lon.size < 3:
        return panel
    limits = radius_limits(panel)
    least = _CROWDED * float(np.median(limits.min(axis=1)))
    keep = np.ones(panel.lon.size, dtype=bool)
    a, b = principal_scales(panel.J).T
    for i, j in np.argwhere(np.triu(limits < least)):
        if keep[i] and keep[j]:
            keep[i if a[i] * b[j] > a[j] * b[i] else j] = False
    return panel.take(keep)


def _fits(panel: Indicatrices, radius: float) -> BoolArray:
    """Whether the map is drawn and not torn within `radius` metres of each point, and like its linear map."""
    if not panel.lon.size:
        return np.zeros(0, dtype=bool)
    ring = np.linspace(0.0, 1.0, _RINGS + 1)[:, None] * radius / panel.domain.radius
    azimuth = np.linspace(0.0, 2.0 * np.pi, _AZIMUTHS, endpoint=False)
    lat, lon = np.radians(panel.lat)[:, None, None], np.radians(panel.lon)[:, None, None]
    east, north = np.sin(ring) * np.sin(azimuth), np.sin(ring) * np.cos(azimuth)
    up = np.cos(ring) * np.ones_like(azimuth)
    axial, meridional = up * np.sin(lat) + north * np.cos(lat), up * np.cos(lat) - north * np.sin(lat)
    lats = np.degrees(np.arctan2(axial, np.hypot(meridional, east)))
    lons = np.degrees(lon + np.arctan2(east, meridional))
    xy = np.stack(panel.domain(normalised(lons), lats), axis=-1)
    # Along a ray the steps change slowly. The steps of the linear map are the measure.
    step = radius / _RINGS * np.linalg.norm(panel.J, axis=(1, 2))
    bend = np.linalg.norm(np.diff(xy, n=2, axis=1), axis=-1).reshape(panel.lon.size, -1)
    smooth = (bend <= _BEND * step[:, None]).all(axis=1)
    # Towards an antipode or a pole line the circle's image curves round the map, and its ellipse sticks out.
    linear = np.einsum("nij,jt->nti", panel.J, np.stack([np.sin(azimuth), np.cos(azimuth)])) * radius
    offset = np.linalg.norm(xy[:, -1] - panel.xy[:, None] - linear, axis=-1).max(axis=1)
    return np.asarray(smooth & (offset <= _OFFSET * radius * principal_scales(panel.J)[:, 1]))


def ellipses(indicatrices: Indicatrices, radius: float, vertices: int = 72) -> FloatArray:
    """Polygons f(p) + r J (cos t, sin t), shape (n, vertices, 2)."""
    t = np.linspace(0.0, 2.0 * np.pi, vertices, endpoint=False)
    circle = np.stack([np.cos(t), np.sin(t)])
    return np.asarray(indicatrices.xy[:, None] + radius * np.swapaxes(indicatrices.J @ circle, 1, 2))
