"""Reports as web pages, each one self-contained file with interactive maps; and the live page.

The text of a page is complete without scripts. Its maps are frames: Jacobians at the nodes of a grid.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
