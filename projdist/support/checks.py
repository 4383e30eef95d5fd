"""Checks of public arguments: each returns the normalised value or raises one clear ValueError; names by registry."""

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np

from projdist._typing import ArrayLike, FloatArray
from projdist.support.messages import close_words, did_you_mean, shown

_Kind = TypeVar("_Kind")
_Thing = TypeVar("_Thing")


def quoted(value: Any) -> str:
    """A value in quotation marks, for messages."""
    return f"'{shown(value if isinstance(value, str) else repr(value))}'"


def check_number(thing: str, value: Any) -> float:
    """A value as a float; booleans and text are refused."""
    if not isinstance(value, bool | str | bytes | np.ndarray):
        try:
            return float(value)
        except (TypeError, ValueError):
            pass  # raised below
    raise ValueError(f"Invalid {thing} {quoted(value)}. It must be a number.")


def check_bool(thing: str, value: Any) -> bool:
    """A boolean; other truth values are refused."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"Invalid {thing} {quoted(value)}. It must be True or False.")
    return bool(value)


def check_whole_number(thing: str, value: Any) -> int:
    """A value as a non-negative integer."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 0:
        raise ValueError(f"Invalid {thing} {quoted(value)}. It must be a whole number, 0 or more.")
    return int(value)


def check_numbers(thing: str, values: Any) -> FloatArray:
    """Values as an array of numbers."""
    if values is not None:
        try:
            return np.asarray(values, dtype=float)
        except (TypeError, ValueError):
            pass  # raised below
    raise ValueError(f"Invalid {thing} {quoted(values)}. They must be numbers.")


def check_pair(thing: str, value: Any) -> tuple[float, float]:
    """Two numbers."""
    pair = check_numbers(thing, value)
    if pair.shape != (2,):
        raise ValueError(f"Invalid {thing} {quoted(value)}. They must be two numbers.")
    return float(pair[0]), float(pair[1])


def check_degrees(lon: ArrayLike, lat: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Longitudes and latitudes as arrays of one shape, copies only where needed; infinite values become NaN."""
    pair = check_numbers("longitudes", lon), check_numbers("latitudes", lat)
    finite = (np.where(np.isinf(values), np.nan, values) if np.isinf(values).any() else values for values in pair)
    try:
        lons, lats = np.broadcast_arrays(*finite)
    except ValueError as error:
        shapes = " and ".join(str(values.shape) for values in pair)
        raise ValueError(f"Invalid points. Longitudes and latitudes of shapes {shapes} do not pair.") from error
    return lons, lats


class Registry(dict[str, _Thing], Generic[_Thing]):
    """Things of one kind by name.

    `aliases` maps further names to names. A misspelt name is compared with the words in `suggested`, by default the
    names. `rule` is the sentence in messages that says what is allowed, by default one of the names.
    """

    def __init__(
        self,
        kind: str,
        things: Mapping[str, _Thing],
        *,
        aliases: Mapping[str, str] | None = None,
        suggested: Collection[str] = (),
        rule: str = "",
    ) -> None:
        super().__init__(things)
        self.kind, self.aliases, self.suggested = kind, aliases or {}, suggested or tuple(things)
        self.rule = rule or f"It must be one of {', '.join(things)}."

    def named(self, name: Any) -> _Thing:
        """The thing with a name or alias; raises ValueError with close words."""
        if isinstance(name, str) and (found := self.aliases.get(name, name)) in self:
            return self[found]
        text = name.lower().replace("-", "_").replace(" ", "_") if isinstance(name, str) else ""
        hint = did_you_mean(close_words(text, self.suggested))
        raise ValueError(f"Invalid {self.kind} {quoted(name)}. {hint}{self.rule}")


def check_choice(thing: str, value: Any, allowed: Collection[str]) -> str:
    """One of the allowed words."""
    return Registry(thing, {word: word for word in allowed}).named(value)


def check_text(thing: str, value: Any) -> str:
    """A value that is text."""
    return check_instance(thing, value, str, "text")


def check_path(thing: str, value: Any) -> Path:
    """A path from text or a path."""
    try:
        return Path(value)
    except TypeError as error:
        raise ValueError(f"Invalid {thing} {quoted(value)}. It must be the path of a file.") from error


def check_raster(image: Any, bands: Iterable[int], text: str) -> None:
    """Raise ValueError that begins with `text` for an open raster without a transform or of complex numbers."""
    # Without a transform GDAL takes rows and columns as coordinates; a real array loses the imaginary part.
    if image.transform.is_identity:
        raise ValueError(f"{text} It does not state where its pixels lie: it has no transform.")
    for band in bands:
        if image.dtypes[band - 1].startswith("complex"):
            raise ValueError(f"{text} Band {band} has complex numbers; they must be real.")


def check_instance(thing: str, value: Any, kind: type[_Kind], what: str) -> _Kind:
    """A value of the type `kind`, which the message describes as `what`."""
    if not isinstance(value, kind):
        raise ValueError(f"Invalid {thing} {quoted(value)}. It must be {what}.")
    return value


def listed_values(values: Any, one: tuple[type, ...] = (str,)) -> list[Any]:
    """The values of an iterable as a list; a value of the types `one`, or not iterable, as a list of itself."""
    return list(values) if isinstance(values, Iterable) and not isinstance(values, (*one, bytes)) else [values]
