"""The states of the USA, the District of Columbia and the territories, by the Census Bureau's outlines."""

from __future__ import annotations

import functools

from projdist.earth import WGS84, state_outline
from projdist.regions.names import folded, names_of, question, states
from projdist.regions.parts import told_apart
from projdist.regions.polygons import Polygons

RESOLUTION = "10m"


def state(text: str, resolution: str = RESOLUTION) -> Polygons:
    """A state by its name, postal or FIPS code, with all its islands; raises ValueError."""
    if resolution != RESOLUTION:
        raise ValueError(f"Invalid suffix '@{resolution}' of a state. It must be one of @{RESOLUTION}, @main and @all.")
    row = states().get(folded(text))
    if row is None:
        near = question(text, names_of(states()))
        raise ValueError(
            f"Invalid state '{text}'. {near}It must be the name or postal code of a state or territory of the USA."
        )
    return _state(row["fips"], row["postal"])


@functools.cache
def _state(fips: str, postal: str) -> Polygons:
    return told_apart(Polygons(state_outline(fips), f"state:{postal}", resolution=RESOLUTION, ellipsoid=WGS84))
