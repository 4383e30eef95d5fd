from .answers import FRAMES, Canvas, Mosaic, check_frame, mosaic, mosaics_of_groups
from .blending import BLENDS
from .common import EXPOSURES
from .correspondences import Correspondences, correspondences_of, parse_sizes, read_correspondences
from .features import match
from .frames import Frame
from .georeference import (
    Georeference,
    MeanGeoreference,
    mean_georeference,
    read_world_file,
    world_file,
    write_world_file,
)
from .homographies import corners
from .images import Picture, check_pixels, open_image, open_pictures
from .models import ModelFit
from .projective import CHOICES, MODELS, places
from .registration import Match, Registration, register, register_groups
from .rendering import Rendered, render
from .saving import PICTURE_SUFFIXES, save_mosaic

__all__ = [
    "BLENDS",
    "CHOICES",
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
    "ModelFit",
    "Mosaic",
    "Picture",
    "Registration",
    "Rendered",
    "check_frame",
    "check_pixels",
    "corners",
    "correspondences_of",
    "match",
    "mean_georeference",
    "mosaic",
    "mosaics_of_groups",
    "open_image",
    "open_pictures",
    "parse_sizes",
    "places",
    "read_correspondences",
    "read_world_file",
    "register",
    "register_groups",
    "render",
    "save_mosaic",
    "world_file",
    "write_world_file",
]
