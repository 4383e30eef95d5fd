"""Maps made to measure: the least-distorting map of a region, of a kind and a degree, as a CRS that PROJ runs."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
