"""Pages of reports: bundled scripts, maps, and HTML."""

import hashlib
import html
import importlib.resources
import json
import re
import zlib
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from string import Template
from typing import Any, NamedTuple

import numpy as np

from projdist import matrices, plots, regions, surfaces
from projdist._typing import FloatArray
from projdist.projections import Projection, ProjectionLike
from projdist.web.frames import frame_of, packed

_TYPES = (".html", ".js", ".css")
_SHARED = ("frames.js", "measures.js", "sheets.js", "drawing.js", "tables.js")
_IMPORT = re.compile(r'^import \{([^}]*)\} from "\./(\w+)\.js";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export ((?:async )?function|class|const) (\w+)", re.MULTILINE)


def bundled(files: Mapping[str, str], entry: str) -> str:
    """An ES module bundled with its imports from `files`, texts by name (`frames.js`), each in its own scope."""
    # Imports must have names in braces and a semicolon; exports must be functions, classes or constants where declared.
    order = [*dict.fromkeys(_modules(files, entry.removesuffix(".js")))]
    scopes = [_scope(name, files[f"{name}.js"]) for name in order[:-1]]
    return "\n".join([*scopes, _without_imports(files[entry])])


def _modules(files: Mapping[str, str], name: str) -> Iterator[str]:
    """Names of the modules that a module imports, each after its own imports, and of the module itself."""
    for _, other in _IMPORT.findall(files[f"{name}.js"]):
        yield from _modules(files, other)
    yield name


def _scope(name: str, text: str) -> str:
    exported = [found for _, found in _EXPORT.findall(text)]
    body = _EXPORT.sub(r"\1 \2", _without_imports(text))
    return f"const ${name} = (() => {{\n{body}\nreturn {{ {', '.join(exported)} }};\n}})();"


def _without_imports(text: str) -> str:
    """Module text with imports replaced by names from the other modules' scopes."""
    return _IMPORT.sub(lambda found: f"const {{{found[1].replace(' as ', ': ')}}} = ${found[2]};\n", text)


def live_files() -> dict[str, str]:
    """Files of the live page by name: its own, and the modules that it shares with reports."""
    live = importlib.resources.files("projdist") / "web" / "live"
    own = {file.name: file.read_text(encoding="utf-8") for file in live.iterdir() if file.name.endswith(_TYPES)}
    return own | {name: _file(name) for name in _SHARED}


def _file(name: str) -> str:
    return (importlib.resources.files("projdist") / "web" / name).read_text(encoding="utf-8")


GROUPS = {
    "Areas and angles": ("fisher", "kavrayskiy", "airy", "jordan", "jordan_kavrayskiy"),
    "Areas": ("areal_scale", "log_areal_scale", "areal_error_ppm"),
    "Angles": ("angular_distortion", "log_anisotropy", "meridian_parallel_angle"),
    "Scales": ("tissot_semimajor", "tissot_semiminor", "meridional_scale", "parallel_scale", "scale_error_ppm"),
    "North": ("meridian_convergence",),
}

SHOWN_MEASURES = tuple(name for names in GROUPS.values() for name in names)


# ---- maps ----------------------------------------------------------------------------------------

MOST_MAPS = 6
"""Largest number of maps on a page."""

_NODES = 10_000  # of a map, between which pages interpolate
_COLOURS = 256


@dataclass(frozen=True, kw_only=True)
class Maps:
    """Encoded frames of maps, the colour scale of each measure, the measure shown first, and notes."""

    titles: tuple[str, ...]
    frames: tuple[str, ...]
    scales: tuple[dict[str, Any], ...]
    measure: str
    notes: tuple[str, ...]


def draw_maps(
    projections: Sequence[ProjectionLike],
    *,
    titles: Sequence[str],
    region: regions.RegionLike | None = None,
    measure: str = "fisher",
    height: float = 0.0,
    marks: Mapping[str, Any] | None = None,
) -> Maps:
    """Maps of the first `MOST_MAPS` projections over a region, by default the area of use or the globe."""
    # `measure` is shown first, or fisher if the page does not have it. Projections that show no part of the region are
    # left out, with a note. Scales are at an ellipsoidal `height` in metres; `marks` are geometries in longitude and
    # latitude, by name.
    name = matrices.get_measure(measure).name
    maps = [Projection.from_user_input(projection) for projection in projections[:MOST_MAPS]]
    place = surfaces.shown_part(regions.region_for(region, maps))
    step = cell_step(place.bounds)
    count = len(projections)
    notes = [f"These are the maps of the first {MOST_MAPS} of {count}."] if count > MOST_MAPS else []
    frames, shown, values, weights = [], [], [], []
    for projection, title in zip(maps, titles, strict=False):
        try:
            surface = surfaces.surface_of(projection, place, step)
        except ValueError as error:
            notes.append(str(error))
            continue
        header, arrays, J = frame_of(surface, title, height=height, marks=marks)
        frames.append(b64encode(zlib.compress(packed(header, arrays), 9)).decode("ascii"))
        shown.append(title)
        values.append(J)
        weights.append(surface.weights)
    return Maps(
        titles=tuple(shown),
        frames=tuple(frames),
        scales=tuple(colour_scales(values, weights)),
        measure=name if name in SHOWN_MEASURES else SHOWN_MEASURES[0],
        notes=tuple(notes),
    )


def cell_step(bounds: surfaces.Bounds, nodes: float = _NODES) -> float:
    """Cell size in degrees for about so many nodes within bounds."""
    _, south, _, north = bounds
    longest = np.cos(np.radians(max(south, -north, 0.0)))
    return float(np.sqrt(surfaces.longitude_width(bounds) * longest * (north - south) / nodes))


def colour_scales(jacobians: Sequence[FloatArray], weights: Sequence[FloatArray]) -> Iterator[dict[str, Any]]:
    """Colour scale of each measure, shared by all maps."""
    if not jacobians:
        return
    for group, name in ((group, name) for group, names in GROUPS.items() for name in names):
        measure = matrices.get_measure(name)
        scale = plots.ColourScale.of(measure, [measure(J) for J in jacobians], weights)
        colours = scale.colours(np.linspace(0.0, 1.0, _COLOURS), bytes=True)[:, :3]
        yield {
            "name": name,
            "group": group,
            "label": scale.label,
            "kind": measure.kind,
            "limits": [*scale.limits],
            "levels": scale.levels.tolist(),
            "labels": scale.labels,
            "extend": scale.extend,
            "colours": b64encode(np.ascontiguousarray(colours, dtype=np.uint8).tobytes()).decode("ascii"),
        }


# ---- page ----------------------------------------------------------------------------------------

# In the order of their dependence.
_MAP_SCRIPTS = ("frames.js", "measures.js", "sheets.js", "drawing.js", "maps.js")
_SCRIPTS = ("tables.js", "page.js")
_FEW_LINES = 8


class Cell(NamedTuple):
    """A text, and the number by which it is sorted, None to sort as text."""

    text: str
    value: float | None = None


@dataclass(frozen=True, kw_only=True)
class PageTable:
    """A table: columns (title, left-aligned) and rows of cells, the first of which is the row's heading."""

    title: str = ""
    columns: Sequence[tuple[str, bool]]
    rows: Sequence[Sequence[Cell]]


@dataclass(frozen=True, kw_only=True)
class Page:
    """Content of a page; `copies` are texts to copy, by title, `signed` labels of blanks to fill in by hand."""

    title: str
    lead: Sequence[str] = ()
    tables: Sequence[PageTable] = ()
    notes: Sequence[str] = ()
    copies: Mapping[str, str] = field(default_factory=dict)
    maps: Maps | None = None
    signed: Sequence[str] = ()


def page_html(page: Page) -> str:
    """HTML of a page, complete without scripts; its content security policy allows only its style and script."""
    has_maps = page.maps is not None and bool(page.maps.frames)
    style, script = _file("page.css"), _script((*_MAP_SCRIPTS, *_SCRIPTS) if has_maps else _SCRIPTS)
    policy = (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; "
        "base-uri 'none'; form-action 'none'"
    )
    title = html.escape(page.title or "projdist")
    body = "\n".join(_body(page))
    parts = {"policy": policy, "title": title, "style": style, "body": body, "script": script}
    return Template(_file("page.html")).substitute(parts)


def _script(names: Sequence[str]) -> str:
    """Modules concatenated, without imports and exports."""
    text = "\n".join(map(_file, names))
    text = re.sub(r"^import .*?;\n", "", text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"^export ", "", text, flags=re.MULTILINE)


def _hash(text: str) -> str:
    return f"sha256-{b64encode(hashlib.sha256(text.encode()).digest()).decode()}"


def _body(page: Page) -> Iterator[str]:
    yield from (f"<p>{html.escape(line)}</p>" for line in page.lead if line)
    if page.maps is not None and page.maps.frames:
        yield _maps(page.maps)
    yield from map(_table, page.tables)
    notes = [*page.notes, *(page.maps.notes if page.maps else ())]
    items = "\n".join(f"<li>{html.escape(line)}</li>" for line in notes if line)
    if items:
        yield f'<section class="notes">\n<h2>Notes</h2>\n<ul>\n{items}\n</ul>\n</section>'
    if page.signed:
        blanks = "".join(f"<div><dt>{html.escape(text)}</dt><dd></dd></div>" for text in page.signed)
        yield f'<section class="signed">\n<h2>Checked by</h2>\n<dl>{blanks}</dl>\n</section>'
    yield from (_copy(name, text) for name, text in page.copies.items())


def _maps(maps: Maps) -> str:
    """Canvases of the maps, and their data as scripts that no browser runs."""
    figures = "\n".join(
        f'<figure><figcaption id="title-{k}">{html.escape(title)}</figcaption>'
        f'<canvas class="map" id="map-{k}" tabindex="0" role="application" aria-labelledby="title-{k}" '
        f'aria-describedby="help"></canvas>'
        f'<p class="told" id="told-{k}" aria-live="polite"></p></figure>'
        for k, title in enumerate(maps.titles)
    )
    data = (f'<script type="text/plain" id="frame-{k}">{frame}</script>' for k, frame in enumerate(maps.frames))
    scales = _json({"measure": maps.measure, "scales": maps.scales})
    return Template(_file("maps.html")).substitute(figures=figures, scales=scales, frames="\n".join(data)).rstrip()


def _json(value: Any) -> str:
    """JSON in which no character can open or close an element."""
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
    """A text with a copy button; a long one is folded."""
    block = f"<pre>{html.escape(text)}</pre>"
    if text.count("\n") > _FEW_LINES:
        block = f"<details><summary>{html.escape(text.partition(chr(10))[0])} ...</summary>\n{block}</details>"
    return (
        f'<section class="copy"><h2>{html.escape(name)}</h2>\n'
        f'<button type="button" class="copier" hidden>Copy</button>\n{block}</section>'
    )
