"""Pictures of distortion: Tissot's indicatrices, heat maps, fields of local corrections, ground distortion.

Each is drawn on given axes or as a whole figure. `region` is None (the area of use of a CRS, else
the globe) or whatever `projdist.get_region` takes.
"""

from projdist.plots.colours import ColourScale
from projdist.plots.figures import SUFFIXES, heatmap_figure, ldp_figure, local_figure, save, tissot_figure
from projdist.plots.ground import ground_map
from projdist.plots.local_fields import local_field
from projdist.plots.pictures import heatmap, tissot

__all__ = [
    "SUFFIXES",
    "ColourScale",
    "ground_map",
    "heatmap",
    "heatmap_figure",
    "ldp_figure",
    "local_field",
    "local_figure",
    "save",
    "tissot",
    "tissot_figure",
]
