"""The command `design`."""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np

from projdist import plots
from projdist.cli import options as opt
from projdist.cli.errors import refuse, refusing, words_told
from projdist.cli.formats import HTML, JSON, TABLE, present
from projdist.cli.number_format import certain, per_cent, rounded, size_text
from projdist.cli.pictures import PictureFile, PictureOptions, picture_of
from projdist.cli.report import Column, Copy, Mapped, Report, Table
from projdist.designs import CRITERIA_OF_DESIGNS, KINDS, SYMMETRIES, Design, design
from projdist.field import Extreme

_FORMS = (TABLE, JSON, HTML, "proj", "wkt", "wkt-derived", "projjson")
_IN_PPM = 0.01  # Airy-Kavrayskiy errors of maps whose scales are told in parts per million
_DOING = {
    "nodes": "Laying nodes",
    "base": "Choosing a base",
    "fit": "Fitting",
    "measure": "Measuring",
    "recommend": "Looking at existing CRSs",
}


def design_command(
    region: opt.RegionArgument,
    kind: str = opt.option(KINDS, "What the map keeps.", "any"),
    criterion: str = opt.option(
        CRITERIA_OF_DESIGNS, "What to make small; max_... if conformal.", "airy_kavrayskiy", *opt.CRITERION
    ),
    degree: str = opt.option("auto|NUMBER", "Of the polynomials; auto while it pays.", "auto"),
    base: str | None = opt.option("PROJECTION", "The map to correct, else the best."),
    balance: str = opt.option("NUMBER", "Share of areas, 0 to 1: more keeps areas better, less angles.", "0.5"),
    norm: str | None = opt.option("NUMBER", "Of ln k of conformal maps: 2, or more for the worst places."),
    weight: opt.Weight = None,
    background: str = opt.option(
        "auto|NUMBER", "What the surroundings count, 0 to 0.5, so that they do not fold.", "auto"
    ),
    symmetric: str = opt.option(SYMMETRIES, "About what.", "none"),
    north: str | None = opt.option("LON,LAT", "Where north is up, else in the middle."),
    datum: opt.Datum = None,
    against: list[str] | None = opt.option(
        "PROJECTION", "Maps to compare with, else the best existing CRS. May be repeated."
    ),
    name: str | None = opt.option("TEXT", "Of the CRS."),
    format: str | None = opt.file_format(_FORMS, ".json, .wkt, .html or .txt"),
    output: opt.Output = None,
    picture: str | None = opt.option("FILE", "Beside the best existing map: .png, .svg or .pdf."),
    *,
    pictured: PictureOptions,
) -> None:
    """Make the map that distorts a region least, as a CRS that PROJ and GDAL run."""
    path = opt.printed_or_file(output, pictured.overwrite)
    form = opt.format_for(format, path, _FORMS)
    drawn = picture_of(picture, pictured)
    opt.choice("symmetry", symmetric, SYMMETRIES)
    area = opt.region_of(region, weight, [] if base is None else [base])
    with refusing(), words_told(_DOING) as tell:
        found = design(
            area,
            kind=kind,
            criterion=criterion,
            degree="auto" if degree == "auto" else _whole(degree),
            base=base,
            balance=_number("balance", balance),
            norm=None if norm is None else _number("norm", norm),
            background="auto" if background == "auto" else _number("background", background),
            symmetric=symmetric,
            north=None if north is None else _place(north),
            datum=datum,
            against=against or "recommend",
            name=name,
            progress=tell,
        )
    if drawn is not None:
        maps, titles, place, measure, *_ = _mapped(found)
        drawn.save(plots.heatmap_figure, maps, measure=measure, region=place, titles=titles)
    present(_report(found, drawn), form, path, pictured.overwrite)


def _number(thing: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        refuse(f"Invalid {thing} '{text}'. It must be a number.")


def _whole(text: str) -> int:
    if not text.isdecimal():
        refuse(f"Invalid degree '{text}'. It must be auto, or a whole number.")
    return int(text)


def _place(text: str) -> tuple[float, float]:
    lon, comma, lat = text.partition(",")
    if not comma:
        refuse(f"Invalid north '{text}'. It must be LON,LAT in degrees.")
    return _number("north", lon), _number("north", lat)


def _mapped(found: Design) -> Mapped:
    """The design, and the best existing CRS or else its first rival."""
    beside = next((one for one in found.rivals if one.kind == "best existing"), next(iter(found.rivals), None))
    maps = [found.projection] + ([beside.projection] if beside else [])
    titles = ["Made to measure"] + ([beside.name] if beside else [])
    measure = "scale_error_ppm" if found.airy_kavrayskiy < _IN_PPM else "fisher"
    return Mapped(maps, titles, found.region, measure)


def _report(found: Design, picture: PictureFile | None) -> Report:
    return Report(
        title=f"{found.projection.name} ({size_text(found.region)})",
        lead=[*_lead(found)],
        tables=[_rivals(found), _degrees(found)],
        notes=[*_notes(found)],
        data=found.to_dict,
        copies={
            "proj": Copy(found.proj),
            "wkt": Copy(found.wkt),
            "wkt-derived": Copy(found.crs.wkt_derived),
            "projjson": Copy(found.crs.projjson),
        },
        about=found.projection.name,
        written=[picture.path if picture else None],
        maps=_mapped(found),
    )


def _lead(found: Design) -> Iterator[str]:
    """Figures of the design."""
    yield f"Degree {found.degree} on {found.base.definition}"
    yield f"{found.criterion} {certain(found.value, found.error)} {found.unit}".rstrip()
    if found.criterion != "airy_kavrayskiy":
        yield f"airy_kavrayskiy {certain(found.airy_kavrayskiy)}"
    if found.limit is not None:
        maps = "maps" if found.kind == "any" else f"{found.kind} maps"
        yield f"limit {certain(found.limit)}: about what the best of all {maps} has"
    yield f"scales {_extreme(found.smallest)} to {_extreme(found.largest)}"


def _extreme(found: Extreme) -> str:
    """An extreme scale with its certain digits, and its place."""
    return f"{rounded(found.value, found.error)} (at {found.lon:.2f}, {found.lat:.2f})"


def _rivals(found: Design) -> Table:
    """Table of the design and its rivals."""
    made = {"kind": "made to measure", "name": "", "value": found.value, "error": found.error}
    columns: list[Column | str] = [
        Column("kind", "map", left=True),
        Column("name", left=True),
        Column("value", found.criterion, certain, error="error", unit=found.unit),
        Column("gain", "the made map has less by", functools.partial(per_cent, digits=3)),
    ]
    return Table([made, *found.rivals], columns)


def _degrees(found: Design) -> Table:
    """Table of the criterion by degree."""
    columns: list[Column | str] = [
        Column("degree", show="{:d}".format),
        Column("value", f"{found.criterion} at nodes", certain, unit=found.unit),
        Column("share", "share of surroundings", "{:g}".format),
    ]
    return Table(found.degrees, columns)


def _notes(found: Design) -> Iterator[str]:
    if found.overlaps is not None:
        yield "The image of the region covers itself." if found.overlaps else "The image does not cover itself."
    if found.surroundings is not None:
        around = found.surroundings
        yield (
            f"Within {around.within_km:.3g} km of the region scales are {around.smallest_scale:.3g} to "
            f"{around.largest_scale:.3g}."
        )
    if np.isfinite(found.inverse_error):
        yield f"There and back, points of the region miss themselves by at most {found.inverse_error:.0e} m."
    else:
        yield "PROJ does not find the way back from all points of the region: this map has no inverse there."
    yield from found.notes
    yield "To take it elsewhere: --format wkt, wkt-derived, proj or projjson, or -o FILE.wkt."
