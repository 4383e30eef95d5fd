"""The region of maps for which none was named."""

from __future__ import annotations

from collections.abc import Iterable

from projdist.projections import Projection
from projdist.regions.boxes import GLOBE, Box
from projdist.regions.language import Place, RegionLike, get_region

__all__ = ["region_for"]


def region_for(region: RegionLike | None, projections: Iterable[Projection]) -> Place:
    """A region; without one the area of use that is that of all maps, else the globe. Raises ValueError."""
    if region is not None:
        return get_region(region)
    areas = {projection.area_of_use for projection in projections}
    area = areas.pop() if len(areas) == 1 else None
    return GLOBE if area is None else Box(*area)
