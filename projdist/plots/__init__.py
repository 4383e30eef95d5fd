"""Pictures of distortion: Tissot's indicatrices, heat maps, fields of local corrections, ground distortion, old maps,
mosaics.

Each is drawn on given axes or as a whole figure. `region` is None (the area of use of a CRS, else
the globe) or whatever `projdist.get_region` takes.
"""

from projdist.plots.colours import ColourScale
from projdist.plots.figures import SUFFIXES, heatmap_figure, ldp_figure, local_figure, save, tissot_figure
from projdist.plots.ground import ground_map
from projdist.plots.local_fields import local_field
from projdist.plots.mosaics import mosaic_figure
from projdist.plots.oldmaps import OLD_MAP_MEASURES, OLD_MAP_PANELS, old_map_figure
from projdist.plots.pictures import heatmap, tissot

__all__ = [
    "OLD_MAP_MEASURES",
    "OLD_MAP_PANELS",
    "SUFFIXES",
    "ColourScale",
    "ground_map",
    "heatmap",
    "heatmap_figure",
    "ldp_figure",
    "local_field",
    "local_figure",
    "mosaic_figure",
    "old_map_figure",
    "save",
    "tissot",
    "tissot_figure",
]
