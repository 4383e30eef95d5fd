"""Distortion for GIS programs: rasters of measures, layers of indicatrices, tables of points, mosaics of map sheets.

The home of rasterio, geopandas and pyogrio, which come with `pip install 'projdist[gis]'` and are
imported where they are used. `region` is None (the area of use of a CRS, else the globe) or
whatever `projdist.get_region` takes. Coordinates of rasters and layers are in the CRS's own unit,
in the order in which GIS programs have them: easting first.
"""

from projdist.gis.grids import GRIDS
from projdist.gis.layers import LAYER_SUFFIXES, indicatrices, save_layer
from projdist.gis.libraries import check_libraries
from projdist.gis.points import TABLE_SUFFIXES, frame_of, plain_table, read_data, read_points, save_points
from projdist.gis.rasters import RASTER_SUFFIXES, Raster, raster, save_raster
from projdist.gis.sheets import georeference_of, save_geotiff
from projdist.gis.weights import weighted

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
