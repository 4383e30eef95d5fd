"""The words of pictures: a map's title, and numbers as print has them."""

from __future__ import annotations

import re
from typing import Any

from projdist.projections import Projection

_LONGEST = 64  # letters
_CODE = re.compile(r"\w+:[\w.]+")


def title_of(projection: Projection) -> str:
    """A map's name as it is printed; of a CRS its code, too, and of a long name what there is room for."""
    code = projection.definition if _CODE.fullmatch(projection.definition) else ""
    return shortened(f"{code} · {projection.name}" if code else projection.name)


def titles_for(given: Any, own: list[str]) -> list[str]:
    """The titles given for maps, None standing for a map's own; raises ValueError where there is not one for each."""
    if given is None:
        return own
    if not isinstance(given, list | tuple) or len(given) != len(own):
        raise ValueError(f"Invalid titles. There must be one for each of {len(own)} maps.")
    return [name if title is None else str(title) for name, title in zip(own, given, strict=True)]


def shortened(text: str, longest: int = _LONGEST) -> str:
    """Whole words of a long text, and an ellipsis."""
    if len(text) <= longest:
        return text
    cut = text[: longest - 1]
    return f"{cut.rpartition(' ')[0] or cut}".rstrip(" /,(·-") + "…"


def with_minus(text: str) -> str:
    """A text whose numbers have a true minus sign, U+2212."""
    return re.sub(r"(?<![\w.)\]])-(?=\.?\d)|(?<=\de)-(?=\d)", "\N{MINUS SIGN}", text)
