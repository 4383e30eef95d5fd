"""Results as they come: a file of JSON lines, whose first tells the job that it is of.

A line is written at once and whole; what was cut off when a process or a machine stopped is the end of the file, and
goes. A job that finds its own file does only what is missing there.
"""

from __future__ import annotations

import contextlib
import json
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from io import FileIO
from pathlib import Path
from typing import Any

from projdist.support import is_stream, quoted

_SYNC = 1.0  # seconds; at every line, of which a cluster sends hundreds a second, it would take most of the time
_MARK = b'{"projdist": '  # at the beginning of every such file


class PartialFile:
    """An open file: the results that it has, and a place for more."""

    def __init__(self, file: FileIO, done: dict[int, dict[str, Any]]) -> None:
        self._file, self.done = file, done
        self._synced = time.monotonic()

    def append(self, lines: Sequence[str]) -> None:
        """Write lines of results; once in a while have the disk keep them, too, in case the machine stops."""
        self._file.write("".join(f"{line}\n" for line in lines).encode("ascii"))
        if time.monotonic() - self._synced > _SYNC:
            os.fsync(self._file.fileno())
            self._synced = time.monotonic()


@contextlib.contextmanager
def open_partial(path: str | os.PathLike[str], header: Mapping[str, Any]) -> Iterator[PartialFile]:
    """The file of a job, new or as it was left.

    Raises ValueError for a file of another job, for what is none, and where another process writes it; OSError.
    """
    path = Path(path)
    if is_stream(path):
        raise ValueError(f"Invalid partial file {quoted(str(path))}. It is a device or a pipe, which keeps nothing.")
    with open(path, "ab+", buffering=0) as file:
        _lock(file, path)
        file.seek(0)
        text = file.read()
        whole = text[: text.rfind(b"\n") + 1]
        if not whole and not _MARK.startswith(text[: len(_MARK)]):
            raise ValueError(f"Invalid partial file {quoted(str(path))}. It is none; take another name.")
        done = _results(whole, header, path)
        if len(whole) < len(text):
            file.truncate(len(whole))
        partial = PartialFile(file, done)
        if not whole:
            partial.append([json.dumps(header)])
        yield partial


def _results(text: bytes, header: Mapping[str, Any], path: Path) -> dict[int, dict[str, Any]]:
    """The results in whole lines by their tasks, less those that are to be tried again."""
    lines = text.splitlines()
    if not lines:
        return {}
    found = _parsed(lines[0], path, 1) if lines[0].startswith(_MARK) else {}
    if "digest" not in found:
        raise ValueError(f"Invalid partial file {quoted(str(path))}. It is none; take another name.")
    if found["digest"] != header["digest"]:
        raise ValueError(
            f"Invalid partial file {quoted(str(path))}. It belongs to another job, {_difference(found, header)}. Take "
            "another name, or remove it."
        )
    results = [_parsed(line, path, number) for number, line in enumerate(lines[1:], start=2)]
    return {result["task"]: result for result in results if not result.get("again")}


def _parsed(line: bytes, path: Path, number: int) -> dict[str, Any]:
    try:
        found = json.loads(line)
    except ValueError as error:
        raise ValueError(f"Invalid partial file {quoted(str(path))}. Its line {number} is damaged.") from error
    if not isinstance(found, dict) or (number > 1 and not isinstance(found.get("task"), int)):
        raise ValueError(f"Invalid partial file {quoted(str(path))}. Its line {number} is no result.")
    return found


def _difference(found: Mapping[str, Any], header: Mapping[str, Any]) -> str:
    """What the jobs of two headers differ in."""
    words = {
        "projdist": "of another version of projdist",
        "PROJ": "with another version of PROJ",
        "function": "of another function",
        "options": "with other options",
    }
    return next((words[key] for key in words if found.get(key) != header[key]), "of other regions or maps")


def _lock(file: FileIO, path: Path) -> None:
    """Keep other processes from writing the file, where the system can."""
    try:
        import fcntl
    except ImportError:  # Windows
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise ValueError(f"Invalid partial file {quoted(str(path))}. Another process is writing it.") from error
