"""Energies of Jacobians, which custom maps minimise, with exact second derivatives.

With the principal scales a >= b of a Jacobian, s = ln(ab) and d = ln(a / b), an energy is S(s) + D(d). The square of
the Fisher distortion, ln^2 a + ln^2 b, is s^2 / 2 + d^2 / 2, so that its mean is the square of the Airy-Kavrayskiy
error. With m = U^T dJ V for J = U diag(a, b) V^T, the Hessian splits into four directions: two in the plane of the
stretches (m11, m22), the twist (m12 - m21), and the flip (m12 + m21).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray

EXPONENT = 0.125
"""Smallest exponent for which the energy is elliptic everywhere."""

_AZIMUTHS = np.pi * np.arange(96) / 96.0
_NEAR = 1e-4  # t = (a - b) / (a + b) below which atanh(t) / t is 1 + t^2 / 3 to rounding
_SQRT_HALF = float(np.sqrt(0.5))


class Expansion(NamedTuple):
    """An energy to second order about Jacobians: values (n,), gradients (n, 2, 2), and eigensystem of the Hessian."""

    value: FloatArray
    gradient: FloatArray
    directions: FloatArray  # (n, 4, 2, 2), orthonormal
    curvatures: FloatArray  # (n, 4), the second derivatives along them

    def is_elliptic(self) -> BoolArray:
        """Mask (n,) of rank-one convexity, checked every 2 degrees; maps of other energies may tear."""
        cos, sin = np.cos(_AZIMUTHS), np.sin(_AZIMUTHS)
        east, north = self.directions[:, :, 0], self.directions[:, :, 1]
        squares = np.stack([cos**2, 2.0 * cos * sin, sin**2])

        def acoustic(a: int, b: int) -> FloatArray:
            """A component of the acoustic tensor (n, azimuths), which is quadratic in cos and sin."""
            mixed = 0.5 * (east[..., a] * north[..., b] + north[..., a] * east[..., b])
            parts = np.stack([east[..., a] * east[..., b], mixed, north[..., a] * north[..., b]], axis=-1)
            return np.einsum("ni,nij->nj", self.curvatures, parts) @ squares

        first = acoustic(0, 0)
        return np.all((first * acoustic(1, 1) > acoustic(0, 1) ** 2) & (first > 0.0), axis=1)


@dataclass(frozen=True)
class Energy:
    """S(s) + D(d): `area` s^2 / 2 + `shape` d^2 / 2, or, with an `exponent` k, its exponentiated twin.

    That is area (exp(k s^2) - 1) / 2k + shape (exp(k d^2) - 1) / 2k, the same to second order, and elliptic everywhere
    in the plane for k >= 1/8 (P. Neff, I.-D. Ghiba, J. Lankeit 2015, Journal of Elasticity 121).
    """

    area: float = 1.0
    shape: float = 1.0
    exponent: float = 0.0

    def value(self, J: FloatArray) -> FloatArray:
        """Values (n,) of Jacobians (n, 2, 2); infinite if they mirror or are not finite."""
        z, w = _conformal_parts(J)
        a, b = np.abs(z) + np.abs(w), np.abs(z) - np.abs(w)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            found = self._half(self.area, np.log(a * b)) + self._half(self.shape, np.log(a / b))
        return np.where(b > 0.0, found, np.inf)

    def expansion(self, J: FloatArray) -> Expansion:
        """The energy to second order about Jacobians (n, 2, 2) of positive determinants."""
        z, w = _conformal_parts(J)
        a = np.abs(z) + np.abs(w)
        b = (J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]) / a
        s, d = np.log(a * b), np.log(a / b)
        S1, S2 = self._slopes(self.area, s)
        D1, D2 = self._slopes(self.shape, d)
        U, V = _turned(0.5 * (np.angle(z) + np.angle(w))), _turned(0.5 * (np.angle(w) - np.angle(z)))
        gradient = np.einsum("nik,nk,njk->nij", U, np.stack([(S1 + D1) / a, (S1 - D1) / b], axis=-1), V)
        stretches, bends = _stretches((S2 + D2 - S1 - D1) / (a * a), (S2 - D2) / (a * b), (S2 + D2 - S1 + D1) / (b * b))
        t = (a - b) / (a + b)
        ratio = np.where(t > _NEAR, np.arctanh(t) / np.where(t > _NEAR, t, 1.0), 1.0 + t * t / 3.0)
        twist, flip = (S1 - D1 * t) / (a * b), (2.0 * self._slope_over(self.shape, d) * ratio - S1) / (a * b)
        m = np.zeros((len(J), 4, 2, 2))
        m[:, :2, 0, 0], m[:, :2, 1, 1] = stretches[:, :, 0], stretches[:, :, 1]
        m[:, 2, 0, 1], m[:, 2, 1, 0] = _SQRT_HALF, -_SQRT_HALF
        m[:, 3, 0, 1], m[:, 3, 1, 0] = _SQRT_HALF, _SQRT_HALF
        directions = U[:, None] @ m @ np.swapaxes(V, 1, 2)[:, None]
        value = self._half(self.area, s) + self._half(self.shape, d)
        return Expansion(value, gradient, directions, np.column_stack([bends, twist, flip]))

    def _half(self, weight: float, t: FloatArray) -> FloatArray:
        """One of the two parts, S(t) or D(t)."""
        k = self.exponent
        return weight * (0.5 * t * t if k == 0.0 else np.expm1(k * t * t) / (2.0 * k))

    def _slope_over(self, weight: float, t: FloatArray) -> FloatArray:
        """First derivative divided by t."""
        return weight * np.exp(self.exponent * t * t)

    def _slopes(self, weight: float, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """First and second derivative."""
        by = self._slope_over(weight, t)
        return by * t, by * (1.0 + 2.0 * self.exponent * t * t)


def _conformal_parts(J: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The complex numbers z, w of J dp = z dp + w conj(dp), dp = dx + i dy."""
    z = 0.5 * ((J[:, 0, 0] + J[:, 1, 1]) + 1j * (J[:, 1, 0] - J[:, 0, 1]))
    w = 0.5 * ((J[:, 0, 0] - J[:, 1, 1]) + 1j * (J[:, 1, 0] + J[:, 0, 1]))
    return z, w


def _turned(angle: FloatArray) -> FloatArray:
    """Rotations (n, 2, 2) by angles in radians, anticlockwise."""
    sin, cos = np.sin(angle), np.cos(angle)
    return np.stack([np.stack([cos, -sin], axis=-1), np.stack([sin, cos], axis=-1)], axis=-2)


def _stretches(p: FloatArray, q: FloatArray, r: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvectors (n, 2, 2), as rows, and eigenvalues (n, 2) of [[p, q], [q, r]]."""
    middle, half = 0.5 * (p + r), 0.5 * (p - r)
    root = np.hypot(half, q)
    return np.swapaxes(_turned(0.5 * np.arctan2(q, half)), 1, 2), np.stack([middle + root, middle - root], axis=-1)
