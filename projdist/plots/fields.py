"""A measure as a field over the mesh, and its colours and levels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.ticker import MaxNLocator

from projdist._typing import FloatArray
from projdist.derivatives import jacobian
from projdist.hessians import hessian
from projdist.measures import Measure
from projdist.plots.domain import POLE, normalised, weighted_quantile
from projdist.plots.mesh import Mesh

COLOUR_MAPS = {"magnitude": "viridis_r", "signed": "RdBu_r", "ratio": "RdBu_r"}
"""Perceptually ordered and safe for the colour-blind; light where the distortion is least."""

_TITLES = {
    "fisher": "Fisher distortion",
    "airy": "Airy distortion",
    "kavrayskiy": "Kavrayskiy distortion",
    "jordan": "Jordan distortion",
}

_TAIL = 0.02  # of the weights at either end may be off the colours
_NOISE = {"deg": 1e-4, "ppm": 1e-1}  # below it, differences are rounding; 1e-7 for pure numbers
_INTERVALS = 9


def field(mesh: Mesh, measure: Measure) -> FloatArray:
    """Values of a measure at the vertices of a mesh; a seam's images have the value of their own side."""
    lon, lat = (value[: mesh.nodes] for value in mesh.lonlat())
    lon = normalised(lon)
    values = np.full(mesh.nodes, np.nan)
    # At the mesh's poles, where the map is singular, the next row stands in.
    inner = np.flatnonzero(np.isfinite(mesh.x[: mesh.nodes]) & (np.abs(mesh.v[: mesh.nodes]) < POLE))
    J = jacobian(mesh.domain.projection, lon[inner], lat[inner])
    if measure.needs_hessian:
        # Per radian: the acceleration on the map has the unit of J when multiplied by the radius.
        H = hessian(mesh.domain.projection, lon[inner], lat[inner]) * mesh.domain.radius
        values[inner] = measure(J, H)
    else:
        values[inner] = measure(J)
    values[~np.isfinite(values)] = np.nan
    return _filled(values.reshape(mesh.shape)).ravel()[mesh.source]


def _filled(values: FloatArray) -> FloatArray:
    """Missing values from their neighbours, up to three cells away."""
    for _ in range(3):
        missing = np.isnan(values)
        if not missing.any():
            break
        padded = np.pad(values, 1, constant_values=np.nan)
        near = np.stack([padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]])
        count = np.isfinite(near).sum(axis=0)
        mean = np.nansum(near, axis=0) / np.maximum(count, 1)
        values = np.where(missing & (count > 0), mean, values)
    return values


@dataclass(frozen=True)
class ColourScale:
    """What the colours of a measure mean: the same for all panels of a figure."""

    measure: Measure
    norm: Normalize
    cmap: str
    levels: FloatArray
    extend: str

    @property
    def limits(self) -> tuple[float, float]:
        """The values at the ends of the colours."""
        return float(self.norm.vmin or 0.0), float(self.norm.vmax or 0.0)

    @property
    def label(self) -> str:
        """The name of the measure, its symbol and unit."""
        name = _TITLES.get(self.measure.name, self.measure.name.replace("_", " ").removesuffix(" ppm").capitalize())
        known = self.measure.symbol in ("", self.measure.unit) or self.measure.symbol in name
        symbol = "" if known else f" {self.measure.symbol}"
        unit = {"deg": "degrees"}.get(self.measure.unit, self.measure.unit)
        return f"{name}{symbol}" + (f" ({unit})" if unit else "")


def colour_scale(
    measure: Measure,
    values: Sequence[FloatArray],
    weights: Sequence[FloatArray],
    *,
    levels: int | Sequence[float] | None = None,
    cmap: str | None = None,
    limits: tuple[float, float] | None = None,
) -> ColourScale:
    """Colours for the values of all panels; the weights are shares.

    The limits leave out the last 2 % of the weights at an end where the values run off. A "ratio" is
    coloured about 1 in the logarithm, a "signed" measure about 0, a "magnitude" from 0 where the
    values come near to it.
    """
    data, area = np.concatenate(values), np.concatenate(weights)
    usable = np.isfinite(data) & (area > 0)
    data, area = data[usable], area[usable]
    if not data.size:
        raise ValueError(f"Invalid measure '{measure.name}'. It has no value in the region.")
    low, high = limits if limits is not None else _robust_limits(data, area)
    if limits is None:
        low, high = _by_kind(measure, low, high)
    if not low < high or (measure.kind == "ratio" and low <= 0):
        raise ValueError(f"Invalid colour limits '{low}, {high}'. They must ascend, and be positive for a ratio.")
    norm = LogNorm(low, high) if measure.kind == "ratio" else Normalize(low, high)
    if levels is None or isinstance(levels, int | np.integer):
        chosen = _levels(measure, low, high, _INTERVALS if levels is None else int(levels))
    else:
        chosen = np.unique(np.asarray(levels, dtype=float))
    slack = 1e-9 * (high - low)
    beyond = bool(data.min() < low - slack), bool(data.max() > high + slack)
    extend = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}[beyond]
    if cmap is not None and cmap not in matplotlib.colormaps:
        raise ValueError(f"Invalid colour map '{cmap}'. It must be a name of matplotlib, such as viridis or RdBu_r.")
    return ColourScale(measure, norm, cmap or COLOUR_MAPS[measure.kind], chosen, extend)


def _robust_limits(data: FloatArray, area: FloatArray) -> tuple[float, float]:
    low, high = (weighted_quantile(data, area, q) for q in (_TAIL, 1.0 - _TAIL))
    room = 0.25 * (high - low)
    least, most = float(data.min()), float(data.max())
    return (least if least >= low - room else low), (most if most <= high + room else high)


def is_constant(measure: Measure, low: float, high: float) -> bool:
    """Whether values differ by no more than rounding."""
    return bool(high - low <= _NOISE.get(measure.unit, 1e-7))


def _by_kind(measure: Measure, low: float, high: float) -> tuple[float, float]:
    if measure.kind == "ratio":
        half = max(abs(np.log(max(low, 1e-12))), abs(np.log(max(high, 1e-12))))
        half = half if half > 1e-6 else 0.1
        return float(np.exp(-half)), float(np.exp(half))
    if measure.kind == "signed":
        half = max(abs(low), abs(high))
        half = half if not is_constant(measure, -half, half) else 1.0
        return -half, half
    if low < 0.5 * high:
        low = min(low, 0.0)
    return (low, high) if not is_constant(measure, low, high) else (0.0, max(1.0, 2.0 * high))


# Mantissas from coarse to fine; the first set with enough levels is taken.
_MANTISSAS = (
    (1.0,),
    (1.0, 2.0, 5.0),
    (1.0, 1.5, 2.0, 3.0, 5.0, 7.0),
    (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0),
)


def _levels(measure: Measure, low: float, high: float, intervals: int) -> FloatArray:
    """Round numbers between the limits."""
    if measure.kind == "ratio" and high > 1.6 * low:
        decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
        for mantissas in _MANTISSAS:
            levels = np.multiply.outer(decades, mantissas).ravel()
            levels = levels[(levels >= low * (1 - 1e-9)) & (levels <= high * (1 + 1e-9))]
            if levels.size > 0.6 * intervals:
                return levels
    levels = np.asarray(MaxNLocator(intervals, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    slack = 1e-9 * (high - low)
    return levels[(levels >= low - slack) & (levels <= high + slack)]


def level_labels(levels: FloatArray) -> list[str]:
    """The shortest texts that tell the levels apart."""
    for digits in range(1, 12):
        labels = [f"{0.0 if abs(level) < 1e-14 else level:.{digits}g}" for level in levels]
        read = np.array([float(label) for label in labels])
        spacing = np.diff(levels).min(initial=np.inf) if levels.size > 1 else np.abs(levels).max(initial=1.0)
        if (np.abs(read - levels) <= 1e-3 * spacing).all():
            break
    return [f"{float(label):,.{_decimals(label)}f}" if "e+" in label else label for label in labels]


def _decimals(label: str) -> int:
    return 0 if "e+" in label else max(len(label.partition(".")[2]), 0)
