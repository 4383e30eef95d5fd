"""Pictures with known maps, cut from a shaded relief that matplotlib ships; for the tests of mosaics."""

import functools

import numpy as np
from matplotlib import cbook, colormaps
from matplotlib.colors import LightSource
from mosaic_sets import moved
from PIL import Image
from scipy.ndimage import map_coordinates, zoom

WIDTH, HEIGHT = 300, 240  # of a picture


@functools.cache
def relief():
    """A coloured relief (688, 806, 3) of uint8."""
    heights = zoom(cbook.get_sample_data("jacksboro_fault_dem.npz")["elevation"].astype(float), 2.0, order=3)
    shaded = LightSource(315, 45).shade(heights, cmap=colormaps["gist_earth"], vert_exag=0.05, dx=15, dy=15)
    return np.round(255.0 * shaded[..., :3]).astype(np.uint8)


def sampled(whole, H, width, height):
    """The pixels of a picture that the map H takes into the pixels of another, by cubic splines."""
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    places = moved(H, np.column_stack([x.ravel(), y.ravel()])) - 0.5
    bands = [map_coordinates(whole[..., b].astype(float), places.T[::-1], order=3, mode="reflect") for b in range(3)]
    return np.clip(np.round(np.stack(bands, axis=-1)), 0, 255).astype(np.uint8).reshape(height, width, 3)


def maps(rng, spread=0.03, tilt=0.0):
    """Six pictures in two rows of three, each a little sheared, scaled, turned and, with a tilt, seen aslant."""
    H = np.tile(np.eye(3), (6, 1, 1))
    for k in range(6):
        H[k, :2, :2] += spread * rng.normal(size=(2, 2))
        H[k, 2, :2] = tilt * rng.uniform(-1.0, 1.0, size=2)
        H[k, :2, 2] = [40.0 + 200.0 * (k % 3), 40.0 + 170.0 * (k // 3)]
    return H


def cut(H):
    """The pictures of the relief."""
    return [sampled(relief(), one, WIDTH, HEIGHT) for one in H]


def save(folder, pictures, suffix=".png"):
    """Files of pictures."""
    paths = []
    for number, pixels in enumerate(pictures):
        paths.append(folder / f"sheet{number}{suffix}")
        Image.fromarray(pixels).save(paths[-1])
    return paths


def places():
    """Points (n, 2) over a picture, its corners among them."""
    x, y = np.meshgrid(np.linspace(0, WIDTH, 7), np.linspace(0, HEIGHT, 7))
    return np.column_stack([x.ravel(), y.ravel()])
