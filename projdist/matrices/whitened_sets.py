"""Sets of matrices relative to trial means, B_i = T^-1 A_i, and logarithms of B_i B_i^T, whose mean is 0 at a mean."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from projdist._typing import ArrayLike, BoolArray, FloatArray


def lq(A: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """The unique factors of A = L Q: L lower triangular with a positive diagonal, Q orthogonal.

    L is the Cholesky factor of A A^T. Raises ValueError, with the index, where A is singular or not finite.
    """
    A = check_square(A)
    refuse(np.asarray(~np.isfinite(A).all(axis=(-1, -2))), "finite and invertible")
    Q, R = np.linalg.qr(transposed(A))
    diagonal = np.einsum("...kk->...k", R)
    refuse((diagonal == 0).any(axis=-1), "finite and invertible")
    signs = np.sign(diagonal)[..., None, :]
    return transposed(R) * signs, transposed(Q * signs)


def lower_factor(A: FloatArray) -> FloatArray:
    """L of A = L Q, unchecked."""
    L = transposed(np.asarray(np.linalg.qr(transposed(A), mode="r")))
    return np.asarray(L * np.where(np.einsum("...kk->...k", L) < 0, -1.0, 1.0)[..., None, :])


def transposed(A: FloatArray) -> FloatArray:
    """A with its last two axes exchanged."""
    return A.swapaxes(-1, -2)


def symmetric_exp(V: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The exponentials of symmetric matrices V and of -V."""
    values, U = np.linalg.eigh(V)
    scales = np.exp(values)[..., None, :]
    return (U * scales) @ transposed(U), (U / scales) @ transposed(U)


def place(wrong: BoolArray) -> str:
    """Index of the first True for messages: ` at index 3`, ` at index (1, 3)`, or "" for a scalar."""
    index = tuple(int(i) for i in np.argwhere(wrong)[0])
    return "" if not index else f" at index {index[0] if len(index) == 1 else index}"


def solve(A: FloatArray, B: FloatArray) -> FloatArray:
    """A^-1 B, broadcast before, as NumPy below 2 takes a B with one axis less than A for vectors."""
    B = np.broadcast_to(B, (*np.broadcast_shapes(A.shape[:-2], B.shape[:-2]), *B.shape[-2:]))
    return np.asarray(np.linalg.solve(A, B), dtype=float)


def check_square(A: ArrayLike) -> FloatArray:
    """A as an array (..., n, n); raises ValueError for other shapes."""
    A = np.asarray(A, dtype=float)
    if A.ndim < 2 or A.shape[-1] != A.shape[-2] or A.shape[-1] == 0:
        raise ValueError(f"Invalid shape {A.shape} of a matrix. It must be (..., n, n).")
    return A


def refuse(wrong: BoolArray, must: str, what: str = "matrix") -> None:
    """Raise ValueError, with its index, for the first matrix (or `what` it is) that is wrong, if one is."""
    if wrong.any():
        raise ValueError(f"Invalid {what}{place(wrong)}. It must be {must}.")


# ---- whitened sets -------------------------------------------------------------------------------

EPS = float(np.finfo(float).eps)
_CHUNK = 1 << 15  # doubles of an array: about eight fit into the second-level cache
_WHOLE = 4  # the largest n for which the Hessian, n^2 on a side, is made as a matrix
_SAME = 1e-8  # r below which r / sinh r and r coth r are 1
# Eigenvectors are kept while the logarithm's off-diagonal part is below this, and its square below rounding.
_OFF_DIAGONAL = 5e-8
# While the off-diagonal part is above this, errors of the decomposition itself do not matter yet.
_NEAR = 1e-2
# A turn times the condition must stay below a tenth to resolve small eigenvalues beside large ones.
_TURN = 10 * _OFF_DIAGONAL
# Below this ratio of eigenvalues the eigenvectors of small ones are lost in B B^T, though not in the SVD of B.
_RATIO = 1e-7
_SWEEPS = 30  # of Jacobi rotations; five or six suffice for all matrices
_ORTHOGONAL = 1e-16  # cosine of two columns


class View(NamedTuple):
    """B sets of N matrices relative to trial means T, B_i = T^-1 A_i."""

    logarithm: FloatArray  # (B, n, n), the weighted mean of ln(B_i B_i^T)
    distances: FloatArray  # (B, N), Dist_F(B_i)^2
    cost: FloatArray  # (B,), their weighted mean
    cosh: FloatArray  # (B,), the mean of cosh r, r the logarithm of the condition of B_i
    bend: FloatArray  # (B,), the mean of r coth r, which bounds the Hessian


class LapackSets:
    """Sets of matrices of any size, by LAPACK.

    Eigenvectors are kept, as after a small move first-order perturbation gives the logarithm at a third of the cost.
    """

    def __init__(self, A: FloatArray, w: FloatArray, T: FloatArray) -> None:
        self.T, self._w, self._pieces = T, w, pieces(A)
        # B_i^T and U_i^T, so that multiplication by a common factor is one flat product.
        self._rows, self._basis, self._excess = np.empty_like(A), np.empty_like(A), np.empty_like(A)
        for part in self._pieces:
            self._rows[:, part] = transposed(_whitened_values(T, A[:, part]))
        # A bound of the logarithm's off-diagonal part, and its growth per move.
        self._off_diagonal, self._gain = np.inf, 1.0

    def move(self, V: FloatArray) -> None:
        """Move along the geodesic of the symmetric V, shape (B, n, n): T becomes T exp(V / 2)."""
        there, back = symmetric_exp(0.5 * V)
        self.T = self.T @ there
        for part in self._pieces:
            self._rows[:, part] = _each(self._rows[:, part], back)
        self._off_diagonal += float(np.sqrt(dot(V, V)).max()) * self._gain

    def look(self) -> View:
        """The view relative to T."""
        b, count, n, _ = self._rows.shape
        mean, sums, distances = np.zeros((b, n, n)), np.zeros((3, b)), np.empty((b, count))
        stale, far = self._off_diagonal > _OFF_DIAGONAL, self._off_diagonal > _NEAR
        if stale:
            self._off_diagonal = 0.0
        self._gain = 1.0
        for part in self._pieces:
            rows, basis, w = self._rows[:, part], self._basis[:, part], self._w[:, part]
            if stale:
                values = _decompose(rows, basis)
            if far:
                half = 0.5 * np.log(values)
                q, r = _ratios(half)
                distances[:, part] = np.einsum("bik,bik->bi", half, half)
                mean += _gather(basis, (2.0 * w[..., None] * half)[..., None] * basis)
            else:
                log, half, (q, r) = _perturbed_log(rows, basis)
                distances[:, part] = 0.25 * np.einsum("bikl,bikl->bi", log, log)
                log *= w[:, :, None, None]
                mean += _gather(basis, log @ basis)
            q *= q
            q += 1.0
            r *= q
            bends = r  # r coth r
            bend, cosh = bends[..., 0, -1], np.cosh(half[..., -1] - half[..., 0])
            sums += [np.einsum("bi,bi->b", w, term) for term in (distances[:, part], cosh, bend)]
            self._gain = max(self._gain, float(bend.max()), _TURN * float(cosh.max()))
            bends -= 1.0
            np.multiply(bends, w[:, :, None, None], out=self._excess[:, part])
        return View(0.5 * (mean + transposed(mean)), distances, *sums)

    def newton_step(self, logarithm: FloatArray) -> FloatArray:
        """The symmetric V, shape (B, n, n), that the Hessian of the latest view maps to `logarithm`."""
        # For n > 4 it is found by conjugate gradients, to an error below the square of the step, Newton's own error.
        b, n, _ = logarithm.shape
        if n <= _WHOLE:
            hessian = np.zeros((b, n * n, n * n))
            for part in self._pieces:
                U = self._basis[:, part]
                products = (U[:, :, :, None, :, None] * U[:, :, None, :, None, :]).reshape(b, -1, n * n)
                hessian += transposed(products * self._excess[:, part].reshape(b, -1, 1)) @ products
            V = np.linalg.solve(np.eye(n * n) + hessian, logarithm.reshape(b, -1, 1))
            return np.asarray(V, dtype=float).reshape(b, n, n)
        size = np.sqrt(dot(logarithm, logarithm))
        goal = np.maximum(size * np.minimum(0.1 * size, 0.03), 0.5 * EPS * n)
        V, residual = np.zeros_like(logarithm), logarithm.copy()
        direction, square = residual.copy(), size * size
        for _ in range(n**2):
            active = np.sqrt(square) > goal
            if not active.any():
                break
            image = self._hessian(direction)
            length = np.where(active, square / np.where(active, dot(direction, image), 1.0), 0.0)[:, None, None]
            V += length * direction
            residual -= length * image
            square, previous = dot(residual, residual), square
            direction *= np.where(active, square / np.where(active, previous, 1.0), 0.0)[:, None, None]
            direction += residual
        return np.asarray(V, dtype=float)

    def _hessian(self, V: FloatArray) -> FloatArray:
        """The image of V under the Hessian."""
        image = V.copy()
        for part in self._pieces:
            basis = self._basis[:, part]
            inside = _each(basis, V) @ transposed(basis)
            inside *= self._excess[:, part]
            image += _gather(basis, inside @ basis)
        return image


class JacobiSet:
    """One set of many small matrices: one-sided Jacobi rotations of all of them at once (Hestenes 1958).

    Rotations from the right make the columns of each B_i orthogonal, so that they are the eigenvectors times the
    singular values. The columns are kept, so that one sweep suffices after a small move. The last axis of arrays is
    that of the matrices.
    """

    def __init__(self, A: FloatArray, w: FloatArray, T: FloatArray) -> None:
        self.T, self._w, self._pieces = T, w[0], pieces(A)
        self._columns = np.empty((*A.shape[2:], A.shape[1]))
        for part in self._pieces:
            self._columns[:, :, part] = np.moveaxis(_whitened_values(T, A[:, part])[0], 0, -1)

    def move(self, V: FloatArray) -> None:
        """Move along the geodesic of the symmetric V, shape (B, n, n): T becomes T exp(V / 2)."""
        there, back = symmetric_exp(0.5 * V)
        self.T = self.T @ there
        for part in self._pieces:
            self._columns[:, :, part] = np.tensordot(back[0], self._columns[:, :, part], 1)

    def look(self) -> View:
        """The view relative to T."""
        n, _, count = self._columns.shape
        mean, sums, distances = np.zeros((n, n)), np.zeros((3, 1)), np.empty((1, count))
        first, second = np.triu_indices(n, 1)
        self._hessian = np.eye(n * (n + 1) // 2)
        for part in self._pieces:
            w, U = self._w[part], self._columns[:, :, part].copy()
            _orthogonalize(U)
            self._columns[:, :, part] = U
            squares = np.einsum("ikm,ikm->km", U, U)
            U /= np.sqrt(squares)
            half = 0.5 * np.log(squares)
            mean += (U * (2.0 * w * half)).reshape(n, -1) @ U.reshape(n, -1).T
            r = np.abs(half[first] - half[second])
            bends = bend(r)
            distances[0, part] = np.einsum("km,km->m", half, half)
            terms = (distances[0, part], np.cosh(r.max(axis=0)), bends.max(axis=0))
            sums[:, 0] += [np.einsum("m,m->", w, term) for term in terms]
            roots = np.sqrt(np.maximum(bends - 1.0, 0.0) * w)
            pairs = zip(first, second, roots, strict=True)
            products = np.concatenate([_symmetric_products(U[:, p] * root, U[:, q]) for p, q, root in pairs], axis=1)
            self._hessian += products @ products.T
        return View(0.5 * (mean + mean.T)[None], distances, *sums)

    def newton_step(self, logarithm: FloatArray) -> FloatArray:
        """The V that the Hessian maps to `logarithm`."""
        i, j = np.triu_indices(logarithm.shape[-1])
        root = np.where(i == j, 1.0, np.sqrt(2.0))
        V = np.empty_like(logarithm)
        V[0, i, j] = V[0, j, i] = np.linalg.solve(self._hessian, logarithm[0, i, j] * root) / root
        return V


AnySets = LapackSets | JacobiSet


def logarithms(B: FloatArray) -> tuple[FloatArray, FloatArray]:
    """ln(B B^T), (N, n, n), for n = 2 in closed form, and the logarithm of the condition of B, (N,)."""
    if B.shape[-1] == 2:
        a, b, c, d = B[:, 0, 0], B[:, 0, 1], B[:, 1, 0], B[:, 1, 1]
        det = np.abs(a * d - b * c)
        p, q = 0.5 * (a * a + b * b - c * c - d * d) / det, (a * c + b * d) / det
        sinh = np.hypot(p, q)
        r = np.arcsinh(sinh)
        factor = np.divide(r, sinh, out=np.ones_like(sinh), where=sinh > 1e-150)
        v, p, q = np.log(det), p * factor, q * factor
        return np.stack([v + p, q, q, v - p], axis=-1).reshape(-1, 2, 2), r
    U, scales, _ = np.linalg.svd(B)
    half = np.log(scales)
    return (U * (2.0 * half)[:, None, :]) @ transposed(U), half[:, 0] - half[:, -1]


def bend(r: FloatArray) -> FloatArray:
    """r coth r."""
    r = np.maximum(r, _SAME)
    return np.asarray(r / np.tanh(r))


def row_condition(T: FloatArray) -> FloatArray:
    """|T^-1| |T|, (...): the condition of T (..., n, n), invariant under scaling of rows."""
    return np.asarray((np.abs(np.linalg.inv(T)) @ np.abs(T)).max(axis=(-1, -2)))


def pieces(A: FloatArray) -> list[slice]:
    """Slices of the second axis of matrices (B, N, n, n) that fit into the cache."""
    b, count, n, _ = A.shape
    step = max(1, _CHUNK // (b * n * n))
    return [slice(start, start + step) for start in range(0, count, step)]


def _whitened_values(T: FloatArray, A: FloatArray) -> FloatArray:
    """T^-1 A_i for A of shape (B, M, n, n)."""
    # With rows and columns reversed, a lower triangular T is its own upper LU factor: all A_i then share no error.
    b, count, n, _ = A.shape
    columns = A.swapaxes(1, 2)[:, ::-1].reshape(b, n, -1)
    found = np.asarray(np.linalg.solve(T[:, ::-1, ::-1], columns), dtype=float)
    return found[:, ::-1].reshape(b, n, count, n).swapaxes(1, 2)


def _each(stack: FloatArray, M: FloatArray) -> FloatArray:
    """stack[b, i] @ M[b] as one product for each b."""
    return np.asarray(stack.reshape(len(M), -1, M.shape[-1]) @ M).reshape(stack.shape)


def _gather(basis: FloatArray, products: FloatArray) -> FloatArray:
    """The sum over i of U_i X_i, for rows U_i^T and products X_i of shape (B, N, n, n)."""
    b, n = basis.shape[0], basis.shape[-1]
    return np.asarray(transposed(basis.reshape(b, -1, n)) @ products.reshape(b, -1, n))


def dot(X: FloatArray, Y: FloatArray) -> FloatArray:
    """The inner products (b,) of matrices (b, n, n)."""
    return np.asarray(np.einsum("bij,bij->b", X, Y))


def _decompose(rows: FloatArray, basis: FloatArray) -> FloatArray:
    """The eigenvalues of B B^T, ascending; writes its eigenvectors as rows into `basis`."""
    values, U = np.linalg.eigh(transposed(rows) @ rows)
    basis[...] = transposed(U)
    poor = ~(values[..., 0] > _RATIO * values[..., -1])
    if poor.any():
        _, scales, V = np.linalg.svd(rows[poor])
        values[poor], basis[poor] = scales[:, ::-1] ** 2, V[:, ::-1]
    return np.asarray(values)


def _ratios(half: FloatArray) -> tuple[FloatArray, FloatArray]:
    """q = e^-r and r / (1 - e^-2r) for all pairs of half logarithms, of which r coth r and r / sinh r are made."""
    r = half[..., :, None] - half[..., None, :]
    np.abs(r, out=r)
    q = np.exp(-r)
    np.maximum(r, _SAME, out=r)
    square = q * q
    np.subtract(1.0, square, out=square)
    r /= np.maximum(square, 2.0 * _SAME, out=square)
    return q, r


def _perturbed_log(rows: FloatArray, basis: FloatArray) -> tuple[FloatArray, FloatArray, tuple[FloatArray, FloatArray]]:
    """ln(B B^T) in a basis that nearly diagonalises it, half its diagonal, and `_ratios` of that."""
    parts = rows @ transposed(basis)
    log = transposed(parts) @ parts
    squares = np.einsum("...kk->...k", log).copy()
    scale = 1.0 / np.sqrt(squares)
    log *= scale[..., :, None]
    log *= scale[..., None, :]
    # A slight turn towards the vector of a far larger eigenvalue adds an error to a small square.
    own = 1.0 - np.einsum("...kl,...kl,kl->...k", log, log, 1.0 - np.tri(basis.shape[-1]))
    half = np.asarray(0.5 * np.log(squares * own))
    scale = 1.0 / np.sqrt(own)
    log *= scale[..., :, None]
    log *= scale[..., None, :]
    # Off the diagonal first order gives the logarithm's divided difference, r / sinh r over the root of both squares.
    q, r = _ratios(half)
    log *= q
    log *= r
    log += log
    np.einsum("...kk->...k", log)[...] = 2.0 * half
    return np.asarray(log), half, (q, r)


def _orthogonalize(B: FloatArray) -> None:
    """Rotate the columns of matrices of shape (n, n, M), in place, until they are orthogonal."""
    n = len(B)
    for _ in range(_SWEEPS):
        squares = np.einsum("ikm,ikm->km", B, B)
        angle = cosine = 0.0
        for p in range(n - 1):
            for q in range(p + 1, n):
                x, y = B[:, p], B[:, q]
                product = np.einsum("im,im->m", x, y)
                cosine = max(cosine, float(np.max(product * product / (squares[p] * squares[q]))))
                # The tangent of the smaller of the two angles that make the columns orthogonal.
                gap = squares[q] - squares[p]
                product += product
                tangent = product / (gap + np.copysign(np.sqrt(gap * gap + product * product) + 1e-300, gap))
                angle = max(angle, float(np.max(tangent * tangent)))
                product *= tangent
                product *= 0.5
                squares[p] -= product
                squares[q] += product
                cos = 1.0 / np.sqrt(1.0 + tangent * tangent)
                sin = cos * tangent
                turned = cos * x
                turned -= sin * y
                y *= cos
                y += sin * x
                x[...] = turned
        # The effect of a rotation on the other cosines is negligible, except for nearly equal singular values.
        if cosine * angle < _ORTHOGONAL**2:
            return


def _symmetric_products(x: FloatArray, y: FloatArray) -> FloatArray:
    """(x y^T + y x^T) / sqrt 2 in the n (n + 1) / 2 orthonormal coordinates of symmetric matrices, shape (.., M)."""
    pairs = zip(*np.triu_indices(len(x)), strict=True)
    return np.stack([np.sqrt(2.0) * x[i] * y[i] if i == j else x[i] * y[j] + x[j] * y[i] for i, j in pairs])
