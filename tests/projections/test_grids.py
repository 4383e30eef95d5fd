"""Points that PROJ has no coordinates of because it cannot read a grid are told from points beyond a map."""

import os
import subprocess
import sys

import numpy as np
import pytest
from projection_points import make
from pyproj.exceptions import ProjError

from projdist.projections import GridError, ProjectionError, geographic
from projdist.projections.operations import check_grids

# Nobody listens there: fetching a grid fails at once, with a network or without.
NOWHERE = {"PROJ_NETWORK": "ON", "PROJ_NETWORK_ENDPOINT": "http://127.0.0.1:9"}
BRITAIN = """
from projdist import Projection
from projdist.projections import geographic, unprojected
from projdist.projections.coordinates import to_lonlat
import numpy as np

x, y = np.array([400000.0]), np.array([300000.0])
for place in (
    lambda: geographic(Projection.from_user_input("EPSG:3035"), "EPSG:27700", x, y),
    lambda: to_lonlat("EPSG:27700")(x, y),
):
    try:
        print(place())
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


def assert_told(*words):
    """Without the grid a command is one line and ends with 1; with nothing to fetch it succeeds."""
    done = run("-m", "projdist", *words, **NOWHERE)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith("projdist: Invalid coordinates. PROJ cannot read a grid")
    assert done.stderr.count("\n") == 1
    assert run("-m", "projdist", *words, PROJ_NETWORK="OFF").returncode == 0


@pytest.mark.slow
def test_the_command_says_so_and_ends_with_1(tmp_path):
    """`check` of data that need the grid is one line, and no table of features beyond the edge."""
    geopandas = pytest.importorskip("geopandas")
    shapely = pytest.importorskip("shapely")
    data = geopandas.GeoDataFrame(geometry=[shapely.box(400e3, 300e3, 401e3, 301e3)], crs="EPSG:27700")
    data.to_file(tmp_path / "data.gpkg")
    assert_told("check", str(tmp_path / "data.gpkg"), "--crs", "EPSG:3035")


@pytest.mark.slow
def test_a_region_that_needs_the_grid(tmp_path):
    """Nothing is wrong with it: one line and 1, not 2."""
    ring = "[[400000,300000],[401000,300000],[401000,301000],[400000,300000]]"
    crs = '"crs":{"type":"name","properties":{"name":"EPSG:27700"}}'
    (tmp_path / "r.geojson").write_text(f'{{"type":"Polygon",{crs},"coordinates":[{ring}]}}')
    assert_told("compare", "robin", "-r", f"file:{tmp_path / 'r.geojson'}", "--tolerance", "1e-3")


class Refusing:
    """A transformer that loses each point for a reason of its own."""

    def __init__(self, reasons):
        self.reasons = reasons

    def transform(self, u, v, **_):
        """PROJ's error."""
        raise ProjError(f"transform error: {self.reasons(u)}")


@pytest.mark.parametrize(("count", "first"), [(2, 1), (300, 299), (100_000, 99_000)])
def test_every_lost_point_is_asked(count, first):
    """The first may lie beyond the map where the others need a grid; of many lost points 300 are asked."""
    u = np.arange(count, dtype=float)
    beyond, unread = "Point outside of projection domain", "Network error when accessing a remote resource"
    lost = np.full(count, np.inf)
    with pytest.raises(GridError, match="Network error"):
        check_grids(Refusing(lambda u: unread if u >= first else beyond), (u, u), lost)
    check_grids(Refusing(lambda u: beyond), (u, u), lost)
    lost[first:] = 0.0
    check_grids(Refusing(lambda u: unread if u >= first else beyond), (u, u), lost)


def test_a_pipeline_without_its_grid_is_refused():
    """A step whose grid is missing is no map; an optional one (@) is passed over, as in PROJ."""
    steps = "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=hgridshift +grids={}nosuch.tif"
    with pytest.raises(ProjectionError, match=r"hgridshift \(File not found or invalid\)"):
        make(f"{steps.format('')} +step +proj=merc +R=1")
    assert np.isfinite(make(f"{steps.format('@')} +step +proj=merc +R=1")(10.0, 20.0)).all()


def test_points_beyond_a_map_are_no_matter_of_grids():
    """What lies beyond the edge of a map stays NaN."""
    lon, lat = geographic(make("moll"), "ESRI:54009", np.array([1.8e7, 0.0]), np.array([8e6, 0.0]))
    assert np.isnan(lon[0])
    np.testing.assert_allclose((lon[1], lat[1]), 0.0, atol=1e-9)
