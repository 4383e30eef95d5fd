"""Files that are whole or not there, and never in the place of another unless asked."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

__all__ = ["is_stream", "refuse_existing", "replacing"]

# Where the system has its open streams: a file behind one of them was opened by whoever started the process.
_STREAMS = ("/dev/stdin", "/dev/stdout", "/dev/stderr", "/dev/fd/", "/proc/")


def is_stream(path: Path) -> bool:
    """Whether the path is a device, a pipe or an open stream, which takes what is written and holds nothing to lose."""
    return os.path.abspath(path).startswith(_STREAMS) or (path.exists() and not path.is_file() and not path.is_dir())


def refuse_existing(path: Path) -> None:
    """Raise FileExistsError for a file that is there, and is no stream."""
    if os.path.lexists(path) and not is_stream(path):
        raise FileExistsError(f"Invalid output '{path}'. It exists; --overwrite replaces it.")


@contextlib.contextmanager
def replacing(path: Path, *, overwrite: bool = True, beside: str = "") -> Iterator[Path]:
    """A path to write to in the place of another, which has the new contents once they are complete, or is untouched.

    It lies in a folder of its own beside the file, so that whatever else a writer leaves there goes
    with it, and what a writer takes from the name (a layer's, say) is right. A link stays a link, and
    a file keeps its permissions. A second file, whose name has `beside` at its end, comes along if
    there is one; an old one goes. Raises FileExistsError where there is a file and it is not to be
    overwritten.
    """
    paths = [path, path.with_name(path.name + beside)] if beside else [path]

    def check() -> None:
        for one in [] if overwrite else paths:
            refuse_existing(one)

    check()
    stream = is_stream(path)
    target = path if stream else Path(os.path.realpath(path))
    folder = Path(tempfile.mkdtemp(prefix=".projdist-", dir=None if stream else target.parent))
    try:
        new = folder / target.name
        yield new
        if stream:
            _copy(new, target)
            return
        check()  # they may have come meanwhile
        if beside:
            _replace_if_there(new.with_name(new.name + beside), target.with_name(target.name + beside))
        _replace(new, target)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _replace(new: Path, target: Path) -> None:
    """Put a file in the place of another, with the other's permissions."""
    if target.exists():
        shutil.copymode(target, new)
    new.replace(target)


def _replace_if_there(new: Path, target: Path) -> None:
    if new.exists():
        _replace(new, target)
    else:
        target.unlink(missing_ok=True)


def _copy(source: Path, stream: Path) -> None:
    with source.open("rb") as data, stream.open("wb") as sink:
        shutil.copyfileobj(data, sink)
