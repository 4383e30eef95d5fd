"""A map as a surface of cells, lines and outlines, which plots and GIS layers are made of."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
