"""Base maps: labels of graticules and isolines, cities, scale bars and globes."""

import itertools
from collections.abc import Callable

import numpy as np
import pytest
import shapely
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
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


def are_apart(centres: np.ndarray, width: np.ndarray) -> bool:
    """Whether no two texts meet, whichever way they are turned."""
    apart = np.linalg.norm(centres[:, None] - centres, axis=-1) + 1e9 * np.eye(len(width))
    return bool((apart > 0.5 * (width[:, None] + width)).all())


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
    assert are_apart(centres, width)
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
    assert are_apart(centres, width)


PICTURES = [
    *(("EPSG:2193", "country:NZ"), ("EPSG:3460", "country:FJ"), ("EPSG:3576", "country:RU")),
    *(("EPSG:3031", "country:AQ"), ("EPSG:6350", "country:US"), ("EPSG:25832", "country:DE")),
    *(("EPSG:2056", "country:CH"), ("EPSG:3057", "country:IS"), ("EPSG:5880", "country:BR")),
    *(("EPSG:2154", "cap:2.35,48.85,40"), ("EPSG:32760", "box:178,-19,-179,-15"), ("EPSG:25832", "box:6,47,12,55")),
]


@pytest.mark.slow
@pytest.mark.parametrize(("projection", "region"), PICTURES)
@pytest.mark.parametrize("kind", [plots.heatmap_figure, plots.tissot_figure])
def test_texts_are_apart_and_within_the_figure(projection, region, kind) -> None:
    """Labels of the graticule, cities, the scale bar and the titles: no boxes overlap, none leaves the figure."""
    figure = kind(projection, region=region)
    figure.draw_without_rendering()
    texts = [text for ax in figure.axes for text in [ax.title, *ax.texts] if text.get_text() and is_level(text)]
    boxes = [text.get_window_extent() for text in texts]
    whole = figure.bbox
    for text, box in zip(texts, boxes, strict=True):
        assert whole.x0 <= box.x0 <= box.x1 <= whole.x1, text
        assert whole.y0 <= box.y0 <= box.y1 <= whole.y1, text
    for (one, a), (other, b) in itertools.combinations(zip(texts, boxes, strict=True), 2):
        across, up = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        # Boxes have room for letters that reach below the line.
        assert min(across, up) < 3.0, (one, other)


def is_level(text) -> bool:
    """Labels of isolines are turned; their boxes say little."""
    return text.get_rotation() in (0.0, 360.0)


def labelled(figure, label: str) -> list:
    return [one for ax in figure.axes for one in ax.get_children() if one.get_label() == label]


def bar_length(ax: Axes) -> float:
    """The length of the scale bar's halves in metres of the map."""
    bars = [patch for patch in ax.patches if isinstance(patch, Rectangle)]
    halves = [patch for patch in bars if patch.get_transform().contains_branch(ax.transAxes)]
    return sum(patch.get_width() for patch in halves if 0 < patch.get_width() < 0.3) * np.ptp(ax.get_xlim())


@pytest.mark.usefixtures("few_cells")
def test_a_country_is_placed() -> None:
    """Its frame, its cities with the capital, its scale and where it lies; degrees round it."""
    figure = plots.heatmap_figure("EPSG:2056", region="country:CH")
    names = {text.get_text() for text in labelled(figure, "city")}
    assert {"Bern", "Zürich", "Geneva"} <= names
    assert any(isinstance(ax, Axes) for ax in labelled(figure, "locator"))
    (bar,) = labelled(figure, "scale bar")
    assert bar.get_text() == "50 km"
    assert bar_length(figure.axes[0]) == pytest.approx(5e4, rel=1e-9)
    degrees = {text.get_text() for text in labelled(figure, "graticule label")}
    assert {"7°E", "8°E", "46°N", "47°N"} <= degrees


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
def test_no_scale_bar_where_the_scale_is_not_one() -> None:
    """Mercator's scale in Norway is two and more."""
    assert labelled(plots.heatmap_figure("mercator", region="country:NO@main"), "scale bar") == []


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
def test_scale_bar_is_as_long_as_it_says() -> None:
    """In metres of the map, to the width of its line."""
    figure = plots.tissot_figure("EPSG:25832", region="country:DE")
    assert bar_length(figure.axes[0]) == pytest.approx(1e5, rel=1e-9)
    assert {text.get_text() for text in labelled(figure, "scale bar")} == {"100 km"}


@pytest.mark.slow
@pytest.mark.parametrize("context", ["none", "coast", "borders"])
@pytest.mark.usefixtures("few_cells")
def test_less_is_shown_on_request(context: str) -> None:
    """Lines of the coast from "coast" on, of borders from "borders" on, cities only with all."""
    figure = plots.heatmap_figure("EPSG:2056", region="country:CH", context=context)
    assert bool(labelled(figure, "coastline")) == (context != "none")
    assert bool(labelled(figure, "borders")) == (context == "borders")
    assert labelled(figure, "city") == []


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
def test_cities_of_a_panel_without_room() -> None:
    """A picture of a square centimetre has none, and is drawn."""
    figure = plots.tissot_figure("EPSG:2056", size=(1.4, 1.4))
    assert len(labelled(figure, "city")) < 4


@pytest.mark.slow
def test_labels_of_isolines_give_way_to_the_city_of_a_picture() -> None:
    """San Francisco, in its own circle, stands on an isoline's middle."""
    figure = plots.figure("EPSG:7131", region="cap:-122.42,37.77,40")
    texts = [text for text in figure.axes[0].texts if text.get_text()]
    (city,) = (text for text in texts if text.get_text() == "San Francisco")
    assert not any(city.get_window_extent().overlaps(text.get_window_extent()) for text in texts if text is not city)
