from .arrays import factor_arrays, measure_arrays
from .atlas_files import ATLAS_SUFFIXES, atlas_frame, save_atlas
from .conversion import CONVERTED_SUFFIXES, RESAMPLINGS, Conversion, convert, convert_frame
from .layers import (
    LAYER_SUFFIXES,
    check_libraries,
    frame_of_geojson,
    frame_of_regions,
    indicatrices,
    old_map_layers,
    save_layer,
    save_layers,
)
from .points import TABLE_SUFFIXES, frame_of, plain_table, read_data, read_points, save_points
from .rasters import GRIDS, RASTER_SUFFIXES, Raster, raster, save_raster
from .sheets import georeference_of, save_geotiff, save_sheet
from .weights import weighted

__all__ = [
    "ATLAS_SUFFIXES",
    "CONVERTED_SUFFIXES",
    "GRIDS",
    "LAYER_SUFFIXES",
    "RASTER_SUFFIXES",
    "RESAMPLINGS",
    "TABLE_SUFFIXES",
    "Conversion",
    "Raster",
    "atlas_frame",
    "check_libraries",
    "convert",
    "convert_frame",
    "factor_arrays",
    "frame_of",
    "frame_of_geojson",
    "frame_of_regions",
    "georeference_of",
    "indicatrices",
    "measure_arrays",
    "old_map_layers",
    "plain_table",
    "raster",
    "read_data",
    "read_points",
    "save_atlas",
    "save_geotiff",
    "save_layer",
    "save_layers",
    "save_points",
    "save_raster",
    "save_sheet",
    "weighted",
]
