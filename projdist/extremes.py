"""Where in a region a measure is largest and smallest: searched from the best samples, not read off them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.cubature import Samples
from projdist.derivatives import jacobian
from projdist.hessians import hessian
from projdist.measures import Measure
from projdist.projections import Projection
from projdist.regions import Place, PointSet, Region
from projdist.regions.chains import divided

__all__ = ["Extreme", "find_maximum", "find_minimum", "measure_at"]

_STARTS = 4
_ROUNDS = 20
_TRIAL, _FINALISTS = 5, 2  # after so many rounds only the best starts go on
_SHRINK = 0.45
_FINE = 1e-6  # of the area; smaller panels are there only beside singularities
_BROAD = 3e-3  # of the largest panel's area
# Ever nearer to the maximum, in shares of the way to the middle of the nearest broad panel. Not nearer than
# this: the last thousandths of a degree before a singular point often are not defined, so that it is not found itself.
_APPROACH = 10.0 ** -np.arange(0.5, 2.5, 0.5)
_SLOWING = 0.75  # a logarithm gains the same in every step, a square root half of the last, a smooth maximum a tenth
_GROWTH = 1e-3  # of the value, in a step


class Extreme(NamedTuple):
    """A largest or smallest value and its place; infinite where the measure grows without bound towards it."""

    value: float
    lon: float
    lat: float


def measure_at(
    projection: Projection, measure: Measure, lon: FloatArray, lat: FloatArray, J: FloatArray | None = None
) -> FloatArray:
    """A measure at points in degrees, where J may be known; H is per radian of the semi-major axis."""
    J = jacobian(projection, lon, lat) if J is None else J
    if not measure.needs_hessian:
        return measure(J)
    return measure(J, hessian(projection, lon, lat) * projection.ellipsoid.a)


def find_maximum(
    projection: Projection, region: Place, samples: Samples, values: FloatArray, measure: Measure
) -> Extreme:
    """The largest value of a measure, from its `values` (n, p, p) at the samples."""
    return _largest(projection, region, samples, values, measure, bounded=measure.bounded)


def find_minimum(
    projection: Projection, region: Place, samples: Samples, values: FloatArray, measure: Measure
) -> Extreme:
    """The smallest value of a measure, from its `values` (n, p, p) at the samples."""
    opposite = replace(measure, function=lambda *derivatives: -measure.function(*derivatives))
    # Only a signed measure, as a logarithm, may fall without bound.
    bounded = measure.bounded or measure.kind != "signed"
    found = _largest(projection, region, samples, -values, opposite, bounded=bounded)
    return found._replace(value=-found.value)


def _largest(
    projection: Projection, region: Place, samples: Samples, values: FloatArray, measure: Measure, *, bounded: bool
) -> Extreme:
    filled = np.where(np.isfinite(values), values, -np.inf)
    if isinstance(region, PointSet):
        best = int(np.argmax(filled))
        return Extreme(float(values.flat[best]), _within_turn(samples.lon.flat[best]), float(samples.lat.flat[best]))
    clipped = samples.share < 1.0
    inside = region.contains(samples.lon[clipped], samples.lat[clipped])
    filled[clipped] = np.where(inside, filled[clipped], -np.inf)
    areas = samples.weight.sum(axis=(1, 2))
    broad = areas >= _BROAD * areas.max()
    if not bounded:
        # Where samples show that there is no bound, a search would only climb towards the singularity.
        top = int(np.argmax(filled))
        lon, lat = float(samples.lon.flat[top]), float(samples.lat.flat[top])
        if _grows(projection, measure, (lon, lat), _nearest_middle(samples, broad, lon, lat)):
            return Extreme(np.inf, _within_turn(lon), lat)
    found = _maximum_of_panels(projection, region, samples, filled.reshape(len(values), -1), measure)
    if len(region.edges):
        found = max(found, _maximum_on_edges(projection, measure, region.edges), key=_value)
    if not np.isfinite(found.value):
        return Extreme(np.nan, np.nan, np.nan)
    _, lon, lat = found
    if not bounded:
        inward = _nearest_middle(samples, broad, lon, lat)
        if _grows(projection, measure, (lon, lat), inward):
            found = found._replace(value=np.inf)
    return found._replace(lon=_within_turn(lon))


_NONE = Extreme(-np.inf, np.nan, np.nan)


def _value(extreme: Extreme) -> float:
    return extreme.value


def _within_turn(lon: float) -> float:
    return float((lon + 180.0) % 360.0 - 180.0)


def _maximum_of_panels(
    projection: Projection, region: Region, samples: Samples, filled: FloatArray, measure: Measure
) -> Extreme:
    """The largest value searched from the best of the nodes; their values (n, m) are -inf where not defined."""
    peaks = filled.max(axis=1)
    if not np.isfinite(peaks).any():
        return _NONE
    areas = samples.weight.sum(axis=(1, 2))
    coarse = areas > _FINE * areas.sum()
    order = np.argsort(-peaks)
    broad = areas >= _BROAD * areas.max()
    if not measure.bounded:
        # Where samples show that there is no bound, a search would only climb towards the singularity.
        best = np.unravel_index(np.argmax(filled), filled.shape)
        lon, lat = (float(at.reshape(filled.shape)[best]) for at in (samples.lon, samples.lat))
        if _grows(projection, measure, (lon, lat), _nearest_middle(samples, broad, lon, lat)):
            return Extreme(np.inf, (lon + 180.0) % 360.0 - 180.0, lat)
    # From the best panels, and from the best that are not tiny: beside a singularity samples may mislead.
    starts = np.unique(np.concatenate([order[:_STARTS], order[coarse[order]][:_STARTS]]))
    nodes = np.stack([samples.u[starts], samples.v[starts]], axis=-1).reshape(len(starts), -1, 2)
    first = nodes[np.arange(len(starts)), filled[starts].argmax(axis=1)]
    search = _Search(projection, region, measure, samples.patch[starts], first, np.ptp(nodes, axis=1) / 4)
    found = search.climb()
    place = region.chart(found.patch, *found.place)
    return Extreme(found.value, float(place.lon), float(place.lat))


_LONGEST = 1.0  # degrees of an edge between stations
_STATIONS = 4000  # at first; around the best of them all
_BEST_STATIONS, _BEST_EDGES = 6, 8
_FRACTIONS = np.linspace(-1.0, 1.0, 9)
_NARROWINGS = 14  # by a factor of four: to the rounding of a smooth maximum


def _maximum_on_edges(projection: Projection, measure: Measure, edges: FloatArray) -> Extreme:
    """The largest value on edges (m, 4): at every so many vertices, at all near the best of these, then along edges."""
    pieces = np.ceil(np.abs(edges[:, 2:] - edges[:, :2]).max(axis=1) / _LONGEST).clip(1).astype(int)
    lon, lat = divided(edges, pieces)
    stride = math.ceil(lon.shape[1] / _STATIONS)
    chosen = np.arange(0, lon.shape[1], stride)
    rough = _defined(measure_at(projection, measure, lon[0, chosen], lat[0, chosen]))
    near = chosen[np.argsort(-rough)[:_BEST_STATIONS], None] + np.arange(-stride, stride + 1)
    chosen = np.unique(np.clip(near, 0, lon.shape[1] - 1))
    ends = _defined(measure_at(projection, measure, lon[:, chosen], lat[:, chosen])).max(axis=0)
    best = chosen[np.argsort(-ends)[:_BEST_EDGES]]
    (lon0, lon1), (lat0, lat1) = lon[:, best, None], lat[:, best, None]
    middle, width = np.full((best.size, 1), 0.5), 0.5
    for _ in range(_NARROWINGS):
        share = np.clip(middle + width * _FRACTIONS, 0.0, 1.0)
        lons, lats = lon0 + (lon1 - lon0) * share, lat0 + (lat1 - lat0) * share
        values = _defined(measure_at(projection, measure, lons, lats))
        index = np.argmax(values, axis=1)[:, None]
        middle, width = np.take_along_axis(share, index, axis=1), 0.25 * width
    place = np.unravel_index(np.argmax(values), values.shape)
    return Extreme(float(values[place]), float(lons[place]), float(lats[place]))


def _defined(values: FloatArray) -> FloatArray:
    return np.where(np.isfinite(values), values, -np.inf)


def _nearest_middle(samples: Samples, chosen: BoolArray, lon: float, lat: float) -> tuple[float, float]:
    """Longitude and latitude of the middle of the nearest of the chosen panels."""
    lons, lats = (values[chosen, values.shape[1] // 2, values.shape[2] // 2] for values in (samples.lon, samples.lat))
    north, east = np.radians(lats - lat), np.radians(lons - lon)
    distance = np.sin(north / 2) ** 2 + np.cos(np.radians(lat)) * np.cos(np.radians(lats)) * np.sin(east / 2) ** 2
    nearest = np.argmin(distance)
    return float(lons[nearest]), float(lats[nearest])


def _grows(projection: Projection, measure: Measure, to: tuple[float, float], start: tuple[float, float]) -> bool:
    """Whether a measure grows without bound on the way `to` a point from another: no less in every step."""
    lon, lat = to
    east, north = (start[0] - lon + 180.0) % 360.0 - 180.0, start[1] - lat
    values = measure_at(projection, measure, lon + _APPROACH * east, lat + _APPROACH * north)
    gains = np.diff(values)
    return bool((gains > _GROWTH * np.abs(values[1:])).all() and (gains[1:] > _SLOWING * gains[:-1]).all())


class _Found(NamedTuple):
    """The best of a search, in chart coordinates."""

    value: float
    patch: IntArray
    place: FloatArray


@dataclass
class _Search:
    """A grid of five by five points about each start (n, 2), shrunk around its best point within the region."""

    projection: Projection
    region: Region
    measure: Measure
    patch: IntArray
    starts: FloatArray
    steps: FloatArray

    def climb(self) -> _Found:
        """The largest value, whose place may lie on the region's edge; -inf where there is none."""
        offsets = np.stack(np.meshgrid(np.arange(-2.0, 3.0), np.arange(-2.0, 3.0)), axis=-1).reshape(-1, 2)
        low, high = _limits(self.region, self.patch)
        place, step, best = self.starts.copy(), self.steps, np.full(len(self.patch), -np.inf)
        on = np.arange(len(self.patch))
        for turn in range(_ROUNDS):
            if turn == _TRIAL:  # the step is a hundredth of the panel
                on = on[np.argsort(-best[on])[:_FINALISTS]]
            around = place[on, None] + step[on, None] * offsets
            around = np.clip(around, low[on, None], high[on, None])
            found = self._values(self.patch[on, None], around)
            index = np.argmax(found, axis=1)
            top = found[np.arange(on.size), index]
            better = top > best[on]
            best[on[better]] = top[better]
            place[on[better]] = around[better, index[better]]
            step = _SHRINK * step
        winner = int(np.argmax(best))
        return _Found(float(best[winner]), self.patch[winner], place[winner])

    def _values(self, patch: IntArray, at: FloatArray) -> FloatArray:
        points = self.region.chart(patch, at[..., 0], at[..., 1])
        values = _defined(measure_at(self.projection, self.measure, points.lon, points.lat))
        if len(self.region.edges):
            values = np.where(self.region.contains(points.lon, points.lat), values, -np.inf)
        return values


def _limits(region: Region, patch: IntArray) -> tuple[FloatArray, FloatArray]:
    """The least and the largest (n, 2) of u and v in each patch."""
    number, rectangles = region.panels()
    low, high = rectangles[:, 0::2], rectangles[:, 1::2]
    own = [number == p for p in patch]
    return np.array([low[mine].min(axis=0) for mine in own]), np.array([high[mine].max(axis=0) for mine in own])
