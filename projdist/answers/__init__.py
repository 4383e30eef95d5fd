"""What a given map does: its factors, its figures over a region, and what corrects it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
