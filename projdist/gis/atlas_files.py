"""The atlas as a file: a table of its maps as CSV or Parquet, or the outlines of its places as GeoPackage."""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from projdist.designs import AtlasEntry
from projdist.gis.layers import check_libraries, frame_of_regions, needed_for, save_layer
from projdist.support import replacing

if TYPE_CHECKING:
    import geopandas

ATLAS_SUFFIXES = (".csv", ".parquet", ".gpkg")


def save_atlas(entries: Sequence[AtlasEntry], path: str | os.PathLike[str], *, overwrite: bool = True) -> Path:
    """Write entries of the atlas by the suffix of the file, whole or not at all.

    A `.csv` or `.parquet` file has a row for each map of each purpose, as `AtlasEntry.rows`; a `.gpkg` file has a
    feature for each place, as `atlas_frame`. Only CSV needs no extra libraries. Raises ValueError for another suffix,
    FileExistsError where there is a file and it is not to be overwritten, OSError where it cannot be written,
    ImportError without the libraries.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in ATLAS_SUFFIXES:
        raise ValueError(f"Invalid output '{path}'. Its suffix must be .csv, .parquet or .gpkg.")
    if suffix == ".gpkg":
        check_libraries(path)
        return save_layer(atlas_frame(entries), path, layer="atlas", overwrite=overwrite)
    rows = [row for entry in entries for row in entry.rows()]
    if suffix == ".parquet":
        with needed_for(f"output '{path}'"):
            import pandas as pd
            import pyarrow  # noqa: F401 whether it is there
        with replacing(path, overwrite=overwrite) as new:
            pd.DataFrame(rows).to_parquet(new, compression="zstd", index=False)
        return path
    with replacing(path, overwrite=overwrite) as new, new.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return path


def atlas_frame(entries: Sequence[AtlasEntry]) -> geopandas.GeoDataFrame:
    """The outlines of places of the atlas, with their summaries, in longitude and latitude; ImportError."""
    return frame_of_regions([entry.summary() for entry in entries], [entry.region for entry in entries])
