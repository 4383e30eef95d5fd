"""The surface of a region, exact at its border, with that of its surroundings."""

from dataclasses import replace

import numpy as np
import shapely

from projdist._typing import BoolArray, FloatArray
from projdist.earth import wrapped
from projdist.projections import Projection, ProjectionLike
from projdist.regions import GLOBE, Box, Place, Polygons, Region, RegionLike, main_part, polygons_of
from projdist.support import tell
from projdist.surfaces.domain import domain_of, ground_size, is_part, longitude_width, project_lines
from projdist.surfaces.land import CellsIn, PreparedArea, cells_in, segments_of
from projdist.surfaces.surface import Surface, build_surface, extent_of, frame_of_part, node_weights, triangles_of

_FULLER = 4.0  # far parts are left out if the main part fills its bounding box this many times better
_GROUND_NODES, _GLOBE_GROUND_STEP = 80, 1.0  # of surroundings: nodes across, and largest step in degrees
_APART = 1.5  # of the length of all cells in a row: parts of a region that span more lie apart
_ALONG_BORDER = 60.0  # steps along the size of a region
_ONCE = 1.2  # of the view's area: cells that cover more cover a part of it twice (cells at its sides reach beyond it)
_SWOLLEN = 4.0  # ratio, either way, of a cell's area scale to the usual one in the region
_SOUGHT, _ROUND = 193, 1.0  # nodes across the search for surroundings, and its reach in sizes of the region


def surface_of(projection: ProjectionLike, region: RegionLike | None, step: float | None = None) -> Surface:
    """The surface of the drawn part of a map, for None its area of use or the globe, in cells of `step` degrees."""
    domain = domain_of(Projection.from_user_input(projection), region)
    surface = build_surface(domain, step)
    return _regional(surface, domain.region) if is_part(domain.region) else surface


def shown_part(region: Place) -> Place:
    """The part of a region that a picture shows: its main part if distant parts would leave it almost blank."""
    if not (isinstance(region, Polygons) and region.far):
        return region
    main = main_part(region)
    return main if isinstance(main, Polygons) and _fullness(main) > _FULLER * _fullness(region) else region


def _fullness(region: Polygons) -> float:
    """The share of its bounding box that a region fills."""
    return region.area_km2 / Box.between(region.bounds, region.figure).area_km2


def _regional(surface: Surface, region: Region) -> Surface:
    """The surface of a region: that of the box around it, without the cells outside the region."""
    lines = _border_lines(region)
    area = PreparedArea.of(polygons_of(region), segments_of(lines))
    found = cells_in(surface, area)
    pieces = _pieces(surface, found)
    if not pieces:
        raise surface.domain.shows_nothing()
    extent = extent_of(np.concatenate(pieces))
    whole, cut = surface.cells(found.touched)
    triangles = triangles_of(whole, cut)
    part = replace(
        surface,
        whole=whole,
        cut=tuple(cut),
        triangles=triangles,
        weights=node_weights(surface.x, surface.y, surface.v, triangles, surface.source, surface.nodes),
        extent=extent,
        view=frame_of_part(extent),
        pieces=pieces,
    )
    if _lies_apart(part):
        bounds, name = part.domain.region.bounds, part.domain.projection.name
        middle = float(wrapped(np.array(0.5 * (bounds[0] + bounds[2]))))
        tell(
            f"{name} is cut within {part.domain.region.name}, so that its parts lie apart. "
            f"A map with its middle there, +lon_0={middle:.0f}, may show it whole."
        )
        ground = surface_of(part.domain.projection, GLOBE, _GLOBE_GROUND_STEP)
        part = replace(part, extent=ground.extent, view=ground.view)
    else:
        ground = _surroundings(part)
    size = max(extent[1] - extent[0], extent[3] - extent[2])
    return replace(part, border=tuple(project_lines(ground.domain, lines, size)), ground=ground)


def _lies_apart(part: Surface) -> bool:
    """True if a seam separates parts of a region by more than all its cells in a row would span."""
    if not (part.cut and len(part.whole)):
        return False
    x, y = part.x[part.whole], part.y[part.whole]
    longest = float(np.hypot(np.diff(x, axis=1), np.diff(y, axis=1)).max())
    west, east, south, north = part.extent
    return east - west + north - south > _APART * longest * sum(part.shape)


def _border_lines(region: Region) -> list[FloatArray]:
    """The border of a region as lines of (lon, lat) in small steps, without sides along antimeridian and poles."""
    lines = []
    spacing = max(ground_size(region.bounds)) / _ALONG_BORDER
    for ring in shapely.get_rings(shapely.get_parts(polygons_of(region))):
        points = shapely.get_coordinates(ring)
        on_cut = np.abs(points) == [180.0, 90.0]
        real = ~(on_cut[1:] & on_cut[:-1] & (points[1:] == points[:-1])).any(axis=1)
        runs = np.split(np.arange(real.size), np.flatnonzero(np.diff(real)) + 1)
        for line in (points[run[0] : run[-1] + 2] for run in runs if real[run[0]]):
            steps = np.diff(line, axis=0)
            across = np.cos(np.radians(0.5 * (line[1:, 1] + line[:-1, 1])))
            parts = np.maximum(np.ceil(np.hypot(steps[:, 0] * across, steps[:, 1]) / spacing).astype(int), 1)
            ends = np.concatenate([[0], np.cumsum(parts)])
            lines.append(np.column_stack([np.interp(np.arange(ends[-1] + 1), ends, column) for column in line.T]))
    return lines


def _pieces(surface: Surface, found: CellsIn) -> tuple[FloatArray, ...]:
    """The polygons of a region, all anticlockwise, as no gap shows between polygons of one orientation."""

    def anticlockwise(polygons: FloatArray) -> FloatArray:
        """Polygons (m, n, 2) with clockwise ones reversed."""
        x, y = np.moveaxis(polygons - polygons[:, :1], -1, 0)
        turned = (x[:, :-1] * y[:, 1:]).sum(axis=1) < (y[:, :-1] * x[:, 1:]).sum(axis=1)
        return np.where(turned[:, None, None], polygons[:, ::-1], polygons)

    xy = np.column_stack([surface.x, surface.y])
    whole, cut = surface.cells(found.inside)
    parts = [*(xy[cell] for cell in cut), *found.pieces]
    return (*anticlockwise(xy[whole]), *(anticlockwise(part[None])[0] for part in parts))


def _surroundings(part: Surface) -> Surface:
    """The surface that fills the picture around a region."""
    projection = part.domain.projection
    west, south, _, north = part.domain.region.bounds
    width, reach = longitude_width(part.domain.region.bounds), _ROUND * max(ground_size(part.domain.region.bounds))
    low, top = max(south - reach, -90.0), min(north + reach, 90.0)
    # A degree of longitude is shortest at the latitude nearest to a pole.
    across = reach / max(np.cos(np.radians(max(-low, top))), 1e-3)
    lons = west + 0.5 * width + min(0.5 * width + across, 180.0) * np.linspace(-1.0, 1.0, _SOUGHT)
    lats = np.linspace(low, top, _SOUGHT)
    x, y = projection(*np.meshgrid(wrapped(lons), lats))
    left, right, bottom, top = part.view
    seen = np.asarray((x >= left) & (x <= right) & (y >= bottom) & (y <= top), dtype=bool)
    near = _one_sheet(part, lons, lats, x, y, seen)
    west, east = _reach(lons, np.asarray(near.any(axis=0)))
    low, high = _reach(lats, np.asarray(near.any(axis=1)))
    south, north = max(low, -90.0), min(high, 90.0)
    if east - west < 360.0:
        first = float(wrapped(np.array(west)))
        box = Box(first, south, float(wrapped(np.array(first + east - west))), north)
    else:
        box = Box(-180.0, south, 180.0, north)
    domain = domain_of(projection, box)
    step = min(max(ground_size(box.bounds)) / _GROUND_NODES, _GLOBE_GROUND_STEP)
    if (near == seen).all():
        return build_surface(domain, step)
    shown = _widened(near, ~seen | near)

    def within(lon: FloatArray, lat: FloatArray) -> BoolArray:
        """True for points whose nearest node is shown."""
        columns = np.rint(np.mod(lon - lons[0], 360.0) / (lons[1] - lons[0])).astype(int)
        rows = np.rint((lat - lats[0]) / (lats[1] - lats[0])).astype(int)
        return np.asarray(shown[np.clip(rows, 0, len(lats) - 1), np.clip(columns, 0, len(lons) - 1)])

    return replace(build_surface(replace(domain, within=within), step), outline=np.empty((0, 2, 2)))


def _one_sheet(
    part: Surface, lons: FloatArray, lats: FloatArray, x: FloatArray, y: FloatArray, seen: BoolArray
) -> BoolArray:
    """Nodes in the view that are connected with the region without a fold, (rows, columns)."""
    # Maps made for one region, as polynomials are, fold beyond it or come back into the view.
    (x_lat, x_lon), (y_lat, y_lon) = np.gradient(x), np.gradient(y)
    cells = np.asarray(x_lon * y_lat - x_lat * y_lon)
    areas = cells / np.cos(np.radians(lats)).clip(1e-6)[:, None]
    west, south, _, north = part.domain.region.bounds
    east = west + longitude_width(part.domain.region.bounds)
    inside = ((lons >= west) & (lons <= east))[None, :] & ((lats >= south) & (lats <= north))[:, None] & seen
    # The majority of signs decides, as near a singular point areas are huge and of either sign.
    way = float(np.sign(np.nansum(np.sign(areas[inside]))))
    upright = seen & (np.sign(areas) != -way)  # at a pole it is 0
    found = _connected(inside, upright)
    left, right, bottom, top = part.view
    if (found == seen).all() and np.nansum(np.abs(cells[seen])) < _ONCE * (right - left) * (top - bottom):
        return found
    # Where a map covers the view a second time, it is much larger or smaller.
    usual = float(np.nanmedian(np.abs(areas[inside])))
    return _connected(inside, upright & (np.abs(areas) < _SWOLLEN * usual) & (np.abs(areas) > usual / _SWOLLEN))


def _connected(chosen: BoolArray, allowed: BoolArray) -> BoolArray:
    """The allowed nodes of a grid that are connected with the chosen ones."""
    found = chosen & allowed
    while True:
        wider = _widened(found, allowed, 1)
        if (wider == found).all():
            return found
        found = wider


def _widened(chosen: BoolArray, allowed: BoolArray, steps: int = 4) -> BoolArray:
    """The chosen nodes of a grid, grown by some steps into allowed ones; columns close around the globe."""
    for _ in range(steps):
        wider = chosen.copy()
        wider[1:] |= chosen[:-1]
        wider[:-1] |= chosen[1:]
        wider |= np.roll(chosen, 1, axis=1) | np.roll(chosen, -1, axis=1)
        chosen = wider & (allowed | chosen)
    return chosen


def _reach(values: FloatArray, seen: BoolArray) -> tuple[float, float]:
    """The range of evenly spaced values that are seen, widened by four steps at either end."""
    first, last = np.flatnonzero(seen)[[0, -1]]
    more = 4.0 * (values[1] - values[0])
    return float(values[first] - more), float(values[last] + more)
