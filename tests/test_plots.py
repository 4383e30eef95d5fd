"""Pictures: true ellipses without overlap, seams that nothing crosses, limits, labels, files."""

from pathlib import Path

import numpy as np
import pytest
import shapely
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.image import imread

from projdist import plots
from projdist.derivatives import jacobian
from projdist.ellipsoid import MEAN_EARTH_RADIUS as R
from projdist.measures import get_measure, principal_scales
from projdist.plots.basemap import graticule_step, map_size
from projdist.plots.domain import GLOBE, Box, domain_of, longitude_width
from projdist.plots.fields import colour_scale, field, level_labels
from projdist.plots.indicatrices import ellipses, even_grid, fit, indicatrices
from projdist.plots.lines import coast, graticule, project_lines
from projdist.plots.mesh import Mesh, build_mesh
from projdist.projections import Projection

GOLDEN = Path(__file__).parent / "golden"
OBLIQUE = f"+proj=ob_tran +o_proj=moll +o_lat_p=40 +o_lon_p=60 +R={R}"
ORTHO = f"+proj=ortho +lat_0=40 +lon_0=10 +R={R}"
EUROPE = Box((-10.0, 35.0, 40.0, 70.0))
SEAMED = ["robin", "igh", "tmerc", "healpix", "peirce_q", OBLIQUE, ORTHO, f"+proj=laea +lat_0=52 +lon_0=10 +R={R}"]


def mesh_of(projection: object, region: plots.Region | None = None, step: float | None = 2.0) -> Mesh:
    return build_mesh(domain_of(Projection.from_user_input(projection), region), step)


def spans(start: np.ndarray, stop: np.ndarray) -> np.ndarray:
    return np.hypot(*(stop - start).T)


# ---- indicatrices ---------------------------------------------------------------------------


def test_ellipses_are_those_of_the_jacobian() -> None:
    """Area pi r^2 |det J|, semi-axes r a and r b, centre f(p), for every ellipse."""
    panel = indicatrices(domain_of(Projection.from_user_input("winkel-tripel"), None), 30.0)
    radius = 3e5
    polygons = ellipses(panel, radius, vertices=720)
    J = jacobian(panel.domain.projection, panel.lon, panel.lat)
    x, y = np.moveaxis(polygons, -1, 0)
    area = 0.5 * np.abs(np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1))
    np.testing.assert_allclose(area, np.pi * radius**2 * np.abs(np.linalg.det(J)), rtol=2e-5)
    distance = np.linalg.norm(polygons - panel.xy[:, None], axis=-1)
    scales = principal_scales(J)
    np.testing.assert_allclose(distance.max(axis=1), radius * scales[:, 0], rtol=1e-4)
    np.testing.assert_allclose(distance.min(axis=1), radius * scales[:, 1], rtol=1e-3)


@pytest.mark.parametrize("projection", ["robin", "eqc", "igh", "merc", ORTHO, "EPSG:32632"])
def test_ellipses_do_not_overlap(projection: str) -> None:
    """No two ellipses of a panel share a point, and there are many."""
    domain = domain_of(Projection.from_user_input(projection), None)
    radius, (panel,) = fit([indicatrices(domain, 4.0 if projection == "EPSG:32632" else 15.0)])
    shapes = shapely.polygons(ellipses(panel, radius))
    tree = shapely.STRtree(shapes)
    one, other = tree.query(shapes, predicate="intersects")
    assert (one == other).all()
    assert len(shapes) > 12


def test_ellipses_are_not_needlessly_small() -> None:
    """The closest two ellipses would touch with a radius that is 30 % larger."""
    radius, (panel,) = fit([indicatrices(domain_of(Projection.from_user_input("robin"), None), 15.0)])
    shapes = shapely.polygons(ellipses(panel, 1.3 * radius))
    one, other = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    assert (one != other).any()


def test_panels_share_radius_and_scale() -> None:
    """All panels have the same circles and the same metres per inch."""
    figure = plots.tissot_figure(["robin", "laea"], region=EUROPE)
    scales = []
    for ax in figure.axes:
        width = ax.get_position().width * figure.get_figwidth()
        height = ax.get_position().height * figure.get_figheight()
        assert np.ptp(ax.get_xlim()) / width == pytest.approx(np.ptp(ax.get_ylim()) / height, rel=1e-6)
        scales.append(np.ptp(ax.get_xlim()) / width)
    assert scales == pytest.approx([scales[0]] * 2, rel=1e-6)


@pytest.mark.parametrize("projection", ["igh", OBLIQUE, ORTHO])
def test_circles_do_not_cross_seams(projection: str) -> None:
    """The small circle of each ellipse drawn is mapped without a jump, and wholly."""
    radius, (panel,) = fit([indicatrices(domain_of(Projection.from_user_input(projection), None), 15.0)])
    radius *= 0.98  # of which parts between the azimuths that were tried may be beyond the limb
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    sin, cos = np.sin(radius / R), np.cos(radius / R)
    lat, lon = np.radians(panel.lat)[:, None], np.radians(panel.lon)[:, None]
    lats = np.arcsin(np.sin(lat) * cos + np.cos(lat) * sin * np.cos(angle))
    lons = lon + np.arctan2(np.sin(angle) * sin * np.cos(lat), cos - np.sin(lat) * np.sin(lats))
    x, y = panel.domain(np.degrees(lons), np.degrees(lats))
    steps = np.hypot(np.diff(x, axis=1), np.diff(y, axis=1))
    a = principal_scales(panel.J)[:, 0]
    assert (steps < 4.0 * np.radians(1.0) * radius * a[:, None]).all()


def test_even_grid() -> None:
    """Points are in rings, as many as the ring is long, and none at a pole."""
    lon, lat = even_grid(GLOBE.bounds, 15.0)
    rings, counts = np.unique(lat, return_counts=True)
    np.testing.assert_allclose(rings, np.arange(-82.5, 90.0, 15.0))
    np.testing.assert_array_equal(counts, np.round(24 * np.cos(np.radians(rings))))
    assert np.abs(lon).max() < 180.0


# ---- seams and outlines ---------------------------------------------------------------------


@pytest.mark.parametrize("projection", SEAMED)
def test_nothing_crosses_a_seam(projection: str) -> None:
    """No triangle, and no segment of graticule, coast and outline, is longer than the local scale allows."""
    mesh = mesh_of(projection)
    size = map_size(mesh)
    inside = np.flatnonzero(np.isfinite(mesh.x[: mesh.nodes]))
    lon, lat = (value[inside] for value in mesh.lonlat())
    largest = np.nanmax(principal_scales(jacobian(mesh.domain.projection, lon, lat))[:, 0])
    # 2 degrees of mesh along the diagonal, and twice that next to singular points.
    allowed = min(2.0 * np.radians(2.0 * np.sqrt(2.0)) * R * largest, 0.15 * size)
    corners = np.stack([mesh.x, mesh.y], axis=-1)[mesh.triangles]
    assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max() < allowed
    assert spans(*np.swapaxes(mesh.outline, 0, 1)).max() < allowed
    for lines in (graticule(GLOBE.bounds, 30.0), coast(mesh.domain, "110m", 1.0)):
        pieces = project_lines(mesh.domain, lines, size)
        assert max(spans(piece[:-1], piece[1:]).max() for piece in pieces) < min(allowed, 0.05 * size)


@pytest.mark.parametrize("projection", SEAMED)
def test_mesh_covers_the_map_once(projection: str) -> None:
    """The triangles' area is that of the map, det J integrated over the drawn nodes."""
    mesh = mesh_of(projection, step=1.0)
    corners = np.stack([mesh.x, mesh.y], axis=-1)[mesh.triangles]
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]).sum()
    inner = np.isfinite(mesh.x[: mesh.nodes]) & (np.abs(mesh.v[: mesh.nodes]) < 89.9)
    lon, lat = (value[: mesh.nodes][inner] for value in mesh.lonlat())
    density = get_measure("areal_scale")(jacobian(mesh.domain.projection, lon, lat))
    step_u, step_v = 360.0 / mesh.shape[1], 180.0 / (mesh.shape[0] - 2)
    ground = R**2 * np.radians(step_u) * np.radians(step_v) * np.cos(np.radians(mesh.v[: mesh.nodes][inner]))
    assert area == pytest.approx(np.nansum(density * ground), rel=0.01)


def test_outline_of_plate_carree_is_the_rectangle() -> None:
    """All of the outline is on the rectangle, and its length is the perimeter."""
    mesh = mesh_of("eqc")
    points = np.abs(mesh.outline) / (np.pi * R)
    on_side = np.abs(points[..., 0] - 1.0) < 1e-6
    on_top = np.abs(points[..., 1] - 0.5) < 1e-6
    assert (on_side | on_top).all()
    assert spans(*np.swapaxes(mesh.outline, 0, 1)).sum() == pytest.approx(6.0 * np.pi * R, rel=1e-4)


def test_outline_of_orthographic_is_the_circle() -> None:
    """The outline is at the distance R from the centre, all the way round."""
    mesh = mesh_of(ORTHO)
    assert np.abs(np.linalg.norm(mesh.outline, axis=-1) / R - 1.0).max() < 1e-6
    assert spans(*np.swapaxes(mesh.outline, 0, 1)).sum() == pytest.approx(2.0 * np.pi * R, rel=2e-3)


def test_outline_at_an_antipode() -> None:
    """The antipode of an oblique equal-area map is a full circle of radius 2 R."""
    mesh = mesh_of(f"+proj=laea +lat_0=52 +lon_0=10 +R={R}")
    assert np.abs(np.linalg.norm(mesh.outline, axis=-1) / (2.0 * R) - 1.0).max() < 1e-6
    assert spans(*np.swapaxes(mesh.outline, 0, 1)).sum() == pytest.approx(4.0 * np.pi * R, rel=2e-3)


def test_outline_of_goode_has_its_cuts() -> None:
    """The outline of Goode's interrupted map is as long as its meridians: two round, four cuts, both sides."""
    mesh = mesh_of("igh", step=None)
    ends = mesh.outline.reshape(-1, 2)
    projection = mesh.domain.projection
    lat = np.linspace(0.0, 90.0, 1000)[:-1]
    length = 0.0
    for sign, meridians in ((1.0, (-180.0, -40.0, 180.0)), (-1.0, (-180.0, -100.0, -20.0, 80.0, 180.0))):
        for meridian in meridians:
            for side in (-1e-7, 1e-7):
                if abs(meridian + side) < 180.0:
                    x, y = projection(meridian + side, sign * lat)
                    length += np.hypot(np.diff(x), np.diff(y)).sum()
    assert spans(*np.swapaxes(mesh.outline, 0, 1)).sum() == pytest.approx(length, rel=0.02)
    assert np.abs(ends[:, 0]).max() == pytest.approx(np.pi * R, rel=1e-3)


def test_endless_maps_are_cut() -> None:
    """Mercator ends where its scale is 12, at 85.2 degrees; the gnomonic map about 73 degrees from its centre."""
    assert mesh_of("merc").extent[3] / R == pytest.approx(np.arccosh(12.0), abs=0.02)
    assert mesh_of(f"+proj=gnom +lat_0=90 +R={R}").extent[1] / R == pytest.approx(np.sqrt(11.0), abs=0.25)


@pytest.mark.parametrize("region", [Box((160.0, -50.0, -170.0, -30.0)), EUROPE])
def test_region_is_filled_and_bounded(region: Box) -> None:
    """A box, also across the antimeridian, is drawn whole and with nothing else."""
    mesh = mesh_of(f"+proj=eqc +lon_0=170 +R={R}", region, None)
    west, south, _, north = region.bounds
    degrees = np.degrees(np.array(mesh.extent) / R)
    assert degrees[1] - degrees[0] == pytest.approx(longitude_width(region.bounds), abs=1e-5)
    assert degrees[2:] == pytest.approx((south, north), abs=1e-5)
    assert degrees[0] == pytest.approx(np.mod(west - 170.0 + 180.0, 360.0) - 180.0, abs=1e-5)


def test_region_that_is_no_box() -> None:
    """A cap is drawn to its edge: any object with `bounds` and `contains` is a region."""

    class Cap:
        bounds = (-180.0, 60.0, 180.0, 90.0)

        def contains(self, lon: np.ndarray, lat: np.ndarray) -> np.ndarray:
            return (lat > 70.0) & np.isfinite(lon)

    mesh = mesh_of(f"+proj=aeqd +lat_0=90 +R={R}", Cap(), None)
    assert np.linalg.norm(mesh.outline, axis=-1) == pytest.approx(np.radians(20.0) * R, rel=1e-6)


def test_area_of_use_is_the_region() -> None:
    """A national CRS is drawn over its area of use."""
    mesh = mesh_of("EPSG:2154", step=None)
    lon, lat = mesh.lonlat()
    assert (lon.min(), lon.max()) == pytest.approx((-9.86, 10.38), abs=0.01)
    assert (lat.min(), lat.max()) == pytest.approx((41.15, 51.56), abs=0.01)


def test_region_outside_the_map() -> None:
    """A region that cannot be projected is refused by name."""
    with pytest.raises(ValueError, match=r"Invalid region for 'Orthographic'. No part of it can be projected."):
        mesh_of(ORTHO, Box((-175.0, -50.0, -165.0, -30.0)), None)


# ---- colours --------------------------------------------------------------------------------


def test_unbounded_measure_does_not_wash_out() -> None:
    """The colours of a scale that grows without bound stop below its maximum, and the bar says so."""
    mesh = mesh_of("eqc", step=1.0)
    values = field(mesh, get_measure("k"))[: mesh.nodes]
    scale = colour_scale(get_measure("k"), [values], [mesh.weights])
    low, high = scale.limits
    assert 5.0 < high < 0.5 * np.nanmax(values)
    assert low * high == pytest.approx(1.0)
    assert scale.extend == "max"


def test_colours_by_kind() -> None:
    """A signed measure is symmetrical about 0, a magnitude begins at 0, a ratio is symmetrical about 1."""
    weights = [np.ones(1000)]
    values = [np.linspace(0.2, 1.0, 1000)]
    assert colour_scale(get_measure("convergence"), values, weights).limits == pytest.approx((-1.0, 1.0))
    assert colour_scale(get_measure("fisher"), values, weights).limits == pytest.approx((0.0, 1.0))
    assert colour_scale(get_measure("k"), values, weights).limits == pytest.approx((0.2, 5.0))


def test_levels_are_taken_as_given() -> None:
    """Levels that are listed are kept, sorted; a count gives about as many."""
    measure, values = get_measure("fisher"), [np.linspace(0.0, 1.0, 100)]
    given = colour_scale(measure, values, [np.ones(100)], levels=[0.5, 0.25])
    np.testing.assert_array_equal(given.levels, [0.25, 0.5])
    assert 3 <= colour_scale(measure, values, [np.ones(100)], levels=4).levels.size <= 6


def test_bad_limits() -> None:
    """Limits must ascend."""
    with pytest.raises(ValueError, match=r"Invalid colour limits '1, 0'. They must ascend"):
        colour_scale(get_measure("fisher"), [np.ones(3)], [np.ones(3)], limits=(1, 0))


def test_level_labels() -> None:
    """Labels have the digits that tell levels apart, and no more."""
    assert level_labels(np.array([0.9996, 1.0, 1.0004])) == ["0.9996", "1", "1.0004"]
    assert level_labels(np.array([0.0, 0.5, 1.0])) == ["0", "0.5", "1"]
    assert level_labels(np.array([1000.0, 20000.0])) == ["1,000", "20,000"]


def test_constant_field_has_no_isolines() -> None:
    """The areal scale of an equal-area map is one colour, without lines of rounding noise."""
    figure = plots.heatmap_figure(["moll"], measure="s", region=EUROPE)
    lines = [child for child in figure.axes[0].get_children() if type(child).__name__ == "TriContourSet"]
    assert not lines


def test_field_on_both_sides_of_a_seam() -> None:
    """The values at the two images of a seam are those of their own side."""
    mesh = mesh_of("igh")
    values = field(mesh, get_measure("convergence"))
    images = np.arange(mesh.nodes, mesh.x.size)
    np.testing.assert_array_equal(values[images], values[mesh.source[images]])
    assert np.isfinite(values[np.unique(mesh.triangles)]).all()


# ---- figures --------------------------------------------------------------------------------


def test_heatmap_figure_has_titles_bar_and_label() -> None:
    """Each panel has the map's name and its Airy-Kavrayskiy figure; one bar has the measure's name."""
    figure = plots.heatmap_figure(["robin", "moll"], measure="omega", region=EUROPE, airy_kavrayskiy=[0.4123, None])
    robin, moll, bar = figure.axes
    assert (robin.get_title(), moll.get_title()) == ("Robinson", "Mollweide")
    texts = [text.get_text() for text in robin.texts]
    assert any("Airy–Kavrayskiy 0.4123" in text for text in texts)
    assert bar.get_xlabel() == "Angular distortion omega (degrees)"


def test_draws_on_given_axes() -> None:
    """The functions draw on axes of the caller, and return the radius and the colours."""
    figure = Figure()
    left, right = figure.subplots(1, 2)
    radius = plots.tissot(left, "robin", region=EUROPE, step=10.0, title="A")
    scale = plots.heatmap(right, "robin", region=EUROPE, measure="h", levels=[1.0], limits=(0.5, 2.0), title="B")
    assert 2e5 < radius < 1e6
    assert scale.limits == pytest.approx((0.5, 2.0))
    assert (left.get_title(), right.get_title()) == ("A", "B")
    assert any(isinstance(child, PolyCollection) for child in left.get_children())
    assert any(isinstance(child, LineCollection) for child in right.get_children())


@pytest.mark.parametrize("suffix", plots.SUFFIXES)
def test_save(tmp_path: Path, suffix: str) -> None:
    """A figure is written by its suffix, and nothing else is left in the folder."""
    path = tmp_path / f"map{suffix}"
    figure = Figure(figsize=(1, 1))
    assert plots.save(figure, path) == path
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    head = path.read_bytes()[:200]
    assert {".png": b"PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}[suffix] in head


def test_unknown_suffix(tmp_path: Path) -> None:
    """A suffix that is no picture is refused, and no file appears."""
    with pytest.raises(
        ValueError, match=r"Invalid picture file '.*x\.foo'\. Its suffix must be \.png, \.svg or \.pdf\."
    ):
        plots.save(Figure(), tmp_path / "x.foo")
    assert not list(tmp_path.iterdir())


def test_bad_options() -> None:
    """Sizes, steps and lists that make no picture are refused."""
    with pytest.raises(ValueError, match=r"Invalid size '\(0, 3\)'"):
        plots.tissot_figure(["EPSG:2154"], size=(0, 3))
    with pytest.raises(ValueError, match=r"Invalid step '-1'"):
        plots.tissot_figure(["EPSG:2154"], step=-1)
    with pytest.raises(ValueError, match=r"Invalid box '\(0, 10, 20, 5\)'. It must be W, S, E, N in degrees"):
        Box((0, 10, 20, 5))
    with pytest.raises(ValueError, match=r"Invalid list of projections"):
        plots.heatmap_figure([])
    with pytest.raises(ValueError, match=r"There must be one for each of 1 maps"):
        plots.heatmap_figure(["EPSG:2154"], titles=["a", "b"])


def test_graticule_step_is_round() -> None:
    """The world has lines every 30 degrees."""
    assert graticule_step(mesh_of("robin")) == 30.0


PICTURES = {
    "tissot-robin": lambda: plots.tissot_figure(["robin"]),
    "heatmap-igh": lambda: plots.heatmap_figure(["igh"], measure="omega"),
    "heatmap-laea-europe": lambda: plots.heatmap_figure(["EPSG:3035"], measure="s"),
}


@pytest.mark.parametrize("name", PICTURES)
def test_golden_pictures(name: str, tmp_path: Path) -> None:
    """Pictures look as they did when they were last looked at, blurred over 8 pixels."""
    path = plots.save(PICTURES[name](), tmp_path / f"{name}.png", dpi=32)
    new, old = (imread(file)[..., :3].astype(float) for file in (path, GOLDEN / f"{name}.png"))
    assert new.shape == old.shape
    rows, columns = (n // 8 * 8 for n in new.shape[:2])
    blurred = (
        value[:rows, :columns].reshape(rows // 8, 8, columns // 8, 8, 3).mean(axis=(1, 3)) for value in (new, old)
    )
    difference = np.subtract(*blurred)
    assert np.sqrt(np.mean(difference**2)) < 0.02
    assert np.abs(difference).max() < 0.25
