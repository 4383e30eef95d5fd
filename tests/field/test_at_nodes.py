"""Fixed nodes of regions: areas, means, Jacobians."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tables import each

from projdist import GLOBE, SPHERE, WGS84, Box, Cap, PointSet, Projection, get_region, jacobian
from projdist.field.sampling import nodes_at, nodes_of

REGIONS = ["globe", "box:-10,35,30,70", "box:170,-60,-170,-50", "box:0,80,90,90", "cap:10,50,3000", "cap:0,90,2000"]
MAPS = [
    "+proj=lcc +lat_1=30 +lat_2=60 +ellps=WGS84",
    "+proj=laea +lat_0=50 +lon_0=10 +ellps=WGS84",
    "+proj=wintri +lon_0=5 +R=6371000",
]


@each("name", REGIONS)
@each("count", [40, 300, 3000])
def test_nodes_are_in_their_region(name: str, count: int) -> None:
    """As many as were asked for, by a factor of three; with weights that sum to 1, also with edges."""
    region = get_region(name)
    nodes = nodes_of(region, WGS84, count, edges=True)
    inside = nodes.weight > 0
    assert count / 3 < inside.sum() < 3 * count
    assert region.contains(nodes.lon[inside], nodes.lat[inside]).all()
    assert nodes.weight.sum() == pytest.approx(1.0)
    assert (~inside).sum() > 8


def test_means_are_spectral() -> None:
    """The mean of sin^2 of the latitude is 1/3 on the sphere, to rounding."""
    nodes = nodes_of(GLOBE, SPHERE, 2000)
    assert_allclose(np.sum(nodes.weight * np.sin(np.radians(nodes.lat)) ** 2), 1 / 3, atol=1e-9)


def test_edges_hold_the_corners() -> None:
    """Extremes of boxes lie in corners more often than not."""
    nodes = nodes_of(Box(1.0, 2.0, 5.0, 9.0), WGS84, 100, edges=True)
    corners = {(1.0, 2.0), (5.0, 2.0), (1.0, 9.0), (5.0, 9.0)}
    assert corners <= {(round(x, 9), round(y, 9)) for x, y in zip(nodes.lon, nodes.lat, strict=True)}


@pytest.mark.slow
def test_polygons() -> None:
    """The middle of a triangle to 1e-4, and points all along its sides."""
    ring = [[0.0, 0.0], [30.0, 0.0], [0.0, 30.0], [0.0, 0.0]]
    region = get_region({"type": "Polygon", "coordinates": [ring]})
    nodes = nodes_of(region, SPHERE, 1000, edges=True)
    flat = nodes.weight / np.cos(np.radians(nodes.lat))
    assert_allclose(np.array([nodes.lon, nodes.lat]) @ flat / flat.sum(), [10.0, 10.0], atol=1e-3)
    edge = nodes.weight == 0.0
    assert 0.6 * 1000 <= (~edge).sum() <= 4 * 1000
    distance = np.minimum(np.minimum(nodes.lon, nodes.lat), 30.0 - nodes.lon - nodes.lat)[edge]
    assert_allclose(distance, 0.0, atol=1e-9)
    assert np.diff(np.sort(nodes.lon[edge & (nodes.lat == 0.0)])).max() < 0.5


@pytest.mark.slow
@pytest.mark.parametrize("count", [100, 1000])
def test_islands_count_for_what_they_are(count: int) -> None:
    """Easter Island is 2e-4 of Chile, however few the nodes are."""
    nodes = nodes_of(get_region("country:CL"), WGS84, count)
    assert 1e-4 < nodes.weight[nodes.lon < -100].sum() < 4e-4


def test_sets_of_points() -> None:
    """Points stay what they are, fewer of them where there are too many."""
    points = PointSet(np.arange(10.0), np.arange(10.0), np.arange(1.0, 11.0))
    assert_allclose(nodes_of(points, WGS84, 10).weight, points.weight / 55.0)
    assert nodes_of(points, WGS84, 5).lon.size == 5


@each("definition", MAPS)
def test_jacobians_are_those_of_the_careful_differences(definition: str) -> None:
    """Fourth order with one step is as good as 1e-10 on smooth maps; the scale of the meridian is J's north column."""
    projection = Projection.from_user_input(definition)
    nodes = nodes_of(Cap(10.0, 50.0, 2500.0), projection.ellipsoid, 100)
    J, shown = nodes.jacobian(projection)
    assert shown.all()
    assert_allclose(J, jacobian(projection, nodes.lon, nodes.lat), atol=2e-10)
    assert_allclose(nodes.meridional_scale(projection), np.hypot(J[:, 0, 1], J[:, 1, 1]), rtol=1e-12)


def jacobians(definition: str, lon: list[float], lat: list[float]) -> tuple[np.ndarray, list[bool]]:
    """J at nodes, and which of them the map shows."""
    projection = Projection.from_user_input(definition)
    J, shown = nodes_at(np.array(lon), np.array(lat), np.ones(len(lon)), projection.ellipsoid).jacobian(projection)
    return J, shown.tolist()


def test_poles_are_ordinary_points() -> None:
    """The stencil lies in the tangent plane."""
    J, _ = jacobians("+proj=laea +lat_0=90 +R=6371000", [0.0, 30.0], [90.0, 89.9999])
    assert_allclose(np.linalg.svd(J, compute_uv=False), 1.0, atol=1e-7)


def test_seams_and_horizons() -> None:
    """Next to the antimeridian the careful differences step in; the far side of a map is not shown, and has no J."""
    lat = [60.0, 80.0, 0.0]
    J, shown = jacobians("+proj=eqc +R=6371000", [179.999, -179.99, 0.0], lat)
    assert all(shown)
    assert_allclose(J[:, 0, 0], 1.0 / np.cos(np.radians(lat)), rtol=1e-6)
    J, shown = jacobians("+proj=ortho +R=6371000", [0.0, 170.0], [0.0, 0.0])
    assert shown == [True, False]
    assert np.isnan(J[1]).all()


@each("lat", [89.0, 89.9, 89.99, -89.999])
def test_steps_beside_pole_lines(lat: float) -> None:
    """Where the parallels of plate carree are stretched without end steps are short: k is 1 / cos(lat) to 1e-5."""
    J, shown = jacobians("plate-carree", [10.0, -70.0], [lat, lat])
    assert all(shown)
    assert_allclose(J[:, 0, 0], 1.0 / np.cos(np.radians(lat)), rtol=1e-5)
    assert_allclose(J[:, 1, 1], 1.0, rtol=1e-9)


def test_all_nodes_doubtful() -> None:
    """Of a map that is torn everywhere there is no Jacobian; points that it shows are known all the same."""

    def noise(lon: np.ndarray, lat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return 1e7 * np.sin(1e7 * lon), 1e7 * np.cos(1e7 * lat)

    J, shown = nodes_of(Box(0, 0, 10, 10), SPHERE, 40).jacobian(Projection.from_user_input(noise))
    assert np.isnan(J).all()
    assert shown.all()


def test_every_vertex():
    """With all ends every vertex is a node of no weight, however many there are; else some."""
    region = get_region("country:CA")
    ends = {tuple(end) for end in region.edges[:, :2].tolist()}
    for all_ends in (True, False):
        nodes = nodes_of(region, WGS84, 100, edges=True, all_ends=all_ends)
        beside = nodes.weight == 0.0
        found = set(zip(nodes.lon[beside].tolist(), nodes.lat[beside].tolist(), strict=True))
        assert (ends <= found) == all_ends
