"""Surveying: distances on the ground, and the maps on which they are nearly true."""

from projdist.decisions.surveying.design import LDP, LDP_FAMILIES, ldp
from projdist.decisions.surveying.ground import HeightStatistics, distortion_ppm, read_heights

__all__ = [
    "LDP",
    "LDP_FAMILIES",
    "HeightStatistics",
    "distortion_ppm",
    "ldp",
    "read_heights",
]
