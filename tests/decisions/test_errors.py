"""Errors of people's own data in a CRS, against closed forms, geodesics, and the map's own scales."""

import json
import sys

import numpy as np
import pyproj
import pytest
import shapely
from refusals import refuses
from shapely import GeometryCollection, LineString, MultiPoint, MultiPolygon, Point, Polygon, box
from tables import each

import projdist
from projdist.decisions.data_checks import OUTSIDE, TORN, CrsForData
from projdist.decisions.data_edges import MISSING, NO_DEGREES, NOT_FINITE, POINTS, REPAIRED

geopandas = pytest.importorskip("geopandas")

GERMANY, BOX = (5.9, 47.3, 15.0, 55.1), "box:5.9,47.3,15.0,55.1"
FIGURES = ("area_km2", "map_area_km2", "length_km", "map_length_km", "bearing_error")
EXACT = 1e-10  # relative: five nodes on an edge, halved where quartics do not follow, are good to 1e-11 and better
BEARING = 1e-5  # degrees: those at the nodes of an edge, from the same quartics
CHORDS = 1e-8  # of 200 m leave curves of the Earth's radius by 1 mm
AUTHALIC = 1e-9  # PROJ's authalic latitudes are a series of three terms


def frame(*shapes, crs="EPSG:4326", **columns):
    return geopandas.GeoDataFrame(columns, geometry=list(shapes), crs=crs)


def checked(*shapes, crs="EPSG:4326", to=None, **columns):
    return projdist.check(frame(*shapes, crs=crs, **columns), to, purpose=None)


def zone_area(crs, west, south, east, north):
    """km^2 between two parallels and two meridians: Snyder 1987, equation 3-12."""
    geod = pyproj.CRS(crs).get_geod()
    e, sin = np.sqrt(geod.es), np.sin(np.radians([south, north]))
    q = sin / (1 - (e * sin) ** 2) - np.log((1 - e * sin) / (1 + e * sin)) / (2 * e)
    return float(np.radians(east - west) * geod.b**2 * np.diff(q)[0] / 2) / 1e6


def parallel(crs, lat, width):
    """Kilometres along a parallel, in closed form."""
    geod = pyproj.CRS(crs).get_geod()
    sin, cos = np.sin(np.radians(lat)), np.cos(np.radians(lat))
    return geod.a * cos / np.sqrt(1 - geod.es * sin**2) * np.radians(width) / 1e3


def box_perimeter(crs, west, south, east, north):
    """Kilometres along two parallels and two meridians, which are geodesics."""
    meridian = pyproj.CRS(crs).get_geod().inv(0, south, 0, north)[2] / 1e3
    return sum(parallel(crs, lat, east - west) for lat in (south, north)) + 2 * meridian


@pytest.mark.slow
@each(("crs", "ratio", "digits"), [
    ("EPSG:3857", 2.5534, 5e-5), ("EPSG:25832", 1.00029, 5e-6), ("ESRI:54009", 0.9986, 5e-5),
])  # fmt: skip
def test_germany(crs, ratio, digits):
    """Its box of four corners has sides along parallels and meridians: the map's area is the mean areal scale."""
    found = checked(box(*GERMANY), shapely.segmentize(box(*GERMANY), 0.05), to=crs).features
    # Other vertices on its sides do not count; on Web Mercator's map bearings are right, to rounding.
    for name in FIGURES[:4] if crs == "EPSG:3857" else FIGURES:
        assert found[name][0] == pytest.approx(found[name][1], rel=EXACT)
    error = found["area_error"][0]
    assert 1 + error == pytest.approx(ratio, abs=digits)
    mean = projdist.summarize(crs, BOX, measures=["s"], tolerance=1e-10).measures["s"].mean
    assert 1 + error == pytest.approx(mean, rel=EXACT)
    assert found["area_km2"][0] == pytest.approx(zone_area(crs, *GERMANY), rel=EXACT)
    assert found["length_km"][0] == pytest.approx(box_perimeter(crs, *GERMANY), rel=EXACT)
    if crs == "EPSG:3857":  # along parallels its scale is a / (N cos lat), along meridians a / M sec lat
        west, south, east, north = np.radians(GERMANY)
        truth = 2 * 6378.137 * (east - west + np.diff(np.arctanh(np.sin([south, north])))[0])
        assert found["map_length_km"][0] == pytest.approx(truth, rel=EXACT)
        # Both are straight on its plane: stored there, the box is the same figure.
        stored = projdist.check(frame(box(*GERMANY)).to_crs(crs), purpose=None).overall
        assert stored.area_error == pytest.approx(error, rel=EXACT)


@each("bounds", [
    (-180, -90, 180, 90), (-180, -90, 180, -60), (-180, 60, 180, 90), (-180, 10, 180, 20), (0, -60, 90, 90),
])  # fmt: skip
def test_boxes_to_the_poles_and_round_the_earth(bounds):
    """Areas on the ground in closed form, on an equal-area map of the world the same."""
    found = checked(box(*bounds), to="EPSG:8857").overall
    assert found.area_km2 == pytest.approx(zone_area("EPSG:4326", *bounds), rel=EXACT)
    assert found.area_error == pytest.approx(0, abs=AUTHALIC)


def test_an_edge_along_a_pole_is_as_wide_as_it_is_said_to_be():
    """Others of 200 degrees go the shorter way; on the equal-area cylinder the pole is a line like others."""
    south = [(lon, 60) for lon in range(-100, 101, 50)]
    found = checked(Polygon([*south, (100, 90), (-100, 90)]), to="+proj=cea +ellps=WGS84").overall
    area, wide = zone_area("EPSG:4326", -100, 60, 100, 90), 6378.137 * np.radians(200.0)
    lengths = area, area, 2.0 * (wide + area / wide)
    assert (found.area_km2, found.map_area_km2, found.map_length_km) == pytest.approx(lengths, rel=EXACT)


def test_antimeridian():
    """Edges wider than 180 degrees go the shorter way; a map that is cut there does not draw it."""
    corners = [(177, -20), (-178, -20), (-178, -15), (177, -15)]
    cut = MultiPolygon([box(177, -20, 180, -15), box(-180, -20, -178, -15)])
    fiji = checked(Polygon(corners), cut, crs="EPSG:4720", to="EPSG:3460")  # on its own datum
    assert fiji.features["area_km2"] == pytest.approx(zone_area("EPSG:3460", 177, -20, 182, -15), rel=EXACT)
    assert fiji.features["map_area_km2"][0] == pytest.approx(fiji.features["map_area_km2"][1], rel=EXACT)
    world = checked(Polygon(corners), cut, LineString(corners[:2]), to="EPSG:3857")
    assert world.features["note"].tolist() == [TORN, "", TORN]
    assert (world.overall.measured, world.undrawn()) == (1, [0, 2])


@each("west", [-710, -370, -10, 350, 355, 540, 690])
def test_longitudes_from_anywhere(west):
    """Data of 0 to 360 degrees and of more turns are the same figures as those of less than one."""
    found, turned = (checked(box(lon, 40, lon + 20, 50), to="EPSG:3832").features for lon in (west, west % 360 - 360))
    assert found["area_km2"] == pytest.approx([zone_area("EPSG:4326", west, 40, west + 20, 50)], rel=EXACT)
    assert found["length_km"] == pytest.approx([box_perimeter("EPSG:4326", west, 40, west + 20, 50)], rel=EXACT)
    for name in ("map_area_km2", "map_length_km", "length_error"):
        assert found[name] == pytest.approx(turned[name], rel=EXACT)


@pytest.mark.slow
@pytest.mark.parametrize("crs", ["EPSG:3832"])
def test_most_of_the_earth_from_east_of_greenwich(crs):
    """Bounds from 170 to 370 are those of the part that they go round, also in what is recommended for it."""
    wide = frame(*(box(lon, 40, lon + 20, 50) for lon in range(170, 351, 20)))
    found = projdist.check(wide, crs, purpose="equal-area", limit=1)
    assert found.region.bounds == pytest.approx((170, 40, 370, 50))
    assert (found.overall.measured, found.overall.undrawn) == (9, 1)
    assert found.recommended is not None


def test_rings_and_lines_round_the_earth():
    """A coast round a pole holds the pole, whether its ring is led there or not; a parallel is a whole circle."""
    coast = [(lon, -80) for lon in range(-180, 181, 30)]
    shapes = Polygon(coast), Polygon([*coast, (180, -90), (-180, -90)]), LineString([(-180, 60), (180, 60)])
    found = checked(*shapes, to="EPSG:6932").features
    truth = zone_area("EPSG:4326", -180, -90, 180, -80)
    assert found["area_km2"][:2] == pytest.approx(truth, rel=EXACT)
    assert found["map_area_km2"][:2] == pytest.approx(truth, rel=AUTHALIC)
    assert found["length_km"][2] == pytest.approx(parallel("EPSG:4326", 60, 360), rel=EXACT)


@pytest.mark.slow
@each("crs", ["EPSG:25832", "EPSG:3035", "EPSG:3857", "EPSG:2056", "ESRI:54009"])
def test_straight_on_the_plane(crs):
    """Edges stored in a projected CRS are straight there: the truth is of many geodesics along them."""
    plane = box(*frame(box(*GERMANY)).to_crs(crs).total_bounds)
    found = checked(plane, crs=crs).overall
    geodetic = pyproj.CRS(crs).geodetic_crs
    dense = frame(shapely.segmentize(plane, plane.length / 2e4), crs=crs).to_crs(geodetic).geometry.iloc[0]
    area, length = geodetic.get_geod().geometry_area_perimeter(dense)
    assert (found.area_km2, found.length_km) == pytest.approx((abs(area) / 1e6, length / 1e3), rel=CHORDS)
    assert (found.map_area_km2, found.map_length_km) == pytest.approx(
        (plane.area / 1e6, plane.length / 1e3), rel=AUTHALIC
    )


def test_another_crs_than_the_datas():
    """A square of Lambert-93 in Mollweide's map, as pyproj draws it; grids in US feet have figures in metres."""
    square = box(6e5, 6.2e6, 9e5, 6.8e6)
    found = checked(square, crs="EPSG:2154", to="ESRI:54009").overall
    there = frame(shapely.segmentize(square, 50), crs="EPSG:2154").to_crs("ESRI:54009").geometry.iloc[0]
    assert (found.map_area_km2, found.map_length_km) == pytest.approx(
        (there.area / 1e6, there.length / 1e3), rel=CHORDS
    )
    own = checked(square, crs="EPSG:2154").overall.area_km2
    assert found.area_km2 == pytest.approx(own, rel=1e-7)  # two ellipsoids
    island = box(3e5, 5e4, 3.5e5, 9e4)  # Long Island's grid in metres and in US feet
    metres = checked(island, crs="EPSG:32118")
    feet = checked(shapely.transform(island, lambda xy: xy * 3937 / 1200), crs="EPSG:2263")
    for name in FIGURES:
        assert feet.features[name] == pytest.approx(metres.features[name], rel=1e-7)  # its origin is rounded to a foot


@each("crs", ["EPSG:6931", "EPSG:6932", "EPSG:3035"])
def test_round_a_pole_and_from_it(crs):
    """Equal-area maps are right about squares that hold a pole, have it for a corner, or on a side."""
    centre = np.array([4321e3, 3210e3]) if crs == "EPSG:3035" else np.zeros(2)
    squares = [box(*bounds) for bounds in ((-1, -1, 1, 1), (0, 0, 1, 1), (-1, 0, 1, 1), (-3, -1, 2, 4))]
    found = checked(*shapely.transform(squares, lambda xy: centre + 1e6 * xy), crs=crs).features
    assert found["area_km2"] == pytest.approx([4e6, 1e6, 2e6, 25e6], rel=AUTHALIC)
    assert found["note"].tolist() == [""] * 4


def test_data_on_the_edge_of_the_map():
    """Rounding puts vertices at 180 degrees beyond the edge of Mollweide's map: they are drawn all the same."""
    bounds = [(165, 10, 180, 40), (-180, -30, -165, 0)]
    shapes = [shapely.segmentize(box(*one), 0.05) for one in bounds]  # chords leave out 1e-6
    found = projdist.check(frame(*shapes).to_crs("ESRI:54009"), purpose=None)
    assert found.undrawn() == []
    assert found.features["area_km2"] == pytest.approx([zone_area("ESRI:54009", *one) for one in bounds], rel=1e-6)


@each("crs", ["EPSG:25832", "EPSG:3035", "EPSG:2056", "EPSG:3857", "ESRI:54009", "ESRI:54030"])
@each("side", [10.0, 1000.0])
def test_small_squares(crs, side):
    """A building has the scales of its place: the rounding of inverses, up to millimetres, does no harm."""
    x, y = pyproj.Transformer.from_crs(pyproj.CRS(crs).geodetic_crs, crs, always_xy=True).transform(8.5, 47.4)
    found = checked(box(x - side / 2, y - side / 2, x + side / 2, y + side / 2), crs=crs).overall
    here = projdist.factors(crs, 8.5, 47.4)
    # Second differences over a kilometre, 1e-4 of a radian; rounding of 1e-9 m over ten metres.
    assert 1 + found.area_error == pytest.approx(float(here.s), rel=1e-7)
    inverse = np.linalg.inv(here.jacobian)
    assert 1 / (1 + found.length_error) == pytest.approx(np.linalg.norm(inverse, axis=0).mean(), rel=1e-7)


@each("crs", ["EPSG:2053", "EPSG:5513", "EPSG:27572", "EPSG:2263", "EPSG:3031", "EPSG:2065", "EPSG:5653", "EPSG:7415"])
def test_unusual_crs(crs):
    """Axes to south or west, other meridians, feet, poles, heights: the areal scale and convergence of the place."""
    stated = pyproj.CRS(crs)
    area = stated.area_of_use
    here = projdist.factors(crs, 0.6 * area.west + 0.4 * area.east, 0.6 * area.south + 0.4 * area.north)
    plane = projdist.projections.projected_crs_of(here.projection)
    centre = np.linalg.solve(plane.to_metres, [float(here.x), float(here.y)])
    side = 1000.0 / stated.axis_info[0].unit_conversion_factor
    found = checked(shapely.transform(box(-0.5, -0.5, 0.5, 0.5), lambda xy: centre + side * xy), crs=crs).overall
    # A square of a kilometre; the convergence near a pole changes by 1e-3 degrees across it.
    assert 1 + found.area_error == pytest.approx(float(here.s), rel=2e-7)
    assert found.bearing_error == pytest.approx(abs(float(here.convergence)), abs=1e-2)


def test_a_rhumb_line():
    """Straight on Mercator's map; on the ground as long as its meridian arc times the secant of its bearing."""
    ends = np.array([[-20.0, 5.0], [60.0, 50.0]])
    plane = np.column_stack(pyproj.Transformer.from_crs("EPSG:4326", "EPSG:3395", always_xy=True).transform(*ends.T))
    found = checked(LineString(plane), crs="EPSG:3395").overall
    step, arc = plane[1] - plane[0], pyproj.Geod(ellps="WGS84").inv(0, 5, 0, 50)[2]
    lengths = arc * np.hypot(*step) / step[1] / 1e3, np.hypot(*step) / 1e3
    assert (found.length_km, found.map_length_km) == pytest.approx(lengths, rel=EXACT)
    assert found.bearing_error < BEARING
    assert np.isnan(found.area_error)


def test_bearings_along_a_parallel():
    """Lambert-93 turns by n (lon - 3), n = 0.725607765 (IGN): along 6 degrees of a parallel n 6 / sqrt 3 as RMS."""
    # Of the totals, worst is that of the worst feature, as RMS along it; largest is anywhere.
    lines = [LineString(ends) for ends in ([(3, 46), (9, 46)], [(9, 46), (3, 46)], [(3, 46), (5, 46)])]
    found, turned = checked(*lines, crs="EPSG:4171", to="EPSG:2154"), 0.7256077650 * np.array([6, 6, 2])
    assert found.features["bearing_error"] == pytest.approx(turned / np.sqrt(3), abs=BEARING)
    assert found.features["largest_bearing_error"] == pytest.approx(turned, abs=BEARING)
    worst = found.overall.worst_bearing_error, found.overall.largest_bearing_error
    assert worst == pytest.approx((turned[0] / np.sqrt(3), turned[0]), abs=BEARING)
    # UTM 10N at 120 W 34 N is off by the convergence, 1 deg 40' 43.13" by the NGS's NCAT; 0.01" are 3e-6 degrees.
    line = checked(LineString([(-120.001, 33.999), (-119.999, 34.001)]), to="EPSG:32610").overall
    assert line.bearing_error == pytest.approx(1 + 40 / 60 + 43.13 / 3600, abs=1e-5)


def test_parts():
    """Holes count less; the parts of a collection add up; points in it do not matter."""
    outer, inner, other = box(8, 48, 12, 52), box(9, 49, 10, 50), box(1, 44, 2, 45)
    holed, line = outer.difference(inner), LineString([(3, 45), (5, 47)])
    together = GeometryCollection([MultiPolygon([holed, other]), line, Point(0, 0)])
    found = checked(outer, inner, other, line, holed, together, to="EPSG:3857").features
    for name in FIGURES[:4]:
        one, hole, beside, road, ring, all_ = np.nan_to_num(found[name])
        assert ring == pytest.approx(one - hole if "area" in name else one + hole)
        assert all_ == pytest.approx(ring + beside + road)


def test_totals():
    """Sums, the worst, RMS of features, and bearings as RMS along all edges."""
    shapes = box(0, 0, 1, 1), box(0, 60, 2, 61), LineString([(5, 70), (6, 71)])
    found = checked(*shapes, to="EPSG:25832", name=list("abc"))
    one, total = found.features, found.overall
    assert (total.measured, one["name"].tolist()) == (3, ["a", "b", "c"])
    assert total.area_error == pytest.approx(np.nansum(one["map_area_km2"]) / np.nansum(one["area_km2"]) - 1)
    assert total.length_error == pytest.approx(one["map_length_km"].sum() / one["length_km"].sum() - 1)
    assert total.worst_length_error == one["length_error"][np.argmax(np.abs(one["length_error"]))]
    assert total.rms_area_error == pytest.approx(np.sqrt(np.nanmean(one["area_error"] ** 2)))
    square = np.average(one["bearing_error"] ** 2, weights=one["length_km"])
    assert total.bearing_error == pytest.approx(np.sqrt(square))
    assert found.worst(2) == list(np.argsort(-np.fmax(abs(one["area_error"]), abs(one["length_error"])))[:2])


def test_lines_have_no_area():
    """No 0 that a mean, a total or a file would take for one."""
    road, names = LineString([(8, 50), (9, 51)]), ("area_km2", "map_area_km2", "area_error")
    found = checked(road, box(8, 48, 9, 49), GeometryCollection([road]), to="EPSG:25832")
    for name in names:
        assert np.isnan(found.features[name]).tolist() == [True, False, True]
    assert found.overall.rms_area_error == abs(found.features["area_error"][1])
    total = checked(road, to="EPSG:25832").to_dict()["overall"]
    assert [total[name] for name in (*names, "worst_area_error", "rms_area_error")] == [None] * 5


def test_names():
    """The usual column, else the only one of texts that tells all features apart, which is said; missing is empty."""
    shapes = box(8, 48, 9, 49), box(9, 48, 10, 49)
    usual = checked(*shapes, to="EPSG:25832", use=["a", "b"], Name=["x", None])
    assert (usual.features["name"].tolist(), usual.notes) == (["x", ""], ())
    only = checked(*shapes, to="EPSG:25832", parcel=["17/1", "17/2"], size=[1, 2])
    assert only.features["name"].tolist() == ["17/1", "17/2"]
    assert only.notes == ("Names are those of 'parcel', the only column of texts.",)
    for columns in ({"use": ["forest", "forest"]}, {"one": ["a", "b"], "two": ["c", "d"]}, {"size": [1, 2]}):
        none = checked(*shapes, to="EPSG:25832", **columns)
        assert (none.features["name"].tolist(), none.notes) == (["", ""], ())


def test_what_cannot_be_measured():
    with np.errstate(invalid="ignore"):
        broken = LineString([(0, 0), (np.nan, 1)])
    bow = Polygon([(8, 48), (10, 50), (10, 48), (8, 50)])
    halves = Polygon([(8, 48), (9, 49), (8, 50)]), Polygon([(9, 49), (10, 48), (10, 50)])
    places = [None, Polygon(), Point(9, 48), MultiPoint([(9, 48), (8, 47)]), LineString([(9, 48), (9, 48)]), broken]
    far = [box(1000, 40, 1001, 41), box(9, 80, 10, 91), box(95, -5, 105, 5)]
    found = checked(*places, *far, bow, *halves, to="EPSG:25832")
    notes = [MISSING, MISSING, POINTS, POINTS, POINTS, NOT_FINITE, NO_DEGREES, NO_DEGREES, OUTSIDE, REPAIRED, "", ""]
    assert found.features["note"].tolist() == notes
    area = found.features["area_km2"]
    assert np.isnan(area[:9]).all()
    assert area[9] == pytest.approx(area[10] + area[11])
    assert (found.overall.measured, found.overall.undrawn) == (3, 1)


def test_metres_of_no_place():
    """Nothing is drawn, and nothing recommended; nor on other bodies, as the registry's areas are the Earth's."""
    found = projdist.check(frame(box(1e8, 1e8, 2e8, 2e8), crs="EPSG:25832"))
    assert (found.features["note"].tolist(), found.above(1e9)) == ([OUTSIDE], True)
    assert (found.worst(5), found.recommended) == ([], None)
    assert found.notes == ("No CRS is recommended: the data have no place on the Earth.",)
    json.loads(found.to_json())
    moon = projdist.check(frame(box(0, 0, 1, 1), crs="IAU_2015:30100"), "IAU_2015:30110")
    assert (moon.recommended, moon.notes[-1]) == (None, "No CRS is recommended: that is done for the Earth only.")


def test_limits():
    """An error above a limit, of a feature or of the totals; what cannot be drawn is above every limit."""
    found = checked(box(8, 48, 9, 49), box(15, 48, 20, 49), to="EPSG:25832")
    undrawn = checked(box(8, 48, 9, 49), box(95, -5, 105, 5), to="EPSG:25832")
    worst, overall = found.overall.worst_area_error, found.overall.area_error
    assert overall < worst
    above = found.above(0.99 * worst), found.above(0.99 * overall, on="overall"), found.above(1.0, bearing=1.0)
    assert (*above, undrawn.above(1e3), undrawn.above(bearing=180.0)) == (True,) * 5
    below = found.above(1.01 * worst), found.above(1.01 * overall, on="overall"), found.above(bearing=10.0)
    assert (*below, found.above(), undrawn.above()) == (False,) * 5
    refuses(r"^Invalid choice 'all' of what to fail on. It must be worst or overall\.$", found.above, 1.0, on="all")


def test_forms():
    """The dictionary is JSON with null where nothing was measured; the frame has a row a feature."""
    found = checked(box(*GERMANY), Point(0, 0), to="EPSG:25832", NAME=["box", "point"])
    data = json.loads(found.to_json())
    assert (data["crs"], data["data_crs"], data["recommended"]) == ("EPSG:25832", "WGS 84", None)
    assert [row["name"] for row in data["results"]] == ["box", "point"]
    assert (data["results"][1]["area_km2"], data["overall"]["area_error"]) == (None, found.overall.area_error)
    table = found.to_frame()
    assert (table["note"].tolist(), table["area_error"][0]) == (["", POINTS], found.overall.area_error)


def test_a_recommended_crs_is_measured(monkeypatch):
    """With the same data; it is sought in the narrowest box about them, across the antimeridian, by their vertices."""
    asked, answers = {}, [CrsForData("EPSG:3460", None, 0.25), None]

    def crs_for_data(crs, region, lon, lat, **words):
        asked.update(words, region=region, lon=lon, lat=lat, crs=crs)
        return answers.pop(0)

    monkeypatch.setattr(sys.modules["projdist.decisions.data_checks"], "crs_for_data", crs_for_data)
    line, area = LineString([(178, -20), (-178, -15)]), box(175, -17, 176, -16)
    found = projdist.check(frame(line, area), "EPSG:3832", purpose="conformal", area="contains")
    assert found.recommended.projection.definition == found.to_dict()["recommended"]["crs"] == "EPSG:3460"
    assert found.recommended.overall == checked(line, area, to="EPSG:3460").overall
    # On the ground, of WGS 72 and of WGS 84, two metres larger.
    assert found.recommended.overall.area_km2 == pytest.approx(found.overall.area_km2, rel=2e-6)
    assert found.notes[-1].startswith("EPSG:3460: Its grid north is off true north by 0.25 degrees")
    assert asked["region"].bounds == pytest.approx((175.0, -20.0, 182.0, -15.0))
    assert (asked["purpose"], asked["area"], asked["crs"].to_epsg()) == ("conformal", "contains", 4326)
    assert sorted(set(np.mod(asked["lon"], 360.0).tolist())) == [175.0, 176.0, 178.0]
    none, said = projdist.check(frame(line), "EPSG:3832", purpose="conformal"), "box:178,-20,-178,-15."
    assert (none.recommended, none.notes[-1]) == (None, f"No CRS is recommended: none serves 'conformal' in {said}")


DEGREE, METRES = frame(box(0, 0, 1, 1), a=[1]), frame(box(5e5, 5e6, 6e5, 5.1e6))


@each(("data", "options", "message"), [
    (DEGREE, {}, r"^Invalid CRS 'WGS 84' of the data to check. It has longitudes and latitudes"),
    (frame(box(0, 0, 1, 1), crs=None), {"crs": "moll"}, r"^Invalid data. They state no CRS"),
    (DEGREE, {"crs": "EPSG:4258"}, r"^Invalid projection 'EPSG:4258'. It is a Geographic 2D CRS"),
    (frame(Point(0, 0), None), {"crs": "moll"}, r"to measure, but no geometry, points only"),
    (frame(), {}, r"^Invalid data. They have no features.$"),
    (DEGREE, {"crs": "moll", "column": "b"}, r"^Invalid column 'b'. It must be a or geom"),
    (DEGREE, {"crs": "moll", "purpose": "best"}, r"^Invalid purpose 'best'"),
    ([box(0, 0, 1, 1)], {"crs": "moll"}, r"^Invalid data of type 'list'"),
    (DEGREE, {"crs": "IAU_2015:30120"}, r"^Invalid CRS 'WGS 84' of the data. PROJ has no way"),
    (METRES, {"crs": "EPSG:25832"}, r"^Invalid data\. .* but coordinates that are not longitudes and lat"),
    (frame(box(0, 0, 1, 1), crs="EPSG:4978"), {}, r"^Invalid projection 'WGS 84'. It is a Geocentric CRS"),
])  # fmt: skip
def test_refused(data, options, message):
    refuses(message, projdist.check, data, **options)
