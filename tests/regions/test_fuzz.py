"""Whatever a region or its file holds, it is a region or one line: the language and the readers, given anything."""

import json
import math
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from commands import refused
from hypothesis import HealthCheck, given, settings, strategies as st
from tables import each

from projdist import Notice, get_region

FILES_STAY = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
MANY = settings(max_examples=200, suppress_health_check=FILES_STAY)


def region_or_line(given_region: Any) -> None:
    """There is a region, or it is refused as it must be, by a ValueError of ours in one line; never with a warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        try:
            region = get_region(given_region)
        except ValueError as error:
            region, refusal = None, str(error)
    if region is None:
        assert refusal.startswith("Invalid ")
        assert len(refusal) < 1500
    else:
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
    start = time.process_time()
    said = refused("compare", "merc", "-r", text)
    assert time.process_time() - start < 5.0  # it took minutes
    assert said.startswith("projdist: Invalid ")
    assert len(said) < 1500


def test_brackets_in_brackets() -> None:
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
    st.fixed_dictionaries({
        "type": st.just("MultiPolygon"), "coordinates": sometimes(st.lists(st.lists(RINGS, max_size=2), max_size=2))
    }),
    st.fixed_dictionaries({"type": sometimes(KINDS)}, optional={"coordinates": ANYTHING}),
)  # fmt: skip
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


def check_bytes(folder: Path, name: str, content: bytes, word: str) -> None:
    path = folder / name
    path.write_bytes(content)
    region_or_line(f"{word}:{path}")


@pytest.mark.slow
@pytest.mark.parametrize(("shapes", "words"), [(POLYGONS, ["file", "geodesic"]), (POINTS, ["points"])])
@MANY
@given(data=st.data())
def test_geojson(tmp_path: Path, shapes: st.SearchStrategy[Any], words: list[str], data: st.DataObject) -> None:
    """GeoJSON of any shape is a region or one line, whatever its edges."""
    content = json.dumps(data.draw(collections(shapes))).encode()
    check_bytes(tmp_path, "x.geojson", content, data.draw(st.sampled_from(words)))


def vector_file(path: Path) -> bytes:
    pyogrio = pytest.importorskip("pyogrio")
    path.unlink(missing_ok=True)  # the last example's, spoilt
    shape = shapely.Polygon([(5, 45), (10, 45), (10, 50), (5, 50)])
    fields = {"field_data": [np.array([2.5])], "fields": np.array(["weight"])}
    pyogrio.raw.write(path, np.array([shape.wkb]), geometry_type="Polygon", crs="EPSG:4326", **fields)
    return path.read_bytes()


SPOILT = st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), max_size=6)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["gpkg", "shp", "fgb"])
def test_spoilt_files(tmp_path: Path, suffix: str) -> None:
    @settings(max_examples=100, suppress_health_check=FILES_STAY)
    @given(spoils=SPOILT, word=st.sampled_from(["file", "geodesic", "points"]))
    def check(spoils: list[tuple[float, int]], word: str) -> None:
        content = bytearray(vector_file(tmp_path / f"whole.{suffix}"))
        for place, value in spoils:
            content[min(int(place * len(content)), len(content) - 1)] = value
        check_bytes(tmp_path, f"whole.{suffix}", bytes(content), word)

    check()


@each("depth", [300, 100_000])
@each(("start", "middle", "end"), [
    ("[", "", "]"),
    ('{"type":"GeometryCollection","geometries":[', "", "]}"),
    ('{"type":"Feature","geometry":', "null", "}"),
])  # fmt: skip
def test_deep_nesting(tmp_path: Path, start: str, middle: str, end: str, depth: int) -> None:
    for word in ("file", "points"):
        check_bytes(tmp_path, "x.geojson", (depth * start + middle + depth * end).encode(), word)


# ---- boxes that may not be meant ------------------------------------------------------------
@each(
    ("box", "wide", "meant"),
    [("30,35,-10,70", 320, "-10,35,30,70"), ("-60,10,-120,50", 300, "-120,10,-60,50"), ("10,-5,5,5", 355, "5,-5,10,5")],
)
def test_boxes_that_cross_by_mistake(box: str, wide: int, meant: str) -> None:
    """West and east exchanged make a box that is far too wide, which is said."""
    text = f"Region 'box:{box}' crosses the antimeridian and is {wide} degrees wide; did you mean box:{meant}?"
    with pytest.warns(Notice) as caught:
        get_region(f"box:{box}")
    assert [(str(one.message), one.filename) for one in caught] == [(text, __file__)]
    with pytest.warns(Notice, match="did you mean"):
        get_region([float(side) for side in box.split(",")])


MEANT = "177,-20,-178,-12 120,-60,-70,60 95,-60,-67,65 160,60,-160,75 -180,-90,180,90 -340,-40,20,40 0,0,10,5".split()


@each("box", MEANT)
def test_boxes_that_are_meant(box: str) -> None:
    """Fiji, the Pacific from Sumatra to Chile, the Bering Sea, and what does not cross are taken as they are."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        get_region(f"box:{box}")
