"""The database of CRSs: search by words, facts of the registry, and CRSs that draw the same map."""

import csv
import re
from pathlib import Path

import numpy as np
import pyproj
import pytest
from refusals import refuses
from tables import each, some

from projdist.earth import data_rows
from projdist.projections import Projection, ProjectionError, catalogue, codes_of_same_map, database, find_crs
from projdist.projections.crs_search import year_of
from projdist.projections.database import facts_of


def rows(text: str) -> list[list[str]]:
    return [pair.strip().split("=") for pair in text.split(";")]


# What a person means who types this: the CRS that the agency of the country, or EPSG, calls so.
MEANT = """EPSG:3035=3035; EPSG:3035=EPSG:3035; EPSG:3035=epsg 3035; IGNF:LAMB93=ignf:lamb93; ESRI:54030=54030;
ESRI:54030=world_robinson; IAU_2015:49910=IAU_2015:49910; EPSG:32633=utm 33; EPSG:32633=utm33n; EPSG:32733=UTM zone 33S;
EPSG:25832=etrs89 utm 32; EPSG:25833=33n utm etrs89; EPSG:2154=lambert 93; EPSG:2154=Lambert-93; EPSG:2154=france;
EPSG:27700=british national grid; EPSG:2056=lv95; EPSG:28992=RD; EPSG:2193=new zealand transverse; robinson=robinson;
EPSG:2975=réunion UTM 40; winkel-tripel=winkel tripel; winkel-tripel=wintri; EPSG:3416=austrian; EPSG:27700=uk"""
MORE = """EPSG:27700=british; EPSG:25832=danish; EPSG:28992=dutch; EPSG:2326=hong kong; EPSG:28992=amersfoort rd new;
EPSG:32139=NAD83 / Texas Central; EPSG:2229=california zone 5 ftus; EPSG:3857=pseudo-mercator wgs;
EPSG:3995=arctic polar stereographic; EPSG:2975=reunion utm 40"""


@each("code, text", [*rows(MEANT), *(pytest.param(*row, marks=pytest.mark.slow) for row in rows(MORE))])
def test_what_is_meant_comes_first(code: str, text: str) -> None:
    assert find_crs(text, limit=1).results[0].code == code


OFFICIAL: dict[str, set[str]] = {}  # codes by country, whose agency the table names
for system in csv.DictReader((Path(__file__).parents[1] / "data/national_systems.csv").read_text("utf-8").splitlines()):
    OFFICIAL.setdefault(system["iso"], set()).update(system["codes"].split())
LATER = {  # how many come before, where the agency's is not first
    "AU": 2,  # Geoscience Australia's Lambert, of the whole country
    "NO": 1,  # EPSG v12's ETRS89-NOR, which is the same
    "BR": 2,  # IBGE's polyconic, of the whole country
    "CZ": 4,  # on S-JTSK/05, the newer datum, which is not yet in force
    "HR": 1,  # Lambert's map of the same scope, which has the sea, too
    "IL": 2,  # Israeli Grid 05 and 05/12, on newer datums
    "IT": 2,  # the same zones on ETRS89
    "TR": 2,  # a conic of the whole country, and the Gauss-Kruger zone of the same meridian
}


@pytest.mark.slow
@each("iso", some(OFFICIAL, 2))
def test_the_first_of_a_country_is_its_agencys(iso: str) -> None:
    (name,) = (row["name"] for row in data_rows("countries.csv") if row["iso_a2"] == iso)
    places = [k for k, hit in enumerate(find_crs(name, limit=10).results) if hit.code in OFFICIAL[iso]]
    assert places
    assert places[0] <= LATER.get(iso, 0)


def test_other_words_of_a_crs() -> None:
    """Methods and countries of the area of use count, too, and authorities, where they are named."""
    assert "EPSG:3035" in [hit.code for hit in find_crs("lambert azimuthal equal area europe", limit=20).results]
    assert "EPSG:25832" in [hit.code for hit in find_crs("austria utm").results]
    assert {hit.code[:5] for hit in find_crs("lambert 93", authorities="ignf", limit=50).results} == {"IGNF:"}
    said = r"Invalid authority 'EPGS'. Did you mean EPSG\? It must be EPSG, ESRI, "
    refuses(said, find_crs, "utm", authorities=["EPGS"])
    for text in ("", "  ", "!?", "---"):
        refuses("It must have a word or a number", find_crs, text)


def test_results() -> None:
    """Each of the words is in what is found, so many as are asked for, and the total is told."""
    found = find_crs("utm 33", limit=3)
    assert len(found.results) == 3 < found.total
    assert len(find_crs("utm 33", limit=1000).results) == found.total
    first = found.results[0]
    assert (first.name, first.area_of_use) == ("WGS 84 / UTM zone 33N", (12.0, 0.0, 18.0, 84.0))
    assert (first.deprecated, found.rows()[0]["east"]) == (False, 18.0)
    assert repr(found).startswith("CrsSearch(3 of ")
    assert all("33" in hit.name for hit in found.results)


def test_deprecated_ones() -> None:
    """By their code, or where they are asked for."""
    assert find_crs("2036").results[0].deprecated
    assert not any(hit.deprecated for hit in find_crs("new brunswick stereo", limit=50).results)
    asked = find_crs("new brunswick stereo", limit=50, deprecated=True).results
    assert "EPSG:2036" in [hit.code for hit in asked if hit.deprecated]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "advice"),
    {
        "amersfort": "Did you mean 'amersfoort'?",
        "utm zonne 33": "Did you mean 'utm zone 33'?",
        "moliweide": "Did you mean 'mollweide'?",
        "4326": "EPSG:4326 is a geographic CRS (WGS 84), and no map.",
        "WGS 84 world mercator grid amersfoort": "No one has all of these words: take fewer of them.",
        "xqzzyx": "No name and no area of use has 'xqzzyx'.",
        "999999": "No name and no area of use has '999999'.",
        "Qornoq 1927 Greenland zone 3 east": "Deprecated ones have these words: ask for them, too.",
    }.items(),
)
def test_nothing_is_found(text: str, advice: str) -> None:
    """What may have been meant is told."""
    found = find_crs(text)
    assert (found.total, found.results, found.advice) == (0, (), advice)


@each(("code", "since", "special"), [
    ("EPSG:7855", {2017}, False),  # GDA2020
    ("EPSG:2056", {1995}, False),  # CH1903+
    ("EPSG:25832", {1989, 1990}, False),  # ETRS89, an ensemble: ETRF89, of 1990 in EPSG v11.022, of 1989 in v12.029
    ("EPSG:32632", {1984}, True),  # WGS 84, an ensemble: Transit; for navigation
    ("EPSG:28992", {0}, False),  # Amersfoort: EPSG tells no date
    *(("ESRI:102173", None, True), ("EPSG:5682", None, True)),  # of no stated scope, for railways
])  # fmt: skip
def test_years_of_datums_and_scopes(code, since, special):
    """The year of publication, of an ensemble that of its first member; surveys and maps are for all."""
    facts = facts_of([code])[code]
    assert since is None or facts.since in since
    assert facts.special == special


@each("date, year", [("1995-03-07", 1995), ("2011", 2011), ("March 2011", 2011), ("unknown", 0), ("", 0), (None, 0)])
def test_years_of_dates(date, year):
    """As EPSG writes them; v12 has Uganda's datum of March 2011."""
    assert year_of(date) == year


def test_maps_but_for_false_origins():
    """Hemispheres of a zone are one map, and so are zone numbers in eastings; other meridians or scales are not."""
    codes = [f"EPSG:{number}" for number in (32637, 32737, 21037, 4491, 4502, 32636, 27572, 2154)]
    drawn = [facts_of(codes)[code].draws for code in codes]
    assert (len({*drawn[:3]}), len({*drawn[3:5]}), len({*drawn})) == (1, 1, 5)


def test_many_codes_and_none(monkeypatch, tmp_path) -> None:
    """More codes than a query takes; those that are none are left out, and all where PROJ's database is no file."""
    found = facts_of([f"EPSG:{code}" for code in range(31900, 33000)])
    assert {"EPSG:31978", "EPSG:32632", "EPSG:32760"} <= set(found)
    assert facts_of(["EPSG:1", "nothing"]) == codes_of_same_map("nothing:1") == {}
    assert codes_of_same_map("EPSG:27700") == {}  # which it does not have in columns
    monkeypatch.setattr(catalogue, "get_data_dir", lambda: str(tmp_path))
    assert codes_of_same_map("EPSG:2154") == facts_of(["EPSG:2056"]) == {}


GRID = np.meshgrid(np.linspace(-1.0, 1.0, 5), np.linspace(-1.0, 1.0, 5))


def coordinates(code: str, lon, lat):
    """Metres east and north in a CRS of points on its own datum, less the first point's."""
    crs = pyproj.CRS(code)
    forward = pyproj.Transformer.from_crs(crs.geodetic_crs.to_2d(), crs, always_xy=True)
    turn = pyproj.CRS(code).prime_meridian.longitude * crs.prime_meridian.unit_conversion_factor
    unit = crs.geodetic_crs.axis_info[0].unit_conversion_factor
    xy = np.array(forward.transform((np.radians(lon) - turn) / unit, np.radians(lat) / unit))
    return (xy - xy[:, :1]) * crs.axis_info[0].unit_conversion_factor


@pytest.mark.slow
@each(("code", "place", "some"), [
    ("EPSG:2154", (3, 46), {"EPSG:9793", "EPSG:9794"}),
    ("EPSG:3035", (10, 52), {"EPSG:5636", "IGNF:ETRS89LAEA"}),
    ("EPSG:32633", (15, 50), {"EPSG:32733", "EPSG:25833", "EPSG:3006", "EPSG:3045"}),
    ("EPSG:27572", (2, 46), {"EPSG:27562"}),
    ("EPSG:2056", (8, 47), {"EPSG:21781"}),
])  # fmt: skip
def test_they_differ_by_a_shift(code: str, place: tuple[float, float], some: set[str]) -> None:
    """Those known to be the same are among them; none is deprecated, of another ellipsoid or of another meridian."""
    found = codes_of_same_map(code)
    assert some <= set(found)
    assert not {code, "EPSG:23033", "EPSG:32632", "EPSG:32233"} & set(found)
    lon, lat = (centre + part.ravel() for centre, part in zip(place, GRID, strict=True))
    own = coordinates(code, lon, lat)
    for other in found:
        assert not pyproj.CRS(other).is_deprecated
        assert np.abs(coordinates(other, lon, lat) - own).max() < 2e-5, other  # WGS 84 and GRS 80 differ so much


@each(("value", "degrees"), [(52.3, 52.5), (-2.2033, -2.3425), (22.18432, 22.312)])
def test_sexagesimal_degrees(value: float, degrees: float) -> None:
    """DDD.MMSSsss, as EPSG has it under 9110."""
    assert database._value(value, 9110, {9102: 1.0}) == pytest.approx(degrees, abs=1e-12)


@pytest.mark.slow
def test_a_country_and_its_people_are_searched_by_areas_of_use() -> None:
    """Those of the country alone come first, then those that it shares; then a county of its name elsewhere."""
    swiss, named = ([hit.code for hit in find_crs(text, limit=200).results] for text in ("swiss", "Switzerland"))
    assert swiss[:3] == named[:3] == ["EPSG:2056", "EPSG:21781", "EPSG:21780"]
    assert "EPSG:3035" in swiss
    assert [hit.code for hit in find_crs("schweiz", limit=3).results] == named[:3]
    assert find_crs("norge").results[0].code == "EPSG:25832"  # as kartverket.no says for its south
    assert named.index("EPSG:3035") < named.index("EPSG:7285")  # of Switzerland County in Indiana
    assert find_crs("nor").total > find_crs("norway").total  # a beginning of words, and no code of a country
    assert not any("Canada" in hit.area_name for hit in find_crs("british", limit=20).results)  # British Columbia


def test_whole_words_make_beginnings_in_lists_needless() -> None:
    """Georgia West has Webster County in its area of use, and a transverse Mercator map."""
    assert [hit.code for hit in find_crs("web mercator").results][:2] == ["webmerc", "EPSG:3857"]
    assert not [hit for hit in find_crs("web mercator", limit=1000).results if "Georgia" in hit.name]


def test_names_of_people_are_of_countries_that_there_are() -> None:
    countries = {row["name"] for row in data_rows("countries.csv")}
    assert {row["country"] for row in data_rows("demonyms.csv")} <= countries


@pytest.mark.slow
def test_world_maps_are_what_proj_reads_by_their_codes() -> None:
    """ESRI's texts with PROJ's names of WGS 84: the same operation, name, method, parameters, datum and area of use."""
    checked = 0
    for code in database._world_maps():
        try:
            truth = Projection.from_user_input(code)
        except ProjectionError as error:
            refuses(re.escape(str(error)), database.load_crs, code)
            continue
        found, crs = database.load_crs(code), pyproj.CRS(code)
        assert found.projection.function.definition == truth.function.definition, code
        same = ("name", "ellipsoid", "area_of_use")
        assert found.projection.definition == code
        assert [getattr(found.projection, key) for key in same] == [getattr(truth, key) for key in same], code
        values = {parameter.name: parameter.value for parameter in crs.coordinate_operation.params}
        assert found.conversion[0] == crs.coordinate_operation.method_name, code
        assert {name for name, _ in found.conversion[1]} <= set(values), code
        upright = {axis.direction for axis in crs.axis_info} == {"east", "north"}
        assert (found.datum, found.is_upright) == (crs.geodetic_crs.name, upright), code
        checked += 1
    assert checked > 60
