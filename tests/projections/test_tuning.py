"""Maps with other parameters and centres: PROJ's own strings, round trips, and what is refused."""

import numpy as np
import pytest
from projection_points import R, assert_same, make, refusal
from pyproj import CRS
from tables import each

from projdist.projections import Projection, tunable, tuned


@each(("given", "values", "centre", "truth"), [
    ("robinson", {"lon_0": 150}, None, f"+proj=robin +lon_0=150 +R={R}"),
    ("behrmann", {"lat_ts": 45}, None, f"+proj=cea +lat_ts=45 +R={R}"),
    ("winkel-1", {"lat_ts": 45, "lon_0": 7}, None, f"+proj=wink1 +lat_ts=45 +lon_0=7 +R={R}"),
    ("polar-stereographic", {}, (10, 50), f"+proj=stere +lat_0=50 +lon_0=10 +R={R}"),
    ("aea+lat_1=20+lat_2=50", {"lat_1": 30}, (10, 40), f"+proj=aea +lat_1=30 +lat_2=50 +lat_0=40 +lon_0=10 +R={R}"),
    ("mollweide", {}, (-100, 45), f"+proj=ob_tran +o_proj=moll +o_lat_p=45 +lon_0=-100 +R={R}"),
    ("mollweide@45,-100", {"lon_0": 20}, None, f"+proj=ob_tran +o_proj=moll +o_lat_p=45 +lon_0=20 +R={R}"),
    ("mollweide@45,-100", {}, (20, 0), f"+proj=moll +lon_0=20 +R={R}"),
    ("EPSG:3035", {}, (20, 30), "+proj=laea +lat_0=30 +lon_0=20 +x_0=4321000 +y_0=3210000 +ellps=GRS80"),
    ("EPSG:32633", {"k_0": 1}, None, "+proj=tmerc +lon_0=15 +x_0=500000 +ellps=WGS84"),
    ("+proj=tmerc +k=0.9996 +R=6e6", {"k_0": 0.999}, None, "+proj=tmerc +k_0=0.999 +R=6e6"),
])  # fmt: skip
def test_what_is_made_is_the_map_of_proj(given, values, centre, truth) -> None:
    """With other values and another centre it is the map that PROJ makes of them, and its definition makes it again."""
    found = tuned(given, values, centre)
    assert_same(found, make(truth))
    again = make(found.definition)
    assert (again.function, again.name, again.ellipsoid) == (found.function, found.name, found.ellipsoid)


@pytest.mark.slow
@each(
    "name",
    """robinson mollweide winkel-tripel equal-earth natural-earth eckert-4 hammer aitoff sinusoidal kavrayskiy-7
    wagner-7 van-der-grinten-3 miller mercator gall-peters behrmann gott-wagner wagner-9 lambert-azimuthal
    azimuthal-equidistant stereographic""".split(),
)
@each("centre", [(-100.0, 45.0), (151.0, -33.0), (260.0, 0.0), (30.0, 90.0)])
def test_a_turned_map_is_that_of_its_name_with_a_point(name, centre) -> None:
    """Wherever the centre of a map of the sphere is dragged."""
    lon, lat = centre
    made = tuned(name, {}, centre)
    assert tunable(name).drags == "both"
    assert_same(made, make(f"{name}@{lat},{lon}"))
    assert tunable(made.definition).centre == pytest.approx(((lon + 180.0) % 360.0 - 180.0, lat))


@each("name", ["robin", "eqearth", "merc", "poly", "goode"])
def test_maps_of_an_ellipsoid_move_around_it(name) -> None:
    found = tunable(f"+proj={name} +lon_0=7 +ellps=WGS84")
    assert (found.drags, found.centre) == ("longitude", (7.0, 0.0))
    moved = tuned(f"+proj={name} +lon_0=7 +ellps=WGS84", {}, (20.0, 50.0))
    assert moved.definition == f"+proj={name} +lon_0=20 +ellps=WGS84"


@each(
    "name",
    """bertin icosahedral-snyder peirce-quincuncial werner interrupted-mollweide briesemeister krovak
    sch+plat_0=30+plon_0=45+phdg_0=-12""".split(),
)
def test_maps_without_a_centre_are_not_turned(name) -> None:
    """Where no point with north up is at the origin, or none, as about a peg point, the longitude moves at most."""
    assert tunable(name).drags == ("none" if name == "bertin" else "longitude")
    found = tunable(Projection.from_function(lambda lon, lat: (lon, lat), name="robinson"))
    assert (found.parameters, found.drags, found.centre) == ((), "none", None)


def test_a_centre_is_counted_from_greenwich() -> None:
    """The longitudes of a map that counts from Paris are its own, and the centre's are Greenwich's."""
    paris = 2.0 + 20.0 / 60.0 + 14.025 / 3600.0
    given = "+proj=lcc +lat_1=49 +lat_2=44 +lat_0=46 +lon_0=3 +pm=paris +ellps=clrk80ign"
    assert tunable(given).centre == pytest.approx((3.0 + paris, 46.0))
    assert np.abs(tuned(given, {}, (10.0, 40.0))(10.0, 40.0)).max() < 1e-6
    crs = tunable("EPSG:27572")
    assert crs.centre == pytest.approx((paris, 46.8), abs=1e-6)
    assert_same(make(crs.definition), make("EPSG:27572"), np.array([1.0, 7.0]), np.array([43.0, 49.0]))


def test_a_southern_parallel_has_a_southern_range() -> None:
    """The range of a parallel is that of its own hemisphere, and a value beyond a range is within its own."""
    parameters = {each.name: each for each in tunable("EPSG:3031").parameters}
    assert (parameters["lat_ts"].low, parameters["lat_ts"].value, parameters["lat_ts"].high) == (-90.0, -71.0, -1.0)
    assert tunable("+proj=tmerc +k_0=3").parameters[-1].high == 3.0
    assert tunable("EPSG:27700").parameters[-1].value == 0.9996012717  # PROJ's k is k_0, and does not stay beside it
    assert " +k=" not in tuned("EPSG:27700", {"k_0": 1.0}).definition


LINE = "It must be a longitude, and a latitude of -90 to 90."


@each(("given", "values", "centre", "said"), [
    ("robinson", {"lat_1": 3.0}, None, "Invalid parameter 'lat_1' of 'robinson'. It must be lon_0."),
    ("bertin", {"lon_0": 3.0}, None, "Invalid parameter 'lon_0' of 'bertin'. This map has none that can be set."),
    ("wintri", {"lat1": 3.0}, None, "Did you mean lat_1?"),
    ("wintri", {"lat_1": 90.0}, None, "Invalid lat_1 '90' of 'wintri'. It must be 0 to 89°."),
    ("wintri", {"lat_1": float("nan")}, None, "It must be 0 to 89°."),
    ("misrsom+path=3", {"path": 1.5}, None, "It must be 1 to 233 in steps of 1."),
    ("nsper+h=1e6", {"h": 0.0}, None, "It must be 100000 to 100000000 m."),
    *(("robinson", {}, (0.0, 91.0), LINE), ("robinson", {}, (float("nan"), 1.0), LINE)),
    ("robinsn", {}, None, "Did you mean robinson or robin?"),
    (lambda lon, lat: (lon, lat), {}, (1, 2), "none that can be moved."),
    # PROJ's reason is given where each is within its range, but not both; poles are no centres of cones.
    ("aea+lat_1=30+lat_2=50", {"lat_1": -50.0}, None, ""),
    ("lcc+lat_1=30+lat_2=50", {"lat_2": -30.0}, None, ""),
    ("murd1+lat_1=30+lat_2=50", {"lat_2": 30.0}, None, ""),
    ("tpeqd+lat_1=40+lon_1=-100+lat_2=50+lon_2=10", {"lat_2": 40.0, "lon_2": -100.0}, None, ""),
    ("lsat+lsat=3+path=2", {"path": 0.0}, None, ""),
    *(("lcc+lat_1=30+lat_2=60", {}, (33.0, -90.0), ""), ("labrd+lat_0=-18.9+azi=18.9", {}, (1.0, 0.0), "")),
    ("somerc", {}, (1.0, 90.0), ""),
])  # fmt: skip
def test_what_cannot_be_set_is_told_in_a_line(given, values, centre, said) -> None:
    """Unknown parameters, values out of range or that do not go together, and points that are none."""
    assert said or centre is None or tunable(given).drags == "both"
    text = refusal(tuned, given, values, centre)
    assert said in text if said else text.endswith(".")


@each("given", [
    make("+proj=laea +lat_0=52 +lon_0=10 +ellps=GRS80"),
    {"proj": "laea", "lat_0": 52, "lon_0": 10, "ellps": "GRS80"},
    CRS.from_epsg(3035),
    3035,
    "+proj=pipeline +step +proj=laea +lat_0=52 +lon_0=10 +ellps=GRS80",
])  # fmt: skip
def test_any_input(given) -> None:
    """Whatever names a map, its parameters are those of PROJ's string of it."""
    found = tunable(given)
    assert (found.drags, found.centre) == ("both", (10.0, 52.0))
    assert [each.name for each in found.parameters] == ["lon_0", "lat_0"]
    moved = tuned(given, {"lat_0": 40.0})
    assert np.abs(np.array(moved(10.0, 40.0)) - np.array(make(given)(10.0, 52.0))).max() < 1e-6


def test_what_was_tuned_is_tuned_on() -> None:
    """The map that was made can be turned as the one that it was made of, in steps or at once."""
    first = tuned("winkel-tripel", {"lat_1": 40.0}, (20.0, 30.0))
    assert first.definition == "winkel-tripel+lat_1=40@30,20"
    again = tuned(first, {"lat_1": 45.0}, (-100.0, 0.0))
    assert again.definition == tuned("winkel-tripel", {"lat_1": 45.0}, (-100.0, 0.0)).definition
    assert tuned("winkel-tripel", {}).function == make("winkel-tripel").function


def test_a_file_is_read_again(tmp_path) -> None:
    """What is kept of a map is kept by its text, not by the name of the file that it was read from."""
    path = tmp_path / "map.prj"
    for name in ("robin", "moll"):
        path.write_text(f"+proj={name} +R={R}")
        assert tunable(str(path)).definition == f"+proj={name} +R={R}"
