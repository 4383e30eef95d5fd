from .answers import Degree, Design, Rival, Surroundings
from .atlas_entries import AtlasEntry, AtlasMap, AtlasPurpose, AtlasZones, atlas, atlas_names
from .atlas_measurement import AtlasArea, atlas_areas, measured_entry
from .averaging import MeanMap, Nearness, mean_map
from .making import design
from .objectives import CRITERIA_OF_DESIGNS, KINDS
from .plane_means import PlaneMean, mean_plane_map
from .sites import SYMMETRIES
from .world_maps import AGAINST, Refinement, Standing, WorldMap, world_map
from .world_spec import WORLD_SYMMETRIES

__all__ = [
    "AGAINST",
    "CRITERIA_OF_DESIGNS",
    "KINDS",
    "SYMMETRIES",
    "WORLD_SYMMETRIES",
    "AtlasArea",
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
    "atlas_areas",
    "atlas_names",
    "design",
    "mean_map",
    "mean_plane_map",
    "measured_entry",
    "world_map",
]
