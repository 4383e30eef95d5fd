"""The region of maps for which none was named."""

import pytest

from projdist import Notice, Projection, compare, indices, sample, summarize
from projdist.regions import GLOBE, Box, region_for


def maps(*names):
    return [Projection.from_user_input(name) for name in names]


@pytest.mark.parametrize(
    ("names", "area"),
    [
        (["robin"], GLOBE),
        ([], GLOBE),
        (["EPSG:3035"], Box(-35.58, 24.6, 44.83, 84.73)),  # as EPSG's registry has it
        (["EPSG:3035", "EPSG:2056"], GLOBE),  # of other areas
        (["EPSG:3035", "robin"], GLOBE),
        (["EPSG:32632", "EPSG:32632"], Box(6, 0, 12, 84)),
    ],
)
def test_the_area_of_use_that_all_have_else_the_globe(names, area):
    """One region for all maps of a comparison."""
    assert region_for(None, maps(*names)) == area
    assert region_for("cap:0,0,10", maps(*names)).name == "cap:0,0,10"


def test_every_answer_has_the_same_default():
    """Of a CRS alone it is its area of use."""
    area = "box:6,0,12,84"
    assert summarize("EPSG:32632", tolerance=1e-3).region.name == area
    assert sample("EPSG:32632", tolerance=1e-3).region.name == area
    assert indices("EPSG:32632", names="airy", tolerance=1e-3).region.name == area
    assert compare("EPSG:32632", tolerance=1e-3).region.name == area
    assert compare(["EPSG:32632", "nonsense"], tolerance=1e-3).region.name == area  # what fails has no area
    with pytest.warns(Notice, match=r"^EPSG:32632 is for box:6,0,12,84, where 0\.83 % of globe lies"):
        assert compare(["EPSG:32632", "robin"], tolerance=1e-3).region == GLOBE
    named, unnamed = (summarize("EPSG:32632", region).airy_kavrayskiy for region in (area, None))
    assert named == unnamed
