"""The commands `find`, `list` and `tables`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from projdist.answers import INDICES, TABLES, tables
from projdist.cli import options as opt
from projdist.cli.errors import refuse, refusing, working
from projdist.cli.formats import present
from projdist.cli.number_format import first_digit, fixed
from projdist.cli.report import Column, Mapped, Report, Row, Table, listing
from projdist.field import FIGURES
from projdist.matrices import MEASURES
from projdist.numerics import CRITERIA
from projdist.projections import NAMES, WORLD_MAPS, CrsSearch, find_crs, needed_parameters, projection_names
from projdist.support import shown

_LONGEST = 48  # characters of the name of an area
_MOST = 100_000


def find_command(
    words: list[str] = opt.argument("WORDS...", "In any order, of names, areas of use, methods; or a code."),
    authority: str = opt.option("NAMES", "Only of EPSG, ESRI, IGNF or IAU_2015, with commas.", ""),
    deprecated: bool = opt.flag("--deprecated", "Deprecated ones, too."),
    limit: str = opt.option("NUMBER", "How many to print.", "10"),
    format: opt.Format = "table",
) -> None:
    """Find projected CRSs and named maps by words, the likeliest first."""
    form, most = opt.format_of(format), opt.whole_number("limit", limit, 1, _MOST)
    chosen = [name for name in authority.split(",") if name.strip()]
    with refusing():
        found = find_crs(" ".join(words), authorities=chosen, deprecated=deprecated, limit=most)
    if not found.results:
        refuse(f"Nothing is found for '{shown(found.text)}'. {found.advice}", code=1)
    present(_find_report(found), form)


def _find_report(found: CrsSearch) -> Report:
    rows = found.rows()
    more = found.total - len(rows)
    return Report(
        tables=[
            Table(
                rows,
                [
                    Column("code", left=True),
                    Column("name", of=_name, left=True),
                    Column("area_name", "area of use", of=_area, left=True),
                ],
            )
        ],
        notes=[f"{more:,} more: --limit {found.total} shows all."] if more else [],
        data=found.to_dict,
        rows=lambda: rows,
    )


def _name(row: Row) -> str:
    return f"{row['name']} (deprecated)" if row["deprecated"] else str(row["name"])


def _area(row: Row) -> str:
    text = str(row["area_name"]).rstrip(".") or "-"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3].rstrip()}..."


# ---- lists ---------------------------------------------------------------------------------------


def list_command(
    what: str = opt.argument("projections|measures|figures|criteria|indices", "What to list."),
    format: opt.Format = "table",
) -> None:
    """List the projections, measures, figures, criteria or published indices that there are."""
    rows = _LISTS[opt.choice("list", what, _LISTS)]()
    present(listing(rows), opt.format_of(format))


def _projection_rows() -> list[dict[str, str]]:
    return [
        {
            "name": name,
            "kind": "name" if name in NAMES or name in WORLD_MAPS else "PROJ id",
            "needs": ", ".join(needed_parameters(name)),
            "definition": definition,
        }
        for name, definition in projection_names().items()
    ]


def _measure_rows() -> list[dict[str, str]]:
    rows = [
        {"name": measure.name, "symbol": measure.symbol, "unit": measure.unit, "description": measure.description}
        for measure in MEASURES.values()
    ]
    return [*rows, {"name": "scale@AZIMUTH", "symbol": "", "unit": "", "description": "Scale in an azimuth, degrees."}]


def _figure_rows() -> list[dict[str, str]]:
    """Figures by which maps are ranked and optimised."""
    return [
        {
            "name": figure.name,
            "unit": figure.unit,
            "definition": figure.description,
            "source": figure.source,
        }
        for figure in FIGURES.values()
    ]


def _criterion_rows() -> list[dict[str, str]]:
    """Statistics of a measure, and the published indices."""
    statistics = {name: (criterion.__doc__ or "").partition("\n")[0] for name, criterion in CRITERIA.items()}
    statistics["pNN"] = "Weighted percentile."
    rows = [{"name": name, "group": "statistics", "definition": text} for name, text in statistics.items()]
    indices = _index_rows()
    return [dict.fromkeys(indices[0], "") | row for row in rows] + indices


def _index_rows() -> list[dict[str, str]]:
    return [
        {
            "name": index.name,
            "symbol": index.symbol,
            "group": index.group,
            "definition": index.definition,
            "normalisation": index.normalisation,
            "scale": index.scale_dependence,
            "source": index.source,
        }
        for index in INDICES.values()
    ]


_LISTS = {
    "projections": _projection_rows,
    "measures": _measure_rows,
    "figures": _figure_rows,
    "criteria": _criterion_rows,
    "indices": _index_rows,
}


# ---- published -----------------------------------------------------------------------------------


def tables_command(
    name: str | None = opt.argument("[NAME]", f"{', '.join(TABLES)}; without it, the list of them.", None),
    format: str | None = opt.file_format(),
    output: opt.Output = None,
    overwrite: opt.Overwrite = False,
) -> None:
    """Print a table of the literature beside the same figures computed anew, and what explains the differences."""
    path = opt.printed_or_file(output, overwrite)
    form = opt.format_for(format, path)
    with refusing(), working("Computing"):
        report = listing(_names()) if name is None else _tables_report(tables(name).to_dict())
    present(report, form, path, overwrite)


def _names() -> list[Row]:
    return [{"name": table, "source": source} for table, source in TABLES.items()]


def _tables_report(found: dict[str, Any]) -> Report:
    rows = found["results"]
    explanations = {row["convention"]: row["explanation"] for row in rows if row["convention"]}
    places = [] if rows[0]["lat"] is None else [Column(key, show="{:.9g}".format) for key in ("lon", "lat")]
    others: list[Column | str] = [
        Column("value_by_convention", "otherwise", of=lambda row: _shown("value_by_convention", row)),
        "convention",
    ]
    columns: list[Column | str] = [
        "projection",
        *places,
        "measure",
        Column("published", of=lambda row: f"{row['published']:.{row['decimals']}f}"),
        Column("value", "ours", of=lambda row: _shown("value", row)),
        Column("error", show=first_digit),
        Column("difference", of=lambda row: _shown("difference", row, "+")),
        Column("reproduced", "comes out", of=_verdict, left=True),
        *(others if explanations else []),
    ]
    notes = [
        "Comes out: ours agrees to half a unit of the last digit printed.",
        *(f"{convention}: {text}" for convention, text in explanations.items()),
        *sorted({f"Source: {row['source']} ({row['status']})." for row in rows}),
    ]
    return Report(
        title=found["source"],
        tables=[Table(rows, columns, keys=2 + len(places))],
        notes=notes,
        data=lambda: found,
        maps=_maps(rows),
    )


def _maps(rows: Sequence[Row]) -> Mapped | None:
    """Maps of the table whose figures are global."""
    maps = {row["definition"]: row["projection"] for row in rows if row["lat"] is None}
    return Mapped([*maps], [*maps.values()], "globe") if maps else None


def _shown(key: str, row: Row, sign: str = "") -> str:
    """Figure with two decimals more than the published one."""
    return "" if row[key] is None else fixed(row[key], row["decimals"] + 2, sign)


def _verdict(row: Row) -> str:
    if row["reproduced"]:
        return "yes"
    return "otherwise" if row["explained"] else "no"
