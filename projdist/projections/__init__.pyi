from . import worldmaps
from .arguments import number_text
from .bodies import Body, is_same_body
from .breaks import breaks_of
from .catalogue import NAMES, WINKEL_PARALLEL
from .cf_conventions import cf_attributes
from .composed import compose, uncomposed
from .crs_search import CrsHit, CrsSearch, find_crs
from .database import (
    AUTHORITIES,
    CRS,
    OF_A_SPHERE,
    Conversion,
    CrsRecord,
    DatabaseCrs,
    check_authorities,
    crs_records,
    load_crs,
    reasons_against,
    to_pyproj,
)
from .definitions import crs_wkt, geodetic_ellipsoid, geodetic_of, unprojected
from .derived import AreaOfUse, DerivedCrs, derived_crs
from .errors import GridError, ProjectionError
from .exports import parameters_of, pipeline_of, wkt_of
from .fileless import close_parameters, environment_without_files, file_named_in
from .geodesy import (
    area_of_use,
    crs_of,
    geodesic_arrivals,
    geodesic_courses,
    geodesic_destination,
    geodesic_lengths,
    geodesic_points,
    geodesics,
    ground_of,
    to_lonlat,
)
from .inputs import listed_projections
from .knobs import Parameter
from .names import needed_parameters, projection_names
from .natures import Nature, nature_of
from .own_poles import OwnPole, own_pole_of
from .parameters import defined_by, with_parameters
from .particulars import Axis, Particulars, Setting, particulars_of
from .planes import Graticule, Plane, Source, geographic, graticule_of, plane_of, same_map, source_of
from .point_tables import (
    MISSING,
    TEXT_SUFFIXES,
    Frame,
    PointTable,
    add_columns,
    check_degrees,
    check_new_names,
    coordinate_columns,
    is_frame,
    is_geographic,
    places,
    read_point_table,
    tell_of_degrees,
    tell_of_frame_in_degrees,
    tell_of_missing,
)
from .projection import Projection, ProjectionLike
from .registry import UNKNOWN, Facts, facts_of, proj_version
from .same_conversions import codes_of_same_map
from .shifts import DatumShift, datum_shift, keeps_datum, kept_datum
from .tuning import Tunable, tunable, tuned
from .worldmaps import WORLD_MAPS, distance_around_edge

__all__ = [
    "AUTHORITIES",
    "CRS",
    "MISSING",
    "NAMES",
    "OF_A_SPHERE",
    "TEXT_SUFFIXES",
    "UNKNOWN",
    "WINKEL_PARALLEL",
    "WORLD_MAPS",
    "AreaOfUse",
    "Axis",
    "Body",
    "Conversion",
    "CrsHit",
    "CrsRecord",
    "CrsSearch",
    "DatabaseCrs",
    "DatumShift",
    "DerivedCrs",
    "Facts",
    "Frame",
    "Graticule",
    "GridError",
    "Nature",
    "OwnPole",
    "Parameter",
    "Particulars",
    "Plane",
    "PointTable",
    "Projection",
    "ProjectionError",
    "ProjectionLike",
    "Setting",
    "Source",
    "Tunable",
    "add_columns",
    "area_of_use",
    "breaks_of",
    "cf_attributes",
    "check_authorities",
    "check_degrees",
    "check_new_names",
    "close_parameters",
    "codes_of_same_map",
    "compose",
    "coordinate_columns",
    "crs_of",
    "crs_records",
    "crs_wkt",
    "datum_shift",
    "defined_by",
    "derived_crs",
    "distance_around_edge",
    "environment_without_files",
    "facts_of",
    "file_named_in",
    "find_crs",
    "geodesic_arrivals",
    "geodesic_courses",
    "geodesic_destination",
    "geodesic_lengths",
    "geodesic_points",
    "geodesics",
    "geodetic_ellipsoid",
    "geodetic_of",
    "geographic",
    "graticule_of",
    "ground_of",
    "is_frame",
    "is_geographic",
    "is_same_body",
    "keeps_datum",
    "kept_datum",
    "listed_projections",
    "load_crs",
    "nature_of",
    "needed_parameters",
    "number_text",
    "own_pole_of",
    "parameters_of",
    "particulars_of",
    "pipeline_of",
    "places",
    "plane_of",
    "proj_version",
    "projection_names",
    "read_point_table",
    "reasons_against",
    "same_map",
    "source_of",
    "tell_of_degrees",
    "tell_of_frame_in_degrees",
    "tell_of_missing",
    "to_lonlat",
    "to_pyproj",
    "tunable",
    "tuned",
    "uncomposed",
    "unprojected",
    "with_parameters",
    "wkt_of",
    "worldmaps",
]
