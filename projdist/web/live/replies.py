"""What a page is told: blocks of a header and arrays, as `projdist.web.frames` has them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from projdist.web.frames import packed
from projdist.web.live.requests import Request


def reply(request: Request, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]] | None = None) -> bytes:
    """The reply to a request."""
    known = {"id": request.id, "kind": request.kind, "slot": request.slot}
    return packed(known | dict(header), arrays or {})


def failed(request: Request, reason: str) -> bytes:
    """A reply that tells why there is none."""
    return reply(request, {"problem": reason})


def progressed(request: Request, done: int, of: int) -> bytes:
    """How far the work on a request is."""
    return reply(request, {"progress": [done, of]})
