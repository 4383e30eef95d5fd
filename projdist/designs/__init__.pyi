from .answers import Degree, Design, Rival, Surroundings
from .atlas.areas import AtlasArea, atlas_areas
from .atlas.measuring import measured_entry
from .averaging import mean_map
from .kinds import KINDS
from .making import design
from .mean_answers import MeanMap, Nearness
from .plane_means import PlaneMean, mean_plane_map
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
    "atlas_areas",
    "design",
    "mean_map",
    "mean_plane_map",
    "measured_entry",
    "world_map",
]
