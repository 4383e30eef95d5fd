"""The commands that look things up: `info` of a projection, `find`, `list` and `tables`."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from projdist import answers, decisions, earth, field, matrices, numerics, plots, projections, regions, support
from projdist.cli import options as opt, wording as say
from projdist.cli.draw import sketch_of
from projdist.cli.errors import refuse, refusing, working
from projdist.cli.report import DETAILS, Column, Mapped, Report, Row, Table, present

_SAME = 5  # codes of CRSs of the same map that are listed
_LONGEST = 100  # characters of a text
_BOUND = 1e7  # ppm; the map has no bound near where its largest scale error is above this
_MEASURE = "scale_error_ppm"
_TITLES = {
    _MEASURE: "scale error, ppm",
    "omega": "angular deformation, deg",
    "s": "areal scale",
    "h": "scale along meridians",
    "k": "scale along parallels",
}
_BRIEF = ("area of use", "datum", "coordinates")
_SIDES = ("west", "south", "east", "north")
_KEEPS = {"conformal": "angles", "equal-area": "areas", "equidistant": "distances"}


def info_command(
    projection: opt.OneProjection,
    region: opt.Region = None,
    format: str | None = opt.report_format(),
    output: str | None = opt.output(
        "A heat map of the scale error: .png, .svg or .pdf; or everything as a page with a live map: .html."
    ),
    *,
    pictured: opt.PictureOptions,
) -> None:
    """Show what a projection is, what it keeps as measured, and its errors in its area; or what a region is."""
    target = opt.page_target(format, output, pictured.overwrite)
    picture = opt.picture_of(output, pictured, beside=(opt.PAGE_SUFFIX,))
    if projection not in projections.projection_names() and regions.is_region_text(projection):
        opt.refuse_given({"--region": region, "--output": picture}, "It is for projections, not for a region.")
        present(_region_report(projection), *target)
        return
    area = opt.region_of(region, [projection])
    with refusing(), working("Measuring"):
        found = decisions.info(projection, area)
    if picture is not None:
        shown: dict[str, Any] = {"measure": _MEASURE, "airy_kavrayskiy": [found.airy_kavrayskiy.raw]}
        picture.save(plots.heatmap_figure, found.projection, region=found.region, **shown)
    stated, label, name = found.crs_metadata, say.label_of(found.given, found.projection.name), found.projection.name
    parameters = [one._asdict() for one in stated.parameters]
    card = [{"what": what, "it is": text} for what, text in _card(found) if text]
    on_earth = not found.projection.ellipsoid.is_of_another_body and not isinstance(found.region, regions.PointSet)
    given, place = shlex.quote(stated.code or label), shlex.quote(found.region.name)
    value = Column("value", show=lambda value: f"{value:.12g}" if isinstance(value, float) else value)
    columns = [Column("name", "parameter"), value, Column("unit", left=True)]
    report = Report(
        answer=[*_answer(found, say.named(stated.code or label, name) if stated.code else say.spoken(label, name))],
        brief=[Table([row for row in card if row["what"] in _BRIEF], ["what", "it is"], most=None)],
        next={f"projdist heatmap {given}{f' -r {place}' if area else ''}": "To see where it distorts"}
        | ({f"projdist recommend {place}": "For the best map of this area"} if on_earth else {}),
        title=f"{stated.code or label}: {name}" if stated.code or label != name else label,
        tables=[
            Table(card, ["what", "it is"]),
            *([Table(parameters, columns, "Parameters")] if parameters else []),
            _errors(found),
        ],
        sketch=sketch_of(found.projection, found.region, target.path) if target.form == DETAILS or target.path else [],
        notes=[*_notes(found)],
        data=found.to_dict,
        rows=lambda: [found.row()],
        written=[picture],
        maps=Mapped([found.projection], [say.caption(stated.code or label, name)], found.region, _MEASURE),
    )
    present(report, *target)


def _region_report(text: str) -> Report:
    """Report of what a region is: its area, bounds, and the limits and definition of a named area."""
    region = opt.region_of(text)
    west, south, east, north = (round(bound, 1) for bound in region.bounds)
    words, stated = say.region_words(region), regions.definition(region.name)
    within = "" if region.name == "globe" else f" from {regions.region_title(regions.Box(west, south, east, north))}"
    begin = words.replace("the ", "The ", 1) if words.startswith("the ") else words
    size = "lie" if isinstance(region, regions.PointSet) else f"has {say.size_text(region)}"
    answer = [f"{begin} {size}{within}."]
    made_of = [{"it is made of": part} for part in filter(None, stated["definition"].split(" + "))]
    facts = {
        "region": region.name,
        "area_km2": region.area_km2,
        **dict(zip(_SIDES, region.bounds, strict=True)),
        **stated,
    }
    return Report(
        answer=[*answer, *([f"Its limits: {stated['limits']}."] if stated["limits"] else [])],
        brief=[],
        next={f"projdist recommend {shlex.quote(region.name)}": "For the best map of it"},
        title=begin,
        tables=[Table(made_of, ["it is made of"])] if made_of else [],
        data=lambda: facts,
        rows=lambda: [facts],
    )


def _answer(found: decisions.MapInfo, name: str) -> Iterator[str]:
    """Sentences: what the map keeps, its errors over the region, and whether it is deprecated."""
    kept = [_KEEPS[one] for one in found.keeps]
    area = found.projection.area_of_use
    own = area is not None and found.region == regions.Box(*area)
    place = "its area of use" if own else say.region_words(found.region)
    yield f"{name} keeps {support.listed(kept, 'and') if kept else 'neither areas, angles nor distances'}."
    scale, areal, omega = (found.measures[key] for key in (_MEASURE, "s", "omega"))
    if scale.maximum.value < _BOUND:
        off = max(areal.maximum.value - 1.0, 1.0 - areal.minimum.value)
        errors = say.errors_text(1e-6 * scale.maximum.value, off, omega.maximum.value)
        at = f" The worst place is {say.place_text(scale.maximum.lon, scale.maximum.lat)}."
    else:
        rms = say.rms_text(found.airy_kavrayskiy.raw)
        errors = f"scales are off by {rms} (RMS), without bound near the worst places"
        at = ""
    yield f"Over {place}, {errors}.{at}"
    if found.coverage < say.WHOLE:
        yield f"It shows {say.per_cent(found.coverage)} of that."
    if found.crs_metadata.deprecated:
        instead = support.listed(found.crs_metadata.replaced_by, "or")
        yield f"It is deprecated{f': use {instead}' if instead else ''}."


def _card(found: decisions.MapInfo) -> Iterator[tuple[str, str | None]]:
    """Rows (label, text) of the card; unknown facts have no text."""
    stated, definition = found.crs_metadata, found.projection.definition
    yield "kind", stated.kind
    if stated.deprecated:
        instead = f"; use {support.listed(stated.replaced_by, 'or')} instead" if stated.replaced_by else ""
        yield "status", f"deprecated{instead}"
    kept = [f"{_KEEPS[name]} ({name}, to {found.departures[name]:.0e})" for name in found.keeps]
    yield "keeps", f"{support.listed(kept, 'and') if kept else 'neither angles, areas nor distances'}, as measured"
    if found.promises and found.promises not in found.keeps:
        yield "should keep", f"{_KEEPS[found.promises]}, by its method: it is not {found.promises} as measured"
    yield "area of use", _short(stated.area_name)
    if found.projection.area_of_use is not None:
        west, south, east, north = found.projection.area_of_use
        longitudes = f"{earth.longitude_text(west)} to {earth.longitude_text(east)}"
        yield "bounds", f"{longitudes}, {earth.latitude_text(south)} to {earth.latitude_text(north)}"
    yield "made for", _short(stated.scope)
    yield "datum", stated.datum
    yield "based on", stated.geographic_crs
    yield "prime meridian", stated.prime_meridian
    ellipsoid, name = found.projection.ellipsoid, stated.ellipsoid_name
    if ellipsoid.is_sphere:
        yield "ellipsoid", f"{name or 'sphere'}, {ellipsoid.a:.11g} m"
    else:
        parts = (name, f"a {ellipsoid.a:.11g} m", f"1/f {1.0 / ellipsoid.f:.12g}")
        yield "ellipsoid", ", ".join(filter(None, parts))
    if stated.unit:
        unit = stated.unit if stated.unit_metres == 1.0 else f"{stated.unit} ({stated.unit_metres:.12g} m)"
        axes = ", ".join(f"{axis.name.lower()} ({axis.direction})" for axis in stated.axes)
        yield "coordinates", f"{axes} in {unit}" if axes else unit
    yield "method", (stated.method or "").replace("_", " ")
    if not stated.code and "\n" not in definition and definition.startswith("+"):
        yield "PROJ", definition
    codes, others = [*found.same_map], len(found.same_map) - _SAME
    yield "same map", ", ".join(codes) if others <= 1 else f"{', '.join(codes[:_SAME])} and {others} others"
    yield "remarks", _short(stated.remarks)


def _short(text: str | None) -> str:
    """Text shortened to `_LONGEST` characters, or to the colon before a list."""
    text = " ".join((text or "").split()).rstrip(".")
    return text if len(text) <= _LONGEST else say.shortened(text.partition(": ")[0], _LONGEST)


def _errors(found: decisions.MapInfo) -> Table:
    rows = [{"name": _TITLES[name], **spread.to_dict()} for name, spread in found.measures.items()]
    columns = [
        Column("name", "measure"),
        Column("mean", show=_figure, error="mean_error"),
        Column("min", "least", _figure, error="min_error"),
        Column("max", "largest", _figure, error="max_error"),
        Column("at", "largest at", of=_place, left=True),
    ]
    area = found.projection.area_of_use
    where = "its area of use" if area and found.region == regions.Box(*area) else found.region.name
    return Table(rows, columns, f"Over {where} ({say.size_text(found.region)})")


def _figure(value: float, error: float | None) -> str:
    """Figure with certain digits; ratios near 1 with decimals."""
    return say.rounded(value, max(error or 0.0, 1e-6)) if 0.5 < value < 2.0 else say.certain(value, error)


def _place(row: Any) -> str:
    lon, lat, least, most = (row[key] for key in ("max_lon", "max_lat", "min", "max"))
    if None in (lon, lat, least, most) or _figure(most, row["max_error"]) == _figure(least, row["min_error"]):
        return "-"
    return say.place_text(lon, lat)


def _notes(found: decisions.MapInfo) -> Iterator[str]:
    AK = found.airy_kavrayskiy
    yield (
        f"Airy-Kavrayskiy error, the RMS of sqrt(ln^2 a + ln^2 b): {say.with_error(AK.raw, AK.error)}, after the best "
        f"scale {say.rounded(AK.scaled, AK.error)}, after the best linear map {say.rounded(AK.affine, AK.error)}."
    )
    if found.coverage < 1.0 - 1e-6:
        yield f"The map covers {say.per_cent(found.coverage)} of the region; the figures are for that share."
    if any(spread.maximum.value == float("inf") for spread in found.measures.values()):
        yield "-: the measure has no bound, or its mean diverges."


_LONGEST_AREA = 48  # characters of the name of an area
_MOST = 100_000
_FOUND = 3


def find_command(
    words: list[str] = opt.argument("WORDS...", "Words in any order, from names, areas of use or methods; or a code."),
    authority: str = opt.option("NAMES", "Only these: EPSG, ESRI, IGNF, IAU_2015, with commas.", ""),
    deprecated: bool = opt.flag("--deprecated", "Include deprecated CRSs."),
    limit: str | None = opt.option("NUMBER", "How many to print; three if not given, with --details ten."),
    format: opt.Format = "table",
) -> None:
    """Find projected CRSs and named maps by words, the best match first."""
    form, most = opt.format_of(format), opt.whole_number("limit", limit or "10", 1, _MOST)
    chosen = [name for name in authority.split(",") if name.strip()]
    with refusing():
        found = projections.find_crs(" ".join(words), authorities=chosen, deprecated=deprecated, limit=most)
    if not found.results:
        refuse(f"Nothing was found for '{support.shown(found.text)}'. {found.advice}", code=1)
    rows = found.rows()
    columns = [
        Column("code", left=True),
        Column("name", of=lambda row: f"{row['name']} (deprecated)" if row["deprecated"] else row["name"], left=True),
        Column(
            "area_name", "area of use", lambda name: say.shortened(name.rstrip(".") or "-", _LONGEST_AREA), left=True
        ),
    ]
    more = found.total - len(rows)
    notes = [f"{more:,} more: --limit {found.total} shows all."] if more else []
    first, likeliest = rows[0], f"The likeliest of {found.total:,} is " if found.total > 1 else "That is "
    report = Report(
        answer=[f"{likeliest}{say.named(first['code'], first['name'])}."],
        brief=[Table(rows, columns, most=None if limit else _FOUND)],
        next={f"projdist info {first['code']}": "What it is, and its errors"},
        tables=[Table(rows, columns)],
        notes=notes,
        data=found.to_dict,
    )
    present(report, form)


# ---- lists ---------------------------------------------------------------------------------------


def list_command(
    what: str = opt.argument("projections|measures|figures|criteria|indices|regions", "What to list."),
    format: opt.Format = "table",
) -> None:
    """List the projections, measures, figures, criteria, published indices or named regions."""
    rows = _LISTS[opt.choice("list", what, _LISTS)]()
    present(_names_report(rows, what), opt.format_of(format))


def _names_report(rows: Sequence[Row], what: str) -> Report:
    """Report of the names in rows; the rows are its details."""
    names = [row["name"] for row in rows if row.get("kind") not in _COUNTED.values()]
    others = f", and {len(rows) - len(names)} {_COUNTED[what]}s" if len(names) < len(rows) else ""
    answer = [f"{len(names)} {what}: {', '.join(names)}{others}."]
    return Report(answer=answer, brief=[], tables=[Table(rows, rows[0])], data=lambda: rows)


_PROJ_ID, _PLACE = "PROJ id", "country or state"
_COUNTED = {"projections": _PROJ_ID, "regions": _PLACE}  # kinds that are only counted


def _rows(found: Iterable[Any], **columns: str) -> list[dict[str, str]]:
    """Rows of objects; each column is an attribute of theirs."""
    return [{name: getattr(one, attribute) for name, attribute in columns.items()} for one in found]


def _criterion_rows() -> list[dict[str, str]]:
    """Statistics of a measure, and the published indices."""
    statistics = {name: (criterion.__doc__ or "").partition("\n")[0] for name, criterion in numerics.CRITERIA.items()}
    statistics["pNN"] = "Weighted percentile."
    indices = _index_rows()
    empty = dict.fromkeys(indices[0], "") | {"group": "statistics"}
    return [empty | {"name": name, "definition": text} for name, text in statistics.items()] + indices


def _index_rows() -> list[dict[str, str]]:
    same = {name: name for name in ("name", "symbol", "group", "definition", "normalisation")}
    return _rows(answers.INDICES.values(), **same, scale="scale_dependence", source="source")


_LISTS: dict[str, Callable[[], list[dict[str, Any]]]] = {
    "projections": lambda: [
        {
            "name": name,
            "kind": "name" if name in projections.NAMES or name in projections.WORLD_MAPS else _PROJ_ID,
            "needs": ", ".join(projections.needed_parameters(name)),
            "definition": definition,
        }
        for name, definition in projections.projection_names().items()
    ],
    "measures": lambda: [
        *_rows(matrices.MEASURES.values(), name="name", symbol="symbol", unit="unit", description="description"),
        {"name": "scale@AZIMUTH", "symbol": "", "unit": "", "description": "Scale in an azimuth, degrees."},
    ],
    # Figures by which maps are ranked and optimised.
    "figures": lambda: _rows(
        field.FIGURES.values(), name="name", unit="unit", definition="description", source="source"
    ),
    "criteria": _criterion_rows,
    "indices": _index_rows,
    "regions": lambda: [
        {"name": name, "kind": _PLACE if name.startswith(("country:", "state:")) else "area"} | regions.definition(name)
        for name in regions.region_names()
    ],
}


# ---- published -----------------------------------------------------------------------------------


def tables_command(
    name: str | None = opt.argument("[NAME]", f"{', '.join(answers.TABLES)}; without it, their list.", None),
    format: str | None = opt.file_format(),
    output: opt.Output = None,
    overwrite: opt.Overwrite = False,
) -> None:
    """Print a table from the literature beside the same figures recomputed, and what explains the differences."""
    target = opt.target(format, output, overwrite)
    with refusing(), working("Computing"):
        if name is None:
            known = [{"name": table, "source": source} for table, source in answers.TABLES.items()]
            report = _names_report(known, "published tables")
        else:
            report = _tables_report(answers.tables(name).to_dict())
    present(report, *target)


_VERDICTS = {"yes": "come out as printed", "otherwise": "come out by another convention", "no": "do not come out"}


def _tables_report(found: dict[str, Any]) -> Report:
    rows = found["results"]
    explanations = {row["convention"]: row["explanation"] for row in rows if row["convention"]}

    def verdict(row: Any) -> str:
        return "yes" if row["reproduced"] else "otherwise" if row["explained"] else "no"

    places = [] if rows[0]["lat"] is None else [Column(key, show="{:.9g}".format) for key in ("lon", "lat")]
    columns: list[Column | str] = [
        "projection",
        *places,
        "measure",
        Column("published", of=lambda row: f"{row['published']:.{row['decimals']}f}"),
        Column("value", "ours", of=lambda row: _published("value", row)),
        Column("error", show="{:.0e}".format),
        Column("difference", of=lambda row: _published("difference", row, "+")),
        Column("reproduced", "comes out", of=verdict, left=True),
    ]
    if explanations:
        otherwise = Column("value_by_convention", "otherwise", of=lambda row: _published("value_by_convention", row))
        columns += [otherwise, "convention"]
    notes = [
        "Comes out: ours agrees to half a unit of the last digit printed.",
        *(f"{convention}: {text}" for convention, text in explanations.items()),
        *sorted({f"Source: {row['source']} ({row['status']})." for row in rows}),
    ]
    of_the_globe = {row["definition"]: row["projection"] for row in rows if row["lat"] is None}
    outcomes = Counter(map(verdict, rows))
    told = [f"{outcomes[word]} {words}" for word, words in _VERDICTS.items() if outcomes[word]]
    worst_first = sorted(rows, key=lambda row: list(_VERDICTS).index(verdict(row)), reverse=True)
    return Report(
        answer=[f"Of {len(rows)} figures of {found['source']}, {support.listed(told, 'and')}."],
        brief=[Table(worst_first, columns, keys=2 + len(places))],
        title=found["source"],
        tables=[Table(rows, columns, keys=2 + len(places))],
        notes=notes,
        data=lambda: found,
        maps=Mapped([*of_the_globe], [*of_the_globe.values()], "globe") if of_the_globe else None,
    )


def _published(key: str, row: Any, sign: str = "") -> str:
    """Figure with two decimals more than the published one."""
    return "" if row[key] is None else say.fixed(row[key], row["decimals"] + 2, sign)
