"""Maps with other parameters and centres: PROJ's own strings, round trips, and what is refused."""

import pytest
from projection_points import R, assert_same, make

from projdist.projections import Projection, ProjectionError, tunable, tuned


@pytest.mark.parametrize(
    ("given", "values", "centre", "truth"),
    [
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
    ],
)
def test_what_is_made_is_the_map_of_proj(given, values, centre, truth) -> None:
    """With other values and another centre it is the map that PROJ makes of them, and its definition makes it again."""
    found = tuned(given, values, centre)
    assert_same(found, make(truth))
    again = make(found.definition)
    assert (again.function, again.name, again.ellipsoid) == (found.function, found.name, found.ellipsoid)


def test_nothing_of_functions_can_be_turned() -> None:
    """Functions, whatever they are called, have no parameters and no centre to be moved."""
    found = tunable(Projection.from_function(lambda lon, lat: (lon, lat), name="robinson"))
    assert (found.parameters, found.drags, found.centre) == ((), "none", None)
    with pytest.raises(ProjectionError, match=r"^Invalid centre of .* none that can be moved\.$"):
        tuned(lambda lon, lat: (lon, lat), {}, (1, 2))
