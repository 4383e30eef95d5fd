"""The desk where requests are answered: one in each process of a live page, or in a notebook's kernel."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from projdist.projections import Projection, tunable, tuned
from projdist.support import Notice, one_line
from projdist.web.frames import Arrays
from projdist.web.live import studies
from projdist.web.live.inputs import Doors
from projdist.web.live.pictures import Pictures
from projdist.web.live.previews import Previewer
from projdist.web.live.replies import failed, reply
from projdist.web.live.requests import Request
from projdist.web.live.shapes import outline

Progress = Callable[[int, int], None]
Answer = tuple[dict[str, Any], Arrays]


@dataclass
class Desk:
    """Answers requests; what they have in common is kept."""

    doors: Doors = field(default_factory=Doors)
    previewer: Previewer = field(default_factory=Previewer)
    pictures: Pictures = field(default_factory=Pictures)

    def answer(self, request: Request, progress: Progress = lambda done, of: None) -> bytes:
        """The reply; what was wrong is said in it."""
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("ignore")
            warnings.simplefilter("always", Notice)
            try:
                header, arrays = self._answers(request, progress)
            except (ValueError, ImportError) as error:
                return failed(request, one_line(error))
        notes = [str(one.message) for one in caught if issubclass(one.category, Notice)]
        return reply(request, header | {"notes": [*header.get("notes", []), *notes]}, arrays)

    def _answers(self, request: Request, progress: Progress) -> Answer:
        if request.kind == "outline":
            return outline(self.doors.region(request.region))
        if request.kind == "recommend":
            return studies.recommended(self.doors.region(request.region), request.options, progress), {}
        if request.kind == "design":
            return studies.designed(self.doors.region(request.region), request.options, progress), {}
        if request.kind == "scales":
            return self.pictures.scales(self.doors.region(request.region), request.beside), {}
        projection = self.projection(request)
        region = self.doors.region(request.region, projection.ellipsoid.ground)
        if request.kind == "preview":
            return self.previewer.frame(projection, region, self._middle(request))
        if request.kind == "picture":
            header, arrays = self.pictures.picture(projection, region, request.beside)
            turned = bool(request.values or request.centre)
            definition = projection.definition if turned else request.projection
            found = studies.knobs(definition if turned else self.doors.source(definition))
            return header | {"definition": definition, **found}, arrays
        if request.kind == "figures":
            return {"figures": studies.figures_of(projection, region)}, {}
        if request.kind == "correct":
            return studies.corrected(projection, region), {}
        if request.kind == "check":
            return studies.checked(projection, request.file)
        if request.kind == "export":
            return studies.exported(projection, region, request.options)
        return studies.texts(projection, region), {}

    def projection(self, request: Request) -> Projection:
        """The projection of a request, with its parameters and its centre; raises ProjectionError."""
        given = self.doors.projection(request.projection)
        source = self.doors.source(request.projection)
        return tuned(source, request.values, request.centre) if request.values or request.centre else given

    def _middle(self, request: Request) -> tuple[float, float] | None:
        """Longitude and latitude at the middle of a map; what is dragged there goes before parameters."""
        if request.centre is not None:
            return request.centre
        middle = tunable(self.doors.source(request.projection)).centre
        return middle and (request.values.get("lon_0", middle[0]), request.values.get("lat_0", middle[1]))
