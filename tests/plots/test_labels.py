"""Labels of isolines and graticules: on their line, clear of each other and of the outline, none without room."""

from collections.abc import Callable

import numpy as np
import pytest
import shapely
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.text import Text

from projdist import plots
from projdist.plots.basemap import crossings
from projdist.plots.map_drawing import label_isolines

CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
ROUND = np.column_stack([np.interp(np.arange(0.0, 4.01, 0.02), np.arange(5.0), column) for column in CORNERS.T])
SQUARE = np.stack([ROUND[:-1], ROUND[1:]], axis=1)


def contours(function: Callable[..., np.ndarray], levels: list[float], inches: float = 4.0) -> tuple[Axes, ContourSet]:
    """Isolines of a function on the square from -1 to 1."""
    figure = Figure(figsize=(inches, inches), dpi=100)
    FigureCanvasAgg(figure)
    ax = figure.add_axes((0, 0, 1, 1))
    ax.set_aspect("equal")
    x, y = np.meshgrid(*[np.linspace(-1, 1, 101)] * 2)
    return ax, ax.contour(x, y, function(x, y), levels=levels)


def widths(texts: list[Text]) -> tuple[np.ndarray, np.ndarray]:
    """Centres in pixels, and the widths of the texts when they are not turned."""
    centres = np.array([text.get_transform().transform(text.get_position()) for text in texts])
    for text in texts:
        text.set_rotation(0.0)
    return centres, np.array([text.get_window_extent().width for text in texts])


def test_one_label_for_each_isoline_on_it() -> None:
    """Each of three circles has its own label, on the circle and turned along it."""
    ax, lines = contours(np.hypot, [0.3, 0.5, 0.7])
    label_isolines(ax, lines, {0.3: "a", 0.5: "b", 0.7: "c"}, SQUARE)
    assert [text.get_text() for text in ax.texts] == ["a", "b", "c"]
    for text, radius in zip(ax.texts, (0.3, 0.5, 0.7), strict=True):
        x, y = text.get_position()
        assert np.hypot(x, y) == pytest.approx(radius, rel=0.02)
        along = np.degrees(np.arctan2(-x, y))
        assert np.mod(text.get_rotation() - along + 90.0, 180.0) - 90.0 == pytest.approx(0.0, abs=10.0)


@pytest.mark.slow
def test_labels_are_clear_of_each_other_and_of_the_outline() -> None:
    """As wide as they are drawn, whichever way they are turned, labels do not meet; many lines stay without."""
    levels = np.round(np.linspace(-0.95, 0.95, 39), 3).tolist()
    ax, lines = contours(lambda x, y: np.sin(2 * x + y), levels)
    label_isolines(ax, lines, {level: f"{level:.3f}" for level in levels}, SQUARE)
    centres, width = widths(list(ax.texts))
    assert len(width) > 5
    apart = np.linalg.norm(centres[:, None] - centres, axis=-1) + 1e9 * np.eye(len(width))
    assert (apart > 0.5 * (width[:, None] + width)).all()
    edge = shapely.linestrings(ax.transData.transform(CORNERS))
    assert (shapely.distance(edge, shapely.points(centres)) > 0.5 * width).all()


def test_short_isolines_have_no_labels() -> None:
    """A ring that is hardly longer than its label is left as it is, and so is a picture without isolines."""
    ax, lines = contours(np.hypot, [0.05], inches=2.0)
    label_isolines(ax, lines, {0.05: "0.05"}, SQUARE)
    assert not ax.texts
    ax, lines = contours(np.hypot, [9.0])
    label_isolines(ax, lines, {9.0: "9"}, SQUARE)
    assert not ax.texts


@pytest.mark.parametrize("edge", ["bottom", "left", "top", "right"])
def test_lines_cross_the_frame(edge: str) -> None:
    """Where shapely has a line and an edge cross; not where it runs along it, or passes beyond its end."""
    width, height = 30.0, 20.0
    corners = {"bottom": (0, 0, 30, 0), "left": (0, 0, 0, 20), "top": (0, 20, 30, 20), "right": (30, 0, 30, 20)}
    side = shapely.LineString(np.reshape(corners[edge], (2, 2)))
    lines = [
        np.array([[-10.0, -2.0], [10.0, 9.0], [33.0, 25.0]]),
        np.array([[3.0, 28.0], [21.0, -1.0]]),
        np.array([[-5.0, 5.0], [36.0, 16.0]]),
        np.array([[-9.0, -1.0], [-3.0, 28.0]]),
    ]
    crossed = [line.intersection(side) for line in map(shapely.LineString, lines)]
    truth = [(point.x, point.y) for point in crossed if not point.is_empty]
    assert truth
    np.testing.assert_allclose(crossings(lines, edge, width, height), truth, rtol=0, atol=1e-12)
    along = np.add(side.coords, [[-1.0, -1.0], [1.0, 1.0]])
    assert crossings([along], edge, width, height) == []


@pytest.mark.slow
def test_labels_on_lobes() -> None:
    """On an interrupted map, where lobes leave little room, labels do not cover each other."""
    figure = plots.heatmap_figure(["igh"], measure="omega", size=(6.0, 4.0))
    texts = [text for text in figure.axes[0].texts if text.get_text().isdecimal()]
    centres, width = widths(texts)
    assert len(texts) > 10
    apart = np.linalg.norm(centres[:, None] - centres, axis=-1) + 1e9 * np.eye(len(texts))
    assert (apart > 0.5 * (width[:, None] + width)).all()
