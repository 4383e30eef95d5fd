from .checking.errors import FAIL_ON, OUTSIDE, TORN, Check, Totals, check
from .families import FAMILIES
from .members import Rounded
from .optimization import Baseline, Optimum, optimize
from .recommendation.candidates import INTERRUPTED
from .recommendation.for_frames import estimate_crs
from .recommendation.purposes import PURPOSES, get_purpose
from .recommendation.search import Candidate, Recommendation, recommend
from .recommendation.standing import CLOSE, WIDE_FACTOR
from .recommendation.zones import ENGINEERING_PPM, ZoneSystem
from .surveying import (
    LDP,
    LDP_FAMILIES,
    HeightStatistics,
    distortion_ppm,
    elevation_factor,
    ldp,
    read_heights,
)

__all__ = [
    "CLOSE",
    "ENGINEERING_PPM",
    "FAIL_ON",
    "FAMILIES",
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
    "HeightStatistics",
    "Optimum",
    "Recommendation",
    "Rounded",
    "Totals",
    "ZoneSystem",
    "check",
    "distortion_ppm",
    "elevation_factor",
    "estimate_crs",
    "get_purpose",
    "ldp",
    "optimize",
    "read_heights",
    "recommend",
]
