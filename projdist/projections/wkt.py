"""Well-known text of CRSs as a tree, and the faults that PROJ passes over in silence."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from projdist.projections.errors import ProjectionError
from projdist.support import shown

__all__ = ["WktNode", "check_wkt", "is_wkt", "parse_wkt", "with_spaces", "with_square_brackets"]

_TOKEN = re.compile(
    r"""\s*(?:(?P<text>"(?:[^"]|"")*")|(?P<open>[\[(])|(?P<close>[\])])|(?P<comma>,)|(?P<word>[^\s"\[\](),][^"\[\](),]*))"""
)
_VERTICAL = re.compile(r",\s*VERTCS\s*[\[(]")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
# How many numbers a node holds.
_NUMBERS = {
    "PARAMETER": 1,
    "PRIMEM": 1,
    "PRIMEMERIDIAN": 1,
    "SPHEROID": 2,
    "ELLIPSOID": 2,
    "UNIT": 1,
    "ANGLEUNIT": 1,
    "LENGTHUNIT": 1,
    "SCALEUNIT": 1,
    "BBOX": 4,
}
# WKT 1 has underscores where a name has spaces. `PROJ-based operation method: +proj=pipeline +step ...` is no name but
# what PROJ runs, and has none before a plus sign otherwise.
_PIPELINE = re.compile(r"PROJ-based[_ ]operation[_ ]method:[^\"]*")


@dataclass(frozen=True)
class WktNode:
    """A keyword in capitals with what stands in its brackets: texts without quotation marks, words, numbers, nodes."""

    keyword: str
    values: list[str] = field(default_factory=list)
    nodes: list[WktNode] = field(default_factory=list)

    @property
    def name(self) -> str:
        """The first of its texts, which most keywords have for a name."""
        return self.values[0] if self.values else ""

    @property
    def numbers(self) -> list[float]:
        """The numbers behind its name."""
        return [float(value) for value in self.values[1:] if _NUMBER.fullmatch(value)]

    def walk(self) -> Iterator[WktNode]:
        """The node, and all below it, from the first to the last."""
        waiting = [self]
        while waiting:
            node = waiting.pop()
            yield node
            waiting.extend(reversed(node.nodes))

    def find(self, *keywords: str) -> WktNode | None:
        """The first node below it, or itself, that has one of the keywords."""
        return next((node for node in self.walk() if node.keyword in keywords), None)


def is_wkt(text: str) -> bool:
    """Whether a text begins as WKT does: with a word and a bracket."""
    return re.match(r"\s*\w+\s*[\[(]", text) is not None


def parse_wkt(text: str) -> list[WktNode]:
    """The tree of WKT, or two where Esri has a comma and a VERTCS behind the first; raises ProjectionError."""
    roots: list[WktNode] = []
    waiting: list[WktNode] = []  # the nodes whose brackets are open
    word, at = "", 0
    while match := _TOKEN.match(text, at):
        at = match.end()
        if match["open"]:
            node = WktNode(word.upper())
            (waiting[-1].nodes if waiting else roots).append(node)
            waiting.append(node)
        elif word and waiting:
            waiting[-1].values.append(word)
        word = (match["word"] or "").strip()
        if match["text"] and waiting:
            waiting[-1].values.append(match["text"][1:-1].replace('""', '"'))
        if match["close"]:
            waiting.pop()
            behind = "" if waiting else text[at:].strip()
            if behind and not (len(roots) == 1 and _VERTICAL.match(behind)):
                raise _unreadable(text, f"WKT must end with its last bracket, and not with '{shown(behind)}'")
    if waiting:
        mark = f", or a quotation mark before '{shown(text[at:])}'" if text[at:].strip() else ""
        raise _unreadable(text, f"The closing bracket of {waiting[-1].keyword} is missing{mark}")
    return roots


def check_wkt(roots: list[WktNode], text: str) -> None:
    """Refuse numbers with decimal commas, and flattenings for their inverses; raises ProjectionError."""
    for node in (node for root in roots for node in root.walk()):
        numbers = node.values[1 if node.keyword != "BBOX" else 0 :]
        stray = [value for value in numbers if _NUMBER.fullmatch(value)]
        if len(stray) > _NUMBERS.get(node.keyword, len(stray)):
            raise _unreadable(
                text,
                f"{node.keyword} '{shown(node.name)}' has a comma within a number, {','.join(stray)}: write a point",
            )
        if node.keyword in ("SPHEROID", "ELLIPSOID") and len(stray) > 1 and 0.0 < float(stray[1]) < 1.0:
            raise _unreadable(
                text,
                f"{node.keyword} '{shown(node.name)}' has an inverse flattening of {stray[1]}, which is below 1: "
                f"a flattening of {stray[1]} is written as {1.0 / float(stray[1]):.9g}",
            )


def with_square_brackets(text: str) -> str:
    """The text with square brackets for round ones, which the standard allows and PROJ does not take for WKT."""
    square = {"(": "[", ")": "]"}
    return re.sub(r'"[^"]*"|[()]', lambda match: square.get(match[0], match[0]), text)


def with_spaces(text: str) -> str:
    """The text with the spaces of PROJ's pipelines in it where files of WKT 1 have underscores."""

    def mended(match: re.Match[str]) -> str:
        return re.sub(r"_(?=\+)", " ", match[0].replace("_operation_method:", " operation method:"))

    return _PIPELINE.sub(mended, text)


def _unreadable(text: str, reason: str) -> ProjectionError:
    return ProjectionError(f"Invalid projection '{shown(text)}'. {reason}.")
