"""Which map to take: the best parameters, the best existing CRS, and what a CRS does to people's data."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
