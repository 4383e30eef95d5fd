"""Pictures with known maps, cut from a shaded relief that matplotlib ships; for the tests of mosaics."""

import functools

import numpy as np
from matplotlib import cbook, colormaps, font_manager
from matplotlib.colors import LightSource
from mosaic_sets import moved
from PIL import Image, ImageDraw, ImageFont
from scipy.fft import irfft2
from scipy.ndimage import gaussian_filter, map_coordinates, zoom

WIDTH, HEIGHT = 300, 240  # of a picture


@functools.cache
def relief():
    """A coloured relief (688, 806, 3) of uint8."""
    heights = zoom(cbook.get_sample_data("jacksboro_fault_dem.npz")["elevation"].astype(float), 2.0, order=3)
    shaded = LightSource(315, 45).shade(heights, cmap=colormaps["gist_earth"], vert_exag=0.05, dx=15, dy=15)
    return np.round(255.0 * shaded[..., :3]).astype(np.uint8)


def middles(H, width, height):
    """Where the map H takes the middles of all pixels, counted from the middle of the first."""
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    return moved(H, np.column_stack([x.ravel(), y.ravel()])) - 0.5


def sampled(whole, H, width=420, height=320):
    """The pixels of a picture, coloured or grey, that the map H takes into the pixels of another, by cubic splines."""
    there, bands = middles(H, width, height).T[::-1], np.moveaxis(np.atleast_3d(whole).astype(float), -1, 0)
    found = np.stack([map_coordinates(band, there, order=3, mode="reflect") for band in bands], axis=-1)
    return np.clip(np.round(found), 0, 255).astype(np.uint8).reshape(height, width, -1).squeeze()


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


def aerial(rng, width, height, cut_at):
    """Six aerial pictures of woods and fields in one grey scene, and their maps into it.

    What is larger than a dozen pixels stays where it is. The leaves do not: wind, sun and parallax make them another
    texture in each picture, with more contrast than the ground has. `cut_at`: the size of the leaves in pixels.
    """
    across, down = int(2.25 * width), int(1.7 * height)
    ground = spectrum(rng, across, down, 3.0 * cut_at, 0.3 * width)
    woods = gaussian_filter(spectrum(rng, across, down, 0.1 * width, 0.5 * width), cut_at) > -0.4
    H = np.tile(np.eye(3), (6, 1, 1))
    pictures = []
    for k in range(6):
        H[k, :2, :2] += 0.02 * rng.normal(size=(2, 2))
        turn = np.radians(rng.uniform(-6.0, 6.0))
        H[k, :2, :2] = H[k, :2, :2] @ [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
        middle = np.array([(0.56 + 0.56 * (k % 3)) * width, (0.58 + 0.54 * (k // 3)) * height])
        H[k, :2, 2] = middle - H[k, :2, :2] @ [0.5 * width, 0.5 * height]
        places = middles(H[k], width, height).T[::-1]
        still = map_coordinates(ground, places, order=1, mode="reflect").reshape(height, width)
        wooded = map_coordinates(woods.astype(np.float32), places, order=1, mode="reflect").reshape(height, width)
        leaves = spectrum(rng, width, height, 0.5 * cut_at, 2.0 * cut_at)
        grey = 110.0 + 28.0 * still + 30.0 * wooded * leaves + rng.normal(0.0, 2.0, (height, width))
        pictures.append(np.clip(np.round(grey), 0, 255).astype(np.uint8))
    return pictures, H


def spectrum(rng, width, height, shortest, longest):
    """A texture (height, width) of mean 0 and variance 1, equally strong in octaves of wavelengths in pixels."""
    across, down = np.fft.rfftfreq(width)[None], np.fft.fftfreq(height)[:, None]
    f = np.hypot(across, down)
    with np.errstate(divide="ignore"):
        power = np.where((f > 1.0 / longest) & (f < 1.0 / shortest), 1.0 / f, 0.0)
    noise = irfft2(power * np.exp(2j * np.pi * rng.random(power.shape)), s=(height, width)).astype(np.float32)
    return noise / noise.std()


def page(seed, width=900, height=700):
    """A page of printed words (height, width), black on white."""
    rng = np.random.default_rng(seed)
    words = ["".join(rng.choice(list("aeioustrnlmdpcbg"), rng.integers(2, 10))) for _ in range(120)]
    font = ImageFont.truetype(font_manager.findfont("DejaVu Serif"), 15)
    image = Image.new("L", (width, height), 240)
    drawing = ImageDraw.Draw(image)
    for y in range(10, height - 20, 22):
        x = 10.0
        while x < width - 60:
            word = str(rng.choice(words))
            drawing.text((x, y), word, font=font, fill=25)
            x += drawing.textlength(word, font=font) + 7
    return np.array(image)


def blobs(seed, count=120, width=900, height=700):
    """Dark blobs with a darker spot each on a plain ground (height, width), as cells under a microscope."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    image = np.full((height, width), 210.0)
    for _ in range(count):
        left, top = rng.uniform([0, 0], [width, height])
        radius, wide = rng.uniform(8, 22), rng.uniform(0.7, 1.3)
        near = slice(max(int(top) - 90, 0), int(top) + 90), slice(max(int(left) - 90, 0), int(left) + 90)
        across, down = x[near] - left, y[near] - top
        image[near] -= rng.uniform(60, 120) / (1 + np.exp(6 * (np.hypot(across * wide, down / wide) / radius - 1)))
        spot = ((across - radius / 3) ** 2 + down**2) / (radius / 3) ** 2
        image[near] -= rng.uniform(20, 60) * np.exp(-spot)
    return np.clip(image + rng.normal(0, 2, image.shape), 0, 255).astype(np.uint8)
