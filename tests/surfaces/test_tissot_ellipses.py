"""Tissot's indicatrices: true ellipses, as large as they can be without overlap, none across a seam."""

import numpy as np
import pytest
import shapely
from gis_files import some_slow
from refusals import refuses
from tables import each

from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS as R, destination
from projdist.field.at_points import jacobian
from projdist.matrices.measures import principal_scales
from projdist.projections import Projection
from projdist.regions import GLOBE
from projdist.surfaces import tissot_ellipses
from projdist.surfaces.domain import domain_of, even_grid, graticule_grid
from projdist.surfaces.tissot_ellipses import Indicatrices, close_pairs, ellipses, exaggerated, fit, indicatrices

OBLIQUE = f"+proj=ob_tran +o_proj=moll +o_lat_p=40 +o_lon_p=60 +R={R}"
ORTHO = f"+proj=ortho +lat_0=40 +lon_0=10 +R={R}"


def panel_of(projection: str, step: float) -> Indicatrices:
    domain = domain_of(Projection.from_user_input(projection), None)
    return indicatrices(domain, domain.region, *even_grid(domain.region.bounds, step))


def overlapping(panel: Indicatrices, radius: float) -> bool:
    """Whether any two ellipses of a panel share a point."""
    shapes = shapely.polygons(ellipses(panel, radius, 72))
    one, other = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    return bool((one != other).any())


def test_ellipses_are_those_of_the_jacobian() -> None:
    """Area pi r^2 |det J|, semi-axes r a and r b, centre f(p), for every ellipse."""
    panel, radius = panel_of("winkel-tripel", 30.0), 3e5
    polygons = ellipses(panel, radius, 720)
    J = jacobian(panel.domain.projection, panel.lon, panel.lat)
    area = shapely.area(shapely.polygons(polygons))
    np.testing.assert_allclose(area, np.pi * radius**2 * np.abs(np.linalg.det(J)), rtol=2e-5)
    distance, scales = np.linalg.norm(polygons - panel.xy[:, None], axis=-1), principal_scales(J)
    np.testing.assert_allclose(distance.max(axis=1), radius * scales[:, 0], rtol=1e-4)
    np.testing.assert_allclose(distance.min(axis=1), radius * scales[:, 1], rtol=1e-3)
    # The inverse Jacobian takes every ellipse back to a circle of the radius: sheared ones, too.
    panel = panel_of("sinusoidal", 45.0)
    back = np.linalg.solve(panel.J[:, None], (ellipses(panel, 2e5, 36) - panel.xy[:, None])[..., None])[..., 0]
    np.testing.assert_allclose(np.linalg.norm(back, axis=-1), 2e5, rtol=1e-9)


@pytest.mark.slow
@each("projection", ["robin", "eqc", "igh", "merc", ORTHO, "EPSG:32632"])
def test_ellipses_do_not_overlap(projection: str) -> None:
    radius, (panel,) = fit([panel_of(projection, 4.0 if projection == "EPSG:32632" else 15.0)])
    assert not overlapping(panel, radius)
    assert panel.lon.size > 12


def test_ellipses_are_not_needlessly_small() -> None:
    """The closest two would touch with a radius that is 30 % larger; of exaggerated ones the radius is found anew."""
    radius, (panel,) = fit([panel_of("robin", 15.0)])
    assert overlapping(panel, 1.3 * radius)
    radius, (panel,) = fit([panel_of("EPSG:2154", 2.0)], exaggeration=200.0)
    assert not overlapping(panel, radius)


@pytest.mark.parametrize("projection", some_slow(["igh", OBLIQUE, ORTHO], {OBLIQUE}))
def test_circles_do_not_cross_seams(projection: str) -> None:
    """The small circle of each ellipse drawn is mapped without a jump, and wholly."""
    radius, (panel,) = fit([panel_of(projection, 15.0)])
    radius *= 0.98  # of which parts between the azimuths that were tried may be beyond the limb
    azimuths, centres = np.linspace(0.0, 360.0, 361), (panel.lon[:, None], panel.lat[:, None])
    x, y = panel.domain(*destination(*centres, azimuths, np.degrees(radius / R)))
    largest = 4.0 * np.radians(1.0) * radius * principal_scales(panel.J)[:, :1]
    assert (np.hypot(np.diff(x, axis=1), np.diff(y, axis=1)) < largest).all()


def test_grids() -> None:
    """Points of even ones are in rings, as many as the ring is long, and none at a pole."""
    lon, lat = even_grid(GLOBE.bounds, 15.0)
    rings, counts = np.unique(lat, return_counts=True)
    np.testing.assert_allclose(rings, np.arange(-82.5, 90.0, 15.0))
    np.testing.assert_array_equal(counts, np.round(24 * np.cos(np.radians(rings))))
    assert np.abs(lon).max() < 180.0
    for step in (0.0, -1.0, np.nan, np.inf):
        refuses(rf"Invalid step '{step}'. It must be a positive number of degrees.", even_grid, GLOBE.bounds, step)
    refuses(r"Invalid step '0.1'. It makes 4,125,296 ellipses, and at most 200,000", even_grid, GLOBE.bounds, 0.1)
    refuses(r"Invalid radius 'inf'. It must be a positive number of metres.", fit, [panel_of("robin", 30.0)], np.inf)
    # Those of the graticule are multiples of its steps, no pole, no meridian twice.
    lon, lat = graticule_grid(GLOBE.bounds, 30.0, 60.0)
    assert sorted(set(lat)) == [-60.0, -30.0, 0.0, 30.0, 60.0]
    assert sorted(set(lon)) == [-180.0, -120.0, -60.0, 0.0, 60.0, 120.0]
    refuses(r"Invalid grid '0.1,0.1'. At most 200,000 ellipses are drawn.", graticule_grid, GLOBE.bounds, 0.1, 0.1)


@pytest.mark.slow
@pytest.mark.parametrize("projection", ["robin", "eqc", "cea", "merc", OBLIQUE])
def test_close_pairs_are_all_there_are(projection: str) -> None:
    """The pairs found are those of comparing each with each, up to the median of the closest."""
    panel = panel_of(projection, 12.0)
    count = panel.lon.size
    touching = np.zeros((count, count))
    for angle in np.linspace(0.0, np.pi, 48, endpoint=False):
        d = np.array([np.cos(angle), np.sin(angle)])
        centre, half = panel.xy @ d, np.linalg.norm(d @ panel.J, axis=1)
        touching = np.maximum(touching, np.abs(centre[:, None] - centre) / (half[:, None] + half))
    touching[np.diag_indices(count)] = np.inf
    usual = np.sort(touching.min(axis=1))[count // 2]
    pairs, radii, found_usual = close_pairs(panel)
    assert found_usual == pytest.approx(usual, rel=1e-12)
    np.testing.assert_allclose(radii, touching[tuple(pairs.T)], rtol=1e-12)
    surely = np.argwhere(np.triu(touching < usual * (1 - 1e-9)))
    assert set(map(tuple, surely)) <= set(map(tuple, pairs))
    assert (pairs[:, 0] < pairs[:, 1]).all()
    if projection == "robin":  # The pairs of 10,000 ellipses are a few for each, and not their square.
        panel = panel_of("robin", 2.0)
        assert panel.lon.size > 10_000
        assert len(close_pairs(panel)[0]) < 4 * panel.lon.size


def test_exaggeration() -> None:
    """Mercator's J is k times the unit matrix: k^n with a factor n. Axes and orientations stay."""
    panel = panel_of("mercator", 30.0)
    k = 1.0 / np.cos(np.radians(panel.lat))
    np.testing.assert_allclose(exaggerated(panel.J, 3.0), k[:, None, None] ** 3 * np.eye(2), rtol=1e-8, atol=1e-8)
    panel = panel_of("sinusoidal", 30.0)
    larger = exaggerated(panel.J, 2.5)
    np.testing.assert_allclose(principal_scales(larger), principal_scales(panel.J) ** 2.5, rtol=1e-9)
    np.testing.assert_allclose(larger @ np.swapaxes(panel.J, 1, 2), panel.J @ np.swapaxes(larger, 1, 2), atol=1e-9)
    np.testing.assert_allclose(exaggerated(panel.J, 1.0), panel.J, rtol=1e-12, atol=1e-12)
    # A UTM zone's scales are within 4e-4 of one: a thousand times as much is seen; a world map needs none.
    assert tissot_ellipses.usual_exaggeration([panel_of("EPSG:32632", 4.0)]) in (500.0, 1000.0)
    assert tissot_ellipses.usual_exaggeration([panel]) == 1.0


def test_axes_are_those_of_the_ellipses() -> None:
    """Plate carrée: east-west 1 / cos(lat), north-south 1; circles on the equator have none."""
    panel = panel_of("plate-carree", 30.0)
    segments = tissot_ellipses.principal_axes(panel, 1e5)
    lengths = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).reshape(-1, 2)
    stretched = np.abs(panel.lat) > 1e-3
    np.testing.assert_allclose(lengths[:, 0], 2e5 / np.cos(np.radians(panel.lat[stretched])), rtol=1e-9)
    np.testing.assert_allclose(lengths[:, 1], 2e5, rtol=1e-9)
    assert np.ptp(segments[::2, :, 1], axis=1) == pytest.approx(0.0, abs=1e-3)
