"""Scans of old maps: where the control points have them."""

from __future__ import annotations

import numpy as np

from projdist.applications.oldmaps.field import OldMap

__all__ = ["scan_extent"]

_BEYOND = 0.05  # of a side: points as far outside are still on a scan that was cut


def scan_extent(found: OldMap, width: int, height: int, invalid: str) -> tuple[float, float, float, float]:
    """The old map's coordinates of the left, right, bottom and top side of a scan in whose pixels its points are.

    Rows are counted downwards, or, where that is not so, upwards, or downwards by negative numbers as QGIS does. Raises
    ValueError, which begins as told, where points are outside.
    """
    old = found.points.old
    if found.is_mirrored:
        extent = 0.0, float(width), float(height), 0.0
    elif old[:, 1].mean() < 0:
        extent = 0.0, float(width), -float(height), 0.0
    else:
        extent = 0.0, float(width), 0.0, float(height)
    share = (old - [extent[0], min(extent[2:])]) / [width, height]
    outside = np.asarray((np.abs(share - 0.5) > 0.5 + _BEYOND).any(axis=1))
    if outside.any():
        name = found.points.names[int(np.argmax(outside))]
        raise ValueError(
            f"{invalid} It has {width} by {height} pixels, and {int(outside.sum())} of {len(outside)} control points "
            f"lie outside, as '{name}'."
        )
    return extent
