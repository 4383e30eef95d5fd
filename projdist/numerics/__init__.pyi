from .estimates import Estimate
from .gauss import DIFFERENTIATE, LEGENDRE, NODES, ORDER, PLANE_WEIGHTS, WEIGHTS, interpolate
from .minima import descend, descend_lattice, lattice, least_between, minimise
from .statistics import CRITERIA, get_criterion, maximum, mean, median, p95, quantile, rms

__all__ = [
    "CRITERIA",
    "DIFFERENTIATE",
    "LEGENDRE",
    "NODES",
    "ORDER",
    "PLANE_WEIGHTS",
    "WEIGHTS",
    "Estimate",
    "descend",
    "descend_lattice",
    "get_criterion",
    "interpolate",
    "lattice",
    "least_between",
    "maximum",
    "mean",
    "median",
    "minimise",
    "p95",
    "quantile",
    "rms",
]
