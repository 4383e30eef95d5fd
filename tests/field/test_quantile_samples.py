"""Values at many points of a region, for medians and shares of its area."""

import pytest

from projdist.field import field_resolving
from projdist.projections import Projection
from projdist.regions import get_region

# Panels of a polygon's edge have just their part. In whole ones the lattice's sum of a smooth density is as far off as
# one in its number of points, a few thousand to a panel.
EXACT, LATTICE = 1e-12, 2e-4


@pytest.mark.parametrize(
    ("region", "error"),
    [
        ("country:CH", EXACT),
        ("box:0,40,20,60", LATTICE),
        pytest.param("cap:10,80,2000", LATTICE, marks=pytest.mark.slow),
    ],
)
def test_weights_are_the_area(region, error):
    """The points stand for the whole region, and for nothing beside it."""
    place = get_region(region)
    field = field_resolving(Projection.from_user_input("plate-carree"), place, tolerance=1e-4)
    values, weights = field.many(field.lat)
    assert (weights >= 0).all()
    assert weights.sum() == pytest.approx(field.weight.sum(), rel=error)
    south, north = place.bounds[1::2]
    assert ((values >= south - 1e-9) & (values <= north + 1e-9))[weights > 0].all()
