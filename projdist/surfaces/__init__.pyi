from .domain import ground_size, normalised
from .fields import field, measured
from .jumps import ValuesAt, jumping
from .land import coast, land_polygons
from .lines import graticule, graticule_steps, project_lines
from .surface import Surface, surface_of
from .tissot_ellipses import (
    Indicatrices,
    close_pairs,
    ellipses,
    even_radius,
    fit,
    tissot_points,
    usual_step,
    without_crowding,
)

__all__ = [
    "Indicatrices",
    "Surface",
    "ValuesAt",
    "close_pairs",
    "coast",
    "ellipses",
    "even_radius",
    "field",
    "fit",
    "graticule",
    "graticule_steps",
    "ground_size",
    "jumping",
    "land_polygons",
    "measured",
    "normalised",
    "project_lines",
    "surface_of",
    "tissot_points",
    "usual_step",
    "without_crowding",
]
