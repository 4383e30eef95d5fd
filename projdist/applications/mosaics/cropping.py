"""The largest box within what a mosaic covers."""

from __future__ import annotations

import numpy as np

from projdist._typing import BoolArray, IntArray

__all__ = ["covered_box"]

_CELLS = 400  # a side: the box is found on them, then grown by pixels


def covered_box(covered: BoolArray) -> tuple[int, int, int, int]:
    """Left, top, right and bottom of a box (the last two are outside) all of whose pixels are covered.

    The largest on a grid of 400 cells a side, grown as far as it goes. Raises ValueError where no cell is covered.
    """
    height, width = covered.shape
    step = max(1, -(-max(height, width) // _CELLS))
    rows, columns = height // step, width // step
    cells = np.asarray(covered[: rows * step, : columns * step].reshape(rows, step, columns, step).all(axis=(1, 3)))
    left, top, right, bottom = (step * side for side in _largest(cells))
    if left == right:
        raise ValueError("Invalid crop. No box is covered by images.")
    while left > 0 and covered[top:bottom, left - 1].all():
        left -= 1
    while right < width and covered[top:bottom, right].all():
        right += 1
    while top > 0 and covered[top - 1, left:right].all():
        top -= 1
    while bottom < height and covered[bottom, left:right].all():
        bottom += 1
    return left, top, right, bottom


def _largest(cells: BoolArray) -> tuple[int, int, int, int]:
    """The largest box of covered cells. Those covered above a row are bars, and some box under bars is the largest."""
    heights = np.zeros(cells.shape[1], int)
    best, found = 0, (0, 0, 0, 0)
    for row, line in enumerate(cells):
        heights = np.where(line, heights + 1, 0)
        area, left, right, height = _largest_in_bars(heights)
        if area > best:
            best, found = area, (left, row + 1 - height, right, row + 1)
    return found


def _largest_in_bars(heights: IntArray) -> tuple[int, int, int, int]:
    """Area, left, right and height of the largest box under bars; a stack has those that still grow."""
    best = (0, 0, 0, 0)
    stack: list[tuple[int, int]] = []  # where a height began, and the height
    for place, height in enumerate([*heights.tolist(), 0]):
        start = place
        while stack and stack[-1][1] >= height:
            start, tall = stack.pop()
            best = max(best, (tall * (place - start), start, place, tall))
        stack.append((start, height))
    return best
