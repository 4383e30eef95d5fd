from .answers import Degree, Design, Rival, Surroundings
from .averaging import mean_map
from .kinds import KINDS
from .making import design
from .mean_answers import MeanMap, Nearness
from .plane_means import PlaneMean, mean_plane_map
from .regional_atlas.areas import AtlasArea, atlas_areas
from .regional_atlas.entries import AtlasEntry, AtlasMap, AtlasPurpose, AtlasZones
from .regional_atlas.measuring import measured_entry
from .regional_atlas.reading import atlas, atlas_names
from .sites import SYMMETRIES
from .wishes import CRITERIA_OF_DESIGNS
from .world_maps import AGAINST, Refinement, Standing, WorldMap, world_map
from .world_wishes import WORLD_SYMMETRIES

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
