"""Map projections as one frozen value type, from any input; the home of pyproj.

A PROJ string is run as the pipeline it is, a CRS as the operation from its own geodetic CRS. Neither goes through the
other's form, which would lose defaults (`+proj=wintri`), methods (EPSG:3857) and ellipsoids.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
