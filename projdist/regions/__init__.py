"""Regions of the Earth to integrate over, and the language that names them."""

from projdist.regions.boxes import GLOBE, Box
from projdist.regions.caps import Cap
from projdist.regions.language import Place, get_region, weighted_points
from projdist.regions.points import PointSet
from projdist.regions.region import ChartPoints, Clips, Region

__all__ = [
    "GLOBE",
    "Box",
    "Cap",
    "ChartPoints",
    "Clips",
    "Place",
    "PointSet",
    "Region",
    "get_region",
    "weighted_points",
]
