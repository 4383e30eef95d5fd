"""Point clouds and landmarks in any dimension: affine registration, and the frame that distorts them least."""

from projdist.applications.pointclouds.affine import FITS, AffineFit, affine_fit
from projdist.applications.pointclouds.correspondences import CORRESPONDENCES, WeightsFile, column_weights, read_weights
from projdist.applications.pointclouds.files import SUFFIXES, CloudFile, read_cloud
from projdist.applications.pointclouds.registration import FRAMES, LeftOut, Registration, WrongPoint, register

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
