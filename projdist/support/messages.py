"""Texts of messages, hints for misspelt words, and notices."""

from __future__ import annotations

import contextlib
import difflib
import sys
import warnings
from collections.abc import Collection, Iterator, Sequence
from contextvars import ContextVar

# Finds 98 % of names with one letter wrong, missing, doubled or transposed, and hardly any unrelated one.
NEAR = 0.75  # cutoff of difflib's similarity
_SHORTEST_BEGINNING = 3  # letters
_LONGEST_WORD = 200
_LONGEST_SHOWN, _LONGEST_READ, _LONGEST_LINE = 80, 2000, 300
_ADVICE = (".; ", ". It might help")  # start of GDAL's advice to programmers
_ELSEWHERE = "See previous exception"  # rasterio's text if the cause has the message


def shown(text: str) -> str:
    """Text for a message: on one line, shortened."""
    line = " ".join(text[:_LONGEST_READ].split())
    return line if len(line) <= _LONGEST_SHOWN and len(text) <= _LONGEST_READ else f"{line[: _LONGEST_SHOWN - 3]}..."


def one_line(error: BaseException | str) -> str:
    """A library's message as one shortened sentence without its full stop."""
    text = " ".join(str(error).split())
    if isinstance(error, UnicodeEncodeError):  # from a library that takes file names as text
        return f"'{error.object.rpartition('/')[2]}' is not text in UTF-8, as the name of such a file must be"
    if isinstance(error, BaseException) and _ELSEWHERE in text:
        while error.__cause__ is not None:
            error = error.__cause__
        return f"it is damaged or cut short ({one_line(str(error))})"
    for advice in _ADVICE:
        text = text.partition(advice)[0]
    text = text.rstrip(".")
    return text if len(text) <= _LONGEST_LINE else f"{text[: _LONGEST_LINE - 3]}..."


def close_words(text: str, known: Collection[str]) -> list[str]:
    """Known words that begin with the text, else close spellings; empty if none is close."""
    if len(text) > _LONGEST_WORD:  # more than twice the longest known word
        return []
    beginning = text.replace("_", "")
    long_enough = len(beginning) >= _SHORTEST_BEGINNING
    begun = [word for word in known if long_enough and word.replace("_", "").startswith(beginning)]
    return begun or difflib.get_close_matches(text, known, n=3, cutoff=NEAR)


def listed(words: Sequence[str], conjunction: str) -> str:
    """`a, b and c`."""
    return f" {conjunction} ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


def did_you_mean(words: Sequence[str]) -> str:
    """The question and a space, such as `Did you mean a or b? `; "" without words."""
    return f"Did you mean {listed(words, 'or')}? " if words else ""


# ---- notices -------------------------------------------------------------------------------------

_KEPT: ContextVar[list[str] | None] = ContextVar("kept", default=None)


class Notice(UserWarning):
    """Warning of projdist: doubtful input, omissions, results near a limit."""


def tell(text: str) -> None:
    """Warn with a Notice at the user's line that called projdist."""
    kept = _KEPT.get()
    if kept is not None:
        kept.append(text)
        return
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "projdist":
        level, frame = level + 1, frame.f_back
    warnings.warn(text, Notice, stacklevel=level)


@contextlib.contextmanager
def notices_kept() -> Iterator[list[str]]:
    """Context that collects the notices of this thread in a list instead of warning."""
    messages: list[str] = []
    token = _KEPT.set(messages)
    try:
        yield messages
    finally:
        _KEPT.reset(token)
