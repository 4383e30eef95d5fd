"""What is answered of an optimum, and what is refused."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pyproj import CRS
from refusals import refuses
from tables import each

from projdist import FIGURES, Figure, Projection, ProjectionError, optimize, principal_scales, summarize
from projdist.decisions import optimization
from projdist.decisions.families import cylinder_of, extent_of, get_family, sensible_families, usual_crs
from projdist.decisions.family_search import Flat, Members, Objective, _farthest
from projdist.decisions.optimization import _at_limit, _baseline, _baselines
from projdist.earth.ellipsoid import SPHERE, WGS84
from projdist.field.sampling import nodes_of
from projdist.regions import GLOBE, Box, get_region

SQUARE, AZIMUTHAL = "box:5,47,15,55", ("laea", "aeqd", "stere")


def members_of(family: str, region: str, criterion: str = "airy_kavrayskiy") -> Members:
    place = get_region(region)
    return Members(get_family(family, extent_of(place)), place, Objective(FIGURES[criterion]), None, None)


@pytest.mark.slow
def test_the_result_is_a_projection_and_a_crs() -> None:
    """PROJ string, projection and WKT are the same map, on WGS 84; a scale of no parameter is applied from without."""
    found = optimize("omerc", SQUARE, round_to=0.5)
    crs = CRS.from_wkt(found.wkt)
    assert crs.geodetic_crs == CRS("EPSG:4326")
    assert found.region.name in crs.name
    for form, error in ((crs, 1e-6), (found.proj, 0.0)):
        places = Projection.from_user_input(form)([6.0, 11.0], [48.0, 54.0])
        assert_allclose(places, found.projection([6.0, 11.0], [48.0, 54.0]), rtol=1e-7, atol=error)
    scaled, plain = (optimize("aeqd", SQUARE, free=free) for free in (["lat_0", "k_0"], ["lat_0"]))
    assert "+proj=affine" in scaled.proj
    assert scaled.scale == scaled.parameters["k_0"] < 1.0
    assert str(scaled.wkt).startswith("DERIVEDPROJCRS")
    assert scaled.value < plain.value


@each("south", [-60.0, 20.0])
@each("west", [-180.0, -178.5, -7.0, 0.0, 172.0, 178.5, 181.0, 357.0, -185.0])
def test_usual_crs(west: float, south: float) -> None:
    """The UTM zone of a region has the region's middle in its area of use, on either side of the antimeridian."""
    name, code = usual_crs(extent_of(Box(west, south, west + 2.0, south + 2.0)))
    crs = CRS(code)
    assert (name, crs.utm_zone[-1]) == (f"UTM {crs.utm_zone}", "N" if south > 0 else "S")
    assert abs((west + 1.0 - crs.coordinate_operation.params[1].value + 180.0) % 360.0 - 180.0) <= 3.0


@each("name", ["laea", "omerc"])
@each("lat", [-110.0, -90.0, -45.0, 45.0, 90.0, 100.0])
@each("lon", [-190.0, -170.0, 20.0, 180.0])
def test_centres_beyond_a_pole(name: str, lat: float, lon: float) -> None:
    """A centre that is beyond a pole is the same point of the globe in its usual coordinates."""
    longitude = "lonc" if name == "omerc" else "lon_0"
    found = get_family(name, extent_of(get_region(SQUARE))).normalised({"lat_0": lat, longitude: lon})
    assert abs(found["lat_0"]) <= 90.0
    assert abs(found[longitude]) <= 180.0
    lam, phi = np.radians([[found[longitude], lon], [found["lat_0"], lat]])
    there, here = np.transpose([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)])
    assert_allclose(there, here, atol=1e-14)


@pytest.mark.slow
def test_rounding() -> None:
    """Angles are multiples, scales have six decimals, and the cost of other roundings is told, never negative."""
    # Multiples of a tenth have one decimal, and no rest of the multiplication (102 x 0.1 is 10.200000000000001).
    found = optimize("tmerc", "box:5.13,47,15.27,55", round_to=0.25)
    assert found.parameters["lon_0"] % 0.25 == 0.0
    assert found.parameters["k_0"] == round(found.parameters["k_0"], 6)
    assert [one.step for one in found.roundings] == sorted(one.step for one in found.roundings)
    assert min(one.loss for one in found.roundings) >= -1e-9
    assert found.roundings[0].loss < 1e-4
    found = optimize("tmerc", "box:5.2,50,15.2,52", free=["lon_0"], round_to=0.1)
    assert found.parameters == {"lon_0": 10.2}
    assert {one.step: one.parameters["lon_0"] for one in found.roundings[:3]} == {0.01: 10.2, 0.1: 10.2, 0.5: 10.0}


@pytest.mark.slow
def test_rounding_is_of_all_angles() -> None:
    """What is not free lies at multiples as well, but for what a PROJ string states; the figure is that of the map."""
    area = "box:5.96,45.82,10.49,47.81"  # its middle is 46.815 north, 8.225 east
    found = optimize("lcc", area, free=["lat_2"], round_to=0.5)
    # A sixth of the height above the south is 46.15.
    assert found.proj == "+proj=lcc +ellps=WGS84 +lat_1=46 +lat_0=47 +lon_0=8 +lat_2=47.5"
    assert found.airy_kavrayskiy == summarize(found.proj, area).airy_kavrayskiy
    assert "+lat_0=47 +lon_0=8" in optimize("laea", area, free=["lon_0"], round_to=0.5).proj
    stated = optimize("+proj=lcc +lat_0=46.3 +lon_0=8.23 +lat_1=46 +lat_2={47..48}", area, round_to=0.5)
    assert "+lat_0=46.3 +lon_0=8.23" in stated.proj
    both = optimize("lcc", area, round_to=0.5).proj
    assert both == "+proj=lcc +ellps=WGS84 +lat_0=47 +lon_0=8 +lat_1=46 +lat_2=47.5"


@pytest.mark.slow
def test_templates() -> None:
    """A PROJ string with ranges; what is stated stays, and a k_0 within limits is found in closed form."""
    # A parameter that wants to leave its range is named.
    found = optimize("+proj=tmerc +lon_0={5..15} +k_0={0.9..1.1} +lat_0=3 +x_0=500000 +ellps=bessel", SQUARE)
    assert found.parameters["lon_0"] == pytest.approx(10.0, abs=1e-5)
    assert {"+x_0=500000", "+ellps=bessel"} <= {*found.proj.split()}
    limited = optimize("+proj=tmerc +lon_0={lon_0:5..15} {k_0:0.9998..1.1} +ellps=bessel", SQUARE)
    assert (limited.parameters["k_0"], limited.value > found.value) == (0.9998, True)
    assert [*optimize("+proj=lcc +lat_2=53 {lat_1:40..52} +ellps=GRS80", SQUARE).parameters] == ["lat_1"]
    ends = optimize("+proj=tmerc +lon_0={12..15} +ellps=GRS80", SQUARE)
    assert (ends.at_limit, ends.parameters["lon_0"]) == (("lon_0",), 12.0)


@pytest.mark.slow
def test_auto() -> None:
    """The best of the families comes first, the others by their values; a strip along a meridian wants tmerc."""
    found = optimize("auto", "box:9,35,11,60")
    assert found.family in ("tmerc", "omerc")
    values = [found.value, *(other.value for other in found.others)]
    assert values == sorted(values)
    assert len(values) + len(found.failures) == len(sensible_families(extent_of(found.region), None))
    data = json.loads(found.to_json())
    assert (data, data["proj"]) == (found.to_dict(), found.proj)
    pytest.importorskip("pandas")
    assert found.to_frame()["airy_kavrayskiy"].tolist() == values


def test_extents() -> None:
    """A box's middle and reach; the long axis of a strip; the globe has no middle, the poles no zones."""
    strip = extent_of(get_region("box:0,-20,4,20"))
    assert (strip.lon, strip.lat) == (pytest.approx(2.0), pytest.approx(0.0, abs=1e-9))
    assert strip.azimuth == pytest.approx(0.0, abs=1e-6)
    assert strip.radius == pytest.approx(20.1, abs=0.1)
    assert extent_of(get_region("globe")).radius == 180.0
    for south, code in ((85.0, "EPSG:32661"), (-89.0, "EPSG:32761")):
        assert usual_crs(extent_of(Box(10.0, south, 20.0, south + 2.0))) == ("UPS", code)


@pytest.mark.slow
@pytest.mark.parametrize(("family", "criteria"), [
    ("lcc", ["max_omega", "mean_omega"]), ("laea", ["max_areal_error_ppm"]),
    ("+proj=stere +lat_0={46..49} +lon_0=7.5 +ellps=GRS80", ["angular_distortion"]),
])  # fmt: skip
def test_criteria_that_vanish(family: str, criteria: list[str]) -> None:
    """Of maps that are all true the one of the least Airy-Kavrayskiy error is chosen, and it is said."""
    usual = optimize(family, "box:5,45,10,50")
    assert usual.note is None
    for name in criteria:
        found = optimize(family, "box:5,45,10,50", criterion=name)
        assert found.parameters == usual.parameters
        assert found.airy_kavrayskiy == pytest.approx(usual.airy_kavrayskiy, abs=1e-6)
        assert found.value < 1e-5
        told = f"{name} vanishes for all of {family}: the least Airy-Kavrayskiy error has decided."
        assert found.to_dict()["note"] == found.note == told


def _scale_error(J: np.ndarray) -> np.ndarray:
    return 1e6 * np.abs(principal_scales(J) - 1.0).max(axis=-1)


@pytest.mark.slow
@pytest.mark.parametrize("statistic", ["mean", "rms", "max"])
@pytest.mark.parametrize("free", [["lat_1", "lat_2"], ["lat_1", "k_0"]])
def test_functions_of_users(statistic: str, free: list[str]) -> None:
    """A function that is a figure's measure has the figure's optimum, also at the best scale, which is searched for."""
    own = _scale_error if statistic == "mean" else Figure(name="own", measure=_scale_error, statistic=statistic)
    known = optimize("eqdc", SQUARE, criterion=f"{statistic}_scale_error_ppm", free=free)
    found = optimize("eqdc", SQUARE, criterion=own, free=free)
    # The scale is good to 1e-8, and with kinks no descent ends at the very lowest point.
    assert found.value == pytest.approx(known.value, rel=1e-4)
    if free == ["lat_1", "lat_2"]:  # with a free scale many parallels have the same maximum
        assert found.parameters == pytest.approx(known.parameters, abs=0.02)


def test_a_function_with_a_closed_form() -> None:
    """The mean of (s - 1)^2 over the globe is least on the cylinder of s = c / cos(lat) whose c is E[1/x] / E[1/x^2].

    By the area of a belt to 60 degrees these are 60 degrees over sin(60), and ln(2 + sqrt(3)) / sin(60).
    """
    sine, text = math.sin(math.radians(60.0)), "+proj=eqc {lat_ts:0..60} +R=6371000"
    first, second = math.radians(60.0) / sine, math.log(2.0 + math.sqrt(3.0)) / sine
    found = optimize(text, "box:-20,0,20,60", criterion=lambda J: (np.linalg.det(J) - 1.0) ** 2)
    assert math.cos(math.radians(found.parameters["lat_ts"])) == pytest.approx(first / second, rel=1e-6)
    assert found.value == pytest.approx(1.0 - first**2 / second, rel=1e-5)


@pytest.mark.slow
def test_the_best_affine_map() -> None:
    """After the best linear map a cylinder's standard parallel does not matter: all have the error of any."""
    found = optimize("eqc", "box:-20,0,20,60", criterion="airy_kavrayskiy_affine", ellipsoid="sphere")
    anyone = summarize("plate-carree", "box:-20,0,20,60").airy_kavrayskiy_affine
    assert found.value == pytest.approx(anyone, rel=1e-6)


@each(("family", "criterion", "vanishes"), [
    ("merc", "max_omega", True), ("laea", "mean_areal_error_ppm", True), ("cea", "max_omega", False),
    ("merc", "max_areal_error_ppm", False), ("merc", "max_scale_error_ppm", False),
])  # fmt: skip
def test_members_that_keep_nothing(family: str, criterion: str, vanishes: bool) -> None:
    """Near poles and antipodes rounding hides no property; maps that keep another are not taken for true."""
    assert members_of(family, "globe", criterion).vanishes() == vanishes


def test_members_that_proj_refuses() -> None:
    """Show nothing, as a cone with opposite parallels: that is no error of the search."""
    members = members_of("+proj=lcc {lat_1:-80..80} +lat_2=-40", SQUARE)
    nodes = nodes_of(get_region(SQUARE), WGS84, 40)
    _, weights, hidden = members.jacobian({"lat_1": 40.0}, nodes)
    assert (hidden, weights.sum()) == (1.0, 0.0)
    assert members._quantile({"lat_1": 40.0}, nodes) == np.inf
    assert members.jacobian({"lat_1": 50.0}, nodes)[1].sum() == pytest.approx(1.0)


@each(("family", "options", "message"), [
    ("lccc", {}, "Invalid family 'lccc'. Did you mean lcc"),
    ("lcc", {"free": ["lon_0"]}, "Invalid free parameter 'lon_0' for lcc. It must be one of lat_1, lat_2, k_0"),
    ("lcc", {"free": []}, "Invalid free parameters ''"),
    ("auto", {"free": ["lat_1"]}, "Invalid free parameters for family 'auto'"),
    ("lcc", {"criterion": "best"}, "Invalid criterion 'best'"),
    ("lcc", {"ellipsoid": "potato"}, "Invalid ellipsoid 'potato'"),
    ("lcc", {"round_to": 0.0}, "Invalid rounding '0.0'"),
    ("+proj=lcc +lat_1=30 +lat_2=40", {}, "A PROJ string must have free parameters"),
    ("+proj=lcc +lat_1={30..20}", {}, "Invalid range '30..20'"), ("+proj=lcc +lat_1={a}", {}, "Invalid range 'a'"),
    (" +".join(["+proj=lcc", *(f"p{i}={{1..2}}" for i in range(7))]), {}, "There must be at most 6."),
    ("+proj=lcc +lat_1=3{30..40}", {}, "Invalid free parameter"),
    ("+proj=lcc +lat_1={30..40} +ellps=GRS80", {"ellipsoid": "GRS80"}, "The PROJ string states its own"),
    ("ob_tran:nothing", {}, "Invalid family 'ob_tran:nothing'"),
])  # fmt: skip
def test_refused(family: str, options: dict[str, object], message: str) -> None:
    refuses(message.replace("(", r"\("), optimize, family, SQUARE, **options)


SCALE = "max_scale_error_ppm"


@each(("family", "region", "message"), [
    # The far side of the Earth is nothing that an orthographic map of this side can be chosen for.
    ("+proj=ortho +lat_0=0 +lon_0={170..190} +R=6371000", "box:-5,-5,5,5", "It shows no part of it"),
    # Mercator's scale at the poles is infinite, whatever it is multiplied by.
    pytest.param("merc", "globe", f"Invalid criterion '{SCALE}' for merc over globe", marks=pytest.mark.slow),
])  # fmt: skip
def test_maps_without_a_figure(family: str, region: str, message: str) -> None:
    with pytest.raises(ProjectionError, match=message):
        optimize(family, region, criterion=SCALE)


@each(("family", "region", "rule"), [
    ("lcc", "box:5,47,15,59", {"lat_1": 49.0, "lat_2": 57.0}),  # a sixth of 12 degrees from either end
    ("cea", "box:0,20,9,40", {"lat_ts": 30.0}),  # between the nearest and the farthest latitude
    ("cea", "box:0,-40,9,-20", {"lat_ts": 30.0}), ("cea", "box:0,-10,9,30", {"lat_ts": 15.0}),
    ("airy", f"cap:0,0,{math.radians(30.0) * 6371.0087714!r}", {"lat_0": 0.0, "lon_0": 0.0, "lat_b": 60.0}),
    ("omerc", "box:0,-20,4,20", {"lat_0": 0.0, "lonc": 2.0, "alpha": 0.0}),
])  # fmt: skip
def test_rules_of_thumb(family: str, region: str, rule: dict[str, float]) -> None:
    """Those of textbooks, to what geodetic latitudes change; PROJ's lat_b is 90 less the radius of Airy's cap."""
    fixed = get_family(family, extent_of(get_region(region))).fixed
    assert {name: fixed[name] for name in rule} == pytest.approx(rule, abs=0.2)


def test_families_state_their_limits() -> None:
    """An oblique line moves across itself, as along itself a great circle has no place to go."""
    extent = extent_of(get_region(SQUARE))
    for name in (*sensible_families(extent, None), "airy", "merc", "cea", "eqc", "wintri", "ob_tran:wintri"):
        family = get_family(name, extent)
        for free in family.free:
            assert free == family.scale or family.limits[free][0] < family.limits[free][1]
    for region, moves in (("box:0,-20,4,20", "lonc"), ("box:0,-2,40,2", "lat_0")):
        assert get_family("omerc", extent_of(get_region(region))).free == (moves, "alpha", "k_0")


@each(("region", "families"), [
    ("globe", {"wintri", "eqc", "cea", "merc"}),
    ("cap:0,0,12000", {"wintri", "eqc", "cea", "merc", "aeqd", "laea", "airy"}),
    ("box:0,40,10,50", {*AZIMUTHAL, "omerc", "lcc", "aea", "eqdc", "tmerc"}),
    ("box:-180,-5,180,5", {"wintri", "eqc", "cea", "merc"}),
    ("box:20,-5,30,5", {*AZIMUTHAL, "omerc", "lcc", "aea", "eqdc", "tmerc", "merc", "cea"}),
    ("cap:0,90,300", {*AZIMUTHAL, "omerc"}), ("cap:0,90,3000", {*AZIMUTHAL, "omerc"}),
    ("country:AQ", {*AZIMUTHAL, "omerc", "airy"}), ("box:-180,50,180,70", {*AZIMUTHAL, "omerc", "airy"}),
    ("box:-179,60,179,70", {*AZIMUTHAL, "omerc", "airy", "lcc", "aea", "eqdc"}),
])  # fmt: skip
def test_sensible_families(region: str, families: set[str]) -> None:
    """Azimuthal maps anywhere but on the globe, cones beside poles, not around them, cylinders about the equator."""
    assert set(sensible_families(extent_of(get_region(region)), WGS84)) == families
    if region == "box:20,-5,30,5":  # what PROJ has for the sphere only is tried where the Earth is one
        assert set(sensible_families(extent_of(get_region(region)), SPHERE)) == families | {"airy", "eqc"}


@each(("text", "scale"), [
    ("+proj=tmerc +lon_0={5..15} +k_0={0.9..1.1} +ellps=bessel", "k_0"), ("+proj=merc {k:0.9..1.1}", "k"),
    ("+proj=merc {k_0:-1..1}", ""), ("+proj=tmerc +lon_0={5..15}", ""),
])  # fmt: skip
def test_scales_of_templates(text: str, scale: str) -> None:
    """A parameter that multiplies the map, as PROJ draws it; it has no need of a search."""
    assert get_family(text, extent_of(get_region(SQUARE))).scale == scale


@each(("alpha", "usual"), [(100.0, -80.0), (-100.0, 80.0), (30.0, 30.0), (270.0, -90.0)])
def test_azimuths_in_their_usual_range(alpha: float, usual: float) -> None:
    """An oblique cylinder's line has the azimuths alpha and alpha + 180."""
    found = get_family("omerc", extent_of(get_region(SQUARE))).normalised({"alpha": alpha})["alpha"]
    assert found == pytest.approx(usual, abs=0.1)
    assert abs(found) < 90.0


def test_cones_next_to_cylinders() -> None:
    """With parallels as far north as south the cone's constant vanishes; with others it does not."""
    said = cylinder_of("lcc", {"lat_1": -20.0, "lat_2": 20.0 + 1e-6})
    assert said.startswith("The cone is nearly a cylinder (n = 8e-09): the map is that of merc, true at 20 degrees")
    assert cylinder_of("aea", {"lat_1": -20.0, "lat_2": 20.2}) == ""
    assert "the map is that of eqc" in cylinder_of("eqdc", {"lat_1": -30.0, "lat_2": 30.0})
    assert cylinder_of("tmerc", {"lat_1": -20.0, "lat_2": 20.0}) == cylinder_of("lcc", {"lat_1": 30.0}) == ""


def test_baselines_must_show_the_region() -> None:
    """A map of one hemisphere is nothing to compare with in the other; what is said tells how much it shows."""
    said, place = "Invalid projection '.*' to compare with. It shows 50 % of box:-10,-10,10,10.", Box(-10, -10, 10, 10)
    with pytest.raises(ProjectionError, match=said):
        _baseline("+proj=ortho +lat_0=90 +R=6371000", place, Objective(FIGURES["airy_kavrayskiy"]))


@pytest.mark.slow
@pytest.mark.parametrize(("family", "name"), [("lcc", "merc"), ("aea", "cea"), ("eqdc", "eqc")])
def test_a_cone_that_is_a_cylinder(family: str, name: str) -> None:
    """Parallels on both sides of the equator make the cylindrical map, whose error is the same; others do not."""
    found = optimize(family, "box:20,-10,50,10", ellipsoid="sphere")
    south, north = found.parameters["lat_1"], found.parameters["lat_2"]
    assert north == pytest.approx(-south, abs=0.01)  # the region is symmetric
    true = 0.5 * (north - south)
    assert f"the map is that of {name}, true at {true:.4g} degrees" in found.cylinder
    assert found.cylinder in found.to_dict()["remarks"]
    cylinder = summarize(f"+proj={name} +lat_ts={true} +R=6371008.7714", "box:20,-10,50,10").airy_kavrayskiy
    assert cylinder == pytest.approx(found.airy_kavrayskiy, rel=1e-4)
    assert optimize(family, "box:20,10,50,30").cylinder == ""


@pytest.mark.slow
def test_a_flat_optimum() -> None:
    """The ends of the range are where the criterion, measured anew, is 1 % larger; a sharp optimum has none."""
    text = "+proj=lcc +lat_1={40..50} +lat_2=48 +lon_0=10 +ellps=GRS80"
    assert optimize(text, "box:0,46,20,50", criterion="max_scale_error_ppm").flats == ()
    laea, region = "+proj=laea +lat_0={} +lon_0=10 +ellps=GRS80", "box:0,40,20,60"
    wide, some = (optimize(laea.format(f"{{{limits}}}"), region) for limits in ("49.9..50.1", "48..52"))
    (flat,) = wide.flats
    assert (flat.low, flat.high) == (49.9, 50.1)
    assert max(summarize(laea.format(end), region).airy_kavrayskiy for end in (49.9, 50.1)) <= 1.01 * wide.value
    assert wide.remarks[-1] == "The optimum is flat: with lat_0 from 49.9 to 50.1 it loses at most 1 %."
    (flat,) = some.flats
    assert 48 < flat.low < some.parameters["lat_0"] < flat.high < 52
    for end in (flat.low, flat.high):  # the nodes' figure against the cubature's
        assert summarize(laea.format(end), region).airy_kavrayskiy == pytest.approx(1.01 * some.value, rel=1e-4)


@each(("begin", "end", "edge"), [(0.2, 1.0, 0.7), (0.2, -1.0, -0.3), (0.2, 0.6, 0.6)])
def test_how_far_values_are_good(begin: float, end: float, edge: float) -> None:
    """From a value towards an end, to 2^-12 of one of 16 steps; or to the end. It is told in a sentence."""
    found = _farthest(lambda value: -0.3 <= value <= 0.7, begin, end)
    assert found == pytest.approx(edge, abs=abs(end - begin) / 16 / 2**12)
    assert -0.3 <= found <= 0.7
    assert str(Flat("lat_1", 30.04, 61.96)) == "The optimum is flat: with lat_1 from 30 to 62 it loses at most 1 %."


@each(("text", "steps"), [("{0..80}", (0.01, 0.1, 0.5, 1.0, 5.0)), ("{42..44}", (0.01, 0.1, 0.5))])
def test_what_rounding_costs(text: str, steps: tuple[float, ...]) -> None:
    """The mean square over the globe is V + ln^2(cos(lat_ts) e / 2) by the plate carree, V the variance of ln cos."""
    # Steps are those that are less than half of the range of the parameter.
    variance = 2 - 2 * math.log(2) + math.log(2) ** 2 - math.pi**2 / 12 - (1 - math.log(2)) ** 2
    best = math.degrees(math.acos(2.0 / math.e))
    members, nodes = members_of(f"+proj=eqc +lat_ts={text} +R=6371000", "globe"), nodes_of(GLOBE, SPHERE, 400)
    found = members.roundings({"lat_ts": best}, members.value({"lat_ts": best}, nodes), nodes)
    assert tuple(one.step for one in found) == steps
    for one in found:
        nearest = one.step * round(best / one.step)
        assert one.parameters == {"lat_ts": pytest.approx(nearest)}
        worse = math.log(math.cos(math.radians(nearest)) * math.e / 2.0) ** 2 / variance
        assert one.loss == pytest.approx(math.sqrt(1.0 + worse) - 1.0, rel=0.05, abs=1e-5)  # of 400 nodes


@each(("lat_ts", "told"), [(0.0, ()), (30.0, ()), (89.5, ("lat_ts",))])
def test_ends_that_are_told(lat_ts: float, told: tuple[str, ...]) -> None:
    """An optimum at the end of a range may have more beyond; the equator is a natural end."""
    assert _at_limit(members_of("eqc", "globe"), {"lat_ts": lat_ts}) == told


@each(("region", "utm"), [("box:0,-8,60,10", ["UTM 36N"]), ("box:-80,-9,80,9", [])])
def test_utm_is_a_baseline_of_what_it_may_serve(region: str, utm: list[str]) -> None:
    found = _baselines(members_of("merc", region), Objective(FIGURES["airy_kavrayskiy"]), extent_of(get_region(region)))
    assert [one.name for one in found] == utm


def test_the_best_family_shows_all_of_the_region(monkeypatch: pytest.MonkeyPatch) -> None:
    """What leaves out a part of it is no better; of the others that with the least value is the best."""
    found = optimize("merc", "box:0,0,3,9", ellipsoid="sphere")
    answers = (("laea", 0.5, 0.2), ("aeqd", 1.0, 0.4), ("stere", 1.0, 0.3))
    by_family = {name: replace(found, family=name, coverage=share, value=value) for name, share, value in answers}
    monkeypatch.setattr(optimization.families, "sensible_families", lambda *_: [*by_family])
    monkeypatch.setattr(optimization, "_optimum", lambda members, *_: by_family[members.family.name])
    best = optimize("auto", "box:0,0,3,9")
    assert [one.family for one in (best, *best.others)] == ["stere", "aeqd", "laea"]
