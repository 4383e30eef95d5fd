"""Files: tables in text files, atomic writing, and protection of existing files."""

import contextlib
import csv
import os
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from projdist.support.messages import tell

# ---- tables in text files ------------------------------------------------------------------------

# Cells are separated by commas, semicolons, tabs or spaces; comment lines begin with #. A row is a line: an unclosed
# quotation mark must not swallow the lines after it. Numbers may have decimal commas if cells have no commas between.

NumberedRow = tuple[int, list[str]]

_WITH_COMMA = re.compile(r"\s*[+-]?\d+,\d+(?:[eE][+-]?\d+)?\s*")
_WITH_POINT = re.compile(r"\s*[+-]?(?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)?\s*")
_WHOLE = re.compile(r"\s*[+-]?\d+\s*")
_THOUSANDS = re.compile(r"\s*[+-]?[1-9]\d{0,2},\d{3}\s*")
_HINT = " Decimal commas are read where all numbers have them and cells are separated by semicolons, tabs or blanks."


def read_text(path: Path, complaint: str) -> str:
    """The text of a UTF-8 file; raises ValueError that begins with `complaint`."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:  # ValueError for other encodings and impossible file names
        reason = error.strerror if isinstance(error, OSError) else error
        raise ValueError(f"{complaint} It cannot be read as text: {reason}.") from error


def numbered_rows(path: Path, complaint: str, *, comments: bool = True) -> list[NumberedRow]:
    """Rows of a file with line numbers, as by `rows_of_text`; raises ValueError."""
    return rows_of_text(read_text(path, complaint), complaint, comments=comments)


def rows_of_text(text: str, complaint: str, *, comments: bool = True) -> list[NumberedRow]:
    """Rows of a text with line numbers; raises ValueError that begins with `complaint`."""
    # The first row determines the separator. Empty rows are left out, with `comments` also lines that begin with #. No
    # row may have more cells than the first, except empty ones. Decimal commas become points.
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
    """Separator of the cells of a line; None for blanks, also if all commas are within numbers."""
    words = line.split()
    decimal = all(has_decimal_comma(word) or is_number(word) for word in words)
    if not (";" in line or "\t" in line) and len(words) > 1 and decimal:
        return None
    return next((mark for mark in ";\t," if mark in line), None)


def split_rows(lines: Iterable[tuple[int, str]], separator: str | None) -> list[NumberedRow]:
    """Cells of numbered lines, at most as many as in the first; raises ValueError that begins with the line number."""
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
    """Rows with decimal commas turned into points, unless a number has a point already."""
    commas = [cell for _, row in rows for cell in row if "," in cell and has_decimal_comma(cell)]
    if not commas or any("." in cell and _WITH_POINT.fullmatch(cell) for _, row in rows for cell in row):
        return list(rows)
    if all(map(_THOUSANDS.fullmatch, commas)):
        tell(f"'{commas[0].strip()}' is read as a number with a decimal comma, not as thousands.")
    mended = ([cell.replace(",", ".") if has_decimal_comma(cell) else cell for cell in row] for _, row in rows)
    return [(number, row) for (number, _), row in zip(rows, mended, strict=True)]


def has_decimal_comma(cell: str) -> bool:
    """True for a number with a decimal comma."""
    return _WITH_COMMA.fullmatch(cell) is not None


def comma_hint(cells: Iterable[str]) -> str:
    """Advice on decimal commas if a cell has one, else ""."""
    return _HINT if any(map(has_decimal_comma, cells)) else ""


MISSING = ("", "NA", "<NA>")
"""Texts of missing cells."""


def cells_of(line: str, separator: str | None) -> list[str]:
    """Cells of a line, separated by blanks if `separator` is None; raises ValueError that describes the fault."""
    if separator is None:
        return line.split()
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True), [])
    except csv.Error as error:
        if "limit" in str(error):
            raise ValueError(f"a cell of more than {csv.field_size_limit()} letters") from error
        raise ValueError("a quotation mark that does not end its cell on the line") from error


def number_of(text: str) -> float:
    """The number in a cell, also infinity and NaN; raises ValueError, also for Python's 1_000."""
    if "_" in text:
        raise ValueError(f"'{text}' is not a number")
    return float(text)


def is_number(text: str) -> bool:
    """True for a number, also infinity and NaN."""
    try:
        number_of(text)
    except ValueError:
        return False
    return True


# ---- writing ------------------------------------------------------------------------------------

_BLOCK = bytes(4096)  # a block of a disk
_AFTER_FAILURE = 256  # blocks: SQLite frees some space before it fails
# Paths of open streams: a file behind one was opened by the parent process.
_STREAMS = ("/dev/stdin", "/dev/stdout", "/dev/stderr", "/dev/fd/", "/proc/")


def is_stream(path: Path) -> bool:
    """True if the path is a device, pipe or open stream, which has no contents to protect."""
    return os.path.abspath(path).startswith(_STREAMS) or (path.exists() and not path.is_file() and not path.is_dir())


def refuse_existing(path: Path) -> None:
    """Raise FileExistsError for an existing file that is not a stream."""
    if os.path.lexists(path) and not is_stream(path):
        raise FileExistsError(f"Invalid output '{path}'. It exists; --overwrite replaces it.")


@contextlib.contextmanager
def replacing(path: Path, *, overwrite: bool = True, beside: Sequence[str] = ()) -> Iterator[Path]:
    """Context with a temporary path to write to; the file is replaced once that is complete, else left untouched."""
    # The path has the file's name and is in a temporary folder beside it, so that a writer's other files are removed
    # and names derived from the path (as of a layer) are right. Links stay links, and permissions are kept. Files with
    # the suffixes `beside` are moved along if they were written, else removed. Raises FileExistsError if the file
    # exists and must not be overwritten, and OSError if the disk is full, even if the writer ignored that.
    paths = [path, *(path.with_suffix(suffix) for suffix in beside)]

    def check() -> None:
        for one in [] if overwrite else paths:
            refuse_existing(one)

    check()
    stream = is_stream(path)
    target = path if stream else Path(os.path.realpath(path))
    folder = Path(tempfile.mkdtemp(prefix=".projdist-", dir=None if stream else target.parent))
    try:
        new = folder / target.name
        try:
            yield new
        except Exception:
            _check_room(new, _AFTER_FAILURE)
            raise
        if new.exists():
            _check_room(new)
        if stream:
            with new.open("rb") as data, target.open("wb") as sink:
                shutil.copyfileobj(data, sink)
            return
        check()  # the files may have been created meanwhile
        for suffix in beside:
            if new.with_suffix(suffix).exists():
                _replace(new.with_suffix(suffix), target.with_suffix(suffix))
            else:
                target.with_suffix(suffix).unlink(missing_ok=True)
        _replace(new, target)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _check_room(path: Path, blocks: int = 2) -> None:
    """Raise OSError if a file cannot grow: GDAL and Pillow may then have written a part of it without an error."""
    with path.open("ab", buffering=0) as file:
        size = file.seek(0, os.SEEK_END)
        try:
            for _ in range(blocks):  # a block may be written in part; the next one then fails
                file.write(_BLOCK)
            os.fsync(file.fileno())  # network disks report a full disk only then
        finally:
            file.truncate(size)


def _replace(new: Path, target: Path) -> None:
    """Replace a file by another, keeping the permissions."""
    if target.exists():
        shutil.copymode(target, new)
    new.replace(target)
