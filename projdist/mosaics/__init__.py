"""Mosaics: overlapping images or map sheets brought into the common frame that distorts them least."""

from projdist.mosaics.answers import FRAMES, Canvas, Mosaic, check_frame, mosaic
from projdist.mosaics.correspondences import (
    Correspondences,
    correspondences_of,
    parse_sizes,
    read_correspondences,
)
from projdist.mosaics.features import match
from projdist.mosaics.frames import Frame
from projdist.mosaics.images import Picture, open_pictures
from projdist.mosaics.projective import MODELS
from projdist.mosaics.registration import Match, Registration, register

__all__ = [
    "FRAMES",
    "MODELS",
    "Canvas",
    "Correspondences",
    "Frame",
    "Match",
    "Mosaic",
    "Picture",
    "Registration",
    "check_frame",
    "correspondences_of",
    "match",
    "mosaic",
    "open_pictures",
    "parse_sizes",
    "read_correspondences",
    "register",
]
