"""Cells of a grid that the edge of what is shown crosses, as polygons that end there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray


@dataclass(frozen=True)
class CutCells:
    """Polygons (n, k) of vertices: nodes of the grid, then points on its edges.

    `ends` (m, 2) are the nodes of each of these, first the one that is shown, `share` (m,) how far from it to the other
    the point lies, `sides` (l, 2) the sides of polygons along the edge of what is shown, as numbers of points.
    """

    ends: IntArray
    share: FloatArray
    polygons: Sequence[IntArray]
    sides: IntArray


def cut_cells(level: FloatArray, cells: BoolArray) -> CutCells:
    """The part of `cells` (n - 1, m - 1) where a level at the nodes (n, m), even along their edges, is at most 0.

    Only of those that are parted.
    """
    flat, nodes = level.ravel(), level.size
    row, column = np.nonzero(cells)
    low = row * level.shape[1] + column
    corners = np.column_stack([low, low + 1, low + level.shape[1] + 1, low + level.shape[1]])
    kind = (flat[corners] <= 0.0) @ (1 << np.arange(4))
    mixed = (kind > 0) & (kind < 15)
    corners, kind = corners[mixed], kind[mixed]
    edges = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1), axis=-1)
    found, number = np.unique(edges[..., 0] * nodes + edges[..., 1], return_inverse=True)
    ends = np.column_stack(np.divmod(found, nodes))
    crossed = (flat[ends] <= 0.0).sum(axis=1) == 1
    points = nodes + np.cumsum(crossed)[number.reshape(edges.shape[:2])] - 1
    vertices = np.concatenate([corners, points], axis=1)
    around = {one: _around(one) for one in np.unique(kind).tolist()}
    polygons = [vertices[kind == one][:, path] for one, path in around.items()]
    along = [
        vertices[kind == one][:, [path[k - 1], path[k]]] - nodes
        for one, path in around.items()
        for k in range(len(path))
        if min(path[k - 1], path[k]) >= 4
    ]
    ends = np.take_along_axis(ends[crossed], np.argsort(flat[ends[crossed]], axis=1), axis=1)
    first, second = flat[ends].T
    return CutCells(ends, first / (first - second), polygons, np.concatenate([np.empty((0, 2), int), *along]))


def _around(kind: int) -> list[int]:
    """The way around what is shown of a cell, from corners 0 to 3 and points on the edges after them, 4 to 7."""
    path = []
    for corner in range(4):
        here, after = kind >> corner & 1, kind >> (corner + 1) % 4 & 1
        path += [corner] * here + [corner + 4] * (here != after)
    return path
