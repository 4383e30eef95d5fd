"""mdt against pyRiemann's mean_riemann, in one process, as Markdown tables: `python benchmarks/means.py [n ...]`.

The truth is by construction: A_i = G exp(V_i / 2) Q_i, where the weighted sum of the symmetric V_i is 0 and Q_i is
orthogonal, has the mean G G^T. The V_i are skewed, so that no symmetry helps either side. An error is the Fisher
distance from G G^T, and holds the rounding of the A_i themselves. mean_riemann has its default tolerance, 1e-8: at an
equal error it would take longer. Memory is the peak of what a call allocates, over the size of the A_i.
"""

import os

# One BLAS thread for both sides: two threads on matrices this small spend their time on waiting for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")

import math
import statistics
import sys
import time
import tracemalloc
import warnings
from collections.abc import Callable

import numpy as np
from pyriemann.geometry.mean import mean_riemann

from projdist import mdt
from projdist.matrices.spd import factor_distance

RUNS, TURN, LONGEST = 7, 0.02, 10.0
SMALL = 100_000  # bytes
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
WIDE = {2: ((1000, 4.0),), 3: ((1000, 4.0),), 8: ((200, 4.0), (200, 6.0)), 32: ((100, 5.0),)}
SETS = {2: (5000, 60), 3: (1000, 60)}  # means of so many sets of so many matrices, of spread 1


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
        if k >= 2 and time.perf_counter() - begin > LONGEST:
            break
    return [statistics.median(seconds[1:]) for seconds in times]  # the first call warms up


def peak_memory(function: Callable[[], object]) -> int:
    """Bytes that a call has allocated at most."""
    tracemalloc.start()
    function()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def theirs(P: np.ndarray) -> np.ndarray | None:
    """mean_riemann's mean; none where it diverges, so that it raises or has not come near in 200 steps."""
    with warnings.catch_warnings(), np.errstate(invalid="ignore"):
        warnings.simplefilter("error", UserWarning)
        try:
            return mean_riemann(P, maxiter=200)
        except (ValueError, UserWarning):
            return None


def measured(A: np.ndarray, G: np.ndarray) -> tuple[float, float, float, float, float]:
    """Seconds of mdt and its error, mean_riemann's error and its seconds over mdt's, mdt's memory over that of A."""
    P = A @ np.swapaxes(A, -1, -2)
    error, memory = factor_distance(G, mdt(A).T).max(), peak_memory(lambda: mdt(A)) / A.nbytes
    mean = theirs(P)
    if mean is None:
        return alternating(lambda: mdt(A))[0], error, math.nan, math.nan, memory
    ours, usual = alternating(lambda: mdt(A), lambda: mean_riemann(P, maxiter=200))
    return ours, error, factor_distance(G, np.linalg.cholesky(mean)).max(), usual / ours, memory


def table(title: str, *columns: str) -> None:
    print(f"\n### {title}\n\n| {' | '.join(columns)} |\n|{' --- |' * len(columns)}")


def span(values: list[float], form: str) -> str:
    texts = [format(value, form) for value in sorted(values)]
    return texts[0] if texts[0] == texts[-1] else f"{texts[0]} to {texts[-1]}"


def row(rng: np.random.Generator, n: int, count: int, spreads: tuple[float, ...]) -> None:
    """One line for all spreads: the errors are the largest."""
    sets = [known_mean(rng, n, count, spread) for spread in spreads]
    condition = max(np.linalg.cond(A[:10_000]).max() for A, _ in sets)
    ours, errors, usual, ratios, memory = (
        list(values) for values in zip(*(measured(*one) for one in sets), strict=True)
    )
    end = "diverges | " if math.isnan(usual[0]) else f"{max(usual):.0e} | {span(ratios, '.1f')}"
    cells = (n, f"{count:,}", f"{condition:.0e}", span([1e3 * t for t in ours], ".3g"), f"{max(errors):.0e}", end)
    # Of a small input the interpreter's own kilobytes are a large multiple.
    memory_cell = f"{max(memory):.1f}" if sets[0][0].nbytes > SMALL else ""
    print(f"| {' | '.join(map(str, cells))} | {memory_cell} |", flush=True)


def batch(rng: np.random.Generator, n: int, sets: int, count: int) -> None:
    made = [known_mean(rng, n, count, 1.0) for _ in range(sets)]
    A, G = (np.stack([one[k] for one in made]) for k in (0, 1))
    ours, error, usual, ratio, memory = measured(A, G)
    (loop,) = alternating(lambda: [mdt(A[k]) for k in range(100)])
    cells = (n, f"{sets:,} x {count}", f"{1e3 * ours:.3g}", f"{error:.0e}", f"{usual:.0e}", f"{ratio:.1f}")
    print(f"| {' | '.join(map(str, cells))} | {loop / 100 * sets / ours:.1f} | {memory:.1f} |", flush=True)


def main(sizes: list[int]) -> None:
    rng = np.random.default_rng(1)
    errors = ("mdt's error", "mean_riemann's", "its time over mdt's")
    table("One mean", "n", "N", "cond(A_i) up to", "mdt ms", *errors, "memory over input")
    for n in sizes:
        for count in CASES[n]:
            row(rng, n, count, SPREADS)
        for count, spread in WIDE.get(n, ()):
            row(rng, n, count, (spread,))
    table("Means of many sets", "n", "sets x N", "mdt ms", *errors, "a loop's time over mdt's", "memory over input")
    for n in sizes:
        if n in SETS:
            batch(rng, n, *SETS[n])


if __name__ == "__main__":
    main([int(text) for text in sys.argv[1:]] or list(CASES))
