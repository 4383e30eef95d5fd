"""Control points of old maps with known distortions; for the tests of old maps."""

import numpy as np

from projdist.applications.oldmaps import ControlPoints

ROUNDING = 1e-9  # relative; the fits solve well-conditioned systems of at most a hundred unknowns


def grid(count: int = 7) -> np.ndarray:
    """Points of the unit square, its corners among them."""
    return np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, count)] * 2), axis=-1).reshape(-1, 2)


def scattered(count: int = 40, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Points of an old map and their true places, with a smooth distortion and noise."""
    rng = np.random.default_rng(seed)
    old = rng.uniform([0.0, 0.0], [900.0, 600.0], (count, 2))
    x, y = old.T / 600.0
    new = np.stack([40.0 * x + 3.0 * y + 2.0 * np.sin(2 * x), 41.0 * y - 2.0 * x + 1.5 * x * y], axis=-1)
    return old, 1000.0 * new + rng.normal(0.0, 100.0, new.shape)


def smooth(kind: str, old: np.ndarray) -> np.ndarray:
    """True places, some 40 km large, of places on a sheet of 900 by 600."""
    x, y = old.T / 600.0
    both = {
        "affine": (40 * x + 3 * y, 41 * y - 2 * x),
        "waves": (40 * x + np.sin(6 * y), 40 * y + np.cos(5 * x + y)),
        "conformal": (40 * x + 3 * np.exp(x) * np.cos(y), 40 * y + 3 * np.exp(x) * np.sin(y)),
        "cone": ((3 - y) * np.sin(0.5 * x) * 25, -(3 - y) * np.cos(0.5 * x) * 25),
    }[kind]
    return 1000.0 * np.stack(both, axis=-1)


def sheets(kind: str, count: int, noise: float, sets: range):
    """Sets of scattered points of a smooth map, with normal errors in metres."""
    for seed in sets:
        rng = np.random.default_rng(seed)
        old = rng.uniform([0.0, 0.0], [900.0, 600.0], (count, 2))
        yield ControlPoints(old, smooth(kind, old) + noise * rng.normal(size=(count, 2)))
