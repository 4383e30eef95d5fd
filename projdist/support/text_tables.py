"""People's tables of text: cells that stand apart by commas, semicolons, tabs or spaces, and comment lines with #.

A row is a line: a quotation mark that is not closed on its line would else swallow those that follow.
"""

from __future__ import annotations

import csv
from pathlib import Path

__all__ = ["MISSING", "cells_of", "is_number", "number_of", "numbered_rows", "read_text"]


def read_text(path: Path, complaint: str) -> str:
    """The text of a file in UTF-8; raises ValueError that begins with the complaint."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:  # a ValueError for what is not UTF-8, and for names that no file has
        reason = error.strerror if isinstance(error, OSError) else error
        raise ValueError(f"{complaint} It cannot be read as text: {reason}.") from error


def numbered_rows(path: Path, complaint: str, *, comments: bool = True) -> list[tuple[int, list[str]]]:
    """The rows of a file and the numbers of their lines; raises ValueError that begins with the complaint.

    What separates the cells is told by the first row. Rows of empty cells are left out, and, if there may be
    `comments`, lines that begin with #. No row has more cells than the first, but for empty ones.
    """
    numbered = enumerate(read_text(path, complaint).splitlines(), start=1)
    lines = [(number, line) for number, line in numbered if line.strip()]
    if comments:
        lines = [(number, line) for number, line in lines if not line.lstrip().startswith("#")]
    if not lines:
        raise ValueError(f"{complaint} It is empty.")
    separator = next((mark for mark in ";\t," if mark in lines[0][1]), None)
    rows, width = [], 0
    for number, line in lines:
        try:
            row = cells_of(line, separator)
        except ValueError as error:
            raise ValueError(f"{complaint} Line {number} has {error}.") from error
        width = width or len(row)
        if any(cell.strip() for cell in row[width:]):
            raise ValueError(f"{complaint} Line {number} has {len(row)} cells; it must have {width}.")
        if any(cell.strip() for cell in row):
            rows.append((number, row[:width]))
    if not rows:
        raise ValueError(f"{complaint} It is empty.")
    return rows


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
