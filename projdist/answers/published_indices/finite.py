"""Indices of finite distances: of all pairs of points, and of the great circles between them."""

from __future__ import annotations

import math
from typing import NamedTuple

from projdist.answers.distance_measures import best_scale_of_distances, gott, peters
from projdist.answers.distances import distance_distortions
from projdist.answers.great_circles import great_circle_bending
from projdist.answers.published_indices.index import ScaledField
from projdist.numerics import Estimate


class Pairs(NamedTuple):
    """Gott's and Peters' measures of the distances on the map at a scale, and ln of the scale that betters it most."""

    gott: Estimate
    peters: Estimate
    best: Estimate


def pairs(field: ScaledField, scale: float) -> Pairs:
    """The measures of distances, all of the same pairs."""
    found = distance_distortions(
        field.projection,
        field.region,
        [gott, lambda ratio, weight: peters(scale * ratio, weight), best_scale_of_distances],
    )
    return Pairs(*(Estimate(one.value, one.error) for one in found))


def spread(field: ScaledField, scale: float) -> Estimate:
    """The standard deviation of ln(d_map / d_globe), which does not depend on the scale."""
    return field.once(pairs).gott


def distance_index(field: ScaledField, scale: float) -> Estimate:
    """The distance index of Peters."""
    return field.once(pairs, scale).peters


def finite_scale_factor(field: ScaledField, scale: float) -> Estimate:
    """Canters' mean finite scale factor (1 + D) / (1 - D), with D the index of Peters."""
    index, error = distance_index(field, scale)
    return Estimate((1.0 + index) / (1.0 - index), 2.0 * error / (1.0 - index) ** 2)


def best_for_distances(field: ScaledField) -> float:
    """The scale that makes both least."""
    return math.exp(field.once(pairs).best.value)


def bending(field: ScaledField, scale: float) -> Estimate:
    """How far great circles are from straight lines."""
    found = great_circle_bending(field.projection, field.region)
    return Estimate(found.value, found.error)
