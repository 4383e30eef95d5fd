"""Pictures of distortion: Tissot's indicatrices, heat maps, fields of local corrections, ground distortion, old maps,
mosaics.

Each is drawn on given axes or as a whole figure. `region` is None (the area of use of a CRS, else
the globe) or whatever `projdist.get_region` takes.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
