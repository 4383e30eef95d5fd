"""Atomic writing of files, and protection of existing ones."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

# Paths of open streams: a file behind one was opened by the parent process.
_BLOCK = bytes(4096)  # a block of a disk
_AFTER_FAILURE = 256  # blocks: SQLite frees some space before it fails
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
    """A temporary path to write to; the file is replaced once it is complete, else untouched.

    The path has the same name in a temporary folder beside the file, so that other files of a writer are removed, and
    names derived from it (as of a layer) are right. Links stay links, and permissions are kept. Files with the suffixes
    `beside` are moved too if written, and removed if not. Raises FileExistsError if the file exists and must not be
    overwritten, and OSError if the disk is full, even if the writer ignored that.
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
            with new.open("rb") as data, target.open("wb") as sink:
                shutil.copyfileobj(data, sink)
            return
        check()  # they may have been created meanwhile
        for suffix in beside:
            if new.with_suffix(suffix).exists():
                _replace(new.with_suffix(suffix), target.with_suffix(suffix))
            else:
                target.with_suffix(suffix).unlink(missing_ok=True)
        _replace(new, target)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _check_room(path: Path, blocks: int = 2) -> None:
    """Raise OSError if a file cannot grow, as a library may then have written only a part without an error.

    GDAL does not report losses when it closes a GeoTIFF, nor Pillow at the end of a JPEG.
    """
    with path.open("ab", buffering=0) as file:
        size = file.seek(0, os.SEEK_END)
        try:
            for _ in range(blocks):  # one may be written in part; the next then fails
                file.write(_BLOCK)
            os.fsync(file.fileno())  # network disks report a full disk only then
        finally:
            file.truncate(size)


def _replace(new: Path, target: Path) -> None:
    """Replace a file by another, keeping the permissions."""
    if target.exists():
        shutil.copymode(target, new)
    new.replace(target)
