"""People's tables of text: cells that stand apart by commas, semicolons, tabs or spaces, and comment lines with #.

A row is a line: a quotation mark that is not closed on its line would else swallow those that follow. Numbers may have
decimal commas where cells stand apart by anything else.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from projdist.support.messages import tell

NumberedRow = tuple[int, list[str]]

_WITH_COMMA = re.compile(r"\s*[+-]?\d+,\d+(?:[eE][+-]?\d+)?\s*")
_WITH_POINT = re.compile(r"\s*[+-]?(?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)?\s*")
_WHOLE = re.compile(r"\s*[+-]?\d+\s*")
_THOUSANDS = re.compile(r"\s*[+-]?[1-9]\d{0,2},\d{3}\s*")
_HINT = " Decimal commas are read where all numbers have them and cells stand apart by semicolons, tabs or blanks."


def read_text(path: Path, complaint: str) -> str:
    """The text of a file in UTF-8; raises ValueError that begins with the complaint."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:  # a ValueError for what is not UTF-8, and for names that no file has
        reason = error.strerror if isinstance(error, OSError) else error
        raise ValueError(f"{complaint} It cannot be read as text: {reason}.") from error


def numbered_rows(path: Path, complaint: str, *, comments: bool = True) -> list[NumberedRow]:
    """The rows of a file and the numbers of their lines, as those of a text; raises ValueError."""
    return rows_of_text(read_text(path, complaint), complaint, comments=comments)


def rows_of_text(text: str, complaint: str, *, comments: bool = True) -> list[NumberedRow]:
    """The rows of a text and the numbers of their lines; raises ValueError that begins with the complaint.

    What separates the cells is told by the first row. Rows of empty cells are left out, and, if there may be
    `comments`, lines that begin with #. No row has more cells than the first, but for empty ones. Decimal commas have
    become points.
    """
    lines = [(number, line) for number, line in enumerate(text.splitlines(), start=1) if line.strip()]
    if comments:
        lines = [(number, line) for number, line in lines if not line.lstrip().startswith("#")]
    try:
        rows = split_rows(lines, separator_of(lines[0][1])) if lines else []
    except ValueError as error:
        raise ValueError(f"{complaint} Line {error}") from error
    rows = [(number, row) for number, row in rows if any(cell.strip() for cell in row)]
    if not rows:
        raise ValueError(f"{complaint} It is empty.")
    return with_decimal_points(rows)


def separator_of(line: str) -> str | None:
    """What stands between the cells of a line; None for blanks, also where all commas are within numbers."""
    words = line.split()
    if not (";" in line or "\t" in line) and len(words) > 1 and all(map(_is_decimal, words)):
        return None
    return next((mark for mark in ";\t," if mark in line), None)


def _is_decimal(word: str) -> bool:
    """Whether a word is a number, perhaps with a decimal comma."""
    return has_decimal_comma(word) or is_number(word)


def split_rows(lines: Iterable[tuple[int, str]], separator: str | None) -> list[NumberedRow]:
    """The cells of numbered lines, none of which has more than the first; raises ValueError from the number on."""
    rows: list[NumberedRow] = []
    for number, line in lines:
        try:
            row = cells_of(line, separator)
        except ValueError as error:
            raise ValueError(f"{number} has {error}.") from error
        width = len(rows[0][1]) if rows else len(row)
        if any(cell.strip() for cell in row[width:]):
            hint = _HINT if separator == "," and all(map(_WHOLE.fullmatch, row)) else ""
            raise ValueError(f"{number} has {len(row)} cells; it must have {width}.{hint}")
        rows.append((number, row[:width]))
    return rows


def with_decimal_points(rows: Sequence[NumberedRow]) -> list[NumberedRow]:
    """Rows with decimal points in place of commas, unless any of their numbers has a point already."""
    commas = [cell for _, row in rows for cell in row if "," in cell and has_decimal_comma(cell)]
    if not commas or any("." in cell and _WITH_POINT.fullmatch(cell) for _, row in rows for cell in row):
        return list(rows)
    if all(map(_THOUSANDS.fullmatch, commas)):
        tell(f"'{commas[0].strip()}' is read as a number with a decimal comma, not as thousands.")
    return [
        (number, [cell.replace(",", ".") if has_decimal_comma(cell) else cell for cell in row]) for number, row in rows
    ]


def has_decimal_comma(cell: str) -> bool:
    """Whether a cell is a number with a decimal comma."""
    return _WITH_COMMA.fullmatch(cell) is not None


def comma_hint(cells: Iterable[str]) -> str:
    """A sentence on decimal commas where a cell that is no number has one, else nothing."""
    return _HINT if any(map(has_decimal_comma, cells)) else ""


MISSING = ("", "NA", "<NA>")
"""What stands in the cells of texts where there is nothing."""


def cells_of(line: str, separator: str | None) -> list[str]:
    """The cells of a line; without a separator they stand apart by blanks. Raises ValueError, what the line has."""
    if separator is None:
        return line.split()
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True), [])
    except csv.Error as error:
        if "limit" in str(error):
            raise ValueError(f"a cell of more than {csv.field_size_limit()} letters") from error
        raise ValueError("a quotation mark that does not end its cell on the line") from error


def number_of(text: str) -> float:
    """The number in a cell, perhaps an infinite or undefined one; raises ValueError, also for Python's own 1_000."""
    if "_" in text:
        raise ValueError(f"'{text}' is no number")
    return float(text)


def is_number(text: str) -> bool:
    """Whether a cell is a number, perhaps an infinite or undefined one."""
    try:
        number_of(text)
    except ValueError:
        return False
    return True
