from .answers import Degree, Design, Rival, Surroundings
from .kinds import KINDS
from .making import design
from .sites import SYMMETRIES
from .wishes import CRITERIA_OF_DESIGNS

__all__ = [
    "CRITERIA_OF_DESIGNS",
    "KINDS",
    "SYMMETRIES",
    "Degree",
    "Design",
    "Rival",
    "Surroundings",
    "design",
]
