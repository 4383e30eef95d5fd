"""How much of a region lies in a box, by area, or by the weights of points."""

from __future__ import annotations

from projdist.regions.boxes import Box
from projdist.regions.caps import Cap
from projdist.regions.points import PointSet
from projdist.regions.region import Region

_WHOLE = 1.0 - 1e-9


def share_in(box: Box, region: Region | PointSet) -> float:
    """The share of a region that lies in a box; of a kind of region not from here, that of its bounds."""
    if isinstance(region, PointSet):
        return float(region.weight[box.contains(region.lon, region.lat)].sum() / region.weight.sum())
    around = Box.between(region.bounds, getattr(region, "ellipsoid", None))
    share = around.shared_km2(box) / around.area_km2
    if share == 0.0 or isinstance(region, Box):
        return share
    if share > _WHOLE:
        return 1.0
    from projdist.regions.combined import combine  # shapely is slow to load
    from projdist.regions.polygons import Polygons

    if not isinstance(region, Cap | Polygons):
        return share
    try:
        return combine("&", region, box, region.name).area_km2 / region.area_km2
    except ValueError:  # nothing is left
        return 0.0
