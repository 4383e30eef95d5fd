"""The ticks of colour bars, levels beyond the values, and isolines that end at jumps."""

import itertools
import re

import numpy as np
import pytest
from matplotlib.figure import Figure
from tables import each

from projdist import plots
from projdist.matrices import get_measure
from projdist.plots.colours import ColourScale
from projdist.plots.map_drawing import draw_colourbar, label_isolines
from projdist.support import Notice

EUROPE = "box:-10,35,40,70"
JOINT = 40.0 + 44.0 / 60.0 + 11.98 / 3600.0  # degrees: where Goode joins two maps


@each(
    ("levels", "shown"),
    [
        ([5.0, 8.0, 10.0, 12.0, 15.0], {10.0}),
        ([0.0, 45.0, 90.0], {0.0, 45.0, 90.0}),
        (np.arange(0.0, 91.0, 1.0).tolist(), {0.0}),
        ([10.0, 10.01, 10.02, 80.0], {10.0, 80.0}),
    ],
)
@each("inches", [1.0, 2.0, 5.0])
def test_ticks_do_not_collide(levels: list[float], shown: set[float], inches: float) -> None:
    """As many labels as have room stand below a bar, whatever the levels; their boxes are apart."""
    scale = ColourScale.of(get_measure("omega"), [np.linspace(0.0, 90.0, 99)], [np.ones(99)], levels=levels)
    figure = Figure(figsize=(inches + 1.0, 2.0), dpi=150)
    bar = draw_colourbar(figure, scale, cax=figure.add_axes((0.5 / (inches + 1.0), 0.5, inches / (inches + 1.0), 0.1)))
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in bar.ax.get_xticklabels()]
    assert all(one.x1 < other.x0 for one, other in itertools.pairwise(boxes))
    assert len(boxes) >= 1
    if inches == 5.0:
        assert shown <= set(bar.get_ticks())


def test_levels_beyond_the_values() -> None:
    """They have no isolines, and one line says so; levels that a count makes are never beyond."""
    for levels, said in (
        ([10.0, 200.0], r"^The level 200 has no isoline: it is beyond the values, 0 to 90\.$"),
        ([-3.0, 10.0, 200.0], r"^The levels -3 and 200 have no isolines: they are beyond the values, 0 to 90\.$"),
        (list(range(100, 120)), r"^The levels 100, 101, 102, 103, 104 and 15 more have no isolines"),
    ):
        with pytest.warns(Notice, match=said):
            ColourScale.of(get_measure("omega"), [np.linspace(0.0, 90.0, 9)], [np.ones(9)], levels=levels)
    ColourScale.of(get_measure("omega"), [np.linspace(0.0, 90.0, 9)], [np.ones(9)], levels=20)


@pytest.mark.parametrize("upwards", [True, False])
def test_labels_are_never_upside_down(upwards: bool) -> None:
    """Whichever way lines run, and also where y is downwards as on scans, letters stand on their feet."""
    figure = Figure(figsize=(6, 6), dpi=100)
    ax = figure.add_axes((0, 0, 1, 1))
    x, y = np.meshgrid(*[np.linspace(-1, 1, 201)] * 2)
    levels = [0.3, 0.5, 0.7, 0.9]
    lines = ax.contour(x, y, np.hypot(x, y), levels=levels)
    ax.set_ylim(*((-1, 1) if upwards else (1, -1)))
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
    label_isolines(ax, lines, {level: f"{level}" for level in levels}, np.stack([corners, np.roll(corners, -1, 0)], 1))
    turned = [(text.get_rotation() + 180.0) % 360.0 - 180.0 for text in ax.texts]
    assert len(turned) >= 3
    assert np.abs(turned).max() <= 90.0


@pytest.mark.slow
def test_isolines_end_at_a_jump() -> None:
    """No piece of an isoline of Goode's map runs along the parallel of 40 degrees 44 minutes."""
    figure = plots.heatmap_figure("goode-homolosine", measure="omega")
    (lines,) = (child for child in figure.axes[0].get_children() if type(child).__name__ == "TriContourSet")
    joint = 6371008.7714 * np.radians(JOINT)
    pieces = [piece for path in lines.get_paths() for piece in path.to_polygons(closed_only=False)]
    assert len(pieces) > 8
    segments = np.concatenate([np.stack([piece[:-1], piece[1:]], axis=1) for piece in pieces])
    # Half a cell from the joint; a few lines cross it, as they have nearly the same place on both sides.
    near = (np.abs(np.abs(segments[..., 1]) - joint) < 6371008.7714 * np.radians(0.3)).all(axis=1)
    along = np.abs(np.diff(segments[..., 0], axis=1)[:, 0])
    assert along[near].sum() < 1e-2 * np.ptp(figure.axes[0].get_xlim())


@pytest.mark.slow
def test_a_figure_says_which_levels_are_beyond() -> None:
    """As the command does."""
    with pytest.warns(Notice, match=re.escape("The level 9 has no isoline")):
        plots.heatmap_figure("moll", measure="a", region=EUROPE, levels=[1.1, 9.0])
