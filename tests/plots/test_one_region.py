"""All maps of a figure are of one region, which the figure names."""

import pytest
from pyproj import CRS

from projdist import plots

pytestmark = pytest.mark.usefixtures("few_cells")

# Of Switzerland's maps; other versions of the registry have other hundredths of a degree.
WEST, SOUTH, EAST, NORTH = CRS("EPSG:2056").area_of_use.bounds
PLACE = f"{WEST:g}°E to {EAST:g}°E, {SOUTH:g}°N to {NORTH:g}°N"


@pytest.mark.slow
def test_the_region_of_several_maps_is_named_once():
    """In the line of the ellipses, and in that of the colours."""
    maps = ["EPSG:2056", "EPSG:2056"]
    tissot = plots.tissot_figure(maps, size=(3, 2))
    assert tissot.texts[-1].get_text().endswith(f", over {PLACE}")
    heatmap = plots.heatmap_figure(maps, size=(3, 2))
    assert heatmap.axes[-1].get_xlabel() == f"Fisher distortion, over {PLACE}"


@pytest.mark.slow
def test_the_region_of_one_map_is_in_its_title():
    """A country with its code; the figure follows."""
    figure = plots.heatmap_figure("EPSG:2056", region="country:CH", airy_kavrayskiy=[0.0123])
    assert "Switzerland (CH) · Airy–Kavrayskiy 0.0123" in {text.get_text() for text in figure.axes[0].texts}
    assert figure.axes[-1].get_xlabel() == "Fisher distortion"


@pytest.mark.slow
def test_the_globe_is_not():
    """Nor where one CRS among others has an area of its own."""
    figure = plots.tissot_figure(["EPSG:3857", "robin"], size=(3, 2))
    assert "over" not in figure.texts[-1].get_text()
