"""What summaries and comparisons promise: order, failures, dictionaries, JSON, frames."""

import functools
import json
import math
import re
import sys

import numpy as np
import pyproj
import pytest
from closed_errors import PLATE_CARREE, R
from refusals import refuses
from tables import each

from projdist import Notice, correct, indices
from projdist.answers.points_and_lines import factors
from projdist.answers.summaries import compare, sort_order, summarize
from projdist.projections import Projection, ProjectionError

SUMMARY_KEYS = """projection name definition coverage airy_kavrayskiy airy_kavrayskiy_scaled
    airy_kavrayskiy_affine error_estimate evaluations""".split()
ERRORS = ["mean_error", "rms_error", "max_error", "min_error"]
FRAME_STATISTICS = ["mean", "rms", "median", "p95", "max", "min", *ERRORS, "max_lon", "max_lat", "min_lon", "min_lat"]
STATISTICS_KEYS = {"mean", "rms", "median", "p95", "max", "min", "max_at", "min_at", *ERRORS}
EUROPE = "box:-10,35,40,70"


def frame_of(answer):
    """The frame, which needs pandas."""
    pytest.importorskip("pandas")
    return answer.to_frame()


def test_a_summary_as_a_dictionary_and_a_frame():
    """Documented keys, then the measures by the text that they were asked for; a row, each statistic a column."""
    found = summarize("mercator", "box:0,0,40,60", measures=["k", "areal_scale", "scale@45"], tolerance=1e-6)
    result, frame = found.to_dict(), frame_of(found)
    assert list(result) == [*SUMMARY_KEYS, "k", "areal_scale", "scale@45"]
    given = result["projection"], result["coverage"], result["definition"]
    assert given == ("mercator", 1.0, f"+proj=merc +R={R}")
    assert result["airy_kavrayskiy"] == found.airy_kavrayskiy
    assert set(result["k"]) == STATISTICS_KEYS
    assert result["k"]["max"] == pytest.approx(2.0, rel=1e-9)
    assert json.loads(json.dumps(result, allow_nan=False)) == result
    columns = [f"{name}_{key}" for name in ("k", "areal_scale", "scale@45") for key in FRAME_STATISTICS]
    assert list(frame.columns) == [*SUMMARY_KEYS, *columns]
    assert frame.shape[0] == 1
    values = frame.iloc[0][["projection", "airy_kavrayskiy", "k_max", "areal_scale_max_lon", "areal_scale_max_lat"]]
    truth = "mercator", found.airy_kavrayskiy, found.measures["k"].max, *found.measures["areal_scale"].max_at
    assert tuple(values) == truth


def test_what_is_undefined():
    """A mean is NaN and a maximum without bound infinity in a frame; both are None in a dictionary, for valid JSON."""
    # Factors at points: one result a point, in order, with None beyond the horizon.
    result = factors(f"+proj=ortho +R={R}", [0.0, 120.0], [60.0, 0.0], measures=["areal_error_ppm"]).to_dict()
    assert list(result) == ["projection", "name", "definition", "results"]
    names = "lon lat x y h k a b s omega theta convergence fisher quality areal_error_ppm".split()
    assert [list(row) for row in result["results"]] == [names, names]
    inside, beyond = result["results"]
    assert inside["h"] == pytest.approx(0.5, abs=1e-10)
    assert inside["areal_error_ppm"] == pytest.approx(5e5, abs=1e-3)
    assert (inside["quality"], beyond["quality"]) == ("ok", "outside")
    assert {beyond[name] for name in names[2:13]} == {None}
    found = summarize("mercator", measures=["s"], tolerance=1e-3)
    assert (found.to_dict()["s"]["mean"], found.to_dict()["s"]["max"]) == (None, None)
    row = frame_of(found).iloc[0]
    assert math.isnan(row["s_mean"])
    assert row["s_max"] == math.inf


def test_factors_of_a_grid():
    """Arrays of its shape, k of Mercator's map is sec(latitude); a frame has a row a point, raveled."""
    lon, lat = np.meshgrid([-120.0, 0.0, 35.0], [-50.0, 20.0])
    found = factors("mercator", lon, lat)
    assert (found.k.shape, found.quality.shape, found.jacobian.shape) == ((2, 3), (2, 3), (2, 3, 2, 2))
    np.testing.assert_allclose(found.k, 1 / np.cos(np.radians(lat)), rtol=1e-11)
    found = factors(f"+proj=ortho +R={R}", lon, lat, measures=["areal_error_ppm"])
    frame = frame_of(found)
    assert list(frame.columns) == list(found.to_dict()["results"][0])
    for name in ("lon", "lat", "h", "quality"):
        np.testing.assert_array_equal(frame[name], getattr(found, name).ravel())
    assert frame["h"].isna().tolist() == [True, False, False, True, False, False]
    assert frame["h"].dtype == float


def test_any_projection():
    """Whatever names the plate carree has its error; `given` is the text, or else the definition."""
    eqc = f"+proj=eqc +R={R}"

    def mine(lon, lat):
        return R * np.radians(lon), R * np.radians(lat)

    given = {"plate-carree": "plate-carree", eqc: eqc, mine: "mine", Projection.from_user_input("plate-carree"): eqc}
    for value in (*given, pyproj.CRS(eqc), pyproj.CRS(eqc).to_wkt()):
        found = summarize(value, tolerance=1e-6)
        assert found.airy_kavrayskiy == pytest.approx(PLATE_CARREE, abs=1e-6)
        assert found.given == given.get(value, found.given)


@pytest.mark.slow
def test_comparison_in_the_order_asked_for(monkeypatch):
    """By error, as given, by name, by an index, by a measure, alone its mean; what has no bound goes last, as poles."""
    found = compare(["mercator", "winkel-tripel", "stereographic", "laea", "natural-earth"], tolerance=1e-4)
    assert [r.given for r in found.results] == ["winkel-tripel", "natural-earth", "mercator", "laea", "stereographic"]
    assert found.failures == ()
    given = ["mercator", "mollweide", "natural-earth"]
    known = {}

    def summarized(projection, region, **options):
        """Once for all orders."""
        key = projection.name, region.name
        known[key] = known.get(key) or summarize(projection, region, **options)
        return known[key]

    monkeypatch.setattr("projdist.answers.summaries.summarize", summarized)

    def order(sort, region="globe", measures="s"):
        options = {"measures": measures, "indices": "canters_ar", "sort": sort, "tolerance": 1e-2}
        return [one.given for one in compare(given, region, **options).results]

    assert order("given") == given
    assert order("name") == ["mercator", "mollweide", "natural-earth"]
    # Mollweide's areas are true. Those of the others have no bound, and only those of Natural Earth have a mean.
    assert order("canters_ar")[0] == "mollweide"
    assert order("s.max") == ["mollweide", "mercator", "natural-earth"]
    assert order("s")[2] == "mercator"
    assert order("scale@22.5.max", "box:0,60,10,70", ["scale@22.5"])[2] == "mercator"
    for sort in ("s", "definition", "omega.max", "", "s.bad"):
        asked = {"measures": [] if sort == "s" else ["s"], "sort": sort}
        refuses(rf"^Invalid sort key '{sort}'\. It must be given, name, .* asked for", compare, "no-such-map", **asked)


def test_failures_stand_beside_results():
    """What cannot be measured is a failure with its reason, and the others have their results."""
    given = ["no-such-map", "mercator", "EPSG:4326", f"+proj=gnom +lat_0=-90 +R={R}"]
    found = compare(given, EUROPE, tolerance=1e-4)
    assert [result.given for result in found.results] == ["mercator"]
    assert [failure.given for failure in found.failures] == [given[0], given[2], given[3]]
    *unknown, beyond = (failure.error for failure in found.failures)
    for name, error in zip(("no-such-map", "EPSG:4326"), unknown, strict=True):
        assert re.fullmatch(rf"Invalid projection '{name}'\. .*", error)  # one line
    assert beyond == "Invalid region 'box:-10,35,40,70' for Gnomonic. No point of it can be projected."


def test_a_comparison_as_a_dictionary_and_a_frame():
    """The region with its area, results, failures; a frame has the results in their order, none if all fail."""
    found = compare(["mercator", "no-such-map", "laea"], EUROPE, measures=["omega"], tolerance=1e-4)
    result, frame = found.to_dict(), frame_of(found)
    assert list(result) == ["region", "results", "failures"]
    assert list(result["region"]) == ["name", "area_km2"]
    assert result["region"]["name"] == EUROPE
    assert [list(entry) for entry in result["results"]] == [[*SUMMARY_KEYS, "omega"]] * 2
    assert [list(entry) for entry in result["failures"]] == [["projection", "error"]]
    assert result["failures"][0]["projection"] == "no-such-map"
    json.dumps(result, allow_nan=False)
    assert frame["projection"].tolist() == [result.given for result in found.results]
    assert frame["omega_p95"].tolist() == [result.measures["omega"].p95 for result in found.results]
    assert compare(["no-such-map"], EUROPE, tolerance=1e-4).to_frame().empty


# One of each kind, with undefined numbers.
ANSWERS = [
    lambda: factors("mercator", [10.0, 20.0], [90.0, 1 / 3]),
    lambda: summarize("mercator", measures=["s"], tolerance=1e-2),
    lambda: compare(["mercator", "no-such-map"], measures=["s"], tolerance=1e-2),
]


@each("make", ANSWERS)
def test_json(make, monkeypatch):
    """JSON is the dictionary to the last bit, valid with its nulls, on one line or indented; frames need pandas."""
    answer = make()
    text = answer.to_json()
    assert json.loads(text, parse_constant=pytest.fail) == answer.to_dict()
    assert ("null" in text, "\n" in text) == (True, False)
    assert json.loads(answer.to_json(indent=2)) == answer.to_dict()
    assert answer.to_json(indent=2).count("\n") > 10
    assert type(frame_of(answer)).__name__ == "DataFrame"
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "pandas", None)
        with pytest.raises(
            ImportError, match=r"^Invalid call of to_frame\. It needs pandas: pip install 'projdist\[gis\]'"
        ):
            answer.to_frame()


EARTH = [(f"+proj=merc {figure}", 510_065_621.724) for figure in (f"+R={R}", "+R=1", "+ellps=bessel")]
MARS, MOON = ("+proj=merc +R=3396190", 4.0 * math.pi * 3396.19**2), ("IAU_2015:30110", 4.0 * math.pi * 1737.4**2)


@each("projection, area", [*EARTH, MARS, MOON])
def test_the_area_of_the_region_is_that_on_its_body(projection, area):
    """It is common to all projections of a comparison: of the Earth WGS 84's, whatever their ellipsoids."""
    result = compare([projection], tolerance=1e-3).to_dict()
    assert result["region"]["area_km2"] == pytest.approx(area, abs=1e-3)


SINGULAR = r"It is singular everywhere|No part of it"
BEYOND = r"^Invalid region 'box:120,-30,150,30' for Orthographic\. No point of it can be projected\.$"


@each("projection, region, message", [
    ("mercatro", "globe", r"^Invalid projection 'mercatro'\. Did you mean mercator"),
    (f"+proj=ortho +R={R}", "box:120,-30,150,30", BEYOND),
    *((lambda lon, lat, k=k: (k * lon, 0.0 * lat), "box:0,0,10,10", SINGULAR) for k in (111e3, 0.0)),
])  # fmt: skip
def test_maps_that_are_refused(projection, region, message):
    """Those without a part in the region, and those onto a line, of which there is nothing to measure."""
    with pytest.raises(ProjectionError, match=message):
        summarize(projection, region)


def fisher(J):
    return J[..., 0, 0]


@pytest.mark.parametrize("asked", [functools.partial(one, "mercator") for one in (summarize, compare)])
def test_refused(asked):
    """What is wrong with the question is an error of a comparison, too, and none of one projection."""
    refuses(r"^Invalid measure 'omgea'\. Did you mean omega", asked, measures=["omgea"])
    refuses(r"^Invalid region 'globus'\. It must be globe, ", asked, region="globus")
    for value in (0, 0.0, -1e-8, math.nan):
        refuses(rf"^Invalid tolerance '{value}'\. It must be above 0\.$", asked, tolerance=value)
    # Each measure must have a name of its own.
    refuses(r"^Invalid measures. Two are called 'fisher'", asked, region="box:0,0,10,10", measures=["fisher", fisher])


def test_published_indices_of_a_comparison():
    """They are those of `indices`, in each result and in its dictionary; an unknown one is refused before the work."""
    compared = compare(["robin", "moll"], "box:6,47,15,55", indices=["airy", "jordan"], tolerance=1e-4)
    for found in compared.results:
        alone = indices(found.given, "box:6,47,15,55", ["airy", "jordan"], tolerance=1e-4)
        assert found.indices.values == alone.values
        assert found.to_dict()["indices"] == alone.to_dict()["indices"]
    for row, found in zip(compared.plain_rows(), compared.results, strict=True):
        assert row["jordan"] == found.indices["jordan"].value
        assert row["airy_best_scale"] == found.indices["airy"].best_scale
    # The same measure twice is one.
    found = summarize("robin", "box:6,47,15,55", measures=["h", "h"], tolerance=1e-3)
    assert (found.indices, list(found.measures)) == (None, ["h"])
    refuses(r"^Invalid index 'jordn'", compare, "robin", "box:6,47,15,55", indices="jordn")


def test_what_is_undefined_goes_last():
    """Numbers and names ascend; infinity and NaN are no better than any."""
    found = sorted([np.nan, 2.0, np.inf, -1.0, 0.0], key=sort_order)
    assert found[:3] == [-1.0, 0.0, 2.0]
    assert not np.isfinite(found[3:]).any()
    assert sorted(["b", "a"], key=sort_order) == ["a", "b"]


LAMBERT_93 = "^EPSG:2154 is for box:-9.86,41.15,10.38,51.56, where"
OUTSIDE = "lies: its figures are mostly of places outside its area of use"
ELSEWHERE = [
    # Half the difference of the sines of the authalic latitudes, of 20.24 degrees of 360.
    ("EPSG:2154", "globe", rf"{LAMBERT_93} 0\.35 % of globe {OUTSIDE}"),
    ("EPSG:2154", "country:DE", rf"{LAMBERT_93} 32 % of country:DE lies: "),
    ("EPSG:2154", "country:MT", rf"{LAMBERT_93} nothing of country:MT lies: "),
    ("EPSG:32760", "box:-180,-20,-170,-10", r"^EPSG:32760 is for box:174,-80,180,0, where nothing of box:"),
]


@pytest.mark.slow
@each("projection, region, text", ELSEWHERE)
def test_areas_of_use_elsewhere_are_told(projection, region, text):
    """Where less than half of the region lies in the area of use: once a map, and compare tells as summarize does."""
    for asked in (functools.partial(summarize, projection), functools.partial(compare, [projection, "moll"])):
        with pytest.warns(Notice, match=text) as notices:
            asked(region, tolerance=1e-2)
        assert len([one for one in notices if "area of use" in str(one.message)]) == 1


# Fiji is on both sides of the antimeridian; the last two have no area of use.
WITHIN = {"EPSG:2154": "country:FR@main", "EPSG:25832": "country:DE", "EPSG:3857": "globe", "EPSG:3460": "country:FJ"}
WITHIN |= {"+proj=utm +zone=33": "country:DE", "robin": "globe"}


SWISS = r"^EPSG:2056 is for box:5\.9\d,45\.8\d,10\.\d+,47\.81: "  # to which PROJ 9.8 adds a hundredth of a degree
SWAPPED = r" With longitude and latitude swapped {} inside: longitudes come first\."


@each(("lon", "lat", "text"), [
    (47, 8, "the point lies outside its area of use." + SWAPPED.format("it lies")),
    (2, 48, r"the point lies outside its area of use\."),
    ([8, 47, 2, np.nan], [47, 8, 48, 0], "2 of 3 points lie outside its area of use." + SWAPPED.format("1 of .*")),
    ([[47], [46]], [7, 8], "4 of 4 points lie outside its area of use." + SWAPPED.format("4 of them lie")),
    ([8, 5.9], [47, 47], r"1 of 2 points lie outside its area of use\."),
])  # fmt: skip
def test_points_elsewhere_are_told(lon, lat, text):
    """How many of those that are there, and how many of these lie inside as latitudes and longitudes."""
    with pytest.warns(Notice, match=f"{SWISS}{text}$") as notices:
        found = factors("EPSG:2056", lon, lat)
    assert len([one for one in notices if one.category is Notice]) == 1
    assert np.isfinite(found.k[np.isfinite(found.lon)]).all()


def test_what_is_in_an_area_of_use_is_not():
    """Regions mostly, points, also those that are nowhere, and corrections over a region; notices are errors here."""
    for projection, region in WITHIN.items():
        summarize(projection, region, tolerance=1e-2)
    correct("EPSG:2154", "box:6,47,15,55", tolerance=1e-2)
    factors("EPSG:2056", [5.96, 10.49, 365.96], [45.82, 47.81, 47])  # the edge is inside, by any turn
    factors("EPSG:2056", np.nan, 47)
    factors("EPSG:3460", [179, -179], [-17, -17])  # on both sides of the antimeridian
    factors("+proj=utm +zone=33", 47, 8)  # has no area of use
