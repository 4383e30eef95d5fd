"""The modes of a distortion: independent ways in which matrices differ from their mean, with the share of each.

Relative to the mean T, a matrix A is Z = ln(T^-1 A A^T T^-T) / 2, a symmetric matrix of norm Dist_F(T^-1 A). The modes
are the principal components of these (Fletcher, Lu, Pizer & Joshi 2004, Principal geodesic analysis for the study of
nonlinear statistics of shape, IEEE Transactions on Medical Imaging 23): symmetric matrices E_k of norm 1 whose scores
<Z, E_k> are uncorrelated. The squares of the scores have the mean square of Dist_F for their sum.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist._typing import ArrayLike, FloatArray
from projdist.matrices.mean_transformation import check_matrices, check_weights, field_mdt, mdt
from projdist.matrices.whitened_sets import logarithms
from projdist.support import Answer, check_numbers

_PURE = 0.1  # a ratio of two scales this near to 1, 0 or -1 is named as if it were that
_ALONG = 7.5  # degrees: a direction this near to an axis is named by it
_LEAST = 0.1  # smallest entry that is named of a mode in more than two dimensions
_NOTHING = 1e-12  # RMS of logarithms below which they are rounding
_AXES = "xyz"


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Modes(Answer):
    """The d = n (n + 1) / 2 modes of matrices, largest share first.

    If A has only the score s of a mode E, T^-1 A is exp(s E) up to rotations: in the direction of an eigenvector the
    scale is exp of s times the eigenvalue. The eigenvalue of largest modulus is positive.
    """

    T: FloatArray  #: (n, n), the reference
    matrices: FloatArray  #: (d, n, n), symmetric, of norm 1
    rms: FloatArray  #: (d,), of the scores, whose squares have the mean square of Dist_F(T^-1 A) for their sum

    @property
    def shares(self) -> FloatArray:
        """Shares of the mean square of the distortion, of sum 1."""
        squares = self.rms**2
        total = float(squares.sum())
        return squares / total if total > 0 else squares

    @property
    def words(self) -> tuple[str, ...]:
        """Description of each mode, in the axes of T^-1 A."""
        return tuple(map(_words, self.matrices))

    def scores(self, A: ArrayLike) -> FloatArray:
        """The scores (..., d) of matrices (..., n, n); NaN for singular ones."""
        A = check_numbers("matrices", A)
        n = self.T.shape[0]
        if A.shape[-2:] != (n, n):
            raise ValueError(f"Invalid shape {A.shape} of matrices. It must be (..., {n}, {n}).")
        flat = A.reshape(-1, n, n)
        with np.errstate(all="ignore"):
            good = np.isfinite(flat).all(axis=(1, 2)) & (np.abs(np.linalg.det(np.nan_to_num(flat))) > 0)
        scores = np.full((len(flat), len(self.rms)), np.nan)
        scores[good] = np.einsum("mij,kij->mk", _relative(self.T, flat[good]), self.matrices)
        return scores.reshape(*A.shape[:-2], -1)

    @property
    def summary(self) -> str:
        """The modes in a line, without those below half a per cent."""
        named = [(share, word) for share, word in zip(self.shares, self.words, strict=True) if share >= 0.005]
        return "; ".join(f"{100.0 * share:.0f} % {word}" for share, word in named) or "nothing is distorted"

    def _line(self) -> str:
        return self.summary

    @property
    def rows(self) -> list[dict[str, Any]]:
        """`"share"`, `"rms"`, `"words"` and `"matrix"` of each mode, largest first."""
        rows = zip(self.shares.tolist(), self.rms.tolist(), self.words, self.matrices.tolist(), strict=True)
        return [dict(zip(("share", "rms", "words", "matrix"), row, strict=True)) for row in rows]

    def to_dict(self) -> dict[str, Any]:
        """`{"T", "modes": [{"share", "rms", "words", "matrix"}]}`, largest first."""
        return {"T": self.T.tolist(), "modes": self.rows}

    def _table(self) -> dict[str, Any]:
        """One row per mode; its matrix as E_00, E_01, ..."""
        n = self.T.shape[0]
        entries = {f"E_{i}{j}": self.matrices[:, i, j] for i in range(n) for j in range(n)}
        return {"share": self.shares, "rms": self.rms, "words": list(self.words)} | entries


def modes(A: ArrayLike, weights: ArrayLike | None = None, *, T: ArrayLike | None = None) -> Modes:
    """The modes of a distortion: principal components of matrices A_i about their mean, and their shares.

    For the Jacobians of a map they show whether sizes, one direction or angles are distorted.

    Parameters
    ----------
    A : array_like (N, n, n)
        N matrices, of any dimension n.
    weights : array_like (N,), optional
        Not negative, of any sum; equal ones if there are none.
    T : array_like (n, n), optional
        The reference; by default the mean distorting transformation. Modes are described in the axes of T^-1 A.

    Returns
    -------
    Modes
        n (n + 1) / 2 symmetric matrices of norm 1, the RMS of the scores in each, their shares of the whole, and words.

    Raises
    ------
    ValueError
        As `mdt` does, for a shape other than (N, n, n), and for a T that is singular or of another shape.

    References
    ----------
    Fletcher, Lu, Pizer & Joshi 2004, IEEE Transactions on Medical Imaging 23 (principal geodesic analysis).
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications (the metric and the mean).

    Examples
    --------
    Of diagonal matrices that differ in the first entry alone the only mode is that direction:

    >>> found = modes([[[1, 0], [0, 1]], [[2, 0], [0, 1]], [[3, 0], [0, 1]]])
    >>> found
    Modes(100 % horizontal)
    """
    A = check_matrices(A)
    if A.ndim != 3:
        raise ValueError(f"Invalid shape {A.shape} of matrices. It must be (N, n, n).")
    w = check_weights(weights, A.shape[:1])
    mean = mdt(A, w).T  # which also checks that they are not singular
    if T is not None:
        mean = check_numbers("T", T)
        if mean.shape != A.shape[1:] or not np.isfinite(mean).all() or np.linalg.matrix_rank(mean) < len(mean):
            message = f"Invalid T of shape {mean.shape}. It must be an invertible matrix of shape {A.shape[1:]}."
            raise ValueError(message)
    return _modes(A, w, mean)


def field_modes(J: FloatArray, weights: FloatArray, T: FloatArray | None = None) -> Modes:
    """The modes of a smooth field of matrices at the nodes of a quadrature rule, whose weights may be negative."""
    w = weights / weights.sum()
    return _modes(J, w, field_mdt(J, w).T if T is None else T)


def _relative(T: FloatArray, A: FloatArray) -> FloatArray:
    """ln(T^-1 A A^T T^-T) / 2 of matrices (N, n, n)."""
    B = np.linalg.solve(np.broadcast_to(T, A.shape), A)
    return np.asarray(0.5 * logarithms(np.asarray(B, dtype=float))[0])


def _modes(A: FloatArray, w: FloatArray, T: FloatArray) -> Modes:
    """The modes of matrices (N, n, n) with weights (N,) of sum 1 about T."""
    n = A.shape[-1]
    i, j = np.triu_indices(n)
    root = np.where(i == j, 1.0, np.sqrt(2.0))
    Z = _relative(T, A)[:, i, j] * root
    values, vectors = np.linalg.eigh(np.einsum("m,mp,mq->pq", w, Z, Z, optimize=True))
    rms = np.sqrt(np.maximum(values, 0.0))[::-1]
    E = np.zeros((len(root), n, n))
    E[:, i, j] = E[:, j, i] = _aligned(vectors, rms[::-1]).T[::-1] / root
    return Modes(T=T, matrices=np.stack([_upright(one) for one in E]), rms=np.where(rms > _NOTHING, rms, 0.0))


def _upright(E: FloatArray) -> FloatArray:
    """E or -E, so that the eigenvalue of largest modulus, or in a tie the first non-zero entry, is positive."""
    low, high = np.linalg.eigvalsh(E)[[0, -1]]
    if abs(low + high) > 1e-6:
        return -E if -low > high else E
    entries = E[np.triu_indices(len(E))]
    return -E if entries[np.abs(entries) > 1e-6][0] < 0 else E


def _aligned(vectors: FloatArray, rms: FloatArray) -> FloatArray:
    """The eigenvectors, those of zero score, which are arbitrary, replaced by ones along the coordinates."""
    none = rms <= _NOTHING
    if not none.any():
        return vectors
    spanned = vectors[:, ~none]
    chosen: list[FloatArray] = []
    for column in (np.eye(len(rms)) - spanned @ spanned.T).T:
        left = column - sum((one * (one @ column) for one in chosen), np.zeros(len(rms)))
        if np.linalg.norm(left) > 1e-6 and len(chosen) < none.sum():
            chosen.append(left / np.linalg.norm(left))
    return np.column_stack([*chosen[::-1], spanned])


def _words(E: FloatArray) -> str:
    """Description of a symmetric matrix of norm 1; in the plane by the scales along its largest stretch and across."""
    n = len(E)
    if abs(np.trace(E)) / np.sqrt(n) > 1.0 - 0.5 * _PURE**2:
        return "size"
    if n != 2:  # by the entries above `_LEAST`
        names = _AXES if n <= len(_AXES) else [f"{k + 1}" for k in range(n)]
        pairs = [*zip(*np.triu_indices(n), strict=True)]
        named = [(E[i, j], names[i]) if i == j else (np.sqrt(2.0) * E[i, j], names[i] + names[j]) for i, j in pairs]
        shown = [f"{name} {value:+.1f}" for value, name in named if abs(value) > _LEAST]
        return ", ".join(shown).replace("-", "\N{MINUS SIGN}")
    turned = float(np.degrees(0.5 * np.arctan2(2.0 * E[0, 1], E[0, 0] - E[1, 1])))
    low, high = np.linalg.eigvalsh(E)
    ratio = low / high
    if ratio > 1.0 - _PURE:
        return "size"
    if ratio < _PURE - 1.0:
        return _named(turned, 45.0, ("shape", "shear", "shape at"))
    along, across = (_named(angle, 90.0, ("horizontal", "vertical", "along")) for angle in (turned, turned + 90.0))
    return along if abs(ratio) <= _PURE else f"{along} 1, {across} {ratio:.2f}".replace("-0.", "\N{MINUS SIGN}0.")


def _named(degrees: float, half: float, words: tuple[str, str, str]) -> str:
    """The word for angles near 0, near `half` the period, or between them, with the angle."""
    folded = (degrees + half) % (2.0 * half) - half
    if abs(folded) <= _ALONG:
        return words[0]
    return words[1] if abs(folded) >= half - _ALONG else f"{words[2]} {folded:.0f}°"
