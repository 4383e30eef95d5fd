"""The meridians and parallels at which maps are known to be torn or bent."""

import csv
from importlib import resources

import numpy as np
import pytest
from tables import each

from projdist.answers.summaries import summarize
from projdist.earth import SMOOTH
from projdist.projections import Projection, discontinuities_of

ROWS = list(
    csv.DictReader(
        resources.files("projdist").joinpath("data", "discontinuities.csv").read_text(encoding="utf-8").splitlines()
    )
)
OPERATIONS = [row["name"] for row in ROWS if row["kind"] == "operation"]
_STEP = 0.01  # degrees


def roughness(projection, lon, lat, along):
    """The largest fourth differences of x and y, with points half a step beside the middle on either side."""
    offset = _STEP * (np.arange(8) - 3.5)
    lon, lat = np.broadcast_arrays(lon + offset * (along == "lon"), lat + offset * (along == "lat"))
    return np.abs(np.diff(np.stack(projection(lon, lat)), n=4, axis=-1)).max()


@each("name", OPERATIONS)
def test_maps_are_rough_there(name):
    """Across each break the differences of x and y are far larger than a tenth of a degree beside it."""
    projection = Projection.from_user_input(f"+proj={name} +R=6371008.7714")
    breaks = discontinuities_of(projection)
    for lat in breaks.parallels:
        beside = max(roughness(projection, 33.0, lat + away, "lat") for away in (-0.1, 0.1))
        assert roughness(projection, 33.0, lat, "lat") > 5.0 * beside
    for lats, lons in (((20.0, 65.0), breaks.northern), ((-20.0, -65.0), breaks.southern)):
        for lon in lons:
            at = max(roughness(projection, lon, lat, "lon") for lat in lats)
            beside = max(roughness(projection, lon + away, lat, "lon") for lat in lats for away in (-0.1, 0.1))
            assert at > 5.0 * beside or lon == -180.0


@each("name", [*OPERATIONS, "moll +lon_0=77"])
def test_figures_are_the_same_without(name):
    """As a function, of which nothing is known, the map has the same error, and takes more evaluations."""
    known = Projection.from_user_input(f"+proj={name} +R=6371008.7714")
    bare = Projection.from_function(lambda lon, lat: known.function(lon, lat), ellipsoid=known.ellipsoid)
    found, truth = (summarize(one, "globe", tolerance=1e-4) for one in (known, bare))
    estimate = found.error_estimate + truth.error_estimate
    assert found.airy_kavrayskiy == pytest.approx(truth.airy_kavrayskiy, abs=estimate)
    assert found.error_estimate <= 1e-4
    assert found.evaluations < truth.evaluations or name == "robin"  # which at 1e-4 is as good as smooth


def test_breaks_turn_with_the_central_meridian():
    """Interruptions move with lon_0, and there is the meridian opposite; of a CRS likewise."""
    turned = discontinuities_of(Projection.from_user_input("+proj=igh +lon_0=30 +R=1"))
    assert turned.southern == pytest.approx((-150.0, -70.0, 10.0, 110.0))
    assert turned.northern == pytest.approx((-150.0, -10.0))
    assert discontinuities_of(Projection.from_user_input("+proj=merc +lon_0=-100 +R=1")).northern == (80.0,)
    assert len(discontinuities_of(Projection.from_user_input("ESRI:54030")).parallels) == 34


@pytest.mark.parametrize(
    "text", ["+proj=ob_tran +o_proj=moll +o_lat_p=45 +R=1", "+proj=robin +pm=paris", "+proj=robin +over", "EPSG:3035"]
)
def test_nothing_is_known_of_others(text):
    """Oblique maps have no break along meridians; shifted ones and most CRSs are left alone."""
    assert discontinuities_of(Projection.from_user_input(text)) == SMOOTH
    assert discontinuities_of(Projection.from_function(lambda lon, lat: (lon, lat))) == SMOOTH
