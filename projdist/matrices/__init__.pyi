from . import spd
from .affine import Affine
from .decomposition import Decomposition, decompose
from .distortion_modes import Modes, field_modes, modes
from .distortions import (
    FACTORS,
    angular_distortion,
    areal_error_ppm,
    areal_scale,
    factors_of,
    fisher,
    jordan,
    log_anisotropy,
    log_areal_scale,
    log_scales,
    meridian_convergence,
    orientation,
    principal_scales,
    scale_error_ppm,
)
from .energies import EXPONENT, Energy, Expansion
from .mean_transformation import MDT, check_weights, field_mdt, field_median, mdt
from .measures import MEASURES, Measure, get_measure, listed_measures
from .rotations import ROTATIONS, Rotation, axes_shift, field_rotation, mean_rotation, turns
from .spd import factor_distance

__all__ = [
    "EXPONENT",
    "FACTORS",
    "MDT",
    "MEASURES",
    "ROTATIONS",
    "Affine",
    "Decomposition",
    "Energy",
    "Expansion",
    "Measure",
    "Modes",
    "Rotation",
    "angular_distortion",
    "areal_error_ppm",
    "areal_scale",
    "axes_shift",
    "check_weights",
    "decompose",
    "factor_distance",
    "factors_of",
    "field_mdt",
    "field_median",
    "field_modes",
    "field_rotation",
    "fisher",
    "get_measure",
    "jordan",
    "listed_measures",
    "log_anisotropy",
    "log_areal_scale",
    "log_scales",
    "mdt",
    "mean_rotation",
    "meridian_convergence",
    "modes",
    "orientation",
    "principal_scales",
    "scale_error_ppm",
    "spd",
    "turns",
]
