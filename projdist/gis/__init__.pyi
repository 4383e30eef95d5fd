from .grids import GRIDS
from .layers import LAYER_SUFFIXES, indicatrices, save_layer
from .libraries import check_libraries
from .points import TABLE_SUFFIXES, frame_of, plain_table, read_data, read_points, save_points
from .rasters import RASTER_SUFFIXES, Raster, raster, save_raster
from .sheets import georeference_of, save_geotiff
from .weights import weighted

__all__ = [
    "GRIDS",
    "LAYER_SUFFIXES",
    "RASTER_SUFFIXES",
    "TABLE_SUFFIXES",
    "Raster",
    "check_libraries",
    "frame_of",
    "georeference_of",
    "indicatrices",
    "plain_table",
    "raster",
    "read_data",
    "read_points",
    "save_geotiff",
    "save_layer",
    "save_points",
    "save_raster",
    "weighted",
]
