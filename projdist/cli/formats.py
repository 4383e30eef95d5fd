"""Results as tables for people, JSON, CSV and Markdown."""

from __future__ import annotations

import csv
import enum
import io
import json
import math
import shutil
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from projdist.files import replacing
from projdist.indices import Index


class Format(enum.StrEnum):
    """How results are printed."""

    TABLE = "table"
    JSON = "json"
    CSV = "csv"
    MARKDOWN = "markdown"


STATISTICS = ("mean", "rms", "median", "p95", "max", "min")
_ERRORS = ("airy_kavrayskiy", "airy_kavrayskiy_scaled", "airy_kavrayskiy_affine")
_CONVENTION = (
    "AK: Airy-Kavrayskiy error, the RMS of sqrt(ln^2 a + ln^2 b) by true area; with a half under the root, as in\n"
    "much of the literature, it is 1/sqrt(2) of that. Scaled: after the best uniform scale; affine: after the best\n"
    "linear map (MDT). Smaller is better, * is the best of its column."
)


def write(text: str, output: Path | None, overwrite: bool = False) -> None:
    """Print text, or write it to a file that is never left half-written; raises OSError."""
    if output is None:
        sys.stdout.write(text)
        sys.stdout.flush()  # so that what cannot be written is an error here, and not when the process ends
        return
    with replacing(output, overwrite=overwrite) as new:
        new.write_bytes(text.encode(errors="backslashreplace"))


def render_comparison(
    result: dict[str, Any],
    measures: Sequence[str],
    indices: Sequence[Index],
    sort: str,
    tolerance: float,
    form: Format,
) -> str:
    """A comparison, in any format."""
    if form is Format.JSON:
        return json_text(result)
    if form is Format.CSV:
        return csv_text([_flat(row) for row in result["results"]], ["projection"])
    rows = result["results"]
    if not rows:
        return "No projection could be measured.\n"
    columns = {
        "projection": [label_of(row["projection"], row["name"]) for row in rows],
        "AK": _mark([row[_ERRORS[0]] for row in rows], [row["error_estimate"] for row in rows]),
        "AK scaled": _mark([row[_ERRORS[1]] for row in rows], [row["error_estimate"] for row in rows]),
        "AK affine": _mark([row[_ERRORS[2]] for row in rows], [row["error_estimate"] for row in rows]),
        "error": [_size(row["error_estimate"]) for row in rows],
    }
    weighed = "points" in result["region"]
    notes = [_CONVENTION.replace("by true area", "by the points' weights") if weighed else _CONVENTION]
    for name in measures:
        for statistic in STATISTICS:
            columns[f"{name} {statistic}"] = [_significant(row[name][statistic]) for row in rows]
    columns |= _index_columns(rows, indices)
    if any(index.best_scale is not None for index in indices):
        notes.append("Best: an index at the scale that makes it best.")
    if indices:
        notes.append(_ERRORS_OF_INDICES)
    if any(row["indices"][index.name]["value"] is None for row in rows for index in indices):
        notes.append("-: the index diverges, has no bound, or is none of the region's.")
    if any(row["coverage"] < 0.9999995 for row in rows):
        columns["covers"] = [f"{100 * row['coverage']:.4g} %" for row in rows]
        notes.append("Covers: the share of the region that can be projected; the figures are of that share.")
    if any(row[name][statistic] is None for row in rows for name in measures for statistic in STATISTICS):
        notes.append("-: the integral diverges, or the measure has no bound.")
    if any((row["error_estimate"] or 0.0) > 2.0 * tolerance for row in rows):
        notes.append(
            "Error: above the tolerance where the projection's own rounding or the work allowed set the limit."
        )
    region = result["region"]
    size = f"{region['points']:,} points" if "points" in region else area_text(region["area_km2"])
    title = f"{region['name']} ({size}), by {sort}"
    if form is Format.MARKDOWN:
        return markdown_text(columns) + "\n" + "\n".join(notes).replace("*", "\\*") + "\n"
    return table_text(columns, title) + "\n".join(notes) + "\n"


def _index_columns(rows: Sequence[dict[str, Any]], indices: Sequence[Index]) -> dict[str, list[str]]:
    """Columns by symbol, with as many digits as the errors allow; a second one where the scale matters."""
    columns = {}
    for index in indices:
        values = [row["indices"][index.name] for row in rows]
        columns[index.symbol] = [_rounded_index(value["value"], value["error"]) for value in values]
        if index.best_scale is not None:
            columns[f"{index.symbol} best"] = [_rounded_index(value["best"], value["best_error"]) for value in values]
    return columns


_LAST_OF_INDICES = 1e-5
_ERRORS_OF_INDICES = "In brackets: the error, of the last digit; without them it is below 0.00001."


def _rounded_index(value: float | None, error: float | None) -> str:
    """Five decimals at most, as published ones have two to four; a larger error in brackets, of the last digit."""
    if value is None or error is None or not error > _LAST_OF_INDICES:
        return rounded(value, _LAST_OF_INDICES)
    decimals = max(0, math.ceil(-math.log10(error)))
    return f"{value:.{decimals}f}({math.ceil(error * 10**decimals)})"


def render_factors(result: dict[str, Any], name: str, form: Format) -> str:
    """Factors at points, in any format; `name` stands for a definition too long for a title."""
    rows = result["results"]
    if form is Format.JSON:
        return json_text(result)
    if form is Format.CSV:
        return csv_text(rows, ["lon", "lat"])
    if not rows:
        return "No point could be read.\n"
    columns = {column: [_cell(column, row[column]) for row in rows] for column in rows[0]}
    if form is Format.MARKDOWN:
        return markdown_text(columns)
    return table_text(columns, label_of(result["projection"], name), keys=2)


def render_list(rows: list[dict[str, str]], form: Format) -> str:
    """A listing, in any format."""
    if form is Format.JSON:
        return json_text(rows)
    if form is Format.CSV:
        return csv_text(rows, [])
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    return markdown_text(columns) if form is Format.MARKDOWN else table_text(columns, "")


# ---- formats --------------------------------------------------------------------------------


def json_text(value: Any) -> str:
    """JSON, indented, with null for what is undefined."""
    # ASCII is valid JSON in whatever encoding the standard output has.
    return json.dumps(value, indent=2, allow_nan=False) + "\n"


def csv_text(rows: list[dict[str, Any]], header: list[str]) -> str:
    """Rows below the names of their columns; no rows below a header."""
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]) if rows else header, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _flat(row: dict[str, Any]) -> dict[str, Any]:
    """Nested statistics as columns of their own, `omega_mean`; the place of a maximum as two."""
    flat: dict[str, Any] = {}
    for name, value in row.items():
        if not isinstance(value, dict):
            flat[name] = value
            continue
        if name == "indices":
            figures = ((index, key, number) for index, found in value.items() for key, number in found.items())
            flat |= {index if key == "value" else f"{index}_{key}": number for index, key, number in figures}
            continue
        for statistic, number in value.items():
            if statistic in ("max_at", "min_at"):
                end = statistic[:3]
                flat[f"{name}_{end}_lon"], flat[f"{name}_{end}_lat"] = number
            else:
                flat[f"{name}_{statistic}"] = number
    return flat


def markdown_text(columns: dict[str, list[str]]) -> str:
    """A table in Markdown."""

    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(" ".join(_escapedmarkdown_text(cell).split()) for cell in cells) + " |\n"

    rule = ["---" if name in _TEXT else "---:" for name in columns]
    return line(list(columns)) + line(rule) + "".join(line(row) for row in zip(*columns.values(), strict=True))


_TEXT = (
    *("projection", "map", "name", "kind", "needs", "definition", "symbol", "unit", "description", "quality", "text"),
    *(
        "code",
        "method",
        "keeps",
        "area of use",
        "feature",
        "note",
        "group",
        "normalisation",
        "scale",
        "source",
        "comes out",
        "convention",
        "cloud",
        "frame",
        "is",
    ),
)


def _escapedmarkdown_text(cell: str) -> str:
    return cell.replace("\\", "\\\\").replace("|", "\\|").replace("*", "\\*")


_LONGEST_LABEL = 60


def label_of(given: str, name: str) -> str:
    """A projection as it was given, or, as WKT may be long, by its name."""
    return given if len(given) <= _LONGEST_LABEL and "\n" not in given else name


def table_text(columns: dict[str, list[str]], title: str, keys: int = 1) -> str:
    """A table; columns that the terminal has no room for go to further tables, which repeat the first `keys`.

    Figures are never cut off. What goes to a file or a pipe has all the room that it needs.
    """
    terminal = sys.stdout.isatty()
    # A pipe has room enough, and yet keeps the descriptions of lists readable.
    room = shutil.get_terminal_size().columns if terminal else 200
    unicode = (sys.stdout.encoding or "").lower().startswith("utf")
    stream = io.StringIO()
    for block in _blocks(columns, keys, room) if terminal else [columns]:
        table = Table(title=escape(title) or None, title_justify="left", box=box.HEAVY_HEAD if unicode else box.ASCII)
        for name, cells in block.items():
            text = name in _TEXT
            table.add_column(
                name,
                justify="left" if text else "right",
                overflow="fold",
                no_wrap=not text,
                min_width=min(_width(name, cells), _NARROWEST) if text else _width(name, cells),
            )
        for row in zip(*block.values(), strict=True):
            table.add_row(*(_bold_best(cell) for cell in row))
        needed = sum(_least(name, cells) for name, cells in block.items()) + 1
        console = Console(file=stream, force_terminal=terminal, width=max(room, needed))
        console.print(table)
    return "\n".join(line.rstrip() for line in stream.getvalue().split("\n"))


_NARROWEST = 24  # characters; texts wider than that are folded where there is no room


def _width(name: str, cells: list[str]) -> int:
    return max(cell_len(name), *map(cell_len, cells))


def _least(name: str, cells: list[str]) -> int:
    """Characters that a column needs, with its border and padding."""
    return 3 + (min(_width(name, cells), _NARROWEST) if name in _TEXT else _width(name, cells))


def _blocks(columns: dict[str, list[str]], keys: int, room: int) -> Iterator[dict[str, list[str]]]:
    """Columns in groups that fit into `room` characters; each group begins with the first `keys`."""
    names = list(columns)
    first = 1 + sum(_least(name, columns[name]) for name in names[:keys])
    group, used = names[:keys], first
    for name in names[keys:]:
        width = _least(name, columns[name])
        if used + width > room and len(group) > keys:
            yield {column: columns[column] for column in group}
            group, used = names[:keys], first
        group.append(name)
        used += width
    yield {column: columns[column] for column in group}


def _bold_best(cell: str) -> str:
    return f"[bold]{escape(cell)}[/bold]" if cell.endswith("*") else escape(cell)


def area_text(km2: float) -> str:
    """An area in words, small ones with their digits."""
    return f"{km2:,.0f} km2" if km2 >= 100 else f"{km2:.3g} km2"


# ---- numbers --------------------------------------------------------------------------------


def _mark(values: list[float | None], errors: list[float | None]) -> list[str]:
    """Figures with the digits that their errors allow, the best marked with a star."""
    known = [value for value in values if value is not None]
    best = min(known, default=None)
    shown = [rounded(value, error) for value, error in zip(values, errors, strict=True)]
    alone = len(values) == 1
    return [
        f"{text}*" if value == best and not alone else f"{text} " for text, value in zip(shown, values, strict=True)
    ]


_MOST_DECIMALS = 10  # a tenth of a millimetre in 1000 km


def rounded(value: float | None, error: float | None) -> str:
    """At most six decimals or four significant digits, and none that the error makes doubtful."""
    if value is None:
        return "-"
    wanted = max(6, 3 - math.floor(math.log10(abs(value)))) if value else 6
    good = math.floor(-math.log10(error)) if error else wanted
    decimals = max(0, min(wanted, good, _MOST_DECIMALS))
    if error and abs(value) > error and round(value, decimals) == 0.0:
        decimals += 1  # its first digit is doubtful, and says more than a zero
    return f"{value:.{decimals}f}"


def _size(error: float | None) -> str:
    return "-" if error is None else f"{error:.0e}"


def _significant(value: float | None) -> str:
    return "-" if value is None else f"{value:.5g}"


_DECIMALS = {"lon": 8, "lat": 8, "x": 3, "y": 3, "omega": 6, "theta": 6, "convergence": 6}


def _cell(name: str, value: Any) -> str:
    if value is None:
        return "-"
    if not isinstance(value, float):
        return str(value)
    if name in ("lon", "lat"):
        return f"{value:.10g}"
    if abs(value) >= 1e6 and name not in ("x", "y"):
        return f"{value:.9g}"
    decimals = _DECIMALS.get(name, 8)
    return f"{round(value, decimals) + 0.0:.{decimals}f}"  # + 0.0: no "-0.000000"
