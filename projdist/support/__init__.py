"""Support that any program needs, not about maps: answers, files, messages, checks of input."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
