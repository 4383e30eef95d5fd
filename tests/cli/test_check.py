"""The command `check`: formats, limits and their exit code, files, and what is refused."""

import json
import shlex
from dataclasses import replace
from pathlib import Path

import pytest
from commands import command, parse_csv
from refusals import says, wrong_words
from shapely import LineString, Point, box
from tables import each

import projdist
from projdist.cli.data import check_report
from projdist.cli.report import render

run, run_ok, run_json, refusal = command("check")

geopandas = pytest.importorskip("geopandas")
GDAL = pytest.importorskip("pyogrio").__gdal_version__

BOX = {"name": ["Germany", "a road", "a tower"], "area_note": [1, 2, 3]}
SHAPES = [box(5.9, 47.3, 15.0, 55.1), LineString([(8, 50), (9, 51)]), Point(10, 50)]
IN_UTM = ["--crs", "EPSG:25832"]


@pytest.fixture(scope="module")
def frame():
    return geopandas.GeoDataFrame(BOX, geometry=SHAPES, crs="EPSG:4326")


@pytest.fixture(scope="module")
def data(frame, tmp_path_factory):
    """The folder with the data in every format, and a part of them in zone 32."""
    folder = tmp_path_factory.mktemp("data")
    frame.to_file(folder / "data.geojson")
    frame.to_file(folder / "data.gpkg", layer="first")
    frame.to_file(folder / "data.gpkg", layer="second")
    frame.to_parquet(folder / "data.parquet")
    frame[:1].to_crs("EPSG:25832").to_file(folder / "data.shp")
    frame[2:].to_file(folder / "points.geojson")
    return folder


def test_json(data, frame):
    """The dictionary of the Python function, the data's name, and the worst features."""
    found = run_json(data / "data.geojson", *IN_UTM, "--worst", "1")
    assert found.pop("data") == str(data / "data.geojson")
    assert found.pop("worst") == found["results"][:1]
    assert found == projdist.check(frame, "EPSG:25832", purpose=None).to_dict()
    assert found["overall"]["area_error"] == pytest.approx(0.00029, abs=5e-6)


def test_table(data):
    """Totals, the worst features by name, and what was not measured; CSV has a row a feature with all figures."""
    out = run_ok(data / "data.geojson", "--crs", "EPSG:3857")
    assert "(WGS 84): 2 of 3 features, 551,499 km2" in out
    shown = ("2.553403", "+155.3 %", "Germany", "a road", "Points only: 1 feature(s).")
    assert [text for text in (*shown, "a tower") if text not in out] == ["a tower"]
    rows = parse_csv(run_ok(data / "data.geojson", *IN_UTM, "--format", "csv", "--id", "area_note"))
    assert [row["name"] for row in rows] == ["1", "2", "3"]
    assert float(rows[0]["area_error"]) == pytest.approx(0.00029, abs=5e-6)
    assert (rows[2]["area_error"], rows[2]["note"]) == ("", "points only")
    out = run_ok(data / "data.geojson", *IN_UTM, "--format", "markdown")
    assert out.startswith("| map | name | measured | area ratio |")
    assert "+285.4 ppm" in out


def test_files(data):
    """GeoPackages with layers, GeoParquet; a Shapefile in a projected CRS is checked in that."""
    for words in (["data.gpkg#second", *IN_UTM], ["data.parquet", *IN_UTM], ["data.shp"]):
        out = run_ok(data / words[0], *words[1:])
        assert ("ETRS89 / UTM zone 32N" in out, "1.00028" in out) == (True, True)


LIMITS = {
    0: ["--fail-above 1%", "--fail-above 0.1%", "--fail-above '700 PPM'", "--fail-above-bearing 4"],
    3: ["--fail-above 500ppm", "--fail-above 0.0005", "--fail-above 6e-4", "--fail-above .1 --fail-above-bearing 3"],
}
OVERALL = [(0, "--fail-above 6e-4 --fail-on overall"), (3, "--fail-above 500ppm --fail-on overall")]


@each(("code", "words"), [*OVERALL, *((code, words) for code, cases in LIMITS.items() for words in cases)])
def test_limits(code, words, data):
    """The perimeter is off by 622 ppm, with the road by less, bearings by 3.2 degrees: 3 above the limit."""
    found, out, err = run(data / "data.geojson", *IN_UTM, *shlex.split(words))
    assert (found, "Germany" in out, err.count("\n")) == (code, True, bool(code))
    assert err.startswith("projdist: The " if code else "")


def test_what_cannot_be_drawn_is_above_every_limit(data):
    """Half the Earth away from the zone."""
    words = [data / "data.geojson", "--crs", "+proj=gnom +lat_0=-50 +lon_0=-170"]
    code, out, err = run(*words, "--fail-above", "1000%")
    told = "projdist: 2 feature(s) cannot be drawn in this CRS, which is above every limit.\n"
    assert (code, err) == (3, told)
    assert "Not measured, as beyond the edge of the CRS: 0 Germany, 1 a road." in out
    code, out, err = run(*words)
    reasons = "beyond the edge of the CRS (2), points only (1)"
    assert (code, err.count("\n")) == (2, 1)
    assert err.endswith(f"None of the features can be drawn in it: {reasons}.\n")
    assert ("0 of 3 features\n" in out, "nan" in out) == (True, False)


@pytest.mark.usefixtures("few_cells")
def test_data_that_go_on_past_a_whole_turn(tmp_path):
    """Bounds from 170 to 370 have a map on the page; metres in a file that says degrees end the command in one line."""
    shapes = [box(lon, 40, lon + 20, 50) for lon in range(170, 351, 20)]
    geopandas.GeoDataFrame(geometry=shapes, crs="EPSG:4326").to_file(tmp_path / "data.gpkg")
    words = (tmp_path / "data.gpkg", "--crs", "EPSG:3832")
    assert run(*words, "-o", tmp_path / "page.html")[0] == 0
    assert "9 of 10 features" in run(*words)[1]
    geopandas.GeoDataFrame(geometry=[box(1000, 40, 1010, 50)], crs="EPSG:4326").to_file(tmp_path / "data.gpkg")
    said = refusal(tmp_path / "data.gpkg", "--crs", "EPSG:3857")
    assert said.endswith("but coordinates that are not longitudes and latitudes in degrees.")


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".gpkg", ".geojson"])
def test_layer(suffix, data, tmp_path, frame):
    """The data with their errors as columns; no file is replaced unless asked."""
    path = tmp_path / f"errors{suffix}"
    assert run(data / "data.geojson", *IN_UTM, "-o", path)[0] == 0
    layer = geopandas.read_file(path)
    truth = projdist.check(frame, "EPSG:25832", purpose=None).features
    assert layer["name"].tolist() == BOX["name"]
    assert layer["length_error"][:2].tolist() == pytest.approx(truth["length_error"][:2].tolist())
    assert layer.geometry.geom_equals_exact(frame.geometry, 1e-9).all()
    message = f"Invalid output '{path}'. It exists; --overwrite replaces it."
    assert refusal(data / "data.geojson", *IN_UTM, "-o", path) == message
    # A file of a check can be checked again, its errors are replaced; one column alone is the user's.
    again = tmp_path / f"again{suffix}"
    assert run_ok(path, "--crs", "EPSG:3857", "-o", again).endswith(f"Wrote: {again}\n")
    second = geopandas.read_file(again)
    truth = projdist.check(frame, "EPSG:3857", purpose=None).features
    assert list(second.columns) == list(layer.columns)
    assert second["length_error"][:2].tolist() == pytest.approx(truth["length_error"][:2].tolist())
    own = tmp_path / f"own{suffix}"
    frame.assign(area_km2=1.0).to_file(own)
    assert "a column 'area_km2' already; rename it." in refusal(own, *IN_UTM, "-o", tmp_path / "refused.gpkg")


def feature(kind, coordinates, properties='{"name":"x"}'):
    """A feature of GeoJSON as text; what is in it need not be right."""
    geometry = f'{{"type":"{kind}","coordinates":{coordinates}}}'
    return f'{{"type":"Feature","properties":{properties},"geometry":{geometry}}}'


PARCEL = feature("Polygon", "[[[8,48],[9,48],[9,49],[8,48]]]")
# Before 3.11 GDAL itself says nothing, and the geometry is missing as that of `null` is.
CIRCLE = "GDAL says of 'x.geojson': Unsupported geometry type detected." if GDAL >= (3, 11) else ""


UNREAD = "1 feature(s) of 'x.geojson' have a geometry that cannot be read and is"
NO_OBJECT = "The member crs of 'x.geojson' is not an object, as GeoJSON needs: the data are"


@each(("other", "said"), [
    *((feature("LineString", "[[1,2]]"), UNREAD), (feature("Polygon", "[[[1,2]]]"), UNREAD)),
    *((feature("LineString", "[]"), ""), (feature("Polygon", "null"), ""), (feature("Circle", "[1,2]"), CIRCLE)),
    *((feature("LineString", "[[1,2],[3,4]]", "[1,2]"), ""), (PARCEL, NO_OBJECT)),
])  # fmt: skip
def test_features_that_are_broken(other, said, tmp_path, monkeypatch):
    """They have no figures, which is said in one line at most; the others have theirs."""
    monkeypatch.chdir(tmp_path)
    extra = '"crs":"EPSG:25832",' if said is NO_OBJECT else ""
    Path("x.geojson").write_text(f'{{"type":"FeatureCollection",{extra}"features":[{other},{PARCEL}]}}')
    code, out, err = run("x.geojson", *IN_UTM, "--format", "json")
    assert (code, err.count("\n")) == (0, bool(said))
    assert json.loads(out)["results"][1]["area_km2"] == pytest.approx(4122.2, rel=1e-4)  # by pyproj's Geod
    assert err.startswith(f"projdist: {said}" if said else "")


BROKEN = [
    *(f'{{"type":"FeatureCollection","features":[{PARCEL}', '{"type":"FeatureCollection","features":"x"}', "\0\1"),
    *(f'{{"type":{"9" * 5000}', "[" * 100_000 + "]" * 100_000),
]


@each("text", BROKEN)
def test_files_that_are_broken(text, tmp_path):
    (tmp_path / "x.geojson").write_text(text)
    said = refusal(tmp_path / "x.geojson", *IN_UTM)
    assert (said.startswith("Invalid data file"), len(said) < 490) == (True, True)


@pytest.mark.slow
def test_recommended(data):
    """The second row is the recommended CRS, with the same data in it."""
    out = run_ok(data / "data.geojson", "--crs", "EPSG:3857", "--suggest", "--purpose", "equal-area")
    assert "1.000000" in out
    assert "The second line: the recommended CRS" in out


@pytest.mark.slow
@each(("crs", "said"), [
    ("{}", "its crs must have properties with the name of a CRS, a text."),
    ('{"type":"link","properties":{"href":"x"}}', "its crs must have properties with the name of a CRS, a text."),
    ('{"type":"name","properties":{"name":"nonsense"}}', "Invalid CRS 'nonsense'. It must be a CRS that PROJ"),
])  # fmt: skip
def test_a_crs_that_is_none(crs, said, tmp_path):
    """GeoJSON that states nonsense is refused (GDAL takes it for WGS 84); a feature may have a property crs."""
    text = '{{"type":"FeatureCollection",{}"features":[{}]}}'
    (tmp_path / "x.geojson").write_text(text.format(f'"crs" : {crs},', PARCEL))
    assert said in refusal(tmp_path / "x.geojson", *IN_UTM)
    own = feature("Polygon", "[[[8,48],[9,48],[9,49],[8,48]]]", f'{{"crs":{crs}}}')
    (tmp_path / "x.geojson").write_text(text.format("", own))
    assert run(tmp_path / "x.geojson", *IN_UTM)[::2] == (0, "")


def test_the_recommended_crs_is_checked(frame):
    """Where it is the one that is checked it has no row of its own, which would be the same; JSON has it."""
    result = projdist.check(frame, "EPSG:25832", purpose=None)
    itself = check_report(replace(result, recommended=result), "data", 1)
    other = replace(result, recommended=projdist.check(frame, "EPSG:32632", purpose=None))
    for form in ("details", "markdown"):
        text = render(itself, form)
        assert text.count("ETRS89 / UTM zone 32N") == 2  # in the answer and in the table
        assert "The recommended CRS for the box around the data is this one, EPSG:25832." in text
        assert "UTM zone 32N" in render(check_report(other, "data", 1), form).partition("ETRS89 / UTM zone 32N")[2]
    assert json.loads(render(itself, "json"))["recommended"] is not None


@each(("words", "code", "message"), wrong_words("_check"))
def test_refused(words, code, message, data):
    given = shlex.split(f"{data}/{words.strip().replace('UTM', ' '.join(IN_UTM))}")
    assert says(message, refusal(*given, code=code))
