"""Base maps, isolines and their labels, cities, scale bars and globes; colour scales and their bars."""

import itertools
from collections.abc import Callable
from typing import Any

import matplotlib
import numpy as np
import pyproj
import pytest
import shapely
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.text import Text
from matplotlib.tri import TriContourSet
from refusals import refuses
from tables import each

from projdist import plots
from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS as R
from projdist.field.at_points import jacobian
from projdist.matrices.measures import get_measure
from projdist.plots.basemap import crossings
from projdist.plots.colours import ColourScale, level_labels, shown_levels
from projdist.plots.map_drawing import draw_colourbar, label_isolines
from projdist.projections import Projection
from projdist.regions import get_region
from projdist.support import Notice
from projdist.surfaces.domain import domain_of
from projdist.surfaces.fields import field
from projdist.surfaces.surface import Surface, build_surface

EUROPE = "box:-10,35,40,70"
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
    """Each of three circles has its own label, on the circle and turned along it; where there is no room is none."""
    ax, lines = contours(np.hypot, [0.3, 0.5, 0.7])
    label_isolines(ax, lines, {0.3: "a", 0.5: "b", 0.7: "c"}, SQUARE)
    assert [text.get_text() for text in ax.texts] == ["a", "b", "c"]
    for text, radius in zip(ax.texts, (0.3, 0.5, 0.7), strict=True):
        x, y = text.get_position()
        assert np.hypot(x, y) == pytest.approx(radius, rel=0.02)
        along = np.degrees(np.arctan2(-x, y))
        assert np.mod(text.get_rotation() - along + 90.0, 180.0) - 90.0 == pytest.approx(0.0, abs=10.0)
    for level, inches in ((0.05, 2.0), (9.0, 4.0)):  # a ring that is hardly longer than its label, and no ring
        ax, lines = contours(np.hypot, [level], inches)
        label_isolines(ax, lines, {level: f"{level:g}"}, SQUARE)
        assert not ax.texts


@pytest.mark.parametrize("y_limits", [(-1, 1), (1, -1)])
def test_labels_are_never_upside_down(y_limits: tuple[int, int]) -> None:
    """Whichever way lines run, and also where y is downwards as on scans, letters stand on their feet."""
    ax, lines = contours(np.hypot, [0.3, 0.5, 0.7, 0.9], inches=6.0)
    ax.set_ylim(*y_limits)
    label_isolines(ax, lines, {level: f"{level}" for level in (0.3, 0.5, 0.7, 0.9)}, SQUARE)
    turned = [(text.get_rotation() + 180.0) % 360.0 - 180.0 for text in ax.texts]
    assert len(turned) >= 3
    assert np.abs(turned).max() <= 90.0


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
    # Nor do they on an interrupted map, where lobes leave little room.
    figure = plots.heatmap_figure(["igh"], measure="omega", size=(6.0, 4.0))
    centres, width = widths([text for text in figure.axes[0].texts if text.get_text().isdecimal()])
    assert len(width) > 10
    assert are_apart(centres, width)


@pytest.mark.parametrize("edge", ["bottom", "left", "top", "right"])
def test_lines_cross_the_frame(edge: str) -> None:
    """Where shapely has a line and an edge cross; not where it runs along it, or passes beyond its end."""
    corners = {"bottom": (0, 0, 30, 0), "left": (0, 0, 0, 20), "top": (0, 20, 30, 20), "right": (30, 0, 30, 20)}
    side = shapely.LineString(np.reshape(corners[edge], (2, 2)))
    lines = [[[-10, -2], [10, 9], [33, 25]], [[3, 28], [21, -1]], [[-5, 5], [36, 16]], [[-9, -1], [-3, 28]]]
    lines = [np.array(line, dtype=float) for line in lines]
    crossed = [line.intersection(side) for line in map(shapely.LineString, lines)]
    truth = [(point.x, point.y) for point in crossed if not point.is_empty]
    assert truth
    np.testing.assert_allclose(crossings(lines, edge, 30.0, 20.0), truth, rtol=0, atol=1e-12)
    along = np.add(side.coords, [[-1.0, -1.0], [1.0, 1.0]])
    assert crossings([along], edge, 30.0, 20.0) == []


COUNTRIES = "2193 NZ, 3460 FJ, 3576 RU, 3031 AQ, 6350 US, 25832 DE, 2056 CH, 3057 IS, 5880 BR".split(", ")
PICTURES = [(f"EPSG:{code}", f"country:{country}") for code, country in map(str.split, COUNTRIES)]
PICTURES += [
    ("EPSG:2154", "cap:2.35,48.85,40"),
    ("EPSG:32760", "box:178,-19,-179,-15"),
    ("EPSG:25832", "box:6,47,12,55"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("projection", "region"), PICTURES)
@pytest.mark.parametrize("kind", [plots.heatmap_figure, plots.tissot_figure])
@pytest.mark.usefixtures("few_cells")
def test_texts_are_apart_and_within_the_figure(projection, region, kind) -> None:
    """Labels of the graticule, cities, the scale bar and the titles: no boxes overlap, none leaves the figure."""
    figure = kind(projection, region=region)
    figure.draw_without_rendering()
    texts = [text for ax in figure.axes for text in [ax.title, *ax.texts] if text.get_text()]
    texts = [text for text in texts if text.get_rotation() in (0.0, 360.0)]  # else of isolines: their boxes say little
    boxes, whole = [(text, text.get_window_extent()) for text in texts], figure.bbox
    for text, box in boxes:
        assert whole.x0 <= box.x0 <= box.x1 <= whole.x1, text
        assert whole.y0 <= box.y0 <= box.y1 <= whole.y1, text
    for (one, a), (other, b) in itertools.combinations(boxes, 2):
        across, up = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        # Boxes have room for letters that reach below the line.
        assert min(across, up) < 3.0, (one, other)


def labelled(figure, label: str) -> list:
    return [one for ax in figure.axes for one in ax.get_children() if one.get_label() == label]


def bar_length(ax: Axes) -> float:
    """The length of the scale bar's halves in metres of the map."""
    halves = [bar for bar in ax.findobj(Rectangle) if bar.get_transform().contains_branch(ax.transAxes)]
    return sum(patch.get_width() for patch in halves if 0 < patch.get_width() < 0.3) * np.ptp(ax.get_xlim())


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
def test_a_country_is_placed() -> None:
    """Its frame, its cities with the capital, its scale and where it lies; degrees round it."""
    figure = plots.heatmap_figure("EPSG:2056", region="country:CH")
    assert {"Bern", "Zürich", "Geneva"} <= {text.get_text() for text in labelled(figure, "city")}
    assert any(isinstance(ax, Axes) for ax in labelled(figure, "locator"))
    (bar,) = labelled(figure, "scale bar")
    assert bar.get_text() == "50 km"
    assert bar_length(figure.axes[0]) == pytest.approx(5e4, rel=1e-9)
    assert {"7°E", "8°E", "46°N", "47°N"} <= {text.get_text() for text in labelled(figure, "graticule label")}


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
def test_towns_are_the_regions_own_before_those_beyond_a_border() -> None:
    """El Paso stands on a map of Texas, and not Ciudad Juárez, which is larger; Helsinki on Finland's coarse coast."""
    found = {
        region: {text.get_text() for text in labelled(plots.tissot_figure(crs, region=region), "city")}
        for crs, region in (("EPSG:3081", "state:TX"), ("EPSG:3067", "country:FI"))
    }
    assert {"El Paso", "Laredo", "Brownsville"} <= found["state:TX"]
    assert "Helsinki" in found["country:FI"]


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
@pytest.mark.parametrize(("crs", "region"), [("EPSG:3857", "country:BE"), ("EPSG:26913", "state:CO")])
def test_a_locator_covers_none_of_the_region(crs: str, region: str) -> None:
    """Belgium has a corner that is free, Colorado has none, and no locator."""
    ax = plots.heatmap_figure(crs, region=region).axes[0]
    found = [one for one in ax.get_children() if one.get_label() == "locator"]
    assert len(found) == (region == "country:BE")
    for globe in found:
        (left, bottom), (right, top) = ax.transAxes.inverted().transform(globe.bbox.get_points())
        x, y = np.meshgrid(np.linspace(left, right, 30), np.linspace(bottom, top, 30))
        places = ax.transData.inverted().transform(ax.transAxes.transform(np.column_stack([x.ravel(), y.ravel()])))
        lon, lat = pyproj.Transformer.from_crs(crs, "EPSG:4326", always_xy=True).transform(*places.T)
        assert not get_region(region).contains(lon, lat).any()


@pytest.mark.slow
@pytest.mark.parametrize("context", ["none", "coast", "borders"])
@pytest.mark.usefixtures("few_cells")
def test_less_is_shown_on_request(context: str) -> None:
    """Lines of the coast from "coast" on, of borders from "borders" on, cities only with all."""
    figure = plots.heatmap_figure("EPSG:2056", region="country:CH", context=context)
    assert bool(labelled(figure, "coastline")) == (context != "none")
    assert bool(labelled(figure, "borders")) == (context == "borders")
    assert labelled(figure, "city") == []
    # There is no scale bar where the scale is two and more.
    assert labelled(plots.heatmap_figure("mercator", region="country:NO@main", context=context), "scale bar") == []


@pytest.mark.slow
def test_labels_of_isolines_give_way_to_the_city_of_a_picture() -> None:
    """San Francisco, in its own circle, stands on an isoline's middle; a square centimetre has no room for cities."""
    assert len(labelled(plots.tissot_figure("EPSG:2056", size=(1.4, 1.4)), "city")) < 4
    figure = plots.figure("EPSG:7131", region="cap:-122.42,37.77,40")
    texts = [text for text in figure.axes[0].texts if text.get_text()]
    (city,) = (text for text in texts if text.get_text() == "San Francisco")
    assert not any(city.get_window_extent().overlaps(text.get_window_extent()) for text in texts if text is not city)


def surface_of(projection: str, step: float) -> Surface:
    return build_surface(domain_of(Projection.from_user_input(projection), None), step)


def scale_of(measure: str, low: float, high: float, **options: Any) -> ColourScale:
    """The colours of values that are spread evenly."""
    return ColourScale.of(get_measure(measure), [np.linspace(low, high, 1000)], [np.ones(1000)], **options)


@pytest.mark.slow
def test_unbounded_measure_does_not_wash_out() -> None:
    """The colours of a scale that grows without bound stop below its maximum, and the bar says so."""
    surface = surface_of("eqc", 1.0)
    values = field(surface, get_measure("k"))[: surface.nodes]
    scale = ColourScale.of(get_measure("k"), [values], [surface.weights])
    assert (scale.limits[0], scale.extend) == (1.0, "max")
    assert 5.0 < scale.limits[1] < 0.5 * np.nanmax(values)


@each(("measure", "values", "limits"), [
    ("fisher", (0.2, 1.0), (0.0, 1.0)), ("fisher", (0.8, 1.0), (0.8, 1.0)), ("fisher", (0.0, 1e-9), (0.0, 1.0)),
    ("convergence", (0.2, 1.0), (0.0, 1.0)), ("convergence", (-1.0, -0.2), (-1.0, 0.0)),
    ("convergence", (-1.0, -0.8), (-1.0, -0.8)), ("convergence", (-3.0, 1.0), (-3.0, 1.0)),
    ("convergence", (0.0, 0.0), (-1.0, 1.0)), ("k", (1.2, 3.0), (1.0, 3.0)), ("k", (0.99999, 3.0), (1.0, 3.0)),
    ("k", (0.2, 0.9), (0.2, 1.0)), ("k", (2.89, 2.90), (2.89, 2.90)), ("k", (0.5, 3.0), (0.5, 3.0)),
    ("k", (2.0, 2.0), (1.0, 2.0)), ("k", (0.5, 0.5), (0.5, 1.0)),
    ("k", (1 - 1e-6, 1 + 1e-6), (np.exp(-0.1), np.exp(0.1))),
])  # fmt: skip
def test_limits_are_what_is_used(measure: str, values: tuple[float, float], limits: tuple[float, float]) -> None:
    """The bar shows the values, and the neutral one if they come near to it; noise about it is no range."""
    assert scale_of(measure, *values).limits == pytest.approx(limits)


@each(("measure", "neutral"), [("s", 1.0), ("convergence", 0.0)])
@each("reach", [(-1.0, 1.0), (0.0, 1.0), (-1.0, 0.0), (-0.3, 1.0)])
def test_neutral_colour_and_symmetry(measure: str, neutral: float, reach: tuple[float, float]) -> None:
    """However much of a diverging map is used, 1 or 0 has its middle, and equal distances have their colours."""
    low, high = (np.exp(reach) if neutral else np.array(reach)).tolist()
    scale = scale_of(measure, low, high)
    whole = matplotlib.colormaps["RdBu_r"]
    distance = np.linspace(*reach, 50)
    values = np.exp(distance) if neutral else distance
    np.testing.assert_allclose(scale.colours(scale.norm(values)), whole(0.5 + 0.5 * distance), atol=0.03)
    assert scale.cmap == "RdBu_r"


@each(("limits", "options", "cmap", "shares"), [
    ((2.89, 2.9), {}, "viridis_r", (0.0, 1.0)), ((0.5, 0.51), {}, "viridis", (0.0, 1.0)),  # lightest next to 1
    ((1.0, 2.0), {"cmap": "magma"}, "magma", (0.0, 1.0)), ((1.0, 2.0), {"cmap": "PuOr"}, "PuOr", (0.5, 1.0)),
])  # fmt: skip
def test_maps_of_colours(limits: tuple[float, ...], options: dict, cmap: str, shares: tuple[float, ...]) -> None:
    """Far from 1 there is no neutral colour; of one's own a sequential map is used whole, a diverging one about 1."""
    scale = scale_of("s", *limits, **options)
    assert scale.cmap == cmap
    np.testing.assert_allclose(scale.colours([0.0, 1.0]), matplotlib.colormaps[cmap](shares), atol=0.02)


def test_levels_and_their_labels() -> None:
    """Levels that are listed are kept, sorted; a count gives about as many; none at all are none."""
    np.testing.assert_array_equal(scale_of("fisher", 0, 1, levels=[0.5, 0.75, 0.25, 0.5]).levels, [0.25, 0.5, 0.75])
    assert 3 <= scale_of("fisher", 0, 1, levels=4).levels.size <= 6
    assert scale_of("fisher", 0, 1, levels=[]).levels.size == 0
    # Labels have the digits that tell levels apart, and no more.
    for labels in (["0.9996", "1", "1.0004"], ["0", "0.5", "1"], ["1,000", "20,000"]):
        assert level_labels(np.array([float(label.replace(",", "")) for label in labels])) == labels
    # Levels beyond the values have no isolines, and one line says so; those that a count makes are never beyond.
    for levels, said in (
        ([10.0, 200.0], r"^The level 200 has no isoline: it is beyond the values, 0 to 90\.$"),
        ([-3.0, 10.0, 200.0], r"^The levels -3 and 200 have no isolines: they are beyond the values, 0 to 90\.$"),
        (list(range(100, 120)), r"^The levels 100, 101, 102, 103, 104 and 15 more have no isolines"),
    ):
        with pytest.warns(Notice, match=said):
            scale_of("omega", 0.0, 90.0, levels=levels)
    scale_of("omega", 0.0, 90.0, levels=20)
    # About 1, a part in a million is PROJ's noise; far from 1 it is what there is to see.
    for middle, reach, shown in ((1.0, 1e-6, False), (1.0, 1e-4, True), (2.89, 1e-6, True)):
        low, high = middle - reach, middle + reach
        assert bool(shown_levels(scale_of("s", low, high), np.linspace(low, high, 100)).size) == shown


@each(("measure", "label"), [
    ("s", "Areal scale s"), ("fisher", "Fisher distortion"), ("omega", "Angular distortion omega (degrees)"),
    ("convergence", "Meridian convergence (degrees)"), ("ppm", "Scale error (ppm)"), ("a", "Tissot semimajor a"),
])  # fmt: skip
def test_labels_have_symbols(measure: str, label: str) -> None:
    """Unless the symbol is a word of the name, or its unit."""
    assert scale_of(measure, 1.0, 2.0).label == label


def isolines_of(figure: Figure) -> list[TriContourSet]:
    return [child for child in figure.axes[0].get_children() if isinstance(child, TriContourSet)]


@pytest.mark.slow
def test_isolines_of_figures() -> None:
    """Of levels in any order; of rounding noise there are none, nor along a jump."""
    figure = plots.heatmap_figure(["merc"], measure="s", region=EUROPE, levels=[3.0, 2.0, 1.5])
    np.testing.assert_array_equal(isolines_of(figure)[0].levels, [1.5, 2.0, 3.0])
    assert not isolines_of(plots.heatmap_figure(["moll"], measure="s", region=EUROPE))  # one colour
    # No piece of an isoline of Goode's map runs along the parallel of 40 degrees 44 minutes.
    figure = plots.heatmap_figure("goode-homolosine", measure="omega")
    (lines,) = isolines_of(figure)
    pieces = [piece for path in lines.get_paths() for piece in path.to_polygons(closed_only=False)]
    assert len(pieces) > 8
    segments = np.concatenate([np.stack([piece[:-1], piece[1:]], axis=1) for piece in pieces])
    # Half a cell from the joint; a few lines cross it, as they have nearly the same place on both sides.
    near = (np.abs(np.abs(segments[..., 1]) / R - np.radians(JOINT)) < np.radians(0.3)).all(axis=1)
    along = np.abs(np.diff(segments[..., 0], axis=1)[:, 0])
    assert along[near].sum() < 1e-2 * np.ptp(figure.axes[0].get_xlim())


def test_what_is_refused() -> None:
    """A number of levels is 1 to 100, and values are finite; limits ascend, and are numbers; colour maps are known."""
    for levels in (0, -1, 101, 10**9, 2.5, np.nan, [1.0, np.nan], [np.inf], range(101), "5"):
        said = "Invalid levels '.*'. They must be a number of isolines, 1 to 100, or"
        refuses(said, scale_of, "fisher", 0.0, 1.0, levels=levels)
    for low, high in ((1, 0), (np.nan, 1), (0, np.inf)):
        refuses(rf"Invalid colour limits '{low}, {high}'. They must ascend", scale_of, "k", 0, 1, limits=(low, high))
    refuses("Invalid colour map 'none'. It must be a name of matplotlib", scale_of, "s", 1.0, 2.0, cmap="none")


@pytest.mark.slow
@pytest.mark.parametrize("projection", ["igh", "healpix", "robin"])
def test_field_on_both_sides_of_a_seam(projection: str) -> None:
    """The values at the two images of a seam are those of their own side, where they are."""
    surface, convergence = surface_of(projection, 2.0), get_measure("convergence")
    values = field(surface, convergence)
    assert np.isfinite(values[np.unique(surface.triangles)]).all()
    images = np.flatnonzero(np.isfinite(surface.x) & (np.abs(surface.v) < 80.0))
    images = images[images >= surface.nodes]
    lon, lat = surface.lonlat()
    node = surface.source[images]
    # A twentieth of the way to the node.
    lons = lon[images] + 0.05 * (np.mod(lon[node] - lon[images] + 180.0, 360.0) - 180.0)
    lats = lat[images] + 0.05 * (lat[node] - lat[images])
    expected = convergence(jacobian(surface.domain.projection, np.mod(lons + 180.0, 360.0) - 180.0, lats))
    np.testing.assert_allclose(values[images], expected, atol=0.1)
    assert np.abs(values[node] - expected).max() > 0.15


def test_flexion_of_the_gnomonic_map() -> None:
    """Great circles are straight on the gnomonic map: a field of second derivatives is 0 but for rounding."""
    surface = surface_of(f"+proj=gnom +lat_0=90 +R={R}", 4.0)
    values = field(surface, get_measure("flexion"))
    assert np.nanmax(np.abs(values[np.unique(surface.triangles)])) < 1e-3


JOINT = 40.0 + 44.0 / 60.0 + 11.98 / 3600.0  # degrees: where Goode joins two maps


@pytest.mark.slow
@each(("levels", "shown"), [
    ([5.0, 8.0, 10.0, 12.0, 15.0], {10.0}), ([0.0, 45.0, 90.0], {0.0, 45.0, 90.0}),
    (np.arange(0.0, 91.0, 1.0).tolist(), {0.0}), ([10.0, 10.01, 10.02, 80.0], {10.0, 80.0}),
])  # fmt: skip
@each("inches", [1.0, 5.0])
def test_ticks_do_not_collide(levels: list[float], shown: set[float], inches: float) -> None:
    """As many labels as have room stand below a bar, whatever the levels; their boxes are apart."""
    scale, figure = scale_of("omega", 0.0, 90.0, levels=levels), Figure(figsize=(inches + 1.0, 2.0), dpi=150)
    bar = draw_colourbar(figure, scale, cax=figure.add_axes((0.5 / (inches + 1.0), 0.5, inches / (inches + 1.0), 0.1)))
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in bar.ax.get_xticklabels()]
    assert boxes
    assert all(one.x1 < other.x0 for one, other in itertools.pairwise(boxes))
    assert inches < 5.0 or shown <= set(bar.get_ticks())
