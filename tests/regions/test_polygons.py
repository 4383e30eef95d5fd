"""Integrals over polygons against closed forms, grids and quadrature; areas against geodesics; cells; ways to write."""

import itertools
import math
import pickle
import tracemalloc

import numpy as np
import pytest
import scipy.integrate
import shapely
from refusals import refuses
from region_texts import geodesic_area, square
from tables import each

from projdist.answers.summaries import summarize
from projdist.earth import GEOS_ARITHMETIC, MEAN_EARTH_RADIUS, SPHERE, WGS84, data_rows, natural_earth as geodata
from projdist.field import field_resolving
from projdist.numerics.polynomials import NODES
from projdist.projections import Projection
from projdist.regions import Box, Polygons, cells_of, get_region, polygons, polygons_of
from projdist.regions.region import patch_chart, tightened

R = MEAN_EARTH_RADIUS


def polygon(*rings):
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


def raw_of_parts(projection, parts, tolerance, coarse):
    """That of several regions in one: squares of errors add up by area."""
    areas = [field_resolving(projection, part, tolerance=coarse).weight.sum() for part in parts]
    return math.sqrt(np.average([raw(projection, part, tolerance) ** 2 for part in parts], weights=areas))


# ---- integrals ------------------------------------------------------------------------------
def test_a_box_as_a_polygon():
    """Plate carree over a box: the mean of ln^2 cos(latitude), weighted by cos(latitude)."""
    south, north = np.radians([-20.0, 70.0])
    top, _ = scipy.integrate.quad(lambda p: math.log(math.cos(p)) ** 2 * math.cos(p), south, north, epsrel=1e-13)
    truth = math.sqrt(top / (math.sin(north) - math.sin(south)))
    region = polygon([(-30, -20), (50, -20), (50, 70), (-30, 70)])
    assert raw(f"+proj=eqc +R={R}", region) == pytest.approx(truth, rel=1e-9)


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
    """The sinusoidal map over a triangle, by quadrature of its closed form."""
    (west, east, middle), lats = np.transpose(TRIANGLE)
    x, gauss = np.polynomial.legendre.leggauss(40)

    def total(f):
        def strip(lon):
            low = np.interp(lon, [west, east], lats[:2])
            high = np.interp(lon, [west, middle, east], lats[[0, 2, 1]])
            lat = 0.5 * (low + high) + 0.5 * (high - low) * x
            return 0.5 * (high - low) * np.sum(gauss * f(lon, lat) * np.cos(np.radians(lat)))

        return scipy.integrate.quad(strip, west, east, points=[middle], epsrel=1e-12)[0]

    truth = math.sqrt(total(sinusoidal_square) / total(lambda lon, lat: 1.0))
    assert raw(f"+proj=sinu +R={R}", polygon(TRIANGLE)) == pytest.approx(truth, rel=1e-9)


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
    projection = Projection.from_user_input(projection)
    parts = [get_region(f"{name}@{resolution}") for name in ("land", "ocean")]
    whole = raw(projection, "globe", 1e-7)
    assert raw_of_parts(projection, parts, 1e-7, coarse=1e-2) == pytest.approx(whole, abs=1e-6)


OBLIQUE = "+proj=ob_tran +o_proj=moll +o_lon_p=40 +o_lat_p=50 +lon_0=60"


@pytest.mark.slow
@pytest.mark.parametrize("projection", [OBLIQUE, "+proj=moll +lon_0=-170.3", "igh", "+proj=ortho +lat_0=50"])
def test_seams_and_edges_across_polygons(projection):
    """Where a curved seam or the edge of a map crosses a slanting polygon, its two sides of a diagonal make the box."""
    corners = [(-60, -20), (60, -20), (60, 60), (-60, 60)]
    parts = [polygon(corners[:3]), polygon([corners[0], *corners[2:]])]
    loose = 1e-3 if "ortho" in projection else 1e-6
    projection = Projection.from_user_input(projection)
    whole = raw(projection, Box(-60, -20, 60, 60), 1e-5)
    assert raw_of_parts(projection, parts, 1e-5, coarse=1e-5) == pytest.approx(whole, abs=loose)


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


@pytest.mark.slow
def test_parts_of_the_map():
    """One that shows nothing of a polygon is refused, of half half is covered, and one that ends beside it has all."""
    ortho = f"+proj=ortho +R={R}"
    said = r"^Invalid region 'polygons' for .*\. No point of it can be projected\."
    refuses(said, summarize, ortho, polygon([(160, -10), (200, -10), (200, 10), (160, 10)]))
    half, whole = polygon([(60, -10), (120, -10), (120, 10), (60, 10)]), polygon([(0, 0), (85, 0), (0, 85)])
    assert summarize(ortho, half, tolerance=1e-3).coverage == pytest.approx(0.5, abs=1e-6)
    assert summarize(ortho, whole, tolerance=1e-6).coverage == pytest.approx(1.0, abs=1e-12)


# ---- weights --------------------------------------------------------------------------------
@each("power", [(0, 0), (3, 1), (9, 0), (0, 9), (9, 9)])
def test_weights_are_exact_for_polynomials(power):
    """The weights of a polygon's panel integrate x^i y^j, by Green's theorem along its edges in closed form."""
    i, j = power
    region = polygon(
        [(-1, -1), (0.9, -0.2), (0.1, 0), (0.3, 0.8), (-0.5, 0.1)], [(0, -0.2), (-0.3, -0.1), (-0.4, -0.3)]
    )
    _, ((west, east, south, north),), (rule,), *_ = region.clip(np.array([0]), np.array([[-1.0, 1.0, -1.0, 1.0]]))
    x = 0.5 * (west + east) + 0.5 * (east - west) * NODES[:, None]
    y = 0.5 * (south + north) + 0.5 * (north - south) * NODES
    found = np.sum(rule * x**i * y**j) * (east - west) * (north - south) / 4
    t, gauss = np.polynomial.legendre.leggauss(30)
    x0, y0, x1, y1 = region.edges.T[..., None]
    x, y = x0 + 0.5 * (1 + t) * (x1 - x0), y0 + 0.5 * (1 + t) * (y1 - y0)
    truth = np.sum(0.5 * (y1 - y0) * gauss * x ** (i + 1) / (i + 1) * y**j)
    assert found == pytest.approx(truth, abs=1e-14)


def test_panels_are_whole_or_tight():
    """Rectangles inside have Gauss weights and are whole, those outside are dropped, also where sides touch."""
    rectangles = np.array([[2, 3, 4, 5], [0, 10, 0, 10], [10, 20, 0, 10], [-5, 0, 0, 10], [0, 10, 10, 20]], dtype=float)
    clips = polygon([(0, 0), (10, 0), (10, 10), (0, 10)]).clip(np.zeros(5, dtype=int), rectangles)
    assert clips.kept.tolist() == [0, 1]
    assert clips.whole.all()
    # The rectangle of a polygon is as wide; it ends at halves of the panel, or where halves would be far too high.
    for south, north, (low, high) in ((41, 42, (40, 42.5)), (49.9, 50.1, (49.9, 50.1))):
        region = polygon([(3, south), (4, south), (4, north), (3, north)])
        clips = region.clip(np.array([0]), np.array([[0.0, 180.0, 40.0, 80.0]]))
        assert clips.rectangles[0] == pytest.approx([3, 4, low, high], abs=1e-12)


def test_clipped_chains_wind_as_before():
    """The area of a polygon's parts in the cells of a grid adds up, cell by cell as shapely has it."""
    region = polygon(STAR, HOLE)
    whole = polygons.Clip(region.edges, np.empty((0, 2)))
    for west, south in itertools.product(range(0, 40, 8), range(20, 60, 8)):
        truth = shapely.intersection(region.geometry, shapely.box(west, south, west + 8, south + 8)).area
        _, rectangles, rules, *_ = region.clip(np.array([0]), np.array([[west, west + 8.0, south, south + 8.0]]))
        sides = zip(rectangles, rules, strict=True)
        found = sum(float(w.sum()) * (r[1] - r[0]) * (r[3] - r[2]) / 4 for r, w in sides)
        assert found == pytest.approx(truth, abs=1e-12)
        part = polygons.clip(whole, west, west + 8.0, south, south + 8.0)
        assert (not len(part.edges) and not len(part.gates)) == (truth == 0)


# ---- areas ----------------------------------------------------------------------------------


def test_an_edge_from_one_end_of_the_earth_to_the_other():
    """The area beside an edge of 160 degrees of latitude, straight in degrees, by adaptive quadrature."""

    def strip(lat):
        width = math.radians(30.0 * (lat + 80.0) / 160.0)
        return math.prod(WGS84.radii(lat)) * math.cos(math.radians(lat)) * width * math.radians(1.0)

    truth = scipy.integrate.quad(strip, -80.0, 80.0, epsabs=0.0, epsrel=1e-13)[0]
    assert polygon([(0, -80), (30, 80), (0, 80)]).area_km2 == pytest.approx(truth / 1e6, rel=1e-12)


COUNTRIES = "AQ AR AU BR CA CH CL CN DE FJ FR GL ID IN JP NO NZ RU US ZA".split()
# Thousands of km^2, CIA World Factbook (land and inland water); the data is generalised.
PUBLISHED = {"CA": 9985, "RU": 17098, "AU": 7741, "CH": 41.3, "FR": 644, "FJ": 18.3, "NZ": 269, "BR": 8516, "DE": 357}


@pytest.mark.slow
@pytest.mark.parametrize("code", COUNTRIES)
def test_areas_of_countries(code):
    """The weights of a country add up to its area by geodesics between many points of its edges, on WGS 84."""
    region = get_region(f"country:{code}")
    outline = geodata.country(next(row["iso_n3"] for row in data_rows("countries.csv") if row["iso_a2"] == code))
    polygons = [shapely.segmentize(part, 0.02) for part in outline.geoms]
    truth = sum(geodesic_area(*(ring.coords for ring in (one.exterior, *one.interiors))) for one in polygons)
    assert region.area_km2 == pytest.approx(truth, rel=1e-6)
    assert region.area_km2 / 1000 == pytest.approx(PUBLISHED.get(code, truth / 1000), rel=0.03)
    weights = field_resolving(Projection.from_user_input("EPSG:8857"), region, tolerance=1e-3).weight
    assert weights.sum() / 1e6 == pytest.approx(region.area_km2, rel=1e-9)


@pytest.mark.slow
def test_continents_make_up_the_land():
    names = ["Africa", "Antarctica", "Asia", "Europe", "North America", "Oceania", "South America"]
    total = sum(get_region(f"continent:{name}").area_km2 for name in names)
    assert total == pytest.approx(get_region("land").area_km2, rel=1e-5)


@pytest.mark.slow
def test_memory_of_many_vertices() -> None:
    """Area and weights of 200,000 edges take less than 100 MB beside the edges, ten times which took 1 GB."""
    t = np.linspace(0.0, 2.0 * math.pi, 200_001)[:-1]
    circle = np.column_stack([10 + 9 * np.cos(t), 20 + 9 * np.sin(t)]).tolist()
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


def subdivided(ring):
    """Each edge in seven, the shorter way round."""
    steps = (np.roll(ring, -1, axis=0) - ring + 180) % 360 - 180
    return (np.array(ring)[:, None] + steps[:, None] * np.arange(7)[:, None] / 7).reshape(-1, 2).tolist()


WAYS = {
    "0..360": lambda ring: [(lon % 360, lat) for lon, lat in ring],
    "backwards": lambda ring: ring[::-1],
    "another start": lambda ring: ring[2:] + ring[:2],
    "a turn on": lambda ring: [(lon - 360 if lon > 0 else lon, lat) for lon, lat in ring],
    "subdivided": subdivided,
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", WAYS)
@pytest.mark.parametrize("shape", SHAPES)
def test_ways_to_write_a_polygon(shape, kind):
    """Area, error and bounds are the same however the ring is written."""
    one, other = polygon(SHAPES[shape]), polygon(WAYS[kind](SHAPES[shape]))
    assert other.area_km2 == pytest.approx(one.area_km2, rel=1e-12)
    assert raw("robin", other) == pytest.approx(raw("robin", one), rel=1e-9)
    assert other.bounds == pytest.approx(one.bounds, abs=1e-9)


def test_equal_polygons_have_one_hash():
    """What is kept for a region is found again for the same one, and for no other."""
    one, other = polygon(STAR, HOLE), polygon(STAR, HOLE)
    assert one is not other
    assert one == other != polygon(STAR)
    assert hash(one) == hash(other) == hash(pickle.loads(pickle.dumps(one)))


def test_across_the_antimeridian():
    """A polygon across the antimeridian, cut there as RFC 7946 asks or not, keeps together."""
    parts, box = [[square(170, 0, 180, 10)], [square(-180, 0, -175, 10)]], Box(170, 0, -175, 10)
    cut = get_region({"type": "MultiPolygon", "coordinates": parts})
    for region in (cut, polygon([(170, 0), (-175, 0), (-175, 10), (170, 10)])):
        assert region.bounds == pytest.approx((170, 0, 185, 10))
        assert region.area_km2 == pytest.approx(box.area_km2, rel=1e-12)
        assert region.contains([175, 180, -180, -178, 185, 169, -174, 0], [5] * 8).tolist() == [True] * 5 + [False] * 3
        assert raw("robin", region) == pytest.approx(raw("robin", box), abs=1e-9)


def test_round_a_pole():
    """A ring round a pole holds it; a band of whole turns is a band."""
    south = polygon([(lon, -60.0) for lon in range(-180, 180, 20)])
    assert bool(south.contains(17, -90))
    band, whole = (polygon([(-180, low), (180, low), (180, high), (-180, high)]) for low, high in ((10, 20), (-90, 90)))
    boxes = Box(-180, -90, 180, -60), Box(-180, 10, 180, 20)
    areas = [*(box.area_km2 for box in boxes), WGS84.area / 1e6]
    assert [region.area_km2 for region in (south, band, whole)] == pytest.approx(areas, rel=1e-12)


def test_holes_and_islands():
    """A hole takes away, an island in it adds, what overlaps counts once."""
    ring = {size: square(-size, -size, size, size) for size in (1, 2, 5)}
    area = {size: Box(-size, -size, size, size).area_km2 for size in ring}
    lake, twice = [[ring[5], ring[2]], [ring[1]]], [[ring[5]], [ring[2]]]
    for parts, truth in ((lake, area[5] - area[2] + area[1]), (twice, area[5])):
        region = get_region({"type": "MultiPolygon", "coordinates": parts})
        assert region.area_km2 == pytest.approx(truth, rel=1e-12)


@each("code", ["FJ", "RU", "US", "AQ", "CH"])
def test_countries_contain_what_their_weights_say(code):
    """As many random points are in a country as its share of the bounding box; its bounds hold it."""
    region, rng = get_region(f"country:{code}@110m"), np.random.default_rng(3)
    west, south, east, north = region.bounds
    lon = rng.uniform(west, east, 40_000)
    lat = np.degrees(np.arcsin(rng.uniform(math.sin(math.radians(south)), math.sin(math.radians(north)), lon.size)))
    inside = region.contains(lon, lat)
    assert inside.any()
    if east - west < 360:
        assert inside.mean() == pytest.approx(region.area_km2 / Box(west, south, east, north).area_km2, abs=0.01)
    np.testing.assert_array_equal(region.contains(lon - 360, lat), inside)


CAPS = "20,50,3000 -175,-30,4000 30,90,2000 -60,75,4000 10,20,16000 0,0,20015.08 10,-88,300 10,20,19990".split()
CAPS += ["0,0,20000", "179,-60,19970", "0,0,10007.557176"]  # of the last a sphere's is half of it


@pytest.mark.slow
@each("figure", [WGS84, SPHERE])
@each("text", ["box:-10,35,40,70", "box:150,-60,-120,10", "globe", *(f"cap:{cap}" for cap in CAPS)])
def test_polygons_of_boxes_and_caps(text, figure):
    """Boxes and caps as polygons have their areas, whichever poles they hold."""
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


@each("name", ["country:CH", "country:FJ", "country:AQ@110m", "country:NZ"])
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


@pytest.mark.slow
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


@each("name", ["country:MC", "country:KY"])
def test_areas_of_small_countries(name: str) -> None:
    """Many cells of a few corners, some of which touch a cell in one point only."""
    region = get_region(name)
    assert cells_of(region, WGS84, 5000).area.sum() / 1e6 == pytest.approx(region.area_km2, rel=1e-7)


def test_what_is_of_no_height_is_tightened() -> None:
    """To its latitude, as on a side between cells; also where no number is between its ends."""
    for north, low, high in ((44.0, 43.0, 43.0), (44.0, 43.7, 43.7), (44.0, 43.0, float(np.nextafter(43.0, 44.0)))):
        assert tightened(43.0, north, low, high) == (low, high)


def test_a_box_of_edges() -> None:
    """Two islands and a lake whose edges lie along the sides of panels and cells: areas in closed form."""
    parts = [[square(0, 0, 16, 80), square(4, 20, 8, 40)[::-1]], [square(40, 81, 44, 90)]]
    cells = cells_of(get_region({"type": "MultiPolygon", "coordinates": parts}), SPHERE, 300)
    s0, s20, s40, s80, s81, s90 = np.sin(np.radians([0.0, 20.0, 40.0, 80.0, 81.0, 90.0]))
    truth = np.radians(SPHERE.a**2 * np.array([16 * (s80 - s0) - 4 * (s40 - s20), 4 * (s90 - s81)]))
    assert np.bincount(cells.patch, cells.area) == pytest.approx(truth, rel=1e-12)


def test_a_far_island_has_its_place() -> None:
    """An island of a kilometre beside a continent is one cell, where it is."""
    parts = [[square(0, 0, 40, 30)], [square(70.0, -20.01, 70.01, -20.0)]]
    cells = cells_of(get_region({"type": "MultiPolygon", "coordinates": parts}), SPHERE, 100)
    (far,) = np.flatnonzero(cells.u > 50.0)
    assert (cells.u[far], cells.v[far]) == pytest.approx((70.005, -20.005), abs=1e-6)
    area = SPHERE.a**2 * np.radians(0.01) * np.ptp(np.sin(np.radians([20.0, 20.01])))
    assert cells.area[far] == pytest.approx(area, rel=1e-9)
