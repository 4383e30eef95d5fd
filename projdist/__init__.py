"""projdist: measure, compare and draw the distortion of any map projection.

Conventions, stated once. Longitudes and latitudes are degrees from Greenwich, x and y metres.
A Jacobian J is metre per metre in the local frame of the ellipsoid: rows x, y; columns east,
north; matrices stand on the trailing axes. Scales are ratios (1 is true), angles degrees.
Undefined is NaN, with a quality flag. The Fisher distortion is sqrt(ln^2 a + ln^2 b); the
Airy-Kavrayskiy error of a region is its RMS by true area. `projdist.plots` draws.
"""

from projdist.ellipsoid import SPHERE, WGS84, Ellipsoid
from projdist import worldmaps
from projdist.projections import Projection, ProjectionError, projection_names
from projdist.derivatives import Derivatives, Quality, derivatives, jacobian
from projdist.hessians import hessian
from projdist.rasters import jacobian_grid
from projdist.measures import MEASURES, Measure, get_measure, principal_scales
from projdist.regions import GLOBE, Box, Cap, PointSet, Region, get_region
from projdist.cubature import Samples, sample
from projdist.criteria import CRITERIA, get_criterion
from projdist import spd
from projdist.mdt import MDT, mdt
from projdist.rigid import Rotation, axes_shift, mean_rotation
from projdist.distances import DISTANCE_MEASURES, FiniteDistortion, distance_distortion, great_circle_bending
from projdist.results import Comparison, Factors, Failure, MeasureSummary, Summary, compare, factors, summarize
from projdist.indices import INDICES, IndexSummary, IndexValue, goldberg_gott_score, indices
from projdist.published import PublishedRow, PublishedTable, tables
from projdist.correction import Correction, correct
from projdist.local_corrections import LocalCorrections, local_corrections
from projdist.objectives import OBJECTIVES, Objective, get_objective
from projdist.members import Rounded
from projdist.optimize import Baseline, Optimum, optimize
from projdist.surveying import LDP, HeightStatistics, distortion_ppm, elevation_factor, ldp, read_heights
from projdist.oldmaps import ControlPoints, OldMap, old_map, read_control_points
from projdist.recommend import Candidate, Recommendation, recommend
from projdist.geoframes import estimate_crs
from projdist.check import Check, Totals, check

__version__ = "0.1.0"

__all__ = [
    "CRITERIA",
    "DISTANCE_MEASURES",
    "GLOBE",
    "INDICES",
    "LDP",
    "MDT",
    "MEASURES",
    "OBJECTIVES",
    "SPHERE",
    "WGS84",
    "Baseline",
    "Box",
    "Candidate",
    "Cap",
    "Check",
    "Comparison",
    "ControlPoints",
    "Correction",
    "Derivatives",
    "Ellipsoid",
    "Factors",
    "Failure",
    "FiniteDistortion",
    "HeightStatistics",
    "IndexSummary",
    "IndexValue",
    "LocalCorrections",
    "Measure",
    "MeasureSummary",
    "Objective",
    "OldMap",
    "Optimum",
    "PointSet",
    "Projection",
    "ProjectionError",
    "PublishedRow",
    "PublishedTable",
    "Quality",
    "Recommendation",
    "Region",
    "Rotation",
    "Rounded",
    "Samples",
    "Summary",
    "Totals",
    "axes_shift",
    "check",
    "compare",
    "correct",
    "derivatives",
    "distance_distortion",
    "distortion_ppm",
    "elevation_factor",
    "estimate_crs",
    "factors",
    "get_criterion",
    "get_measure",
    "get_objective",
    "get_region",
    "goldberg_gott_score",
    "great_circle_bending",
    "hessian",
    "indices",
    "jacobian",
    "jacobian_grid",
    "ldp",
    "local_corrections",
    "mdt",
    "mean_rotation",
    "old_map",
    "optimize",
    "principal_scales",
    "projection_names",
    "read_control_points",
    "read_heights",
    "recommend",
    "sample",
    "spd",
    "summarize",
    "tables",
    "worldmaps",
]
