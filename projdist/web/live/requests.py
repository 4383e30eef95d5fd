"""What a page asks: messages in JSON, checked field by field."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from projdist.support import shown

LONGEST_MESSAGE = 64 * 1024
"""Bytes of a message; files that are dropped on the page come apart from that."""

LARGEST_FILE = 20 * 1024 * 1024
"""Bytes of a file."""

STOP = "stop"
"""The kind of a message that no process answers: it ends what is done for a kind, its `options["what"]`."""

LANES = {
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
"""The kinds of requests, and which process answers them: pictures must not wait for one that takes seconds."""

_FIELDS = {"id", "kind", "slot", "projection", "values", "centre", "region", "beside", "options"}
_MOST_VALUES, _MOST_BESIDE, _MOST_OPTIONS = 40, 12, 20
_LONGEST_TEXT = 20_000
_LARGEST = 1e300


@dataclass(frozen=True, kw_only=True)
class Request:
    """A request: its number, what it is for, which map of the page, and that map with its region.

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
    """A message that is no request."""


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
    if not isinstance(kind, str) or kind not in (*LANES, STOP):
        raise RequestError(f"Invalid kind '{shown(str(kind))}'. It must be one of {', '.join(LANES)}.")
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
