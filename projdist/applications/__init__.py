"""Applications of the mean beyond projections: mosaics of images, clouds of points, old maps."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
