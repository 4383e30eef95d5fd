"""Whether values grow without bound: on the way to a singular point they gain no less in every step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.field.cubature import Samples
from projdist.field.extremes.goals import Extreme, Goal
from projdist.field.extremes.measuring import fields_at
from projdist.projections import Projection

__all__ = ["unbounded"]

_BROAD = 3e-3  # of the largest panel's area
# Ever nearer to the maximum, in shares of the way to the middle of the nearest broad panel. Not nearer than
# this: the last thousandths of a degree before a singular point often are not defined, so that it is not found itself.
_APPROACH = 10.0 ** -np.arange(0.5, 2.5, 0.5)
_NEARER = 10.0 ** -np.arange(1.5, 5.25, 0.25)  # on the way to a pole, where growth may come to an end
_BESIDE = 0.1  # degrees from a pole
_ALIKE = 1.5  # times what the meridian of a panel reaches there: what is more is not of the same kind
_SLOWING = 0.75  # a logarithm gains the same in every step, a square root half of the last, a smooth maximum a tenth
_GROWTH = 1e-3  # of the value, in a step
_FEWEST = 3  # steps where it is defined


def unbounded(
    projection: Projection, samples: Samples, goals: Sequence[Goal], found: Sequence[Extreme]
) -> list[Extreme]:
    """Values found for the goals, infinite where a goal grows without bound on the way to its place.

    The way is that from the middle of the nearest panel that is broad; in every step it grows no less, and beside a
    pole the growth does not come to an end.
    """
    doubtful = [k for k, one in enumerate(found) if np.isfinite(one.value) and not goals[k].bounded]
    result = list(found)
    if not doubtful:
        return result
    areas = samples.weight.sum(axis=(1, 2))
    middle = samples.lon.shape[-1] // 2
    broad = (areas >= _BROAD * areas.max(), middle, middle)
    lon, lat = np.array([found[k][1:3] for k in doubtful]).T[:, :, None]
    east, north = (samples.lon[broad] - lon + 180.0) % 360.0 - 180.0, samples.lat[broad] - lat
    cosines = np.cos(np.radians(lat)) * np.cos(np.radians(lat + north))
    distance = np.sin(np.radians(north) / 2) ** 2 + cosines * np.sin(np.radians(east) / 2) ** 2
    nearest = np.argmin(distance, axis=1)[:, None]
    east, north = (np.take_along_axis(way, nearest, axis=1) for way in (east, north))
    # To the place; and to a pole that it is beside, on the panel's own meridian, away from a seam that ends there.
    pole = np.copysign(90.0, lat)
    lons, lats = lon + _APPROACH * east, lat + _APPROACH * north
    to_pole = np.broadcast_to(lon + east, (len(lon), _NEARER.size)), pole + _NEARER * (lat + north - pole)
    bent = any(goals[k].measure.needs_hessian for k in doubtful)
    lons, lats = (np.concatenate(both, axis=1) for both in zip((lons, lats), to_pole, strict=True))
    fields = fields_at(projection, lons.ravel(), lats.ravel(), bent)[0].reshape(*lons.shape, -1)
    values = np.stack([goals[k].of(own) for k, own in zip(doubtful, fields, strict=True)])
    values, nearer = np.split(values, [_APPROACH.size], axis=1)
    with np.errstate(invalid="ignore"):
        gains, defined_at = np.diff(values), np.isfinite(values)
        grows = ((gains > _GROWTH * np.abs(values[:, 1:])) | ~defined_at[:, 1:]).all(axis=1)
        grows &= ((gains[:, 1:] > _SLOWING * gains[:, :-1]) | ~defined_at[:, 2:]).all(axis=1)
        grows &= defined_at[:, :_FEWEST].all(axis=1)
    reached, at_pole = (np.where(np.isfinite(some), some, -np.inf).max(axis=1) for some in (values, nearer))
    alike = reached < _ALIKE * at_pole
    grows &= ~(_ends(nearer) & alike & (90.0 - np.abs(lat[:, 0]) < _BESIDE))
    for k in np.array(doubtful)[grows]:
        result[k] = result[k]._replace(value=np.inf)
    return result


def _ends(values: FloatArray) -> BoolArray:
    """Whether growth comes to an end: gains between values (n, m) become less two times in a row, and slow."""
    with np.errstate(invalid="ignore"):
        gains = np.diff(values)
        less, slow = gains[:, 1:] < gains[:, :-1], gains[:, 1:] < _SLOWING**0.5 * gains[:, :-1]
        return np.asarray((less[:, :-1] & slow[:, 1:] & (gains[:, 2:] > 0.0)).any(axis=1))
