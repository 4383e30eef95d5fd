"""Jumps of a field: found where a map of two parts is joined, and nowhere else."""

import functools

import numpy as np
import pytest

from projdist.matrices import get_measure
from projdist.projections import Projection
from projdist.surfaces.domain import domain_of
from projdist.surfaces.fields import field, jumping, measured
from projdist.surfaces.surface import build_surface

JOINT = 40.0 + 44.0 / 60.0 + 11.98 / 3600.0  # degrees: where Goode joins the sinusoidal map to Mollweide's


@pytest.mark.slow
@pytest.mark.parametrize(
    ("projection", "measure", "jumps"),
    [
        ("goode-homolosine", "omega", True),
        ("goode-homolosine", "h", True),
        ("robin", "omega", False),
        ("merc", "s", False),
        ("+proj=ortho +R=6371000", "h", False),
        ("winkel-tripel", "omega", False),
    ],
)
def test_jumps_are_where_maps_are_joined(projection: str, measure: str, jumps: bool) -> None:
    """Goode's map jumps at 40 degrees 44 minutes; kinks, steep fields and limbs are no jumps."""
    surface = build_surface(domain_of(Projection.from_user_input(projection), None), 2.0)
    chosen = get_measure(measure)
    values = field(surface, chosen)
    levels = np.concatenate([np.linspace(0.5, 3.0, 26), np.arange(5.0, 90.0, 5.0)])
    at = functools.partial(measured, surface.domain.projection, chosen)
    found = jumping(surface, values, levels, at)
    assert found.any() == jumps
    lat = np.abs(surface.lonlat()[1][surface.triangles[found]])
    assert ((lat.min(axis=1) < JOINT) & (lat.max(axis=1) > JOINT)).all()
