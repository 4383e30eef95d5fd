"""The regions of a batch, as text."""

import csv
import json
from pathlib import Path

import pytest

import projdist
from projdist.answers import areas_of
from projdist.regions import PointSet, get_region

SQUARE = {"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]]]}
FAR = {"type": "Polygon", "coordinates": [[[10, 50], [12, 50], [12, 51], [10, 51], [10, 50]]]}


def rows() -> list[dict[str, str]]:
    path = Path(projdist.__file__).parent / "data" / "countries.csv"
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))


def test_countries_and_continents():
    """All of the table of countries, of their continents, and of states; in the detail that is asked for."""
    assert {area.text for area in areas_of("countries")} == {f"country:{row['name']}" for row in rows()}
    assert {area.text for area in areas_of("continents")} == {f"continent:{row['continent']}" for row in rows()}
    assert len(areas_of("states")) == len(areas_of("states@10m")) == 56
    assert areas_of("states")[5] == ("state:California", "state:California")
    (switzerland,) = (one for one in areas_of("countries@10m") if "Switzerland" in one.text)
    assert switzerland.text == "country:Switzerland@10m"
    assert switzerland.place().area_km2 == get_region("country:CH@10m").area_km2


def write(path: Path, *features: tuple[dict, dict | None]) -> Path:
    members = [{"type": "Feature", "properties": fields, "geometry": shape} for fields, shape in features]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": members}))
    return path


def test_features_of_a_file(tmp_path):
    """Each is a region, by its name if it has one; two of a name are told apart; one without a geometry fails later."""
    path = write(
        tmp_path / "parts.geojson",
        ({"NAME": "a"}, SQUARE),
        ({"name": "a"}, FAR),
        ({}, {"type": "GeometryCollection", "geometries": [SQUARE, FAR]}),
        ({"name": "none"}, None),
    )
    areas = areas_of(str(path))
    assert [area.name for area in areas] == ["a", "a (2)", "parts 3", "none"]
    places = [area.place() for area in areas[:3]]
    octants = [get_region("box:0,0,2,2").area_km2, get_region("box:10,50,12,51").area_km2]
    assert [place.area_km2 for place in places] == pytest.approx([*octants, sum(octants)], rel=1e-9)
    assert [place.name for place in places] == ["a", "a (2)", "parts 3"]
    with pytest.raises(ValueError, match=r"^Invalid region 'none'. It holds no polygons.$"):
        areas[3].place()


@pytest.mark.slow
def test_features_in_a_crs(tmp_path):
    """A file's own coordinates go along with its CRS, and edges are straight there."""
    gis = pytest.importorskip("geopandas")
    frame = gis.GeoDataFrame(
        {"name": ["square"]}, geometry=gis.points_from_xy([4321000], [3210000]).buffer(1e5, cap_style=3), crs=3035
    )
    frame.to_file(tmp_path / "square.gpkg")
    expected = get_region(f"file:{tmp_path / 'square.gpkg'}").area_km2
    for given in (str(tmp_path / "square.gpkg"), frame):
        (area,) = areas_of(given)
        assert area.name == "square"
        assert area.place().area_km2 == pytest.approx(expected, rel=1e-12)
        assert expected == pytest.approx(4e4, rel=1e-3)  # 200 km squared; the projection is equal-area


@pytest.mark.slow
def test_one_and_several():
    """Whatever `get_region` takes, to the last digit, alone or in a list."""
    third = projdist.Box(1 / 3, 0, 20, 10)
    given = [third, projdist.Cap(10, 1 / 3, 500), (0, 1, 2, 3), "land & box:0,0,10,10", FAR]
    areas = areas_of(given)
    assert areas[0].place() == third
    assert areas[1].place() == given[1]
    assert areas[2].place() == projdist.Box(0, 1, 2, 3)
    assert areas[3].text == "land & box:0,0,10,10"
    assert areas[4].place().area_km2 == pytest.approx(get_region("box:10,50,12,51").area_km2, rel=1e-12)
    assert areas_of((0, 1, 2, 3)) == [areas[2]]
    assert areas_of(areas) == areas


def test_files_within_words(tmp_path):
    """Workers need no file: what is named so goes along as it is."""
    path = tmp_path / "square.geojson"
    path.write_text(json.dumps(SQUARE))
    (area,) = areas_of(f"file:{path} & box:1,1,5,5")
    path.unlink()
    assert area.place().area_km2 == pytest.approx(get_region("box:1,1,2,2").area_km2, rel=1e-9)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([], r"Invalid regions of a batch. There must be one at least."),
        ("countries@5m", r"Invalid suffix '@5m'. It must be one of @110m, "),
        ("states@50m", r"Invalid suffix '@50m' of a state. It must be one of @10m, @main and @all."),
        ("nowhere.gpkg", r"Invalid region file 'nowhere.gpkg'. It cannot be read: No such file"),
        ([3.5], r"Invalid region '3.5'"),
        (PointSet([1.0], [2.0], [1.0], "mine"), r"Invalid region 'mine' of a batch. It must be an area, not points."),
    ],
)
def test_refused(given, message):
    """In one line."""
    pytest.importorskip("geopandas")
    with pytest.raises(ValueError, match=f"^{message}"):
        areas_of(given)
