"""Point clouds without known partners: projdist's ICP against pycpd's affine coherent point drift, on known truth.

    python -m pip install 'projdist[benchmark]'; python benchmarks/clouds.py [SETS]

Each set is a cloud of points and an affine image of it, turned by up to so many degrees, in any order, with normal
errors, a part of its points missing on either side, and as many that are nowhere in the other; of some sets half of the
points have a hundredth of these errors. A set is found where
the RMS distance of the true partners, in the coordinates of the first cloud, is below three times that of the errors.
"""

import sys
import time

import numpy as np

from projdist.applications.pointclouds import register

KINDS = {
    "2-D": {"n": 2, "turn": 30.0, "noise": 0.01, "missing": 0.0, "outliers": 0.0},
    "2-D, turned by up to 180": {"n": 2, "turn": 180.0, "noise": 0.01, "missing": 0.0, "outliers": 0.0},
    "2-D, a tenth missing": {"n": 2, "turn": 30.0, "noise": 0.01, "missing": 0.1, "outliers": 0.0},
    "2-D, a tenth outliers": {"n": 2, "turn": 30.0, "noise": 0.01, "missing": 0.0, "outliers": 0.1},
    "2-D, noise .03, both": {"n": 2, "turn": 30.0, "noise": 0.03, "missing": 0.1, "outliers": 0.1},
    "3-D": {"n": 3, "turn": 30.0, "noise": 0.01, "missing": 0.0, "outliers": 0.0},
    "3-D, turned by up to 180": {"n": 3, "turn": 180.0, "noise": 0.01, "missing": 0.0, "outliers": 0.0},
    "3-D, both": {"n": 3, "turn": 30.0, "noise": 0.03, "missing": 0.1, "outliers": 0.1},
    "3-D, both, turned by up to 180": {"n": 3, "turn": 180.0, "noise": 0.03, "missing": 0.1, "outliers": 0.1},
    "2-D, half nearly exact": {"n": 2, "turn": 180.0, "noise": 0.1, "missing": 0.0, "outliers": 0.0, "exact": 0.5},
    "2-D, half nearly exact, both": {
        "n": 2,
        "turn": 180.0,
        "noise": 0.1,
        "missing": 0.1,
        "outliers": 0.1,
        "exact": 0.5,
    },
    "3-D, half nearly exact, both": {
        "n": 3,
        "turn": 180.0,
        "noise": 0.1,
        "missing": 0.1,
        "outliers": 0.1,
        "exact": 0.5,
    },
    "5-D": {"n": 5, "turn": 30.0, "noise": 0.01, "missing": 0.0, "outliers": 0.0},
    "5-D, both": {"n": 5, "turn": 30.0, "noise": 0.03, "missing": 0.1, "outliers": 0.1},
}
POINTS = 100


def rotation(rng, n, degrees):
    """A turn in a random plane by at most so many degrees."""
    basis = np.linalg.qr(rng.normal(size=(n, n)))[0]
    angle = np.radians(rng.uniform(-degrees, degrees))
    turn = np.eye(n)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return basis @ turn @ basis.T


def made(rng, *, n, turn, noise, missing, outliers, exact=0.0):
    """Two clouds, and which rows of the second are the partners of which of the first."""
    base = rng.uniform(-1.0, 1.0, size=(POINTS, n)) * np.linspace(1.0, 0.7, n)
    A = rotation(rng, n, turn) @ (np.eye(n) + 0.15 * rng.normal(size=(n, n)))
    lost, strange = int(missing * POINTS), int(outliers * POINTS)
    errors = np.where(np.arange(POINTS) < exact * POINTS, 0.01 * noise, noise)[:, None]
    keep = [rng.permutation(POINTS)[lost:] for _ in range(2)]
    clouds = [
        np.concatenate(
            [base[rows] + errors[rows] * rng.normal(size=(len(rows), n)), rng.uniform(-1.2, 1.2, size=(strange, n))]
        )
        for rows in keep
    ]
    both = np.intersect1d(*keep)
    pairs = [np.array([int(np.flatnonzero(rows == k)[0]) for k in both]) for rows in keep]
    return clouds[0], clouds[1] @ A.T + rng.normal(size=n), pairs


def by_icp(first, second):
    """The second cloud in the coordinates of the first."""
    return register([first, second], correspond="icp", frame="first").aligned[1]


def by_cpd(first, second):
    """The same by pycpd."""
    from pycpd import AffineRegistration

    return AffineRegistration(X=first, Y=second, w=0.1, max_iterations=300, tolerance=1e-8).register()[0]


def main():
    """A line a kind."""
    sets = int(sys.argv[1]) if len(sys.argv) > 1 else 30
    print(f"{sets} sets of {POINTS} points each; seconds of processor time a set")
    for name, kind in KINDS.items():
        found, spent = {}, {}
        for method in (by_icp, by_cpd):
            rng, hits, start = np.random.default_rng(1), 0, time.process_time()
            for _ in range(sets):
                first, second, (k, m) = made(rng, **kind)
                try:
                    moved = method(first, second)
                    error = float(np.sqrt(np.mean(np.sum((moved[m] - first[k]) ** 2, axis=1))))
                except ValueError:
                    error = np.inf
                hits += error < 3.0 * kind["noise"] * np.sqrt(kind["n"])
            found[method], spent[method] = hits, (time.process_time() - start) / sets
        told = [f"{label} {found[one]} found, {spent[one]:.3f} s" for label, one in (("ICP", by_icp), ("CPD", by_cpd))]
        print(f"{name:30} {'; '.join(told)}")


if __name__ == "__main__":
    main()
