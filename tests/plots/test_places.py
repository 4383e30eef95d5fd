"""Pictures of regions: what tells the place, and that nothing of it covers anything else."""

import itertools

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from projdist import plots

PICTURES = [
    pytest.param("EPSG:2193", "country:NZ", marks=pytest.mark.slow),
    ("EPSG:3460", "country:FJ"),
    pytest.param("EPSG:3576", "country:RU", marks=pytest.mark.slow),
    pytest.param("EPSG:3031", "country:AQ", marks=pytest.mark.slow),
    pytest.param("EPSG:6350", "country:US", marks=pytest.mark.slow),
    pytest.param("EPSG:25832", "country:DE", marks=pytest.mark.slow),
    pytest.param("EPSG:2056", "country:CH", marks=pytest.mark.slow),
    pytest.param("EPSG:3057", "country:IS", marks=pytest.mark.slow),
    pytest.param("EPSG:5880", "country:BR", marks=pytest.mark.slow),
    pytest.param("EPSG:2154", "cap:2.35,48.85,40", marks=pytest.mark.slow),
    pytest.param("EPSG:32760", "box:178,-19,-179,-15", marks=pytest.mark.slow),
    pytest.param("EPSG:25832", "box:6,47,12,55", marks=pytest.mark.slow),
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
        assert whole.x0 <= box.x0, text
        assert box.x1 <= whole.x1, text
        assert whole.y0 <= box.y0, text
        assert box.y1 <= whole.y1, text
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


def test_context_that_is_none() -> None:
    """One line names the four."""
    with pytest.raises(ValueError, match=r"Invalid context 'much'. It must be one of none, coast, borders, full"):
        plots.heatmap_figure("EPSG:2056", context="much")


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
