"""Exact pictures: the frame of a report, and colours for all maps of the page."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from projdist._typing import FloatArray
from projdist.projections import Projection
from projdist.regions import Place, region_title
from projdist.surfaces import shown_part, surface_of
from projdist.web.frames import Arrays, frame_of
from projdist.web.maps import cell_step, colour_scales

_KEPT = 24  # maps whose values take part in the colours


@dataclass
class Pictures:
    """Makes pictures; keeps the Jacobians of the last ones, so that all maps of a page have one scale."""

    kept: OrderedDict[tuple[str, str], tuple[FloatArray, FloatArray]] = field(default_factory=OrderedDict)

    def picture(
        self, projection: Projection, region: Place, beside: Sequence[str] = ()
    ) -> tuple[dict[str, Any], Arrays]:
        """The header and the arrays of a map, whose colours suit the maps `beside` it; raises ValueError."""
        shown = shown_part(region)
        surface = surface_of(projection, shown, cell_step(shown.bounds))
        header, arrays, J = frame_of(surface, projection.label)
        self._keep((projection.definition, region.name), (J, surface.weights))
        header |= {
            "resolved": projection.definition,
            "name": projection.name,
            "region_title": region_title(region),
        }
        return header | self.scales(region, [projection.definition, *beside]), arrays

    def scales(self, region: Place, definitions: Sequence[str]) -> dict[str, Any]:
        """The colours for the last pictures of maps of a region, as many as are kept, and of which maps they are."""
        together = [one for one in dict.fromkeys(definitions) if (one, region.name) in self.kept]
        values = [self.kept[definition, region.name] for definition in together]
        scales = colour_scales([J for J, _ in values], [weights for _, weights in values])
        return {"scales": list(scales), "together": together}

    def _keep(self, key: tuple[str, str], values: tuple[FloatArray, FloatArray]) -> None:
        self.kept[key] = values
        self.kept.move_to_end(key)
        while len(self.kept) > _KEPT:
            self.kept.popitem(last=False)
