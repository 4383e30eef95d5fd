"""Regions from texts: what they stand for, how they combine, and what is refused."""

import pyproj
import pytest
from region_texts import area, refused
from tables import each

from projdist.earth import natural_earth as geodata
from projdist.regions import GLOBE, Box, Cap, combine, get_region

# ---- names ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "texts",
    [
        ("country:CH", "country:che", "country:756", "Country: Switzerland", "country:CH@50m"),
        ("country:CI", "country:Côte d'Ivoire", "country:cote d ivoire", "country:Ivory Coast"),
        ("country:BA", "country:Bosnia and Herzegovina", 'country:"Bosnia & Herzegovina"'),
        ("country:CZ", "country:Czech Republic", "country:Czechia"),
        pytest.param(("continent:North America", "CONTINENT:north america"), marks=pytest.mark.slow),
        ("country:XK", "country:Kosovo"),
        pytest.param(("land", "LAND", "land@50m"), marks=pytest.mark.slow),
    ],
    ids=lambda texts: texts[0],
)
def test_spellings(texts):
    """A country is found by its codes and names, whatever their case and accents; the same text is the same object."""
    assert len({id(get_region(text)) for text in texts}) == 1
    assert get_region(texts[0]).name == texts[0]


@pytest.mark.slow
def test_every_country_can_be_named():
    """Each row of the table has polygons, and is found by its name and its codes."""
    for row in geodata.country_keys():
        for key in filter(None, (row["name"], row["iso_a2"], row["iso_a3"], row["iso_n3"])):
            assert get_region(f"country:{key}").name == f"country:{row['iso_a2'] or row['name']}"


def test_every_shape_of_the_data_is_in_the_table():
    """No country of Natural Earth is left out, but for those that only the finest data has.

    That has all others but Vatican City, whose outline is rounded to a line there.
    """
    keys = {row["iso_n3"] or row["name"] for row in geodata.country_keys()}
    shapes = {
        resolution: {geodata._key(shape) for shape in geodata._topology("countries", resolution).objects["countries"]}
        for resolution in geodata.RESOLUTIONS
    }
    assert shapes["110m"] <= shapes["50m"] == keys <= shapes["10m"] | {"336"}


def test_area_of_use():
    """The area of use of a CRS is a box, also of one that is no map."""
    swiss = get_region("crs:EPSG:2056")
    assert swiss == Box(*pyproj.CRS("EPSG:2056").area_of_use.bounds)
    # Liechtenstein and Switzerland, EPSG's extent 1286; its version 12 has moved the sides by a hundredth.
    assert swiss.bounds == pytest.approx((5.96, 45.82, 10.49, 47.81), abs=0.015)
    assert get_region("crs:EPSG:4326") == GLOBE
    assert get_region("crs:EPSG:3832").bounds[2] > 180


# ---- combinations ---------------------------------------------------------------------------


A, B = "box:0,0,20,20", "box:10,10,30,30"


def test_areas_of_combinations():
    """What is in both, in one only and in either has the areas of boxes."""
    both = area("box:10,10,20,20")
    assert area(f"{A} & {B}") == pytest.approx(both, rel=1e-12)
    assert area(f"{A} - {B}") == pytest.approx(area(A) - both, rel=1e-12)
    assert area(f"{A} + {B}") == pytest.approx(area(A) + area(B) - both, rel=1e-12)


def test_precedence():
    """& goes before - and +, these from left to right; brackets group."""
    c = "box:0,0,5,5"
    assert area(f"{c} + {A} & {B}") == pytest.approx(area(c) + area("box:10,10,20,20"), rel=1e-12)
    assert area(f"({c} + {A}) & {B}") == pytest.approx(area("box:10,10,20,20"), rel=1e-12)
    assert area(f"{A} - {c} - {B}") == pytest.approx(area(A) - area(c) - area("box:10,10,20,20"), rel=1e-12)
    assert area(f"{A} - ({c} + ({B}))") == pytest.approx(area(f"{A} - {c} - {B}"), rel=1e-12)


@pytest.mark.slow
def test_with_globe_and_ocean():
    """Land is the globe less the ocean; nothing is both; a zone across the antimeridian is cut out of the sea."""
    assert area("globe - ocean@110m") == pytest.approx(area("land@110m"), rel=1e-12)
    assert area("globe & land@110m") == pytest.approx(area("land@110m"), rel=1e-12)
    assert refused("land@110m & ocean@110m") == "Invalid region 'land@110m & ocean@110m'. Nothing is left of it."
    sea = get_region("ocean & box:170,-30,-170,-10")
    assert sea.bounds == pytest.approx((170, -30, 190, -10))
    assert 0.95 < sea.area_km2 / Box(170, -30, -170, -10).area_km2 < 1


def test_names_of_combinations():
    """The name of a combination is a text for it."""
    region = get_region("  country:CH   -  cap:8,47,50 ")
    assert region.name == "country:CH - cap:8,47,50"
    assert get_region(region.name).area_km2 == pytest.approx(region.area_km2, rel=1e-15)


def test_combined_in_python():
    """Regions combine as objects, too."""
    assert combine("-", Box(0, 0, 20, 20), Cap(0, 0, 100), "rest").area_km2 < Box(0, 0, 20, 20).area_km2


# ---- refusals -------------------------------------------------------------------------------


@each(
    ("text", "start"),
    [
        (
            "country:Swizerland",
            "Invalid country 'Swizerland'. Did you mean Switzerland? It must be a name in English or",
        ),
        ("country:Korea", "Invalid country 'Korea'. Did you mean North Korea or South Korea? It must be a name"),
        ("country:", "Invalid country ''. It must be a name in English or an ISO 3166 code."),
        ("country:VA@110m", "Invalid country 'VA' at 110m. It is too small for this data: ask for 50m."),
        ("country:VA@10m", "Invalid country 'VA' at 10m. It is too small for this data: ask for 50m."),
        ("continent:Europa", "Invalid continent 'Europa'. Did you mean Europe? It must be one of Africa, Antarctica,"),
        ("Fiji", "Invalid region 'Fiji'. Did you mean country:Fiji? It must be globe, land, ocean,"),
        ("lnad", "Invalid region 'lnad'. Did you mean land? It must be globe, land, ocean,"),
        (
            "land@110m - continent:Antarctica",
            "Invalid region 'land@110m - continent:Antarctica'. Its parts are of different detail, 110m and 50m, and "
            "would leave slivers along coasts: give all of them the same suffix.",
        ),
        ("land@1m", "Invalid suffix '@1m'. It must be one of @110m, @50m, @10m, @main and @all, once each."),
        (
            "country:FR@mainland",
            "Invalid suffix '@mainland'. It must be one of @110m, @50m, @10m, @main and @all, once each.",
        ),
        ("crs:EPSG:0", "Invalid CRS 'EPSG:0'. It must be a CRS that PROJ knows."),
        ("land -", "Invalid region 'land -'. There must be a region on each side of an operator."),
        ("& land", "Invalid region '& land'. There must be a region on each side of an operator."),
        ("(land", "Invalid region '(land'. Its brackets must close what they open."),
        ("land)", "Invalid region 'land)'. Its brackets must close what they open."),
        ("land - land", "Invalid region 'land - land'. Nothing is left of it."),
    ],
)
def test_refusals(text, start):
    """What names no region is refused, with what may have been meant."""
    assert refused(text).startswith(start)
