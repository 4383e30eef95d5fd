"""Longitudes and latitudes as people write them."""

from __future__ import annotations

import numpy as np

__all__ = ["latitude_text", "longitude_text"]


def longitude_text(lon: float, *, minutes: bool = False) -> str:
    """A longitude in degrees as 10.5°E, or in degrees, minutes and seconds as 10°30′E."""
    turned = (lon + 180.0) % 360.0 - 180.0
    return _text(180.0 if turned == -180.0 else turned, "EW", 180.0, minutes)


def latitude_text(lat: float, *, minutes: bool = False) -> str:
    """A latitude in degrees as 10.5°S, or in degrees, minutes and seconds as 10°30′S."""
    return _text(lat, "NS", 90.0, minutes)


def _text(value: float, letters: str, end: float, minutes: bool) -> str:
    # The equator, the first meridian and the one opposite to it are on neither side.
    letter = "" if value == 0.0 or (end == 180.0 and value == end) else letters[int(value < 0)]
    return f"{_sexagesimal(abs(value)) if minutes else f'{abs(value):.7g}°'}{letter}"


def _sexagesimal(value: float) -> str:
    """Degrees with as many of minutes, seconds and hundredths of them as there are."""
    hundredths = int(np.rint(value * 360_000.0))
    degrees, rest = divmod(hundredths, 360_000)
    minutes, seconds = divmod(rest, 6_000)
    text = f"{degrees}°"
    if rest:
        text += f"{minutes:02d}′"
    if seconds:
        text += f"{seconds / 100.0:05.2f}".rstrip("0").rstrip(".") + "″"
    return text
