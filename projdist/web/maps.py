"""Maps of a page, with one scale of colours for each measure."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.matrices import get_measure
from projdist.plots import ColourScale
from projdist.projections import Projection, ProjectionLike
from projdist.regions import RegionLike, region_for
from projdist.surfaces import Bounds, longitude_width, shown_part, surface_of
from projdist.web.frames import encoded, frame_of, packed
from projdist.web.menu import GROUPS, SHOWN_MEASURES

MOST_MAPS = 6
"""As many maps has a page."""

_NODES = 10_000  # of a map: what is between them is interpolated
_COLOURS = 256


@dataclass(frozen=True, kw_only=True)
class Maps:
    """Maps as encoded frames, what the colours of each measure mean, the measure shown first, and what is missing."""

    titles: tuple[str, ...]
    frames: tuple[str, ...]
    scales: tuple[dict[str, Any], ...]
    measure: str
    notes: tuple[str, ...]


def draw_maps(
    projections: Sequence[ProjectionLike],
    *,
    titles: Sequence[str],
    region: RegionLike | None = None,
    measure: str = "fisher",
    height: float = 0.0,
    marks: Mapping[str, Any] | None = None,
) -> Maps:
    """The first `MOST_MAPS` projections as maps of a region, None for the area of use or the globe.

    `measure` is shown first, or else Fisher's, if the page has it not. A projection that shows nothing of the region is
    told in the notes. Scales are over distances at an ellipsoidal height in metres; `marks` are geometries in longitude
    and latitude by their names, which are drawn.
    """
    name = get_measure(measure).name
    maps = [Projection.from_user_input(projection) for projection in projections[:MOST_MAPS]]
    place = shown_part(region_for(region, maps))
    step = cell_step(place.bounds)
    notes = (
        [f"These are the maps of the first {MOST_MAPS} of {len(projections)}."] if len(projections) > MOST_MAPS else []
    )
    drawn, values, weights = [], [], []
    for projection, title in zip(maps, titles, strict=False):
        try:
            surface = surface_of(projection, place, step)
        except ValueError as error:
            notes.append(str(error))
            continue
        header, arrays, J = frame_of(surface, title, height=height, marks=marks)
        drawn.append((title, encoded(packed(header, arrays))))
        values.append(J)
        weights.append(surface.weights)
    return Maps(
        titles=tuple(title for title, _ in drawn),
        frames=tuple(frame for _, frame in drawn),
        scales=tuple(colour_scales(values, weights)),
        measure=name if name in SHOWN_MEASURES else SHOWN_MEASURES[0],
        notes=tuple(notes),
    )


def cell_step(bounds: Bounds) -> float:
    """Degrees of cells, of which a region has about as many as are wanted."""
    _, south, _, north = bounds
    longest = np.cos(np.radians(max(south, -north, 0.0)))
    return float(np.sqrt(longitude_width(bounds) * longest * (north - south) / _NODES))


def colour_scales(jacobians: Sequence[FloatArray], weights: Sequence[FloatArray]) -> Iterator[dict[str, Any]]:
    """What the colours of each measure mean, one scale for all maps."""
    if not jacobians:
        return
    for group, name in ((group, name) for group, names in GROUPS.items() for name in names):
        measure = get_measure(name)
        scale = ColourScale.of(measure, [measure(J) for J in jacobians], weights)
        low, high = scale.limits
        colours = scale.colours(np.linspace(0.0, 1.0, _COLOURS), bytes=True)[:, :3]
        yield {
            "name": name,
            "group": group,
            "label": scale.label,
            "kind": measure.kind,
            "limits": [low, high],
            "levels": scale.levels.tolist(),
            "labels": scale.labels,
            "extend": scale.extend,
            "colours": b64encode(np.ascontiguousarray(colours, dtype=np.uint8).tobytes()).decode("ascii"),
        }
