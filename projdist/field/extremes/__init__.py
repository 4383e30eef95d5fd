"""Where in a region measures are largest and smallest, and by how much the values found may miss them."""

from projdist.field.extremes.goals import Extreme, Goal, measure_at
from projdist.field.extremes.search import find_extremes

__all__ = ["Extreme", "Goal", "find_extremes", "measure_at"]
