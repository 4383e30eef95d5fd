"""The search for the best member of a family of projections over a region, and the objectives that it minimises.

Maps are differentiated at fixed nodes of the region. A lattice over the free parameters and descents from its best
points find the optimum, with the best uniform scale at every step, in closed form where there is one.

An objective takes Jacobians at nodes and weights that sum to 1. Multiplying a map by c multiplies the principal
scales a >= b. The best c is:

- Airy-Kavrayskiy, areas: exp(-mean ln(ab) / 2), because ln c adds to ln a and ln b (a plain mean).
- Airy: sum w (a + b) / sum w (a^2 + b^2), a linear least-squares problem.
- largest |scale - 1|: 2 / (max a + min b), the arithmetic middle, and so for areas; largest |ln scale|:
  1 / sqrt(max a min b), the geometric middle.
- mean |scale - 1|: a weighted quantile of 2 / (a + b), where one straight part of the sum meets the next; for areas
  of 1 / ab. Its RMS: the minimum of a parabola, or where one parabola meets the next.
- angles: any, as they do not depend on the scale.

For other figures, also those of users, ln c is found by a search.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from projdist import earth, numerics, projections, regions
from projdist._typing import BoolArray, FloatArray
from projdist.decisions.families import Family, ellipsoid_text
from projdist.field import FIGURES, Figure, Nodes, nodes_of
from projdist.matrices import MEASURES, Measure, mdt, principal_scales

Scales = Callable[[FloatArray, FloatArray, FloatArray], float]
Terms = Callable[[FloatArray, FloatArray], FloatArray]
Extremes = Callable[[FloatArray, FloatArray, bool], FloatArray]

_REACH = 3.0  # of ln c to either side of the geometric mean


@dataclass(frozen=True)
class Objective:
    """A figure to minimise."""

    figure: Figure

    def scale(self, J: FloatArray, w: FloatArray) -> float:
        """The best uniform scale of Jacobians (n, 2, 2) with weights (n,) that sum to 1."""
        a, b = _scales(J)
        closed = _BEST_SCALES.get(self.figure.essence)
        if closed is not None:
            return closed(a, b, w)
        middle = np.log(_log_middle(a, b, w))
        best = numerics.least_between(lambda x: self.figure(np.exp(x) * J, w), middle - _REACH, middle + _REACH)
        return float(np.exp(best))

    def terms(self, J: FloatArray, w: FloatArray, c: float) -> FloatArray:
        """Terms of a map times c; the criterion is their norm, their sum of squares (for a mean), or their maximum."""
        if self.figure.version == "affine":
            J, c = np.linalg.inv(mdt(J[w > 0], w[w > 0]).T) @ J, 1.0
        if self.figure.version == "scaled" and w.any():
            c = _log_middle(*_scales(J), w)
        if (smooth := _SMOOTH.get(self.figure.measure)) and self.figure.statistic == "rms":
            return (np.sqrt(w) * smooth(*_scales(c * J))).ravel()
        values = self.figure.measure(c * J)
        if self.figure.is_maximum:
            return values
        return np.sqrt(w) * (np.sqrt(np.maximum(values, 0.0)) if self.figure.statistic == "mean" else values)

    def extremes(self, J: FloatArray, w: FloatArray, free: bool) -> FloatArray:
        """Terms (groups, n) that are smooth in the parameters; the maxima of the groups add up to the figure."""
        closed = _EXTREMES.get(self.figure.essence)
        if closed is not None:
            return closed(*_scales(J), free)
        defined = np.isfinite(J).all(axis=(1, 2))
        c = self.scale(J[defined], w[defined]) if free and defined.any() else 1.0
        return self.figure.measure(c * J)[None]

    def value(self, terms: FloatArray) -> float:
        """The criterion, from its terms."""
        if self.figure.is_maximum:
            return float(terms.max())
        square = float(np.sum(terms * terms))
        return square if self.figure.statistic == "mean" else square**0.5


def _scales(J: FloatArray) -> tuple[FloatArray, FloatArray]:
    a, b = np.moveaxis(principal_scales(J), -1, 0)
    return a, b


# ---- best scales ----------------------------------------------------------------------------


def _log_middle(a: FloatArray, b: FloatArray, w: FloatArray) -> float:
    """The scale that makes the mean of ln(ab) vanish."""
    return float(np.exp(-0.5 * np.sum(w * np.log(a * b)) / np.sum(w)))


def _turning_point(places: FloatArray, steps: FloatArray, until: float) -> float:
    """The place up to which steps, sorted by their places, add up to a value."""
    order = np.argsort(places)
    sums = np.cumsum(steps[order])
    return float(places[order[min(int(np.searchsorted(sums, until)), order.size - 1)]])


def _scale_parabola(a: FloatArray, b: FloatArray, w: FloatArray) -> float:
    # The sum of max(c a - 1, 1 - c b)^2 is convex, and a parabola between any two of the places 2 / (a + b). Its
    # minimum is that of the first parabola whose minimum lies before its end, or the kink before that parabola.
    places = 2.0 / (a + b)
    order = np.argsort(places)
    a, b, w = a[order], b[order], w[order]
    first, second = (np.sum(w * b**n) + np.append(0.0, np.cumsum(w * (a**n - b**n))) for n in (1, 2))
    lowest, ends = first / second, np.append(places[order], np.inf)
    k = int(np.argmax(lowest <= ends))
    return float(lowest[k] if k == 0 else max(lowest[k], ends[k - 1]))


_OF_ANGLES = ("angular_distortion", "max_omega", "mean_omega", "isotropy", "kunimune_shape")
_BY_NAME: dict[str, Scales] = {
    **dict.fromkeys(("airy_kavrayskiy", "airy_kavrayskiy_scaled", "airy_kavrayskiy_affine"), _log_middle),
    **dict.fromkeys(("kavrayskiy", "klingatsch_angles", "klingatsch_areas", "log_areal_scale"), _log_middle),
    **dict.fromkeys(_OF_ANGLES, lambda a, b, w: 1.0),
    "airy": lambda a, b, w: float(np.sum(w * (a + b)) / np.sum(w * (a * a + b * b))),
    "max_scale_error_ppm": lambda a, b, w: float(2.0 / (a.max() + b.min())),
    # max(c a - 1, 1 - c b) falls with the slope -b up to c = 2 / (a + b), and rises with the slope a from there.
    "mean_scale_error_ppm": lambda a, b, w: _turning_point(2.0 / (a + b), w * (a + b), float(np.sum(w * b))),
    "rms_scale_error_ppm": _scale_parabola,
    "max_log_scale": lambda a, b, w: float(1.0 / np.sqrt(a.max() * b.min())),
    "max_areal_error_ppm": lambda a, b, w: float(np.sqrt(2.0 / ((a * b).max() + (a * b).min()))),
    "mean_areal_error_ppm": lambda a, b, w: float(
        np.sqrt(_turning_point(1.0 / (a * b), w * (a * b), 0.5 * float(np.sum(w * (a * b)))))
    ),
}
_BEST_SCALES = {FIGURES[name].essence: scale for name, scale in _BY_NAME.items()}


# ---- smooth terms of measures that are not smooth themselves ---------------------------------


def _fisher_terms(a: FloatArray, b: FloatArray) -> FloatArray:
    # ln^2 a + ln^2 b = (ln^2(ab) + ln^2(a/b)) / 2: smooth where a = b, unlike a and b themselves.
    return np.sqrt(0.5) * np.stack([np.log(a * b), np.log(a / b)])


def _scale_extremes(a: FloatArray, b: FloatArray, free: bool) -> FloatArray:
    # With a free scale half of ln(max a / min b) is left, or what grows with it.
    return _log_scale_extremes(a, b, free) if free else 1e6 * np.concatenate([a - 1.0, 1.0 - b])[None]


def _log_scale_extremes(a: FloatArray, b: FloatArray, free: bool) -> FloatArray:
    groups = np.stack([np.log(a), -np.log(b)])
    return groups if free else groups.reshape(1, -1)


_SMOOTH: dict[Measure, Terms] = {
    MEASURES["fisher"]: _fisher_terms,
    MEASURES["kavrayskiy"]: lambda a, b: np.sqrt(0.5) * _fisher_terms(a, b),
    MEASURES["airy"]: lambda a, b: 0.5 * np.stack([a + b - 2.0, a - b]),
}
_EXTREMES: dict[object, Extremes] = {
    FIGURES["max_scale_error_ppm"].essence: _scale_extremes,
    FIGURES["max_log_scale"].essence: _log_scale_extremes,
    FIGURES["max_areal_error_ppm"].essence: lambda a, b, free: _scale_extremes(a * b, a * b, free),
}


# ---- family search -------------------------------------------------------------------------------

DECIMALS = 7
"""Decimals of parameters in degrees that are not rounded otherwise: a centimetre."""

_COARSE, _FINE = 300, 2000  # nodes of the global search, and of the last descent
_ROUGHLY = 1.25  # a coarse search gives up a family that is so many times worse than the best of the others
_MOST_FREE = 6  # two more than any family has; nine take minutes, and the lattice over them has holes
_SOME, _QUANTILE = 5, 0.75  # members tried to find out whether a criterion vanishes, and the quantile that must
_LOST = {"": 10.0, "deg": 180.0, "ppm": 1e7}  # penalty by unit for points that the map does not show: distortion e^10
_OFF_THE_MAP, _NOTHING = 1e9, -1e3  # the penalty for maxima, in any unit; and a term that does not count
_SCALE_DECIMALS = 10  # finer than any criterion resolves
_FLAT, _FLAT_RANGE = 0.01, 0.25  # flat: the criterion grows by no more, over so much of a parameter's range
_WALK, _HALVINGS = 16, 12  # values tried to either side, then halvings: 1e-5 of the range
_ROUNDINGS = (0.01, 0.1, 0.5, 1.0, 5.0)  # degrees
_POLE = ("o_lat_p", "o_lon_p", "lon_0")
_SCALE = "k_0"


@dataclass(frozen=True)
class Rounded:
    """The best parameters that are multiples of `step` degrees, and their relative `loss` against the optimum."""

    step: float
    parameters: dict[str, float]
    value: float
    loss: float


class Flat(NamedTuple):
    """A parameter and the range in which the criterion is at most 1 % larger, other parameters unchanged."""

    name: str
    low: float
    high: float

    def __str__(self) -> str:
        """One sentence."""
        return f"The optimum is flat: with {self.name} from {self.low:.3g} to {self.high:.3g} it loses at most 1 %."


@dataclass(eq=False)
class Members:
    """The members of a family over a region, by the values of `variables`, the free parameters but for the scale."""

    family: Family
    region: regions.Place
    objective: Objective
    free: Sequence[str] | None = None  # by default the family's own
    ellipsoid: earth.Ellipsoid | None = None
    step: float | None = None  # of which angles that are not free are multiples

    def __post_init__(self) -> None:
        family, figure, ellipsoid, step = self.family, self.objective.figure, self.ellipsoid, self.step
        self.lost = _LOST.get(figure.unit, 1e7) ** (0.5 if figure.statistic == "mean" else 1.0)
        names = _free_names(family, self.free)
        if len(names) > _MOST_FREE:
            raise ValueError(f"Invalid free parameters '{','.join(names)}'. There must be at most {_MOST_FREE}.")
        self.variables = tuple(name for name in names if name not in (_SCALE, family.scale))
        self.frees_scale = len(self.variables) < len(names)
        self.scale_limits = family.limits.get(family.scale, (0.0, np.inf))
        self.low, self.high = (np.array([family.limits[name][side] for name in self.variables]) for side in (0, 1))
        fixed = {name: value for name, value in family.fixed.items() if name not in names}
        if step is not None:
            angles = {name: value for name, value in fixed.items() if name != family.scale}
            fixed |= {name: step * round(value / step) for name, value in angles.items()}
        self.fixed = {name: round(value, DECIMALS) for name, value in fixed.items()}
        text = family.text or f"+proj={family.name}"
        if not family.states_ellipsoid:
            text += f" {ellipsoid_text(ellipsoid or (earth.SPHERE if family.is_spherical else earth.WGS84))}"
        elif ellipsoid is not None:
            raise ValueError("Invalid ellipsoid. The PROJ string states its own.")
        # Anywhere in the box, except where two parallels coincide or are symmetric about the equator.
        some = self.low + (self.high - self.low) * np.mod(0.3 + 0.37 * np.arange(self.low.size), 1.0)
        words = " ".join(
            f"+{key}={projections.number_text(value)}" for key, value in self.parameters(self.named(some)).items()
        )
        self.base = projections.Projection.from_user_input(f"{text} {words}".strip())

    # ---- one member of the family

    def named(self, place: FloatArray) -> dict[str, float]:
        """Values of the free parameters except the scale, by name."""
        return dict(zip(self.variables, map(float, place), strict=True))

    def parameters(self, values: Mapping[str, float]) -> dict[str, float]:
        """All parameters except the scale, in their usual range."""
        return self.family.normalised(self.fixed | dict(values))

    def jacobian(self, values: Mapping[str, float], nodes: Nodes) -> tuple[FloatArray, FloatArray, float]:
        """Jacobians and weights at nodes where the map is smooth, and the share of the region that is not shown."""
        try:
            J, shown = nodes.jacobian(projections.with_parameters(self.base, self.parameters(values)))
        except projections.ProjectionError:
            J, shown = np.full((nodes.lon.size, 2, 2), np.nan), np.zeros(nodes.lon.size, dtype=bool)
        smooth = principal_scales(J)[:, 1] > 0
        w = np.where(smooth, nodes.weight, 0.0)
        if w.sum():
            w = w / w.sum()
        hidden = float(nodes.weight[~shown].sum())
        return np.where(smooth[:, None, None], J, np.nan), w, hidden

    def best_scale(self, J: FloatArray, w: FloatArray) -> float:
        """The best scale within its limits; criteria have one minimum in it."""
        if not self.frees_scale:
            return 1.0
        smooth = _is_smooth(J)
        best = self.objective.scale(J[smooth], w[smooth])
        return float(np.clip(best, *self.scale_limits))

    def terms(self, values: Mapping[str, float], nodes: Nodes) -> FloatArray:
        """Terms that the search minimises, as many for every member of the family."""
        J, w, hidden = self.jacobian(values, nodes)
        if self.objective.figure.is_maximum:
            groups = self.objective.extremes(J, w, self.frees_scale and self.scale_limits == (0.0, np.inf))
            # Maxima by group add up to the maximum; negligible where the map is torn.
            return np.where(np.isfinite(groups), groups, _NOTHING) + _OFF_THE_MAP * hidden
        c = self.best_scale(J, w) if w.any() else 1.0
        J = np.where(_is_smooth(J)[:, None, None], J, np.eye(2) / c)
        return np.append(self.objective.terms(J, w, c), self.lost * np.sqrt(hidden))

    def value(self, values: Mapping[str, float], nodes: Nodes) -> float:
        """Value of the criterion at the nodes, with the best scale."""
        J, w, hidden = self.jacobian(values, nodes)
        smooth = _is_smooth(J)
        if not smooth.any() or (self.objective.figure.is_maximum and hidden):
            return float("inf")
        J, w = J[smooth], w[smooth]
        terms = self.objective.terms(J, w, self.best_scale(J, w))
        return self.objective.value(np.append(terms, self.lost * np.sqrt(hidden)))

    def member(self, values: Mapping[str, float], scale: float) -> projections.Projection:
        """The projection; multiplied by the scale if the method has no parameter for it."""
        parameters = self.parameters(values)
        if self.family.scale and self.frees_scale:
            parameters[self.family.scale] = scale
        projection = projections.with_parameters(self.base, parameters)
        if self.family.scale or scale == 1.0:
            return projections.Projection.from_user_input(projection.definition)
        return projections.compose(projection, scale * np.eye(2), f"{projection.name}, scaled")

    # ---- the search

    def vanishes(self) -> bool:
        """True if the objective vanishes for the family: for a few members, at three quarters of the nodes."""
        # At the other nodes, next to poles and edges of maps, rounding is larger.
        figure = self.objective.figure
        if figure.aspect not in ("angles", "areas", ""):  # no family is without such a distortion
            return False
        nodes = nodes_of(self.region, self.base.ellipsoid, _COARSE)
        places = self.low + (self.high - self.low) * numerics.lattice(self.low.size, _SOME)
        return all(self._quantile(self.named(place), nodes) <= figure.rounding for place in places)

    def _quantile(self, values: Mapping[str, float], nodes: Nodes) -> float:
        """75th percentile of the objective's measure over the nodes; infinite if none is shown."""
        J, w, _ = self.jacobian(values, nodes)
        if not w.any():
            return float("inf")
        return float(np.quantile(np.abs(self.objective.figure.measure(self.best_scale(J, w) * J[w > 0])), _QUANTILE))

    def search(self, most: float = np.inf) -> tuple[dict[str, float], float, Nodes, int]:
        """Free parameters of the best member, its value at nodes, these nodes, and the number of evaluations."""
        # Raises ProjectionError for a family that shows no part of the region, or has about no value below `most`.
        edges = self.objective.figure.is_maximum
        coarse = nodes_of(self.region, self.base.ellipsoid, _COARSE, edges=edges)
        fine = nodes_of(self.region, self.base.ellipsoid, _FINE, edges=edges)
        first = numerics.minimise(self._terms_at(coarse), self.low, self.high, worst=edges, rough=True)
        start = self.named(first.place)
        if self.value(start, coarse) > _ROUGHLY * most:
            raise projections.ProjectionError(f"Invalid family '{self.family.name}'. Others are better.")
        best, least, evaluations = self.refine(start, fine)
        if not self.jacobian(best, fine)[1].any():
            raise projections.ProjectionError(
                f"Invalid family '{self.family.name}' for {self.region.name}. It shows no part of it."
            )
        return best, least, fine, first.evaluations + evaluations

    def refine(self, start: Mapping[str, float], nodes: Nodes) -> tuple[dict[str, float], float, int]:
        """Free parameters of the best member near a start, its value at nodes, and the number of evaluations."""
        place, worst = np.array([start[name] for name in self.variables]), self.objective.figure.is_maximum
        last = numerics.minimise(self._terms_at(nodes), self.low, self.high, worst=worst, start=place)
        best = self.named(last.place)
        return best, self.value(best, nodes), last.evaluations

    def _terms_at(self, nodes: Nodes) -> Callable[[FloatArray], FloatArray]:
        """The terms at nodes as a function of the values of `variables`."""
        return lambda place: self.terms(self.named(place), nodes)

    def written(self, values: Mapping[str, float], nodes: Nodes) -> tuple[dict[str, float], float]:
        """Free parameters rounded to `DECIMALS`, and the best scale for them."""
        chosen = {name: round(values[name], DECIMALS) for name in self.variables}
        J, w, _ = self.jacobian(chosen, nodes)
        return chosen, round(self.best_scale(J, w), _SCALE_DECIMALS)

    def shown(self, chosen: Mapping[str, float], scale: float) -> dict[str, float]:
        """The free parameters in their usual range, the scale included."""
        shown = {name: self.parameters(chosen)[name] for name in self.variables}
        return shown | ({self.family.scale or _SCALE: scale} if self.frees_scale else {})

    def rounded(self, best: Mapping[str, float], step: float, least: float, nodes: Nodes) -> Rounded:
        """The best multiples of a step near the optimum."""
        start = np.round(np.array(list(best.values())) / step)
        place, found = numerics.descend_lattice(lambda place: self.value(self.named(place * step), nodes), start)
        usual = self.parameters(self.named(place * step))
        plain = {name: float(projections.number_text(usual[name])) for name in self.variables}
        return Rounded(step, plain, found, found / least - 1.0 if least else 0.0)

    def flats(self, best: Mapping[str, float], least: float, nodes: Nodes) -> tuple[Flat, ...]:
        """Parameters that hardly matter: a quarter of their range costs at most 1 %, other parameters unchanged."""
        found = []
        for name, low, high in zip(self.variables, self.low.tolist(), self.high.tolist(), strict=True):

            def is_as_good(value: float, name: str = name) -> bool:
                return self.value({**best, name: value}, nodes) <= (1.0 + _FLAT) * least

            ends = sorted(_farthest(is_as_good, best[name], end) for end in (low, high))
            if least > 0.0 and ends[1] - ends[0] >= _FLAT_RANGE * (high - low):
                found.append(Flat(name, *ends))
        return tuple(found)

    def roundings(self, best: Mapping[str, float], least: float, nodes: Nodes) -> tuple[Rounded, ...]:
        """Rounded optima, for steps below half of the widest range."""
        widest = float(np.max(self.high - self.low, initial=0.0))
        return tuple(self.rounded(best, step, least, nodes) for step in _ROUNDINGS if step < 0.5 * widest)


def _is_smooth(J: FloatArray) -> BoolArray:
    return np.isfinite(J[:, 0, 0])


def _farthest(is_good: Callable[[float], bool], begin: float, end: float) -> float:
    """The value farthest from `begin` towards `end` up to which all values tried are good."""
    steps = [begin + (end - begin) * k / _WALK for k in range(1, _WALK + 1)]
    first = next((k for k, value in enumerate(steps) if not is_good(value)), None)
    if first is None:
        return end
    good, bad = (steps[first - 1] if first else begin), steps[first]
    for _ in range(_HALVINGS):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if is_good(middle) else (good, middle)
    return good


def _free_names(family: Family, free: Sequence[str] | None) -> tuple[str, ...]:
    """Names of the free parameters in the family's order, without repetition; raises ValueError."""
    allowed = [*family.limits, *([] if {_SCALE, "k"} & set(family.limits) else [_SCALE])]
    if free is None:
        return family.free
    names: list[str] = []
    for name in free:
        names += _POLE if name == "pole" and set(_POLE) <= set(family.limits) else [name]
    for name in names:
        if name not in allowed:
            raise ValueError(
                f"Invalid free parameter '{name}' for {family.name}. It must be one of {', '.join(allowed)}; others do "
                "not change the distortion, or need a range: give a PROJ string with +name={LOW..HIGH}."
            )
    if not names:
        raise ValueError("Invalid free parameters ''. There must be at least one.")
    return tuple(name for name in allowed if name in names)
