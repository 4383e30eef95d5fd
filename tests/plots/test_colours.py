"""Colours of a measure: limits by its kind, the neutral colour, the part of a map that is used, levels and labels."""

from typing import Any

import matplotlib
import numpy as np
import pytest
from tables import each

from projdist import plots
from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS as R
from projdist.field.at_points import jacobian
from projdist.matrices.measures import get_measure
from projdist.plots.colours import ColourScale, level_labels, shown_levels
from projdist.projections import Projection
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
        ("fisher", (0.2, 1.0), (0.0, 1.0)),
        ("fisher", (0.8, 1.0), (0.8, 1.0)),
        ("fisher", (0.0, 1e-9), (0.0, 1.0)),
        ("convergence", (0.2, 1.0), (0.0, 1.0)),
        ("convergence", (-1.0, -0.2), (-1.0, 0.0)),
        ("convergence", (-1.0, -0.8), (-1.0, -0.8)),
        ("convergence", (-3.0, 1.0), (-3.0, 1.0)),
        ("convergence", (0.0, 0.0), (-1.0, 1.0)),
        ("k", (1.2, 3.0), (1.0, 3.0)),
        ("k", (0.99999, 3.0), (1.0, 3.0)),
        ("k", (0.2, 0.9), (0.2, 1.0)),
        ("k", (2.89, 2.90), (2.89, 2.90)),
        ("k", (0.5, 3.0), (0.5, 3.0)),
        ("k", (2.0, 2.0), (1.0, 2.0)),
        ("k", (0.5, 0.5), (0.5, 1.0)),
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
    """A figure takes levels in any order."""
    figure = plots.heatmap_figure(["merc"], measure="s", region=EUROPE, levels=[3.0, 2.0, 1.5])
    isolines = [child for child in figure.axes[0].get_children() if type(child).__name__ == "TriContourSet"]
    np.testing.assert_array_equal(isolines[0].levels, [1.5, 2.0, 3.0])


@each("levels", [0, -1, 101, 10**9, 2.5, np.nan, [1.0, np.nan], [np.inf], range(101), "5"])
def test_levels_that_are_none(levels: Any) -> None:
    """A number of levels is 1 to 100, and values are finite; else one sentence says so."""
    with pytest.raises(ValueError, match=r"Invalid levels '.*'. They must be a number of isolines, 1 to 100, or"):
        scale_of("fisher", 0.0, 1.0, levels=levels)


@pytest.mark.parametrize("limits", [(1, 0), (np.nan, 1), (0, np.inf)])
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
