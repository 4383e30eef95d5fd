"""Regions on a map: whole to their border, side by side, with surroundings that fill the picture."""

import numpy as np
import pytest
import shapely
from matplotlib.tri import Triangulation
from tables import each

from projdist import atlas
from projdist.regions import get_region
from projdist.support import Notice
from projdist.surfaces.land import clipped
from projdist.surfaces.regional import shown_part, surface_of
from projdist.surfaces.tissot_ellipses import tissot_points

pytestmark = pytest.mark.slow


def test_what_geos_cannot_clip() -> None:
    """A border that was cut by another one; the area within the box is that of the general intersection."""
    box = 26.390677415095325, 40.22908803275496, 26.98986004925743, 40.82832081467412
    border = get_region("country:TR - continent:Europe").geometry
    assert clipped(border, *box).area == pytest.approx(shapely.intersection(border, shapely.box(*box)).area, rel=1e-12)


def area_of(pieces) -> float:
    return sum(shapely.Polygon(piece).area for piece in pieces)


@each("text", ["country:KI@all", "country:FJ", "country:MH"])
def test_islands_are_drawn_however_small(text: str) -> None:
    """The pieces of an equal-area map have the area of the region, also where a cell has several islands."""
    region = get_region(text)
    surface = surface_of("+proj=laea +lat_0=-10 +lon_0=-175 +ellps=WGS84", region)
    # Sides of pieces are straight on the map.
    assert area_of(surface.pieces) == pytest.approx(1e6 * region.area_km2, rel=1e-3)
    if text == "country:KI@all":  # Where no point of the grid falls on atolls, those beside them stand for them.
        assert tissot_points(surface_of("EPSG:3832", text), None).lon.size >= 9


@each("text", ["country:LI", "country:DE"])
def test_pieces_of_a_region_are_side_by_side(text: str) -> None:
    """A country's area on an equal-area map, to the bend of the sides of cells; no piece covers another."""
    pieces = [shapely.Polygon(piece) for piece in surface_of("EPSG:3035", text).pieces]
    assert (total := area_of(pieces)) == pytest.approx(1e6 * get_region(text).area_km2, rel=1e-5)
    assert shapely.union_all(pieces, grid_size=0.01).area == pytest.approx(total, rel=1e-6)
    assert all(piece.exterior.is_ccw for piece in pieces)


COUNTRIES = {2193: "NZ", 3460: "FJ", 3576: "RU", 3031: "AQ", 6350: "US", "mercator": "NO@main"}
FRAMES = {code: f"country:{name}" for code, name in COUNTRIES.items()}
FRAMES |= {2154: "cap:2.35,48.85,60", 25832: "box:6,47,12,55"}


@pytest.mark.parametrize(("projection", "region"), FRAMES.items())
def test_surroundings_fill_the_picture(projection: str | int, region: str) -> None:
    """Every pixel of a frame that the map covers is on a triangle of the ground, the antimeridian or a pole within."""
    surface = surface_of(projection, region)
    ground, inside, (west, east, south, north) = surface.ground, surface.extent, surface.view
    x, y = np.meshgrid(np.linspace(west, east, 41), np.linspace(south, north, 41))
    if projection != 6350:  # the cone of this map leaves a gap about the pole
        assert (Triangulation(ground.x, ground.y, ground.triangles).get_trifinder()(x, y) >= 0).all()
    assert west <= inside[0] < inside[1] <= east
    assert south <= inside[2] < inside[3] <= north


def test_parts_far_away_are_left_out_where_the_picture_would_be_empty() -> None:
    """France without Guiana and Réunion; the United States with Alaska, which fill their box."""
    assert shown_part(get_region("country:FR")).bounds == pytest.approx((-4.76, 41.4, 9.52, 51.1), abs=0.1)
    for text in ("country:US", "country:DE", "country:FR@all", "globe"):
        assert shown_part(get_region(text)) == get_region(text)


def test_a_map_that_is_cut_within_the_region_says_so() -> None:
    """Fiji on both ends of the world: one line names the middle that shows it whole, and it does."""
    with pytest.warns(Notice, match=r"Gall-Peters is cut within country:FJ.*\+lon_0=178, may show it whole"):
        torn = surface_of("gall-peters", "country:FJ").extent
    whole = surface_of("gall-peters+lon_0=178", "country:FJ").extent
    assert whole[1] - whole[0] < 1e6 < 2e7 < torn[1] - torn[0]


def test_the_border_is_drawn_whole() -> None:
    """Its length on the map is that of the image of the box's sides, and its ends meet."""
    surface = surface_of("EPSG:2154", "box:-5,42,8,51")
    (border,) = surface.border
    np.testing.assert_allclose(border[0], border[-1])
    corners = np.column_stack(surface.domain.projection([-5.0, 8.0, 8.0, -5.0], [42.0, 42.0, 51.0, 51.0]))
    distances = np.linalg.norm(border[:, None] - corners, axis=-1).min(axis=0)
    np.testing.assert_allclose(distances, 0.0, atol=1.0)


def test_a_border_reaches_to_the_other_end_of_the_world() -> None:
    """Of all land on an equal-area map: as far as the pieces do, whose area is that on the ground."""
    region = get_region("land - continent:Antarctica")
    # About the antipode the map turns round and round within a step; and tiles of this land crossed themselves.
    surface = surface_of("+proj=laea +lat_0=40 +lon_0=10 +ellps=WGS84", region, 2.0)
    assert area_of(surface.pieces) == pytest.approx(1e6 * region.area_km2, rel=2e-3)
    drawn = shapely.total_bounds([shapely.linestrings(line) for line in surface.border])
    np.testing.assert_allclose(drawn, shapely.total_bounds([shapely.polygons(p) for p in surface.pieces]), rtol=1e-3)


def test_maps_that_come_round_again_show_one_sheet() -> None:
    """The New Zealand Map Grid is a polynomial: far places fall into its frame again, and are not drawn."""
    surface = surface_of("EPSG:27200", "country:NZ@main")
    ground, (west, east, south, north) = surface.ground, surface.view
    seen = (ground.x > west) & (ground.x < east) & (ground.y > south) & (ground.y < north)
    lon, lat = (degrees[seen] for degrees in ground.lonlat())
    assert lat.size > 1000
    assert -56.0 < lat.min() < lat.max() < -30.0
    assert 160.0 < np.mod(lon, 360.0).min() < np.mod(lon, 360.0).max() < 186.0


@pytest.mark.parametrize("place", ["continent:Africa", "country:Indonesia"])
@pytest.mark.parametrize("purpose", ["any", "conformal", "equal-area"])
def test_made_maps_cover_their_view_once(place, purpose) -> None:
    """Also conformal ones, which turn nothing over where they come round, and equal-area ones, which swell nothing."""
    entry = atlas(place)
    surface = surface_of(entry.purposes[purpose].made.projection, entry.region)
    ground, (west, east, south, north) = surface.ground, surface.view
    corners = np.stack([ground.x, ground.y], axis=-1)[ground.triangles]
    seen = ((corners > [west, south]) & (corners < [east, north])).all(axis=(1, 2))
    one, other = corners[seen, 1] - corners[seen, 0], corners[seen, 2] - corners[seen, 0]
    covered = 0.5 * np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]).sum()
    assert 0.5 < covered / ((east - west) * (north - south)) < 1.02
