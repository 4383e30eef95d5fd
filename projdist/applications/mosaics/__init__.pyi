from .answers import FRAMES, Mosaic, check_frame, mosaic, mosaics_of_groups
from .bundle_adjustment import ModelFit
from .canvases import (
    Canvas,
    Georeference,
    MeanGeoreference,
    SphereCanvas,
    mean_georeference,
    read_world_file,
    world_file,
    write_world_file,
)
from .correspondences import Correspondences, correspondences_of, parse_sizes, read_correspondences
from .features import match
from .homographies import CHOICES, MODELS, corners, places
from .images import Picture, check_pixels, open_image, open_pictures
from .panoramas import FOCALS, MappedPanorama, Panorama, map_of_sphere, panorama, panoramas_of_groups
from .registration import Cameras, Frame, ImageRegistration, Match, register, register_groups
from .rendering import (
    BLENDS,
    DEEP_SUFFIXES,
    DEPTHS,
    EXPOSURES,
    PICTURE_SUFFIXES,
    Rendered,
    render,
    save_mosaic,
)

__all__ = [
    "BLENDS",
    "CHOICES",
    "DEEP_SUFFIXES",
    "DEPTHS",
    "EXPOSURES",
    "FOCALS",
    "FRAMES",
    "MODELS",
    "PICTURE_SUFFIXES",
    "Cameras",
    "Canvas",
    "Correspondences",
    "Frame",
    "Georeference",
    "ImageRegistration",
    "MappedPanorama",
    "Match",
    "MeanGeoreference",
    "ModelFit",
    "Mosaic",
    "Panorama",
    "Picture",
    "Rendered",
    "SphereCanvas",
    "check_frame",
    "check_pixels",
    "corners",
    "correspondences_of",
    "map_of_sphere",
    "match",
    "mean_georeference",
    "mosaic",
    "mosaics_of_groups",
    "open_image",
    "open_pictures",
    "panorama",
    "panoramas_of_groups",
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
