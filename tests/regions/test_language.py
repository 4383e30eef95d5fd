"""Regions from texts: what they stand for, how they combine, their titles, and what is refused."""

import pyproj
import pytest
from refusals import says, wrong_words
from region_texts import area, refused
from tables import each

from projdist.earth import data_rows, latitude_text, longitude_text, natural_earth
from projdist.regions import GLOBE, Box, get_region, is_region_text, region_title


# ---- names ----------------------------------------------------------------------------------
@each("texts", [
    ("country:CH", "country:che", "country:756", "Country: Switzerland", "country:CH@50m"),
    ("country:CI", "country:Côte d'Ivoire", "country:cote d ivoire", "country:Ivory Coast"),
    ("country:BA", "country:Bosnia and Herzegovina", 'country:"Bosnia & Herzegovina"'),
    *(("country:CZ", "country:Czech Republic", "country:Czechia"), ("country:XK", "country:Kosovo")),
    pytest.param(("continent:North America", "CONTINENT:north america"), marks=pytest.mark.slow),
    ("state:CA", "state:ca", "state:06", "STATE: California", "state:CA@10m"),
    ("state:DC", "state:District of Columbia", "state:Washington, D.C."),
    ("state:VI", "state:US Virgin Islands", 'state:"U.S. Virgin Islands"'),
    *(("state:NH", "state:new-hampshire"), ("state:HI", "state:Hawai'i")),
    pytest.param(("land", "LAND", "land@50m"), marks=pytest.mark.slow),
])  # fmt: skip
def test_spellings(texts):
    """A country or state is found by codes and names, whatever their case and accents; each text is the same object."""
    assert len({id(get_region(text)) for text in texts}) == 1
    assert get_region(texts[0]).name == texts[0]


@pytest.mark.slow
def test_every_country_can_be_named():
    """Each row of the table has polygons, and is found by its name and its codes."""
    for row in data_rows("countries.csv"):
        for key in filter(None, (row["name"], row["iso_a2"], row["iso_a3"], row["iso_n3"])):
            assert get_region(f"country:{key}").name == f"country:{row['iso_a2'] or row['name']}"


def test_every_shape_of_the_data_is_in_the_table():
    """No country is left out, but those in the finest data only, which lacks Vatican City: rounded to a line there."""
    keys = {row["iso_n3"] or row["name"] for row in data_rows("countries.csv")}
    outlines = (natural_earth.topology("countries", resolution)[0] for resolution in natural_earth.RESOLUTIONS)
    coarse, fine, finest = ({outline.key for outline in some} for some in outlines)
    assert coarse <= fine == keys <= finest | {"336"}


def test_area_of_use():
    """The area of use of a CRS is a box, also of one that is no map."""
    swiss = get_region("crs:EPSG:2056")
    assert (swiss, get_region("crs:EPSG:4326")) == (Box(*pyproj.CRS("EPSG:2056").area_of_use.bounds), GLOBE)
    # Liechtenstein and Switzerland, EPSG's extent 1286; its version 12 has moved the sides by a hundredth.
    assert swiss.bounds == pytest.approx((5.96, 45.82, 10.49, 47.81), abs=0.015)
    assert get_region("crs:EPSG:3832").bounds[2] > 180


# ---- combinations ---------------------------------------------------------------------------
A, B = "box:0,0,20,20", "box:10,10,30,30"


def test_areas_of_combinations():
    """Of both, of one only, of either; & goes before - and +, these from left to right; brackets group."""
    both, c = area("box:10,10,20,20"), "box:0,0,5,5"
    less = area(A) - area(c) - both
    areas = {f"{A} & {B}": both, f"{A} - {B}": area(A) - both, f"{A} + {B}": area(A) + area(B) - both}
    areas |= {f"{c} + {A} & {B}": area(c) + both, f"({c} + {A}) & {B}": both}
    areas |= {f"{A} - {c} - {B}": less, f"{A} - ({c} + ({B}))": less}
    assert {text: area(text) for text in areas} == pytest.approx(areas, rel=1e-12)


@pytest.mark.slow
def test_with_globe_and_ocean():
    """Land is the globe less the ocean; nothing is both; a zone across the antimeridian is cut out of the sea."""
    assert area("globe - ocean@110m") == pytest.approx(area("land@110m"), rel=1e-12)
    assert area("globe & land@110m") == pytest.approx(area("land@110m"), rel=1e-12)
    assert refused("land@110m & ocean@110m") == "Invalid region 'land@110m & ocean@110m'. Nothing is left of it."
    sea = get_region("ocean & box:170,-30,-170,-10")
    assert sea.bounds == pytest.approx((170, -30, 190, -10))
    assert 0.95 < sea.area_km2 / Box(170, -30, -170, -10).area_km2 < 1


@each("alone, full", [
    *(("Germany", "country:DE"), ("österreich", "country:AT"), ("new-zealand", "country:NZ")),
    ('"Côte d\'Ivoire"', "country:CI"),
    *(("DE", "country:DE"), ("deu", "country:DE"), ("CA", "country:CA"), ("TX", "state:TX")),
    *(("Delaware", "state:DE"), ("Africa", "continent:Africa"), ("Chile@main", "country:CL@main")),
    *(("Fiji@10m", "country:FJ@10m"), ("(Fiji)@all", "country:FJ@all"), ("Fiji@10m@main", "country:FJ@10m@main")),
    ("New Zealand@110m - cap:170,-45,300", "country:NZ@110m - cap:170,-45,300"),
])  # fmt: skip
def test_places_by_their_names_alone(alone, full):
    """A name or a code of one place needs no kind before it; a code is a country's before a state's."""
    one, other = get_region(alone), get_region(full)
    assert (one.bounds, one.area_km2, is_region_text(alone)) == (other.bounds, other.area_km2, True)


@each(
    ("close", "full"),
    [("DE+FR", "DE + FR"), ("country:DE&EU", "country:DE & EU"), ("AT+CH-LI", "AT + CH - LI")]
    + [(one, one) for one in ("Guinea-Bissau", "country:Guinea-Bissau", "Timor-Leste - cap:126,-9,30")],
)
def test_operators_between_names_need_no_blanks(close, full):
    """But for hyphens of names."""
    assert get_region("area:South-eastern Asia").name == "area:South-eastern Asia"  # though Eastern Asia is one, too
    one, other = get_region(close), get_region(full)
    assert (one.name, one.area_km2, is_region_text(close)) == (other.name, other.area_km2, True)


@each("text, unknown", [("DE+XX", "XX"), ("Germny+FR-CH", "Germny"), ("land & DE-XX", "XX")])
def test_the_unknown_part_is_named(text: str, unknown: str) -> None:
    assert f"Invalid region '{unknown}' in '" in refused(text)


@each("text", ["DE+", "-FR", "a+b.gpkg", "parcels.gpkg", "texas/roads.shp", "./chad", "056", "Georgia", "ahead"])
def test_other_texts_are_no_places(text):
    """Paths, numbers and names of two places begin no region."""
    assert not is_region_text(text)


def test_names_of_combinations():
    region = get_region("  country:CH   -  cap:8,47,50 ")
    assert region.name == "country:CH - cap:8,47,50"
    assert get_region(region.name).area_km2 == pytest.approx(region.area_km2, rel=1e-15)


# ---- refusals -------------------------------------------------------------------------------
@each(("words", "code", "message"), wrong_words("_regions"))
def test_refusals(words, code, message):
    said = refused(words.removeprefix("region "))
    assert says(message, said)
    assert "\n" not in said


# ---- titles ---------------------------------------------------------------------------------------
@each(("text", "title"), [
    *(("country:DE", "Germany (DE)"), ("country:Fiji", "Fiji (FJ)")),
    *(("country:DE + country:AT", "Germany (DE) + Austria (AT)"), ("country:FR@all", "France (FR)")),
    *(("country:NO@main", "Norway (NO), main part"), ("country:Somaliland", "Somaliland")),
    *(("continent:North America", "North America"), ("state:california", "California (CA)")),
    ("state:WA + state:OR", "Washington (WA) + Oregon (OR)"),
    ("box:170,-20,-170,-10", "170°E to 170°W, 20°S to 10°S"),
    *(("cap:2.35,48.85,50", "50 km around 48.85°N, 2.35°E"), ("globe", "globe")),
])  # fmt: skip
def test_titles(text: str, title: str) -> None:
    """Names with their codes, degrees with their hemispheres."""
    assert region_title(get_region(text)) == title


LONGITUDES = {10.0: "10°E", -10.5: "10°30′W", 190.0: "170°W", 180.0: "180°", -180.0: "180°", 0.0: "0°"}
LONGITUDES |= {7 + 5 / 60 + 20 / 3600: "7°05′20″E", 359 + 59.9999 / 60: "0°00′00.01″W"}


def test_longitudes_and_latitudes() -> None:
    """With as many minutes and seconds as there are; decimals where no minutes are asked for."""
    assert [longitude_text(value, minutes=True) for value in LONGITUDES] == [*LONGITUDES.values()]
    assert [latitude_text(value, minutes=True) for value in (0.0, 51.5)] == ["0°", "51°30′N"]
    assert latitude_text(-33.25) == "33.25°S"
