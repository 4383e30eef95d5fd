"""Mosaics: overlapping images or map sheets brought into the common frame that distorts them least."""

from projdist.mosaics.answers import FRAMES, Canvas, Mosaic, check_frame, mosaic
from projdist.mosaics.blending import BLENDS
from projdist.mosaics.common import EXPOSURES
from projdist.mosaics.correspondences import (
    Correspondences,
    correspondences_of,
    parse_sizes,
    read_correspondences,
)
from projdist.mosaics.features import match
from projdist.mosaics.frames import Frame
from projdist.mosaics.georeference import (
    Georeference,
    MeanGeoreference,
    mean_georeference,
    read_world_file,
    world_file,
    write_world_file,
)
from projdist.mosaics.images import Picture, open_pictures
from projdist.mosaics.projective import MODELS
from projdist.mosaics.registration import Match, Registration, register
from projdist.mosaics.rendering import Rendered, render
from projdist.mosaics.saving import PICTURE_SUFFIXES, save_mosaic

__all__ = [
    "BLENDS",
    "EXPOSURES",
    "FRAMES",
    "MODELS",
    "PICTURE_SUFFIXES",
    "Canvas",
    "Correspondences",
    "Frame",
    "Georeference",
    "Match",
    "MeanGeoreference",
    "Mosaic",
    "Picture",
    "Registration",
    "Rendered",
    "check_frame",
    "correspondences_of",
    "match",
    "mean_georeference",
    "mosaic",
    "open_pictures",
    "parse_sizes",
    "read_correspondences",
    "read_world_file",
    "register",
    "render",
    "save_mosaic",
    "world_file",
    "write_world_file",
]
