"""Mosaics: overlapping images or map sheets brought into the common frame that distorts them least."""

from projdist.mosaics.correspondences import Correspondences, parse_sizes, read_correspondences
from projdist.mosaics.projective import MODELS
from projdist.mosaics.registration import Match, Registration, register

__all__ = [
    "MODELS",
    "Correspondences",
    "Match",
    "Registration",
    "parse_sizes",
    "read_correspondences",
    "register",
]
