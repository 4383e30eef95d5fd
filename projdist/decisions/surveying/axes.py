"""What a low-distortion projection shall be good at, and the scale on its axis that is best for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray
from projdist.answers import elevation_factor
from projdist.decisions.families import Extent, ellipsoid_text, get_family
from projdist.decisions.objectives import Objective
from projdist.decisions.surveying.ground import Ground
from projdist.earth import Ellipsoid
from projdist.field import FIGURES, AnyFigure, Figure, get_figure
from projdist.numerics import descend_lattice, lattice, minimise
from projdist.projections import Projection, ProjectionError, number_text, with_parameters

Factors = FloatArray  # combined factors with k_0 = 1
Order = tuple[float, float]

SHARE = "share"
"""The criterion that is no figure of a map alone: the weight of the points within a target."""


def rms_scale(q: Factors, w: FloatArray) -> float:
    """The k_0 of least RMS distortion."""
    return float(np.sum(w * q) / np.sum(w * q * q))


def _middle(q: Factors, w: FloatArray) -> float:
    return float(2.0 / (q.max() + q.min()))


def _rms(ppm: FloatArray, w: FloatArray) -> float:
    return float(np.sqrt(np.sum(w * ppm * ppm)))


def _largest(ppm: FloatArray, w: FloatArray) -> float:
    return float(np.abs(ppm).max())


# Where a = b these are quicker than what is for all matrices: the best scale, and the figure of distortions.
_QUICK: dict[object, tuple[Callable[[Factors, FloatArray], float], Callable[[FloatArray, FloatArray], float]]] = {
    FIGURES["max_scale_error_ppm"].essence: (_middle, _largest),
    FIGURES["rms_scale_error_ppm"].essence: (rms_scale, _rms),
}


@dataclass(frozen=True)
class Goal:
    """A figure, or None for the share of the points within a target in ppm, and what k_0 is a multiple of."""

    figure: Figure | None
    target: float
    round_k: float

    @property
    def name(self) -> str:
        """The criterion's."""
        return self.figure.name if self.figure else SHARE

    def order(self, ppm: FloatArray, weight: FloatArray) -> Order:
        """How good distortions are, by the figure, then by RMS; less is better."""
        if self.figure is None:
            # Shares that differ by rounding only are the same.
            return -round(float(np.sum(weight[np.abs(ppm) <= self.target])), 9), _rms(ppm, weight)
        if quick := _QUICK.get(self.figure.essence):
            return quick[1](ppm, weight), _rms(ppm, weight)
        return self.figure(_similar(1.0 + 1e-6 * ppm), weight), _rms(ppm, weight)

    def rounded_scale(self, q: Factors, weight: FloatArray) -> tuple[float, Order]:
        """The best multiple of `round_k`, and how good it is."""
        multiple = self._multiple(q, weight)
        # Figures are convex in k_0: the best multiple is next to the best of all.
        options = np.unique([np.floor(multiple), np.ceil(multiple)]) * self.round_k
        orders = [self.order(1e6 * (k * q - 1.0), weight) for k in options]
        best = min(range(len(orders)), key=lambda index: orders[index])
        return float(options[best]), orders[best]

    def _multiple(self, q: Factors, weight: FloatArray) -> float:
        if self.figure is None:
            return _crowded(q, weight, self.target, self.round_k)
        if quick := _QUICK.get(self.figure.essence):
            return quick[0](q, weight) / self.round_k
        return Objective(self.figure).scale(_similar(q), weight) / self.round_k


def goal_of(criterion: AnyFigure, target: float, round_k: float) -> Goal:
    """The goal of a criterion; raises ValueError for one that tells conformal maps nothing."""
    if isinstance(criterion, str) and criterion == SHARE:
        return Goal(None, target, round_k)
    figure = get_figure(criterion)
    if figure.aspect == "angles" or figure.version:
        raise ValueError(
            f"Invalid criterion '{figure.name}'. It must be share, or a figure that conformal maps have at a scale, as "
            "max_scale_error_ppm or rms_scale_error_ppm."
        )
    return Goal(figure, target, round_k)


def _similar(factor: FloatArray) -> FloatArray:
    """Jacobians (n, 2, 2) of factors (n,) that are the same in all directions."""
    return factor[:, None, None] * np.eye(2)


def _crowded(q: Factors, w: FloatArray, target: float, unit: float) -> float:
    """The multiple with the most weight of points within the target; of all that have as much that of least RMS.

    A point is within it for k_0 from (1 - t) / q to (1 + t) / q: where most of these ranges of whole multiples overlap
    is found in one walk along their ends.
    """
    usual = rms_scale(q, w) / unit
    first, beyond = np.ceil((1.0 - 1e-6 * target) / q / unit), np.floor((1.0 + 1e-6 * target) / q / unit) + 1.0
    held = first < beyond
    if not held.any():
        return usual
    ends, place = np.unique(np.concatenate([first[held], beyond[held]]), return_inverse=True)
    inside = np.cumsum(np.bincount(place, np.concatenate([w[held], -w[held]])))
    # Rounding of the sums makes shares that are the same differ by 1e-13.
    most = np.flatnonzero(inside[:-1] > inside[:-1].max() - 1e-12)
    nearest = np.clip(np.round(usual), ends[most], ends[most + 1] - 1.0)
    return float(nearest[np.argmin(np.abs(nearest - usual))])


# ---- axes ----------------------------------------------------------------------------------------


_STARTS, _LATTICE = 8, 64  # of the descents to whole numbers; places tried before
_SMOOTH = 24  # places tried for the least RMS or maximum
_COARSE = ((64.0, 5), (8.0, 3), (1.0, 3))  # steps of the axis, in units of its rounding; the ends that are gone on from
_SCANNED, _KEPT = 400, 8  # places of a scan of one parameter, and those that it goes on from
_FINER = 8.0  # its next step


class Axis:
    """The axis of a family over a region; places are values of `names` in degrees, multiples of `unit` in the end."""

    def __init__(self, family: str, extent: Extent, ellipsoid: Ellipsoid, unit: float) -> None:
        self.extent, self.unit = extent, unit
        sides, self.fixed = self._sides(family)
        self.names = tuple(sides)
        self.low = np.array([middle - side for middle, side in sides.values()])
        self.high = np.array([middle + side for middle, side in sides.values()])
        for index, key in enumerate(self.names):
            if key.startswith("lat"):
                self.low[index], self.high[index] = max(self.low[index], -89.0), min(self.high[index], 89.0)
        # Not where an oblique line runs due north or east.
        some = self.parameters(self.low + 0.43 * (self.high - self.low))
        words = " ".join(f"+{key}={number_text(value)}" for key, value in some.items())
        self.base = Projection.from_user_input(f"+proj={family} {ellipsoid_text(ellipsoid)} {words}")

    def _sides(self, family: str) -> tuple[dict[str, tuple[float, float]], dict[str, float]]:
        """The middle and the half width of the range of each parameter of the axis, and the parameters that stay."""
        extent = self.extent
        # Over ground that slopes the best axis lies beside the region: scale falls with height.
        across = 1.0 + 1.5 * extent.radius
        east = across / max(np.cos(np.radians(extent.lat)), 0.1)
        if family == "tmerc":
            return {"lon_0": (extent.lon, east)}, {}
        if family == "lcc":
            return {"lat_1": (extent.lat, across)}, {}
        oblique = get_family("omerc", extent)
        moving, turning, _ = oblique.free
        fixed = {
            key: float(np.round(value / self.unit) * self.unit)
            for key, value in oblique.fixed.items()
            if key not in oblique.free
        }
        middle = (extent.lon, east) if moving == "lonc" else (extent.lat, across)
        return {moving: middle, turning: (extent.azimuth, 90.0)}, fixed

    def parameters(self, place: FloatArray) -> dict[str, float]:
        """PROJ's parameters; the one standard parallel of lcc is its latitude of origin, too."""
        values = self.fixed | dict(zip(self.names, map(float, place), strict=True))
        if "lat_1" in values:
            values["lat_0"] = values["lat_1"]
            values["lon_0"] = float(np.round(self.extent.lon / self.unit) * self.unit)
        for name in {"lon_0", "lonc"} & set(values):
            values[name] = float(np.mod(values[name] + 180.0, 360.0) - 180.0)
        if "alpha" in values:
            values["alpha"] = float(np.mod(values["alpha"] + 90.0, 180.0) - 90.0)
        return values

    def factors(self, place: FloatArray, ground: Ground) -> Factors:
        """Combined factors with a scale of 1 on the axis; NaN where PROJ refuses the axis."""
        nodes = ground.nodes
        try:
            scale = nodes.meridional_scale(with_parameters(self.base, self.parameters(place)))
        except ProjectionError:
            return np.full(nodes.lon.size, np.nan)
        return scale * elevation_factor(nodes.lat, ground.height, nodes.ellipsoid)


def best_place(axis: Axis, goal: Goal, few: Ground, ground: Ground) -> FloatArray:
    """The best multiples of the axis's unit, searched on few points and in the end on all."""

    def value(steps: FloatArray, at: Ground) -> Order:
        q = axis.factors(steps * axis.unit, at)
        if not np.isfinite(q).all():
            return np.inf, np.inf
        return goal.rounded_scale(q, at.nodes.weight)[1]

    def on_few(steps: FloatArray) -> Order:
        return value(steps, few)

    found = _scanned(axis, on_few) if axis.low.size == 1 else _descended(axis, goal, few, on_few)
    if few is ground:
        return axis.unit * found[0]
    best = min(found, key=lambda steps: value(steps, ground))
    return axis.unit * descend_lattice(lambda steps: value(steps, ground), best)[0]


def _scanned(axis: Axis, value: Callable[[FloatArray], Order]) -> list[FloatArray]:
    """The best multiples of the unit in the range of one parameter, best first.

    A share has many tops, one a few units wide: all multiples are tried where they are few, else ever finer ones near
    the best.
    """
    low, high = np.ceil(axis.low[0] / axis.unit), np.floor(axis.high[0] / axis.unit)
    stride = 1.0
    while (high - low) / stride >= _SCANNED:
        stride *= _FINER
    places = np.arange(low, high + 1.0, stride)
    known: dict[float, Order] = {}
    while True:
        for place in np.unique(np.clip(places, low, high)):
            if place not in known:
                known[place] = value(np.array([place]))
        kept = sorted(known, key=known.__getitem__)[:_KEPT]
        if stride == 1.0:
            return [np.array([place]) for place in kept]
        stride /= _FINER
        places = np.add.outer(kept, stride * np.arange(-_FINER, _FINER + 1.0))


def _descended(axis: Axis, goal: Goal, ground: Ground, value: Callable[[FloatArray], Order]) -> list[FloatArray]:
    """The ends of descents by ever smaller steps from the best of several starts, best first."""
    known: dict[tuple[float, ...], Order] = {}

    def once(steps: FloatArray) -> Order:
        place = tuple(steps.tolist())
        if place not in known:
            known[place] = value(steps)
        return known[place]

    def descended(steps: FloatArray, coarse: float) -> FloatArray:
        return coarse * descend_lattice(lambda multiple: once(coarse * multiple), np.round(steps / coarse))[0]

    places = sorted((np.round(start / axis.unit) for start in _starts(axis, goal, ground)), key=once)[:_STARTS]
    for coarse, kept in _COARSE:
        ends = [descended(steps, coarse) for steps in places]
        # Descents often meet.
        places = sorted({tuple(end.tolist()): end for end in ends}.values(), key=once)[:kept]
    return places


def _starts(axis: Axis, goal: Goal, ground: Ground) -> list[FloatArray]:
    """The place of least RMS, if that is asked for that of the least maximum, and a lattice over all of them."""
    weight = ground.nodes.weight

    def squares(place: FloatArray) -> FloatArray:
        q = axis.factors(place, ground)
        return np.nan_to_num(1e6 * np.sqrt(weight) * (rms_scale(q, weight) * q - 1.0), nan=1e6)

    def extremes(place: FloatArray) -> FloatArray:
        q = np.log(axis.factors(place, ground))
        return np.nan_to_num(np.stack([q, -q]), nan=1.0)

    starts = [minimise(squares, axis.low, axis.high, worst=False, count=_SMOOTH).place]
    if goal.figure is not None and goal.figure.is_maximum:
        starts.append(minimise(extremes, axis.low, axis.high, worst=True, count=_SMOOTH).place)
    return starts + list(axis.low + lattice(axis.low.size, _LATTICE) * (axis.high - axis.low))
