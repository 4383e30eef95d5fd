"""Distortion for GIS programs: rasters of measures, layers of indicatrices, tables of points, mosaics of map sheets.

The home of rasterio, geopandas, pyogrio and xarray, which come with `pip install 'projdist[gis]'` and are
imported where they are used. `region` is None (the area of use of a CRS, else the globe) or whatever
`projdist.get_region` takes. Coordinates of rasters and layers are in the CRS's own unit, in the order in which GIS
programs have them: easting first. Where pandas is imported already, frames have `frame.projdist`.
"""

import sys

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

if "pandas" in sys.modules:  # it is slow to load, and frames may not be wanted
    import projdist.gis.accessors  # noqa: F401  (registers `frame.projdist`)
