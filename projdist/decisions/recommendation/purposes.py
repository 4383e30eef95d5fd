"""What a map is asked to keep."""

from __future__ import annotations

from projdist.decisions.properties import PROPERTIES
from projdist.support import close_words, did_you_mean, listed, quoted

__all__ = ["PURPOSES", "get_purpose", "suits"]

PURPOSES = ("any", *PROPERTIES, "compromise")


def get_purpose(name: str) -> str:
    """The purpose of a name; raises ValueError with close matches."""
    if not isinstance(name, str) or name not in PURPOSES:
        words = close_words(name.lower().replace("_", "-"), PURPOSES) if isinstance(name, str) else []
        hint = did_you_mean(words)
        raise ValueError(f"Invalid purpose {quoted(name)}. {hint}It must be {listed(PURPOSES, 'or')}.")
    return name


def suits(kept: tuple[str, ...], purpose: str) -> bool:
    """Whether a map with these properties serves a purpose; a compromise is what keeps none."""
    return purpose == "any" or purpose in kept or (purpose == "compromise" and not kept)
