from .at_points import (
    Derivatives,
    Interpolant,
    Quality,
    derivatives,
    interpolant,
    jacobian,
    jacobian_grid,
    measure_at,
)
from .cubature import AiryKavrayskiy, GeometricMedian, Samples, Spread, airy_kavrayskiy_of, sample_panels
from .extreme_bounds import Goal
from .extremes import Extreme, find_extremes
from .field import DEFAULT_TOLERANCE, Field, check_declared_property, field_resolving, named_measures, sample
from .figures import FIGURES, AnyFigure, Figure, get_figure
from .given_fields import Nodes, field_of, nodes_at, nodes_of
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
    "check_declared_property",
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
]
