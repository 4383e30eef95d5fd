"""Map projections as one frozen value type, from any input; the home of pyproj.

A PROJ string is run as the pipeline it is, a CRS as the operation from its own geodetic CRS.
Neither goes through the other's form, which would lose defaults (`+proj=wintri`), methods
(EPSG:3857) and ellipsoids.
"""

from projdist.projections.composed import compose, uncomposed
from projdist.projections.definitions import crs_wkt, geodetic_ellipsoid, unprojected
from projdist.projections.errors import ProjectionError
from projdist.projections.exports import parameters_of, pipeline_of, wkt_of
from projdist.projections.names import needed_parameters, projection_names
from projdist.projections.parameters import defined_by, number_text, with_parameters
from projdist.projections.planes import (
    Graticule,
    Plane,
    Source,
    geographic,
    graticule_of,
    plane_of,
    same_map,
    source_of,
)
from projdist.projections.projection import Projection

__all__ = [
    "Graticule",
    "Plane",
    "Projection",
    "ProjectionError",
    "Source",
    "compose",
    "crs_wkt",
    "defined_by",
    "geodetic_ellipsoid",
    "geographic",
    "graticule_of",
    "needed_parameters",
    "number_text",
    "parameters_of",
    "pipeline_of",
    "plane_of",
    "projection_names",
    "same_map",
    "source_of",
    "uncomposed",
    "unprojected",
    "with_parameters",
    "wkt_of",
]
