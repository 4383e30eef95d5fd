from . import natural_earth
from .breaks import SMOOTH, Breaks
from .degree_texts import latitude_text, longitude_text
from .ellipsoid import MEAN_EARTH_RADIUS, SPHERE, WGS84, Ellipsoid
from .natural_earth import RESOLUTIONS, Border, borders, coastlines, lakes, lakes_within, land, land_within, shores
from .places import Cities, cities
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
from .states import state_keys, state_outline

__all__ = [
    "GEOS_ARITHMETIC",
    "MEAN_EARTH_RADIUS",
    "RESOLUTIONS",
    "SMOOTH",
    "SPHERE",
    "WGS84",
    "Border",
    "Breaks",
    "Cities",
    "Ellipsoid",
    "borders",
    "chord_angle",
    "chords",
    "cities",
    "closed_round_pole",
    "coastlines",
    "cut_at_antimeridian",
    "destination",
    "even_odd",
    "goes_round",
    "lakes",
    "lakes_within",
    "land",
    "land_within",
    "latitude_text",
    "longitude_text",
    "merged",
    "natural_earth",
    "planar",
    "shores",
    "state_keys",
    "state_outline",
    "unit_vectors",
    "unwrapped",
]
