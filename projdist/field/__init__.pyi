from .airy_kavrayskiy import AiryKavrayskiy, airy_kavrayskiy_of
from .at_nodes import Nodes, nodes_at, nodes_of
from .at_points import Derivatives, Quality, derivatives, jacobian
from .cubature import UNDEFINED, UNDEFINED_AT_KINKS, Samples, sample_panels
from .cut_lengths import cut_length, is_interrupted
from .dense_samples import dense
from .extremes import Extreme, Goal, find_extremes, measure_at
from .field import DEFAULT_TOLERANCE, Field, named_measures, sample
from .figures import FIGURES, AnyFigure, Figure, get_figure
from .geometric_medians import GeometricMedian, Spread
from .given_fields import field_of
from .guard import tell_of_contradiction
from .interpolants import Interpolant, interpolant
from .on_grids import jacobian_grid
from .panel_mesh import Integrand
from .second_derivatives import hessian
from .tears import Links, Map, drawn, evaluate, find_tears

__all__ = [
    "DEFAULT_TOLERANCE",
    "FIGURES",
    "UNDEFINED",
    "UNDEFINED_AT_KINKS",
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
    "dense",
    "derivatives",
    "drawn",
    "evaluate",
    "field_of",
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
