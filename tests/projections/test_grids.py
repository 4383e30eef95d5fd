"""Points that PROJ has no coordinates of because it cannot read a grid are told from points beyond a map."""

import os
import subprocess
import sys
import types

import numpy as np
import pytest
from gis_files import write_layer
from projection_points import make, message
from pyproj.exceptions import ProjError

from projdist.projections import GridError, data_crs_of
from projdist.projections.operations import check_grids

# Nobody listens there: fetching a grid fails at once, with a network or without.
NOWHERE = {"PROJ_NETWORK": "ON", "PROJ_NETWORK_ENDPOINT": "http://127.0.0.1:9"}
BRITAIN = """
from projdist import Projection
from projdist.projections import data_crs_of, unprojected
from projdist.projections.coordinates import to_lonlat
import numpy as np

x, y = np.array([400000.0]), np.array([300000.0])
for call in data_crs_of(Projection.from_user_input("EPSG:3035"), "EPSG:27700").degrees, to_lonlat("EPSG:27700"):
    try:
        print(call(x, y))
    except ValueError as error:
        print(error)
print(unprojected("EPSG:27700", x, y))
"""


def run(*words, **environment):
    """A command in an environment."""
    command = [sys.executable, *words]
    return subprocess.run(command, capture_output=True, text=True, env=os.environ | environment, check=False)


@pytest.mark.slow
def test_a_grid_that_cannot_be_fetched_is_told():
    """From British coordinates to ETRS89 PROJ wants a grid: what came back infinite was called beyond the edge."""
    told = run("-c", BRITAIN, **NOWHERE).stdout.splitlines()
    for line in told[:2]:
        assert line.startswith("Invalid coordinates. PROJ cannot read a grid that they need: Network error when")
        assert line.endswith("Fetch it with 'projsync', or set PROJ_NETWORK=OFF to do without.")
    assert "inf" not in told[2]  # its own datum needs no grid


@pytest.mark.slow
def test_commands_say_so_and_end_with_1(tmp_path):
    """Data and regions that need the grid make one line; with PROJ_NETWORK=OFF they do without."""
    shapely = pytest.importorskip("shapely")
    data = write_layer(tmp_path / "data.gpkg", [shapely.box(400e3, 300e3, 401e3, 301e3)], "EPSG:27700")
    region = ("compare", "robin", "-r", f"file:{data}", "--tolerance", "1e-3")
    for words in (("check", str(data), "--crs", "EPSG:3035"), region):
        done = run("-m", "projdist", *words, **NOWHERE)
        assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
        assert done.stderr.startswith("projdist: Invalid coordinates. PROJ cannot read a grid")
        assert run("-m", "projdist", *words, PROJ_NETWORK="OFF").returncode == 0


def refusing(reason_of):
    """A transformer that loses each point for a reason of its own."""

    def transform(u, v, **_):
        raise ProjError(f"transform error: {reason_of(u)}")

    return types.SimpleNamespace(transform=transform)


@pytest.mark.parametrize(("count", "first"), [(2, 1), (300, 299), (100_000, 99_000)])
def test_every_lost_point_is_asked(count, first):
    """The first may lie beyond the map where the others need a grid; of many lost points 300 are asked."""
    u = np.arange(count, dtype=float)
    beyond, unread = "Point outside of projection domain", "Network error when accessing a remote resource"
    lost = np.full(count, np.inf)
    with pytest.raises(GridError, match="Network error"):
        check_grids(refusing(lambda u: unread if u >= first else beyond), (u, u), lost)
    check_grids(refusing(lambda u: beyond), (u, u), lost)
    lost[first:] = 0.0
    check_grids(refusing(lambda u: unread if u >= first else beyond), (u, u), lost)


def test_a_pipeline_without_its_grid_is_refused():
    """A step whose grid is missing is no map; an optional one (@) is passed over, as in PROJ."""
    steps = "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=hgridshift +grids={}nosuch.tif"
    assert "hgridshift (File not found or invalid)" in message(f"{steps.format('')} +step +proj=merc +R=1")
    assert np.isfinite(make(f"{steps.format('@')} +step +proj=merc +R=1")(10.0, 20.0)).all()


def test_points_beyond_a_map_are_no_matter_of_grids():
    lon, lat = data_crs_of(make("moll"), "ESRI:54009").degrees(np.array([1.8e7, 0.0]), np.array([8e6, 0.0]))
    assert np.isnan(lon[0])
    np.testing.assert_allclose((lon[1], lat[1]), 0.0, atol=1e-9)
