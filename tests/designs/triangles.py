"""A quarter of the sphere as flat triangles on which maps are linear: the discretisation of the published figures."""

import numpy as np

from projdist.designs.newton import Elements


def quarter_of_octahedron(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Points on the unit sphere with longitudes and latitudes within 0..180 and 0..90, and 2 n^2 triangles."""
    points: list[np.ndarray] = []
    numbers: dict[tuple[int, int], int] = {}

    def number(octant: int, row: int, k: int) -> int:
        key = (row, octant * row + k)
        if key not in numbers:
            numbers[key] = len(points)
            x, y, z = np.array([row - k, k, n - row]) / np.linalg.norm([row - k, k, n - row])
            points.append(np.array([x, y, z] if octant == 0 else [-y, x, z]))
        return numbers[key]

    triangles = []
    for row in range(n):
        for octant in range(2):
            for k in range(row + 1):
                triangles.append([number(octant, row, k), number(octant, row + 1, k), number(octant, row + 1, k + 1)])
                if k < row:
                    triangles.append(
                        [number(octant, row, k), number(octant, row + 1, k + 1), number(octant, row, k + 1)]
                    )
    return np.array(points), np.array(triangles)


def elements_and_start(n: int) -> tuple[Elements, np.ndarray]:
    """The elements of the symmetric map, weighted by the triangles' areas on the sphere, and Hammer's map on them."""
    points, triangles = quarter_of_octahedron(n)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    one, two = b - a, c - a
    east = one / np.linalg.norm(one, axis=1)[:, None]
    up = np.cross(one, two)
    north = np.cross(up / np.linalg.norm(up, axis=1)[:, None], east)
    edges = np.stack([np.stack([(edge * axis).sum(1) for axis in (east, north)], axis=-1) for edge in (one, two)], 1)
    inverse = np.linalg.inv(edges)  # its columns are the gradients of the second and the third coordinate
    gradients = np.stack([-inverse.sum(axis=2), inverse[:, :, 0], inverse[:, :, 1]], axis=1)
    # A. van Oosterom and J. Strackee 1983: the solid angle of a triangle.
    solid = np.arctan2((a * np.cross(b, c)).sum(1), 1 + (a * b).sum(1) + (b * c).sum(1) + (c * a).sum(1))
    lon, lat = np.arctan2(points[:, 1], points[:, 0]), np.arcsin(points[:, 2])
    numbers = np.arange(2 * len(points)).reshape(-1, 2).T.copy()
    numbers[0, (lon == 0.0) | (points[:, 2] == 1.0)] = -1
    numbers[1, points[:, 2] == 0.0] = -1
    used = np.unique(numbers[numbers >= 0])
    numbers = np.where(numbers >= 0, np.searchsorted(used, numbers), -1)
    scale = np.sqrt(2.0 / (1.0 + np.cos(lat) * np.cos(lon / 2)))
    hammer = np.stack([2 * scale * np.cos(lat) * np.sin(lon / 2), scale * np.sin(lat)])
    start = np.zeros(len(used))
    start[numbers[numbers >= 0]] = hammer[numbers >= 0]
    local = numbers[:, triangles]
    weights = (solid / solid.sum())[:, None]
    return Elements(local, np.ones(local.shape), gradients[:, None], weights, len(used)), start
