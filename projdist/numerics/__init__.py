"""Numbers with weights, quadrature rules, and searches: nothing of matrices or the Earth."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
