from . import natural_earth
from .ellipsoid import MEAN_EARTH_RADIUS, SPHERE, WGS84, Ellipsoid
from .natural_earth import RESOLUTIONS, Border, borders, coastlines, lakes, land
from .rings import (
    GEOS_ARITHMETIC,
    chords,
    closed_round_pole,
    cut_at_antimeridian,
    even_odd,
    goes_round,
    merged,
    planar,
    unwrapped,
)
from .sphere import chord_angle, destination, unit_vectors

__all__ = [
    "GEOS_ARITHMETIC",
    "MEAN_EARTH_RADIUS",
    "RESOLUTIONS",
    "SPHERE",
    "WGS84",
    "Border",
    "Ellipsoid",
    "borders",
    "chord_angle",
    "chords",
    "closed_round_pole",
    "coastlines",
    "cut_at_antimeridian",
    "destination",
    "even_odd",
    "goes_round",
    "lakes",
    "land",
    "merged",
    "natural_earth",
    "planar",
    "unit_vectors",
    "unwrapped",
]
