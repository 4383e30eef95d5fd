"""The extra libraries, and what is said where they are missing."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def needed_for(thing: str) -> Iterator[None]:
    """Imports that something needs; raises ImportError in one line that says what to install."""
    try:
        yield
    except ImportError as error:
        library = (error.name or "the extra gis").partition(".")[0]
        raise ImportError(f"Invalid {thing}. It needs {library}: pip install 'projdist[gis]'.", name=library) from error


def check_libraries(path: Path) -> None:
    """Import what a file of that suffix is written with, before the work; raises ImportError in one line."""
    suffix = path.suffix.lower()
    with needed_for(f"output '{path}'"):
        if suffix in (".tif", ".tiff"):
            import rasterio  # noqa: F401 whether it is there

            return
        import geopandas  # noqa: F401
        import pyogrio  # noqa: F401

        if suffix == ".parquet":
            import pyarrow  # noqa: F401
