"""Surveying: distances on the ground, and the maps on which they are nearly true."""

from projdist.surveying.criteria import LDP_CRITERIA
from projdist.surveying.design import LDP, LDP_FAMILIES, ldp
from projdist.surveying.ground import HeightStatistics, distortion_ppm, elevation_factor
from projdist.surveying.heights import read_heights

__all__ = [
    "LDP",
    "LDP_CRITERIA",
    "LDP_FAMILIES",
    "HeightStatistics",
    "distortion_ppm",
    "elevation_factor",
    "ldp",
    "read_heights",
]
