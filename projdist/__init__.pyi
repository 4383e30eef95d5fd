# A map, a region
from .projections import Projection, ProjectionError, ProjectionLike, projection_names, worldmaps
from .earth import Ellipsoid, SPHERE, WGS84
from .regions import Box, Cap, GLOBE, PointSet, Region, RegionLike, get_region

# Its Jacobian, and what is measured of it
from .field import (
    FIGURES,
    Figure,
    get_figure,
    AiryKavrayskiy,
    Derivatives,
    Extreme,
    Field,
    Quality,
    derivatives,
    field_of,
    hessian,
    jacobian,
    jacobian_grid,
    sample,
)
from .matrices import (
    MDT,
    MEASURES,
    Measure,
    Rotation,
    axes_shift,
    get_measure,
    mdt,
    mean_rotation,
    principal_scales,
    spd,
)
from .numerics import CRITERIA, Estimate, get_criterion

# What a map does
from .answers import (
    Comparison,
    Correction,
    DISTANCE_MEASURES,
    Factors,
    Failure,
    FiniteDistortion,
    INDICES,
    IndexSummary,
    IndexValue,
    LocalCorrections,
    MeasureSummary,
    Profile,
    PublishedRow,
    PublishedTable,
    Summary,
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
from .decisions import (
    Baseline,
    Candidate,
    Check,
    HeightStatistics,
    LDP,
    Optimum,
    Recommendation,
    Rounded,
    Totals,
    check,
    distortion_ppm,
    estimate_crs,
    ldp,
    optimize,
    read_heights,
    recommend,
)

# Maps made to measure
from .designs import Design, MeanMap, PlaneMean, WorldMap, design, mean_map, mean_plane_map, world_map

# Many regions at once
from .batches import Batch, BatchFailure, BatchResult, batch

# The same mean elsewhere
from .applications import mosaics, oldmaps, pointclouds
from .applications.oldmaps import ControlPoints, OldMap, old_map, read_control_points

# What is told
from .support import Notice

# Pictures, and files of GIS programs
from . import gis, plots

# Maps that turn under the hand, in notebooks
from .web import Explorer

__version__: str

__all__ = [
    "CRITERIA",
    "DISTANCE_MEASURES",
    "FIGURES",
    "GLOBE",
    "INDICES",
    "LDP",
    "MDT",
    "MEASURES",
    "SPHERE",
    "WGS84",
    "AiryKavrayskiy",
    "Baseline",
    "Batch",
    "BatchFailure",
    "BatchResult",
    "Box",
    "Candidate",
    "Cap",
    "Check",
    "Comparison",
    "ControlPoints",
    "Correction",
    "Derivatives",
    "Design",
    "Ellipsoid",
    "Estimate",
    "Explorer",
    "Extreme",
    "Factors",
    "Failure",
    "Field",
    "Figure",
    "FiniteDistortion",
    "HeightStatistics",
    "IndexSummary",
    "IndexValue",
    "LocalCorrections",
    "MeanMap",
    "Measure",
    "MeasureSummary",
    "Notice",
    "OldMap",
    "Optimum",
    "PlaneMean",
    "PointSet",
    "Profile",
    "Projection",
    "ProjectionError",
    "ProjectionLike",
    "PublishedRow",
    "PublishedTable",
    "Quality",
    "Recommendation",
    "Region",
    "RegionLike",
    "Rotation",
    "Rounded",
    "Summary",
    "Totals",
    "WorldMap",
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
    "get_criterion",
    "get_figure",
    "get_measure",
    "get_region",
    "gis",
    "goldberg_gott_score",
    "great_circle_bending",
    "hessian",
    "indices",
    "jacobian",
    "jacobian_grid",
    "ldp",
    "local_corrections",
    "mdt",
    "mean_map",
    "mean_plane_map",
    "mean_rotation",
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
