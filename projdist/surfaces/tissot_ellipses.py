"""Tissot's indicatrices: the ellipses that the Jacobian makes of equal small circles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import destination, unit_vectors, wrapped
from projdist.field import jacobian
from projdist.matrices import principal_scales
from projdist.regions import Box, Place
from projdist.support import check_number
from projdist.surfaces.domain import Domain, even_grid, graticule_grid, ground_size, longitude_width
from projdist.surfaces.surface import Surface

_LEAST_SHARE = 0.4  # of the usual step
_FILL = 0.8  # of the size at which the first two ellipses would touch
_CROWDED = 0.6  # of the usual distance: closer ellipses are left out, so that they do not shrink all others
_DIRECTIONS = 48  # tried, of which one is within 2 degrees of that which separates best
_RINGS, _AZIMUTHS = 24, 36
_BEND = 0.5  # of a step between rings: a jump of 2 % of the radius; smooth maps bend less except at pole lines
_OFFSET = 2.2  # of the semi-minor axis: a circle's image is at most this far from its ellipse
_FLAT = 0.02  # of the semi-minor axis: a circle whose image is this close to its ellipse has no jump or bend
_TRIALS = 15  # of sizes
_SEEN, _LEAST_SEEN = 1.6, 1e-9  # scale up to which ellipses are exaggerated; smallest logarithm that is no rounding
_ROUND = 1e-9  # relative difference of axes below which an ellipse is a circle, which has no longest axis
_FEW = 9  # points in a region: to fewer those nearest to its border are added
_AT_ONCE = 500_000  # points on the ground; 100 MB


@dataclass(frozen=True, kw_only=True, eq=False)
class Ellipses:
    """Centres xy (n, 2) on a map and the Jacobians J (n, 2, 2) there."""

    xy: FloatArray
    J: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Indicatrices(Ellipses):
    """Ellipses of a map, and the points in degrees whose images are their centres, in metres."""

    domain: Domain
    lon: FloatArray
    lat: FloatArray

    def take(self, keep: BoolArray | IntArray) -> Indicatrices:
        """The chosen indicatrices."""
        return replace(self, lon=self.lon[keep], lat=self.lat[keep], xy=self.xy[keep], J=self.J[keep])


def indicatrices(domain: Domain, region: Place, lon: FloatArray, lat: FloatArray) -> Indicatrices:
    """Indicatrices at the points that are in a region; circles must stay within `domain`."""
    xy = np.column_stack(domain(lon, lat))
    J = jacobian(domain.projection, lon, lat)
    with np.errstate(invalid="ignore"):
        keep = np.isfinite(xy[:, 0]) & np.isfinite(J).all(axis=(1, 2)) & (np.abs(np.linalg.det(J)) > 1e-12)
    inside = region.contains(lon, lat)
    if len(region.edges) and inside.sum() < _FEW:
        # Of a region so scattered that few points are in it, also those nearest to its border.
        from scipy.spatial import cKDTree  # slow to load, and hardly any region is so scattered

        tree = cKDTree(unit_vectors(lon, lat).T)
        inside[tree.query(unit_vectors(region.edges[:, 0], region.edges[:, 1]).T)[1]] = True
    return Indicatrices(xy=xy, J=J, domain=domain, lon=lon, lat=lat).take(keep & inside)


def close_pairs(indicatrices: Ellipses) -> tuple[IntArray, FloatArray, float]:
    """Pairs (m, 2) of close indicatrices, the radii in metres at which they touch, and the usual such radius."""
    # The usual radius is the median over the points of the radius at which they touch their closest neighbour. The
    # pairs are all that touch at this radius or less. There must be two or more indicatrices.
    xy, count = indicatrices.xy, len(indicatrices.xy)
    places = shapely.points(xy)
    tree = shapely.STRtree(places)
    # The nearest points are not always the first to touch: they give an upper bound of the radius.
    near = tree.query_nearest(places, exclusive=True, all_matches=False)
    bounds = np.full(count, np.inf)
    bounds[near[0]] = touching_radius(indicatrices, near.T)
    bound = np.partition(bounds, count // 2)[count // 2]
    # Ellipses that touch at radius r are within r (a + a') of each other; the directions tried give too small an r.
    reach = bound * principal_scales(indicatrices.J)[:, 0] / np.cos(np.pi / _DIRECTIONS)
    # From the point with the larger reach, the other is at most twice that reach away.
    one, other = tree.query(places, predicate="dwithin", distance=2.0 * reach)
    within = (one != other) & (np.hypot(*(xy[one] - xy[other]).T) <= reach[one] + reach[other])
    pairs = np.unique(np.sort(np.column_stack([one, other])[within], axis=1), axis=0)
    radii = touching_radius(indicatrices, pairs)
    closest = np.full(count, np.inf)
    np.minimum.at(closest, pairs, radii[:, None])
    usual = float(np.partition(closest, count // 2)[count // 2])
    return pairs[radii <= usual], radii[radii <= usual], usual


def touching_radius(indicatrices: Ellipses, pairs: IntArray) -> FloatArray:
    """Largest radius in metres at which the ellipses of pairs (m, 2) do not overlap."""
    # Two convex shapes are apart if their projections on some direction d are; half of an ellipse's is r |J^T d|.
    radii = np.zeros(len(pairs))
    for angle in np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS:
        d = np.array([np.cos(angle), np.sin(angle)])
        centre, half = indicatrices.xy @ d, np.linalg.norm(np.swapaxes(indicatrices.J, 1, 2) @ d, axis=1)
        apart, together = np.abs(np.diff(centre[pairs], axis=1)[:, 0]), half[pairs].sum(axis=1)
        np.maximum(radii, apart / together, out=radii)
    return radii


def fit(
    panels: Sequence[Indicatrices], radius: float | None = None, exaggeration: float = 1.0, *, crowded: bool = False
) -> tuple[float, list[Indicatrices]]:
    """One radius in metres for all panels, and the indicatrices to draw with it; no two of a panel overlap."""
    # With a given `radius` they may overlap. Left out are indicatrices that would touch a seam or an edge, those that
    # differ much from the circle's image, and, unless `crowded`, some that are far closer than usual. Scales get the
    # power `exaggeration`.
    if radius is not None:
        if not 0.0 < check_number("radius", radius) < np.inf:
            raise ValueError(f"Invalid radius '{radius}'. It must be a positive number of metres.")
        size, kept = radius, [panel.take(_fits(panel, radius)) for panel in panels]
    else:
        spaced = panels if crowded else [without_crowding(panel) for panel in panels]
        size = even_radius(spaced)
        for _ in range(_TRIALS):
            kept = [panel.take(_fits(panel, size)) for panel in spaced]
            # Circles that leave out most of a panel are too large for it: a narrow region, small lobes.
            if all(2 * few.lon.size >= many.lon.size for few, many in zip(kept, spaced, strict=True)):
                break
            size *= 0.8
    if exaggeration != 1.0:
        kept = [replace(panel, J=exaggerated(panel.J, exaggeration)) for panel in kept]
        size = even_radius(kept) if radius is None else radius
    return size, kept


def exaggerated(J: FloatArray, factor: float) -> FloatArray:
    """Jacobians (n, 2, 2) with their axes and orientation, and their principal scales to the power `factor`."""
    left, scales, right = np.linalg.svd(J)
    return np.asarray((left * scales[:, None, :] ** factor) @ right)


def usual_exaggeration(panels: Sequence[Indicatrices]) -> float:
    """The largest round factor, at least 1, with which 95 % of the principal scales stay within 1/1.6 .. 1.6."""
    logarithms = np.concatenate([np.abs(np.log(principal_scales(panel.J))).ravel() for panel in panels])
    if not logarithms.size:
        return 1.0
    wanted = np.log(_SEEN) / max(float(np.quantile(logarithms, 0.95)), _LEAST_SEEN)
    power = 10.0 ** np.floor(np.log10(max(wanted, 1.0)))
    return float(max((m * power for m in (1.0, 2.0, 5.0) if m * power <= wanted), default=1.0))


def principal_axes(indicatrices: Ellipses, radius: float) -> FloatArray:
    """The axes of ellipses of a radius in metres as segments, (m, 2, 2), without those of circles."""
    left, scales, _ = np.linalg.svd(indicatrices.J)
    bent = scales[:, 0] > (1.0 + _ROUND) * scales[:, 1]
    arms = radius * np.swapaxes(left * scales[:, None, :], 1, 2)[bent]
    centres = indicatrices.xy[bent][:, None]
    return np.stack([centres - arms, centres + arms], axis=2).reshape(-1, 2, 2)


def even_radius(panels: Sequence[Indicatrices]) -> float:
    """The radius in metres at which no two indicatrices of a panel overlap, with some space between them."""
    radii = [float(close_pairs(panel)[1].min()) for panel in panels if panel.lon.size > 1]
    if radii:
        return _FILL * min(radii)
    domains = [panel.domain for panel in panels]
    return min(float(0.05 * d.radius * np.radians(longitude_width(d.region.bounds))) for d in domains)


def without_crowding(panel: Indicatrices) -> Indicatrices:
    """The panel without the more distorted one of each pair that is far closer than usual."""
    if panel.lon.size < 3:
        return panel
    pairs, radii, usual = close_pairs(panel)
    keep = np.ones(panel.lon.size, dtype=bool)
    a, b = principal_scales(panel.J).T
    for i, j in pairs[radii < _CROWDED * usual]:
        if keep[i] and keep[j]:
            keep[i if a[i] * b[j] > a[j] * b[i] else j] = False
    return panel.take(keep)


def _fits(panel: Indicatrices, radius: float) -> BoolArray:
    """True for points around which the map is drawn, not torn and close to linear within `radius` metres."""
    fits = np.zeros(panel.lon.size, dtype=bool)
    for some in _portions(np.arange(fits.size), _AZIMUTHS):
        part = panel.take(some)
        fits[some] = _off_ellipse(part, radius, _circles(part, np.array([radius]))[:, 0]) <= _FLAT
    for some in _portions(np.flatnonzero(~fits), _AZIMUTHS * _RINGS):
        fits[some] = _is_smooth(panel.take(some), radius)
    return fits


def _portions(indices: IntArray, points: int) -> list[IntArray]:
    """Indices in portions that take little memory, with so many points on the ground for each index."""
    return np.array_split(indices, indices.size * points // _AT_ONCE + 1)


def _is_smooth(panel: Indicatrices, radius: float) -> BoolArray:
    """True for points whose circle's image has no jump or bend and stays near the ellipse."""
    xy = _circles(panel, np.linspace(0.0, radius, _RINGS + 1))
    # Along a ray the steps change slowly, measured in steps of the linear map.
    step = radius / _RINGS * np.linalg.norm(panel.J, axis=(1, 2))
    bend = np.linalg.norm(np.diff(xy, n=2, axis=1), axis=-1)
    smooth = (bend <= _BEND * step[:, None, None]).all(axis=(1, 2))
    # Near an antipode or a pole line the circle's image curves around the map, and its ellipse sticks out.
    return np.asarray(smooth & (_off_ellipse(panel, radius, xy[:, -1]) <= _OFFSET))


def _circles(panel: Indicatrices, radii: FloatArray) -> FloatArray:
    """Images (n, r, azimuths, 2) of the circles on the ground with radii (r,) in metres about each point."""
    distance = np.degrees(radii[:, None] / panel.domain.radius)
    azimuths = np.degrees(np.linspace(0.0, 2.0 * np.pi, _AZIMUTHS, endpoint=False))
    lons, lats = destination(panel.lon[:, None, None], panel.lat[:, None, None], azimuths, distance)
    return np.stack(panel.domain(wrapped(lons), lats), axis=-1)


def _off_ellipse(panel: Indicatrices, radius: float, rim: FloatArray) -> FloatArray:
    """Distances of circles' images, (n, azimuths, 2), from their ellipses, in semi-minor axes; NaN if not drawn."""
    azimuth = np.linspace(0.0, 2.0 * np.pi, _AZIMUTHS, endpoint=False)
    linear = np.einsum("nij,jt->nti", panel.J, np.stack([np.sin(azimuth), np.cos(azimuth)])) * radius
    offset = np.linalg.norm(rim - panel.xy[:, None] - linear, axis=-1).max(axis=1)
    return np.asarray(offset / (radius * principal_scales(panel.J)[:, 1]))


def ellipses(indicatrices: Ellipses, radius: float, vertices: int) -> FloatArray:
    """Polygons f(p) + r J (cos t, sin t), shape (n, vertices, 2)."""
    t = np.linspace(0.0, 2.0 * np.pi, vertices, endpoint=False)
    circle = np.stack([np.cos(t), np.sin(t)])
    return np.asarray(indicatrices.xy[:, None] + radius * np.swapaxes(indicatrices.J @ circle, 1, 2))


def tissot_points(surface: Surface, step: float | None, grid: tuple[float, float] | None = None) -> Indicatrices:
    """Indicatrices of a surface, about a dozen across, `step` degrees apart, or on a `grid` of degrees lat, lon."""
    # An ellipse may reach over the border of a country, but not over a seam or the map's edge.
    domain = surface.domain if surface.ground is None else surface.ground.domain
    region = surface.domain.region
    if grid is None:
        points = even_grid(region.bounds, usual_step(surface) if step is None else step, surface.central_meridian)
    elif step is None:
        points = graticule_grid(region.bounds, *grid)
    else:
        raise ValueError("Invalid step and grid. Only one of them may be given.")
    return indicatrices(domain, region, *points)


def usual_step(surface: Surface) -> float:
    """15 degrees for the globe; a ninth of smaller regions, less if they are narrow or fill little of their box."""
    bounds = surface.domain.region.bounds
    width, height = ground_size(bounds)
    wide, narrow = max(width, height), min(width, height)
    if wide > 150.0:
        return 15.0
    region = surface.domain.region
    share = region.area_km2 / Box.between(bounds, region.figure).area_km2
    return float(min(wide / 9.0, max(narrow / 2.0, wide / 40.0)) * np.clip(np.sqrt(share), _LEAST_SHARE, 1.0))
