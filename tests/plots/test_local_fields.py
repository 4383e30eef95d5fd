"""Fields of local corrections: what the discs and lines say."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from projdist import local_corrections, plots
from projdist.plots.map_drawing import LocalField

EUROPE = "box:-10,35,40,70"


def part(ax, label):
    """The collection of a label."""
    (found,) = [child for child in ax.get_children() if child.get_label() == label]
    return found


def drawn(projection, radius=300.0, **options):
    """The axes of a field and its colours."""
    ax = Figure().add_subplot()
    return ax, plots.local_field(ax, projection, radius, region=EUROPE, **options)


@pytest.mark.slow
def test_lines_lie_along_the_stretch():
    """Each line has the azimuth of its place's correction, about its disc; the longest are equal."""
    ax, _ = drawn("moll", step=5.0)
    lines, discs = part(ax, "stretches"), part(ax, "scales")
    assert isinstance(lines, LineCollection)
    assert isinstance(discs, PolyCollection)
    segments = np.array(lines.get_segments())
    centres = np.array([path.vertices[:-1].mean(axis=0) for path in discs.get_paths()])
    np.testing.assert_allclose(segments.mean(axis=1), centres, atol=1e-3)
    figure, field = plots.local_figure("moll", 300.0, region=EUROPE, step=5.0)
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
    _, scale = drawn("merc")
    field = local_corrections("merc", 10.0, [38.0, 67.0], 300.0)
    low, high = scale.limits
    assert 0.8 * field.parts.scale[1] < low < field.parts.scale[1]
    assert field.parts.scale[0] < high <= 1.0
    assert scale.label == "Scale of the local correction"


@pytest.mark.slow
def test_colours_of_equal_area_maps():
    """Where the scale is the same everywhere the colours are the stretches."""
    _, scale = drawn("moll")
    assert scale.label == "Stretch of the local correction"
    # Mollweide's map is undistorted at 40.7 N on its middle meridian, and stretched most in the box's north-east.
    assert scale.limits[0] == pytest.approx(1.0, abs=0.05)
    assert scale.limits[1] > 1.5


def test_caps_that_are_not_on_the_map():
    """Where no cap is on the map there is nothing to draw."""
    with pytest.raises(ValueError, match="No cap of so many km"):
        drawn(lambda lon, lat: (np.where(np.hypot(lon - 15, lat - 50) < 5, 1e5 * lon, np.nan), 1e5 * lat), 5000.0)
