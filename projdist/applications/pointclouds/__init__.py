"""Point clouds and landmarks in any dimension: affine registration, and the frame that distorts them least."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
