"""Answers in words: numbers with their certain digits, errors in everyday terms, regions and maps by name."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from projdist import decisions, earth, regions, support

# ---- numbers -------------------------------------------------------------------------------------


_DIGITS = 5
_MOST_DECIMALS = 10  # a tenth of a millimetre in 1000 km
_LONGEST_LABEL = 60
_WORDS = re.compile(r"[\w-]+( [\w-]+)+")  # by which a CRS was found
_PLAIN = re.compile(r"\+proj=\w+ \+R=\S+|[\w+=@,-]*[a-z][\w+=@,-]*")  # its name says it all
_LARGE = 1e6  # from here on, numbers have an exponent
_ROUNDING = 1e-5  # a figure within an error up to this, in its unit, is shown as zero
WHOLE = 0.9999995
"""A share that is shown as 100 %."""


def rounded(value: float | None, error: float | None) -> str:
    """A number with at most six decimals or four significant digits, and only certain ones."""
    # A value within its error is shown with the error, one within rounding as zeros.
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
    """A number with at most five significant digits, and only certain ones."""
    # A value within its error is shown with the error, one within rounding as 0.
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
    return f"{rounded(value, error)} +- {error:.0e}"


def _plain(value: float, digits: int) -> str:
    """A number with so many significant digits and thousands separators, from a million on with an exponent."""
    few = float(f"{value:.{digits}g}")
    return f"{few:,.0f}" if 10.0 ** (digits - 1) <= abs(few) < _LARGE else f"{few:.{digits}g}"


def fixed(value: float, decimals: int, sign: str = "") -> str:
    """A number with fixed decimals, never "-0.00"."""
    return f"{round(value, decimals) + 0.0:{sign}.{decimals}f}"


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
    """A text cut to at most so many characters."""
    return text if len(text) <= most else f"{text[: most - 3].rstrip()}..."


def label_of(given: str, name: str) -> str:
    """The projection as given, or its name if that is unclear: long like WKT, a bare number, or words."""
    unclear = len(given) > _LONGEST_LABEL or "\n" in given or given.isdecimal() or _WORDS.fullmatch(given)
    return name if unclear else given


def spoken(given: str, name: str) -> str:
    """The projection in a sentence: Robinson for robin, else its label."""
    return name if _PLAIN.fullmatch(given) else label_of(given, name)


def caption(code: str, name: str) -> str:
    """A map by its name and its code: Robinson (robin)."""
    plain = regions.folded(name)
    return name if plain == regions.folded(code) else f"{name.replace('_', ' ')} ({code})"


# ---- errors, places and maps -----------------------------------------------------------------------


_SMALL = 0.02  # relative error below which the text is 1 in so many
_TRUE = 1e-7  # a relative error that is rounding: a centimetre in 100 km
_TRUE_DEGREES = 1e-5  # an angle that is rounding: 0.04 seconds of arc
_ROUND = 179.0  # degrees; from here on, an angle is off by any amount
_WHOLE_PER_CENT = 0.1  # error from which on the text is in whole per cent
_SAME = 1.0005  # ratio below which two distortions are called equal
_TIMES = 2.0  # ratio below which the text is in per cent, above in times
TRUE, NO_BOUND = "true", "without bound"
_CODE, _MAIN = re.compile(r" \([A-Z]{2}\)"), ", main part"  # of a region's title
_SEAS = (" Atlantic", " Pacific", " Ocean", " Sea")


def _digits(value: float, round_to: float) -> float:
    """A number with two digits, rounded up or, for `round_to` -1, down."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return round_to * math.ceil(round(round_to * value / step, 6)) * step


def up(value: float) -> str:
    """A number rounded up to two digits, so that it stays a bound."""
    return f"{_digits(value, 1.0):,.10g}"


def distance_error(error: float) -> str:
    """The largest relative error of distances: `1 in 2,500`, `12 %`, a factor; a bound that holds."""
    return f"1 in {_digits(1.0 / error, -1.0):,.0f}" if _TRUE <= error < _SMALL else area_error(error)


def area_error(error: float) -> str:
    """The largest relative error of areas: `0.08 %`, or from 100 % on a factor; a bound that holds."""
    if error < _TRUE:
        return TRUE
    if not math.isfinite(error):
        return NO_BOUND
    return f"{up(100.0 * error)} %" if error < 1.0 else f"a factor of {up(1.0 + error)}"


def angle_error(degrees: float) -> str:
    """The largest error of angles: `0.52°`; a bound that holds."""
    if degrees < _TRUE_DEGREES:
        return TRUE
    return NO_BOUND if not degrees < _ROUND else f"{up(degrees)}°"


def errors_text(distances: float, areas: float, degrees: float, *, mean: bool = False) -> str:
    """Errors in a sentence: distances are off by at most 1 in 560 and areas by 0.36 %; angles are true."""
    # Those of distances and areas are relative. Infinite ones, and angles that turn right round, are without bound.
    told = {"distances": distance_error(distances), "areas": area_error(areas), "angles": angle_error(degrees)}
    return error_sentence(told, mean=mean)


def error_sentence(told: Mapping[str, str], *, mean: bool = False) -> str:
    """A sentence of errors in words, given by the thing that is off."""
    off = [f"{what} by {text}" for what, text in told.items() if text not in (TRUE, NO_BOUND)]
    are = " are off by " if mean else " are off by at most "
    parts = [support.listed(off, "and").replace(" by ", are, 1)] if off else []
    for text, words in ((NO_BOUND, "off without bound"), (TRUE, "true")):
        those = [what for what, error in told.items() if error == text]
        parts += [f"{support.listed(those, 'and')} are {words}"] if those else []
    return f"{'on average ' * mean}{'; '.join(parts)}"


def distortion_text(found: decisions.Distortion) -> str:
    """The errors of a map over a region, the largest, or the mean ones where those have no bound."""
    of = "max" if math.isfinite(found.max_scale_error_ppm) else "mean"
    scale, area, angle = (
        getattr(found, f"{of}_{figure}") for figure in ("scale_error_ppm", "areal_error_ppm", "omega")
    )
    return errors_text(1e-6 * scale, 1e-6 * area, angle, mean=of == "mean")


def rms_text(error: float) -> str:
    """An Airy-Kavrayskiy error as the RMS of the scale errors along the axes of the indicatrices: 0.028 %."""
    rms = math.expm1(error / math.sqrt(2.0))
    return f"{100.0 * rms:.2g} %" if rms < _WHOLE_PER_CENT else f"{100.0 * rms:,.0f} %"


def times_text(ratio: float) -> str:
    """How much more distortion, by the ratio: 57 % more, or 3.4 times as much."""
    if ratio < _SAME:
        return "as much"
    if ratio < _TIMES:
        return f"{100.0 * (ratio - 1.0):.2g} % more"
    return f"{float(f'{ratio:.2g}'):,.10g} times as much"


def less_text(ratio: float) -> str:
    """How much less distortion, by the ratio of the larger to the smaller: 36 % less."""
    return f"{min(99.0, 100.0 * (1.0 - 1.0 / ratio)):.2g} % less"


def place_text(lon: float, lat: float) -> str:
    """A place in degrees: 7.44°E 45.82°N."""
    return f"{earth.longitude_text(round(lon, 2))} {earth.latitude_text(round(lat, 2))}"


def region_words(region: regions.Place) -> str:
    """A region in a sentence: Kenya, the globe, the land."""
    title = _CODE.sub("", regions.region_title(region))
    if isinstance(region, regions.PointSet):
        return f"the {region.lon.size:,} point{'s' * (region.lon.size > 1)} of {title}"
    words = with_article(title.removesuffix(_MAIN))
    return f"the main part of {words}" if title.endswith(_MAIN) else words


def with_article(name: str) -> str:
    """The name of a place in a sentence: the Philippines, the South Pacific."""
    known = name in {row["name"] for row in earth.data_rows("names_with_article.csv")}
    return f"the {name}" if known or name.startswith("United ") or name.endswith(_SEAS) else name


def named(code: str, name: str) -> str:
    """A map by its code and its name."""
    return code if name == code or not name else f"{code} ({name.replace('_', ' ')})"
