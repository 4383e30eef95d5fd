"""Reports as web pages: one file each, with maps that answer, and nothing that comes from elsewhere.

The text of a page is complete without scripts. Its maps are frames: the Jacobian at the nodes of a grid, from
which the page computes every measure.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
