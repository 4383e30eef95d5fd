"""Jacobians as points of the hyperbolic plane, and the modes as fields: where the points lie, and what is drawn."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse

from projdist import plots
from projdist.matrices.measures import angular_distortion
from projdist.matrices.spd import factor_distance
from projdist.plots.shape_space import disc_points, draw_glyphs, geodesic

SMALL = "box:0,20,40,60"


def hyperbolic(z, w):
    """The distance in Poincare's disc (Anderson 2005, Hyperbolic Geometry, proposition 4.3)."""
    return 2.0 * np.arctanh(np.abs((z - w) / (1.0 - np.conj(z) * w)))


def test_disc_points():
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
    stretched = np.array([[c, -s], [s, c]]) @ np.diag([3.0, 1.0])
    assert disc_points(stretched) == pytest.approx(0.5 * np.exp(1j * np.pi / 3))
    assert np.isnan(disc_points(np.zeros((2, 2))))


def test_geodesics():
    """They are as long as the distance of their ends, which no other curve is."""
    start, end = 0.3 + 0.2j, -0.1 + 0.8j
    x, y = geodesic(start, end).T
    line = x + 1j * y
    assert (line[0], line[-1]) == (pytest.approx(start), pytest.approx(end))
    assert hyperbolic(line[:-1], line[1:]).sum() == pytest.approx(hyperbolic(start, end), rel=1e-12)


def test_ellipses_about_the_rim():
    """Each stands where the disc has the matrices that make it of a circle."""
    ax = Figure().add_subplot()
    draw_glyphs(ax, 0.5)
    found = [patch for patch in ax.patches if isinstance(patch, Ellipse)]
    assert len(found) == 8
    for one in found:
        c, s = np.cos(np.radians(one.angle)), np.sin(np.radians(one.angle))
        place = disc_points(np.array([[c, -s], [s, c]]) @ np.diag([one.width, one.height]))
        assert place / abs(place) == pytest.approx(complex(*one.center) / abs(complex(*one.center)), abs=1e-12)


def markers(ax):
    return {line.get_label(): complex(line.get_xdata()[0], line.get_ydata()[0]) for line in ax.get_lines()}


@pytest.mark.slow
def test_space_of_the_plate_carree():
    """Its shapes lie on one line; the mean is at ln(e / 2), the median at the scale at 30 degrees."""
    figure = plots.space_figure("plate-carree")
    (ax,) = (ax for ax in figure.axes if ax.get_title() or ax.get_lines())
    found = markers(ax)
    assert found["mean (MDT)"] == pytest.approx(np.tanh((1 - np.log(2)) / 2), abs=1e-6)
    assert found["median"] == pytest.approx(np.tanh(np.log(2 / 3**0.5) / 2), abs=1e-4)
    places = next(one for one in ax.collections if one.get_label() == "places").get_offsets()
    np.testing.assert_allclose(places[:, 1], 0.0, atol=1e-6)
    assert places[:, 0].min() > -1e-6
    # Half of the places, each of the same area, lie nearer than the median.
    assert np.mean(places[:, 0] < found["median"].real) == pytest.approx(0.5, abs=0.01)


@pytest.mark.slow
def test_space_of_small_regions():
    """What is drawn reaches as far as the points do, with round angles; panels are alike, and named."""
    figure = plots.space_figure(["EPSG:3035", "EPSG:25832"], region=SMALL, titles=["One", None])
    panes = figure.axes[:2]
    assert panes[0].get_xlim() == panes[1].get_xlim()
    rim = next(patch for patch in panes[0].patches if isinstance(patch, Circle)).radius
    assert rim < 0.2
    angles = [float(text.get_text()[:-1]) for text in panes[0].texts if text.get_text().endswith("°")]
    assert 3 <= len(angles) <= 5
    assert np.sin(np.radians(max(angles)) / 2) < rim


@pytest.mark.slow
def test_modes_figure():
    """A panel a mode with its share and words; modes without a share are left out; one colour bar."""
    figure = plots.modes_figure(["mercator", "mollweide"], region="globe", dpi=40)
    words = [text.get_text() for ax in figure.axes for text in ax.texts] + [ax.get_title() for ax in figure.axes]
    told = " ".join(words)
    assert len(figure.axes) == 4
    for expected in ("100 % size", "51 % shear", "49 % shape"):
        assert expected in told
