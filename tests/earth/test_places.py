"""The shipped cities: where atlases have them, in their countries, and not closer together than maps can show."""

import numpy as np
import pyproj
import pytest
import shapely
from scipy.spatial import cKDTree
from tables import each

from projdist.earth import cities, data_rows, natural_earth, unit_vectors

# Longitudes and latitudes in degrees and minutes, as encyclopaedias have them.
KNOWN = {
    **{("Paris", "FR"): (2.35, 48.86), ("Wellington", "NZ"): (174.78, -41.29), ("Suva", "FJ"): (178.44, -18.14)},
    **{("Bern", "CH"): (7.45, 46.95), ("Nairobi", "KE"): (36.82, -1.29), ("Quito", "EC"): (-78.52, -0.22)},
    **{("Reykjavík", "IS"): (-21.93, 64.15), ("Tokyo", "JP"): (139.69, 35.69), ("Astana", "KZ"): (71.43, 51.13)},
    **{("Ulaanbaatar", "MN"): (106.92, 47.92), ("Washington", "US"): (-77.04, 38.91), ("Bogotá", "CO"): (-74.08, 4.61)},
    ("Canberra", "AU"): (149.13, -35.28),
}
CITY = 0.08  # degrees: the size of a large city, within which sources put its middle
ROUNDED = 0.16  # km, by which two places change their distance when they are rounded to 0.001 degrees

# Whose codes Natural Earth has under another country or area.
PART_OF = dict.fromkeys(("GF", "GP", "MQ", "RE", "YT"), "FR") | {"SJ": "NO", "BQ": "NL"}
# Western Sahara is drawn without the part that Morocco holds; Natural Earth lacks these islands, Gibraltar and Tuvalu.
MISSING = {"Cockburn Town", "Adamstown", "Gibraltar", "Funafuti", "West Island", "Flying Fish Cove"}
NOT_IN_THEIR_COUNTRY = {"Laayoune", *MISSING}


def country_of(code: str) -> shapely.MultiPolygon | None:
    """The polygons of a two-letter code."""
    keys = {row["iso_a2"]: row["iso_n3"] or row["name"] for row in data_rows("countries.csv")}
    return natural_earth.country(keys.get(PART_OF.get(code, code), ""))


@each("key, place", KNOWN.items())
def test_known_capitals(key: tuple[str, str], place: tuple[float, float]) -> None:
    all_cities = cities()
    (found,) = np.flatnonzero((all_cities.name == key[0]) & (all_cities.country == key[1]) & all_cities.is_capital)
    assert (all_cities.lon[found], all_cities.lat[found]) == pytest.approx(place, abs=CITY)


def test_every_country_has_one_capital_and_cities_stand_apart() -> None:
    """All of countries.csv with a code, but Antarctica and Heard Island; by 12 km in a country, but for capitals."""
    all_cities = cities()
    codes = all_cities.country[all_cities.is_capital]
    assert len(set(codes)) == codes.size
    assert {row["iso_a2"] for row in data_rows("countries.csv")} - set(codes) == {"", "AQ", "HM"}
    points = 6371.0 * unit_vectors(all_cities.lon, all_cities.lat).T
    pairs = cKDTree(points).query_pairs(12.0 - ROUNDED, output_type="ndarray")
    one, other = all_cities.country[pairs].T
    assert (all_cities.is_capital[pairs].any(axis=1) | (one != other)).all()
    assert {"El Paso", "Ciudad Juárez", "Aqaba", "Melilla"} <= set(all_cities.name)


@pytest.mark.slow
def test_cities_lie_in_their_countries() -> None:
    """99 of 100 within 0.3 degrees, as coasts are generalised, and all capitals but for those that are known."""
    all_cities = cities()
    near = np.zeros(all_cities.lon.size, dtype=bool)
    for code in np.unique(all_cities.country):
        area, there = country_of(code), np.flatnonzero(all_cities.country == code)
        if area is not None:
            near[there] = natural_earth.near(area, all_cities.lon[there], all_cities.lat[there], 0.3)
    assert near.mean() > 0.99
    assert {str(name) for name in all_cities.name[all_cities.is_capital & ~near]} == NOT_IN_THEIR_COUNTRY


def test_the_better_known_come_first_and_are_apart() -> None:
    """New Zealand's and Germany's largest, no suburb among the world's."""
    all_cities = cities()
    assert set(all_cities.name[all_cities.country == "NZ"][:3]) == {"Auckland", "Wellington", "Christchurch"}
    assert set(all_cities.name[all_cities.country == "DE"][:4]) == {"Berlin", "Hamburg", "Munich", "Cologne"}
    assert not {"Brooklyn", "Giza", "Zapopan", "Quezon City"} & set(all_cities.name)
    assert "Longyearbyen" in all_cities.name
    # Paris and London are 344 km apart, Sydney and Auckland 2156 (airlines' tables, to 1 %).
    for one, other, km in (("Paris", "London", 344.0), ("Sydney", "Auckland", 2156.0)):
        a, b = (np.flatnonzero(all_cities.name == name)[0] for name in (one, other))
        places = all_cities.lon[a], all_cities.lat[a], all_cities.lon[b], all_cities.lat[b]
        assert pyproj.Geod(ellps="WGS84").inv(*places)[2] / 1e3 == pytest.approx(km, rel=0.01)
