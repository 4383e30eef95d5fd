"""Values that people give, checked at the public door; hints for misspelt words; notices beside an answer."""

from __future__ import annotations

import contextlib
import difflib
import sys
import warnings
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray

__all__ = [
    "Notice",
    "check_bool",
    "check_choice",
    "check_degrees",
    "check_instance",
    "check_number",
    "check_numbers",
    "check_pair",
    "check_path",
    "check_raster",
    "check_text",
    "check_whole_number",
    "listed_values",
    "notices_kept",
    "quoted",
    "tell",
]


# Finds 98 of 100 names with one letter wrong, missing, doubled or transposed, and hardly an unrelated one.
NEAR = 0.75
_SHORTEST_BEGINNING = 3  # letters
_LONGEST_WORD = 200
_LONGEST_SHOWN, _LONGEST_READ, _LONGEST_LINE = 80, 2000, 300
_ADVICE = (".; ", ". It might help")  # GDAL's, on how to call it
_ELSEWHERE = "See previous exception"  # rasterio's words, where what it was is told by the error before


def shown(text: str) -> str:
    """Text for a message: on one line, and not too long."""
    line = " ".join(text[:_LONGEST_READ].split())
    return line if len(line) <= _LONGEST_SHOWN and len(text) <= _LONGEST_READ else f"{line[: _LONGEST_SHOWN - 3]}..."


def one_line(error: BaseException | str) -> str:
    """A library's message as one sentence without its full stop, and not too long: some quote what they cannot read."""
    text = " ".join(str(error).split())
    if isinstance(error, UnicodeEncodeError):  # of a library that is told of a file by text
        return f"'{error.object.rpartition('/')[2]}' is no text in UTF-8, as the name of such a file must be"
    if isinstance(error, BaseException) and _ELSEWHERE in text:
        while error.__cause__ is not None:
            error = error.__cause__
        return f"it is damaged or cut short ({one_line(str(error))})"
    for advice in _ADVICE:
        text = text.partition(advice)[0]
    text = text.rstrip(".")
    return text if len(text) <= _LONGEST_LINE else f"{text[: _LONGEST_LINE - 3]}..."


def close_words(text: str, known: Collection[str]) -> list[str]:
    """Words that begin with the text, or else are spelt nearly so; none for nonsense."""
    if len(text) > _LONGEST_WORD:  # longer than twice any that is known
        return []
    beginning = text.replace("_", "")
    long_enough = len(beginning) >= _SHORTEST_BEGINNING
    begun = [word for word in known if long_enough and word.replace("_", "").startswith(beginning)]
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


# ---- notices -------------------------------------------------------------------------------------


_KEPT: ContextVar[list[str] | None] = ContextVar("kept", default=None)


class Notice(UserWarning):
    """What projdist warns of: input that may not be what was meant, what was left out, what is close to wrong."""


def tell(text: str) -> None:
    """Warn with a Notice, at the line of the user's that called projdist."""
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
    """A list of the notices told within it, in this thread, in place of warnings."""
    told: list[str] = []
    token = _KEPT.set(told)
    try:
        yield told
    finally:
        _KEPT.reset(token)


# ---- checks --------------------------------------------------------------------------------------


_Kind = TypeVar("_Kind")


def quoted(value: Any) -> str:
    """A value for a message, in quotation marks."""
    return f"'{shown(value if isinstance(value, str) else repr(value))}'"


def check_number(thing: str, value: Any) -> float:
    """A value as a number; True and text are none."""
    if not isinstance(value, bool | str | bytes | np.ndarray):
        try:
            return float(value)
        except (TypeError, ValueError):
            pass  # said below
    raise ValueError(f"Invalid {thing} {quoted(value)}. It must be a number.")


def check_bool(thing: str, value: Any) -> bool:
    """A value that is True or False, and nothing like it."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"Invalid {thing} {quoted(value)}. It must be True or False.")
    return bool(value)


def check_whole_number(thing: str, value: Any) -> int:
    """A value as a whole number that is not negative."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 0:
        raise ValueError(f"Invalid {thing} {quoted(value)}. It must be a whole number, 0 or more.")
    return int(value)


def check_numbers(thing: str, values: Any) -> FloatArray:
    """Values as an array of numbers."""
    if values is not None:
        try:
            return np.asarray(values, dtype=float)
        except (TypeError, ValueError):
            pass  # said below
    raise ValueError(f"Invalid {thing} {quoted(values)}. They must be numbers.")


def check_pair(thing: str, value: Any) -> tuple[float, float]:
    """Two numbers."""
    pair = check_numbers(thing, value)
    if pair.shape != (2,):
        raise ValueError(f"Invalid {thing} {quoted(value)}. They must be two numbers.")
    return float(pair[0]), float(pair[1])


def check_degrees(lon: ArrayLike, lat: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Longitudes and latitudes as arrays of one shape; what is not finite is NaN."""
    pair = check_numbers("longitudes", lon), check_numbers("latitudes", lat)
    try:
        lons, lats = np.broadcast_arrays(*(np.where(np.isfinite(values), values, np.nan) for values in pair))
    except ValueError as error:
        shapes = " and ".join(str(values.shape) for values in pair)
        raise ValueError(f"Invalid points. Longitudes and latitudes of shapes {shapes} are no pairs.") from error
    return lons, lats


def check_choice(thing: str, value: Any, allowed: Collection[str], *, also: str = "") -> str:
    """One of the words that are allowed; `also` tells what else would be taken."""
    if isinstance(value, str) and value in allowed:
        return value
    hint = suggestion(value, allowed) if isinstance(value, str) else ""
    raise ValueError(f"Invalid {thing} {quoted(value)}. {hint}It must be one of {', '.join(allowed)}{also}.")


def check_text(thing: str, value: Any) -> str:
    """A value that is text."""
    return check_instance(thing, value, str, "text")


def check_path(thing: str, value: Any) -> Path:
    """A path of text or of a path."""
    try:
        return Path(value)
    except TypeError as error:
        raise ValueError(f"Invalid {thing} {quoted(value)}. It must be the path of a file.") from error


def check_raster(image: Any, bands: Iterable[int], text: str) -> None:
    """Raise ValueError, which begins with `text`, for an open raster of rasterio without a place or of complex numbers.

    Without a transform GDAL takes rows and columns for coordinates; of complex numbers a real array keeps a part.
    """
    if image.transform.is_identity:
        raise ValueError(f"{text} It does not state where its pixels lie: it has no transform.")
    for band in bands:
        if image.dtypes[band - 1].startswith("complex"):
            raise ValueError(f"{text} Band {band} has complex numbers; they must be real.")


def check_instance(thing: str, value: Any, kind: type[_Kind], what: str) -> _Kind:
    """A value that is of a type of projdist's."""
    if not isinstance(value, kind):
        raise ValueError(f"Invalid {thing} {quoted(value)}. It must be {what}.")
    return value


def listed_values(values: Any, one: tuple[type, ...] = (str,)) -> list[Any]:
    """The values of an iterable; what is no iterable, or of a type that is one value, stands alone."""
    if isinstance(values, (*one, bytes)) or not isinstance(values, Iterable):
        return [values]
    return list(values)
