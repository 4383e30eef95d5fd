from .at_points import Derivatives, Quality, derivatives, jacobian
from .cubature import AiryKavrayskiy, GeometricMedian, Samples, Spread, airy_kavrayskiy_of, sample_panels
from .extremes import Extreme, Goal, find_extremes, measure_at
from .field import DEFAULT_TOLERANCE, Field, field_resolving, named_measures, sample, tell_of_contradiction
from .figures import FIGURES, AnyFigure, Figure, get_figure
from .given_fields import Nodes, field_of, nodes_at, nodes_of
from .interpolants import Interpolant, interpolant
from .on_grids import jacobian_grid
from .panel_mesh import Integrand
from .stencils import hessian
from .tears import Links, Map, cut_length, drawn, evaluate, find_tears, is_interrupted

__all__ = [
    "DEFAULT_TOLERANCE",
    "FIGURES",
    "AiryKavrayskiy",
    "AnyFigure",
    "Derivatives",
    "Extreme",
    "Field",
    "Figure",
    "GeometricMedian",
    "Goal",
    "Integrand",
    "Interpolant",
    "Links",
    "Map",
    "Nodes",
    "Quality",
    "Samples",
    "Spread",
    "airy_kavrayskiy_of",
    "cut_length",
    "derivatives",
    "drawn",
    "evaluate",
    "field_of",
    "field_resolving",
    "find_extremes",
    "find_tears",
    "get_figure",
    "hessian",
    "interpolant",
    "is_interrupted",
    "jacobian",
    "jacobian_grid",
    "measure_at",
    "named_measures",
    "nodes_at",
    "nodes_of",
    "sample",
    "sample_panels",
    "tell_of_contradiction",
]
