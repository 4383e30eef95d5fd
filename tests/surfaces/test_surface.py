"""The drawn surface: all of the map once, nothing across its seams, an outline along them; lines and coasts on it."""

import functools

import numpy as np
import pytest
import shapely
from refusals import refuses
from tables import each, some

import projdist
from projdist import earth, surfaces
from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS as R
from projdist.earth.natural_earth import coastlines
from projdist.field.at_points import jacobian, measure_at
from projdist.matrices.measures import get_measure, principal_scales
from projdist.plots.basemap import map_size
from projdist.projections import Projection
from projdist.regions import GLOBE, Box, Cap, RegionLike
from projdist.surfaces import domain
from projdist.surfaces.fields import field, jumping
from projdist.surfaces.land import PreparedArea, _whole_area, coast, coast_resolution, land_polygons
from projdist.surfaces.surface import Surface, build_surface, triangles_of

OBLIQUE = f"+proj=ob_tran +o_proj=moll +o_lat_p=40 +o_lon_p=60 +R={R}"
ORTHO = f"+proj=ortho +lat_0=40 +lon_0=10 +R={R}"
EUROPE = Box(-10.0, 35.0, 40.0, 70.0)
SEAMED = ["robin", "igh", "tmerc", "healpix", "peirce_q", OBLIQUE, ORTHO, f"+proj=laea +lat_0=52 +lon_0=10 +R={R}"]


def surface_of(projection: object, region: RegionLike | None = None, step: float | None = 2.0) -> Surface:
    return build_surface(domain.domain_of(Projection.from_user_input(projection), region), step)


@each(("projection", "lon", "lat"), [("igh", -20.0, -40.0), ("igh", -40.0, 30.0), ("moll", 180.0, 10.0)])
@each("side", [-1, 1])
def test_rough_scales_beside_a_seam(projection: str, lon: float, lat: float, side: int) -> None:
    """Half a metre from a seam they are those of the point's own side, where the sixth-order stencils find them."""
    place, the_map = np.array([[lon + 5e-6 * side], [lat]]), Projection.from_user_input(projection)
    truth = principal_scales(jacobian(projection, lon + 0.05 * side, lat))
    found = domain.rough_scales(the_map, *place, *the_map(*place))
    np.testing.assert_allclose(np.ravel(found), truth, rtol=2e-3)  # of 5 km apart


def longest(start: np.ndarray, stop: np.ndarray) -> float:
    return np.hypot(*(stop - start).T).max()


def length_of(segments: np.ndarray) -> float:
    """That of segments (n, 2, 2) in all."""
    return np.linalg.norm(np.diff(segments, axis=1), axis=-1).sum()


@pytest.mark.slow
@pytest.mark.parametrize("projection", SEAMED)
def test_nothing_crosses_a_seam(projection: str) -> None:
    """No triangle, and no segment of graticule, coast and outline, is longer than the local scale allows."""
    surface = surface_of(projection)
    size, inside = map_size(surface), np.flatnonzero(np.isfinite(surface.x[: surface.nodes]))
    lon, lat = (value[inside] for value in surface.lonlat())
    largest = np.nanmax(principal_scales(jacobian(surface.domain.projection, lon, lat))[:, 0])
    # 2 degrees along the diagonal, and twice that next to singular points.
    allowed = min(2.0 * np.radians(2.0 * np.sqrt(2.0)) * R * largest, 0.15 * size)
    corners = np.stack([surface.x, surface.y], axis=-1)[surface.triangles]
    assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max() < allowed
    assert longest(*np.swapaxes(surface.outline, 0, 1)) < allowed
    for lines in (domain.graticule(GLOBE.bounds, 30.0, 30.0), coast(GLOBE.bounds, "110m", 1.0)):
        pieces = domain.project_lines(surface.domain, lines, size)
        assert max(longest(piece[:-1], piece[1:]) for piece in pieces) < min(allowed, 0.05 * size)


@pytest.mark.slow
@pytest.mark.parametrize("projection", some(SEAMED, 2))
def test_triangles_cover_the_map_once(projection: str) -> None:
    """Their area is det J integrated over the drawn nodes; the fewer fans of one colour have their area and border."""
    surface = surface_of(projection, step=1.0)
    corners = np.column_stack([surface.x, surface.y])
    area = shapely.area(shapely.polygons(corners[surface.triangles])).sum()
    inner = np.isfinite(surface.x[: surface.nodes]) & (np.abs(surface.v[: surface.nodes]) < 89.9)
    lon, lat = (value[: surface.nodes][inner] for value in surface.lonlat())
    density = get_measure("areal_scale")(jacobian(surface.domain.projection, lon, lat))
    step_u, step_v = 360.0 / surface.shape[1], 180.0 / (surface.shape[0] - 2)
    ground = R**2 * np.radians(step_u) * np.radians(step_v) * np.cos(np.radians(surface.v[: surface.nodes][inner]))
    assert area == pytest.approx(np.nansum(density * ground), rel=0.01)
    cells = np.arange(len(surface.whole) + len(surface.cut)) < 0.6 * len(surface.whole)
    for chosen, fine in ((None, surface.triangles), (cells, triangles_of(*surface.cells(cells)))):
        coarse = surface.covering(chosen)
        assert len(coarse) < 0.5 * len(fine)
        assert border_of(coarse) == border_of(fine)
        areas = [shapely.area(shapely.polygons(corners[triangles])).sum() for triangles in (coarse, fine)]
        assert areas[0] == pytest.approx(areas[1], rel=1e-6)


def border_of(triangles: np.ndarray) -> set[tuple[int, int]]:
    """The sides that one triangle has, and no other."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    pairs, counts = np.unique(sides, axis=0, return_counts=True)
    return set(map(tuple, pairs[counts == 1].tolist()))


@pytest.mark.slow
def test_outlines() -> None:
    """Of plate carree a rectangle; circles at R of the orthographic map, at 2 R, an antipode, of an equal-area map."""
    outline = surface_of("eqc").outline / (np.pi * R)
    assert (np.abs(np.abs(outline) - [1.0, 0.5]) < 1e-6).any(axis=-1).all()
    assert length_of(outline) == pytest.approx(6.0, rel=1e-4)
    for projection, radius in ((ORTHO, 1.0), (SEAMED[-1], 2.0)):
        outline = surface_of(projection).outline / (radius * R)
        assert np.abs(np.linalg.norm(outline, axis=-1) - 1.0).max() < 1e-6
        assert length_of(outline) == pytest.approx(2.0 * np.pi, rel=2e-3)


@pytest.mark.slow
def test_outline_of_goode_has_its_cuts() -> None:
    """The outline of Goode's interrupted map is as long as its meridians: two round, four cuts, both sides."""
    surface, lat, side, length = surface_of("igh", step=None), np.linspace(0.0, 90.0, 1000)[:-1], 1e-7, 0.0
    for sign, cuts in ((1.0, [-40.0]), (-1.0, [-100.0, -20.0, 80.0])):
        for meridian in [-180.0 + side, 180.0 - side, *(cut + off for cut in cuts for off in (-side, side))]:
            length += np.hypot(*np.diff(surface.domain.projection(meridian, sign * lat))).sum()
    assert length_of(surface.outline) == pytest.approx(length, rel=0.02)
    assert np.abs(surface.outline[..., 0]).max() == pytest.approx(np.pi * R, rel=1e-3)


@pytest.mark.slow
def test_endless_maps_are_cut() -> None:
    """Mercator ends where its scale is 12, at 85.2 degrees; the gnomonic map about 73 degrees from its centre."""
    assert surface_of("merc").extent[3] / R == pytest.approx(np.arccosh(12.0), abs=0.02)
    assert surface_of(f"+proj=gnom +lat_0=90 +R={R}").extent[1] / R == pytest.approx(np.sqrt(11.0), abs=0.25)
    # PROJ's transverse Mercator is wrong about its singular points; meridians are 40,008 km long on GRS 80.
    surface = surface_of("+proj=tmerc", GLOBE)
    west, east, south, north = surface.extent
    assert max(-south, north) == pytest.approx(20_003_931.5, abs=10.0)
    assert max(-west, east) < 22e6
    assert surface.weights.sum() == pytest.approx(1.0)
    assert np.isin(np.arange(surface.nodes), surface.triangles).mean() > 0.98


@pytest.mark.slow
def test_region_is_filled_and_bounded() -> None:
    """A box, also across the antimeridian, and a cap about a pole are drawn whole, to the edge and no further."""
    for region, sides in ((Box(160.0, -50.0, -170.0, -30.0), (-10.0, 20.0)), (EUROPE, (-180.0, -130.0))):
        surface = surface_of(f"+proj=eqc +lon_0=170 +R={R}", region, None)
        truth = *sides, region.south, region.north
        assert np.degrees(np.array(surface.extent) / R) == pytest.approx(truth, abs=1e-5)
    surface = surface_of(f"+proj=aeqd +lat_0=90 +R={R}", Cap(0.0, 90.0, 1000.0), None)
    assert np.linalg.norm(surface.outline, axis=-1) == pytest.approx(1e6, rel=1e-5)
    assert min(surface.shape) > 90


def test_area_of_use_is_the_region() -> None:
    """A national CRS is drawn over its area of use; a region that cannot be projected is refused by name."""
    degrees = np.array(surface_of("EPSG:2154", step=None).lonlat())
    assert [*degrees.min(axis=1), *degrees.max(axis=1)] == pytest.approx([-9.86, 41.15, 10.38, 51.56], abs=0.01)
    outside = Box(-175.0, -50.0, -165.0, -30.0)
    refuses(r"Invalid region for 'Orthographic'. No part of it can be projected.", surface_of, ORTHO, outside, None)


def test_ground_size_and_graticule_steps() -> None:
    """Width at the middle latitude, across the pole where that is less; whole degrees, or minutes and seconds."""
    sizes = {(0.0, 59.0, 10.0, 61.0): (5.0, 2.0), GLOBE.bounds: (360.0, 180.0)}
    sizes |= dict.fromkeys([(-180.0, 80.0, 180.0, 90.0), (-180.0, -90.0, 180.0, -80.0)], (20.0, 10.0))
    for bounds, size in sizes.items():
        assert domain.ground_size(bounds) == pytest.approx(size)
    # Such steps as people write; in the north meridians are farther apart.
    steps = {GLOBE: (30.0, 30.0), EUROPE: (10.0, 5.0), Cap(0.0, 90.0, 3000.0): (30.0, 10.0)}
    for region, step in (steps | {Cap(10.0, 54.0, 1.0): (20 / 3600, 10 / 3600)}).items():
        assert domain.graticule_steps(region.bounds) == pytest.approx(step)
    # A step is taken for meridians and parallels, unless the lines would be thousands.
    assert domain.graticule_steps(EUROPE.bounds, 7.0) == (7.0, 7.0)
    lines = r"Invalid step '0.1'. It makes 5,400 lines, and at most 2,000 are drawn"
    refuses(lines, domain.graticule_steps, GLOBE.bounds, 0.1)
    refuses(r"Invalid step '0'. It must be a positive number of degrees", domain.graticule_steps, GLOBE.bounds, 0)


GERMANY = [(9.0, 53.0, 12.0, 56.0), (10.0, 54.3, 10.4, 54.5)]
FIJI = [(170.0, -60.0, -150.0, -10.0), (177.0, -18.5, 180.0, -15.5), (-180.0, -18.5, -177.0, -15.5)]


@pytest.mark.slow
@each("bounds", [*GERMANY, *FIJI, (-100.0, -90.0, 250.0, 90.0)])
def test_coast_is_clipped_and_whole(bounds: tuple[float, float, float, float]) -> None:
    """Within a box the coast is that part of the whole coast; it does not run on, and has no long steps."""
    west, south, east, north = sides = Box(*bounds).bounds
    lines = coast(sides, "50m", 0.5)
    points = np.concatenate(lines)
    assert (
        np.abs(points - [(west + east) / 2, (south + north) / 2]) < 0.53 * np.array([east - west, north - south])
    ).all()
    assert max(longest(line[:-1], line[1:]) for line in lines) < 0.5 + 1e-9
    window = shapely.box(west, south, east, north)
    turned = [line + np.array([turn, 0.0]) for line in coastlines("50m") for turn in (-360.0, 0.0, 360.0)]
    whole, drawn = (shapely.multilinestrings([shapely.linestrings(line) for line in some]) for some in (turned, lines))
    length = shapely.length(shapely.intersection(whole, window))
    assert shapely.length(shapely.intersection(drawn, window)) == pytest.approx(length, rel=1e-9)


def test_coast_of_a_tiny_region_is_short() -> None:
    """Lines are clipped before points are put between theirs: a box of 100 m does not see the other continents."""
    lines = coast((10.1500, 54.3665, 10.1515, 54.3680), "50m", 1e-5)
    assert sum(len(line) for line in lines) < 1000
    assert not coast((10.0, 50.0, 10.01, 50.01), "50m", 1e-4)
    assert not coast((-180.0, 89.0, 180.0, 90.0), "50m", 1e-4)


FINE = "country:SG@10m", "country:CH@10m", "country:FJ@main@10m", "country:CH@10m & box:7,46,8,47", "cap:10,54,1"
COASTS = {None: "110m", EUROPE: "50m", "country:SG": "50m", "country:CH@110m": "110m"}
COASTS |= dict.fromkeys((*FINE, "box:7,46,8,47 - cap:7.5,46.5,10"), "10m")


@pytest.mark.slow
@each("region, resolution", COASTS.items())
def test_resolutions_of_coasts(region: RegionLike | None, resolution: str) -> None:
    """The world's is coarse, a continent's finer, a town's the finest; about a country it is that of its border."""
    assert coast_resolution(surface_of("robin", region)) == resolution


LANDS = [("EPSG:3035", (14.6, 54.95, 15.2, 55.35), 588.0), ("EPSG:3035", (-40.0, 30.0, -39.0, 31.0), 0.0)]
LANDS += [("+proj=laea +lat_0=71 +lon_0=180", (177.0, 70.5, -176.5, 72.0), 7600.0)]


@pytest.mark.slow
@each("projection, bounds, known", LANDS)
def test_fine_land_of_equal_area_maps(projection: str, bounds: tuple[float, float, float, float], known: float) -> None:
    """Whole cells and pieces of cells have the area of Bornholm and Wrangel, as encyclopaedias have it, to 5 %."""
    surface = surface_of(projection, bounds)
    triangles, pieces = land_polygons(surface, "10m")
    corners = np.column_stack([surface.x, surface.y])[triangles]
    area = shapely.area(shapely.polygons(corners)).sum() + sum(shapely.Polygon(piece).area for piece in pieces)
    assert area / 1e6 == pytest.approx(known, rel=0.05)


SIZE = 5e6  # metres, of maps of a continent: what their curves are smooth to
# The fast case is about the Caspian Sea, a hole. The picture of Europe shows the pole, and closes round it; that of the
# Arctic is cut at the antimeridian; Australia has islands only.
CASES = [("EPSG:3035", "box:-10,35,40,70"), ("EPSG:6931", "cap:0,90,2000"), ("EPSG:3035", "country:DE")]


@pytest.mark.slow
@each("projection, region", [("ESRI:102025", "box:40,30,60,50"), *CASES, ("EPSG:3577", "country:AU")])
def test_equal_area_maps_keep_the_area_of_the_land(projection: str, region: str) -> None:
    """By even and odd, the rings have the area of the land within the surroundings, on the ground."""
    ground = surfaces.surface_of(projection, region, 2.0).ground
    shapes = [shapely.make_valid(shapely.polygons(ring)) for ring in surfaces.land_rings(ground, "50m", SIZE)]
    inside = functools.reduce(shapely.symmetric_difference, shapes)
    west, south, east, north = ground.domain.box.bounds
    box = f"box:{west!r},{south!r},{projdist.get_region('globe').bounds[2] if east == 180.0 else east!r},{north!r}"
    truth = projdist.get_region(f"land@50m & {box}").area_km2
    assert shapely.area(inside) / 1e6 == pytest.approx(truth, rel=2e-4)  # chords, smooth to 2.5 km


def test_torn_maps_have_no_rings() -> None:
    """A seam, or an edge, may part what a ring is around."""
    for projection, region in (("igh", "box:-60,-60,60,-10"), ("+proj=ortho +lat_0=50 +lon_0=10", "box:-60,-60,80,70")):
        surface = surfaces.surface_of(projection, region, 2.0)
        assert surfaces.land_rings(surface if surface.ground is None else surface.ground, "50m", SIZE) is None


@pytest.mark.slow
@each("region, share", [(None, 0.3), ((-12.0, 30.0, 45.0, 72.0), 0.3), ((20.0, 20.0, 21.0, 21.0), 0.0)])
def test_few_cells_may_be_on_the_border(region: tuple[float, float, float, float] | None, share: float) -> None:
    """Cells that GEOS finds on the coast are among them, all but boxes of which are off it; inland there are none."""
    surface = surface_of("eqc", region, None if region else 2.0)
    lons, lats = (degrees[surface.whole.T] for degrees in surface.lonlat())
    lons = earth.wrapped(lons[0]) + np.mod(lons - lons[0] + 180.0, 360.0) - 180.0
    area: PreparedArea = _whole_area("coast", "110m")
    boxes = shapely.box(lons.min(axis=0), lats.min(axis=0), lons.max(axis=0), lats.max(axis=0))
    met = set(area.edges.query(boxes, predicate="intersects")[0].tolist())
    found = set(area.may_border(lons, lats).tolist())
    assert met <= found
    assert len(found) <= share * len(boxes)


JOINT = 40.0 + 44.0 / 60.0 + 11.98 / 3600.0  # degrees: where Goode joins the sinusoidal map to Mollweide's
GOODE = [("goode-homolosine", "omega", True), ("goode-homolosine", "h", True)]
WHOLE = {"robin": "omega", "merc": "s", "+proj=ortho +R=6371000": "h", "winkel-tripel": "omega"}


@pytest.mark.slow
@pytest.mark.parametrize(("projection", "measure", "jumps"), [*GOODE, *((*one, False) for one in WHOLE.items())])
def test_jumps_are_where_maps_are_joined(projection: str, measure: str, jumps: bool) -> None:
    """Goode's map jumps at 40 degrees 44 minutes; kinks, steep fields and limbs are no jumps."""
    surface, chosen = surface_of(projection), get_measure(measure)
    levels = np.concatenate([np.linspace(0.5, 3.0, 26), np.arange(5.0, 90.0, 5.0)])
    at = functools.partial(measure_at, surface.domain.projection, chosen)
    found = jumping(surface, field(surface, chosen), levels, at)
    assert found.any() == jumps
    lat = np.abs(surface.lonlat()[1][surface.triangles[found]])
    assert ((lat.min(axis=1) < JOINT) & (lat.max(axis=1) > JOINT)).all()
