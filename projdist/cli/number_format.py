"""Formats of numbers with the digits that their errors allow, of areas, shares and names."""

from __future__ import annotations

import math

from projdist import regions

_DIGITS = 5
_MOST_DECIMALS = 10  # a tenth of a millimetre in 1000 km
_LONGEST_LABEL = 60
_LARGE = 1e6  # from where on a number has an exponent
_ROUNDING = 1e-5  # an error up to which what is no more is nothing, in the unit of any figure
WHOLE = 0.9999995
"""A share that is shown as 100 %."""


def rounded(value: float | None, error: float | None) -> str:
    """A number with at most six decimals or four significant digits, and only certain ones.

    A value within its error is shown with the error, one within rounding as zeros.
    """
    if value is None:
        return "-"
    if error and error > _ROUNDING and abs(value) <= error:
        return with_error(value, error)
    wanted = max(6, 3 - math.floor(math.log10(abs(value)))) if value else 6
    good = math.floor(-math.log10(error)) if error else wanted
    decimals = max(0, min(wanted, good, _MOST_DECIMALS))
    if error and abs(value) > error and round(value, decimals) == 0.0:
        decimals += 1  # its first digit is doubtful, and says more than a zero
    return f"{value:.{decimals}f}"


def certain(value: float | None, error: float | None = None) -> str:
    """A number with at most five significant digits, and only certain ones.

    A value within its error is shown with the error, one within rounding as 0.
    """
    if value is None:
        return "-"
    if error and error > _ROUNDING and abs(value) <= error:
        return with_error(value, error)
    if not error or not value or math.isinf(value):
        return f"{value:.{_DIGITS}g}"
    if abs(value) <= error:
        return "0"
    before = math.floor(math.log10(abs(value))) + 1
    good = before + math.floor(-math.log10(error))
    return f"{value:.{max(1, min(_DIGITS, good))}g}"


def with_error(value: float, error: float) -> str:
    """A value and its error: `0.12346 +- 3e-09`, or within the error `327 +- 27,000`."""
    if error > _ROUNDING and abs(value) <= error:
        return f"{_plain(value, 3)} +- {_plain(error, 2)}"
    return f"{rounded(value, error)} +- {first_digit(error)}"


def _plain(value: float, digits: int) -> str:
    """A number with significant digits and thousands separators; an exponent from a million on."""
    few = float(f"{value:.{digits}g}")
    return f"{few:,.0f}" if 10.0 ** (digits - 1) <= abs(few) < _LARGE else f"{few:.{digits}g}"


def fixed(value: float, decimals: int, sign: str = "") -> str:
    """A number with fixed decimals, never "-0.00"."""
    return f"{round(value, decimals) + 0.0:{sign}.{decimals}f}"


def first_digit(error: float) -> str:
    """An error with one digit."""
    return f"{error:.0e}"


def per_cent(share: float, digits: int = 4) -> str:
    """A share in per cent."""
    return f"{100.0 * share:.{digits}g} %"


def change(ratio: float) -> str:
    """Relative change of a ratio, in per cent with sign."""
    return f"{100.0 * (ratio - 1.0):+.2f} %" if abs(ratio) < math.inf else "-"


def area_text(km2: float) -> str:
    """An area in km2."""
    return f"{km2:,.0f} km2" if km2 >= 100 else f"{km2:.3g} km2"


def size_text(region: regions.Place) -> str:
    """Area of a region, or the number of its points."""
    return f"{region.lon.size:,} points" if isinstance(region, regions.PointSet) else area_text(region.area_km2)


def covers(coverage: float) -> list[str]:
    """A note on the covered share of the region, if it is not all."""
    return [f"Covers {per_cent(coverage)} of the region."] if coverage < WHOLE else []


def shortened(text: str, most: int) -> str:
    """A text of at most so many characters."""
    return text if len(text) <= most else f"{text[: most - 3].rstrip()}..."


def label_of(given: str, name: str) -> str:
    """The projection as given, or its name if that is long, as WKT, or a number alone."""
    return name if len(given) > _LONGEST_LABEL or "\n" in given or given.isdecimal() else given
