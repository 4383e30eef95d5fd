"""Bundle adjustment: the maps of images into one plane that fit all their common points best.

The sum of squares of the symmetric transfer error is made least: of a pair (x_i, x_j) of points in images whose maps
are M_i and M_j, the distances of M_j^-1 M_i x_i from x_j and of M_i^-1 M_j x_j from x_i, in the pixels of the images.
It does not know the plane, so that no image is drawn small to please another, as happens where the points are
brought together in the plane of one of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from projdist._typing import FloatArray
from projdist.applications.mosaics.projective import ENTRIES, homogeneous

__all__ = ["Chart", "Link", "Planes", "adjust", "adjust_in", "transfer_errors", "transfers"]

_MOST_STEPS = 200  # 5 to 10 do
_SETTLED = 1e-13  # of a step, in half an image: rounding
_DAMPING, _WEAKEST, _STRONGEST = 1e-4, 1e-8, 1e8


class Link(NamedTuple):
    """Two images i and j and the points, shape (n, 2), that they have in common."""

    i: int
    j: int
    xi: FloatArray
    xj: FloatArray


def transfer_errors(S: FloatArray, xi: FloatArray, xj: FloatArray) -> FloatArray:
    """The larger of the two distances of each pair of points under maps S (..., 3, 3) from i to j, shape (..., n)."""
    return np.maximum(*transfers(S, xi, xj))


def transfers(S: FloatArray, xi: FloatArray, xj: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Both distances, in image j and in image i; infinite where a point lies behind the other image's horizon."""
    with np.errstate(all="ignore"):
        return _distances(S, xi, xj), _distances(np.asarray(np.linalg.inv(S)), xj, xi)


def _distances(S: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    z = np.einsum("...ij,nj->...ni", S, homogeneous(x))
    gap = np.hypot(*np.moveaxis(z[..., :2] / z[..., 2:] - y, -1, 0))
    return np.asarray(np.where((z[..., 2] > 0) & np.isfinite(gap), gap, np.inf))


class Chart(Protocol):
    """The changes that maps may be given, as vectors, and what is left of the normal equations for these.

    `model`: the entries of the changes E_i of M_i (I + E_i) that the normal equations are of.
    """

    @property
    def model(self) -> str:
        """A key of `ENTRIES`."""

    def reduced(self, M: FloatArray, normal: FloatArray, gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
        """J^T J and J^T r of the changes, from those (N, k, N, k) and (N, k) of the entries of all E_i."""

    def moved(self, M: FloatArray, step: FloatArray) -> FloatArray:
        """The maps after a change."""


class Planes(NamedTuple):
    """All maps of a model but the first image's, which stays as it is."""

    model: str

    def reduced(self, M: FloatArray, normal: FloatArray, gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Those of all images but the first."""
        size = gradient[1:].size
        return normal[1:, :, 1:].reshape(size, size), gradient[1:].reshape(size)

    def moved(self, M: FloatArray, step: FloatArray) -> FloatArray:
        """M_i (I + E_i)."""
        E = np.tile(np.eye(3), (len(M), 1, 1))
        for number, (a, b) in enumerate(ENTRIES[self.model]):
            E[1:, a, b] += step.reshape(len(M) - 1, -1)[:, number]
        return M @ E


def adjust(M: FloatArray, links: Sequence[Link], model: str) -> tuple[FloatArray, float]:
    """The maps (N, 3, 3) near the start M that make the symmetric transfer error least, and its RMS over the points.

    The first image's map stays as it is. Raises as `adjust_in`.
    """
    return adjust_in(Planes(model), M, links)[:2]


def adjust_in(chart: Chart, M: FloatArray, links: Sequence[Link]) -> tuple[FloatArray, float, FloatArray]:
    """The same over the maps that a chart reaches; and J^T J there.

    By Levenberg and Marquardt's method, M_i being changed to M_i (I + E_i), from
    the right: what the errors know is M_j^-1 M_i, so neither they nor the steps depend on the plane. The normal
    equations are of 6 or 8 unknowns an image, whatever the number of points; and it ends at the rounding of the
    maps, where sparse trust-region steps by conjugate gradients take ten times as long to 1e-9. Raises ValueError where
    the points do not determine the maps.
    """
    errors, cost = _errors(M, links)
    damping = 0.0
    normal = np.zeros((0, 0))
    for _ in range(_MOST_STEPS):
        normal, gradient = chart.reduced(M, *_normal_equations(M, links, errors, chart.model))
        diagonal = np.diag(normal)
        if not np.isfinite(cost) or not (diagonal > 0).all():
            break
        while True:
            try:
                step = np.asarray(-np.linalg.solve(normal + np.diag(damping * diagonal), gradient))
            except np.linalg.LinAlgError:
                step = np.full_like(gradient, np.nan)
            tried = chart.moved(M, step)
            there, new = _errors(tried, links)
            size = float(np.abs(step).max(initial=0.0))
            if new <= cost * (1.0 + 1e-13) or size < _SETTLED or damping > _STRONGEST:
                break
            damping = max(10.0 * damping, _DAMPING)
        if not new <= cost * (1.0 + 1e-13):
            break
        M, errors, cost = tried, there, new
        if size < _SETTLED:
            break
        damping = 0.1 * damping if damping > _WEAKEST else 0.0
    if not np.isfinite(cost):
        raise ValueError("Invalid correspondences. They do not determine the maps of the images.")
    points = sum(len(link.xi) for link in links)
    return M, float(np.sqrt(cost / (2.0 * points))), normal


class _Way(NamedTuple):
    """A link in one direction: the image that points are from, the one they go to, where they are there, and errors."""

    a: int
    b: int
    S: FloatArray
    x: FloatArray
    z: FloatArray
    error: FloatArray


def _errors(M: FloatArray, links: Sequence[Link]) -> tuple[list[_Way], float]:
    """The ways there and back of all links, and the sum of squares; infinite where a point is behind a horizon."""
    ways, cost = [], 0.0
    with np.errstate(all="ignore"):
        inverse = np.linalg.inv(M) if np.isfinite(M).all() else np.full_like(M, np.nan)
        for link in links:
            for a, b, x, y in ((link.i, link.j, link.xi, link.xj), (link.j, link.i, link.xj, link.xi)):
                S, x1 = inverse[b] @ M[a], homogeneous(x)
                z = x1 @ S.T
                error = z[:, :2] / z[:, 2:] - y
                ways.append(_Way(a, b, S, x1, z, error))
                cost += float(np.sum(error * error)) if (z[:, 2] > 0).all() else np.inf
    return ways, cost if np.isfinite(cost) else np.inf


def _normal_equations(
    M: FloatArray, links: Sequence[Link], ways: list[_Way], model: str
) -> tuple[FloatArray, FloatArray]:
    """J^T J (N, k, N, k) and J^T r (N, k) of the entries of the changes of all images."""
    entries = ENTRIES[model]
    count, wide = len(M), len(entries)
    normal, gradient = np.zeros((count, wide, count, wide)), np.zeros((count, wide))
    rows, columns = (list(numbers) for numbers in zip(*entries, strict=True))
    for a, b, S, x, z, error in ways:
        # y = S (I + E_a) x - E_b S x, then the two quotients.
        quotient = np.zeros((len(x), 2, 3))
        quotient[:, 0, 0] = quotient[:, 1, 1] = 1.0 / z[:, 2]
        quotient[:, :, 2] = -z[:, :2] / z[:, 2:] ** 2
        Ja = ((quotient @ S)[:, :, rows] * x[:, None, columns]).reshape(-1, wide)
        Jb = (-quotient[:, :, rows] * z[:, None, columns]).reshape(-1, wide)
        flat = error.reshape(-1)
        normal[a, :, a] += Ja.T @ Ja
        normal[b, :, b] += Jb.T @ Jb
        cross = Ja.T @ Jb
        normal[a, :, b] += cross
        normal[b, :, a] += cross.T
        gradient[a] += flat @ Ja
        gradient[b] += flat @ Jb
    return normal, gradient
