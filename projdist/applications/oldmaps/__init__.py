"""Old maps: control points and their true places, the field of distortion, and affine rectifications."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
