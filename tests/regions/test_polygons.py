"""Integrals over polygons against closed forms, grids and quadrature; areas against geodesics; cells; ways to write."""

import functools
import math
import pickle
import tracemalloc
from itertools import pairwise

import numpy as np
import pyproj
import pytest
import scipy.integrate
import shapely
from region_texts import square
from tables import each

from projdist.answers.summaries import summarize
from projdist.earth import GEOS_ARITHMETIC, MEAN_EARTH_RADIUS, SPHERE, WGS84, data_rows
from projdist.earth import natural_earth as geodata
from projdist.field import field_resolving
from projdist.numerics.polynomials import NODES
from projdist.projections import Projection
from projdist.regions import Box, Polygons, cells_of, get_region, polygons, polygons_of
from projdist.regions.region import patch_chart, tightened

R = MEAN_EARTH_RADIUS
GEOD = pyproj.Geod(ellps="WGS84")


def polygon(*rings, name="test"):
    """A region of one polygon: a shell and holes, as lists of (lon, lat)."""
    return get_region({"type": "Polygon", "coordinates": [[*ring, ring[0]] for ring in rings]})


TRIANGLE = [(-20.0, 5.0), (35.0, 15.0), (10.0, 65.0)]
# A star with a hole: concave, and cut many times by any line.
RADII = [8, 18] * 7
STAR = [(20 + r * math.cos(k * math.pi / 7), 40 + r * math.sin(k * math.pi / 7)) for k, r in enumerate(RADII)]
HOLE = [(17.0, 38.0), (22.0, 37.0), (21.0, 42.0)]


def sinusoidal_square(lon, lat):
    """ln^2 a + ln^2 b of the sinusoidal map of the sphere: a - b = |shear| and a b = 1."""
    return 2 * np.arcsinh(np.radians(lon) * np.sin(np.radians(lat)) / 2) ** 2


def raw(projection, region, tolerance=1e-9):
    return summarize(projection, region, tolerance=tolerance).airy_kavrayskiy


# ---- integrals ------------------------------------------------------------------------------
def test_a_box_as_a_polygon():
    """Plate carree over a box: the mean of ln^2 cos(latitude), weighted by cos(latitude)."""
    region = polygon([(-30, -20), (50, -20), (50, 70), (-30, 70)])
    top, bottom = (
        scipy.integrate.quad(f, math.radians(-20), math.radians(70), epsrel=1e-13)[0]
        for f in (lambda p: math.log(math.cos(p)) ** 2 * math.cos(p), math.cos)
    )
    assert raw(f"+proj=eqc +R={R}", region) == pytest.approx(math.sqrt(top / bottom), rel=1e-9)


@pytest.mark.parametrize("centre", [(20, 50), (179, -30), (40, 88)], ids=["plain", "antimeridian", "pole"])
def test_a_cap_as_a_polygon(centre):
    """Azimuthal equidistant over a cap whose rim is a chain of chords: a = c / sin c, b = 1."""
    lon, lat = centre
    region = get_region(f"cap:{lon},{lat},3000 & globe", SPHERE)
    angle = 3e6 / R
    square = scipy.integrate.quad(lambda c: math.log(c / math.sin(c)) ** 2 * math.sin(c), 0, angle, epsrel=1e-12)[0]
    truth = math.sqrt(square / (1 - math.cos(angle)))
    assert raw(f"+proj=aeqd +lon_0={lon} +lat_0={lat} +R={R}", region) == pytest.approx(truth, rel=1e-6)


def test_a_triangle_by_quadrature():
    """The sinusoidal map over a triangle, by adaptive quadrature of its closed form."""
    (west, _), (east, _), _ = TRIANGLE

    def between(lon):
        """South and north of the triangle at a longitude."""
        lats = sorted(
            y0 + (lon - x0) * (y1 - y0) / (x1 - x0)
            for (x0, y0), (x1, y1) in pairwise([*TRIANGLE, TRIANGLE[0]])
            if min(x0, x1) <= lon <= max(x0, x1)
        )
        return lats[0], lats[-1]

    def strip(f):
        def total(lon):
            low, high = between(lon)
            lats, w = 0.5 * (low + high) + 0.5 * (high - low) * x, 0.5 * (high - low) * gauss
            return float(np.sum(w * f(lon, lats) * np.cos(np.radians(lats))))

        return scipy.integrate.quad(total, west, east, points=[TRIANGLE[2][0]], epsrel=1e-12)[0]

    x, gauss = np.polynomial.legendre.leggauss(40)
    truth = math.sqrt(strip(sinusoidal_square) / strip(lambda lon, lat: 1.0))
    assert raw(f"+proj=sinu +R={R}", polygon(TRIANGLE)) == pytest.approx(truth, rel=1e-9)


@pytest.mark.slow
def test_a_star_on_a_grid():
    """The sinusoidal map over a concave polygon with a hole, by the middles of a million cells."""
    region = polygon(STAR, HOLE)
    shape = shapely.Polygon(STAR, [HOLE])
    west, south, east, north = shape.bounds
    middles = (np.arange(1500) + 0.5) / 1500
    lon, lat = np.meshgrid(west + (east - west) * middles, south + (north - south) * middles)
    weight = np.where(shapely.contains_xy(shape, lon, lat), np.cos(np.radians(lat)), 0.0)
    truth = math.sqrt(np.sum(weight * sinusoidal_square(lon, lat)) / weight.sum())
    assert raw(f"+proj=sinu +R={R}", region) == pytest.approx(truth, rel=1e-4)


MAPS = ["robin", "moll", "merc", "wintri", "laea", "EPSG:3857", "igh", "+proj=moll +lon_0=11"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["country:CA", "country:FJ", "country:AQ"])
@pytest.mark.parametrize("projection", MAPS)
def test_refinement(projection, name):
    """Coarse results agree with fine ones to what they say of themselves, and to the tolerance."""
    region = get_region(name)
    fine = summarize(projection, region, tolerance=1e-10)
    for tolerance in (1e-4, 1e-6, 1e-8):
        coarse = summarize(projection, region, tolerance=tolerance)
        for error in ("airy_kavrayskiy", "airy_kavrayskiy_scaled", "airy_kavrayskiy_affine"):
            off = abs(getattr(coarse, error) - getattr(fine, error))
            assert off <= coarse.error_estimate + fine.error_estimate
            assert off <= tolerance or coarse.limit


@pytest.mark.slow
@pytest.mark.parametrize("resolution", ["50m", "110m"])
@pytest.mark.parametrize("projection", ["robin", "moll", "merc", "wintri", "laea", "igh"])
def test_land_and_ocean_make_up_the_globe(projection, resolution):
    """The squares of the errors over land and ocean, by area, are that of the globe, whose panels are whole."""
    parts = [get_region(f"{name}@{resolution}") for name in ("land", "ocean")]
    projection = Projection.from_user_input(projection)
    areas = [field_resolving(projection, part, tolerance=1e-2).weight.sum() for part in parts]
    squares = [raw(projection, part, 1e-7) ** 2 for part in parts]
    whole = raw(projection, "globe", 1e-7)
    assert math.sqrt(np.dot(areas, squares) / sum(areas)) == pytest.approx(whole, abs=1e-6)


OBLIQUE = "+proj=ob_tran +o_proj=moll +o_lon_p=40 +o_lat_p=50 +lon_0=60"


@pytest.mark.slow
@pytest.mark.parametrize("projection", [OBLIQUE, "+proj=moll +lon_0=-170.3", "igh", "+proj=ortho +lat_0=50"])
def test_seams_and_edges_across_polygons(projection):
    """Where a curved seam or the edge of a map crosses a slanting polygon, its two sides of a diagonal make the box."""
    corners = [(-60, -20), (60, -20), (60, 60), (-60, 60)]
    parts = [polygon(corners[:3]), polygon([corners[0], *corners[2:]])]
    projection = Projection.from_user_input(projection)
    samples = [field_resolving(projection, part, tolerance=1e-5) for part in parts]
    areas = [part.weight.sum() for part in samples]
    squares = [raw(projection, part, 1e-5) ** 2 for part in parts]
    whole = summarize(projection, Box(-60, -20, 60, 60), tolerance=1e-5)
    loose = 1e-3 if "ortho" in projection.definition else 1e-6
    assert math.sqrt(np.dot(areas, squares) / sum(areas)) == pytest.approx(whole.airy_kavrayskiy, abs=loose)


@pytest.mark.slow
def test_statistics_of_a_polygon():
    """The scale of plate carree along parallels over a box in two halves has the box's quantiles."""
    region = polygon([(0, 10), (40, 10), (40, 60), (0, 60)])
    found = summarize(f"+proj=eqc +R={R}", region, measures=["k"]).measures["k"]
    south, north = math.sin(math.radians(10)), math.sin(math.radians(60))
    for share, value in ((0.5, found.median), (0.95, found.p95)):
        assert value == pytest.approx(1 / math.cos(math.asin(south + share * (north - south))), rel=2e-4)
    assert found.max == pytest.approx(2.0, rel=1e-9)
    assert found.mean == pytest.approx(math.radians(50) / (north - south), rel=1e-9)


def test_no_part_of_the_map():
    """A polygon that a map does not show is refused, one of which it shows a part has a coverage."""
    region = polygon([(160, -10), (200, -10), (200, 10), (160, 10)])
    with pytest.raises(ValueError, match=r"^Invalid region 'polygons' for .*\. No point of it can be projected\."):
        summarize(f"+proj=ortho +R={R}", region)
    half = polygon([(60, -10), (120, -10), (120, 10), (60, 10)])
    assert summarize(f"+proj=ortho +R={R}", half, tolerance=1e-3).coverage == pytest.approx(0.5, abs=1e-6)


def test_maps_that_end_beside_a_polygon():
    """A map that ends in the panel, but not in the polygon, is measured as well as any other."""
    region = polygon([(0, 0), (85, 0), (0, 85)])
    assert summarize(f"+proj=ortho +R={R}", region, tolerance=1e-6).coverage == pytest.approx(1.0, abs=1e-12)


# ---- weights --------------------------------------------------------------------------------
@pytest.mark.parametrize("power", [(0, 0), (3, 1), (9, 0), (0, 9), (9, 9)])
def test_weights_are_exact_for_polynomials(power):
    """The weights of a polygon's panel integrate x^i y^j, by Green's theorem along its edges in closed form."""
    i, j = power
    region = polygon([(-1, -1), (0.9, -0.2), (0.3, 0.8), (-0.5, 0.1)])
    _, rectangles, rules, *_ = region.clip(np.array([0]), np.array([[-1.0, 1.0, -1.0, 1.0]]))
    (west, east, south, north), rule = rectangles[0], rules[0]
    x = 0.5 * (west + east) + 0.5 * (east - west) * NODES[:, None]
    y = 0.5 * (south + north) + 0.5 * (north - south) * NODES[None]
    found = np.sum(rule * x**i * y**j) * (east - west) * (north - south) / 4
    truth = 0.0
    t, gauss = np.polynomial.legendre.leggauss(30)
    for x0, y0, x1, y1 in region.edges:
        along = 0.5 * (1 + t)
        px, py = x0 + along * (x1 - x0), y0 + along * (y1 - y0)
        truth += 0.5 * (y1 - y0) * np.sum(gauss * px ** (i + 1) / (i + 1) * py**j)
    assert found == pytest.approx(truth, abs=1e-14)


def test_a_panel_within_is_whole():
    """Rectangles inside have Gauss weights and are whole, those outside are dropped, also where sides touch."""
    region = polygon([(0, 0), (10, 0), (10, 10), (0, 10)])
    rectangles = np.array([[2, 3, 4, 5], [0, 10, 0, 10], [10, 20, 0, 10], [-5, 0, 0, 10], [0, 10, 10, 20]], dtype=float)
    clips = region.clip(np.zeros(5, dtype=int), rectangles)
    assert clips.kept.tolist() == [0, 1]
    assert clips.whole.all()


def test_panels_are_tight():
    """The rectangle of a polygon is as wide; it ends at halves of the panel, or where halves would be far too high."""
    for south, north, (low, high) in ((41, 42, (40, 42.5)), (49.9, 50.1, (49.9, 50.1))):
        region = polygon([(3, south), (4, south), (4, north), (3, north)])
        clips = region.clip(np.array([0]), np.array([[0.0, 180.0, 40.0, 80.0]]))
        assert clips.rectangles[0] == pytest.approx([3, 4, low, high], abs=1e-12)


def test_clipped_chains_wind_as_before():
    """The area of a polygon's parts in the cells of a grid adds up, cell by cell as shapely has it."""
    region = polygon(STAR, HOLE)
    whole = polygons.Clip(region.edges, np.empty((0, 2)))
    for west in range(0, 40, 8):
        for south in range(20, 60, 8):
            part = polygons.clip(whole, west, west + 8.0, south, south + 8.0)
            cell = shapely.box(west, south, west + 8, south + 8)
            truth = shapely.intersection(region.geometry, cell).area
            rule = region.clip(np.array([0]), np.array([[west, west + 8.0, south, south + 8.0]]))
            sides = zip(rule[1], rule[2], strict=True)
            found = sum(float(w.sum()) * (r[1] - r[0]) * (r[3] - r[2]) / 4 for r, w in sides)
            assert found == pytest.approx(truth, abs=1e-12)
            assert (not len(part.edges) and not len(part.gates)) == (truth == 0)


# ---- areas ----------------------------------------------------------------------------------
def geodesic_area(geometry):
    """Area in km^2 of polygons whose edges are divided so finely that geodesics stand for them."""
    total = 0.0
    for part in geometry.geoms:
        dense = shapely.segmentize(part, 0.02)
        for ring, sign in [(dense.exterior, 1.0), *((hole, -1.0) for hole in dense.interiors)]:
            total += sign * abs(GEOD.polygon_area_perimeter(*shapely.get_coordinates(ring).T)[0])
    return total / 1e6


def test_an_edge_from_one_end_of_the_earth_to_the_other():
    """The area beside an edge of 160 degrees of latitude, straight in degrees, by adaptive quadrature."""
    region = get_region({"type": "Polygon", "coordinates": [[[0, -80], [30, 80], [0, 80], [0, -80]]]})

    def strip(lat):
        width = math.radians(30.0 * (lat + 80.0) / 160.0)
        return math.prod(WGS84.radii(lat)) * math.cos(math.radians(lat)) * width * math.radians(1.0)

    truth = scipy.integrate.quad(strip, -80.0, 80.0, epsabs=0.0, epsrel=1e-13)[0]
    assert region.area_km2 == pytest.approx(truth / 1e6, rel=1e-12)


@functools.cache
def country_area(code):
    return geodesic_area(geodata.country(next(r["iso_n3"] for r in data_rows("countries.csv") if r["iso_a2"] == code)))


COUNTRIES = "AQ AR AU BR CA CH CL CN DE FJ FR GL ID IN JP NO NZ RU US ZA".split()
MANY_VERTICES = {"AU", "BR", "CA", "CL", "CN", "GL", "ID", "NO", "RU"}


@pytest.mark.parametrize(
    "code", [pytest.param(code, marks=pytest.mark.slow) if code in MANY_VERTICES else code for code in COUNTRIES]
)
def test_areas_of_countries(code):
    """The weights of a country add up to its area by geodesics, on WGS 84."""
    region = get_region(f"country:{code}")
    assert region.area_km2 == pytest.approx(country_area(code), rel=1e-6)
    weights = field_resolving(Projection.from_user_input("EPSG:8857"), region, tolerance=1e-3).weight
    assert weights.sum() / 1e6 == pytest.approx(region.area_km2, rel=1e-9)


# Thousands of km^2, CIA World Factbook (land and inland water); the data is generalised.
PUBLISHED = {"CA": 9985, "RU": 17098, "AU": 7741, "CH": 41.3, "FR": 644, "FJ": 18.3, "NZ": 269, "BR": 8516, "DE": 357}


@each("code", PUBLISHED)
def test_published_areas(code):
    """Countries are as large as is published, to three percent; so are their parts in all."""
    assert get_region(f"country:{code}").area_km2 / 1000 == pytest.approx(PUBLISHED[code], rel=0.03)


@pytest.mark.slow
def test_continents_make_up_the_land():
    """The continents' areas add up to the land's."""
    names = ["Africa", "Antarctica", "Asia", "Europe", "North America", "Oceania", "South America"]
    total = sum(get_region(f"continent:{name}").area_km2 for name in names)
    assert total == pytest.approx(get_region("land").area_km2, rel=1e-5)


@pytest.mark.slow
def test_memory_of_many_vertices() -> None:
    """Area and weights of 200,000 edges take less than 100 MB beside the edges, ten times which took 1 GB."""
    t = np.linspace(0.0, 2.0 * math.pi, 200_001)
    circle = [(10 + 9 * math.cos(one), 20 + 9 * math.sin(one)) for one in t[:-1]]
    region = polygon(circle)
    region.edges  # noqa: B018 made before
    tracemalloc.start()
    area = region.area_km2
    region.clip(np.array([0]), np.array([[1.0, 19.0, 11.0, 29.0]]))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 100e6
    assert area == pytest.approx(polygon(circle[::20]).area_km2, rel=1e-6)


# ---- what must not matter -------------------------------------------------------------------
FIJI = [(177.0, -19.0), (-179.0, -19.0), (-178.0, -16.0), (178.0, -15.5)]
POLE = [(-180.0 + 10 * k, -70.0 + 5 * math.sin(k)) for k in range(36)]
SHAPES = {"plain": TRIANGLE, "antimeridian": FIJI, "pole": POLE}


def moved(ring, kind):
    """The same ring, written differently."""
    ring = list(ring)
    if kind == "0..360":
        return [(lon % 360, lat) for lon, lat in ring]
    if kind == "backwards":
        return ring[::-1]
    if kind == "another start":
        return ring[2:] + ring[:2]
    if kind == "a turn on":
        return [(lon - 360 if lon > 0 else lon, lat) for lon, lat in ring]
    if kind == "subdivided":
        points = []
        for (x0, y0), (x1, y1) in pairwise([*ring, ring[0]]):
            x1 = x0 + (x1 - x0 + 180) % 360 - 180
            points += [(x0 + (x1 - x0) * k / 7, y0 + (y1 - y0) * k / 7) for k in range(7)]
        return points
    return ring


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["0..360", "backwards", "another start", "a turn on", "subdivided"])
@pytest.mark.parametrize("shape", SHAPES)
def test_ways_to_write_a_polygon(shape, kind):
    """Area, error and bounds are the same however the ring is written."""
    one, other = polygon(SHAPES[shape]), polygon(moved(SHAPES[shape], kind))
    assert other.area_km2 == pytest.approx(one.area_km2, rel=1e-12)
    assert raw("robin", other) == pytest.approx(raw("robin", one), rel=1e-9)
    assert other.bounds == pytest.approx(one.bounds, abs=1e-9)


def test_equal_polygons_have_one_hash():
    """What is kept for a region is found again for the same one, and for no other; a copy brings no hash along."""
    one, other = polygon(STAR, HOLE), polygon(STAR, HOLE)
    assert one is not other
    assert one == other
    assert hash(one) == hash(other) == hash(pickle.loads(pickle.dumps(one)))
    assert hash(polygon(STAR)) != hash(one)
    assert "_hash" not in vars(pickle.loads(pickle.dumps(one)))


def test_across_the_antimeridian():
    """A polygon across the antimeridian, cut there as RFC 7946 asks or not, keeps together."""
    parts = [[square(170, 0, 180, 10)], [square(-180, 0, -175, 10)]]
    cut = get_region({"type": "MultiPolygon", "coordinates": parts})
    across = polygon([(170, 0), (-175, 0), (-175, 10), (170, 10)])
    for region in (cut, across):
        assert region.bounds == pytest.approx((170, 0, 185, 10))
        assert region.area_km2 == pytest.approx(Box(170, 0, -175, 10).area_km2, rel=1e-12)
        assert region.contains([175, 180, -180, -178, 185], [5, 5, 5, 5, 5]).all()
        assert not region.contains([169, -174, 0], [5, 5, 5]).any()
        assert raw("robin", region) == pytest.approx(raw("robin", Box(170, 0, -175, 10)), abs=1e-9)


def test_round_a_pole():
    """A ring round a pole holds it; a band of whole turns is a band."""
    south = polygon([(lon, -60.0) for lon in range(-180, 180, 20)])
    assert south.area_km2 == pytest.approx(Box(-180, -90, 180, -60).area_km2, rel=1e-12)
    assert bool(south.contains(17, -90))
    band = polygon([(-180, 10), (180, 10), (180, 20), (-180, 20)])
    assert band.area_km2 == pytest.approx(Box(-180, 10, 180, 20).area_km2, rel=1e-12)
    whole = polygon([(-180, -90), (180, -90), (180, 90), (-180, 90)])
    assert whole.area_km2 == pytest.approx(WGS84.area / 1e6, rel=1e-12)


def test_holes_and_islands():
    """A hole takes away, an island in it adds, what overlaps counts once."""
    ring = {size: square(-size, -size, size, size) for size in (1, 2, 5)}
    lake = get_region({"type": "MultiPolygon", "coordinates": [[ring[5], ring[2]], [ring[1]]]})
    area = {size: Box(-size, -size, size, size).area_km2 for size in ring}
    assert lake.area_km2 == pytest.approx(area[5] - area[2] + area[1], rel=1e-12)
    twice = get_region({"type": "MultiPolygon", "coordinates": [[ring[5]], [ring[2]]]})
    assert twice.area_km2 == pytest.approx(area[5], rel=1e-12)


@pytest.mark.parametrize("code", ["FJ", "RU", "US", "AQ", "CH"])
def test_countries_contain_what_their_weights_say(code):
    """As many random points are in a country as its share of the bounding box; its bounds hold it."""
    region = get_region(f"country:{code}@110m")
    west, south, east, north = region.bounds
    rng = np.random.default_rng(3)
    lon = rng.uniform(west, east, 40_000)
    lat = np.degrees(np.arcsin(rng.uniform(math.sin(math.radians(south)), math.sin(math.radians(north)), lon.size)))
    share = region.area_km2 / Box(west, south, east, north).area_km2 if east - west < 360 else None
    inside = region.contains(lon, lat)
    assert inside.any()
    if share is not None:
        assert inside.mean() == pytest.approx(share, abs=0.01)
    np.testing.assert_array_equal(region.contains(lon - 360, lat), inside)


def test_polygons_of_boxes_and_caps():
    """Boxes and caps as polygons have their areas, whichever poles they hold."""
    boxes = ("box:-10,35,40,70", "box:150,-60,-120,10", "globe")
    caps = ("20,50,3000", "-175,-30,4000", "30,90,2000", "-60,75,4000", "10,20,16000", "0,0,20015.08", "10,-88,300")
    caps += ("10,20,19990", "0,0,20000", "179,-60,19970", "0,0,10007.557176")  # of the last a sphere's is half of it
    for text in (*boxes, *(f"cap:{cap}" for cap in caps)):
        for figure in (WGS84, SPHERE):
            region = get_region(text, figure)
            own = Polygons(polygons_of(region), "", ellipsoid=region.figure)
            assert own.area_km2 == pytest.approx(region.area_km2, rel=1e-7)


# ---- cells ----------------------------------------------------------------------------------------
# The edges of GEOS's clips in pieces of so many degrees. Halved, the areas come nearer by a factor of four: to 1.5e-7.
_PIECE = 0.003


@GEOS_ARITHMETIC
def clipped(region, cells, i):
    """The polygons' part of a cell by GEOS, in longitude and sine of latitude, where areas are those of the sphere."""
    west, east, *ends = cells.rectangle[i]
    south, north = np.sort(patch_chart(cells.patch[i], np.zeros(2), np.array(ends)).lat)
    box = shapely.box(west, south, east, north)
    turned = shapely.transform(region.geometry, lambda p: p + np.array([360.0, 0.0]))
    parts = [shapely.intersection(geometry, box) for geometry in (region.geometry, turned)]
    dense = shapely.segmentize(shapely.union_all(parts), _PIECE)
    return shapely.transform(dense, lambda p: np.column_stack([np.radians(p[:, 0]), np.sin(np.radians(p[:, 1]))]))


@pytest.mark.parametrize("name", ["country:CH", "country:FJ", "country:AQ@110m", "country:NZ"])
def test_cells_are_what_geos_clips(name: str) -> None:
    """Areas to 2e-7, middles in longitude to 2e-7 of a cell's width."""
    region = get_region(name)
    cells = cells_of(region, SPHERE, 200)
    for i in range(0, cells.area.size, 7):
        truth, width = clipped(region, cells, i), np.ptp(cells.rectangle[i, :2])
        assert cells.area[i] == pytest.approx(SPHERE.a**2 * truth.area, rel=2e-7)
        assert cells.u[i] == pytest.approx(np.degrees(truth.centroid.x), abs=2e-7 * width)
        if cells.patch[i] == 0:
            low, high = np.degrees(np.arcsin(np.array(truth.bounds)[[1, 3]]))
            # The mean of the latitude is the latitude of the mean sine but for its variance, times its tangent / 2.
            away = np.radians(high - low) * (high - low)
            assert cells.v[i] == pytest.approx(np.degrees(np.arcsin(truth.centroid.y)), abs=away)


@each("count", [50, 2000])
@each("name", ["country:CA", "country:FJ", "country:AQ", "country:CL", "land@110m", "ocean@110m"])
def test_areas_of_cells_add_up(name: str, count: int) -> None:
    """To the region's area, nothing lost at poles and the antimeridian; and there are about as many as asked for."""
    region = get_region(name)
    cells = cells_of(region, WGS84, count)
    assert cells.area.sum() / 1e6 == pytest.approx(region.area_km2, rel=1e-9)
    assert count / 2 < cells.area.size < 4 * count + 40 * np.sqrt(count)
    assert cells.area.min() > 0.0
    u0, u1, v0, v1 = cells.rectangle.T
    assert ((u0 <= cells.u) & (cells.u <= u1) & (v0 <= cells.v) & (cells.v <= v1)).all()


@pytest.mark.parametrize("name", ["country:MC", "country:KY"])
def test_areas_of_small_countries(name: str) -> None:
    """Many cells of a few corners, some of which touch a cell in one point only."""
    region = get_region(name)
    assert cells_of(region, WGS84, 5000).area.sum() / 1e6 == pytest.approx(region.area_km2, rel=1e-7)


def test_what_is_of_no_height_is_tightened() -> None:
    """To its latitude, as on a side between cells; also where no number is between its ends."""
    assert tightened(43.0, 44.0, 43.0, 43.0) == (43.0, 43.0)
    assert tightened(43.0, 44.0, 43.7, 43.7) == (43.7, 43.7)
    above = float(np.nextafter(43.0, 44.0))
    assert tightened(43.0, 44.0, 43.0, above) == (43.0, above)


def test_a_box_of_edges() -> None:
    """Two islands and a lake whose edges lie along the sides of panels and cells: areas in closed form."""
    parts = [[square(0, 0, 16, 80), square(4, 20, 8, 40)[::-1]], [square(40, 81, 44, 90)]]
    region = get_region({"type": "MultiPolygon", "coordinates": parts})
    cells = cells_of(region, SPHERE, 300)
    s0, s20, s40, s80, s81, s90 = np.sin(np.radians([0.0, 20.0, 40.0, 80.0, 81.0, 90.0]))
    polar = cells.patch == 1
    per_degree = np.radians(1.0) * SPHERE.a**2
    assert cells.area[polar].sum() == pytest.approx(per_degree * 4 * (s90 - s81), rel=1e-12)
    assert cells.area[~polar].sum() == pytest.approx(per_degree * (16 * (s80 - s0) - 4 * (s40 - s20)), rel=1e-12)


def test_a_far_island_has_its_place() -> None:
    """An island of a kilometre beside a continent is one cell, where it is."""
    parts = [[square(0, 0, 40, 30)], [square(70.0, -20.01, 70.01, -20.0)]]
    region = get_region({"type": "MultiPolygon", "coordinates": parts})
    cells = cells_of(region, SPHERE, 100)
    (far,) = np.flatnonzero(cells.u > 50.0)
    assert (cells.u[far], cells.v[far]) == pytest.approx((70.005, -20.005), abs=1e-6)
    area = SPHERE.a**2 * np.radians(0.01) * np.ptp(np.sin(np.radians([20.0, 20.01])))
    assert cells.area[far] == pytest.approx(area, rel=1e-9)
