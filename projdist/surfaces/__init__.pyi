from .boundaries import boundary_polygon
from .domain import Bounds, ground_size, is_part, longitude_width, normalised
from .fields import field, filled, jacobians, measured
from .jumps import ValuesAt, crosses, jumping
from .land import coast, coast_resolution, country_borders, lake_polygons, lake_shores, land_polygons, land_rings
from .lines import cut_at_tears, graticule, graticule_steps, graticule_values, project_lines
from .regional import shown_part, surface_of, surface_of_globe
from .surface import Surface
from .tissot_ellipses import (
    Indicatrices,
    close_pairs,
    ellipses,
    even_radius,
    fit,
    principal_axes,
    tissot_points,
    usual_exaggeration,
    usual_step,
    without_crowding,
)

__all__ = [
    "Bounds",
    "Indicatrices",
    "Surface",
    "ValuesAt",
    "boundary_polygon",
    "close_pairs",
    "coast",
    "coast_resolution",
    "country_borders",
    "crosses",
    "cut_at_tears",
    "ellipses",
    "even_radius",
    "field",
    "filled",
    "fit",
    "graticule",
    "graticule_steps",
    "graticule_values",
    "ground_size",
    "is_part",
    "jacobians",
    "jumping",
    "lake_polygons",
    "lake_shores",
    "land_polygons",
    "land_rings",
    "longitude_width",
    "measured",
    "normalised",
    "principal_axes",
    "project_lines",
    "shown_part",
    "surface_of",
    "surface_of_globe",
    "tissot_points",
    "usual_exaggeration",
    "usual_step",
    "without_crowding",
]
