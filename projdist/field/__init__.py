"""The waist: the Jacobian field of a map, at points and over regions."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
