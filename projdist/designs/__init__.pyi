from .answers import Degree, Design, Rival, Surroundings
from .kinds import KINDS
from .making import design
from .sites import SYMMETRIES
from .wishes import CRITERIA_OF_DESIGNS
from .world_maps import AGAINST, WORLD_SYMMETRIES, Refinement, Standing, WorldMap, world_map

__all__ = [
    "AGAINST",
    "CRITERIA_OF_DESIGNS",
    "KINDS",
    "SYMMETRIES",
    "WORLD_SYMMETRIES",
    "Degree",
    "Design",
    "Refinement",
    "Rival",
    "Standing",
    "Surroundings",
    "WorldMap",
    "design",
    "world_map",
]
