from .basemap import CONTEXTS
from .colours import ColourScale
from .figures import (
    encoded,
    figure,
    heatmap,
    heatmap_figure,
    ldp_figure,
    local_figure,
    modes_figure,
    save,
    tissot,
    tissot_figure,
)
from .geoaxes import add_heatmap, add_tissot, to_cartopy
from .graphs import DISTRIBUTIONS, distribution_figure, profile_figure
from .images import OLD_MAP_MEASURES, OLD_MAP_PANELS, mosaic_figure, old_map_figure
from .map_drawing import ground_map, local_field
from .morphs import ANIMATION_SUFFIXES, morph
from .shape_space import space_figure
from .style import Look, Theme

SUFFIXES: tuple[str, ...]

__all__ = [
    "ANIMATION_SUFFIXES",
    "CONTEXTS",
    "DISTRIBUTIONS",
    "OLD_MAP_MEASURES",
    "OLD_MAP_PANELS",
    "SUFFIXES",
    "ColourScale",
    "Look",
    "Theme",
    "add_heatmap",
    "add_tissot",
    "distribution_figure",
    "encoded",
    "figure",
    "ground_map",
    "heatmap",
    "heatmap_figure",
    "ldp_figure",
    "local_field",
    "local_figure",
    "modes_figure",
    "morph",
    "mosaic_figure",
    "old_map_figure",
    "profile_figure",
    "save",
    "space_figure",
    "tissot",
    "tissot_figure",
    "to_cartopy",
]
