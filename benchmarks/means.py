"""mdt against pyRiemann's mean_riemann, in one process, as a Markdown table: `python benchmarks/means.py [n ...]`.

The truth is by construction: A_i = G exp(V_i / 2) Q_i, where the weighted sum of the symmetric V_i is 0 and Q_i is
orthogonal, has the mean G G^T. The V_i are skewed, so that no symmetry helps either side. An error is the Fisher
distance from G G^T, and holds the rounding of the A_i themselves.
"""

import os

# One BLAS thread for both sides: two threads on matrices this small spend their time on waiting for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")

import math
import statistics
import sys
import time
import warnings
from collections.abc import Callable

import numpy as np
from pyriemann.geometry.mean import mean_riemann

from projdist import mdt
from projdist.spd import factor_distance

RUNS, TURN = 7, 0.02
CASES = {
    2: (10, 10**4, 10**5, 10**6),
    3: (10, 1000, 10**5),
    4: (10**4,),
    8: (1000,),
    16: (400,),
    32: (200,),
    64: (100,),
}
SPREADS = (0.5, 1.0, 2.0)  # of the entries of V; the condition of G G^T is 100
WIDE = (
    (2, 1000, 4.0),
    (3, 1000, 4.0),
    (8, 200, 4.0),
    (8, 200, 6.0),
    (32, 100, 5.0),
)  # some A_i of conditions 1e7 to 1e10


def known_mean(rng: np.random.Generator, n: int, count: int, spread: float) -> tuple[np.ndarray, np.ndarray]:
    """Matrices A of shape (count, n, n) and G."""
    V = rng.normal(size=(count, n, n)) * rng.uniform(0.2, 1.5, size=(count, 1, 1))
    values, U = np.linalg.eigh(V + np.swapaxes(V, 1, 2))
    values *= np.where(values > 0, 0.75, 0.25) * spread / math.sqrt(max(n, 3) / 3)
    V = (U * values[:, None, :]) @ np.swapaxes(U, 1, 2)
    V -= V.mean(axis=0)
    values, U = np.linalg.eigh(V)
    S = (U * np.exp(values / 2)[:, None, :]) @ np.swapaxes(U, 1, 2)
    turn, back = np.linalg.qr(rng.normal(size=(2, n, n)))[0]
    G = turn @ np.diag(np.geomspace(10**0.5, 10**-0.5, n)) @ back
    return G @ S @ np.linalg.qr(rng.normal(size=(count, n, n)))[0], G


def alternating(*functions: Callable[[], object]) -> list[float]:
    """Median seconds of a call of each function, run in turn; a turn is as many calls as fill 20 ms."""
    times: list[list[float]] = [[] for _ in functions]
    calls = [1] * len(functions)
    begin = time.perf_counter()
    for k in range(RUNS + 1):
        for i, function in enumerate(functions):
            start = time.perf_counter()
            for _ in range(calls[i]):
                function()
            seconds = (time.perf_counter() - start) / calls[i]
            calls[i] = max(1, round(TURN / seconds))
            times[i].append(seconds)
        if k >= 2 and time.perf_counter() - begin > 10:
            break
    return [statistics.median(seconds[1:]) for seconds in times]  # the first call warms up


def theirs(P: np.ndarray, tol: float) -> tuple[Callable[[], np.ndarray], str, np.ndarray | None]:
    """A call of mean_riemann, what it said, and its mean; none where it fails."""

    def call() -> np.ndarray:
        return mean_riemann(P, tol=tol, maxiter=200)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            return call, "not converged" if caught else "", call()
        except ValueError:
            return call, "diverges", None


def row(rng: np.random.Generator, n: int, count: int, spread: float) -> None:
    A, G = known_mean(rng, n, count, spread)
    P = A @ np.swapaxes(A, 1, 2)
    error = factor_distance(G, mdt(A).T)
    call, said, mean = theirs(P, 1e-8)
    if mean is None:
        (ours,) = alternating(lambda: mdt(A))
        cells = [said, "", ""]
    else:
        ours, usual = alternating(lambda: mdt(A), call)
        cells = [f"{1e3 * usual:.3g}", f"{factor_distance(G, np.linalg.cholesky(mean)):.0e}", f"{usual / ours:.1f}"]
    print(f"| {n} | {count:,} | {spread} | {1e3 * ours:.3g} | {error:.0e} | {' | '.join(cells)} |", flush=True)


def main(sizes: list[int]) -> None:
    columns = ("n", "N", "spread", "mdt ms", "its error", "mean_riemann ms", "its error", "ratio of times")
    print(f"### Frechet means\n\n| {' | '.join(columns)} |\n|{' --- |' * len(columns)}")
    rng = np.random.default_rng(1)
    for n in sizes:
        for count in CASES[n]:
            for spread in SPREADS:
                row(rng, n, count, spread)
        for size, count, spread in WIDE:
            if size == n:
                row(rng, n, count, spread)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main([int(text) for text in sys.argv[1:]] or list(CASES))
