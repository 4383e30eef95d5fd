"""Reports as web pages."""

from __future__ import annotations

import math
import re
import shlex
import sys
from collections.abc import Iterator
from typing import Any

from projdist.cli.errors import working
from projdist.cli.report import Mapped, Report, Row, Table, value_of
from projdist.projections import Projection, crs_of, crs_wkt
from projdist.web import Cell, Maps, Page, PageTable, draw_maps, page_html

_CODE = re.compile(r"\w+:\w+")
_FORMS = {
    "proj": "PROJ",
    "wkt": "WKT2",
    "wkt-derived": "WKT2 of a derived CRS",
    "projjson": "PROJJSON",
    "esri": "WKT of Esri",
}


def page_text(report: Report) -> str:
    """HTML page of a report."""
    return page_html(
        Page(
            title=report.title,
            lead=report.lead,
            tables=[_table(table) for table in report.tables],
            notes=report.notes,
            copies={name: text for name, text in _copies(report) if text},
            maps=_maps(report.maps) if report.maps else None,
        )
    )


def _maps(mapped: Mapped) -> Maps:
    with working("Drawing"):
        options = mapped._asdict()
        return draw_maps(options.pop("projections"), **options)


def _table(table: Table) -> PageTable:
    columns = [(column.head, column.is_left(table.rows)) for column in table.columns]
    texts = [column.cells(table.rows) for column in table.columns]
    rows = [
        [Cell(text[k], _figure(row, column.key)) for text, column in zip(texts, table.columns, strict=True)]
        for k, row in enumerate(table.rows)
    ]
    return PageTable(title=table.title, columns=columns, rows=rows)


def _figure(row: Row, key: str) -> float | None:
    """Sort key of a cell: its value if finite, else None."""
    value: Any = value_of(row, key)
    try:
        figure = float(value)
    except (TypeError, ValueError):
        return None
    return figure if math.isfinite(figure) else None


def _copies(report: Report) -> Iterator[tuple[str, str | None]]:
    """Texts to copy: the command, and the forms of the answer or else of its maps."""
    yield "Command", shlex.join(["projdist", *sys.argv[1:]])
    yield from ((_FORMS[form], copy.text) for form, copy in report.copies.items())
    if report.maps and not report.copies:
        for given, title in zip(report.maps.projections, report.maps.titles, strict=True):
            projection = Projection.from_user_input(given)
            if projection.definition.startswith("+"):
                yield f"PROJ: {title}", projection.definition
            yield f"WKT2: {title}", _wkt(projection)


def _wkt(projection: Projection) -> str | None:
    """WKT2 of a projection, of a code its authority's own; None if it has none."""
    if _CODE.fullmatch(projection.definition):
        return str(crs_of(projection.definition).to_wkt("WKT2_2019", pretty=True))
    return crs_wkt(projection, projection.name)[0]
