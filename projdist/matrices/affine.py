"""Linear maps followed by shifts: what old maps are rectified by, and clouds of points registered."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray

__all__ = ["Affine"]


@dataclass(frozen=True, eq=False)
class Affine:
    """The map p -> matrix p + shift of points (..., n).

    Examples
    --------
    >>> import numpy as np
    >>> there = Affine(np.diag([2.0, 4.0]), np.array([1.0, 0.0]))
    >>> there.inverse()(there(np.array([[3.0, 5.0]])))
    array([[3., 5.]])
    """

    matrix: FloatArray
    shift: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        """The images of points."""
        return np.asarray(points @ self.matrix.T + self.shift)

    def inverse(self) -> Affine:
        """The map back."""
        back = np.asarray(np.linalg.inv(self.matrix), dtype=float)
        return Affine(back, -back @ self.shift)
