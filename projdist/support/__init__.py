"""What any program needs, and nothing of maps: answers, files, messages, checks of what people give."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
