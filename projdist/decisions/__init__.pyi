from .candidate_crs import Candidate
from .data_checks import FAIL_ON, OUTSIDE, TORN, Check, Totals, check, estimate_crs
from .families import FAMILIES, Extent, ellipsoid_text, extent_of, sensible_families
from .family_search import Objective, Rounded
from .ground import HeightStatistics, distortion_ppm, read_heights
from .low_distortion import LDP, LDP_FAMILIES, ldp
from .map_info import INFO_MEASURES, MapInfo, info
from .measurement import INTERRUPTED, Distortion
from .optimization import Baseline, Optimum, best_member, least_error, optimize
from .ranking import CLOSE, PURPOSES, WIDE_FACTOR, get_purpose, suits
from .recommendation import Custom, Recommendation, recommend
from .zones import ENGINEERING_PPM, Zone, ZoneSystem

__all__ = [
    "CLOSE",
    "ENGINEERING_PPM",
    "FAIL_ON",
    "FAMILIES",
    "INFO_MEASURES",
    "INTERRUPTED",
    "LDP",
    "LDP_FAMILIES",
    "OUTSIDE",
    "PURPOSES",
    "TORN",
    "WIDE_FACTOR",
    "Baseline",
    "Candidate",
    "Check",
    "Custom",
    "Distortion",
    "Extent",
    "HeightStatistics",
    "MapInfo",
    "Objective",
    "Optimum",
    "Recommendation",
    "Rounded",
    "Totals",
    "Zone",
    "ZoneSystem",
    "best_member",
    "check",
    "distortion_ppm",
    "ellipsoid_text",
    "estimate_crs",
    "extent_of",
    "get_purpose",
    "info",
    "ldp",
    "least_error",
    "optimize",
    "read_heights",
    "recommend",
    "sensible_families",
    "suits",
]
