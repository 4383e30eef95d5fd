"""Whatever a region or its file holds, it is a region or one line: the language and the readers, given anything."""

import json
import math
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from region_texts import refused
from tables import each
from typer.testing import CliRunner

from projdist import Notice, get_region
from projdist.cli.app import app

FILES_STAY = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
FEW = settings(max_examples=20, suppress_health_check=FILES_STAY)
MANY = settings(max_examples=600, suppress_health_check=FILES_STAY)


def region_or_line(given_region: Any) -> None:
    """There is a region, or it is refused as it must be, by a ValueError of ours in one line; never with a warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        try:
            region = get_region(given_region)
        except ValueError as error:
            refusal = str(error)
        else:
            refusal = ""
    if refusal:
        assert refusal.startswith("Invalid ")
        assert len(refusal) < 1500
        return
    west, south, east, north = region.bounds
    assert west < east
    assert south < north
    assert math.isfinite(region.area_km2)


# ---- the language ---------------------------------------------------------------------------
NUMBERS = st.one_of(
    st.integers(-400, 400).map(str), st.floats().map(str), st.sampled_from(["", "1e400", "nan", "9" * 400, "٣", "0x10"])
)
PREFIXES = ["country:", "file:", "crs:", "continent:", "state:", ""]
ATOMS = st.one_of(
    st.sampled_from("globe land@110m ocean@110m country:CH@110m country:FR@110m@main continent:Asia@110m".split()),
    st.sampled_from("crs:EPSG:2056 crs: country: state:RI file: points:x.csv#a geodesic:/dev/null land@".split()),
    st.lists(NUMBERS, min_size=3, max_size=5).map(lambda numbers: "box:" + ",".join(numbers)),
    st.lists(NUMBERS, min_size=2, max_size=4).map(lambda numbers: "cap:" + ",".join(numbers)),
    st.text(max_size=12),
    st.tuples(st.sampled_from(PREFIXES), st.text(max_size=20)).map("".join),
)
REGIONS = st.recursive(
    ATOMS,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from([" & ", " - ", " + ", "&", " "]), inner).map("".join),
        inner.map(lambda text: f"({text})"),
        st.tuples(inner, st.sampled_from(["@main", "@all", "@main:50", "@main:x", ")", '"', "@"])).map("".join),
    ),
    max_leaves=5,
)


@pytest.mark.slow
@MANY
@given(REGIONS)
def test_texts(text: str) -> None:
    """A text is a region, or one line."""
    region_or_line(text)


LONG = [
    *("land" + " " * 19_000 + "x", " " * 50_000, "(" * 700 + "globe" + ")" * 700, "(" * 19_000, "globe" + " &" * 9_000),
    *("country:" + "x" * 300, "y" * 19_000, "file:" + "z" * 300 + ".geojson", "points:" + "z" * 300),
    *("file:" + "z" * 5000 + "#" + "l" * 300, "box:" + "," * 19_000, "box:" + "9" * 5000 + ",1,2,3"),
    *("land" + "@main" * 3000, "crs:EPSG:" + "1" * 5000, "file:a\0b.geojson"),
]


@each("text", LONG)
def test_long_texts(text: str) -> None:
    """What is long is refused in one line, within the second."""
    start = time.perf_counter()
    result = CliRunner().invoke(app, ["compare", "merc", "-r", text])
    assert time.perf_counter() - start < 5.0  # a busy machine; it took minutes
    assert (result.exit_code, result.stdout, result.stderr.count("\n")) == (2, "", 1)
    assert result.stderr.startswith("projdist: Invalid ")
    assert len(result.stderr) < 1500


def test_brackets_in_brackets() -> None:
    """Brackets may lie as deep as anyone writes them."""
    assert get_region("(" * 49 + "globe" + ")" * 49).name == "globe"


# ---- files ----------------------------------------------------------------------------------
HUGE = st.sampled_from([10**400, -(10**20)])
SCALARS = st.one_of(st.none(), st.booleans(), st.text(max_size=5), st.floats(), st.integers(-200, 200), HUGE)
ANYTHING = st.recursive(
    SCALARS,
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=4), inner, max_size=3)),
    max_leaves=8,
)
POSITIONS = st.one_of(
    st.tuples(st.floats(-200, 200), st.floats(-95, 95)).map(list), st.lists(SCALARS, max_size=4), SCALARS
)
GOOD_POSITIONS = st.tuples(st.floats(-180, 180), st.floats(-90, 90)).map(list)
RINGS = st.one_of(
    st.lists(GOOD_POSITIONS, min_size=3, max_size=8).map(lambda ring: [*ring, ring[0]]),
    st.lists(POSITIONS, max_size=6),
    ANYTHING,
)
KINDS = st.sampled_from([*"Polygon MultiPolygon Point LineString MultiPoint Feature Nonsense".split(), 5, None])


def sometimes(value: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Mostly this, else anything."""
    return st.one_of(value, value, value, ANYTHING)


POLYGONS = st.one_of(
    st.fixed_dictionaries({"type": st.just("Polygon"), "coordinates": sometimes(st.lists(RINGS, max_size=3))}),
    st.fixed_dictionaries(
        {"type": st.just("MultiPolygon"), "coordinates": sometimes(st.lists(st.lists(RINGS, max_size=2), max_size=2))}
    ),
    st.fixed_dictionaries({"type": sometimes(KINDS)}, optional={"coordinates": ANYTHING}),
)
POINTS = st.fixed_dictionaries({"type": st.just("Point"), "coordinates": sometimes(POSITIONS)})
PROPERTIES = sometimes(st.dictionaries(st.sampled_from(["weight", "height", "name"]), SCALARS))
CRS = st.fixed_dictionaries(
    {}, optional={"type": SCALARS, "properties": sometimes(st.fixed_dictionaries({"name": sometimes(st.sampled_from(
        ["EPSG:3857", "urn:ogc:def:crs:OGC:1.3:CRS84", "EPSG:4978", "EPSG:5773", "EPSG:32632", "IAU_2015:30100"]
    ))}))},
)  # fmt: skip


def collections(geometries: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    features = st.fixed_dictionaries(
        {"type": st.just("Feature"), "geometry": sometimes(geometries), "properties": PROPERTIES}
    )
    return st.one_of(
        geometries,
        st.fixed_dictionaries(
            {"type": st.just("FeatureCollection"), "features": sometimes(st.lists(sometimes(features), max_size=4))},
            optional={"crs": sometimes(CRS)},
        ),
        st.fixed_dictionaries({"type": st.just("GeometryCollection"), "geometries": sometimes(st.lists(geometries))}),
        ANYTHING,
    )


def check_json(folder: Path, value: Any, word: str) -> None:
    check_bytes(folder, "x.geojson", json.dumps(value).encode(), word)


@pytest.mark.slow
@MANY
@given(value=collections(POLYGONS), word=st.sampled_from(["file", "geodesic"]))
def test_geojson_of_polygons(tmp_path: Path, value: Any, word: str) -> None:
    """GeoJSON of any shape is a region or one line, whatever its edges."""
    check_json(tmp_path, value, word)


@FEW
@given(value=collections(POINTS))
def test_geojson_of_points(tmp_path: Path, value: Any) -> None:
    """And points."""
    check_json(tmp_path, value, "points")


@pytest.mark.slow
@MANY
@given(value=collections(POINTS))
def test_much_geojson_of_points(tmp_path: Path, value: Any) -> None:
    """So are many more."""
    check_json(tmp_path, value, "points")


TABLES = st.one_of(
    st.text(max_size=60),
    st.lists(st.lists(st.one_of(NUMBERS, st.text(max_size=4)), min_size=1, max_size=4).map(",".join), max_size=5).map(
        lambda rows: "lon,lat,weight\n" + "\n".join(rows)
    ),
)


def check_bytes(folder: Path, name: str, content: bytes, word: str) -> None:
    path = folder / name
    path.write_bytes(content)
    region_or_line(f"{word}:{path}")


@settings(FEW, max_examples=60)
@given(content=st.one_of(TABLES.map(lambda text: text.encode("utf-8", "surrogatepass")), st.binary(max_size=80)))
def test_tables_of_points(tmp_path: Path, content: bytes) -> None:
    """Tables, and bytes that are no text, are points or one line; `test_readers` breaks many more."""
    check_bytes(tmp_path, "x.csv", content, "points")


def vector_file(path: Path) -> bytes:
    """A small file of one polygon and its bytes."""
    pyogrio = pytest.importorskip("pyogrio")
    path.unlink(missing_ok=True)  # the last example's, spoilt
    shape = shapely.Polygon([(5, 45), (10, 45), (10, 50), (5, 50)])
    fields = {"field_data": [np.array([2.5])], "fields": np.array(["weight"])}
    pyogrio.raw.write(path, np.array([shape.wkb]), geometry_type="Polygon", crs="EPSG:4326", **fields)
    return path.read_bytes()


SPOILT = st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), max_size=6)


def check_spoilt(folder: Path, suffix: str, spoils: list[tuple[float, int]], word: str) -> None:
    whole = vector_file(folder / f"whole.{suffix}")
    content = bytearray(whole)
    for place, value in spoils:
        content[min(int(place * len(content)), len(content) - 1)] = value
    check_bytes(folder, f"whole.{suffix}", bytes(content), word)


@pytest.mark.parametrize("suffix", ["gpkg", "shp", "fgb"])
@settings(max_examples=5, suppress_health_check=FILES_STAY)
@given(spoils=SPOILT, word=st.sampled_from(["file", "geodesic", "points"]))
def test_spoilt_files(tmp_path: Path, suffix: str, spoils: list[tuple[float, int]], word: str) -> None:
    """Files of other formats with bytes changed are a region or one line."""
    check_spoilt(tmp_path, suffix, spoils, word)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["gpkg", "shp", "fgb"])
@settings(max_examples=300, suppress_health_check=FILES_STAY)
@given(spoils=SPOILT, word=st.sampled_from(["file", "geodesic", "points"]))
def test_many_spoilt_files(tmp_path: Path, suffix: str, spoils: list[tuple[float, int]], word: str) -> None:
    """So are many more."""
    check_spoilt(tmp_path, suffix, spoils, word)


SQUARE = [[0, 0], [10, 0], [10, 10], [0, 10], [0, 0]]
FEATURE = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [SQUARE]}}
POINT = {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [1, 2]}}


def crs(value: Any) -> dict[str, Any]:
    return {"type": "FeatureCollection", "features": [FEATURE], "crs": value}


UNNAMED = "It must be GeoJSON; its crs must have properties with the name of a CRS, a text."
NO_RINGS = "Its polygons must have coordinates, lists of rings."
NO_CRS: list[Any] = [{}, {"foo": 1}, {"type": "name"}, {"properties": {"name": [1]}}]
NO_CRS += [{"type": "link", "properties": {"href": "x"}}]
LISTLESS = {"type": "FeatureCollection", "features": 5}
ODD: dict[str, tuple[str, Any, str]] = {
    "crs as text": ("file", crs("EPSG:4326"), "It must be GeoJSON; its crs must be an object."),
    **{f"crs {value}": ("file", crs(value), UNNAMED) for value in NO_CRS},
    "no coordinates": ("file", {"type": "Polygon"}, NO_RINGS),
    "a number": ("geodesic", {"type": "MultiPolygon", "coordinates": [3]}, NO_RINGS),
    "a point of nothing": ("points", {"type": "Point", "coordinates": [[]]}, "Its coordinates must be numbers."),
    "no point": ("points", {"type": "Point"}, "Its coordinates must be numbers."),
    "huge": ("file", {"type": "Polygon", "coordinates": [[[10**400, 0], *SQUARE]]}, "Its coordinates must be numbers."),
    "features": ("points", LISTLESS, "It must be GeoJSON; its features must be a list."),
    "properties": ("points", POINT | {"properties": [1]}, "It must be GeoJSON; its properties must be an object."),
    "weight": ("points", POINT | {"properties": {"weight": "cow"}}, "Point 1 must have a number for weight."),
    "height": ("points", POINT | {"properties": {"height": [2]}}, "Point 1 must have a number for height."),
}


@pytest.mark.parametrize("kind", ODD)
def test_odd_geojson(tmp_path: Path, kind: str) -> None:
    """What is of another shape than expected is named."""
    word, value, reason = ODD[kind]
    path = tmp_path / "x.json"
    path.write_text(json.dumps(value))
    thing = "points" if word == "points" else "region"
    assert refused(f"{word}:{path}").startswith(f"Invalid {thing} file '{path}'. {reason}")


@pytest.mark.parametrize(
    "nested",
    [
        lambda n: "[" * n + "]" * n,
        lambda n: '{"type":"GeometryCollection","geometries":[' * n + "]}" * n,
        lambda n: '{"type":"Feature","geometry":' * n + "null" + "}" * n,
    ],
)
@pytest.mark.parametrize("depth", [300, 100_000])
def test_deep_nesting(tmp_path: Path, nested: Callable[[int], str], depth: int) -> None:
    """However deep a file is nested, it is one line."""
    for word in ("file", "points"):
        check_bytes(tmp_path, "x.geojson", nested(depth).encode(), word)


# ---- boxes that may not be meant ------------------------------------------------------------
@pytest.mark.parametrize(
    ("given_box", "wide", "meant"),
    [("30,35,-10,70", 320, "-10,35,30,70"), ("-60,10,-120,50", 300, "-120,10,-60,50"), ("10,-5,5,5", 355, "5,-5,10,5")],
)
def test_boxes_that_cross_by_mistake(given_box: str, wide: int, meant: str) -> None:
    """West and east exchanged make a box that is far too wide, which is said, in Python and on the command line."""
    text = f"Region 'box:{given_box}' crosses the antimeridian and is {wide} degrees wide; did you mean box:{meant}?"
    with pytest.warns(Notice) as caught:
        get_region(f"box:{given_box}")
    assert [str(one.message) for one in caught] == [text]
    assert caught[0].filename == __file__
    with pytest.warns(Notice, match="did you mean"):
        get_region([float(side) for side in given_box.split(",")])
    result = CliRunner().invoke(app, ["compare", "merc", "-r", f"box:{given_box}"])
    assert (result.exit_code, result.stderr) == (0, f"projdist: {text}\n")


MEANT = "177,-20,-178,-12 120,-60,-70,60 95,-60,-67,65 160,60,-160,75 -180,-90,180,90 -340,-40,20,40 0,0,10,5".split()


@each("box", MEANT)
def test_boxes_that_are_meant(box: str) -> None:
    """Fiji, the Pacific from Sumatra to Chile, the Bering Sea, and what does not cross are taken as they are."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        get_region(f"box:{box}")
