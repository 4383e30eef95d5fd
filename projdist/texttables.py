"""People's tables of text: cells that stand apart by commas, semicolons, tabs or spaces, and comment lines with #."""

from __future__ import annotations

import csv
from pathlib import Path

__all__ = ["is_number", "numbered_rows", "read_text"]


def read_text(path: Path, complaint: str) -> str:
    """The text of a file in UTF-8; raises ValueError that begins with the complaint."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:  # a ValueError for what is not UTF-8, and for names that no file has
        reason = error.strerror if isinstance(error, OSError) else error
        raise ValueError(f"{complaint} It cannot be read as text: {reason}.") from error


def numbered_rows(path: Path, complaint: str) -> list[tuple[int, list[str]]]:
    """The rows of a file and the numbers of their lines; raises ValueError that begins with the complaint.

    What separates the cells is told by the first row.
    """
    numbered = enumerate(read_text(path, complaint).splitlines(), start=1)
    lines = [(number, line) for number, line in numbered if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise ValueError(f"{complaint} It is empty.")
    separator = next((mark for mark in ";\t," if mark in lines[0][1]), None)
    return [(number, _cells(line, separator)) for number, line in lines]


def _cells(line: str, separator: str | None) -> list[str]:
    return next(csv.reader([line], delimiter=separator, skipinitialspace=True)) if separator else line.split()


def is_number(text: str) -> bool:
    """Whether a cell is a number, perhaps an infinite or undefined one."""
    try:
        float(text)
    except ValueError:
        return False
    return True
