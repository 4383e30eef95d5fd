"""Pictures of distortion: Tissot's indicatrices and heat maps, on given axes or as whole figures.

`region` is None (the area of use of a CRS, else the globe) or any object with `bounds` (W, S, E, N
in degrees) and `contains(lon, lat)`, such as those of `projdist.regions`.
"""

from projdist.plots.domain import Region
from projdist.plots.fields import ColourScale
from projdist.plots.figures import SUFFIXES, heatmap_figure, save, tissot_figure
from projdist.plots.pictures import heatmap, tissot

__all__ = [
    "SUFFIXES",
    "ColourScale",
    "Region",
    "heatmap",
    "heatmap_figure",
    "save",
    "tissot",
    "tissot_figure",
]
