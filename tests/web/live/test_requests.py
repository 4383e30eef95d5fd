"""A page names no files, its messages are what they must be, and what is said of designs and features."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
import shapely
from live_pages import header_of
from pyproj import CRS
from refusals import refuses
from tables import each

from projdist.projections import Projection, ProjectionError
from projdist.regions import get_region
from projdist.web.live import dispatcher
from projdist.web.live.dispatcher import InputPolicy, Request, RequestError, read_request
from projdist.web.live.handlers import checked, designed, figures_of

READING = [
    *("map.prj", "/etc/passwd.wkt", "../x.json", "C:\\maps\\x.prj", "~/x.PRJ", " x.wkt "),
    *("+proj=hgridshift +grids=x.gsb", "+proj=utm +zone=32 +nadgrids=x.gsb", "+proj=merc +geoidgrids=egm.gtx"),
    *("+proj=utm +zone=32 +nadgrids=@x.gsb", "+proj=pipeline +step +proj=vgridshift +grids=a.tif +step +proj=merc"),
    *("+proj=tinshift +file=x.json", "+proj=defmodel +model=x.json", "+proj=deformation +xy_grids=a +z_grids=b"),
    *("+init=/tmp/x:1", "+init=../x:1", "init=./x:1", "+proj=merc +ellps=/etc/passwd"),
    *("+proj=xyzgridshift +grids=x", "+proj=gridshift +grids=x", "+PROJ=hgridshift +GRIDS=x"),
    *('{"proj": "hgridshift", "grids": "x"}', '{"proj": "tinshift", "file": "x.json"}', '{"init": "/x:1"}'),
    'PROJCRS["x",METHOD["NTv2"],PARAMETERFILE["Latitude and longitude difference file","x.gsb"]]',
    'PROJCS["x",GEOGCS["y",EXTENSION["PROJ4_GRIDS","x.gsb"]]]',
    'PROJCS["x",GEOGCS["y",EXTENSION["PROJ4","+proj=longlat +nadgrids=x.gsb"]]]',
    'PROJCRS["x",METHOD["PROJ-based operation method: +proj=deformation +xy_grids=a"]]',
    *("robinson+nadgrids=x.gsb", "mollweide+geoidgrids=x@45,3", "+proj=merc +nadgrids=@null,x.gsb", "+init=x:1"),
    *('{"proj": "merc +nadgrids=x"}', '{"\\u0070roj": "merc", "init": "a"}'),
    '{"proj": "hgridshift", "gr\\u0069ds": "x"}',
    '{"type": "BoundCRS", "parameters": [{"name": "Latitude difference f\\u0069le", "value": "x.las"}]}',
]

OPEN = [
    *("robinson", "robinson+lon_0=150", "mollweide@45,-100", "EPSG:3035", "ESRI:54030", "WGS 84 / UTM zone 32N"),
    *("+proj=merc +nadgrids=@null", "+proj=utm +zone=32 +to_meter=1200/3937", "+init=epsg:32632 +no_defs"),
    "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=merc",
    *(CRS(27700).to_wkt(), CRS(27700).to_json(), CRS(3857).to_wkt("WKT1_GDAL"), CRS(2056).to_wkt("WKT1_ESRI")),
    '{"proj": "merc", "nadgrids": "@null"}',
]


@each("text", READING)
def test_projections_that_need_files_are_refused(text: str) -> None:
    with pytest.raises(ProjectionError, match="must need no file"):
        InputPolicy().projection(text)


@each("text", OPEN)
def test_other_projections_are_open(text: str) -> None:
    assert InputPolicy().projection(text).name


@each("text", ["file:x.geojson", "globe & file:x", "(geodesic:x)", "points:a.csv", "FILE:x", "file :x", "crs:x.prj"])
def test_regions_that_need_files_are_refused(text: str) -> None:
    refuses("must need no file", InputPolicy().region, text)


def test_files_of_the_command_line_are_open(tmp_path: Path) -> None:
    path = tmp_path / "a.geojson"
    path.write_text('{"type": "Polygon", "coordinates": [[[0, 0], [10, 0], [10, 10], [0, 0]]]}')
    policy = InputPolicy(frozenset([f"file:{path}"]))
    assert policy.region(f"file:{path}").bounds == pytest.approx((0, 0, 10, 10))
    refuses("must need no file", policy.region, f"file:{path} - globe")


GOOD = {"id": 1, "kind": "preview", "projection": "robinson", "centre": [10, 20], "values": {"lon_0": 3}}


def test_requests_are_read() -> None:
    expected = {"id": 1, "kind": "preview", "projection": "robinson", "centre": (10.0, 20.0), "values": {"lon_0": 3.0}}
    assert read_request(json.dumps(GOOD)) == Request(**expected, region="globe")


BAD = [
    *({"id": -1}, {"id": "1"}, {"id": True}, {"id": 2**60}, {"kind": "other"}, {"kind": 3}, {"extra": 1}),
    *({"projection": 3}, {"projection": "x" * 30_000}, {"projection": "a\0b"}, {"centre": [1]}, {"centre": "x"}),
    *({"centre": [1, 91]}, {"centre": [1, None]}, {"values": [1]}, {"values": {"a": "b"}}, {"values": {"a": True}}),
    *({"values": {str(k): 1 for k in range(100)}}, {"beside": ["x"] * 100}, {"beside": [1]}, {"beside": "x"}),
    *({"options": {"a": [1]}}, {"options": 3}, {"region": None}, {"slot": 1}, {"centre": [10**400, 0]}),
    *({"values": {"lon_0": 10**400}}, {"values": {"lon_0": float("inf")}}, {"values": {"lon_0": float("nan")}}),
]


@each("message", [
    "", "no", "[]", "3", "{" * 50_000, '{"id": NaN}', "x" * (dispatcher.LONGEST_MESSAGE + 1),
    *(json.dumps(GOOD | changed) for changed in BAD),
])  # fmt: skip
def test_other_messages_are_refused(message: str) -> None:
    """In one line, and so is a file that is too large."""
    with pytest.raises(RequestError, match=r"^[^\n]*\Z"):
        read_request(message)
    with pytest.raises(RequestError, match="too long"):
        read_request(json.dumps(GOOD), b"x" * (dispatcher.LARGEST_FILE + 1))


LINE = '{"type": "LineString", "coordinates": %s}'

FILES = [
    *("", "null", "1", "[]", "\x00", "[" * 100_000, '{"type": [1]}', '{"type": "Foo"}', LINE % "[[1]]"),
    *(LINE % "[" * 5000, LINE % f"[[{'9' * 4000}, 2], [1, 2]]", LINE % f"[[{'9' * 5000}, 2], [1, 2]]"),
    *(LINE % '[["a", "b"], ["c", "d"]]', LINE % "[[1, 2], [3]]", '{"type": "FeatureCollection", "features": 3}'),
    *('{"type": "FeatureCollection"}', '{"type": "FeatureCollection", "features": [null]}'),
    '{"type": "Polygon", "coordinates": [[[0, 0], [1, 1]]]}',
    '{"type": "GeometryCollection", "geometries": [' * 5000 + "]}" * 5000,
]


@each("file", FILES)
def test_files_that_are_no_geojson_are_refused(file: str) -> None:
    pytest.importorskip("geopandas")
    request = Request(id=1, kind="check", projection="robinson", file=file.encode())
    assert (
        header_of(dispatcher.Dispatcher().answer(request))["problem"]
        == "Invalid file. It must be GeoJSON: features of lines or polygons"
    )


def test_maps_that_are_for_elsewhere() -> None:
    """Figures say so; those of maps for a place or for no place in particular need not."""
    notes = [
        figures_of(Projection.from_user_input(given), get_region("box:170,-40,171,-39"))["note"]
        for given in ("EPSG:3035", "EPSG:2193", "robin")
    ]
    assert "nothing of box:170,-40,171,-39 lies" in notes[0]
    assert notes[1:] == ["", ""]


def test_a_design_is_told_beside_its_best_rival(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of several; and beside none where there is none."""
    made = {"proj": "+proj=horner", "degree": 3, "base": SimpleNamespace(label="laea"), "notes": (), "error": 1e-9}
    for values, before in (((0.02, 0.01, 0.03), 0.01), ((), None)):
        found = SimpleNamespace(**made, value=0.005, rivals=[SimpleNamespace(value=value) for value in values])
        monkeypatch.setattr("projdist.designs.design", lambda *_, found=found, **__: found)
        told = designed(get_region("cap:0,0,100"), {}, lambda *_: None)
        assert (told["before"], told["after"], told["words"]) == (before, 0.005, "Degree 3 on laea.")


def test_the_worst_features_come_first() -> None:
    """Of squares on Mercator's map, where areas grow by 1 / cos^2 of the latitude."""
    pytest.importorskip("geopandas")
    features = [
        {
            "type": "Feature",
            "properties": {"name": f"{lat} N"},
            "geometry": shapely.box(0, lat, 1, lat + 1).__geo_interface__,
        }
        for lat in (30, 60, 0, 45)
    ]
    file = json.dumps({"type": "FeatureCollection", "features": features}).encode()
    found, lines = checked(Projection.from_user_input("+proj=merc +ellps=WGS84"), file)
    assert [row["name"] for row in found["rows"]] == ["60 N", "45 N", "30 N", "0 N"]
    assert lines["points"].reshape(4, 5, 2)[..., 1].min(axis=1).tolist() == [60.0, 45.0, 30.0, 0.0]
