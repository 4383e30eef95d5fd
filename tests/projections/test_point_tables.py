"""Columns added to people's own points: DataFrames, GeoDataFrames, and what is refused."""

import numpy as np
import pyproj
import pytest
from projection_points import make
from refusals import refuses
from shapely import MultiPoint, Point, Polygon
from tables import each

from projdist import Notice, ProjectionError, factors
from projdist.projections import data_crs_of, graticule_of, projected_crs_of

geopandas = pytest.importorskip("geopandas")
pd = pytest.importorskip("pandas")

ADDED = ["x", "y", "h", "k", "a", "b", "s", "omega", "theta", "convergence", "fisher", "quality"]
SWISS = pd.DataFrame({"name": ["Bern", "Chur"], "lon": [7.44, 9.53], "lat": [46.95, 46.85]}, index=["p", "q"])


def geo(crs: str | None, *points: object) -> geopandas.GeoDataFrame:
    return geopandas.GeoDataFrame({"number": range(len(points))}, geometry=list(points), crs=crs)


@pytest.mark.parametrize("prefix", ["", "lv_"])
def test_a_data_frame_gives_one(prefix: str) -> None:
    """Own columns and index first and unchanged, then those of `factors` at lon, lat; the one given is left alone."""
    before = SWISS.copy()
    found = factors("EPSG:2056", SWISS, measures=["airy"], prefix=prefix)
    pd.testing.assert_frame_equal(SWISS, before)
    pd.testing.assert_frame_equal(found[before.columns], before)
    assert list(found.columns) == [*before.columns, *(prefix + name for name in [*ADDED, "airy"])]
    truth = factors("EPSG:2056", SWISS.lon, SWISS.lat, measures=["airy"]).to_frame()
    for name in [*ADDED, "airy"]:
        assert (found[prefix + name].to_numpy() == truth[name].to_numpy()).all()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.* outside its area of use")
@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:2056", "EPSG:3857", "EPSG:2263", "EPSG:4807", "EPSG:31467"])
@pytest.mark.parametrize("projection", ["EPSG:2056", "EPSG:27572", "EPSG:3035"])
def test_a_geo_data_frame_gives_one(projection: str, crs: str) -> None:
    """Points of any CRS are taken to the datum of the map: x, y are pyproj's from the one CRS to the other."""
    points = geopandas.GeoDataFrame(SWISS, geometry=geopandas.points_from_xy(SWISS.lon, SWISS.lat), crs=4326)
    points = points.to_crs(crs).rename(columns={"lon": "wgs_lon", "lat": "wgs_lat"})
    found = factors(projection, points)
    assert (type(found), found.crs) == (geopandas.GeoDataFrame, points.crs)
    assert found.geometry.equals(points.geometry)
    there = pyproj.Transformer.from_crs(crs, projection, always_xy=True).transform(points.geometry.x, points.geometry.y)
    # 1 mm: datum shifts by way of WGS 84 are not exactly undone.
    np.testing.assert_allclose(found[["x", "y"]], np.column_stack(there), atol=1e-3)


def test_a_map_without_a_datum_takes_longitudes_and_latitudes_as_they_are() -> None:
    """An old French point, in grads from Paris, is in degrees from Greenwich; the Earth's have no place on the Moon."""
    with pytest.raises(ProjectionError, match=r"Invalid CRS 'WGS 84' of points. PROJ has no way from it to Moon"):
        data_crs_of(make("IAU_2015:30120"), "EPSG:4326").degrees(np.array([0.0]), np.array([0.0]))
    lon, lat = data_crs_of(make("robinson"), "EPSG:4902").degrees(np.array([10.0]), np.array([50.0]))
    np.testing.assert_allclose([lon[0], lat[0]], [2.33720833 + 9.0, 45.0], atol=1e-4)


@each(("unit", "metres"), [("m", 1.0), ("km", 1000.0), ("us-ft", 1200.0 / 3937.0)])
@each("beyond", [1e-5, 1e-3])
def test_points_on_the_edge_of_their_map(unit: str, metres: float, beyond: float) -> None:
    """Beyond Mollweide's edge, 2 sqrt(2) R, by rounding they are 6 mm inside of where they lie; by a metre nowhere."""
    crs = f"+proj=moll +R=6371000 +units={unit} +type=crs"
    source = data_crs_of(make("+proj=robin +R=6371000"), crs)
    edge = 2.0 * np.sqrt(2.0) * 6371000.0
    x = np.array([edge + beyond, edge + 1.0, -edge - beyond])
    lon, lat = source.degrees_on_map(x / metres, np.zeros(3))
    inside = (edge + beyond - 6.371e-3) / edge * np.array([180.0, np.nan, -180.0])
    # PROJ's own rounding is a nanometre; 1e-10 degrees are ten micrometres.
    np.testing.assert_allclose(lon, inside, rtol=0, atol=1e-10)
    np.testing.assert_allclose(lat[[0, 2]], 0.0, atol=1e-10)


SQUARE = Polygon([(0, 0), (1, 0), (1, 1)])


@each("frame", [
    *(geo("EPSG:3857", Point(8e5, 6e6), one) for one in (None, Point(), Point(np.nan, 1.0))),
    *(SWISS.assign(lon=["7.5", " "]), SWISS.assign(lat=[46.9, np.nan])),
])  # fmt: skip
def test_missing_points_have_no_figures(frame):
    """Empty geometries, missing coordinates: they are told, and the other points have what they have alone."""
    with pytest.warns(Notice, match=r"^1 of 2 points have no longitude or no latitude; they have no figures\.$"):
        found = factors("EPSG:2056", frame)
    assert found.k.iloc[0] == factors("EPSG:2056", frame[:1].infer_objects()).k.iloc[0]
    assert np.isnan(found.k.iloc[1])
    assert found.quality.tolist() == ["ok", "outside"]


NO_POINTS = r"Invalid points\. They must be longitudes and"


@each("case", [
    (geo("EPSG:4326", MultiPoint([(1, 2)])), "Invalid point in row 1. The geometry is a MultiPoint; it must"),
    (geo("EPSG:4326", Point(1, 2), SQUARE), "in row 2. The geometry is a Polygon; it must be a point. 'check' "),
    (geo(None, Point(1, 2)), "Invalid points. They have no CRS; they must state the one that they are in."),
    (geo("EPSG:3857", Point(1e6, 2e6), Point(np.inf, 0)), "Invalid point in row 2."),
    (SWISS.rename(columns={"lon": "length"}), "Invalid columns 'name, length, lat' of points. One must be"),
    (SWISS.assign(lon=["1", "x"]), "Invalid point in row 2. Its lon is 'x'; it must be a number of degrees."),
    (SWISS.assign(lat=[95, 1]), "Invalid point in row 1. Its lat is '95'; it must lie within -90 and 90 degrees."),
    (SWISS.assign(K=1), "Invalid points. They have a column 'k' already; rename it, or give the new ones a prefix"),
    # A frame is alone: latitudes beside it, longitudes without latitudes, and a prefix without it are no points.
    *((SWISS, "Invalid latitudes beside a frame", [1, 2]), (1.0, NO_POINTS), (1.0, NO_POINTS, 2.0, "x")),
])  # fmt: skip
def test_what_is_refused(case: tuple) -> None:
    """One line that names the row, counted from 1, or the column."""
    points, message, *rest = case
    refuses(message, factors, "EPSG:2056", points, *rest[:1], prefix="".join(rest[1:]))


@each(
    ("projection", "code"),
    [("mollweide", 4326), ("+proj=laea +ellps=GRS80", 4326), ("EPSG:2056", 4150), ("EPSG:27572", 4807)],
)
def test_graticules(projection: str, code: int) -> None:
    """A CRS has its own geographic CRS; what states no datum but is of the Earth's size has WGS 84."""
    assert pyproj.CRS(graticule_of(make(projection)).wkt).to_epsg() == code
    for bare in (lambda lon, lat: (lon, lat), "+proj=pipeline +step +proj=moll"):
        assert projected_crs_of(make(bare)) is None
    for other in (make("+proj=moll +R=1737400"), make("+proj=moll +ellps=bessel")):  # they keep the ellipsoid
        found, truth = pyproj.CRS(graticule_of(other).wkt).ellipsoid, other.ellipsoid
        sizes = found.semi_major_metre, found.semi_minor_metre
        assert sizes == (truth.a, pytest.approx(truth.a * (1 - truth.f), rel=1e-12))


TOLD = r"^{} of {} feature\(s\) of the points look like degrees, as that at {}, but .* is in units of {}: is that"


@each(("crs", "points", "told"), [
    ("EPSG:3857", [(11, 48)], (1, 1, "11, 48", "metre")),
    ("EPSG:25832", [(5e5, 5e6), (48, 150)], (1, 2, "48, 150", "metre")),
    ("EPSG:2227", [(-120.5, 37)], (1, 1, "-120\\.5, 37", "US survey foot")),
    ("EPSG:25832+7837", [(11, 48)], (1, 1, "11, 48", "metre")),
])  # fmt: skip
def test_degrees_that_are_stated_to_be_metres(crs, points, told) -> None:
    """They are told of, and measured as what is stated."""
    with pytest.warns(Notice, match=TOLD.format(*told)):
        factors("EPSG:3857", geo(crs, *map(Point, points)))


@each(("crs", "x", "y"), [
    *(("EPSG:4326", 11, 48), ("EPSG:25832", 5e5, 5e6), ("EPSG:3857", 180, 180)),
    ("EPSG:3857", 0, 0),  # a null point, wherever it was
    ("+proj=laea +lat_0=50 +lon_0=10 +units=km +type=crs", 60, 80),
    ("+proj=moll +R=1 +type=crs", 0.5, 0.5),
])  # fmt: skip
def test_what_does_not_look_like_degrees(crs, x, y) -> None:
    """Degrees themselves, and numbers that are as small for another reason."""
    factors("+proj=moll +R=1" if "R=1" in crs else "EPSG:3857", geo(crs, Point(x, y)))


def test_columns_by_their_usual_names() -> None:
    """As those of files: in capitals or not."""
    named = SWISS.rename(columns={"lon": "Longitude", "lat": "LAT"})
    assert factors("EPSG:2056", named).k.tolist() == factors("EPSG:2056", SWISS).k.tolist()
