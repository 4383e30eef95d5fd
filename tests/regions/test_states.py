"""The states of the USA: against areas that the Census Bureau published, laws, EPSG's extents and Natural Earth."""

import itertools

import pyproj
import pytest
import shapely

from projdist.earth import data_rows
from projdist.regions import Polygons, get_region

# km2: land and all waters. US Census Bureau, "State Area Measurements and Internal Point Coordinates", 2010,
# https://www.census.gov/geographies/reference-files/2010/geo/state-area.html
TOTAL = {
    "AL": 135_767, "AK": 1_723_337, "AZ": 295_234, "AR": 137_732, "CA": 423_967, "CO": 269_601, "CT": 14_357,
    "DE": 6_446, "FL": 170_312, "GA": 153_910, "HI": 28_313, "ID": 216_443, "IL": 149_995, "IN": 94_326, "IA": 145_746,
    "KS": 213_100, "KY": 104_656, "LA": 135_659, "ME": 91_633, "MD": 32_131, "MA": 27_336, "MI": 250_487,
    "MN": 225_163, "MS": 125_438, "MO": 180_540, "MT": 380_831, "NE": 200_330, "NV": 286_380, "NH": 24_214,
    "NJ": 22_591, "NM": 314_917, "NY": 141_297, "NC": 139_391, "ND": 183_108, "OH": 116_098, "OK": 181_037,
    "OR": 254_799, "PA": 119_280, "RI": 4_001, "SC": 82_933, "SD": 199_729, "TN": 109_153, "TX": 695_662,
    "UT": 219_882, "VT": 24_906, "VA": 110_787, "WA": 184_661, "WV": 62_756, "WI": 169_635, "WY": 253_335,
}  # fmt: skip
# Without sea and Great Lakes all of it is within the outlines.
INLAND = "AZ AR CO ID IA KS KY MO MT NE NV NM ND OK SD TN UT VT WV WY".split()
# The same table: land and inland water, which is what ends at a shore; and of the fifty states and the capital.
ASHORE = {"AL": 131_171 + 2_740, "AK": 1_477_953 + 49_997, "CA": 403_466 + 7_339, "CT": 12_542 + 443}
ALL_ASHORE = 9_147_593 + 221_824
CONTIGUOUS = [code for code in [*TOTAL, "DC"] if code not in ("AK", "HI")]

# A border of n corners L km apart that are off by e km to either side changes an area by e L sqrt(n): West Virginia
# has 230 of 9 km, off by 0.3 km, a step of longitudes in the file: 41 km2 or 0.07 %; twice to three times that.
INLAND_TOLERANCE = 0.002
# Bays that the table has as the sea's, or the outlines as the land's, are some hundredths of coastal states.
SHORE_TOLERANCE = 0.005


def state(code: str) -> Polygons:
    return get_region(f"state:{code}")


def test_areas_of_states() -> None:
    """Land and water, of coasts without the sea, are what was published; none is larger than with all its waters."""
    areas = {code: state(code).area_km2 for code in [*TOTAL, "DC"]}
    inland, ashore = ({code: areas[code] for code in some} for some in (INLAND, ASHORE))
    assert inland == pytest.approx({code: TOTAL[code] for code in INLAND}, rel=INLAND_TOLERANCE)
    assert ashore == pytest.approx(ASHORE, rel=SHORE_TOLERANCE)
    assert sum(areas.values()) == pytest.approx(ALL_ASHORE, rel=SHORE_TOLERANCE)
    assert [code for code in TOTAL if areas[code] > TOTAL[code] * (1.0 + INLAND_TOLERANCE)] == []


def test_states_fit_together() -> None:
    """Those that touch share their borders: no two overlap, and there is no gap at Four Corners."""
    shapes = {code: state(code).geometry for code in CONTIGUOUS}
    for one, other in itertools.combinations(CONTIGUOUS, 2):
        assert shapely.intersection(shapes[one], shapes[other]).area == 0.0, (one, other)
    four = [shapes[code] for code in "AZ CO NM UT".split()]
    (corner,) = set.intersection(*(set(map(tuple, shapely.get_coordinates(shape))) for shape in four))
    assert corner == pytest.approx((-109.045, 36.999), abs=0.002)  # the monument; half a step of the file is 0.0018
    together = shapely.union_all(four)
    assert (together.geom_type, len(together.interiors)) == ("Polygon", 0)


# W, S, E, N. Acts of 1861 and 1868 for Colorado, Wyoming and Utah; meridians are 25, 27, 32, 34 and 37 degrees west of
# Washington's old observatory, which is 77 degrees 3 minutes 2 seconds from Greenwich's.
WASHINGTON = -(77.0 + 3.0 / 60.0 + 2.3 / 3600.0)
LAWFUL = {
    "WY": (WASHINGTON - 34, 41, WASHINGTON - 27, 45),
    "CO": (WASHINGTON - 32, 37, WASHINGTON - 25, 41),
    "UT": (WASHINGTON - 37, 37, WASHINGTON - 32, 42),
}
# What holds are the lines as surveyors marked them, up to 0.9 km off: EPSG's registry has Colorado from 109.06 W.
SURVEYED = 0.0105  # degrees


# CRSs whose area of use is one state, as EPSG's registry has it.
STATEWIDE = {
    "AK": 3338, "CA": 3310, "CT": 26956, "DE": 26957, "ID": 8826, "MD": 26985, "MT": 32100, "NC": 32119, "NE": 32104,
    "NH": 32110, "NJ": 32111, "OR": 2992, "RI": 32130, "SC": 32133, "TN": 32136, "TX": 3083, "VT": 32145,
}  # fmt: skip
EXTENT = 0.1  # degrees: there are waters to three nautical miles, 0.06, in some of them, and they are rounded


def test_bounds() -> None:
    """Three states are boxes of law; all lie where CRSs of theirs are for; Alaska runs on over the antimeridian."""
    for code, bounds in LAWFUL.items():
        assert state(code).bounds == pytest.approx(bounds, abs=SURVEYED), code
    for code, crs in STATEWIDE.items():
        west, south, east, north = pyproj.CRS(crs).area_of_use.bounds
        assert state(code).bounds == pytest.approx((west, south, east + 360 * (east < west), north), abs=EXTENT), code


def test_alaska_is_cut() -> None:
    """Its parts lie within -180 to 180, islands on both sides in it, and all of it hangs together."""
    alaska = state("AK")
    west, _, east, _ = alaska.geometry.bounds
    assert -180.0 <= west < -179.0 < 179.0 < east <= 180.0
    # Attu, Semisopochnoi, Adak and Fairbanks, but not Whitehorse.
    places = [172.9, 179.6, -176.65, -147.7, -135.1], [52.9, 51.95, 51.85, 64.8, 60.7]
    assert alaska.contains(*places).tolist() == [True, True, True, True, False]
    assert alaska.far == ""
    assert get_region("state:AK@main") is alaska
    assert get_region("state:AK@main:60").area_km2 < 0.999 * alaska.area_km2


def test_every_state_can_be_named() -> None:
    """Fifty states, the capital and five territories, each by its name and codes."""
    assert {row["postal"] for row in data_rows("states.csv")} == {*TOTAL, "DC", "AS", "GU", "MP", "PR", "VI"}
    for row in data_rows("states.csv"):
        for key in ("name", "postal", "fips"):
            assert get_region(f"state:{row[key]}").name == f"state:{row['postal']}"
