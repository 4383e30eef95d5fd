"""Pictures of distortion: Tissot's indicatrices and heat maps, on given axes or as whole figures.

`region` is None (the area of use of a CRS, else the globe) or whatever `projdist.get_region` takes.
"""

from projdist.plots.colours import ColourScale
from projdist.plots.figures import SUFFIXES, heatmap_figure, save, tissot_figure
from projdist.plots.pictures import heatmap, tissot

__all__ = [
    "SUFFIXES",
    "ColourScale",
    "heatmap",
    "heatmap_figure",
    "save",
    "tissot",
    "tissot_figure",
]
