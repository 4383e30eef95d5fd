from .checking.errors import FAIL_ON, OUTSIDE, TORN, Check, Totals, check
from .extents import Extent, extent_of
from .families import FAMILIES, ellipsoid_text, sensible_families
from .limits import LIMITED, least_error
from .map_info import INFO_MEASURES, MapInfo, info
from .members import Rounded
from .objectives import Objective
from .optimization import Baseline, Optimum, best_member, optimize
from .recommendation.candidates import INTERRUPTED
from .recommendation.custom import Custom
from .recommendation.for_frames import estimate_crs
from .recommendation.purposes import PURPOSES, get_purpose, suits
from .recommendation.search import Candidate, Recommendation, recommend
from .recommendation.standing import CLOSE, WIDE_FACTOR
from .recommendation.zones import ENGINEERING_PPM, ZoneSystem
from .surveying import (
    LDP,
    LDP_FAMILIES,
    HeightStatistics,
    distortion_ppm,
    ldp,
    read_heights,
)

__all__ = [
    "CLOSE",
    "ENGINEERING_PPM",
    "FAIL_ON",
    "FAMILIES",
    "INFO_MEASURES",
    "INTERRUPTED",
    "LDP",
    "LDP_FAMILIES",
    "LIMITED",
    "OUTSIDE",
    "PURPOSES",
    "TORN",
    "WIDE_FACTOR",
    "Baseline",
    "Candidate",
    "Check",
    "Custom",
    "Extent",
    "HeightStatistics",
    "MapInfo",
    "Objective",
    "Optimum",
    "Recommendation",
    "Rounded",
    "Totals",
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
