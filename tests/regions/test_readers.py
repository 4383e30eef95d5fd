"""Readers of people's files under thousands of broken ones: an answer, or one line that says what is wrong."""

import re
import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings, strategies as st

from projdist import Notice, check, read_heights
from projdist.applications.mosaics import read_correspondences
from projdist.applications.oldmaps import old_map, read_control_points
from projdist.applications.pointclouds import read_cloud
from projdist.decisions.data_edges import REPAIRED
from projdist.gis import read_data, read_points
from projdist.regions import shapes

pytestmark = pytest.mark.slow

MANY = settings(max_examples=400, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])

# What a stray key, another program or another country leaves in a table.
KEYS = ['"', '""', ",", ";", "\t", "\n", "\r\n", "#", " ", "-", ".", "\x00", "\ufeff", "\u2028", "é", ",,,,\n"]
WORDS = ["nan", "inf", "-inf", "1e303", "1e-303", "1e999", "1_0", "٣", "9" * 20, "lon", "x,y\n", "end_header\n"]
SCRAPS = st.one_of(
    st.sampled_from(KEYS + WORDS), st.text(max_size=4), st.floats().map(str), st.integers(-(10**30), 10**30).map(str)
)


@st.composite
def broken(draw: st.DrawFn, whole: str, more: st.SearchStrategy[str] = SCRAPS) -> str:
    """A text with pieces put in, taken out, or in the place of others."""
    text = whole
    for _ in range(draw(st.integers(0, 4))):
        first = draw(st.integers(0, len(text)))
        last = draw(st.integers(first, min(len(text), first + 12)))
        text = text[:first] + draw(st.one_of(st.just(""), SCRAPS, more)) + text[last:]
    return text


def tried(read, path, text):
    """What is read of a file, or None where it is refused, in one line that begins as all do."""
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", errors="surrogatepass"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        try:
            return read(path)
        except ValueError as error:
            refused = error
    assert type(refused) is ValueError
    assert str(refused).startswith("Invalid ")
    assert len(str(refused).splitlines()) == 1
    return None


NOTHING = " ,;\t\ufeff\x1c\x1d\x1e\x1f\x85\xa0\u2028\u2029\x0b\x0c"


def rows_of(text):
    """The number of lines with more than separators in them, but for the header."""
    return sum(bool(line.strip(NOTHING)) for line in text.splitlines()) - 1


POINTS = "name,lon,lat,weight\n" + "".join(f"p{k},{7 + k / 10},{47 + k / 20},{k + 1}\n" for k in range(9))


@MANY
@example(POINTS.replace("p1", '"p1'))
@example(POINTS.replace("p1", '"p1').replace("p7,", 'p7",'))
@example(POINTS.replace("7.2,", "7.2,,"))
@example(b"lon,lat\n\xff\x00,2\n")
@given(broken(POINTS))
def test_points(tmp_path, text):
    """The points of a region, as many as there are rows less those without coordinates; of a table all, or refusals."""
    found = tried(lambda path: shapes.points_from_file(path, "", "points"), tmp_path / "p.csv", text)
    if found is not None:
        assert np.isfinite([found.lon, found.lat, found.weight]).all()
        left_out = sum(int(re.search(r": (\d+) of \d+ points have no", note)[1]) for note in found.notes)
        assert len(found.lon) + left_out == rows_of(text)
    table = tried(read_points, tmp_path / "p.csv", text)
    assert table is None or len(table) == rows_of(text)


@MANY
@given(broken("lon,lat,h\n" + "".join(f"{7 + k / 10},{47 - k / 10},{100 * k}\n" for k in range(6))))
def test_heights(tmp_path, text):
    """Heights at points: finite, or refused."""
    found = tried(read_heights, tmp_path / "h.csv", text)
    assert found is None or np.isfinite(found).all()


CONTROL = "id,x_old,y_old,x_new,y_new\n" + "".join(
    f"c{k},{k},{k * k % 7},{600000 + 1000 * k + 30 * (k % 3)},{200000 + 900 * (k * k % 7)}\n" for k in range(9)
)
GCPS = "gdal_translate " + " ".join(f"-gcp {k} {k * k % 7} {6000 + 10 * k} {200 + 9 * (k * k % 7)}" for k in range(9))


@MANY
@example(CONTROL.replace("c1,1,1", "c1,1e303,1"), "tps")
@example(CONTROL.replace("c1,1,1", "c1,1e15,1"), "tps")
@given(
    st.sampled_from([CONTROL, GCPS, "#CRS: EPSG:2056\n" + CONTROL]).flatmap(broken),
    st.sampled_from(["tps", "affine", "polynomial2", "helmert"]),
)
def test_control_points(tmp_path, text, model):
    """An old map of control points, whatever their coordinates are."""
    tried(lambda path: old_map(read_control_points(path), model=model).to_dict(), tmp_path / "c.csv", text)


MATCHES = "# image sizes h x w: [(600, 800), (600, 800)]\nmodel,i,j,xi,yi,xj,yj\n" + "".join(
    f"0,0,1,{10 * k},{k * k},{10 * k + 3},{k * k - 2}\n" for k in range(6)
)


@MANY
@given(broken(MATCHES))
def test_correspondences(tmp_path, text):
    tried(read_correspondences, tmp_path / "m.csv", text)


CLOUDS = {
    "a.csv": "id,x,y,z\n" + "".join(f"q{k},{k},{k * k},{-k}\n" for k in range(6)),
    "b.csv": "".join(f"{k};{k * k};{-k}\n" for k in range(6)),
    "a.xyz": "".join(f"{k} {k * k} {-k} 255\n" for k in range(6)),
    "a.ply": "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty ushort n\n"
    "end_header\n" + "".join(f"{k} {k * k} {10000 * k}\n" for k in range(6)),
    "b.ply": "ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int n\nelement vertex 3\nproperty float x\n"
    "property float y\nend_header\n3 0 1 2\n3 2 1 0\n0 0\n1 0\n0 1\n",
    "a.pcd": "VERSION .7\nFIELDS x y n\nSIZE 4 8 2\nTYPE F F U\nCOUNT 1 1 2\nWIDTH 6\nHEIGHT 1\nPOINTS 6\nDATA ascii\n"
    + "".join(f"{k} {k * k} {100 * k} 7\n" for k in range(6)),
    "a.asc": "//X;Y;Z\n" + "".join(f"{k},5;{k * k},25;{-k}\n" for k in range(6)),
}


@pytest.mark.parametrize("name", CLOUDS)
@MANY
@given(st.data())
def test_clouds(tmp_path, name, data):
    """A cloud of points: each of them finite or missing, and written back where it can be read."""
    text = data.draw(broken(CLOUDS[name]))
    found = tried(read_cloud, tmp_path / name, text)
    if found is not None:
        whole = np.isfinite(found.points).all(axis=1)
        assert whole.any()
        assert np.isnan(found.points[~whole]).all()
        n = found.points.shape[1]
        found.write(tmp_path / f"new-{name}", np.eye(n), np.zeros(n), overwrite=True)
        again = tried(read_cloud, tmp_path / f"new-{name}", (tmp_path / f"new-{name}").read_bytes())
        np.testing.assert_array_equal(again.points, found.points)


BINARY_PCD = "VERSION .7\nFIELDS x y n\nSIZE 4 8 2\nTYPE F F U\nCOUNT 1 1 3\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA binary\n"
FACES = (
    "ply\nformat binary_big_endian 1.0\nelement face 2\nproperty list uchar short n\nelement vertex 2\n"
    "property float x\nproperty float y\nend_header\n"
)
BINARY = b"ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty double x\nproperty double y\nend_header\n"
NUMBERS = np.arange(8.0).tobytes()


@MANY
@example(BINARY.replace(b"vertex 4", b"vertex 1000000000000000000") + NUMBERS)
@given(
    st.tuples(
        st.sampled_from([BINARY.decode(), BINARY_PCD, FACES]).flatmap(broken).map(str.encode), st.binary(max_size=80)
    ).map(b"".join)
)
def test_binary_clouds(tmp_path, data):
    """A binary file with a header that claims anything."""
    found = tried(read_cloud, tmp_path / ("a.pcd" if data.startswith(b"VERSION") else "a.ply"), data)
    assert found is None or np.isfinite(found.points).all(axis=1).any()


FEATURES = """{"type": "FeatureCollection", "crs": {"type": "name", "properties": {"name": "EPSG:4326"}}, "features": [
{"type": "Feature", "properties": {"name": "a", "n": 1}, "geometry": {"type": "Polygon", "coordinates":
[[[8, 48], [9, 48], [9, 49], [8, 48]]]}},
{"type": "Feature", "properties": {"name": "b"}, "geometry": {"type": "LineString", "coordinates": [[7, 50], [8, 51]]}},
{"type": "Feature", "properties": null, "geometry": {"type": "MultiPolygon", "coordinates":
[[[[10, 48], [11, 48], [11, 49], [10, 49], [10, 48]], [[10.2, 48.2], [10.4, 48.2], [10.4, 48.4], [10.2, 48.2]]]]}}]}
"""
BRACKETS = ["[]", "[[]]", "{}", "[[1, 2]]", "[[[1, 2], [3, 4]]]", "[1]", "[" * 40, "]" * 40, "}", '{"a": ']
KINDS = ["null", '"x"', '"Point"', '"Polygon"', '"LineString"', '"GeometryCollection"', '"crs": "EPSG:25832"']
SHAPES = st.sampled_from([*BRACKETS, *KINDS, "1e400", "NaN", "9" * 400])


@MANY
@given(broken(FEATURES, SHAPES))
def test_features(tmp_path, text):
    """GeoJSON of any shape in `check`: figures, or a refusal."""
    found = tried(lambda path: check(read_data(path), "EPSG:25832", purpose=None), tmp_path / "x.geojson", text)
    if found is not None:
        known = found.features["length_km"] >= 0
        assert (known == [note in ("", REPAIRED) for note in found.features["note"]]).all()
        assert found.overall.measured == known.sum()
