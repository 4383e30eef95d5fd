from .border import Border
from .boxes import GLOBE, Box, bounding_box
from .caps import Cap, reaches
from .cells import cells_of
from .combined import combine, geojson_of, polygons_of
from .defaults import check_on_body, ground_of_maps, region_for
from .files import features_from_file, polygons_from_geojson
from .language import (
    HasGeometry,
    Place,
    RegionLike,
    get_region,
    is_region_text,
    layer_path,
    region_of_text,
    weighted_points,
)
from .lines import line_of
from .names import folded, full_name, region_names
from .parts import main_part
from .patches import height_of, latitude_of
from .points import PointSet
from .polygons import Polygons
from .reading import crs_name, tell_of_geojson_in_degrees, with_gpx_heights
from .region import ChartPoints, Clips, Region
from .shares import share_in
from .titles import region_title
from .turned import TurnedGlobe

__all__ = [
    "GLOBE",
    "Border",
    "Box",
    "Cap",
    "ChartPoints",
    "Clips",
    "HasGeometry",
    "Place",
    "PointSet",
    "Polygons",
    "Region",
    "RegionLike",
    "TurnedGlobe",
    "bounding_box",
    "cells_of",
    "check_on_body",
    "combine",
    "crs_name",
    "features_from_file",
    "folded",
    "full_name",
    "geojson_of",
    "get_region",
    "ground_of_maps",
    "height_of",
    "is_region_text",
    "latitude_of",
    "layer_path",
    "line_of",
    "main_part",
    "polygons_from_geojson",
    "polygons_of",
    "reaches",
    "region_for",
    "region_names",
    "region_of_text",
    "region_title",
    "share_in",
    "tell_of_geojson_in_degrees",
    "weighted_points",
    "with_gpx_heights",
]
