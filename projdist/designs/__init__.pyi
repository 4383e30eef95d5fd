from .atlas_entries import (
    AtlasEntry,
    AtlasMap,
    AtlasPurpose,
    AtlasZones,
    atlas,
    atlas_names,
)
from .averaging import MeanMap, Nearness, mean_map
from .base_maps import CRITERIA_OF_DESIGNS, KINDS, SYMMETRIES
from .making import Degree, Design, Rival, Surroundings, design
from .plane_maps import PlaneMean, mean_plane_map
from .world_maps import AGAINST, WORLD_SYMMETRIES, Refinement, Standing, WorldMap, world_map

__all__ = [
    "AGAINST",
    "CRITERIA_OF_DESIGNS",
    "KINDS",
    "SYMMETRIES",
    "WORLD_SYMMETRIES",
    "AtlasEntry",
    "AtlasMap",
    "AtlasPurpose",
    "AtlasZones",
    "Degree",
    "Design",
    "MeanMap",
    "Nearness",
    "PlaneMean",
    "Refinement",
    "Rival",
    "Standing",
    "Surroundings",
    "WorldMap",
    "atlas",
    "atlas_names",
    "design",
    "mean_map",
    "mean_plane_map",
    "world_map",
]
