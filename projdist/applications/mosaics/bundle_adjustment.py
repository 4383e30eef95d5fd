"""Bundle adjustment of maps of images, maps of pairs by RANSAC, and the comparison of models."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.applications.mosaics.homographies import ENTRIES, LEAST, MODELS, fit, homogeneous

_MOST_STEPS = 200  # 5 to 10 suffice
_CONVERGED = 1e-13  # step in units of half an image: rounding
_DAMPING, _WEAKEST, _STRONGEST = 1e-4, 1e-8, 1e8


class Link(NamedTuple):
    """Images i and j and their common points xi and xj, (n, 2), found in images reduced by a factor."""

    i: int
    j: int
    xi: FloatArray
    xj: FloatArray
    reduction: float = 1.0

    def chosen(self, some: BoolArray) -> Link:
        """The link with some of its points."""
        return self._replace(xi=self.xi[some], xj=self.xj[some])


def transfer_errors(S: FloatArray, xi: FloatArray, xj: FloatArray) -> FloatArray:
    """The larger of the two transfer distances of pairs of points, (..., n), under maps S (..., 3, 3) from i to j."""
    return np.maximum(*transfers(S, xi, xj))


def transfers(S: FloatArray, xi: FloatArray, xj: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Transfer distances in image j and in image i; infinite for points behind the other image's horizon."""
    with np.errstate(all="ignore"):
        return _distances(S, xi, xj), _distances(np.asarray(np.linalg.inv(S)), xj, xi)


def _distances(S: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Distances (..., n) of S x from y; infinite behind the horizon."""
    z = np.einsum("...ij,nj->...ni", S, homogeneous(x))
    gap = np.hypot(*np.moveaxis(z[..., :2] / z[..., 2:] - y, -1, 0))
    return np.asarray(np.where((z[..., 2] > 0) & np.isfinite(gap), gap, np.inf))


@dataclass(frozen=True)
class Chart:
    """Changes of a model's maps but the first to M_i (I + E_i), by free entries of E_i; a base of charts with fewer."""

    model: str

    def reduced(self, M: FloatArray, normal: FloatArray, gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
        """J^T J and J^T r of the parameters, from those of the entries of all E_i, (N, k, N, k) and (N, k)."""
        size = gradient[1:].size
        return normal[1:, :, 1:].reshape(size, size), gradient[1:].reshape(size)

    def moved(self, M: FloatArray, step: FloatArray) -> FloatArray:
        """The maps after a step of the parameters."""
        E = np.tile(np.eye(3), (len(M), 1, 1))
        for number, (a, b) in enumerate(ENTRIES[self.model]):
            E[1:, a, b] += step.reshape(len(M) - 1, -1)[:, number]
        return M @ E


def adjust(chart: Chart, M: FloatArray, links: Sequence[Link]) -> tuple[FloatArray, float, FloatArray]:
    """Maps (N, 3, 3) of least symmetric transfer error near the start M, its RMS over the points, and J^T J."""
    # By the Levenberg-Marquardt method, to rounding; raises ValueError if the points do not determine the maps. Errors
    # depend only on M_j^-1 M_i, and M_i is changed from the right, so that errors and steps do not depend on the plane.
    # Sparse trust-region steps by conjugate gradients take ten times as long to 1e-9.
    errors, cost = _errors(M, links)
    damping = 0.0
    normal = np.zeros((0, 0))
    for _ in range(_MOST_STEPS):
        normal, gradient = chart.reduced(M, *_normal_equations(len(M), errors, ENTRIES[chart.model]))
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
            if new <= cost * (1.0 + 1e-13) or size < _CONVERGED or damping > _STRONGEST:
                break
            damping = max(10.0 * damping, _DAMPING)
        if not new <= cost * (1.0 + 1e-13):
            break
        M, errors, cost = tried, there, new
        if size < _CONVERGED:
            break
        damping = 0.1 * damping if damping > _WEAKEST else 0.0
    if not np.isfinite(cost):
        raise ValueError("Invalid correspondences. They do not determine the maps of the images.")
    return M, float(np.sqrt(cost / (2.0 * sum(len(link.xi) for link in links)))), normal


# A link in one direction: the images from and to, the map S, the points x, their images z, and the errors.
_Way = tuple[int, int, FloatArray, FloatArray, FloatArray, FloatArray]


def _errors(M: FloatArray, links: Sequence[Link]) -> tuple[list[_Way], float]:
    """Both directions of all links, and the sum of squared errors; infinite if a point is behind a horizon."""
    ways, cost = [], 0.0
    with np.errstate(all="ignore"):
        inverse = np.linalg.inv(M) if np.isfinite(M).all() else np.full_like(M, np.nan)
        for link in links:
            for a, b, x, y in ((link.i, link.j, link.xi, link.xj), (link.j, link.i, link.xj, link.xi)):
                S, x1 = inverse[b] @ M[a], homogeneous(x)
                z = x1 @ S.T
                error = z[:, :2] / z[:, 2:] - y
                ways.append((a, b, S, x1, z, error))
                cost += float(np.sum(error * error)) if (z[:, 2] > 0).all() else np.inf
    return ways, cost if np.isfinite(cost) else np.inf


def _normal_equations(
    count: int, ways: list[_Way], entries: Sequence[tuple[int, int]]
) -> tuple[FloatArray, FloatArray]:
    """J^T J (N, k, N, k) and J^T r (N, k) for the k entries of E_i of all N images."""
    wide = len(entries)
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


# ---- pairs ---------------------------------------------------------------------------------------

_BATCH, _BATCHES = 100, 40  # samples; if one point in five is right, one in 600 samples of four is
_SURE = 0.999  # probability of a sample without a wrong point
_ROUNDS = 20  # of refitting
_HOPELESS = 10.0  # tolerances: a linear fit with a larger median error is not refined, as no map fits all points
# Largest expected number of maps of random points, over all pairs, on which as many points agree as well
# (a contrario: L. Moisan & B. Stival 2004, "A probabilistic criterion to detect rigid point matches between two images
# and estimate the fundamental matrix", section 4; of homographies L. Moisan, P. Moulon & P. Monasse 2012, "Automatic
# homographic registration of a pair of images, with a contrario elimination of outliers").
_FALSE_ALARMS = 1e-3
_DISTINCT = 0.01  # of an image's side: points closer to each other in both images count once
_VAGUE = 0.2  # standard deviation above which a scale is unknown
_POINT = 1e-6  # spread of points that lie on a line to rounding
_LINE = "the points lie on a line"


class Pair(NamedTuple):
    """The map S from image i to image j and the points that agree on it, or the reason why there is no map."""

    agree: BoolArray
    S: FloatArray | None
    reason: str
    false_alarms: float = np.nan  # decimal logarithm of the expected number of chance maps as good; NaN if unknown


def estimate(xi: FloatArray, xj: FloatArray, model: str, tolerance: float, *, area: float, tests: int) -> Pair:
    """The map that takes most points xi (n, 2) to xj and back within the tolerance; coordinates are about 1 in size."""
    # If the fit to all points does not agree with all, maps through random minimal samples are tried (RANSAC, Fischler
    # & Bolles 1981), and the best is refitted to its points until these stay the same. A map no better than by chance,
    # in images of this `area` and so many pairs (`tests`), is refused unless all points agree and at most one is spare.
    least = LEAST[model]
    none = np.zeros(len(xi), dtype=bool)
    if len(xi) < least:
        return Pair(none, None, f"{len(xi)} points; it takes {least}")
    if _spread(xi, xj) <= _POINT:
        return Pair(none, None, _LINE)
    linear = fit(xi, xj, model)
    hopeful = _is_map(linear) and np.median(transfer_errors(linear, xi, xj)) < _HOPELESS * tolerance
    S = _refined(linear, xi, xj, np.ones(len(xi), dtype=bool), model) if hopeful else None
    agree = none if S is None else transfer_errors(S, xi, xj) <= tolerance
    if not agree.all():
        S, agree = _sampled(xi, xj, model, tolerance)
        for _ in range(_ROUNDS):
            S = None if S is None or agree.sum() < least else _refined(S, xi, xj, agree, model)
            before, agree = agree, none if S is None else transfer_errors(S, xi, xj) <= tolerance
            if (agree == before).all():
                break
    alarms = np.nan if S is None else _false_alarms(S, xi, xj, tolerance, area, least) + math.log10(tests)
    few = len(xi) <= least + 1 and agree.all()
    if not few and not alarms < math.log10(_FALSE_ALARMS):
        return Pair(none, None, f"{agree.sum()} of {len(xi)} points agree, no more than by chance", alarms)
    if S is not None:
        # The scale across the line that fits the points best must be known: its error is noise over spread.
        noise = np.sqrt(np.mean(transfer_errors(S, xi[agree], xj[agree]) ** 2))
        if _spread(xi[agree], xj[agree]) > max(noise / _VAGUE, _POINT):
            return Pair(agree, S, "", alarms)
    return Pair(none, None, _LINE, alarms)


def _false_alarms(S: FloatArray, xi: FloatArray, xj: FloatArray, tolerance: float, area: float, least: int) -> float:
    """Decimal logarithm of the number of false alarms of a map S, the least over all precisions up to the tolerance."""
    # With k of n points within e it is (n - p) C(n, k) C(k, p) (pi e^2 / area)^(k - p) for samples of p points.
    # Features at one place count once: of each cell of pairs of places only the smallest error counts.
    cells = np.floor(np.hstack([xi, xj]) / (_DISTINCT * math.sqrt(area)))
    numbers = np.unique(cells, axis=0, return_inverse=True)[1].reshape(-1)
    errors = np.full(numbers.max() + 1, np.inf)
    np.minimum.at(errors, numbers, transfer_errors(S, xi, xj))
    n, near = len(errors), np.sort(errors[errors <= tolerance])
    k = np.arange(least + 1, len(near) + 1)
    if not k.size:
        return math.inf
    # A point that fits to rounding is no infinite evidence.
    chance = np.minimum(np.pi * np.maximum(near[least:], _POINT) ** 2 / area, 1.0)
    logarithms = math.log(n - least) + _log_choices(n, k) + _log_choices(k, least) + (k - least) * np.log(chance)
    return float(logarithms.min()) / math.log(10.0)


def _log_choices(n: IntArray | int, k: IntArray | int) -> FloatArray:
    """Logarithms of binomial coefficients."""
    factorial = np.vectorize(lambda number: math.lgamma(number + 1), otypes=[float])
    return np.asarray(factorial(n) - factorial(k) - factorial(n - k))


def _is_map(S: FloatArray) -> bool:
    """True for a finite, invertible matrix."""
    return bool(np.isfinite(S).all() and np.linalg.det(S) != 0)


def _refined(S: FloatArray, xi: FloatArray, xj: FloatArray, agree: BoolArray, model: str) -> FloatArray | None:
    """The map with the least symmetric transfer error of the points `agree`; None if they do not determine it."""
    if not _is_map(S):
        return None
    try:
        # The plane is that of image j, which comes first.
        return adjust(Chart(model), np.stack([np.eye(3), S]), [Link(0, 1, xj[agree], xi[agree])])[0][1]
    except ValueError:
        return None


def _sampled(xi: FloatArray, xj: FloatArray, model: str, tolerance: float) -> tuple[FloatArray | None, BoolArray]:
    """The map through a random sample with which most points agree, and flags of these points."""
    # Every other batch is of affine maps: if one point in ten is right, samples of three are right ten times as often.
    rng, least = np.random.default_rng(0), LEAST[model]
    best, agreeing = None, np.zeros(len(xi), dtype=bool)
    for batch in range(1, _BATCHES + 1):
        kind = model if batch % 2 else "affine"
        chosen = np.argsort(rng.random((_BATCH, len(xi))), axis=1)[:, : LEAST[kind]]
        maps = fit(xi[chosen], xj[chosen], kind)
        maps = maps[np.isfinite(maps).all(axis=(1, 2))]
        maps = maps[np.linalg.det(maps) != 0]
        agree = transfer_errors(maps, xi, xj) <= tolerance
        count = agree.sum(axis=1)
        if len(maps) and count.max() > agreeing.sum():
            best, agreeing = maps[count.argmax()], agree[count.argmax()]
        if (1.0 - agreeing.mean() ** least) ** (batch * _BATCH) < 1.0 - _SURE:
            break
    return best, agreeing


def _spread(xi: FloatArray, xj: FloatArray) -> float:
    """Spread of the points about the line that fits them best, in the image where it is smaller."""
    return min(float(np.linalg.svd(x - x.mean(axis=0), compute_uv=False)[-1]) for x in (xi, xj))


# ---- models --------------------------------------------------------------------------------------

_NOISE = 0.05  # pixels of the image in which points were found: their best accuracy
_WRONG = 4.0  # limit of a squared error over the noise's: 2 per dimension, as in Torr


class ModelFit(NamedTuple):
    """The fit of a model to all pairs of images: the RMS of the symmetric transfer error in pixels, and the GRIC."""

    rms_pixels: float
    #: The geometric robust information criterion, smaller for better models: squared errors over the noise, and a
    #: penalty for parameters (P. H. S. Torr 1998, "Geometric motion segmentation and model selection", section 4).
    gric: float


def compare_models(pairs: Iterable[tuple[Link, BoolArray]], unit: float) -> dict[str, ModelFit]:
    """The fit of each model to the points of pairs, with a map for each pair; `unit` of the points in pixels."""
    # Flags mark points that agree on a map of either model. Homographies, which include affine maps, give the noise.
    squares, points, gric = dict.fromkeys(MODELS, 0.0), 0, dict.fromkeys(MODELS, 0.0)
    for link, agree in pairs:
        xi, xj = link.xi[agree], link.xj[agree]
        count = len(xi)
        if count <= LEAST["homography"]:
            continue
        maps = {model: _refined(fit(xi, xj, model), xi, xj, np.ones(count, dtype=bool), model) for model in MODELS}
        if any(S is None for S in maps.values()):
            continue
        errors = {model: np.square(transfers(S, xi, xj)).sum(axis=0) for model, S in maps.items() if S is not None}
        freedom = 2 * count - len(ENTRIES["homography"])
        noise = max(errors["homography"].sum() / (4.0 * freedom), (_NOISE * (link.reduction / unit)) ** 2)
        points += count
        for model, both in errors.items():
            squares[model] += float(both.sum())
            # If both points of a pair move to meet in the middle, each is off by half of the transfer error.
            gric[model] += float(np.minimum(both / (4.0 * noise), _WRONG).sum())
            gric[model] += len(ENTRIES[model]) * math.log(4.0 * count) + 2.0 * count * math.log(4.0)
    if not points:
        return {}
    return {model: ModelFit(unit * math.sqrt(squares[model] / (2.0 * points)), gric[model]) for model in MODELS}
