"""Whose areas of use are, and whose land a region is."""

from tables import each

from projdist.decisions.candidate_crs import _NOBODYS_KM2, home_of, named
from projdist.decisions.measurement import lattice_of
from projdist.regions import get_region

NAMED = [
    (["Kenya - onshore"], {"Kenya"}),
    (["USA - New Mexico - SPCS - E"], {"United States of America"}),
    (["World - N hemisphere - 36°E to 42°E - by country", "Between 36°E and 42°E. Kenya. Somalia."], set()),
    (["Europe - Czechoslovakia", "Czechia; Slovakia."], {"Czechia", "Slovakia"}),
    (["Africa - Kenya and Tanzania - south of equator and east of 36°E"], {"Kenya", "Tanzania"}),
    (
        ["Europe between 6°E and 12°E: Austria; Denmark - onshore and offshore; Spain - offshore."],
        {"Austria", "Denmark"},
    ),
    (["Papua New Guinea - west of 144°E"], {"Papua New Guinea"}),
    (["Korea, Republic of (South Korea)"], {"South Korea"}),
    (
        ["USA - CONUS", "United States (USA) - CONUS - Alabama; Delaware; Georgia; New Jersey; New Mexico; Ohio."],
        {"United States of America"},
    ),
    (["China - Hong Kong - onshore and offshore."], {"China", "Hong Kong"}),
    (["Mexico - New Mexico border"], {"Mexico"}),
    (["Reunion - onshore and offshore - west of 54°E."], {"France"}),
    (["Georgia - onshore and offshore."], {"Georgia"}),
    (["North America - Equi7", "North America including Greenland, the Caribbean and Central America."], set()),
    (["Norway including Svalbard - onshore and offshore."], {"Norway"}),
    (["Nigeria - offshore deep water - west of 6°E"], set()),
    ([], set()),
]


@each(("extents", "countries"), NAMED)
def test_named(extents, countries):
    """Countries by whole words, on land, the first of a name that goes on; nobody by what is for the world."""
    assert named(extents) == countries


@each(
    ("region", "home"),
    [
        ("country:KE", "Kenya"),
        ("box:5.9,47.3,15.0,55.1", "Germany"),
        ("box:177,-20,-178,-15", "Fiji"),  # most of it is sea
        ("country:AQ", ""),  # by treaty
        ("country:SG", "Singapore"),  # which a coarse outline of Malaysia covers
        ("country:LI", "Liechtenstein"),
        ("country:AF", "Afghanistan"),  # for which alone no CRS is made
        ("state:OH", "United States of America"),
        ("box:2,54,4,56", ""),  # the North Sea
        ("box:-180,-90,180,90", ""),
    ],
)
def test_home(region, home):
    """The country that has most of a region's land; none at sea, and none that has half of the world."""
    lattice = lattice_of(get_region(region))
    assert home_of(lattice) == home


def test_the_world_is_nobodys():
    """A region above 450 million km2 is not looked into: no country has half of what it must hold."""
    area = {name: get_region(name).area_km2 for name in ("globe", "land", "country:RU", "country:AQ")}
    land = area["land"] - area["country:AQ"] - (area["globe"] - _NOBODYS_KM2)
    assert area["country:RU"] < 0.5 * land
