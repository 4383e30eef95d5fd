"""Labels of isolines, where there is room for them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.contour import ContourSet
from matplotlib.patheffects import withStroke

from projdist._typing import FloatArray
from projdist.plots.looks import look_of, scale_of

_SIZE = 6.5  # points
_WIDTH = 0.65  # of a character, in its height
_SHORTEST = 4.0  # of the label's width; shorter isolines have none
_SHARES = (0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.1, 0.9)


def label_isolines(ax: Axes, lines: ContourSet, labels: Mapping[float, str], outline: FloatArray) -> None:
    """Label isolines at places that are clear of each other and of the outline, (n, 2, 2) short segments in metres.

    matplotlib's own choice minds neither: on lobes and at limbs its labels cover each other.
    """
    ax.apply_aspect()
    edge = ax.transData.transform(outline.reshape(-1, 2))
    size = _SIZE * scale_of(ax)
    height = size / 72.0 * ax.figure.dpi
    places = np.empty((0, 2))
    reaches = np.empty(0)
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        # Half the width of the label, whichever way the line turns it, and a little air.
        reach = 0.5 * height * (_WIDTH * len(labels[level]) + 0.4)
        for piece in path.to_polygons(closed_only=False):
            points = ax.transData.transform(piece)
            along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
            if along[-1] < 2.0 * _SHORTEST * reach:
                continue
            for share in _SHARES:
                place = np.array([np.interp(share * along[-1], along, column) for column in points.T])
                clear = (np.hypot(*(places - place).T) > reaches + reach).all()
                if clear and (np.hypot(*(edge - place).T) > reach).all():
                    places, reaches = np.vstack([places, place]), np.append(reaches, reach)
                    break
    if not reaches.size:
        return
    manual = ax.transData.inverted().transform(places).tolist()
    for text in ax.clabel(lines, fontsize=size, fmt=dict(labels), inline_spacing=2, manual=manual):
        text.set_path_effects([withStroke(linewidth=1.5, foreground=look_of(ax).colours.halo)])
