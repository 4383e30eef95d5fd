"""The command `compare`."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from projdist.answers import compare
from projdist.cli.errors import refuse, report
from projdist.cli.formats import STATISTICS, Format, render_comparison
from projdist.cli.indices import IndicesOption, chosen_indices
from projdist.cli.options import (
    FileFormatOption,
    MeasuresOption,
    OutputOption,
    OverwriteOption,
    Projections,
    RegionOption,
    WeightOption,
    format_for,
    measure_names,
    number,
    printed_or_file,
    region_of,
)
from projdist.cli.output import emit
from projdist.field import DEFAULT_TOLERANCE


def compare_command(
    projections: Projections,
    region: RegionOption = "globe",
    weight: WeightOption = None,
    measure: MeasuresOption = None,
    indices: IndicesOption = None,
    sort: Annotated[
        str, typer.Option("--sort", help="given, name, an airy_kavrayskiy..., INDEX, or MEASURE or MEASURE.STATISTIC.")
    ] = "airy_kavrayskiy",
    tolerance: Annotated[
        str, typer.Option(metavar="NUMBER", help="Largest error of the Airy-Kavrayskiy figures.")
    ] = f"{DEFAULT_TOLERANCE:g}",
    format: FileFormatOption = None,
    output: OutputOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Compare projections over a region: Airy-Kavrayskiy errors, statistics of measures, published indices."""
    path, names = printed_or_file(output, overwrite), measure_names(measure)
    form = Format(format_for(format, path))
    published = chosen_indices(indices)
    column = _sort_column(sort, names, [index.name for index in published])
    # Rounding alone is of the order of 1e-15.
    largest = number("tolerance", tolerance, 1e-15, 1.0)
    area = region_of(region, weight)
    result = compare(
        projections, area, measures=names, indices=[index.name for index in published], tolerance=largest
    ).to_dict()
    result["results"] = _sorted(result["results"], column, projections)
    emit(render_comparison(result, names, published, sort, largest, form, path), path, overwrite)
    report([failure["error"] for failure in result["failures"]])


_SORTS = (
    "given",
    "name",
    "coverage",
    "evaluations",
    "error_estimate",
    "airy_kavrayskiy",
    "airy_kavrayskiy_scaled",
    "airy_kavrayskiy_affine",
)


def _sort_column(key: str, measures: list[str], indices: list[str]) -> tuple[str, str]:
    """The column of a sort key, and its statistic, "" for a column that has none."""
    if key in _SORTS:
        return key, ""
    if key in indices:
        return "indices", key
    if key in measures:
        return key, "mean"
    measure, _, statistic = key.rpartition(".")
    if measure not in measures or statistic not in STATISTICS:
        refuse(
            f"Invalid sort key '{key}'. It must be {', '.join(_SORTS)}, one of the indices asked for with --indices, "
            f"or one of the measures asked for with --measure, alone or with .{', .'.join(STATISTICS)}."
        )
    return measure, statistic


def _sorted(rows: list[dict[str, Any]], key: tuple[str, str], given: list[str]) -> list[dict[str, Any]]:
    """Rows in the order of a column; None goes last."""
    column, statistic = key

    def order(row: dict[str, Any]) -> tuple[bool, Any]:
        if column == "given":
            return False, given.index(row["projection"])
        value = row[column][statistic] if statistic else row[column]
        if column == "indices":
            value = value["value"]
        return value is None, value if value is not None else 0.0

    return sorted(rows, key=order)
