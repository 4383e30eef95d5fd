"""The main part of a region, and the word on parts far away, against distances and countries as people know them."""

import math

import numpy as np
import pytest
import shapely
from tables import each
from typer.testing import CliRunner

from projdist.cli.app import app
from projdist.regions import GLOBE, Cap, PointSet, get_region, main_part
from projdist.regions.combinations import FAR_KM

# Points of each country that its main part holds, and others that it leaves out.
MAIN = {
    "FR": ([(2.35, 48.85), (9.1, 42.2)], [(-53.0, 4.0), (55.5, -21.1), (-61.0, 14.65)]),  # Corsica; Guiana, Réunion
    "US": ([(-95.0, 38.0), (-81.5, 27.5)], [(-150.0, 65.0), (-155.5, 19.6)]),  # Florida; Alaska, Hawaii
    "NO": ([(9.0, 61.0), (25.0, 70.0)], [(17.0, 77.5), (-8.4, 71.0)]),  # Finnmark; Svalbard, Jan Mayen
    "NL": ([(5.5, 52.0)], [(-68.28, 12.18)]),  # Bonaire
    "ES": ([(-4.0, 40.0), (2.9, 39.6)], [(-16.6, 28.27)]),  # Mallorca; Tenerife
    "PT": ([(-8.0, 39.5)], [(-16.95, 32.75), (-25.4, 37.8)]),  # Madeira, São Miguel
    "CL": ([(-70.5, -33.0), (-69.5, -54.0)], [(-109.35, -27.12)]),  # Tierra del Fuego; Easter Island
    "EC": ([(-78.5, -1.0)], [(-91.1, -0.7)]),  # Isabela of the Galapagos
    "NZ": ([(175.5, -39.0), (171.0, -43.5), (167.9, -47.0)], [(-176.5, -44.0)]),  # Stewart Island; Chatham
    "FJ": ([(178.0, -17.8), (179.2, -16.6), (-179.97, -16.85)], []),  # both sides of the antimeridian
    "KI": ([(-157.4, 1.85)], []),  # Kiritimati, the largest atoll
}


@each("code", MAIN)
def test_main_parts_of_countries(code: str) -> None:
    """The mainland and the islands that are mapped with it, without what lies overseas."""
    whole, main = get_region(f"country:{code}"), get_region(f"country:{code}@main")
    within, without = MAIN[code]
    for point in (*within, *without):
        assert bool(whole.contains(*point)), point
    assert [bool(main.contains(*point)) for point in within] == [True] * len(within)
    assert not any(bool(main.contains(*point)) for point in without)
    assert main.name == f"country:{code}@main"
    assert main.area_km2 < whole.area_km2


@pytest.mark.slow
@pytest.mark.parametrize("code", ["ID", "GB", "DK", "GR", "PH", "RU", "CA", "HR", "BS"])
def test_archipelagos_stay_whole(code: str) -> None:
    """What hangs together is the region itself, and there is no word on it; Russia crosses the antimeridian."""
    whole = get_region(f"country:{code}")
    assert main_part(whole) is whole
    assert whole.far == ""
    assert whole.notes == ()


def squares(*corners: tuple[float, float], size: float = 1.0) -> dict[str, object]:
    """A multi-polygon of squares, the first one twice as wide."""
    boxes = [
        shapely.box(lon, lat, lon + size * (2 if k == 0 else 1), lat + size) for k, (lon, lat) in enumerate(corners)
    ]
    return shapely.geometry.mapping(shapely.MultiPolygon(boxes))


@pytest.mark.parametrize("lon", [0.0, 175.0])
def test_gaps_are_distances_on_the_ground(lon: float) -> None:
    """Three squares at the equator, 3 and 4 degrees apart: a chain of which each gap counts; so it does across 180."""
    region = get_region(squares((lon, 0), (lon + 5, 0), (lon + 10, 0)))
    one, two, three = (main_part(region, km) for km in (333.0, 334.5, 446.0))
    # A degree of a great circle of the mean sphere is 111.195 km: gaps of 333.58 and 444.78 km at the equator.
    areas = [get_region(f"box:0,0,{width},1").area_km2 for width in (2, 3, 4)]
    assert [part.area_km2 for part in (one, two, three)] == pytest.approx(areas, rel=1e-9)
    assert three is region


def test_gaps_near_a_pole() -> None:
    """At 80 N five degrees of longitude are 97 km, whatever they are at the equator."""
    north, south = get_region(squares((0, 80), (7, 80))), get_region(squares((0, 0), (7, 0)))
    assert main_part(north, 100) is north
    assert main_part(south, 100) is not south


def test_long_edges_count_between_their_ends() -> None:
    """An island beside the middle of a box without a vertex there belongs to it."""
    box = shapely.box(0, 0, 60, 20)
    island = shapely.box(30, 21, 31, 22)
    region = get_region(shapely.geometry.mapping(shapely.MultiPolygon([box, island])))
    assert main_part(region, 112) is region
    assert main_part(region, 110) is not region


def test_what_has_no_parts() -> None:
    """Boxes, caps and points are their own main parts."""
    points = PointSet(np.array([0.0, 90.0]), np.zeros(2), np.ones(2))
    for region in (GLOBE, Cap(0, 0, 100), points):
        assert main_part(region) is region
        assert region.far == ""


@each(
    "text",
    [
        "country:FR@main",
        "country:FR@110m@main",
        "country:FR@main:1300",
        "continent:Oceania@main",
        "(country:FR + country:IT)@main",
        "country:FR@all",
        "(country:FR - box:0,40,10,50)@all",
        "country:FR@main - box:0,40,10,50",
    ],
)
def test_names_are_texts(text: str) -> None:
    """The name of a part is a text for it."""
    region = get_region(text)
    assert region.name == text
    assert region.notes == ()
    assert get_region(text.replace("@main", " @MAIN")).area_km2 == region.area_km2


def test_suffixes_in_any_order() -> None:
    """Detail and part may stand in either order."""
    assert get_region("country:FR@main:1300@110m").name == "country:FR@110m@main:1300"
    assert get_region("country:FR@all@110m").area_km2 == get_region("country:FR@110m").area_km2


def test_all_parts_are_the_region() -> None:
    """The same polygons without the word on them."""
    whole, asked = get_region("country:FR"), get_region("country:FR@all")
    assert (asked.area_km2, asked.bounds) == (whole.area_km2, whole.bounds)


def test_the_word_on_parts_far_away() -> None:
    """Its share, and the distances of the nearest and the farthest part, are those of two squares."""
    region = get_region(squares((0, 0), (12, 0), (22, 0)))
    gaps = math.radians(10) * 6371.0088, math.radians(20) * 6371.0088
    assert gaps[0] > FAR_KM
    assert region.notes == (region.far,)
    assert region.far.startswith(
        f"polygons: 50 % of the area lies {gaps[0]:.0f} to {gaps[1]:.0f} km from the main part; @main leaves it out"
    )


@each(
    ("text", "told"),
    [
        ("country:FR", True),
        ("country:FR - box:-3,42,5,50", True),
        ("country:FR & cap:2,48,900", False),
        ("country:MY", False),
        ("land@110m", False),
        ("continent:Oceania@110m", False),
        ("land@110m & box:-180,-30,180,30", False),
        ("country:FR@main + country:US@main", False),
    ],
)
def test_when_there_is_a_word(text: str, told: bool) -> None:
    """Where places are named, of which parts may not be meant, and of what is left of them."""
    assert bool(get_region(text).far) == told


@each(
    ("text", "message"),
    [
        ("country:FR@main:x", "Invalid distance 'x' of a main part. It must be a number of kilometres."),
        ("country:FR@main:", "Invalid distance '' of a main part. It must be a number of kilometres."),
        ("country:FR@main:0", "Invalid distance '0' of a main part. It must be 10 to 20015 km."),
        ("country:FR@main:nan", "Invalid distance 'nan' of a main part. It must be 10 to 20015 km."),
        ("country:FR@all:5", "Invalid region 'country:FR@all:5'. Polygons may have @main, @main:KM or @all behind"),
        (
            "country:FR@main@main",
            "Invalid suffix '@main'. It must be one of @110m, @50m, @10m, @main and @all, once each.",
        ),
    ],
)
def test_wrong_suffixes(text: str, message: str) -> None:
    """Each is refused in a line."""
    with pytest.raises(ValueError, match=r"^Invalid") as caught:
        get_region(text)
    assert str(caught.value).startswith(message)


def test_on_the_command_line() -> None:
    """A country with parts far away has its figures, and one line; its main part, and all on request, have none."""
    for text, lines in (("country:FR@110m", 1), ("country:FR@110m@main", 0), ("country:FR@110m@all", 0)):
        done = CliRunner().invoke(app, ["compare", "EPSG:2154", "-r", text])
        assert (done.exit_code, done.stderr.count("\n")) == (0, lines)
        assert ("@main leaves it out" in done.stderr) == bool(lines)
