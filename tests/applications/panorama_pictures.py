"""Pictures of a sphere by a camera that turns, with known rotations; for the tests of panoramas."""

import functools
import itertools

import numpy as np
from matplotlib import colormaps
from scipy.ndimage import map_coordinates
from scipy.spatial.transform import Rotation

from projdist.applications.mosaics import Correspondences

_CELLS = 200  # a side of the volume that the sphere is cut from


@functools.cache
def volume():
    """A texture in space, periodic, equally strong in octaves."""
    f = np.fft.fftfreq(_CELLS)
    size = np.sqrt(f[:, None, None] ** 2 + f[None, :, None] ** 2 + f[None, None, :] ** 2)
    noise = np.fft.fftn(np.random.default_rng(7).normal(size=(_CELLS,) * 3))
    power = np.divide(1.0, size**1.5, out=np.zeros_like(size), where=(size > 0.01) & (size < 0.3))
    field = np.fft.ifftn(noise * power).real
    return (field / field.std()).astype(np.float32)


def colours(directions):
    """Red, green and blue (..., 3) of uint8 in directions (..., 3): the texture on a sphere, and lines of latitude."""
    unit = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    places = np.moveaxis(unit * 0.45 * _CELLS + 0.5 * _CELLS, -1, 0)
    value = map_coordinates(volume(), places, order=3, mode="grid-wrap")
    shaded = colormaps["gist_earth"](0.5 + 0.17 * value)[..., :3] * 255.0
    latitude = np.degrees(np.arcsin(-unit[..., 1]))
    on_line = np.abs(latitude - 15.0 * np.round(latitude / 15.0)) < 0.15
    return np.where(on_line[..., None], 255.0, shaded).round().astype(np.uint8)


def turned_by(w):
    """The rotation about a vector by its length."""
    return Rotation.from_rotvec(w).as_matrix()


def directions(R, f, width, height):
    """Those of the middles of all pixels (height, width, 3): right, down, forward, turned by R."""
    x, y = np.meshgrid(np.arange(width) + 0.5 - width / 2, np.arange(height) + 0.5 - height / 2)
    return np.stack([x / f, y / f, np.ones_like(x)], axis=-1) @ R.T


def picture(R, f, width, height):
    """What a camera with that rotation and focal length in pixels sees."""
    return colours(directions(R, f, width, height))


def cameras(rng, longitudes, latitudes=0.0, wobble=2.0):
    """Rotations that look at longitudes and latitudes in degrees, off by a wobble of a few degrees about all axes."""
    lon, lat = np.radians(np.broadcast_arrays(np.asarray(longitudes, float), latitudes))
    off = np.radians(wobble) * rng.normal(size=(len(lon), 3))
    turns, tilts = np.multiply.outer(lon, [0.0, 1.0, 0.0]), np.multiply.outer(lat, [1.0, 0.0, 0.0])
    return turned_by(turns) @ turned_by(tilts) @ turned_by(off)


def common_directions(R, f, width, height, rng, noise=0.0, count=4000):
    """Correspondences of such pictures: what two of them see of directions at random, with normal noise in pixels."""
    rays = rng.normal(size=(count, 3))
    seen = []
    for one, focal in zip(R, np.broadcast_to(f, len(R)), strict=True):
        there = rays @ one
        with np.errstate(divide="ignore", invalid="ignore"):
            x = focal * there[:, :2] / there[:, 2:] + [width / 2, height / 2]
        seen.append((x, (there[:, 2] > 0) & ((x > 0) & (x < [width, height])).all(axis=1)))
    rows = []
    for i, j in itertools.combinations(range(len(R)), 2):
        both = seen[i][1] & seen[j][1]
        if both.sum() >= 8:
            rows.append((np.full(both.sum(), i), np.full(both.sum(), j), seen[i][0][both], seen[j][0][both]))
    i, j, xi, xj = (np.concatenate(column) for column in zip(*rows, strict=True))
    xi, xj = xi + noise * rng.normal(size=xi.shape), xj + noise * rng.normal(size=xj.shape)
    return Correspondences(i=i, j=j, xi=xi, xj=xj, sizes=np.tile([[float(width), float(height)]], (len(R), 1)))


def off_by(R, known):
    """The greatest angle in degrees between relative rotations, from the first camera's."""
    gaps = (R[0].T @ R).swapaxes(1, 2) @ (known[0].T @ known)
    return float(np.degrees(Rotation.from_matrix(gaps).magnitude().max()))
