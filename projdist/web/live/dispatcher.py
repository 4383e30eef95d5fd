"""Requests of a page: parsing, input policy, dispatch to handlers, and replies."""

from __future__ import annotations

import functools
import json
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from projdist.earth import Ellipsoid
from projdist.projections import (
    Projection,
    ProjectionError,
    ProjectionLike,
    close_parameters,
    environment_without_files,
    file_named_in,
    tunable,
    tuned,
)
from projdist.regions import Place, get_region, is_region_text, region_of_text
from projdist.support import Notice, did_you_mean, one_line, shown
from projdist.web.frames import Arrays, packed
from projdist.web.live import handlers
from projdist.web.live.handlers import Pictures, outline
from projdist.web.live.previews import Previewer

LONGEST_MESSAGE = 64 * 1024
"""Bytes of a message, without a file dropped on the page."""

LARGEST_FILE = 20 * 1024 * 1024
"""Bytes of a file."""

STOP = "stop"
"""Kind of a message that cancels the work for a kind, its `options["what"]`."""

WORKER_OF_KIND = {
    "preview": "preview",
    "picture": "picture",
    "scales": "picture",
    "figures": "figures",
    "texts": "picture",
    "outline": "picture",
    "recommend": "long",
    "correct": "long",
    "design": "long",
    "check": "long",
    "export": "long",
}
"""Worker of each kind of request: pictures must not wait for work of seconds."""

_FIELDS = {"id", "kind", "slot", "projection", "values", "centre", "region", "beside", "options"}
_MOST_VALUES, _MOST_BESIDE, _MOST_OPTIONS = 40, 12, 20
_LONGEST_TEXT = 20_000
_LARGEST = 1e300


@dataclass(frozen=True, kw_only=True)
class Request:
    """A request of a page: id, kind, slot of the map, and the map with its region.

    `values` are parameters that differ from those of the projection, `centre` the longitude and latitude that are
    brought to the middle, `beside` the keys of the other maps on the page, `file` the bytes of a file.
    """

    id: int
    kind: str
    slot: str = ""
    projection: str = ""
    values: Mapping[str, float] = field(default_factory=dict)
    centre: tuple[float, float] | None = None
    region: str = "globe"
    beside: tuple[str, ...] = ()
    options: Mapping[str, Any] = field(default_factory=dict)
    file: bytes = b""


class RequestError(ValueError):
    """Invalid message."""


def read_request(text: str | bytes, file: bytes = b"") -> Request:
    """The request of a message in JSON; raises RequestError."""
    if len(text) > LONGEST_MESSAGE or len(file) > LARGEST_FILE:
        raise RequestError("Invalid message. It is too long.")
    try:
        message = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise RequestError("Invalid message. It must be JSON.") from error
    if not isinstance(message, dict) or not set(message) <= _FIELDS:
        raise RequestError(f"Invalid message. It must be an object with some of {', '.join(sorted(_FIELDS))}.")
    kind = message.get("kind")
    if not isinstance(kind, str) or kind not in (*WORKER_OF_KIND, STOP):
        raise RequestError(f"Invalid kind '{shown(str(kind))}'. It must be one of {', '.join(WORKER_OF_KIND)}.")
    return Request(
        id=_whole(message.get("id")),
        kind=kind,
        slot=_text(message, "slot", "")[:40],
        projection=_text(message, "projection", ""),
        values=_values(message.get("values") or {}),
        centre=_centre(message.get("centre")),
        region=_text(message, "region", "globe"),
        beside=_texts(message.get("beside") or []),
        options=_options(message.get("options") or {}),
        file=file,
    )


def _whole(value: Any) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 2**53:
        raise RequestError("Invalid id. It must be a whole number.")
    return value


def _text(message: Mapping[str, Any], name: str, default: str) -> str:
    value = message.get(name, default)
    if not isinstance(value, str) or len(value) > _LONGEST_TEXT or "\0" in value:
        raise RequestError(f"Invalid {name}. It must be a text of at most {_LONGEST_TEXT} characters.")
    return value


def _texts(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or len(value) > _MOST_BESIDE or not all(isinstance(text, str) for text in value):
        raise RequestError(f"Invalid beside. It must be at most {_MOST_BESIDE} texts.")
    return tuple(value)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not -_LARGEST <= value <= _LARGEST:
        raise RequestError("Invalid number. Parameters and places must be finite numbers.")
    return float(value)


def _values(value: Any) -> dict[str, float]:
    if not isinstance(value, dict) or len(value) > _MOST_VALUES:
        raise RequestError("Invalid values. They must be numbers by the names of parameters.")
    return {str(name): _number(number) for name, number in value.items()}


def _centre(value: Any) -> tuple[float, float] | None:
    if value is None:
        return None
    if not isinstance(value, list) or len(value) != 2:
        raise RequestError("Invalid centre. It must be a longitude and a latitude in degrees.")
    lon, lat = map(_number, value)
    if not (abs(lon) <= 360.0 and abs(lat) <= 90.0):
        raise RequestError("Invalid centre. It must be a longitude and a latitude in degrees.")
    return lon, lat


def _options(value: Any) -> dict[str, Any]:
    plain = isinstance(value, dict) and len(value) <= _MOST_OPTIONS
    if not plain or not all(isinstance(one, str | int | float | bool | None) for one in value.values()):
        raise RequestError("Invalid options. They must be texts and numbers by their names.")
    return dict(value)


# ---- inputs --------------------------------------------------------------------------------------


_LONGEST = 20_000  # characters

_FILES = ("file", "geodesic", "points")  # kinds of regions


@dataclass(frozen=True)
class InputPolicy:
    """Reads projections and regions of requests; only `opened`, texts of the user's own, may name files."""

    opened: frozenset[str] = frozenset()

    def projection(self, text: str) -> Projection:
        """The projection of a text; raises ProjectionError."""
        if text not in self.opened:
            check_projection(text)
        return _projection(text)

    def source(self, text: str) -> ProjectionLike:
        """Input that a text stands for."""
        return text

    def region(self, text: str, ellipsoid: Ellipsoid | None = None) -> Place:
        """The region of a text, on the body of an ellipsoid; raises ValueError."""
        return _region(text, ellipsoid) if text in self.opened else _closed_region(text, ellipsoid)

    def environment(self) -> dict[str, str]:
        """Environment variables of worker processes: without the user's grids, unless a file was opened."""
        return {} if any(map(_is_of_files, self.opened)) else environment_without_files()


class OpenInputPolicy(InputPolicy):
    """Allows all inputs, as in a notebook's own kernel."""

    def projection(self, text: str) -> Projection:
        """The projection of any text; raises ProjectionError."""
        return _projection(text)

    def region(self, text: str, ellipsoid: Ellipsoid | None = None) -> Place:
        """The region of any text, on the body of an ellipsoid; raises ValueError."""
        return _region(text, ellipsoid)

    def environment(self) -> dict[str, str]:
        """No variables: the code is the user's own."""
        return {}


def check_projection(text: str) -> None:
    """Allow names, PROJ strings, codes, WKT and PROJJSON; raises ProjectionError for what names a file."""
    if len(text) > _LONGEST:
        raise ProjectionError(f"Invalid projection '{shown(text)}'. It must have at most {_LONGEST} characters.")
    named = file_named_in(text)
    if named:
        hint = did_you_mean(close_parameters(named))
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. {hint}On this page it must need no file, as '{shown(named)}' may: "
            "name files on the command line, as in 'projdist explore FILE'."
        )


def _check_atom(kind: str, argument: str) -> None:
    """Refuse a part of a region that names a file; raises ValueError."""
    if kind.strip() in _FILES or (kind.strip() == "crs" and file_named_in(argument)):
        raise ValueError(
            f"Invalid region '{shown(f'{kind}:{argument}')}'. On this page it must need no file: name files on the "
            "command line, as in 'projdist explore --region file:PATH'."
        )


@functools.lru_cache(maxsize=256)
def _projection(text: str) -> Projection:
    return Projection.from_user_input(text)


@functools.lru_cache(maxsize=32)
def _region(text: str, ellipsoid: Ellipsoid | None) -> Place:
    return get_region(text, ellipsoid)


@functools.lru_cache(maxsize=32)
def _closed_region(text: str, ellipsoid: Ellipsoid | None) -> Place:
    return region_of_text(text, _check_atom, ellipsoid)


def _is_of_files(text: str) -> bool:
    """True if a projection or a region names a file."""
    try:
        if is_region_text(text):
            _closed_region(text, None)
            return False
        return bool(file_named_in(text))
    except ValueError:
        return True


# ---- replies -------------------------------------------------------------------------------------


def reply(request: Request, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]] | None = None) -> bytes:
    """The reply to a request."""
    known = {"id": request.id, "kind": request.kind, "slot": request.slot}
    return packed(known | dict(header), arrays or {})


def failed(request: Request, reason: str) -> bytes:
    """Reply with the reason of a failure."""
    return reply(request, {"problem": reason})


def progressed(request: Request, done: int, of: int) -> bytes:
    """Reply with the progress of a request."""
    return reply(request, {"progress": [done, of]})


# ---- dispatcher ----------------------------------------------------------------------------------------


Progress = Callable[[int, int], None]
Answer = tuple[dict[str, Any], Arrays]


@dataclass
class Dispatcher:
    """Answers requests by their handlers; keeps pictures and previews between them."""

    policy: InputPolicy = field(default_factory=InputPolicy)
    previewer: Previewer = field(default_factory=Previewer)
    pictures: Pictures = field(default_factory=Pictures)

    def answer(self, request: Request, progress: Progress = lambda done, of: None) -> bytes:
        """Reply to a request, also to an invalid one."""
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
            return outline(self.policy.region(request.region))
        if request.kind == "recommend":
            return handlers.recommended(self.policy.region(request.region), request.options, progress), {}
        if request.kind == "design":
            return handlers.designed(self.policy.region(request.region), request.options, progress), {}
        if request.kind == "scales":
            return self.pictures.scales(self.policy.region(request.region), request.beside), {}
        projection = self.projection(request)
        region = self.policy.region(request.region, projection.ellipsoid.ground)
        if request.kind == "preview":
            return self.previewer.frame(projection, region, self._middle(request))
        if request.kind == "picture":
            header, arrays = self.pictures.picture(projection, region, request.beside)
            turned = bool(request.values or request.centre)
            definition = projection.definition if turned else request.projection
            found = handlers.parameter_ranges(definition if turned else self.policy.source(definition))
            return header | {"definition": definition, **found}, arrays
        if request.kind == "figures":
            return {"figures": handlers.figures_of(projection, region)}, {}
        if request.kind == "correct":
            return handlers.corrected(projection, region), {}
        if request.kind == "check":
            return handlers.checked(projection, request.file)
        if request.kind == "export":
            return handlers.exported(projection, region, request.options)
        return handlers.texts(projection, region), {}

    def projection(self, request: Request) -> Projection:
        """The projection of a request, with its parameters and its centre; raises ProjectionError."""
        given = self.policy.projection(request.projection)
        source = self.policy.source(request.projection)
        return tuned(source, request.values, request.centre) if request.values or request.centre else given

    def _middle(self, request: Request) -> tuple[float, float] | None:
        """Longitude and latitude of the map's centre: the dragged one, else that of the parameters."""
        if request.centre is not None:
            return request.centre
        middle = tunable(self.policy.source(request.projection)).centre
        return middle and (request.values.get("lon_0", middle[0]), request.values.get("lat_0", middle[1]))
