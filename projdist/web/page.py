"""A page as HTML: one file with its style, its script and its data, which asks nothing of any server."""

from __future__ import annotations

import base64
import hashlib
import html
import importlib.resources
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from projdist.web.maps import Maps

# In this order: a module takes names only from those before it.
_MAP_SCRIPTS = ("frames.js", "measures.js", "sheets.js", "drawing.js", "maps.js")
_SCRIPTS = ("tables.js", "page.js")
_FEW_LINES = 8


class Cell(NamedTuple):
    """A text, and the number that it is sorted by, if it is not sorted as text."""

    text: str
    value: float | None = None


@dataclass(frozen=True, kw_only=True)
class PageTable:
    """A table: its columns with whether they stand to the left, and rows of cells, whose first one heads them."""

    title: str = ""
    columns: Sequence[tuple[str, bool]]
    rows: Sequence[Sequence[Cell]]


@dataclass(frozen=True, kw_only=True)
class Page:
    """What a page says. `copies` are texts to copy by what they are; `maps` may be there."""

    title: str
    lead: Sequence[str] = ()
    tables: Sequence[PageTable] = ()
    notes: Sequence[str] = ()
    copies: Mapping[str, str] = field(default_factory=dict)
    maps: Maps | None = None


def page_html(page: Page) -> str:
    """The page; its text is complete without scripts.

    Its policy allows its own style and script by their hashes, and no address at all.
    """
    has_maps = page.maps is not None and bool(page.maps.frames)
    style, script = _file("page.css"), _script((*_MAP_SCRIPTS, *_SCRIPTS) if has_maps else _SCRIPTS)
    policy = (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; "
        "base-uri 'none'; form-action 'none'"
    )
    title = html.escape(page.title or "projdist")
    body = "\n".join(_body(page))
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="projdist">
<meta name="color-scheme" content="light dark">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<main>
<h1>{title}</h1>
{body}
</main>
<script type="module">{script}</script>
</body>
</html>
"""


def _file(name: str) -> str:
    return (importlib.resources.files("projdist") / "web" / name).read_text(encoding="utf-8")


def _script(names: Sequence[str]) -> str:
    """Modules as one, without what they import from and export to each other."""
    text = "\n".join(map(_file, names))
    text = re.sub(r"^import .*?;\n", "", text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"^export ", "", text, flags=re.MULTILINE)


def _hash(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"


def _body(page: Page) -> Iterator[str]:
    yield from (f"<p>{html.escape(line)}</p>" for line in page.lead if line)
    if page.maps is not None and page.maps.frames:
        yield from _maps(page.maps)
    yield from map(_table, page.tables)
    notes = [*page.notes, *(page.maps.notes if page.maps else ())]
    items = "\n".join(f"<li>{html.escape(line)}</li>" for line in notes if line)
    if items:
        yield f'<section class="notes">\n<h2>Notes</h2>\n<ul>\n{items}\n</ul>\n</section>'
    yield from (_copy(name, text) for name, text in page.copies.items())


def _maps(maps: Maps) -> Iterator[str]:
    """Places for the maps, and their data, which no browser runs."""
    yield '<section class="maps" aria-label="Maps">'
    yield (
        '<div class="bar" hidden><label>Measure <select id="measure"></select></label>'
        '<div class="scale"><canvas id="scale" role="img" aria-label="Colours of the measure"></canvas></div>'
        '<label><input type="checkbox" id="ellipses"> Indicatrices</label></div>'
    )
    yield '<div class="grid">'
    for k, title in enumerate(maps.titles):
        name = html.escape(title)
        yield (
            f'<figure><figcaption id="title-{k}">{name}</figcaption>'
            f'<canvas class="map" id="map-{k}" tabindex="0" role="application" aria-labelledby="title-{k}" '
            f'aria-describedby="help"></canvas>'
            f'<p class="told" id="told-{k}" aria-live="polite"></p></figure>'
        )
    yield "</div>"
    yield (
        '<p id="help" class="help" hidden>Point at a map, or move with the arrow keys (faster with shift), for the '
        "distortion there; h and k are the scales along meridian and parallel, a and b the largest and the smallest. "
        "Figures have the digits that are certain, a span or ? where none is; ~: beside a cut, an edge or a pole.</p>"
    )
    yield "<noscript><p>The maps are drawn by a script, and this browser runs none. All else is here.</p></noscript>"
    yield "</section>"
    scales = {"measure": maps.measure, "scales": maps.scales}
    yield f'<script type="application/json" id="scales">{_json(scales)}</script>'
    for k, frame in enumerate(maps.frames):
        yield f'<script type="text/plain" id="frame-{k}">{frame}</script>'


def _json(value: Any) -> str:
    """JSON that ends no element and begins none."""
    return json.dumps(value, allow_nan=False).replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _table(table: PageTable) -> str:
    kinds = ["" if left else ' class="number"' for _, left in table.columns]
    caption = f"<caption>{html.escape(table.title)}</caption>\n" if table.title else ""
    head = "".join(
        f'<th scope="col"{kind}>{html.escape(text)}</th>' for (text, _), kind in zip(table.columns, kinds, strict=True)
    )
    rows = "\n".join(f"<tr>{''.join(_cells(row, kinds))}</tr>" for row in table.rows)
    name = html.escape(table.title) or "Table"
    return (
        f'<div class="table" tabindex="0" role="group" aria-label="{name}">'
        f"<table>\n{caption}<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}\n</tbody>\n"
        "</table></div>"
    )


def _cells(row: Sequence[Cell], kinds: Sequence[str]) -> Iterator[str]:
    for k, (cell, kind) in enumerate(zip(row, kinds, strict=True)):
        value = "" if cell.value is None else f' data-value="{cell.value!r}"'
        text = html.escape(cell.text.strip())
        yield f'<th scope="row"{kind}{value}>{text}</th>' if k == 0 else f"<td{kind}{value}>{text}</td>"


def _copy(name: str, text: str) -> str:
    """A text with a button; a long one is folded."""
    block = f"<pre>{html.escape(text)}</pre>"
    if text.count("\n") > _FEW_LINES:
        block = f"<details><summary>{html.escape(text.partition(chr(10))[0])} ...</summary>\n{block}</details>"
    return (
        f'<section class="copy"><h2>{html.escape(name)}</h2>\n'
        f'<button type="button" class="copier" hidden>Copy</button>\n{block}</section>'
    )
