"""Pictures of distortion: Tissot's indicatrices, heat maps, local corrections, ground distortion, old maps, mosaics.

Each is drawn on given axes or as a whole figure; `region` is None (the area of use, else the globe) or a RegionLike.
"""

import lazy_loader

SUFFIXES = (".png", ".svg", ".pdf")
"""Suffixes of pictures; they stand here, as commands ask for them before they know whether they need matplotlib."""

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
