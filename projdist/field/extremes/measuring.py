"""The values of goals at places, by the careful differences of points, with their errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from projdist._typing import FloatArray
from projdist.field.at_points import derivatives
from projdist.field.extremes.goals import Extreme
from projdist.field.extremes.states import State
from projdist.field.second_derivatives import hessian
from projdist.projections import Projection

__all__ = ["BENT", "exact", "fields_at", "measured"]

_EXACT = 1e-10  # of the scales: what a search resolves, above the rounding of derivatives
BENT = 1e-7  # of the second derivatives
_LEAST = 2e-12  # of J, as the differences leave it


def measured(projection: Projection, states: Sequence[State], found: Sequence[Extreme]) -> list[Extreme]:
    """The best of the places of each goal, measured there, or else the best node; with its error."""
    if not states:
        return []
    places = [place for state in states for place in state.places]
    bent = any(state.goal.measure.needs_hessian for state in states)
    lon, lat = np.array(places).reshape(-1, 2).T
    fields, errors = fields_at(projection, lon, lat, bent)
    ends = np.cumsum([len(state.places) for state in states])
    parts = zip(np.split(fields, ends[:-1]), np.split(errors, ends[:-1]), strict=True)
    return [_measured_at(state, node, *part) for state, node, part in zip(states, found, parts, strict=True)]


def fields_at(projection: Projection, lon: FloatArray, lat: FloatArray, bent: bool) -> tuple[FloatArray, FloatArray]:
    """The entries of J, and if `bent` of H, at points, and their errors: both (n, k)."""
    lon, lat = np.asarray(lon), np.asarray(lat)
    found = derivatives(projection, lon, lat)
    field = found.jacobian.reshape(-1, 4)
    error = (_size(field) * np.maximum(found.error, _LEAST))[:, None] * np.ones(4)
    if bent:
        H = hessian(projection, lon, lat).reshape(-1, 8)
        field, lost = np.concatenate([field, H], axis=1), BENT * np.maximum(np.abs(H).max(axis=1), _size(field))
        error = np.concatenate([error, np.broadcast_to(lost[:, None], H.shape)], axis=1)
    return field, error


def _measured_at(state: State, node: Extreme, fields: FloatArray, errors: FloatArray) -> Extreme:
    """The largest value at a goal's places, with its error; without one, what is known of polynomials or a node."""
    values = state.goal.of(fields)
    best, rounding = node, 0.0
    if np.isfinite(values).any():
        changes = state.goal.change(fields, errors)
        certain = np.where(np.isfinite(changes) & np.isfinite(values), values - np.nan_to_num(changes), -np.inf)
        top = int((certain if np.isfinite(certain).any() else values).argmax())
        best, rounding = Extreme(float(values[top]), *state.places[top]), float(changes[top])
    singular = state.known_at in state.places and values[state.places.index(state.known_at)] == -np.inf
    if state.known_at is not None and singular and state.known > best.value:
        best, rounding = Extreme(state.known, *state.known_at), 0.0
    return best._replace(error=max(state.bound - best.value, 0.0) + rounding)


def _size(field: FloatArray) -> FloatArray:
    """The scale of J, from fields (..., k)."""
    return np.sqrt(0.5 * (field[..., :4] ** 2).sum(axis=-1))


def exact(field: FloatArray) -> FloatArray:
    """What a search resolves of each entry of a field (k,)."""
    error = np.full(field.shape, _EXACT * _size(field))
    error[4:] = BENT * np.abs(field[4:]).max(initial=0.0)
    return error
