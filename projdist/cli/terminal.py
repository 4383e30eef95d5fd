"""What a terminal has room for, and whether it may be sent escape codes."""

from __future__ import annotations

import os
from typing import TextIO

_USUAL = 80  # columns of a terminal that does not tell


def width_of(stream: TextIO) -> int | None:
    """Columns of the terminal behind a stream; None where it is a file or a pipe, which has all the room one needs."""
    if not stream.isatty():
        return None
    wanted = os.environ.get("COLUMNS", "")
    if wanted.isdecimal() and int(wanted) > 0:
        return int(wanted)
    try:
        return os.get_terminal_size(stream.fileno()).columns or _USUAL
    except OSError:
        return _USUAL


def takes_escapes(stream: TextIO) -> bool:
    """Whether a stream is a terminal that knows escape codes, whose user does not object (https://no-color.org)."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") not in ("dumb", "unknown")


def folded(text: str, width: int | None) -> str:
    """Text with its wider lines broken at blanks; a longer word, as a path, stays whole: it may be copied."""
    if width is None:
        return text
    return "\n".join(part for line in text.split("\n") for part in _parts(line, width))


def _parts(line: str, width: int) -> list[str]:
    from rich.cells import cell_len  # only what goes to a terminal needs it

    if cell_len(line) <= width:
        return [line]
    parts = [""]
    for word in line.split():
        if parts[-1] and cell_len(parts[-1]) + 1 + cell_len(word) > width:
            parts.append(word)
        else:
            parts[-1] += f" {word}" if parts[-1] else word
    return parts
