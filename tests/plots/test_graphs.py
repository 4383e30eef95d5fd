"""Graphs of distributions and profiles, fields of local corrections, and what the disc of shapes and modes show."""

import itertools

import numpy as np
import pytest
import shapely
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse
from refusals import refuses

from projdist import local_corrections, plots, profile, sample
from projdist.matrices.measures import angular_distortion
from projdist.matrices.spd import factor_distance
from projdist.plots.graphs import areas, overlaps, pareto_front
from projdist.plots.map_drawing import LocalField
from projdist.plots.shape_space import disc_points, draw_glyphs, geodesic

EUROPE, SMALL = "box:-10,35,40,70", "box:0,20,40,60"


def test_distributions_of_mercators_scale() -> None:
    """It is at most K where cos(lat) >= 1 / K: on the sphere a share sqrt(1 - 1 / K^2)."""
    figure = plots.distribution_figure("+proj=merc +R=6371000", "cumulative", measure="k", region="globe")
    k, share = figure.axes[0].get_lines()[0].get_data()
    inside = (k > 1.01) & (k < 5.0)
    assert inside.sum() > 100
    # The lattice has 200,000 points: shares are good to some of them.
    np.testing.assert_allclose(share[inside], 100.0 * np.sqrt(1.0 - 1.0 / k[inside] ** 2), atol=0.03)
    # Bins have their closed form, and with what lies beyond them they sum to all of the area.
    figure = plots.distribution_figure("+proj=merc +R=6371000", measure="k", region="globe")
    shares, edges, _ = figure.axes[0].patches[0].get_data()
    below = np.sqrt(1.0 - 1.0 / np.maximum(edges, 1.0) ** 2)
    np.testing.assert_allclose(shares, 100.0 * np.diff(below), atol=0.05)
    (text,) = figure.axes[0].get_legend().get_texts()
    assert text.get_text().endswith(f"({100.0 * (1.0 - below[-1]):.2g} % beyond)")


@pytest.mark.parametrize("name", ["robin", "mercator", "moll", "laea"])
def test_areas_and_angles_make_the_error(name: str) -> None:
    """The squares of both parts sum to that of the scaled Airy-Kavrayskiy error."""
    field = sample(name, "globe", tolerance=1e-5)
    angles, areas = field.angles_and_areas
    assert np.hypot(angles, areas) == pytest.approx(field.airy_kavrayskiy.scaled, rel=1e-4)
    assert (angles < 1e-4) == (name == "mercator")
    assert (areas < 5e-3) == (name in ("moll", "laea"))


def test_the_front_and_what_labels_hide() -> None:
    """The front is what none is below in both, from the left; ties are one."""
    points = np.array([[0.0, 3.0], [1.0, 2.0], [1.5, 2.5], [2.0, 1.0], [2.2, 1.0 - 1e-6], [2.5, 0.5]])
    assert pareto_front(points, 1e-3) == [0, 1, 3, 5]
    assert pareto_front(points, 1e-9) == [0, 1, 3, 4, 5]
    # What boxes have in common, and outside of a frame, is as large as shapely has it; corners touch in none.
    boxes = [(0.0, 0.0, 2.0, 1.0), (1.0, -3.0, 5.0, 0.25), (2.0, 1.0, 3.0, 3.0), (-1.0, -1.0, 4.0, 4.0)]
    common, shapes = overlaps(np.array(boxes), np.array(boxes)), [shapely.box(*box) for box in boxes]
    outside = areas(np.array(boxes))[:, None] - common
    with np.errstate(invalid="ignore"):  # Old GEOS sets this flag where nothing is left.
        assert common.tolist() == [[one.intersection(other).area for other in shapes] for one in shapes]
        assert outside.tolist() == [[one.difference(other).area for other in shapes] for one in shapes]


@pytest.mark.slow
def test_labels_do_not_overlap() -> None:
    maps = ["robin", "moll", "mercator", "eqearth", "eck4", "wag4", "hammer", "kav7", "winkel-tripel", "natearth"]
    figure = plots.distribution_figure(maps, "pareto", region="globe")
    boxes = [shapely.box(*text.get_window_extent().extents) for text in figure.axes[0].texts]
    assert len(boxes) == len(maps)
    assert max(one.intersection(other).area for one, other in itertools.combinations(boxes, 2)) == 0.0


def test_curves_are_the_profile() -> None:
    """A panel for the scale, one for heights, one a measure; parts per million at the right are off 1."""
    found = profile("EPSG:32632", [(9, 48, 300), (10, 48, 500), (12, 49, 400)], measures=["convergence", "omega"])
    scale, ppm, height, convergence, _ = plots.profile_figure(found).axes
    np.testing.assert_array_equal(scale.get_lines()[0].get_data(), (found.distance_km, found.scale))
    np.testing.assert_array_equal(height.get_lines()[0].get_ydata(), found.height)
    np.testing.assert_array_equal(convergence.get_lines()[0].get_ydata(), found.measures["convergence"])
    np.testing.assert_allclose(ppm.get_ylim(), 1e6 * (np.array(scale.get_ylim()) - 1.0))
    assert f"mean {found.mean_scale:.7g}" in scale.get_legend().get_texts()[0].get_text()


@pytest.mark.slow
def test_curves_end_where_the_map_is_torn() -> None:
    for line, gaps in ([(170, 10), (-170, 30)], 1), ([(150, 10), (170, 30)], 0):
        scale = plots.profile_figure(profile("robin", line)).axes[0].get_lines()[0]
        assert np.isnan(scale.get_ydata()).sum() == gaps


def part(ax, label, kind):
    """The collection of a label."""
    (found,) = [child for child in ax.findobj(kind) if child.get_label() == label]
    return found


@pytest.mark.slow
def test_lines_lie_along_the_stretch():
    """Each line has the azimuth of its place's correction, about its disc; the longest are equal."""
    figure, field = plots.local_figure("moll", 300.0, region=EUROPE, step=5.0)
    segments = np.array(part(figure.axes[0], "stretches", LineCollection).get_segments())
    discs = part(figure.axes[0], "scales", PolyCollection).get_paths()
    np.testing.assert_allclose(segments.mean(axis=1), [path.vertices[:-1].mean(axis=0) for path in discs], atol=1e-3)
    ahead = segments[:, 1] - segments[:, 0]
    azimuth = np.mod(np.degrees(np.arctan2(ahead[:, 0], ahead[:, 1])), 180.0)
    np.testing.assert_allclose(azimuth, field.parts.stretch_azimuth, atol=1e-6)
    length = np.hypot(*ahead.T)
    assert np.isclose(length, length.max()).sum() == pytest.approx(0.1 * len(length), abs=1.5)
    inner = length < 0.99 * length.max()
    ratio = length[inner] / np.log(field.parts.stretch[inner])
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)
    assert len(figure.axes) == 2


def test_lines_of_closed_forms():
    """The plate carree at 60 N is twice too wide: the line is vertical, or, of the map turned, horizontal."""
    xy = np.array([[1.0, 2.0], [5.0, 5.0]])
    for projection, ahead in (("plate-carree", [0.0, 2.0]), (lambda lon, lat: (lat, -lon), [2.0, 0.0])):
        found = local_corrections(projection, [0.0, 0.0], [60.0, 60.0], 1.0)
        field = LocalField(surface=None, corrections=found, xy=xy, discs=None, radius=1.0, scale=None)
        segments, longest, cut = field.segments()
        np.testing.assert_allclose(np.abs(np.diff(segments, axis=1)[:, 0]), [ahead, ahead], atol=1e-6)
        np.testing.assert_allclose(segments.mean(axis=1), xy, atol=1e-12)
        assert longest == pytest.approx(2.0, rel=1e-6)  # a kilometre's square: 1e-8, and a rim of 1 km
        assert not cut


@pytest.mark.slow
def test_colours_are_scales():
    """The colours span the corrections' scales, to the neutral 1."""
    scale, stretch = (plots.local_field(Figure().add_subplot(), one, 300.0, region=EUROPE) for one in ("merc", "moll"))
    field = local_corrections("merc", 10.0, [38.0, 67.0], 300.0)
    low, high = scale.limits
    assert 0.8 * field.parts.scale[1] < low < field.parts.scale[1]
    assert field.parts.scale[0] < high <= 1.0
    # Where the scale is the same everywhere the colours are the stretches.
    assert [one.label for one in (scale, stretch)] == [
        f"{name} of the local correction" for name in ("Scale", "Stretch")
    ]
    # Mollweide's map is undistorted at 40.7 N on its middle meridian, and stretched most in the box's north-east.
    assert stretch.limits[0] == pytest.approx(1.0, abs=0.05)
    assert stretch.limits[1] > 1.5


def test_caps_that_are_not_on_the_map():
    def small(lon, lat):
        return np.where(np.hypot(lon - 15, lat - 50) < 5, 1e5 * lon, np.nan), 1e5 * lat

    refuses("No cap of this radius", plots.local_field, Figure().add_subplot(), small, 5000.0, region="box:12,47,18,53")


def hyperbolic(z, w):
    """The distance in Poincare's disc (Anderson 2005, Hyperbolic Geometry, proposition 4.3)."""
    return 2.0 * np.arctanh(np.abs((z - w) / (1.0 - np.conj(z) * w)))


def test_points_of_the_disc_and_lines_between_them():
    """Distances are those of the Fisher metric for determinant 1; from the middle they are sin(omega / 2)."""
    rng = np.random.default_rng(1)
    A = rng.normal(size=(50, 2, 2))
    A /= np.sqrt(np.abs(np.linalg.det(A)))[:, None, None]
    z = disc_points(A)
    # d_F of P and Q is twice Dist_F, whose square is half of r^2.
    np.testing.assert_allclose(np.sqrt(2.0) * hyperbolic(z[:-1], z[1:]), factor_distance(A[:-1], A[1:]), rtol=1e-6)
    np.testing.assert_allclose(np.abs(z), np.sin(np.radians(angular_distortion(A)) / 2), atol=1e-12)
    np.testing.assert_allclose(disc_points(3.0 * A), z, atol=1e-12)
    # A stretch by 3 at 30 degrees lies at twice the angle, (3 - 1) / (3 + 1) from the middle.
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    assert disc_points(np.array([[c, -s], [s, c]]) @ np.diag([3.0, 1.0])) == pytest.approx(0.5 * np.exp(1j * np.pi / 3))
    assert np.isnan(disc_points(np.zeros((2, 2))))
    # Geodesics are as long as the distance of their ends, which no other curve is.
    start, end = 0.3 + 0.2j, -0.1 + 0.8j
    x, y = geodesic(start, end).T
    line = x + 1j * y
    assert (line[0], line[-1]) == (pytest.approx(start), pytest.approx(end))
    assert hyperbolic(line[:-1], line[1:]).sum() == pytest.approx(hyperbolic(start, end), rel=1e-12)


def test_ellipses_about_the_rim():
    """Each stands where the disc has the matrices that make it of a circle."""
    draw_glyphs(ax := Figure().add_subplot(), 0.5)
    found = [patch for patch in ax.patches if isinstance(patch, Ellipse)]
    assert len(found) == 8
    for one in found:
        c, s = np.cos(np.radians(one.angle)), np.sin(np.radians(one.angle))
        place = disc_points(np.array([[c, -s], [s, c]]) @ np.diag([one.width, one.height]))
        assert place / abs(place) == pytest.approx(complex(*one.center) / abs(complex(*one.center)), abs=1e-12)


@pytest.mark.slow
def test_figures_of_shape_space():
    """The plate carree's shapes lie on one line; the mean is at ln(e / 2), the median at the scale at 30 degrees."""
    figure = plots.space_figure("plate-carree")
    (ax,) = (ax for ax in figure.axes if ax.get_title() or ax.get_lines())
    found = {line.get_label(): complex(line.get_xdata()[0], line.get_ydata()[0]) for line in ax.get_lines()}
    assert found["mean (MDT)"] == pytest.approx(np.tanh((1 - np.log(2)) / 2), abs=1e-6)
    assert found["median"] == pytest.approx(np.tanh(np.log(2 / 3**0.5) / 2), abs=1e-4)
    places = next(one for one in ax.collections if one.get_label() == "places").get_offsets()
    np.testing.assert_allclose(places[:, 1], 0.0, atol=1e-6)
    assert places[:, 0].min() > -1e-6
    # Half of the places, each of the same area, lie nearer than the median.
    assert np.mean(places[:, 0] < found["median"].real) == pytest.approx(0.5, abs=0.01)
    # What is drawn of a small region reaches as far as the points do, with round angles; panels are alike.
    figure = plots.space_figure(["EPSG:3035", "EPSG:25832"], region=SMALL, titles=["One", None])
    panes = figure.axes[:2]
    assert panes[0].get_xlim() == panes[1].get_xlim()
    rim = next(patch for patch in panes[0].patches if isinstance(patch, Circle)).radius
    assert rim < 0.2
    angles = [float(text.get_text()[:-1]) for text in panes[0].texts if text.get_text().endswith("°")]
    assert 3 <= len(angles) <= 5
    assert np.sin(np.radians(max(angles)) / 2) < rim


@pytest.mark.usefixtures("few_cells")
@pytest.mark.parametrize(("size", "entries"), [((4.0, 3.0), 4), ((9.0, 4.0), 3)])
def test_legends_lie_on_no_circle(size, entries):
    """In a corner of the first panel, or, of small panels, below all."""
    figure = plots.space_figure(["robin", "moll", "eqearth"], region=SMALL, size=size)
    figure.canvas.draw()
    (legend,) = [*figure.legends, *(ax.get_legend() for ax in figure.axes if ax.get_legend())]
    assert len(legend.get_texts()) == entries
    words = [text.get_window_extent() for text in legend.get_texts()]
    circles = [(ax, ax.transData.transform([(0, 0), (ax.patches[0].radius, 0)])) for ax in figure.axes[:3]]
    for _, ((x, y), (right, _)) in circles:
        for box in words:
            assert np.hypot(x - np.clip(x, box.x0, box.x1), y - np.clip(y, box.y0, box.y1)) > right - x
            assert box.y0 > figure.axes[3].get_tightbbox().y1


@pytest.mark.slow
def test_modes_figure():
    """A panel a mode with its share and words; modes without a share are left out; one colour bar."""
    figure = plots.modes_figure(["mercator", "mollweide"], region="globe", dpi=40)
    told = " ".join(text.get_text() for ax in figure.axes for text in (*ax.texts, ax.title))
    assert len(figure.axes) == 4
    assert [words for words in ("100 % size", "51 % shear", "49 % shape") if words not in told] == []
