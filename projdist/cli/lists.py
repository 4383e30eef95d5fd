"""The commands `find`, `list` and `tables`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from projdist.answers import INDICES, TABLES, tables
from projdist.cli import options as opt
from projdist.cli.errors import refuse, refusing, working
from projdist.cli.formats import present
from projdist.cli.number_format import first_digit, fixed, shortened
from projdist.cli.report import Column, Columns, Mapped, Report, Row, Table, listing
from projdist.field import FIGURES
from projdist.matrices import MEASURES
from projdist.numerics import CRITERIA
from projdist.projections import NAMES, WORLD_MAPS, find_crs, needed_parameters, projection_names
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
    rows = found.rows()
    columns: Columns = [
        Column("code", left=True),
        Column("name", of=lambda row: f"{row['name']} (deprecated)" if row["deprecated"] else row["name"], left=True),
        Column(
            "area_name",
            "area of use",
            of=lambda row: shortened(row["area_name"].rstrip(".") or "-", _LONGEST),
            left=True,
        ),
    ]
    more = found.total - len(rows)
    notes = [f"{more:,} more: --limit {found.total} shows all."] if more else []
    present(Report(tables=[Table(rows, columns)], notes=notes, data=found.to_dict, rows=lambda: rows), form)


# ---- lists ---------------------------------------------------------------------------------------


def list_command(
    what: str = opt.argument("projections|measures|figures|criteria|indices", "What to list."),
    format: opt.Format = "table",
) -> None:
    """List the projections, measures, figures, criteria or published indices that there are."""
    rows = _LISTS[opt.choice("list", what, _LISTS)]()
    present(listing(rows), opt.format_of(format))


def _rows(found: Iterable[Any], **columns: str) -> list[dict[str, str]]:
    """Rows of things, whose columns are attributes of theirs."""
    return [{name: getattr(one, attribute) for name, attribute in columns.items()} for one in found]


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


def _criterion_rows() -> list[dict[str, str]]:
    """Statistics of a measure, and the published indices."""
    statistics = {name: (criterion.__doc__ or "").partition("\n")[0] for name, criterion in CRITERIA.items()}
    statistics["pNN"] = "Weighted percentile."
    rows = [{"name": name, "group": "statistics", "definition": text} for name, text in statistics.items()]
    indices = _index_rows()
    return [dict.fromkeys(indices[0], "") | row for row in rows] + indices


def _index_rows() -> list[dict[str, str]]:
    same = {name: name for name in ("name", "symbol", "group", "definition", "normalisation")}
    return _rows(INDICES.values(), **same, scale="scale_dependence", source="source")


_LISTS = {
    "projections": _projection_rows,
    "measures": lambda: [
        *_rows(MEASURES.values(), name="name", symbol="symbol", unit="unit", description="description"),
        {"name": "scale@AZIMUTH", "symbol": "", "unit": "", "description": "Scale in an azimuth, degrees."},
    ],
    # Figures by which maps are ranked and optimised.
    "figures": lambda: _rows(FIGURES.values(), name="name", unit="unit", definition="description", source="source"),
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
    target = opt.target(format, output, overwrite)
    with refusing(), working("Computing"):
        if name is None:
            report = listing([{"name": table, "source": source} for table, source in TABLES.items()])
        else:
            report = _tables_report(tables(name).to_dict())
    present(report, *target)


def _tables_report(found: dict[str, Any]) -> Report:
    rows = found["results"]
    explanations = {row["convention"]: row["explanation"] for row in rows if row["convention"]}
    places = [] if rows[0]["lat"] is None else [Column(key, show="{:.9g}".format) for key in ("lon", "lat")]
    columns: Columns = [
        "projection",
        *places,
        "measure",
        Column("published", of=lambda row: f"{row['published']:.{row['decimals']}f}"),
        Column("value", "ours", of=lambda row: _figure("value", row)),
        Column("error", show=first_digit),
        Column("difference", of=lambda row: _figure("difference", row, "+")),
        Column("reproduced", "comes out", of=_verdict, left=True),
    ]
    if explanations:
        otherwise = Column("value_by_convention", "otherwise", of=lambda row: _figure("value_by_convention", row))
        columns += [otherwise, "convention"]
    notes = [
        "Comes out: ours agrees to half a unit of the last digit printed.",
        *(f"{convention}: {text}" for convention, text in explanations.items()),
        *sorted({f"Source: {row['source']} ({row['status']})." for row in rows}),
    ]
    of_the_globe = {row["definition"]: row["projection"] for row in rows if row["lat"] is None}
    return Report(
        title=found["source"],
        tables=[Table(rows, columns, keys=2 + len(places))],
        notes=notes,
        data=lambda: found,
        maps=Mapped([*of_the_globe], [*of_the_globe.values()], "globe") if of_the_globe else None,
    )


def _figure(key: str, row: Row, sign: str = "") -> str:
    """Figure with two decimals more than the published one."""
    return "" if row[key] is None else fixed(row[key], row["decimals"] + 2, sign)


def _verdict(row: Row) -> str:
    if row["reproduced"]:
        return "yes"
    return "otherwise" if row["explained"] else "no"
