"""Layers and tables for GIS programs, read back by pyogrio and held against `factors`; `frame.projdist`."""

import errno
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyproj
import pytest
import shapely
from gis_files import greenwich_degrees
from refusals import refuses
from tables import each

import projdist.gis.accessors
from projdist import Projection, factors, gis
from projdist.applications.oldmaps import ControlPoints, isolines, old_map
from projdist.projections import projected_crs_of, same_map

geopandas = pytest.importorskip("geopandas")
pd = pytest.importorskip("pandas")
pyogrio = pytest.importorskip("pyogrio")


LAYERS = {
    "mollweide": {"region": "box:-180,0,20,90"},
    "EPSG:2263": {"step": 0.5},
    "EPSG:5513": {"step": 1},
    "ESRI:54009": {"region": "cap:0,40,3000"},
    "equal-earth": {"region": "box:0,0,60,60", "step": 15},  # of which WKT 1 knows nothing
    "EPSG:3832": {"region": "box:170,-30,-170,10", "step": 10},
}


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".gpkg", ".geojson"])
@pytest.mark.parametrize("projection", LAYERS)
def test_indicatrices(projection: str, suffix: str, tmp_path: Path) -> None:
    """Ellipses in the map's CRS and its unit, about the points, of the area and the axes that `factors` says."""
    path = gis.save_layer(gis.indicatrices(projection, **LAYERS[projection]), tmp_path / f"e{suffix}")
    read = geopandas.read_file(path)
    map_ = Projection.from_user_input(projection)
    assert pyogrio.list_layers(path)[0, 0] == "e"
    assert same_map(map_, read.crs.to_wkt()) is not None
    names = ["lon", "lat", "x", "y", "a", "b", "h", "k", "s", "omega", "azimuth", "radius"]
    assert list(read.columns) == [*names, "geometry"]
    truth = factors(map_, read.lon, read.lat)
    np.testing.assert_allclose(
        read[names[2:10]].T, [getattr(truth, name) for name in names[2:10]], rtol=1e-12, atol=1e-6
    )
    # A polygon of 72 vertices in an ellipse has 36 sin(5 degrees) / pi of its area.
    area = 36 * np.sin(np.radians(5)) * read.s * (read.radius / read.crs.axis_info[0].unit_conversion_factor) ** 2
    np.testing.assert_allclose(read.geometry.area, area, rtol=1e-9)
    # The centre, by pyproj; the antimeridian is of no concern to it.
    middle = read.geometry.centroid
    lon, lat = greenwich_degrees(pyproj.CRS(read.crs.to_wkt()), middle.x.to_numpy(), middle.y.to_numpy())
    np.testing.assert_allclose(np.mod(lon - read.lon + 180, 360), 180, atol=1e-7)
    np.testing.assert_allclose(lat, read.lat, atol=1e-7)


@pytest.mark.usefixtures("few_cells")
def test_the_azimuth_of_the_major_axis() -> None:
    """Plate carree stretches along the parallels; conformal maps have none; the radius may be given."""
    layer = gis.indicatrices("eqc", region="box:0,20,40,60", step=10, radius=1e5)
    assert np.abs(layer.azimuth - 90).max() < 1e-6
    assert (layer.radius == 1e5).all()
    assert gis.indicatrices("merc", region="box:0,20,40,60", step=10).azimuth.isna().all()


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".gpkg", ".geojson"])
@pytest.mark.usefixtures("few_cells")
def test_indicatrices_of_a_map_without_a_crs(suffix: str, tmp_path: Path) -> None:
    """Metres, and a CRS that is undefined (GeoPackage) or of no place on the Earth (GeoJSON)."""
    layer = gis.indicatrices("+proj=pipeline +step +proj=moll", region="box:0,0,40,40", step=10)
    assert layer.crs is None
    read = geopandas.read_file(gis.save_layer(layer, tmp_path / f"e{suffix}"))
    assert read.crs is None or read.crs.type_name == "Engineering CRS"
    np.testing.assert_allclose(shapely.get_coordinates(read.geometry), shapely.get_coordinates(layer.geometry))


PLACES = pd.DataFrame({"name": ["Bern", "Chur"], "height": [540, 593], "lon": [7.44, 9.53], "lat": [46.95, 46.85]})
LIKE = geopandas.points_from_xy(PLACES.lon, PLACES.lat)


@each("suffix", [".gpkg", ".geojson", ".parquet", ".fgb", ".shp"])
def test_points_are_read_from(suffix: str, tmp_path: Path) -> None:
    """Whatever GDAL or pyarrow reads; other columns and the CRS are kept."""
    path = tmp_path / f"p{suffix}"
    frame = geopandas.GeoDataFrame(PLACES[["name", "height"]], geometry=LIKE, crs=4326)
    frame.to_parquet(path) if suffix == ".parquet" else frame.to_file(path)
    read = gis.read_points(path).sort_values("name", ignore_index=True)  # FlatGeobuf has an order of its own
    assert read.crs == frame.crs
    pd.testing.assert_frame_equal(pd.DataFrame(read[["name", "height"]]), PLACES[["name", "height"]], check_dtype=False)


def test_points_are_read_from_tables(tmp_path: Path) -> None:
    """CSV and Parquet without geometries; what begins with a zero stays text."""
    PLACES.to_parquet(tmp_path / "p.parquet")
    pd.testing.assert_frame_equal(gis.read_points(tmp_path / "p.parquet"), PLACES)
    (tmp_path / "p.csv").write_text("code,n,lon,lat,note\n007,1,0.1,2,\n8,,3,4,\n", encoding="utf-8-sig")
    read = gis.read_points(tmp_path / "p.csv")
    assert (read.code.tolist(), read.lon.tolist(), read.n[0]) == (["007", "8"], [0.1, 3.0], 1)
    assert np.isnan(read.n[1])


def test_layers_of_points(tmp_path: Path) -> None:
    """One of several must be named, behind a #."""
    path = tmp_path / "p.gpkg"
    for layer in ("one", "two"):
        geopandas.GeoDataFrame({"layer": [layer]}, geometry=LIKE[:1], crs=4326).to_file(path, layer=layer)
    assert gis.read_points(f"{path}#two").layer.tolist() == ["two"]
    for wrong in (f"{path}", f"{path}#three"):
        refuses(r"Invalid points file '.*'. It must name a layer, .* it has one, two.", gis.read_points, wrong)


@each(("name", "text", "message"), [
    *((f"x.{one}", b"\xff\xfe\0nothing" * 10, "It cannot be read") for one in ("gpkg", "parquet", "csv", "txt")),
    ("x.csv", b"lon,lat,lon\n1,2,3\n", "It has two columns 'lon'"),
    ("x.csv", b"lon,lat,name\n1,2,x\n3,4\n", "Line 3 has 2 cells; it must have 3"),
])  # fmt: skip
def test_points_that_cannot_be_read(name: str, text: bytes, message: str, tmp_path: Path) -> None:
    """No file, a file of something else, two columns of one name, a line that is too short; as data, no geometries."""
    path = tmp_path / name
    path.unlink(missing_ok=True)
    refuses("There is no file", gis.read_points, path)
    path.write_bytes(text)
    refuses(rf"^[^\n]*{message}[^\n]*$", gis.read_points, path)
    PLACES.to_parquet(tmp_path / "p.parquet")
    refuses(r"^Invalid data file '.*'. It has no geometries.$", gis.read_data, tmp_path / "p.parquet")


def test_points_become_tables(tmp_path: Path) -> None:
    """Geometries become columns lon and lat, on the datum of the map, unless there are such columns."""
    map_ = Projection.from_user_input("EPSG:3035")
    frame = geopandas.GeoDataFrame(PLACES[["name"]], geometry=LIKE, crs=4258).to_crs(3035)
    read = pd.read_csv(gis.save_points(map_, frame, tmp_path / "p.csv"))
    assert list(read) == ["lon", "lat", "name"]
    np.testing.assert_allclose(read[["lon", "lat"]], PLACES[["lon", "lat"]], atol=1e-9)
    for given in (geopandas.GeoDataFrame(PLACES, geometry=LIKE[::-1], crs=4258), PLACES):
        pd.testing.assert_frame_equal(pd.read_csv(gis.save_points(map_, given, tmp_path / "q.csv")), PLACES)


def test_points_that_cannot_be_written(tmp_path: Path) -> None:
    """Texts among numbers in Parquet, the Moon in GeoJSON: a line each, and no file."""
    earth, its = (Projection.from_user_input(name) for name in ("eqc", "IAU_2015:30110"))
    refuses("It cannot hold the table: ", gis.save_points, earth, PLACES.assign(name=[1, "x"]), tmp_path / "p.parquet")
    moon = geopandas.GeoDataFrame(PLACES[["name"]], geometry=LIKE, crs="IAU_2015:30100")
    said = "GeoJSON is in WGS 84, to which PROJ has no way from Moon"
    refuses(said, gis.save_points, its, moon, tmp_path / "p.geojson")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("suffix", gis.TABLE_SUFFIXES)
@pytest.mark.parametrize("crs", [None, "EPSG:4326", "EPSG:2056"])
def test_points_are_written(crs: str | None, suffix: str, tmp_path: Path) -> None:
    """The numbers come back to the last digit; points stay where they are, in their CRS or, for GeoJSON, in WGS 84."""
    map_, frame = Projection.from_user_input("EPSG:2056"), PLACES
    if crs:
        frame = geopandas.GeoDataFrame(PLACES[["name", "height"]], geometry=LIKE, crs=4326).to_crs(crs)
    found = factors(map_, frame)
    path = gis.save_points(map_, found, tmp_path / f"o{suffix}")
    read = gis.read_points(path)
    numbers = ["height", "x", "y", "h", "k", "omega", "convergence"]
    np.testing.assert_allclose(read[numbers], found[numbers], rtol=1e-15)
    assert read.name.tolist() == PLACES.name.tolist()
    again = factors(map_, read[[name for name in ("lon", "lat", "geometry") if name in read]])
    np.testing.assert_allclose(again[["x", "y"]], found[["x", "y"]], atol=2e-3)
    if suffix == ".gpkg":
        assert read.crs.to_epsg() == (pyproj.CRS(crs).to_epsg() if crs else 4150)
    if suffix == ".geojson":
        assert read.crs.to_epsg() == 4326
        assert read.geometry.iloc[0].x == pytest.approx(7.44, abs=1e-2)


def write(path: Path) -> None:
    """A file of each kind, by its suffix."""
    if path.suffix == ".tif":
        gis.save_raster(gis.raster("eqc", region="box:0,0,9,9", size=8), path)
    elif path.suffix == ".parquet":
        gis.save_points(Projection.from_user_input("eqc"), PLACES, path)
    else:
        gis.save_layer(gis.indicatrices("eqc", region="box:0,0,9,9", step=3), path)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["x.tif", "x.gpkg", "x.geojson", "x.parquet"])
def test_a_failure_leaves_nothing_half_written(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that is full in the middle: the old file as it was, and no other."""
    path = tmp_path / name
    path.write_text("old")

    def full(*arguments: object, **options: object) -> None:
        for target in arguments:
            if isinstance(target, Path):
                target.write_text("half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    for target in ("rasterio.open", "pyogrio.write_dataframe", "pandas.DataFrame.to_parquet"):
        monkeypatch.setattr(target, full)
    with pytest.raises(OSError, match="No space left"):
        write(path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@each("suffix, library", [(".tif", "rasterio"), (".gpkg", "geopandas"), (".gpkg", "pyogrio"), (".parquet", "pyarrow")])
def test_a_missing_library(suffix: str, library: str, tmp_path: Path) -> None:
    """One line that says what to install; unknown suffixes are refused by name."""
    for save, *given in ((gis.save_raster, None), (gis.save_layer, None), (gis.save_points, None, None)):
        refuses(r"Invalid .* 'x.foo'. Its suffix must be \.", save, *given, "x.foo")
    message = re.escape(f"x{suffix}'. It needs {library}: pip install 'projdist[gis]'.")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, library, None)
        with pytest.raises(ImportError, match=rf"^Invalid output '.*{message}$"):
            gis.check_libraries(tmp_path / f"x{suffix}")


def test_planes_of_crss() -> None:
    """A CRS is its own plane, whatever its unit and axes; the matrix leads to metres east and north."""
    for code, truth in (("EPSG:5513", [[0, -1], [-1, 0]]), ("EPSG:2263", np.eye(2) * 1200 / 3937)):
        found = projected_crs_of(Projection.from_user_input(code)).to_metres
        np.testing.assert_allclose(found, truth, rtol=1e-15)


MESH = 2e-3  # of a value, by straight sides of triangles a hundredth of the sheet large
A, B = 40.0 * np.exp(0.2j), 6.0 - 9.0j


def conformal(flip=1.0):
    """An old map that f = A z + B z^2 / 2 leads to the truth from."""
    x, y = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 9)] * 2), axis=-1).reshape(-1, 2).T
    f = A * (x + 1j * y) + 0.5 * B * (x + 1j * y) ** 2
    return old_map(ControlPoints(np.stack([x, flip * y], -1), np.stack([f.real, f.imag], -1)), model="polynomial2")


@pytest.mark.slow
@pytest.mark.parametrize("flip", [1.0, -1.0])
def test_isolines_of_a_conformal_map(flip):
    """At places f(z) of isolines the scale is that of the MDT over |A + B z|, the turn arg(A + B z) less its mean."""
    found = conformal(flip)
    parts = found.rectifications["mdt"].parts
    truths = {
        "scale": lambda slope: float(parts.scale) / np.abs(slope),
        "rotation": lambda slope: np.degrees(np.angle(slope)) - float(parts.rotation),
    }
    for measure, value in truths.items():
        levels = isolines(found, measure)
        assert 4 <= len(levels) <= 12
        for level, pieces in levels.items():
            f = pieces.reshape(-1, 2) @ [1.0, 1.0j]
            slope = np.sqrt(A * A + 2.0 * B * f)  # A + B z, by the formula of quadratic equations
            np.testing.assert_allclose(value(slope), level, atol=MESH * max(1.0, abs(level)))


@pytest.mark.slow
def test_layers_in_feet(tmp_path):
    """Lines lead from where the rectification has the points to the truth, in the CRS's unit; isolines are whole."""
    found = conformal()
    layers = gis.old_map_layers(found, by="affine", crs="EPSG:2230")
    known = replace(found, points=replace(found.points, crs=Projection.from_user_input("EPSG:2230")))
    assert gis.old_map_layers(known, by="affine")["displacements"].equals(layers["displacements"])
    moved = layers["displacements"]
    assert (moved.crs.to_epsg(), moved["outlier"].any()) == (2230, False)
    start = found.rectifications["affine"].affine(found.points.old)
    ends = np.array([line.coords for line in moved.geometry]) * 1200.0 / 3937.0
    np.testing.assert_allclose(ends, np.stack([start, found.points.new], axis=1), atol=1e-9)
    np.testing.assert_allclose(moved["length"], np.hypot(*(found.points.new - start).T), rtol=1e-12)
    # Lines of equal scale are arcs about one point: one each.
    assert layers["scale"]["level"].is_unique
    # An affine map is the same everywhere.
    alike = old_map(ControlPoints(found.points.old, found.points.old @ [[9.0, 1.0], [2.0, 8.0]]), model="affine")
    assert list(gis.old_map_layers(alike)) == ["displacements"]
    path = gis.save_layers(layers, tmp_path / "x.gpkg")
    assert len(pyogrio.read_dataframe(path, layer="scale")) == len(layers["scale"])
    said = r"Its suffix must be .gpkg, which has room for several layers"
    refuses(said, gis.save_layers, layers, tmp_path / "x.geojson")
    with pytest.raises(FileExistsError):
        gis.save_layers(layers, path, overwrite=False)


def test_wrong_rectifications():
    found, crs = conformal(), "+proj=pipeline +step +proj=merc +step +proj=affine +s11=2"
    refuses(r"Invalid rectification 'fit'. It must be one of mdt, affine, helmert", gis.old_map_layers, found, by="fit")
    refuses(r"PROJ has no CRS of it", gis.old_map_layers, found, crs=crs)


def test_frames_and_series_have_it() -> None:
    """A check by the accessor is the check of the function; web maps enlarge areas by 1 / cos(lat)^2, about 2.15."""
    squares = geopandas.GeoDataFrame(geometry=shapely.box([7, 8], 47, [7.1, 8.1], 47.1), crs="EPSG:4326")
    for data in (squares, squares.geometry):
        found = data.projdist.check("EPSG:3857", purpose=None).overall.area_error
        assert found == projdist.check(data, "EPSG:3857", purpose=None).overall.area_error
        assert found == pytest.approx(1.15, abs=0.02)


@pytest.mark.slow
def test_estimates() -> None:
    bern = geopandas.GeoSeries.from_xy([2600000, 2601000], [1200000, 1201000], crs="EPSG:2056")
    assert bern.projdist.estimate_crs(authorities=["EPSG"]).to_epsg() == 2056


def test_factors_of_points() -> None:
    """Also of a plain table with lon and lat: Mercator's scale is 1 / cos(lat). It is no data to check."""
    table = pd.DataFrame({"lon": [10.0], "lat": [60.0]})
    assert table.projdist.factors("mercator", prefix="m_")["m_k"][0] == pytest.approx(2.0, rel=1e-9)
    refuses(r"They must be a GeoDataFrame or GeoSeries\.$", table.projdist.check, "EPSG:3857")


HAS = "import pandas; print(hasattr(pandas.DataFrame, 'projdist'))"


@pytest.mark.parametrize(("imports", "question", "answer"), [
    ("projdist.gis", "print('pandas' in sys.modules)", "False"),
    pytest.param("geopandas, projdist.gis", HAS, "True", marks=pytest.mark.slow),
    pytest.param("projdist.gis, pandas", HAS, "False", marks=pytest.mark.slow),
    pytest.param("projdist.gis.accessors, geopandas", HAS, "True", marks=pytest.mark.slow),
])  # fmt: skip
def test_it_is_registered_with_pandas(imports: str, question: str, answer: str) -> None:
    """Importing projdist.gis alone loads no pandas, and registers nothing."""
    code = f"import sys, {imports}; {question}"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == answer
