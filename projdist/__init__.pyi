# Maps and regions
from .projections import Projection, ProjectionError, ProjectionLike, find_crs, projection_names, worldmaps
from .earth import Ellipsoid, SPHERE, WGS84
from .regions import Box, Cap, GLOBE, PointSet, Region, RegionLike, get_region

# Jacobians, measures and figures
from .field import (
    FIGURES,
    Figure,
    get_figure,
    Field,
    derivatives,
    field_of,
    hessian,
    jacobian,
    sample,
)
from .matrices import MDT, MEASURES, Measure, axes_shift, get_measure, mdt, mean_rotation, modes, principal_scales, spd
from .numerics import CRITERIA, get_criterion

# What a map does
from .answers import (
    DISTANCE_MEASURES,
    INDICES,
    compare,
    correct,
    distance_distortion,
    elevation_factor,
    factors,
    goldberg_gott_score,
    great_circle_bending,
    indices,
    local_corrections,
    profile,
    summarize,
    tables,
)

# Which map to take
from .decisions import check, distortion_ppm, estimate_crs, info, ldp, optimize, read_heights, recommend

# Maps made to measure
from .designs import design, mean_map, mean_plane_map, world_map

# Atlas: the best maps of places
from .designs import atlas, atlas_names

# Batches of regions
from .answers import batch

# Mosaics, point clouds, old maps
from .applications import mosaics, oldmaps, pointclouds
from .applications.oldmaps import old_map, read_control_points

# Messages and notices
from .support import Estimate, Notice

# Pictures and files for GIS programs
from . import gis, plots

# Interactive maps in notebooks
from .web import Explorer

__version__: str

__all__ = [
    "CRITERIA",
    "DISTANCE_MEASURES",
    "FIGURES",
    "GLOBE",
    "INDICES",
    "MDT",
    "MEASURES",
    "SPHERE",
    "WGS84",
    "Box",
    "Cap",
    "Ellipsoid",
    "Estimate",
    "Explorer",
    "Field",
    "Figure",
    "Measure",
    "Notice",
    "PointSet",
    "Projection",
    "ProjectionError",
    "ProjectionLike",
    "Region",
    "RegionLike",
    "atlas",
    "atlas_names",
    "axes_shift",
    "batch",
    "check",
    "compare",
    "correct",
    "derivatives",
    "design",
    "distance_distortion",
    "distortion_ppm",
    "elevation_factor",
    "estimate_crs",
    "factors",
    "field_of",
    "find_crs",
    "get_criterion",
    "get_figure",
    "get_measure",
    "get_region",
    "gis",
    "goldberg_gott_score",
    "great_circle_bending",
    "hessian",
    "indices",
    "info",
    "jacobian",
    "ldp",
    "local_corrections",
    "mdt",
    "mean_map",
    "mean_plane_map",
    "mean_rotation",
    "modes",
    "mosaics",
    "old_map",
    "oldmaps",
    "optimize",
    "plots",
    "pointclouds",
    "principal_scales",
    "profile",
    "projection_names",
    "read_control_points",
    "read_heights",
    "recommend",
    "sample",
    "spd",
    "summarize",
    "tables",
    "world_map",
    "worldmaps",
]
