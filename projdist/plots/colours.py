"""Colour scales of measures: limits, the part of a colour map that is used, and isolines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib import colors, ticker

from projdist import matrices, numerics, support
from projdist._typing import FloatArray
from projdist.plots.style import THEMES, Theme
from projdist.surfaces import Surface

Levels = int | Sequence[float] | None

_TAIL = 0.02  # of the weights at either end may be off the colours
_FEW = 0.001  # of the weights, for which no half of a diverging map is shown
_WHOLE = 0.9  # of a half: where as much is used, all of it is shown
_NOISE = {"deg": 1e-4, "ppm": 1e-1}  # below it, differences are rounding; 1e-7 for pure numbers
_NEAR = 0.5  # of the farther limit: values that come as near to the neutral one show it too
_SLACK = 1e-3  # of the limits' distance: what is less beyond them is not seen
_SEEN = 1e-4  # of the limits' distance: across values as close as that, isolines run at random
_ALMOST_NEUTRAL = 2e-6  # of a ratio: PROJ's own noise in the areal scale, a few km from the pole of EPSG:3035
_FLAT = {"magnitude": (0.0, 1.0), "signed": (-1.0, 1.0), "ratio": (-0.1, 0.1)}  # where nothing is distorted
_MOST_LEVELS = 100
_COLOURS = 256


def unit_label(measure: matrices.Measure) -> str:
    """The unit of a measure after its title, as "(degrees)"; "" if it has none."""
    unit = "degrees" if measure.unit == "deg" else measure.unit
    return f"({unit})" if unit else ""


@dataclass(frozen=True)
class ColourScale:
    """Colour scale of a measure, shared by all panels of a figure."""

    measure: matrices.Measure
    norm: colors.Normalize
    cmap: str | colors.Colormap
    levels: FloatArray
    extend: str

    @classmethod
    def of(
        cls,
        measure: matrices.Measure,
        values: Sequence[FloatArray],
        weights: Sequence[FloatArray] | None = None,
        *,
        levels: Levels = None,
        cmap: str | colors.Colormap | None = None,
        limits: tuple[float, float] | None = None,
        colours: Theme = THEMES["light"],
    ) -> ColourScale:
        """Colour scale for the values of all panels; the weights are shares, by default equal.

        The limits leave out the last 2 % of the weights at an end where the values run off, and take in the neutral
        value (1 of a ratio, else 0) where the values come near to it. About it the colours of a "ratio" are even in the
        logarithm, those of a "signed" measure in the value. Raises ValueError.
        """
        known = isinstance(cmap, colors.Colormap) or (isinstance(cmap, str) and cmap in matplotlib.colormaps)
        if cmap is not None and not known:
            said = support.quoted(cmap)
            raise ValueError(f"Invalid colour map {said}. It must be a name of matplotlib or a Colormap.")
        wanted = _check_levels(levels)
        equal = [np.full(one.size, 1.0 / one.size) for one in values] if weights is None else weights
        data, area = np.concatenate(values), np.concatenate(equal)
        usable = np.isfinite(data) & (area > 0)
        data, area = data[usable], area[usable]
        if not data.size:
            raise ValueError(f"Invalid measure '{measure.name}'. It has no value in the region.")
        low, high = _limits(measure, data, area) if limits is None else support.check_pair("colour limits", limits)
        if not -np.inf < low < high < np.inf or (measure.kind == "ratio" and low <= 0):
            said = f"Invalid colour limits '{low:g}, {high:g}'."
            raise ValueError(f"{said} They must ascend, and be positive for a ratio.")
        chosen = _round_levels(measure, low, high, wanted) if isinstance(wanted, int) else wanted
        missed = chosen[(chosen < data.min()) | (chosen > data.max())]
        if missed.size and not isinstance(wanted, int):
            few = [f"{level:g}" for level in missed[:5]]
            few += [f"{missed.size - 5} more"] if missed.size > 5 else []
            has = "level {} has no isoline: it is" if missed.size == 1 else "levels {} have no isolines: they are"
            beyond = has.format(support.listed(few, "and"))
            support.tell(f"The {beyond} beyond the values, {data.min():.6g} to {data.max():.6g}.")
        if cmap is None and measure.kind == "magnitude":
            cmap = colours.rising
        elif cmap is None:  # diverging if the neutral value is on the scale, else light at the limit nearer to it
            start, stop = _from_neutral(measure, np.array([low, high]))
            cmap = colours.diverging if start <= 0 <= stop else colours.rising if start > 0 else colours.falling
        norm = colors.LogNorm(low, high) if measure.kind == "ratio" else colors.Normalize(low, high)
        slack = _SLACK * (high - low)
        extend = ("neither", "min", "max", "both")[(data.min() < low - slack) + 2 * (data.max() > high + slack)]
        return cls(measure, norm, cmap, chosen, extend)

    @classmethod
    def of_surfaces(
        cls, measure: matrices.Measure, surfaces: Sequence[Surface], values: Sequence[FloatArray], **options: Any
    ) -> ColourScale:
        """Colour scale for values at the vertices of surfaces, by those at their nodes."""
        inner = [value[: surface.nodes] for value, surface in zip(values, surfaces, strict=True)]
        return cls.of(measure, inner, [surface.weights for surface in surfaces], **options)

    @property
    def labels(self) -> list[str]:
        """Levels as texts."""
        return level_labels(self.levels)

    @property
    def limits(self) -> tuple[float, float]:
        """Values at the ends of the colours."""
        return float(self.norm.vmin or 0.0), float(self.norm.vmax or 0.0)

    @property
    def colours(self) -> colors.Colormap:
        """Colour map from limit to limit; of a diverging one, the part around the neutral value that is used."""
        whole = self.cmap if isinstance(self.cmap, colors.Colormap) else matplotlib.colormaps[self.cmap]
        # Diverging is what has a middle that is lighter, or darker, than both ends.
        start, middle, stop = whole([0.0, 0.5, 1.0])[:, :3] @ [0.30, 0.59, 0.11]
        if self.measure.kind == "magnitude" or not (middle - start) * (middle - stop) > 0:
            return whole
        ends = _from_neutral(self.measure, np.array(self.limits))
        low, high = 0.5 + 0.5 * ends / np.abs(ends).max()
        return colors.ListedColormap(whole.resampled(4 * _COLOURS)(np.linspace(low, high, _COLOURS)))

    @property
    def label(self) -> str:
        """Name of the measure with symbol and unit."""
        title, symbol = self.measure.title, self.measure.symbol
        is_said = symbol in (*title.split(), self.measure.unit)
        return " ".join(filter(None, (title, "" if is_said else symbol, unit_label(self.measure))))


def _from_neutral(measure: matrices.Measure, values: FloatArray) -> FloatArray:
    """Distance from the neutral value: 0, or of a ratio 1, in the logarithm."""
    return np.log(np.maximum(values, 1e-12)) if measure.kind == "ratio" else values


def _check_levels(levels: Levels) -> int | FloatArray:
    """Approximate number of levels, or the levels in ascending order."""
    if levels is None:
        return 9
    if isinstance(levels, int | np.integer) and not isinstance(levels, bool):
        if 1 <= levels <= _MOST_LEVELS:
            return int(levels)
    elif isinstance(levels, Sequence | np.ndarray) and not isinstance(levels, str | bytes):
        chosen = np.unique(support.check_numbers("levels", levels))
        if chosen.size <= _MOST_LEVELS and np.isfinite(chosen).all():
            return chosen
    must = f"They must be a number of isolines, 1 to {_MOST_LEVELS}, or as many finite values."
    raise ValueError(f"Invalid levels {support.quoted(levels)}. {must}")


def _noise(measure: matrices.Measure) -> float:
    return _NOISE.get(measure.unit, 1e-7)


def shown_levels(scale: ColourScale, values: FloatArray) -> FloatArray:
    """Levels that have isolines: those within values that differ by more than rounding, and visibly."""
    low, high = np.quantile(values, [0.01, 0.99])
    if not high - low > max(_noise(scale.measure), _SEEN * (scale.limits[1] - scale.limits[0])):
        return np.empty(0)
    return scale.levels[(scale.levels > values.min()) & (scale.levels < values.max())]


def _limits(measure: matrices.Measure, data: FloatArray, area: FloatArray) -> tuple[float, float]:
    """Limits of values, never equal; they include the neutral value if they come near to it."""
    distance = _from_neutral(measure, data)
    low, high, least, most = numerics.quantiles(distance, area, [_TAIL, 1.0 - _TAIL, _FEW, 1.0 - _FEW])
    start, stop, room = float(distance.min()), float(distance.max()), 0.25 * (high - low)
    start, stop = (start if start >= low - room else low), (stop if stop <= high + room else high)  # no far tails
    start, stop = _with_neutral(start, stop, np.inf if stop - start <= _noise(measure) else _NEAR)
    if measure.kind != "magnitude" and start <= 0.0 <= stop:
        # A diverging map has colours for the smaller half, too, so it covers all but a few values.
        reach = max(-start, stop)
        start, stop = (
            -reach if least < -_WHOLE * reach else min(start, least),
            reach if most > _WHOLE * reach else max(stop, most),
        )
        start, stop = _with_neutral(start, stop, 0.0)
    noise = _ALMOST_NEUTRAL if measure.kind == "ratio" else _noise(measure)
    if max(-start, stop) <= noise:
        start, stop = _FLAT[measure.kind]
    return (float(np.exp(start)), float(np.exp(stop))) if measure.kind == "ratio" else (start, stop)


def _with_neutral(start: float, stop: float, near: float) -> tuple[float, float]:
    """A range that ends at 0, if that end is within `near` times the other one of 0, or hardly beyond it."""
    if -_SLACK * stop < start < near * stop:
        return 0.0, stop
    if near * start < stop < -_SLACK * start:
        return start, 0.0
    return start, stop


# From coarse to fine; the first set with enough levels is used.
_MANTISSAS = (
    (1.0,),
    (1.0, 2.0, 5.0),
    (1.0, 1.5, 2.0, 3.0, 5.0, 7.0),
    (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0),
)


def _round_levels(measure: matrices.Measure, low: float, high: float, intervals: int) -> FloatArray:
    """Round numbers within the limits."""
    if measure.kind == "ratio" and high > 1.6 * low:
        decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
        for mantissas in _MANTISSAS:
            levels = np.multiply.outer(decades, mantissas).ravel()
            levels = levels[(levels >= low * (1 - 1e-9)) & (levels <= high * (1 + 1e-9))]
            if levels.size > 0.6 * intervals:
                return levels
    return round_values(low, high, intervals, slack=1e-9 * (high - low))


def round_values(low: float, high: float, intervals: int, slack: float = 0.0) -> FloatArray:
    """Round numbers, evenly spaced, from `low` to `high`, or beyond them by `slack`."""
    values = np.asarray(ticker.MaxNLocator(intervals, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    return values[(values >= low - slack) & (values <= high + slack)]


def level_labels(levels: FloatArray) -> list[str]:
    """Shortest texts that distinguish the levels."""
    for digits in range(1, 12):
        labels = [f"{0.0 if abs(level) < 1e-14 else level:.{digits}g}" for level in levels]
        read = np.array([float(label) for label in labels])
        spacing = np.diff(levels).min(initial=np.inf) if levels.size > 1 else np.abs(levels).max(initial=1.0)
        if (np.abs(read - levels) <= 1e-3 * spacing).all():
            break
    labels = [f"{float(label):,.0f}" if "e+" in label else label for label in labels]
    return [label.replace("-", "\N{MINUS SIGN}") for label in labels]
