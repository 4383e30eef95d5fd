"""Figures of a mosaic in several frames, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from projdist._typing import FloatArray
from projdist.applications.mosaics import Canvas, Mosaic, Picture, Rendered, corners, places, render
from projdist.plots.basemap import draw_title, fit_titles
from projdist.plots.layouts import arranged
from projdist.plots.style import Look, look_for, look_of, scale_of
from projdist.support import check_instance

_FOOT = 0.2  # inches
_PIXELS = 8e5  # of a panel
_FLAT = (12.0, 1.0)  # the shape of an empty one
_FACE, _EDGE, _RIM = "#4a7ba630", "#1f3b57", "#c2402899"
_NUMBERS = 60  # images that have room for them
_FIGURES = {"affine": "Sum of Dist_F² = {:.4g}", "homography": "Mean of Dist_F² = {:.4g}"}
_TITLES = {"first": "First", "last": "Last", "central": "Central", "best": "Best image's plane", "mdt": "MDT"}


def mosaic_figure(
    found: Mosaic,
    pictures: Sequence[Picture] | None = None,
    *,
    frames: Sequence[str] = ("first", "last", "central", "best", "mdt"),
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    look: Look | str | None = None,
) -> Figure:
    """A mosaic in several frames, each with its distortion, as large as possible.

    With `pictures` it is drawn, with the images' rims; without them only these are. A frame in which an image reaches
    infinity has only a title. A `look`, or the name of a theme, says how it looks; its title is a heading. Raises
    ValueError, and ImportError where pictures are to be drawn without OpenCV.
    """
    check_instance("mosaic", found, Mosaic, "a Mosaic")
    if not frames or any(name not in found.frames for name in frames):
        raise ValueError(f"Invalid frames '{', '.join(frames)}'. They must be of {', '.join(found.frames)}.")
    panels = [_drawn(found, name, pictures) for name in frames]
    sides = [_FLAT if panel is None else (_canvas(panel).width, _canvas(panel).height) for panel in panels]
    shapes = np.array(sides, dtype=float)
    words = [_words(found, name) for name in frames]
    look, shapes = look_for(look), shapes / shapes.max(axis=1, keepdims=True)
    if len(words) == 1 and look.title:
        words = [(look.title, words[0][1])]
    with look.applied():
        figure, axes, room = arranged(shapes, size, dpi, foot=_FOOT, words=words, look=look)
        for ax, panel, (title, below) in zip(axes, panels, words, strict=True):
            ax.set_axis_off()
            if panel is not None:
                _draw(ax, found, panel)
            draw_title(ax, title, below)
        fit_titles(axes, room)
    return figure


def _drawn(found: Mosaic, name: str, pictures: Sequence[Picture] | None) -> Rendered | Canvas | None:
    """Rendered mosaic of a panel, or its canvas alone; None for an impossible frame."""
    frame = found.frames[name]
    if frame is None:
        return None
    there = replace(found, frame=frame, frame_name=name)
    return there.canvas(most_pixels=_PIXELS) if pictures is None else render(there, pictures, most_pixels=_PIXELS)


def _canvas(panel: Rendered | Canvas) -> Canvas:
    canvas = panel.canvas if isinstance(panel, Rendered) else panel
    assert isinstance(canvas, Canvas), "what is drawn of a mosaic is in a plane"
    return canvas


def _draw(ax: Axes, found: Mosaic, panel: Rendered | Canvas) -> None:
    canvas = _canvas(panel)
    rims = places(canvas.matrices, corners(found.registration.sizes))
    ax.set_xlim(0.0, canvas.width)
    ax.set_ylim(canvas.height, 0.0)
    if isinstance(panel, Rendered):
        ax.imshow(panel.pixels, extent=(0.0, canvas.width, canvas.height, 0.0), aspect="auto", zorder=0.5)
        closed = np.concatenate([rims, rims[:, :1]], axis=1)
        ax.add_collection(LineCollection(list(closed), colors=_RIM, linewidths=0.5, zorder=1.0), autolim=False)
    else:
        ax.add_collection(
            PolyCollection(list(rims), facecolors=_FACE, edgecolors=_edge(ax), linewidths=0.6, zorder=1.0),
            autolim=False,
        )
        _draw_numbers(ax, found, rims)


def _draw_numbers(ax: Axes, found: Mosaic, rims: FloatArray) -> None:
    if len(rims) <= _NUMBERS:
        for image, (x, y) in zip(found.images, rims.mean(axis=1), strict=True):
            ax.text(x, y, str(image), ha="center", va="center", fontsize=scale_of(ax) * 7, color=_edge(ax))


def _edge(ax: Axes) -> str:
    """Colour of outlines: blue, or in a theme that of the text."""
    look = look_of(ax)
    return _EDGE if look.theme is None else look.colours.text


def _words(found: Mosaic, name: str) -> tuple[str, str]:
    """Title (the frame and its image) and subtitle (its distortion)."""
    frame = found.frames[name]
    if frame is None:
        return _TITLES[name], "Impossible: the plane sends an image to infinity"
    title = _TITLES[name] if frame.reference is None else f"{_TITLES[name]} ({found.points.name(frame.reference)})"
    return title, _FIGURES[found.registration.model].format(frame.figure)
