"""Colour scales and colour bars."""

import itertools
import re
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from tables import each

from projdist import plots
from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS as R
from projdist.field.at_points import jacobian
from projdist.matrices.measures import get_measure
from projdist.plots.colours import ColourScale, level_labels, shown_levels
from projdist.plots.map_drawing import draw_colourbar, label_isolines
from projdist.projections import Projection
from projdist.support import Notice
from projdist.surfaces.domain import domain_of
from projdist.surfaces.fields import field
from projdist.surfaces.surface import Surface, build_surface

EUROPE = "box:-10,35,40,70"


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
    low, high = scale.limits
    assert low == 1.0
    assert 5.0 < high < 0.5 * np.nanmax(values)
    assert scale.extend == "max"


@each(
    ("measure", "values", "limits"),
    [
        *(("fisher", (0.2, 1.0), (0.0, 1.0)), ("fisher", (0.8, 1.0), (0.8, 1.0)), ("fisher", (0.0, 1e-9), (0.0, 1.0))),
        *(("convergence", (0.2, 1.0), (0.0, 1.0)), ("convergence", (-1.0, -0.2), (-1.0, 0.0))),
        *(("convergence", (-1.0, -0.8), (-1.0, -0.8)), ("convergence", (-3.0, 1.0), (-3.0, 1.0))),
        *(("convergence", (0.0, 0.0), (-1.0, 1.0)), ("k", (1.2, 3.0), (1.0, 3.0)), ("k", (0.99999, 3.0), (1.0, 3.0))),
        *(("k", (0.2, 0.9), (0.2, 1.0)), ("k", (2.89, 2.90), (2.89, 2.90)), ("k", (0.5, 3.0), (0.5, 3.0))),
        *(("k", (2.0, 2.0), (1.0, 2.0)), ("k", (0.5, 0.5), (0.5, 1.0))),
        ("k", (1 - 1e-6, 1 + 1e-6), (np.exp(-0.1), np.exp(0.1))),
    ],
)
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


@pytest.mark.parametrize(("low", "high", "cmap"), [(2.89, 2.9, "viridis_r"), (0.5, 0.51, "viridis")])
def test_far_from_neutral(low: float, high: float, cmap: str) -> None:
    """Where 1 is not on the scale there is no neutral colour, and the lightest is nearest to 1."""
    scale = scale_of("s", low, high)
    lightness = scale.colours([0.0, 1.0])[:, :3].sum(axis=1)
    assert scale.cmap == cmap
    assert (lightness[0] > lightness[1]) == (low > 1)


def test_a_map_of_ones_own() -> None:
    """A sequential map is used whole, a diverging one about 1; an unknown one is refused."""
    colours = scale_of("s", 1.0, 2.0, cmap="magma").colours
    np.testing.assert_allclose(colours([0.0, 1.0]), matplotlib.colormaps["magma"]([0.0, 1.0]))
    colours = scale_of("s", 1.0, 2.0, cmap="PuOr").colours
    np.testing.assert_allclose(colours([0.0, 1.0]), matplotlib.colormaps["PuOr"]([0.5, 1.0]), atol=0.02)
    with pytest.raises(ValueError, match=r"Invalid colour map 'none'. It must be a name of matplotlib"):
        scale_of("s", 1.0, 2.0, cmap="none")


def test_levels_are_taken_as_given() -> None:
    """Levels that are listed are kept, sorted; a count gives about as many; none at all are none."""
    np.testing.assert_array_equal(scale_of("fisher", 0, 1, levels=[0.5, 0.75, 0.25, 0.5]).levels, [0.25, 0.5, 0.75])
    assert 3 <= scale_of("fisher", 0, 1, levels=4).levels.size <= 6
    assert scale_of("fisher", 0, 1, levels=[]).levels.size == 0


@pytest.mark.slow
def test_descending_levels_are_drawn() -> None:
    """A figure takes levels in any order, and says which are beyond the values."""
    with pytest.warns(Notice, match=re.escape("The level 9 has no isoline")):
        figure = plots.heatmap_figure(["merc"], measure="s", region=EUROPE, levels=[9.0, 3.0, 2.0, 1.5])
    isolines = [child for child in figure.axes[0].get_children() if type(child).__name__ == "TriContourSet"]
    np.testing.assert_array_equal(isolines[0].levels, [1.5, 2.0, 3.0])


@each("levels", [0, -1, 101, 10**9, 2.5, np.nan, [1.0, np.nan], [np.inf], range(101), "5"])
def test_levels_that_are_none(levels: Any) -> None:
    """A number of levels is 1 to 100, and values are finite; else one sentence says so."""
    with pytest.raises(ValueError, match=r"Invalid levels '.*'. They must be a number of isolines, 1 to 100, or"):
        scale_of("fisher", 0.0, 1.0, levels=levels)


@each("limits", [(1, 0), (np.nan, 1), (0, np.inf)])
def test_bad_limits(limits: tuple[float, float]) -> None:
    """Limits must ascend, and be numbers."""
    with pytest.raises(ValueError, match=rf"Invalid colour limits '{limits[0]}, {limits[1]}'. They must ascend"):
        scale_of("fisher", 0.0, 1.0, limits=limits)


def test_level_labels() -> None:
    """Labels have the digits that tell levels apart, and no more."""
    assert level_labels(np.array([0.9996, 1.0, 1.0004])) == ["0.9996", "1", "1.0004"]
    assert level_labels(np.array([0.0, 0.5, 1.0])) == ["0", "0.5", "1"]
    assert level_labels(np.array([1000.0, 20000.0])) == ["1,000", "20,000"]


@pytest.mark.slow
def test_constant_field_has_no_isolines() -> None:
    """The areal scale of an equal-area map is one colour, without lines of rounding noise."""
    figure = plots.heatmap_figure(["moll"], measure="s", region=EUROPE)
    assert not [child for child in figure.axes[0].get_children() if type(child).__name__ == "TriContourSet"]


@pytest.mark.parametrize(("middle", "reach", "shown"), [(1.0, 1e-6, False), (1.0, 1e-4, True), (2.89, 1e-6, True)])
def test_isolines_of_small_differences(middle: float, reach: float, shown: bool) -> None:
    """About 1, a part in a million is PROJ's noise; far from 1 it is what there is to see."""
    low, high = middle - reach, middle + reach
    assert bool(shown_levels(scale_of("s", low, high), np.linspace(low, high, 100)).size) == shown


@pytest.mark.slow
@pytest.mark.parametrize("projection", ["igh", "healpix", "robin"])
def test_field_on_both_sides_of_a_seam(projection: str) -> None:
    """The values at the two images of a seam are those of their own side, where they are."""
    surface = surface_of(projection, 2.0)
    convergence = get_measure("convergence")
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
    surface = build_surface(domain_of(Projection.from_user_input(f"+proj=gnom +lat_0=90 +R={R}"), None), 4.0)
    values = field(surface, get_measure("flexion"))
    assert np.nanmax(np.abs(values[np.unique(surface.triangles)])) < 1e-3


JOINT = 40.0 + 44.0 / 60.0 + 11.98 / 3600.0  # degrees: where Goode joins two maps


@each(
    ("levels", "shown"),
    [
        *(([5.0, 8.0, 10.0, 12.0, 15.0], {10.0}), ([0.0, 45.0, 90.0], {0.0, 45.0, 90.0})),
        *((np.arange(0.0, 91.0, 1.0).tolist(), {0.0}), ([10.0, 10.01, 10.02, 80.0], {10.0, 80.0})),
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
