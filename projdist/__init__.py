"""projdist: measure, compare and draw the distortion of any map projection.

Conventions, stated once. Longitudes and latitudes are degrees from Greenwich, x and y metres.
A Jacobian J is metre per metre in the local frame of the ellipsoid: rows x, y; columns east,
north; matrices stand on the trailing axes. Scales are ratios (1 is true), angles degrees.
Undefined is NaN, with a quality flag. The Fisher distortion is sqrt(ln^2 a + ln^2 b); the
Airy-Kavrayskiy error of a region is its RMS by true area. `projdist.plots` draws, and
`projdist.gis` makes rasters and layers.
"""

import projdist.support.signals  # noqa: F401  (first: the command may be ended while the rest is loaded)
import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
