"""Sets of images with known maps, and the points that they have in common; for the tests of mosaics."""

import itertools

import numpy as np

from projdist.applications.mosaics import Correspondences

SIZES = np.array([[300.0, 200.0]] * 6)


def moved(H, x):
    """Points (n, 2) under a map."""
    y = np.column_stack([x, np.ones(len(x))]) @ H.T
    return y[:, :2] / y[:, 2:]


def turned(x, y, angle):
    """The map that turns by an angle and shifts."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin, x], [sin, cos, y], [0.0, 0.0, 1.0]])


def affine_maps(rng, spread=0.06, count=6):
    """Overlapping images in a row of two lines, each a little sheared, scaled and turned."""
    H = np.tile(np.eye(3), (count, 1, 1))
    for k in range(count):
        H[k, :2, :2] += spread * rng.normal(size=(2, 2))
        H[k, :2, 2] = [170.0 * (k % 3), 110.0 * (k // 3)]
    return H


def homographies(rng, spread=0.06, count=6, tilt=2e-4):
    """The same with a vanishing line each."""
    H = affine_maps(rng, spread, count)
    H[:, 2, :2] = tilt * rng.uniform(-1.0, 1.0, size=(count, 2))
    return H


MAKERS = {"affine": affine_maps, "homography": homographies}


def common_points(H, sizes=SIZES, rng=None, noise=0.0, pairs=None, grid=9):
    """Correspondences of images whose maps into one plane are known, with normal noise in pixels."""
    columns = [[], [], [], []]
    for i, j in pairs or itertools.combinations(range(len(H)), 2):
        steps = (np.arange(grid) + 0.5) / grid
        xi = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) * sizes[i]
        xj = moved(np.linalg.solve(H[j], H[i]), xi)
        inside = ((xj > 0) & (xj < sizes[j])).all(axis=1)
        if inside.sum() < 8:
            continue
        values = np.full(inside.sum(), i), np.full(inside.sum(), j), xi[inside], xj[inside]
        for column, one in zip(columns, values, strict=True):
            column.append(one)
    i, j, xi, xj = (np.concatenate(column) for column in columns)
    if noise:
        xi, xj = xi + noise * rng.normal(size=xi.shape), xj + noise * rng.normal(size=xj.shape)
    return Correspondences(i=i, j=j, xi=xi, xj=xj, sizes=sizes)


def write_csv(path, points, model=0, sizes=True):
    """The table that `read_correspondences` reads."""
    header = "model,i,j,xi,yi,xj,yj"
    if sizes:
        header += " ; image sizes h x w: " + str([(int(h), int(w)) for w, h in points.sizes])
    table = np.column_stack([np.full(len(points.i), model), points.i, points.j, points.xi, points.xj])
    np.savetxt(path, table, fmt="%.17g", delimiter=",", header=header)
    return path
