"""Areas on the cells of a surface: the quick test leaves out no cell that the border meets."""

import numpy as np
import pytest
import shapely

from projdist.projections import Projection
from projdist.surfaces.domain import domain_of, normalised
from projdist.surfaces.land import PreparedArea, _whole_area
from projdist.surfaces.surface import build_surface


@pytest.mark.parametrize(
    ("region", "share"), [(None, 0.3), ((-12.0, 30.0, 45.0, 72.0), 0.3), ((20.0, 20.0, 21.0, 21.0), 0.0)]
)
def test_few_cells_may_be_on_the_border(region: tuple[float, float, float, float] | None, share: float) -> None:
    """Cells that GEOS finds on the coast are among them, all but boxes of which are off it; inland there are none."""
    surface = build_surface(domain_of(Projection.from_user_input("eqc"), region), None if region else 2.0)
    lons, lats = (degrees[surface.whole.T] for degrees in surface.lonlat())
    lons = normalised(lons[0]) + np.mod(lons - lons[0] + 180.0, 360.0) - 180.0
    area: PreparedArea = _whole_area("coast", "110m")
    boxes = shapely.box(lons.min(axis=0), lats.min(axis=0), lons.max(axis=0), lats.max(axis=0))
    met = set(area.edges.query(boxes, predicate="intersects")[0].tolist())
    found = set(area.may_border(lons, lats).tolist())
    assert met <= found
    assert len(found) <= share * len(boxes)
