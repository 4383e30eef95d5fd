from .affine import FITS, AffineFit, affine_fit
from .correspondences import CORRESPONDENCES, WeightsFile, column_weights, read_weights
from .files import SUFFIXES, CloudFile, read_cloud
from .registration import FRAMES, LeftOut, Registration, WrongPoint, register

__all__ = [
    "CORRESPONDENCES",
    "FITS",
    "FRAMES",
    "SUFFIXES",
    "AffineFit",
    "CloudFile",
    "LeftOut",
    "Registration",
    "WeightsFile",
    "WrongPoint",
    "affine_fit",
    "column_weights",
    "read_cloud",
    "read_weights",
    "register",
]
