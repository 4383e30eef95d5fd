"""Many regions or maps as one job: on any executor, with results kept as they come, to go on from."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
