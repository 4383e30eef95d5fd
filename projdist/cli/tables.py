"""Points in people's own files: measured, with columns added, printed or written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from projdist import gis
from projdist.answers import factors
from projdist.cli.errors import refuse, refusing
from projdist.cli.factor_report import factors_report
from projdist.cli.formats import CSV, TABLE
from projdist.cli.layers import check_libraries
from projdist.cli.output import drawing, present, tell_written
from projdist.projections import TEXT_SUFFIXES, Projection, check_degrees, check_new_names, read_point_table
from projdist.support import is_stream, plain

TABLE_SUFFIXES = (".parquet", ".gpkg", ".geojson")
_SUFFIXES = (".csv", *TABLE_SUFFIXES)


def is_table_file(path: Path) -> bool:
    """Whether a file, by its suffix, can hold nothing that is printed."""
    return path.suffix.lower() in TABLE_SUFFIXES and not is_stream(path)


def measure_file(
    projection: Projection,
    given: str,
    at: str,
    measures: Sequence[str],
    prefix: str,
    form: str,
    path: Path | None,
    overwrite: bool,
) -> None:
    """Add columns to the points of a file, and print or write all of them."""
    if path is not None and not is_stream(path):
        if path.suffix.lower() not in _SUFFIXES:
            refuse(f"Invalid output '{path}'. Its suffix must be {', '.join(_SUFFIXES[:-1])} or {_SUFFIXES[-1]}.")
        if form != TABLE:
            refuse(f"Invalid format '{form}' for '{path}'. Its suffix tells the format.")
        form = CSV
    with refusing():
        if at.lower().endswith(TEXT_SUFFIXES) and (path is None or not is_table_file(path)):
            header, rows = _measured_text(projection, at, measures, prefix, form)
        else:
            frame = _measured_frame(projection, at, measures, prefix, path)
            if path is not None and is_table_file(path):
                _write_frame(projection, frame, path, overwrite)
                return
            header, rows = _rows(projection, frame)
    named = {"projection": given, "name": projection.name, "definition": projection.definition}
    present(factors_report(named | {"results": rows}, header), form, path, overwrite)


def _measured_text(
    projection: Projection, at: str, measures: Sequence[str], prefix: str, form: str
) -> tuple[list[str], list[dict[str, Any]]]:
    """The header and the rows of a table of text with columns added; its own stay text, with decimal points."""
    read = read_point_table(Path(at), f"Invalid points file '{at}'.")
    header, rows = read.header, [row for _, row in read.rows]
    lon, lat = check_degrees(*([row[column] for row in rows] for column in (read.lon, read.lat)))
    columns = {
        prefix + name: values for name, values in factors(projection, lon, lat, measures=measures).columns().items()
    }
    check_new_names(header, columns)
    added = zip(*(values.tolist() for values in columns.values()), strict=True)
    table = [
        dict(zip([*header, *columns], [*row, *map(plain, values)], strict=True))
        for row, values in zip(rows, added, strict=True)
    ]
    if form != CSV:
        for row, east, north in zip(table, lon.tolist(), lat.tolist(), strict=True):
            row.update({header[read.lon]: east, header[read.lat]: north})
    return [*header, *columns], table


def _measured_frame(projection: Projection, at: str, measures: Sequence[str], prefix: str, path: Path | None) -> Any:
    """The points of a file as a frame with columns added."""
    if path is not None and is_table_file(path):
        check_libraries(path)
    return factors(projection, gis.read_points(at), measures=measures, prefix=prefix)


def _rows(projection: Projection, frame: Any) -> tuple[list[str], list[dict[str, Any]]]:
    """A frame's columns and rows without geometries, for printing."""
    table = gis.plain_table(projection, frame)
    rows = [{name: _cell(value) for name, value in row.items()} for row in table.to_dict("records")]
    return [str(name) for name in table.columns], rows


def _cell(value: Any) -> Any:
    """A number, text or nothing."""
    if isinstance(value, str | int | float | np.generic | None):
        return plain(value)
    return str(value)


def write_table(projection: Projection, rows: Sequence[Mapping[str, Any]], path: Path, overwrite: bool) -> None:
    """Rows with `lon` and `lat` as a file for GIS programs."""
    check_libraries(path)
    _write_frame(projection, gis.frame_of(rows), path, overwrite)


def _write_frame(projection: Projection, frame: Any, path: Path, overwrite: bool) -> None:
    with drawing(path):
        gis.save_points(projection, frame, path, overwrite=overwrite)
    tell_written(path)
