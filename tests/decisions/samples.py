"""Jacobians for the tests of figures and properties."""

import numpy as np
from matrix_samples import rotation


def turned(rng: np.random.Generator, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Matrices with principal scales a and b, turned every way, which changes no figure."""
    turn = rotation(rng.uniform(0.0, 2.0 * np.pi, a.size))
    return np.asarray(turn @ (np.stack([a, b], axis=-1)[:, :, None] * np.eye(2)))
