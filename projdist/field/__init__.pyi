from .at_points import (
    Derivatives,
    Quality,
    derivatives,
    jacobian,
    measure_at,
)
from .extremes import Extreme
from .field import Field
from .figures import FIGURES, AiryKavrayskiy, AnyFigure, Figure, GeometricMedian, Spread, get_figure
from .sampling import (
    DEFAULT_TOLERANCE,
    Nodes,
    check_declared_property,
    field_of,
    field_resolving,
    named_measures,
    nodes_at,
    nodes_of,
    sample,
)
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
    "Links",
    "Map",
    "Nodes",
    "Quality",
    "Spread",
    "check_declared_property",
    "cut_length",
    "derivatives",
    "drawn",
    "evaluate",
    "field_of",
    "field_resolving",
    "find_tears",
    "get_figure",
    "hessian",
    "is_interrupted",
    "jacobian",
    "measure_at",
    "named_measures",
    "nodes_at",
    "nodes_of",
    "sample",
]
