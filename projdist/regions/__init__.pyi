from .boxes import GLOBE, Box, TurnedGlobe, bounding_box, height_of, latitude_of
from .caps import Cap, reaches
from .cells import cells_of
from .combinations import RegionEdges, combine, geojson_of, polygons_of
from .countries import folded, full_name, region_names
from .language import (
    HasGeometry,
    Place,
    RegionLike,
    check_on_body,
    get_region,
    ground_of_maps,
    is_region_text,
    layer_path,
    region_for,
    region_of_text,
    region_title,
    weighted_points,
)
from .lines import line_of
from .parts import main_part, share_in
from .points import PointSet
from .polygons import Polygons
from .region import ChartPoints, Clips, Region
from .vector_files import (
    crs_name,
    features_from_file,
    polygons_from_geojson,
    tell_of_geojson_in_degrees,
    with_gpx_heights,
)

__all__ = [
    "GLOBE",
    "Box",
    "Cap",
    "ChartPoints",
    "Clips",
    "HasGeometry",
    "Place",
    "PointSet",
    "Polygons",
    "Region",
    "RegionEdges",
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
