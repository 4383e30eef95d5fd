"""Files that are whole or not there, and never in the place of another unless asked."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

# Where the system has its open streams: a file behind one of them was opened by whoever started the process.
_BLOCK = bytes(4096)  # of disks
_AFTER_FAILURE = 256  # blocks: SQLite gives back what it had taken before it fails
_STREAMS = ("/dev/stdin", "/dev/stdout", "/dev/stderr", "/dev/fd/", "/proc/")


def is_stream(path: Path) -> bool:
    """Whether the path is a device, a pipe or an open stream, which takes what is written and holds nothing to lose."""
    return os.path.abspath(path).startswith(_STREAMS) or (path.exists() and not path.is_file() and not path.is_dir())


def refuse_existing(path: Path) -> None:
    """Raise FileExistsError for a file that is there, and is no stream."""
    if os.path.lexists(path) and not is_stream(path):
        raise FileExistsError(f"Invalid output '{path}'. It exists; --overwrite replaces it.")


@contextlib.contextmanager
def replacing(path: Path, *, overwrite: bool = True, beside: Sequence[str] = ()) -> Iterator[Path]:
    """A path to write to in the place of another, which has the new contents once they are complete, or is untouched.

    It lies in a folder of its own beside the file, so that whatever else a writer leaves there goes
    with it, and what a writer takes from the name (a layer's, say) is right. A link stays a link, and
    a file keeps its permissions. Other files, which have suffixes of `beside` in place of the path's, come
    along if they are written; old ones go. Raises FileExistsError where there is a file and it is not to be
    overwritten, and OSError where the disk is full, whatever the writer made of that, if anything.
    """
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
            _copy(new, target)
            return
        check()  # they may have come meanwhile
        for suffix in beside:
            _replace_if_there(new.with_suffix(suffix), target.with_suffix(suffix))
        _replace(new, target)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _check_room(path: Path, blocks: int = 2) -> None:
    """Raise OSError where a file cannot grow: a library may then have left half of it, and told of that or not.

    GDAL says nothing of what it loses when it closes a GeoTIFF, and Pillow nothing of the end of a JPEG.
    """
    with path.open("ab", buffering=0) as file:
        size = file.seek(0, os.SEEK_END)
        try:
            for _ in range(blocks):  # one may be written in part, and the next then is an error
                file.write(_BLOCK)
            os.fsync(file.fileno())  # on the disk of another machine no room is an error only then
        finally:
            file.truncate(size)


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
