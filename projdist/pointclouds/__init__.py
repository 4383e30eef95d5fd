"""Point clouds and landmarks in any dimension: affine registration, and the frame that distorts them least."""

from projdist.pointclouds.affine import FITS, AffineFit, affine_fit
from projdist.pointclouds.correspondence import CORRESPONDENCES
from projdist.pointclouds.files import SUFFIXES, CloudFile, read_cloud
from projdist.pointclouds.registration import FRAMES, LeftOut, Registration, register

__all__ = [
    "CORRESPONDENCES",
    "FITS",
    "FRAMES",
    "SUFFIXES",
    "AffineFit",
    "CloudFile",
    "LeftOut",
    "Registration",
    "affine_fit",
    "read_cloud",
    "register",
]
