"""Continents within their usual limits, and other areas made of countries."""

import collections

import pytest
from region_texts import refused
from tables import each

from projdist.earth import data_rows
from projdist.regions import definition, get_region

# Longitude and latitude, on both sides of each line.
CITIES = {
    "Europe": "Istanbul-Fatih 28.94 41.02, Perm 56.25 58.01, Ufa 55.97 54.74, Vorkuta 64.0 67.5, Sochi 39.73 43.6, "
    "Grozny 45.69 43.32, Ponta Delgada -25.45 37.78, Reykjavik -21.7 64.1, Longyearbyen 15.6 78.2",
    "Asia": "Istanbul-Kadikoy 29.08 40.98, Yekaterinburg 60.65 56.84, Chelyabinsk 61.4 55.16, Salekhard 66.6 66.53, "
    "Tbilisi 44.8 41.7, Baku 49.7 40.4, Aktau 51.5 43.7, El Arish 33.8 31.0, Nicosia 33.36 35.17, Seram 129.5 -3.1",
    "Africa": "Cairo 31.24 30.04, Hurghada 33.7 27.2, Las Palmas -15.6 27.95, Madeira -17.0 32.75, Reunion 55.5 -21.1",
    "Oceania": "Jayapura 140.5 -3.0, Timika 136.9 -4.4, Hawaii -155.5 19.6, Suva 178.0 -18.0",
    "North America": "Panama -80.5 8.4, Guadeloupe -61.7 16.1, Nuuk -50.5 65.0, Anchorage -149.5 61.5",
    "South America": "Cayenne -52.9 4.5, Medellin -75.6 6.2, Isabela -91.1 -0.5",
    "Antarctica": "Vostok 106.8 -78.5, South Georgia -36.5 -54.45",
}

# km2, and tolerance as a ratio: coasts at 1 : 50 million, and lines of some twenty points.
AREAS = {
    "country:TR & continent:Europe": (23_764, 0.02),  # Eastern Thrace: Britannica, "Turkey"
    "country:EG & continent:Asia": (61_000, 0.05),  # Sinai: Britannica, "Sinai Peninsula"
    "country:FR & continent:South America": (83_534, 0.02),  # INSEE, Guyane
    "European Russia": (3_960_000, 0.01),  # two fifths of Russia's 17,098,246: Britannica, "Europe"
    "DACH": (357_592 + 83_879 + 41_285, 0.01),  # the states' own figures
    "Benelux": (30_689 + 2_586 + 37_400, 0.03),  # with inland waters, without the Wadden Sea
}

LEAVES = (  # the subregions of M49, which has Antarctica in none; South America is the continent
    "Northern Africa, Eastern Africa, Middle Africa, Southern Africa, Western Africa, Caribbean, Central America, "
    "Northern America, Central Asia, Eastern Asia, South-eastern Asia, Southern Asia, Western Asia, Eastern Europe, "
    "Northern Europe, Southern Europe, Western Europe, Australia and New Zealand, Melanesia, Micronesia (region), "
    "Polynesia"
)


@pytest.mark.slow
def test_places_are_in_their_continent() -> None:
    """And in no other."""
    for name, cities in CITIES.items():
        for city in cities.split(", "):
            lon, lat = map(float, city.split()[-2:])
            found = [one for one in CITIES if get_region(f"continent:{one}").contains(lon, lat)]
            assert found == [name], city


@pytest.mark.parametrize(("region", "published"), AREAS.items())
def test_areas_are_the_published_ones(region: str, published: tuple[float, float]) -> None:
    """Of the parts that the lines cut off, and of unions of countries."""
    area, tolerance = published
    assert get_region(region).area_km2 == pytest.approx(area, rel=tolerance)


def test_a_country_is_in_one_subregion() -> None:
    """All codes of ISO 3166 in the data, once; parts of France, Spain, Norway and so on follow their country or M49."""
    rows = {row["name"]: row for row in data_rows("areas.csv")}
    named = collections.Counter(code for leaf in LEAVES.split(", ") for code in rows[leaf]["whole"].split())
    named.update("AR BO BR CL CO EC FK GY PY PE GS SR UY VE".split())
    parts = {"FR", "NL", "NO"}  # with parts in two
    assert {code for code, count in named.items() if count > 1} == set()
    known = {row["iso_a2"] for row in data_rows("countries.csv")} - {""}
    assert known - set(named) == {"AQ", *parts}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["European Economic Area", "British Isles", "Iberia", "Contiguous US", "lower 48", "MENA"]
)
def test_what_is_printed_is_what_is_measured(name: str) -> None:
    """The text of a definition, read as a region, has the area."""
    region = get_region(name)
    assert get_region(definition(region.name)["definition"]).area_km2 == pytest.approx(region.area_km2, rel=1e-12)


def test_details_leave_out_what_they_do_not_have() -> None:
    """At 1 : 110 million there are no Canaries; the area is that to a part in a hundred."""
    coarse, fine = (get_region(f"continent:Africa{detail}") for detail in ("@110m", ""))
    assert coarse.area_km2 == pytest.approx(fine.area_km2, rel=0.01)
    assert coarse.name == "continent:Africa@110m"


def test_polygons_of_the_command_line() -> None:
    """An eighth of the globe, also as a polygon; the text is its name."""
    octant = get_region("polygon:0,0,90,0,90,90,0,90")
    assert octant.area_km2 == pytest.approx(get_region("globe").area_km2 / 8, rel=1e-12)
    assert octant.name == "polygon:0,0,90,0,90,90,0,90"


WRONG = {
    "polygon:0,0,1,1,2": "It must be polygon:LON,LAT,LON,LAT,LON,LAT or more, 6 numbers.",
    "polygon:0,0,1,1,2,2": "Its polygons have no area.",
    "polygon:0,0,10,95,10,0": "latitudes within -90 and 90",
    "area:Iberiia": "Did you mean Iberian Peninsula? It must be one of ASEAN, Andean Community, Arabian Peninsula, ",
    "area:Europe": "Did you mean continent:Europe?",
}


@each("text", WRONG)
def test_wrong_texts(text: str) -> None:
    assert WRONG[text] in refused(text)
