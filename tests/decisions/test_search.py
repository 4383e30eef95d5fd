"""Recommendations: known answers, the order of brute force, what is grouped and what is refused."""

import dataclasses
import json
import re
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
from pyproj import Proj
from refusals import refuses
from tables import each, some

import projdist
from projdist import recommend
from projdist.decisions.ranking import CLOSE, WIDE_FACTOR
from projdist.projections import ProjectionError, catalogue, database as crs_database
from projdist.regions import get_region

pytestmark = pytest.mark.slow

GERMANY = "box:5.9,47.3,15.0,55.1"
ISLAND = "box:-7.2,61.3,-6.2,62.5"  # the Faroe Islands: few candidates


@pytest.fixture(scope="module")
def germany():
    return recommend(GERMANY, criterion="max_scale_error_ppm", authorities=["EPSG"], limit=8)


def code_of(result, code):
    """The candidate that is a code, or draws the same map."""
    return next(one for one in result.results if code in one.codes)


def test_germany(germany):
    """EPSG:3035 has less error than both UTM zones and the national conics, and not half of it: these come first."""
    europe, first = code_of(germany, "EPSG:3035"), germany.results[0]
    assert (europe.wide, europe.ranked) == (True, WIDE_FACTOR * europe.value)
    assert (germany.country, first.national) == ("Germany", True)
    # Without custom projections there is nothing to compare with.
    assert (germany.custom, germany.not_custom) == ((), ())
    assert (first.ratio_to_custom, first.difference_to_custom) == (None, None)
    for code in ("EPSG:25832", "EPSG:25833", "EPSG:4839", "EPSG:5243"):
        own = code_of(germany, code)
        assert own.national
        assert own.ranked == pytest.approx(own.value / own.share)
        assert own.value > europe.value
        before = germany.results.index(own) < germany.results.index(europe)
        assert before == (own.ranked < (1 + CLOSE) * europe.ranked)


@each("code", ["EPSG:3035", "EPSG:25832", "EPSG:4839"])
def test_figures_against_pyproj(germany, code):
    """Largest and mean |scale - 1| and areal range agree with PROJ's own factors on a fine grid with its edges."""
    lon, lat = np.meshgrid(np.linspace(5.9, 15.0, 183), np.linspace(47.3, 55.1, 157))
    found = Proj(code).get_factors(lon, lat)
    ppm = 1e6 * np.maximum(np.abs(found.tissot_semimajor - 1), np.abs(found.tissot_semiminor - 1))
    one = code_of(germany, code).distortion
    assert one.max_scale_error_ppm == pytest.approx(ppm.max(), abs=0.1)
    middle, weight = (
        0.25 * (x[1:, 1:] + x[1:, :-1] + x[:-1, 1:] + x[:-1, :-1]) for x in (ppm, np.cos(np.radians(lat)))
    )
    assert one.mean_scale_error_ppm == pytest.approx(np.average(middle, weights=weight), rel=3e-3)
    assert one.min_areal_scale == pytest.approx(found.areal_scale.min(), abs=1e-6)
    assert one.max_areal_scale == pytest.approx(found.areal_scale.max(), abs=1e-6)


def test_what_is_grouped_and_what_is_rejected(germany):
    """UTM zone 32N is one map, whose CRSs on other datums are all named; what is no candidate is listed with why."""
    # Only CRSs of the authorities asked for are there. Zone 2 ends at 7.5 E, with 9.8 % of the box.
    assert {"EPSG:25832", "EPSG:32632", "EPSG:23032", "EPSG:32232"} <= {*code_of(germany, "EPSG:25832").codes}
    codes = [code for result in germany.results for code in result.codes]
    assert len(set(codes)) == len(codes)
    reasons = {one.code: one.reason for one in germany.rejected}
    assert {code.partition(":")[0] for code in (*codes, *reasons)} == {"EPSG"}
    held = re.fullmatch(r"Its area of use holds (\S+) % of the region\.", reasons["EPSG:31466"])
    assert float(held[1]) == pytest.approx(9.8, abs=1.0)  # by a thousand nodes
    assert "the method 'Transverse Mercator Zoned Grid System'" in reasons["EPSG:32600"]


def reasons_of_proj(codes):
    """What PROJ's own reading of each CRS has against it."""
    reasons = {}
    for code in codes:
        try:
            crs_database.load_crs(code)
        except ProjectionError as error:
            reasons[code] = str(error)
    return reasons


def test_reasons_against(monkeypatch, tmp_path):
    """Spheres and other bodies are told from the database's texts as PROJ would; where it is no file, by PROJ alone."""
    # Web Mercator is left to PROJ, which takes this text of it for a sphere since 9.8, and did not before.
    codes = ["ESRI:53012", "ESRI:103880", "ESRI:54012", "ESRI:102113", "EPSG:3035"]
    found = crs_database.reasons_against(codes)
    assert list(found) == codes[:2]
    assert found == reasons_of_proj(set(codes) - {"ESRI:102113"})
    monkeypatch.setattr(catalogue, "get_data_dir", lambda: str(tmp_path))
    crs_database._spheroids.cache_clear()
    assert crs_database.reasons_against(["ESRI:53012"]) == {}
    crs_database._spheroids.cache_clear()


def test_all_reasons_against():
    """No CRS is refused by its text that PROJ would not refuse, for the same reason."""
    records = crs_database.crs_records(["EPSG", "ESRI", "IGNF"], deprecated=True)
    found = crs_database.reasons_against(record.code for record in records)
    assert len(found) > 40
    assert found == reasons_of_proj(found)


def test_preference_for_areas_that_hold_the_region():
    """UTM zone 32N, whose area ends at 12 E, counts over the share that it holds, is left out, or counts in full."""
    for area in ("preferred", "intersects"):
        result = recommend(GERMANY, area=area, authorities=["EPSG"], limit=8)
        utm, conic = code_of(result, "EPSG:25832"), code_of(result, "EPSG:4839")
        assert utm.value < conic.value < utm.value / utm.share
        assert (result.results.index(utm) < result.results.index(conic)) == (area == "intersects")
    # Nothing but figures counts when areas of use do not.
    values = [one.value for one in result.results]
    assert [one.ranked for one in result.results] == values == sorted(values)
    results = recommend(GERMANY, area="contains", authorities=["EPSG"], limit=20).results
    assert all(one.share >= 0.99 and "EPSG:25832" not in one.codes for one in results)


@pytest.mark.parametrize("purpose", ["equal-area", "conformal", "equidistant", "compromise"])
def test_purpose(purpose):
    """All that is recommended for a purpose keeps what it asks for, in its figures; equal-area maps have no zones."""
    result = recommend(ISLAND, purpose=purpose, authorities=["EPSG"], limit=3)
    for one in result.results:
        areal = one.distortion.max_areal_scale / one.distortion.min_areal_scale - 1
        kept = {"equal-area": areal < 1e-7, "conformal": one.distortion.max_omega < 1e-5}
        kept |= {"equidistant": "equidistant" in one.keeps, "compromise": not any(kept.values())}
        assert kept[purpose]
    assert purpose != "equal-area" or result.zones == ()


def test_datum():
    """By a part of its name in any spelling."""
    results = recommend(GERMANY, datum="etrs-89", authorities=["EPSG"], limit=5).results
    assert {one.datum for one in results} <= {"ETRS89", "ETRS89-extended"}


@each(("options", "message"), [
    ({"criterion": "airy_"}, r"^Invalid criterion 'airy_'. Did you mean airy_kavrayskiy, .*\? It must be"),
    ({"purpose": "best"}, r"^Invalid purpose 'best'. It must be any, equal-area, conformal, equidistant or comp"),
    ({"authorities": ["IAU_2015"]}, r"^Invalid authority 'IAU_2015'. It must be EPSG, ESRI or IGNF.$"),
    ({"authorities": ["ESPG"]}, r"^Invalid authority 'ESPG'. Did you mean EPSG\? It must be"),
    ({"area": "inside"}, r"^Invalid area 'inside'. It must be preferred, contains or intersects.$"),
    ({"executor": "serial"}, r"^Invalid executor 'serial'. It must be dask://HOST:PORT"),
    ({"executor": 5}, r"^Invalid executor '5'. It must be .* or an executor of concurrent.futures.$"),
    ({"datum": 5}, r"^Invalid datum '5'. It must be text.$"),
    ({"limit": 0}, r"^Invalid limit '0'. It must be at least 1.$"),
    ({"datum": "ETSR89"}, r"^Invalid datum 'ETSR89'. Did you mean ETRS89.*\? It must be a part"),
])  # fmt: skip
def test_wrong_options(options, message):
    refuses(message, recommend, ISLAND, **options)


def test_forms(germany):
    pytest.importorskip("pandas")
    data = json.loads(germany.to_json())
    assert data == json.loads(json.dumps(germany.to_dict(), allow_nan=False))
    assert (data["region"]["name"], data["country"]) == ("box:5.9,47.3,15,55.1", "Germany")
    first = data["results"][0]
    assert first["code"] == germany.results[0].code
    for name, value in dataclasses.asdict(germany.results[0]).items():
        if name in first and isinstance(value, (bool, int, float, str)):
            assert first[name] == value
    frame = germany.to_frame()
    assert list(frame["code"]) == [one.code for one in germany.results]
    assert list(frame["value"]) == list(frame["max_scale_error_ppm"])


def test_progress_and_an_executor():
    """The listener hears rising numbers that end at the total; processes give what this one gives."""
    heard = []
    plain = recommend(ISLAND, authorities=["EPSG"], limit=3, progress=lambda *numbers: heard.append(numbers))
    assert [done for done, _ in heard] == sorted(done for done, _ in heard)
    assert heard[-1][0] == heard[-1][1]
    with ProcessPoolExecutor(2) as pool:
        spread = recommend(ISLAND, authorities=["EPSG"], limit=3, executor=pool)
    assert spread.to_dict() == plain.to_dict()


# The Alps, concave, with a hole; GeoJSON.
ALPS = [[5.5, 43.8], [8, 44.2], [8.2, 45.6], [12, 45.8], [14.5, 46.2], [16, 47.7], [10, 47.5], [6.5, 46.5], [5.5, 43.8]]
AROUND_POLE = "box:-180,-90,180,-60"
HOLE = [[10, 46.2], [11, 46.2], [11, 46.9], [10, 46.9], [10, 46.2]]
# By either criterion; by the largest scale not the globe, of which nearly all maps have none.
REGIONS = {
    "airy_kavrayskiy": [
        GERMANY, "box:158,62,-170,70", AROUND_POLE, "country:FJ",
        {"type": "Polygon", "coordinates": [ALPS, HOLE]},
    ],
    "max_scale_error_ppm": [
        "box:177,-20,-178,-15", "box:10,76,35,81", "country:NP",
    ],
}  # fmt: skip
# The CRS that a country or a city uses itself, or what is made for a place, also across the antimeridian.
FIRST = {
    "country:FJ": "EPSG:3460",  # Fiji Map Grid
    "box:158,62,-170,70": "EPSG:5935",  # Chukotka: an Arctic zone
}


@pytest.mark.parametrize(
    ("criterion", "region"), some([(one, place) for one in REGIONS for place in REGIONS[one]], 2), ids=str
)
def test_brute_force(criterion, region):
    """The five best are those of measuring every candidate in full, in the same order; some are known to be first."""
    # Searches for largest values in ESRI's maps of the world, torn at 180 degrees, take minutes, and never rank.
    # Around a pole all of ESRI's maps take three quarters of the time.
    authorities = ["EPSG", "ESRI"] if region != AROUND_POLE and criterion == "airy_kavrayskiy" else ["EPSG"]
    best, every = (recommend(region, criterion=criterion, authorities=authorities, limit=limit) for limit in (5, None))
    assert len(every.results) > len(best.results)
    assert best.to_dict()["results"] == every.to_dict()["results"][:5]  # as there NaN equals NaN
    first = best.results[0]
    assert first.code == FIRST.get(str(region), first.code)
    assert region != "box:158,62,-170,70" or first.share > 0.99
    if region == AROUND_POLE:
        azimuthal = {"Azimuthal Equidistant", "Lambert Azimuthal Equal Area", "Polar Stereographic"}
        assert {one.method.partition(" (")[0] for one in best.results} <= azimuthal


@pytest.mark.parametrize(("region", "purpose", "code", "method"), [
    ("box:177,-20,-178,-15", "any", "EPSG:3460", "Transverse Mercator"),  # Fiji Map Grid
    ("box:10,76,35,81", "any", "EPSG:6070", "Lambert Conic Conformal (2SP)"),  # Svalbard: the Arctic zone made for it
    ("box:-76,-56,-66,-17.5", "any", "EPSG:20049", "Transverse Mercator"),  # Chile: UTM 19S, on the datum of 2021
    ("box:-106.6,25.9,-93.6,36.4", "any", "EPSG:3083", "Albers Equal Area"),  # Texas
    ("box:166,-47.5,179,-34", "any", "EPSG:2193", "Transverse Mercator"),  # New Zealand
    ("cap:13.4,52.5,20", "any", "EPSG:3068", "Cassini-Soldner"),  # Soldner Berlin
    ("globe", "equal-area", None, "Equal Earth"),
])  # fmt: skip
def test_first(region, purpose, code, method):
    """The CRS that a country uses itself comes first, also across the antimeridian; the world gets EPSG's map of it."""
    first = recommend(region, purpose=purpose, authorities=["EPSG"], limit=1).results[0]
    assert (code or first.code, first.method) == (first.code, method)
    assert region != "globe" or first.share > 0.99


def test_uninterrupted():
    """Goode's maps lead for the world, with three half meridians of cuts; without them Winkel's does, with one."""
    first = recommend("globe", limit=1).results[0]
    assert first.method.startswith("Interrupted Goode")
    assert first.distortion.cut_km > 2.5 * 20015
    whole = recommend("globe", limit=2, uninterrupted=True)
    winkel = whole.results[0]
    assert (winkel.method, winkel.distortion.cut_km) == ("Winkel Tripel", pytest.approx(20015, abs=1))
    assert first.code in [one.code for one in whole.rejected if one.reason == "It is cut within the region."]


def test_angles_of_conformal_maps():
    """All have none, so that the order is that by the Airy-Kavrayskiy error, and maps are told apart as by it."""
    options = {"purpose": "conformal", "limit": 6, "authorities": ["EPSG"]}
    criteria = ("airy_kavrayskiy", "max_omega", "mean_omega")
    usual, *others = (recommend("country:DE", criterion=name, **options) for name in criteria)
    for found in others:
        assert [one.code for one in found.results] == [one.code for one in usual.results]
        assert found.maps == usual.maps


def test_areas_of_equal_area_maps():
    """The continent's map is before those of the world, whose errors of areas are as much rounding as its own."""
    found = recommend(GERMANY, criterion="max_areal_error_ppm", limit=5)
    assert found.results[0].code == "EPSG:3035"
    levels = [one.distortion.airy_kavrayskiy / one.share * (WIDE_FACTOR if one.wide else 1.0) for one in found.results]
    assert levels == sorted(levels)


def test_rounding_is_no_figure():
    """What keeps true to 0.1 ppm counts as nothing, in each unit."""
    limits = {"max_areal_error_ppm": (0.09, 0.2), "max_omega": (5e-6, 6e-6), "airy_kavrayskiy": (9e-8, 2e-7)}
    for name, (below, above) in limits.items():  # 1e-7 radians are 5.73e-6 degrees
        assert [projdist.FIGURES[name].without_rounding(value) for value in (below, above)] == [0.0, above]


def test_zones_of_a_country():
    """UTM zone 37 is Kenya's best, before maps of the world: its area of use is on both sides of the equator."""
    found = recommend("country:KE", authorities=["EPSG"], limit=4)
    first, *others = found.results
    assert set(first.codes) >= {"EPSG:21037", "EPSG:21097", "EPSG:32637", "EPSG:32737"}
    counts = [one.value / one.share * (2.0 if one.wide else 1.0) for one in found.results]
    assert counts[0] == min(counts)
    assert first.national
    assert all(one.wide for one in others)
    kenya = get_region("country:KE")
    zone = get_region("country:KE & box:36,-12,42,6")  # the zone's meridians; areas of use end at 4.49 N
    assert first.share == pytest.approx(zone.area_km2 / kenya.area_km2, abs=0.02)
    # Its four zones, each over its own part; the largest scale error against PROJ's factors on a grid.
    (system,) = found.zones
    assert system.national
    assert {zone.code for zone in system.zones} == {"EPSG:21036", "EPSG:21037", "EPSG:21096", "EPSG:21097"}
    lon, lat = np.meshgrid(np.linspace(33.9, 42, 400), np.linspace(-4.8, 5.1, 400))
    inside = kenya.contains(lon, lat)
    for zone in system.zones:
        west, south, east, north = Proj(zone.code).crs.area_of_use.bounds
        part = inside & (lon >= west) & (lon <= east) & (lat >= south) & (lat <= north)
        k = Proj(zone.code).get_factors(lon[part], lat[part]).meridional_scale
        assert zone.max_scale_error_ppm == pytest.approx(1e6 * np.abs(k - 1).max(), abs=15)  # a cell of the grid
        assert zone.share == pytest.approx(part.sum() / inside.sum(), abs=0.01)
    assert system.max_scale_error_ppm == max(zone.max_scale_error_ppm for zone in system.zones)
    # A small country is within 100 ppm of the truth in one system.
    assert recommend("country:LU", authorities=["EPSG"], limit=1).zones == ()


@each(("state", "codes"), [("TX", range(32137, 32142)), ("AZ", range(26948, 26951)), ("CO", range(26953, 26956))])
def test_zones_of_a_state(state, codes):
    """The State Plane zones of NOAA Manual NOS NGS 5, appendix A; Arizona's have two scales."""
    (system,) = recommend(f"state:{state}", authorities=["EPSG"], limit=1).zones
    assert [zone.code for zone in system.zones] == [f"EPSG:{code}" for code in codes]


def test_parts_far_away():
    """The answer for France is that for its main part, and says so; with @all it is for all of it."""
    france = recommend("country:FR", authorities=["EPSG"], limit=1)
    assert france.region.name == "country:FR@main"
    assert france.results == recommend("country:FR@main", authorities=["EPSG"], limit=1).results
    assert france.results[0].code == "EPSG:2154"
    assert france.notes[0] == "The answer is for the main part, country:FR@main."
    everywhere = recommend("country:FR@all", authorities=["EPSG"], limit=1)
    assert everywhere.region.area_km2 == pytest.approx(1.16 * france.region.area_km2, rel=0.02)


def test_why_not_the_countrys_own():
    """Where another system comes first, a note has the figures of the country's own."""
    options = {"authorities": ["EPSG"], "purpose": "conformal"}
    argentina, more = (recommend("country:AR", limit=limit, **options) for limit in (1, 20))
    first, (note,) = argentina.results[0], argentina.notes
    assert not first.national
    told = r"(\S+), the best of those of Argentina, counts (\S+) by airy_kavrayskiy, (\S+) (\S+)\."
    code, count, best, least = re.fullmatch(told, note).groups()
    own = code_of(more, code)
    assert (own.national, best) == (True, first.code)
    assert (float(count), float(least)) == pytest.approx((own.ranked, first.ranked), rel=1e-4)


def one_over_s(J):
    """How much smaller areas are than they should be."""
    return 1.0 / np.abs(np.linalg.det(J))


def test_functions_of_users():
    """By the mean of a function, also of one that cannot be pickled; values are those of the fields."""
    belt, criteria = "box:-30,0,30,60", (one_over_s, lambda J: one_over_s(J))
    options = {"authorities": ["EPSG"], "area": "intersects", "limit": 3, "uninterrupted": True}
    found, local = (recommend(belt, criterion=criterion, **options) for criterion in criteria)
    assert found.criterion == "one_over_s"
    assert [one.code for one in found.results] == [one.code for one in local.results]
    for one in found.results:
        assert one.value == pytest.approx(projdist.sample(one.code, belt).mean(one_over_s).value, rel=1e-4)
    assert found.results[0].value == min(one.value for one in found.results)


@pytest.mark.parametrize("name", ["kavrayskiy", "isotropy", "max_log_scale", "canters_ab"])
def test_figures_that_answers_do_not_list(name):
    found = recommend("box:7.5,46.5,8.5,47.5", criterion=name, authorities=["EPSG"], limit=2)
    for one in found.results:
        truth = projdist.sample(one.code, found.region, measures=[projdist.FIGURES[name].measure], tolerance=1e-9)
        assert one.value == pytest.approx(truth.figure(name).value, rel=1e-4, abs=1e-9)
