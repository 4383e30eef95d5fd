"""Results as tables for people, JSON, CSV and Markdown."""

from __future__ import annotations

import csv
import enum
import io
import json
import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from projdist.answers import Index
from projdist.cli.terminal import folded, takes_escapes, width_of
from projdist.support import replacing


class Format(enum.StrEnum):
    """How results are printed."""

    TABLE = "table"
    JSON = "json"
    CSV = "csv"
    MARKDOWN = "markdown"


STATISTICS = ("mean", "rms", "median", "p95", "max", "min")
_ERRORS = ("airy_kavrayskiy", "airy_kavrayskiy_scaled", "airy_kavrayskiy_affine")
_CONVENTION = (
    "AK: Airy-Kavrayskiy error, the RMS of sqrt(ln^2 a + ln^2 b) by true area. Smaller is better, * is the best.",
    "With a half under the root, as in much of the literature, it is 1/sqrt(2) of that.",
    "Scaled: after the best uniform scale; affine: after the best linear map (MDT).",
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
    output: Path | None = None,
) -> str:
    """A comparison, in any format, to print or for a file."""
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
    notes = [text.replace("by true area", "by the points' weights") if weighed else text for text in _CONVENTION]
    for name in measures:
        for statistic in STATISTICS:
            figures = [(row[name][statistic], row[name].get(f"{statistic}_error")) for row in rows]
            columns[f"{name} {statistic}"] = [certain(*figure) for figure in figures]
    columns |= _index_columns(rows, indices)
    if any(index.best_scale is not None for index in indices):
        notes.append("Best: an index at the scale that makes it best.")
    if indices:
        notes.append(_ERRORS_OF_INDICES)
    if any(row["indices"][index.name]["value"] is None for row in rows for index in indices):
        notes.append("-: the index diverges, has no bound, or is none of the region's.")
    notes += _published_over(result.get("published_over", {}), indices)
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
    return table_text(columns, title, output=output) + notes_text(notes, output)


def _index_columns(rows: Sequence[dict[str, Any]], indices: Sequence[Index]) -> dict[str, list[str]]:
    """Columns by symbol, with as many digits as the errors allow; a second one where the scale matters."""
    columns = {}
    for index in indices:
        values = [row["indices"][index.name] for row in rows]
        columns[index.symbol] = [_rounded_index(value["value"], value["error"]) for value in values]
        if index.best_scale is not None:
            columns[f"{index.symbol} best"] = [_rounded_index(value["best"], value["best_error"]) for value in values]
    return columns


def _published_over(parts: dict[str, str], indices: Sequence[Index]) -> list[str]:
    """Of what part of the globe the published figures of indices are, where it is not all of it."""
    symbols: dict[str, list[str]] = {}
    for index in indices:
        if index.name in parts:
            symbols.setdefault(parts[index.name], []).append(index.symbol)
    return [
        f"{', '.join(names)}: most published figures come out over {part} only, and these here are of the whole region."
        for part, names in symbols.items()
    ]


_LAST_OF_INDICES = 1e-5
_ERRORS_OF_INDICES = "In brackets: the error, of the last digit; without them it is below 0.00001."


def _rounded_index(value: float | None, error: float | None) -> str:
    """Five decimals at most, as published ones have two to four; a larger error in brackets, of the last digit."""
    if value is None or error is None or not error > _LAST_OF_INDICES:
        return rounded(value, _LAST_OF_INDICES)
    decimals = max(0, math.ceil(-math.log10(error)))
    return f"{value:.{decimals}f}({math.ceil(error * 10**decimals)})"


def render_factors(result: dict[str, Any], header: list[str], form: Format, output: Path | None = None) -> str:
    """Factors at points, in any format, to print or for a file; the header is for CSV without points."""
    rows = result["results"]
    if form is Format.JSON:
        return json_text(result)
    if form is Format.CSV:
        return csv_text(rows, header)
    if not rows:
        return "No point could be read.\n"
    columns = {column: [_cell(column, row[column]) for row in rows] for column in rows[0]}
    if form is Format.MARKDOWN:
        return markdown_text(columns)
    keys = 2 if list(columns)[:2] == ["lon", "lat"] else 1
    return table_text(columns, _title_of(result["projection"], result["name"], result["definition"]), keys, output)


def render_list(rows: list[dict[str, str]], form: Format, output: Path | None = None) -> str:
    """A listing, in any format, to print or for a file."""
    if form is Format.JSON:
        return json_text(rows)
    if form is Format.CSV:
        return csv_text(rows, [])
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    return markdown_text(columns) if form is Format.MARKDOWN else table_text(columns, "", output=output)


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
        return "| " + " | ".join(" ".join(_escaped_for_markdown(cell).split()) for cell in cells) + " |\n"

    rule = ["---" if name in _TEXT else "---:" for name in columns]
    return line(list(columns)) + line(rule) + "".join(line(row) for row in zip(*columns.values(), strict=True))


_TEXT = (
    *(
        "projection",
        "map",
        "name",
        "kind",
        "needs",
        "definition",
        "commands",
        "symbol",
        "unit",
        "description",
        "quality",
        "text",
    ),
    *(
        "code",
        "method",
        "keeps",
        "area of use",
        "made for",
        "zone",
        "feature",
        "note",
        "group",
        "normalisation",
        "scale",
        "source",
        "comes out",
        "convention",
        "cloud",
        "image",
        "frame",
        "is",
    ),
)


def _escaped_for_markdown(cell: str) -> str:
    return cell.replace("\\", "\\\\").replace("|", "\\|").replace("*", "\\*")


_LONGEST_LABEL = 60


def _title_of(given: str, name: str, definition: str) -> str:
    """A projection as it was given, with what that means, which names the figure of the Earth: `krovak (+proj=...)`."""
    label, meant = label_of(given, name), label_of(definition, name)
    return label if label == meant else f"{label} ({meant})"


def label_of(given: str, name: str) -> str:
    """A projection as it was given, or, as WKT may be long, by its name."""
    return given if len(given) <= _LONGEST_LABEL and "\n" not in given else name


def table_text(columns: dict[str, list[str]], title: str, keys: int = 1, output: Path | None = None) -> str:
    """A table; columns that the terminal has no room for go to further tables, which repeat the first `keys`.

    Figures are never cut off. What goes to a file or a pipe has all the room that it needs.
    """
    room = _room(output)
    styled = output is None and takes_escapes(sys.stdout)
    unicode = output is not None or (sys.stdout.encoding or "").lower().startswith("utf")
    narrowest = _narrowest(columns, keys, room)
    stream = io.StringIO()
    for block in [columns] if room is None else _blocks(columns, keys, room, narrowest):
        table = Table(box=box.HEAVY_HEAD if unicode else box.ASCII)
        for name, cells in block.items():
            table.add_column(
                name,
                justify="left" if name in _TEXT else "right",
                overflow="fold",
                no_wrap=not _folds(name, cells),
                min_width=_least(name, cells, narrowest) - _BORDER,
            )
        for row in zip(*block.values(), strict=True):
            table.add_row(*(_bold_best(cell) for cell in row))
        needed = 1 + sum(_least(name, cells, narrowest) for name, cells in block.items())
        console = Console(file=stream, force_terminal=styled, width=max(room or _READABLE, needed))
        console.print(table)
    return notes_text([title] if title else [], output) + "\n".join(
        line.rstrip() for line in stream.getvalue().split("\n")
    )


def notes_text(lines: Iterable[str], output: Path | None = None) -> str:
    """Lines of words, which a terminal has in lines that fit."""
    return "".join(f"{folded(line, _room(output))}\n" for line in lines)


def _room(output: Path | None) -> int | None:
    """Columns of the terminal that is printed to; None without one."""
    return None if output is not None else width_of(sys.stdout)


_BORDER = 3  # of a column, with its padding
_READABLE = 200  # columns: a pipe has room enough, and yet keeps the descriptions of lists readable
_NARROWEST = (24, 16, 8)  # characters; texts wider than that are folded where there is no room
_LONGEST_FIGURE = 24  # as 0.99941 .. 1.00026


def _folds(name: str, cells: list[str]) -> bool:
    """Whether a column is of texts, which may be folded."""
    return name in _TEXT or max(map(cell_len, cells)) > _LONGEST_FIGURE


def _narrowest(columns: dict[str, list[str]], keys: int, room: int | None) -> int:
    """How narrow texts may be: not more than lets each column stand beside the keys."""
    names = list(columns)
    for narrowest in _NARROWEST:
        least = [_least(name, columns[name], narrowest) for name in names]
        if room is None or 1 + sum(least[:keys]) + max(least[keys:], default=0) <= room:
            return narrowest
    return _NARROWEST[-1]


def _least(name: str, cells: list[str], narrowest: int) -> int:
    """Characters that a column needs, with its border and padding."""
    width = max(cell_len(name), *map(cell_len, cells))
    return _BORDER + (min(width, narrowest) if _folds(name, cells) else width)


def _blocks(columns: dict[str, list[str]], keys: int, room: int, narrowest: int) -> Iterator[dict[str, list[str]]]:
    """Columns in groups that fit into `room` characters; each group begins with the first `keys`."""
    names = list(columns)
    least = {name: _least(name, columns[name], narrowest) for name in names}
    first = 1 + sum(least[name] for name in names[:keys])
    group, used = names[:keys], first
    for name in names[keys:]:
        if used + least[name] > room and len(group) > keys:
            yield {column: columns[column] for column in group}
            group, used = names[:keys], first
        group.append(name)
        used += least[name]
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


_DIGITS = 5


def certain(value: float | None, error: float | None = None) -> str:
    """Five significant digits at most, and none that the error makes doubtful; 0 for what is no more than its error."""
    if value is None:
        return "-"
    if not error or not value:
        return f"{value:.{_DIGITS}g}"
    if abs(value) <= error:
        return "0"
    before = math.floor(math.log10(abs(value))) + 1
    good = before + math.floor(-math.log10(error))
    return f"{value:.{max(1, min(_DIGITS, good))}g}"


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
