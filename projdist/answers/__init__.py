"""Figures of given maps, at points, along lines and over regions, and their corrections."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
