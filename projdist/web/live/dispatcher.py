"""Requests of a page: parsing, input policy, dispatch to handlers, and replies."""

import functools
import json
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from projdist import earth, projections, regions, support
from projdist.web import frames
from projdist.web.live import handlers
from projdist.web.live.handlers import Pictures, Progress, outline
from projdist.web.live.previews import Previewer

LONGEST_MESSAGE = 64 * 1024
"""Largest number of bytes of a message, without the file dropped on a page."""

LARGEST_FILE = 20 * 1024 * 1024
"""Largest number of bytes of such a file."""

STOP = "stop"
"""Kind of a message that cancels the requests of another kind, named by its `options["what"]`."""

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
"""Worker of each kind of request, so that pictures do not wait for work of seconds."""

_FIELDS = {"id", "kind", "slot", "projection", "values", "centre", "region", "beside", "options"}
_MOST_VALUES, _MOST_BESIDE, _MOST_OPTIONS = 40, 12, 20
_LONGEST_TEXT = 20_000
_LARGEST = 1e300


@dataclass(frozen=True, kw_only=True)
class Request:
    """A request of a page: id, kind, slot of the map, and the map with its region."""

    id: int
    kind: str
    slot: str = ""
    projection: str = ""
    values: Mapping[str, float] = field(default_factory=dict)  # parameters that differ from those of the projection
    centre: tuple[float, float] | None = None  # longitude and latitude in the middle
    region: str = "globe"
    beside: tuple[str, ...] = ()  # keys of the other maps on the page
    options: Mapping[str, Any] = field(default_factory=dict)
    file: bytes = b""  # bytes of a dropped file


class RequestError(ValueError):
    """Invalid message."""


def read_request(text: str | bytes, file: bytes = b"") -> Request:
    """The request of a message in JSON; raises RequestError."""
    _require(len(text) <= LONGEST_MESSAGE and len(file) <= LARGEST_FILE, "message. It is too long.")
    try:
        message = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise RequestError("Invalid message. It must be JSON.") from error
    is_known = isinstance(message, dict) and set(message) <= _FIELDS
    _require(is_known, f"message. It must be an object with some of {', '.join(sorted(_FIELDS))}.")
    kind, number = message.get("kind"), message.get("id")
    if not isinstance(kind, str) or kind not in (*WORKER_OF_KIND, STOP):
        names = ", ".join(WORKER_OF_KIND)
        raise RequestError(f"Invalid kind '{support.shown(str(kind))}'. It must be one of {names}.")
    is_whole = isinstance(number, int) and not isinstance(number, bool) and 0 <= number < 2**53
    _require(is_whole, "id. It must be a whole number.")
    values, beside, options = message.get("values") or {}, message.get("beside") or [], message.get("options") or {}
    are_few = isinstance(values, dict) and len(values) <= _MOST_VALUES
    _require(are_few, "values. They must be numbers by the names of parameters.")
    are_texts = isinstance(beside, list) and len(beside) <= _MOST_BESIDE and all(isinstance(one, str) for one in beside)
    _require(are_texts, f"beside. It must be at most {_MOST_BESIDE} texts.")
    are_plain = isinstance(options, dict) and len(options) <= _MOST_OPTIONS
    are_plain = are_plain and all(isinstance(one, str | int | float | bool | None) for one in options.values())
    _require(are_plain, "options. They must be texts and numbers by their names.")
    return Request(
        id=number,
        kind=kind,
        slot=_text(message, "slot", "")[:40],
        projection=_text(message, "projection", ""),
        values={str(name): _number(value) for name, value in values.items()},
        centre=_centre(message.get("centre")),
        region=_text(message, "region", "globe"),
        beside=tuple(beside),
        options=dict(options),
        file=file,
    )


def _require(holds: bool, reason: str) -> None:
    """Raise RequestError with a reason where a condition does not hold."""
    if not holds:
        raise RequestError(f"Invalid {reason}")


def _text(message: Mapping[str, Any], name: str, default: str) -> str:
    value = message.get(name, default)
    is_right = isinstance(value, str) and len(value) <= _LONGEST_TEXT and "\0" not in value
    _require(is_right, f"{name}. It must be a text of at most {_LONGEST_TEXT} characters.")
    return str(value)


def _number(value: Any) -> float:
    is_right = isinstance(value, int | float) and not isinstance(value, bool) and -_LARGEST <= value <= _LARGEST
    _require(is_right, "number. Parameters and places must be finite numbers.")
    return float(value)


def _centre(value: Any) -> tuple[float, float] | None:
    if value is None:
        return None
    reason = "centre. It must be a longitude and a latitude in degrees."
    _require(isinstance(value, list) and len(value) == 2, reason)
    lon, lat = map(_number, value)
    _require(abs(lon) <= 360.0 and abs(lat) <= 90.0, reason)
    return lon, lat


# ---- inputs --------------------------------------------------------------------------------------

_FILES = ("file", "geodesic", "points")  # kinds of regions


@dataclass(frozen=True)
class InputPolicy:
    """Reads projections and regions of requests; only `opened` texts, or all if `is_open`, may name files."""

    opened: frozenset[str] = frozenset()
    is_open: bool = False

    def projection(self, text: str) -> projections.Projection:
        """The projection of a text; raises ProjectionError."""
        if not (self.is_open or text in self.opened):
            _check_projection(text)
        return _projection(text)

    def source(self, text: str) -> projections.ProjectionLike:
        """The input that a text stands for."""
        return text

    def region(self, text: str, ellipsoid: earth.Ellipsoid | None = None) -> regions.Place:
        """The region of a text, on the body of an ellipsoid; raises ValueError."""
        return _region(text, ellipsoid, self.is_open or text in self.opened)

    def environment(self) -> dict[str, str]:
        """Environment variables of worker processes: without the user's grids, unless a file was opened."""
        may_read = self.is_open or any(map(_is_of_files, self.opened))
        return {} if may_read else projections.environment_without_files()


def _check_projection(text: str) -> None:
    """Allow names, PROJ strings, codes, WKT and PROJJSON; raises ProjectionError for texts that name a file."""
    said = f"Invalid projection '{support.shown(text)}'."
    if len(text) > _LONGEST_TEXT:
        raise projections.ProjectionError(f"{said} It must have at most {_LONGEST_TEXT} characters.")
    if named := projections.file_named_in(text):
        hint = support.did_you_mean(projections.close_parameters(named))
        raise projections.ProjectionError(
            f"{said} {hint}On this page it must need no file, as '{support.shown(named)}' may: name files on the "
            "command line, as in 'projdist explore FILE'."
        )


def _check_atom(kind: str, argument: str) -> None:
    """Refuse a part of a region that names a file; raises ValueError."""
    if kind.strip() in _FILES or (kind.strip() == "crs" and projections.file_named_in(argument)):
        raise ValueError(
            f"Invalid region '{support.shown(f'{kind}:{argument}')}'. On this page it must need no file: name files "
            "on the command line, as in 'projdist explore --region file:PATH'."
        )


_projection = functools.lru_cache(maxsize=256)(projections.Projection.from_user_input)


@functools.lru_cache(maxsize=64)
def _region(text: str, ellipsoid: earth.Ellipsoid | None, may_read: bool) -> regions.Place:
    """The region of a text, which may name files only if `may_read`."""
    if may_read:
        return regions.get_region(text, ellipsoid)
    return regions.region_of_text(text, _check_atom, ellipsoid)


def _is_of_files(text: str) -> bool:
    """True if a projection or a region names a file."""
    try:
        if regions.is_region_text(text):
            _region(text, None, False)
            return False
        return bool(projections.file_named_in(text))
    except ValueError:
        return True


# ---- replies -------------------------------------------------------------------------------------


def reply(request: Request, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]] | None = None) -> bytes:
    """The reply to a request."""
    known = {"id": request.id, "kind": request.kind, "slot": request.slot}
    return frames.packed(known | dict(header), arrays or {})


def failed(request: Request, reason: str) -> bytes:
    """Reply with the reason of a failure."""
    return reply(request, {"problem": reason})


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
            warnings.simplefilter("always", support.Notice)
            try:
                header, arrays = self._answers(request, progress)
            except (ValueError, ImportError) as error:
                return failed(request, support.one_line(error))
        notes = [str(one.message) for one in caught if issubclass(one.category, support.Notice)]
        return reply(request, header | {"notes": [*header.get("notes", []), *notes]}, arrays)

    def _answers(self, request: Request, progress: Progress) -> frames.Frame:
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

    def projection(self, request: Request) -> projections.Projection:
        """The projection of a request, with its parameters and its centre; raises ProjectionError."""
        given = self.policy.projection(request.projection)
        source = self.policy.source(request.projection)
        return projections.tuned(source, request.values, request.centre) if request.values or request.centre else given

    def _middle(self, request: Request) -> tuple[float, float] | None:
        """Longitude and latitude of the map's centre: the dragged one, else that of the parameters."""
        if request.centre is not None:
            return request.centre
        middle = projections.tunable(self.policy.source(request.projection)).centre
        return middle and (request.values.get("lon_0", middle[0]), request.values.get("lat_0", middle[1]))
