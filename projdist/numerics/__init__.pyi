from .estimates import Estimate
from .gauss import DIFFERENTIATE, LEGENDRE, NODES, ORDER, PLANE_WEIGHTS, WEIGHTS, interpolate
from .graded_polynomials import ComplexPolynomials, PlanePolynomials
from .harmonic_fits import HarmonicFit, fit_harmonic
from .minima import descend, descend_lattice, lattice, least_between, least_largest, least_squares, minimise
from .statistics import CRITERIA, get_criterion, maximum, mean, median, p95, quantile, quantiles, rms

__all__ = [
    "CRITERIA",
    "DIFFERENTIATE",
    "LEGENDRE",
    "NODES",
    "ORDER",
    "PLANE_WEIGHTS",
    "WEIGHTS",
    "ComplexPolynomials",
    "Estimate",
    "HarmonicFit",
    "PlanePolynomials",
    "descend",
    "descend_lattice",
    "fit_harmonic",
    "get_criterion",
    "interpolate",
    "lattice",
    "least_between",
    "least_largest",
    "least_squares",
    "maximum",
    "mean",
    "median",
    "minimise",
    "p95",
    "quantile",
    "quantiles",
    "rms",
]
