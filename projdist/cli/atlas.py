"""The command `atlas`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from projdist import gis
from projdist.cli import options as opt
from projdist.cli.errors import refuse, refusing
from projdist.cli.formats import TABLE, drawing, present, tell_written
from projdist.cli.number_format import area_text, certain
from projdist.cli.report import Column, Report, Row, Table
from projdist.designs import AtlasEntry, AtlasZones, atlas, atlas_names


def atlas_command(
    place: str | None = opt.argument(
        "PLACE", "A country, state, continent, ocean or UTM zone: NZ, state:CA, Europe.", None
    ),
    format: str | None = opt.report_format(),
    export: str | None = opt.option(
        "FILE",
        "Write the data instead of printing, of the place or of all: .csv or .parquet (a row for each map of each "
        "purpose) or .gpkg (the outline of each place).",
    ),
    overwrite: opt.Overwrite = False,
) -> None:
    """Show the best maps of a place, measured beforehand; without a place, list the places."""
    form = TABLE if format is None else opt.format_of(format)
    if export is not None and format is not None:
        refuse(f"Invalid format '{format}' for '{export}'. Its suffix tells the format.")
    with refusing():
        entries = [atlas(name) for name in (atlas_names() if place is None else [place])]
    if export is not None:
        _write(entries, export, overwrite)
        return
    present(_overview(entries) if place is None else _report(entries[0]), form)


def _write(entries: Sequence[AtlasEntry], export: str, overwrite: bool) -> None:
    path = opt.file_of_kind(export, gis.ATLAS_SUFFIXES, overwrite)
    with drawing(path):
        gis.save_atlas(entries, path, overwrite=overwrite)
    tell_written(path)


# ---- one place ------------------------------------------------------------------------------


def _report(entry: AtlasEntry) -> Report:
    rows = entry.rows()
    return Report(
        title=f"{entry.title} ({area_text(entry.area_km2)})",
        tables=[Table(rows, [*_columns(rows)], keys=2)],
        notes=[*_notes(entry)],
        data=entry.to_dict,
        rows=lambda: rows,
    )


def _map(row: Row) -> str:
    """Code of the map, or name of its family in place of a long PROJ string."""
    return str(row["name"] if row["projection"].startswith("+") else row["projection"])


def _saved(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def _columns(rows: Sequence[Row]) -> Iterator[Column | str]:
    yield Column("purpose", show=lambda name: name or "-")
    yield "what"
    yield Column("projection", "map", of=_map, left=True)
    yield Column("airy_kavrayskiy", show=certain)
    yield "over_limit"
    yield Column("saves", show=_saved)
    yield "max_scale_error_ppm"
    yield "mean_scale_error_ppm"
    yield Column("max_omega", "omega max", "{:.4f}".format)
    yield "cut_km"
    yield "keeps"


def _notes(entry: AtlasEntry) -> Iterator[str]:
    official = entry.official
    if official is None:
        if entry.country:
            yield f"Official: no CRS of {entry.country}'s own is made for the place and holds nine tenths of it."
    else:
        own = f"the best of {entry.country}'s own for general use, on its datum in force"
        yield f"Official: {own}: {official.projection}, {official.name}."
    yield f"{_names(entry)}."
    yield from (_of_zones(system) for system in entry.zones)
    yield from _reasons(entry)
    against = "the official CRS" if official else "the best existing CRS"
    yield (
        f"Saves: the share of the error of {against} that a map saves; below 0 it costs. Of the purpose least scale "
        "error it is of the largest scale error."
    )
    yield "Over limit: the Airy-Kavrayskiy error over about what the best of all maps of the purpose in one piece has."
    if any(row["cut_km"] for row in entry.rows()):
        yield "Cuts: their length within the place, kilometres; a map that is cut may be below the limit."
    versions = entry.versions
    yield f"Measured with projdist {versions['projdist']} and {versions['PROJ']}; --format json has PROJ strings."


def _of_zones(system: AtlasZones) -> str:
    whose = "national zones" if system.national else "zones of the world"
    worst = certain(system.max_scale_error_ppm)
    return f"Zones: {system.name}, {system.zones} {whose}, each in its part at most {worst} ppm."


def _reasons(entry: AtlasEntry) -> Iterator[str]:
    """Reasons why no map was made to measure, each once."""
    reasons = dict.fromkeys(purpose.reason for purpose in entry.purposes.values() if purpose.reason)
    yield from (f"No map made to measure: {reason}" for reason in reasons)


def _names(entry: AtlasEntry) -> str:
    """Codes of the table's CRSs with their names."""
    existing = [one.existing for one in entry.purposes.values() if one.existing is not None]
    names = {one.projection: one.name for one in existing}
    return "; ".join(f"{code}: {name}" for code, name in names.items())


# ---- all places -----------------------------------------------------------------------------


def _overview(entries: Sequence[AtlasEntry]) -> Report:
    rows = [entry.summary() for entry in entries]
    return Report(
        title=f"The atlas: {len(entries)} places",
        tables=[Table(rows, _OF_ALL)],
        notes=[
            "Errors are Airy-Kavrayskiy's. Existing: the best CRS of the registries; custom: the best of PROJ's "
            "families; made: to measure. Saves: against the official CRS, else the best existing one."
        ],
        data=lambda: {"entries": [entry.to_dict() for entry in entries]},
        rows=lambda: rows,
    )


_OF_ALL: list[Column | str] = [
    "place",
    "kind",
    Column("official", left=True),
    Column("official_error", "error", certain),
    Column("existing", "best existing", left=True),
    Column("existing_saves", "saves", _saved),
    Column("custom_saves", "custom saves", _saved),
    Column("made_saves", "made saves", _saved),
    Column("official_over_limit", "official over limit", "x {:.3g}".format),
]
