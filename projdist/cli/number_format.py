"""What stands in the cells of tables and in titles: numbers with the digits that their errors allow, and names."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from projdist.regions import Place

_DIGITS = 5
_MOST_DECIMALS = 10  # a tenth of a millimetre in 1000 km
_LONGEST_LABEL = 60
_LARGE = 1e6  # from where on a number has an exponent
_ROUNDING = 1e-5  # an error up to which what is no more is nothing, in the unit of any figure
WHOLE = 0.9999995
"""A share that is shown as 100 %."""


def rounded(value: float | None, error: float | None) -> str:
    """At most six decimals or four significant digits, and none that the error makes doubtful.

    Of a figure that is no more than its error both are shown; one that is nothing but rounding has zeros.
    """
    if value is None:
        return "-"
    if error and _is_swallowed(value, error):
        return with_error(value, error)
    wanted = max(6, 3 - math.floor(math.log10(abs(value)))) if value else 6
    good = math.floor(-math.log10(error)) if error else wanted
    decimals = max(0, min(wanted, good, _MOST_DECIMALS))
    if error and abs(value) > error and round(value, decimals) == 0.0:
        decimals += 1  # its first digit is doubtful, and says more than a zero
    return f"{value:.{decimals}f}"


def certain(value: float | None, error: float | None = None) -> str:
    """Five significant digits at most, and none that the error makes doubtful.

    Of a figure that is no more than its error both are shown; one that is nothing but rounding is 0.
    """
    if value is None:
        return "-"
    if error and _is_swallowed(value, error):
        return with_error(value, error)
    if not error or not value or math.isinf(value):
        return f"{value:.{_DIGITS}g}"
    if abs(value) <= error:
        return "0"
    before = math.floor(math.log10(abs(value))) + 1
    good = before + math.floor(-math.log10(error))
    return f"{value:.{max(1, min(_DIGITS, good))}g}"


def with_error(value: float, error: float) -> str:
    """A figure and its error: `0.12346 +- 3e-09`, or of what is no more than that `327 +- 27,000`."""
    if _is_swallowed(value, error):
        return f"{_plain(value, 3)} +- {_plain(error, 2)}"
    return f"{rounded(value, error)} +- {first_digit(error)}"


def _is_swallowed(value: float, error: float) -> bool:
    """Whether a figure is no more than its error, and that is more than rounding."""
    return error > _ROUNDING and abs(value) <= error


def _plain(value: float, digits: int) -> str:
    """A number to so many digits, with commas, and without an exponent below a million."""
    few = float(f"{value:.{digits}g}")
    return f"{few:,.0f}" if 10.0 ** (digits - 1) <= abs(few) < _LARGE else f"{few:.{digits}g}"


def fixed(value: float, decimals: int, sign: str = "") -> str:
    """So many decimals, and no "-0.00"."""
    return f"{round(value, decimals) + 0.0:{sign}.{decimals}f}"


def first_digit(error: float) -> str:
    """The size of an error."""
    return f"{error:.0e}"


def per_cent(share: float, digits: int = 4) -> str:
    """A share."""
    return f"{100.0 * share:.{digits}g} %"


def change(ratio: float) -> str:
    """By how much something is more than something else, of which it is a ratio."""
    return f"{100.0 * (ratio - 1.0):+.2f} %" if abs(ratio) < math.inf else "-"


def area_text(km2: float) -> str:
    """An area in words, small ones with their digits."""
    return f"{km2:,.0f} km2" if km2 >= 100 else f"{km2:.3g} km2"


def size_text(region: Place) -> str:
    """How large a region is, in words: its area, or how many points it has."""
    from projdist.regions import PointSet  # loads numpy, which --version does without

    return f"{region.lon.size:,} points" if isinstance(region, PointSet) else area_text(region.area_km2)


def covers(coverage: float) -> list[str]:
    """A line on what share of a region a map covers, if it is not all."""
    return [f"Covers {per_cent(coverage)} of the region."] if coverage < WHOLE else []


def label_of(given: str, name: str) -> str:
    """A projection as it was given, or, as WKT may be long, by its name."""
    return given if len(given) <= _LONGEST_LABEL and "\n" not in given else name
