"""Projections, indicatrices and heat maps for cartopy, against PROJ's coordinates and cartopy's own maps."""

import copy
import io
import pickle
import sys

import numpy as np
import pyproj
import pytest
import shapely
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from refusals import refuses

import projdist
from projdist.earth import SPHERE, land
from projdist.plots import add_heatmap, add_tissot, to_cartopy
from projdist.projections import Projection, ProjectionError

pytestmark = pytest.mark.slow

crs = pytest.importorskip("cartopy.crs")

# Maps and what PROJ knows them by.
WORLD = {
    "robinson": "+proj=robin +R=6371008.7714", "equal-earth": "+proj=eqearth +R=6371008.7714",
    "winkel-tripel": "+proj=wintri +R=6371008.7714 +lat_1=50.4597762521898", "igh": "+proj=igh +R=6371008.7714",
    "+proj=laea +lat_0=52 +lon_0=10": "+proj=laea +lat_0=52 +lon_0=10 +ellps=GRS80",
}  # fmt: skip
PARTS = {"EPSG:3035": (-10, 35, 30, 70), "EPSG:2193": (167, -47, 178, -34.5), "EPSG:2263": (-74.2, 40.5, -72, 41.2)}
SAME = 1e-6  # metres: twelve digits of 1e7 m, lost twice
# Cartopy's globe with the mean radius of the Earth.
GLOBE = crs.Globe(ellipse=None, semimajor_axis=6371008.7714, semiminor_axis=6371008.7714)


def grid(west: float, south: float, east: float, north: float) -> tuple[np.ndarray, np.ndarray]:
    """Places well within bounds and off seams on whole degrees."""
    lon, lat = np.meshgrid(np.linspace(west, east, 74)[1:-1], np.linspace(south, north, 60)[1:-1])
    return lon.ravel(), lat.ravel()


@pytest.mark.parametrize("name", WORLD)
def test_world_maps_have_the_coordinates_of_proj(name: str) -> None:
    """Longitudes and latitudes are taken for the map's own; all images lie within the edge of the map."""
    found, (lon, lat) = to_cartopy(name), grid(-180.0, -90.0, 180.0, 90.0)
    truth = np.column_stack(pyproj.Proj(WORLD[name])(lon, lat))
    source = crs.Geodetic() if "laea" in name else crs.Geodetic(globe=GLOBE)
    np.testing.assert_allclose(found.transform_points(source, lon, lat)[:, :2], truth, rtol=0, atol=SAME)
    assert found.domain.is_valid
    assert shapely.contains_xy(found.domain, *truth.T).all()
    for other in (copy.deepcopy(found), pickle.loads(pickle.dumps(found))):  # as figures are copied and kept
        assert (other, other.bounds) == (found, found.bounds)
        assert other.boundary.equals(found.boundary)
    assert repr(found).startswith("<cartopy CRS of ")
    assert found.x_limits[0] < truth[:, 0].min() < truth[:, 0].max() < found.x_limits[1]
    assert found.y_limits[0] < truth[:, 1].min() < truth[:, 1].max() < found.y_limits[1]


@pytest.mark.parametrize("name", PARTS)
def test_crs_have_their_own_coordinates(name: str) -> None:
    """In their own unit, easting first, within the area of use."""
    found, (lon, lat) = to_cartopy(name), grid(*PARTS[name])
    transformer = pyproj.Transformer.from_crs(pyproj.CRS(name).geodetic_crs, name, always_xy=True)
    truth = np.column_stack(transformer.transform(lon, lat))
    assert shapely.contains_xy(found.domain, *truth.T).all()
    source = pyproj.Transformer.from_crs(pyproj.CRS(name).geodetic_crs, found, always_xy=True)
    np.testing.assert_allclose(np.column_stack(source.transform(lon, lat)), truth, rtol=0, atol=SAME)


@pytest.mark.parametrize(("name", "own", "share"), [
    ("robinson", "Robinson", 2e-3), ("equal-earth", "EqualEarth", 2e-3), ("igh", "InterruptedGoodeHomolosine", 4e-3),
])  # fmt: skip
def test_edges_are_those_of_cartopy(name: str, own: str, share: float) -> None:
    """By the area of what is in one and not in the other, on the same sphere; cartopy's have 2 to 6 degrees a chord."""
    theirs = shapely.Polygon(getattr(crs, own)(globe=GLOBE).boundary)
    ours = to_cartopy(name).domain
    assert shapely.symmetric_difference(theirs.buffer(0), ours).area < share * ours.area


def test_edge_around_a_region() -> None:
    """On plate carree it is the box around the region; a map in two pieces has no edge, and is refused."""
    refuses(r"It must be a map in one piece; this one has 2\.$", to_cartopy, "bipc")
    found = to_cartopy("+proj=eqc +R=6371008.7714", region="cap:10,50,500").bounds
    bounds = np.radians(projdist.get_region("cap:10,50,500", SPHERE).bounds)
    np.testing.assert_allclose(found, bounds[[0, 2, 1, 3]] * 6371008.7714, rtol=1e-3)


def test_geometries_and_gridlines_are_drawn() -> None:
    """On an interrupted map no line runs from lobe to lobe: land has the area that it has on the ground."""
    found, plate = to_cartopy("igh"), crs.PlateCarree(globe=GLOBE)
    drawn = found.project_geometry(shapely.segmentize(land("110m"), 2.0), plate)
    ax = Figure().add_subplot(projection=found)
    ax.add_geometries([land("110m")], crs=plate)
    ax.gridlines()
    ax.figure.savefig(io.BytesIO(), dpi=30)
    assert drawn.area == pytest.approx(projdist.get_region("land@110m").area_km2 * 1e6, rel=5e-3)


@pytest.mark.parametrize("projection", ["EPSG:2263", "mollweide", crs.Mollweide(), crs.PlateCarree(150.0)])
def test_ellipses_are_on_their_places(projection: object) -> None:
    """Their middles are images of points, in the unit of the axes; the view stays as it was."""
    chosen = to_cartopy(projection) if isinstance(projection, str) else projection
    ax = Figure().add_subplot(projection=chosen)
    before = ax.get_xlim(), ax.get_ylim()
    radius = add_tissot(ax)
    (drawn,) = [one for one in ax.collections if isinstance(one, PolyCollection)]
    rims = np.array([path.vertices[:-1] for path in drawn.get_paths()])
    middles = 0.5 * (rims.min(axis=1) + rims.max(axis=1))
    assert radius > 0.0
    assert shapely.contains_xy(shapely.Polygon(chosen.boundary).buffer(0), *middles.T).mean() > 0.95
    assert len(middles) > 20
    assert (ax.get_xlim(), ax.get_ylim()) == before


def test_ellipses_of_plate_carree() -> None:
    """In degrees: a circle on the equator is as high as on the ground, and 1 / cos(lat) times as wide at a latitude."""
    ax = Figure().add_subplot(projection=crs.PlateCarree())
    assert add_tissot(ax, step=20.0, radius=1e5) == 1e5
    (drawn,) = [one for one in ax.collections if isinstance(one, PolyCollection)]
    metres = pyproj.Geod(ellps="WGS84").inv
    for path in drawn.get_paths():
        low, high = path.vertices.min(axis=0), path.vertices.max(axis=0)
        lon, lat = 0.5 * (low + high)
        ends = (lon - 1e-3, lat, lon + 1e-3, lat), (lon, lat - 1e-3, lon, lat + 1e-3)
        degrees = [1e5 * 2e-3 / metres(*points)[2] for points in ends]
        np.testing.assert_allclose((high - low) / 2.0, degrees, rtol=2e-3)  # 72 vertices


def test_heat_maps() -> None:
    """The colours of Mercator's angles: none; of its scale 1 / cos(lat) on the sphere, at the triangles' corners."""
    ax = Figure().add_subplot(projection=crs.Mercator(globe=GLOBE))
    before = ax.get_xlim(), ax.get_ylim()
    scale = add_heatmap(ax, measure="a", region=(-60.0, -60.0, 60.0, 60.0))
    assert scale.measure.symbol == "a"
    colours = next(one for one in ax.collections if hasattr(one, "_triangulation"))
    y = colours._triangulation.y
    np.testing.assert_allclose(colours.get_array(), np.cosh(y / 6371008.7714), rtol=1e-9)
    assert (ax.get_xlim(), ax.get_ylim()) == before
    ax.figure.savefig(io.BytesIO(), dpi=30)


def test_what_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    for wrong in (lambda lon, lat: (lon, lat), Projection.from_function(lambda lon, lat: (lon, lat), name="mine")):
        with pytest.raises(ProjectionError, match=r"for cartopy. It must be one that PROJ has a CRS for\.$"):
            to_cartopy(wrong)
    for draw in (add_tissot, add_heatmap):
        refuses(r"It must be GeoAxes of cartopy\.$", draw, Figure().add_subplot())
    monkeypatch.setitem(sys.modules, "cartopy.crs", None)
    with pytest.raises(ImportError, match=r"^Invalid .* It needs cartopy: pip install 'projdist\[cartopy\]'.$"):
        to_cartopy("robinson")
