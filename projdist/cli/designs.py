"""The commands that make maps to measure: `design`, `mean-map` and `world-map`."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import Any

import numpy as np

from projdist import designs, plots, support
from projdist.cli import options as opt, wording as say
from projdist.cli.errors import progress_bar, refuse, refusing, working
from projdist.cli.report import HTML, JSON, TABLE, Column, Copy, Mapped, Report, Table, drawing, present

_DESIGN_FORMS = (TABLE, JSON, HTML, "proj", "wkt", "wkt-derived", "projjson")
_MEAN_FORMS = (TABLE, JSON, "proj", "wkt", "wkt-derived", "projjson")
_WORLD_FORMS = (TABLE, JSON)
_IN_PPM = 0.01  # Airy-Kavrayskiy error below which scales are shown in parts per million
_GOOD = 1e-4  # error with which the errors of world maps over the globe are measured
_DOING = {
    "nodes": "Laying nodes",
    "base": "Choosing a base",
    "fit": "Fitting",
    "measure": "Measuring",
    "recommend": "Looking at existing CRSs",
}
_ELSEWHERE = "To take it elsewhere: --format wkt, wkt-derived, proj or projjson, or -o FILE.wkt."


def _whole(thing: str, text: str, allowed: str) -> int:
    if not text.removeprefix("-").isdecimal():  # the library says what range is allowed
        refuse(f"Invalid {thing} '{text}'. It must be {allowed}.")
    return int(text)


def _number(thing: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        refuse(f"Invalid {thing} '{text}'. It must be a number.")


def design_command(
    region: opt.RegionArgument,
    kind: str = opt.option(designs.KINDS, "What the map keeps.", "any"),
    criterion: str = opt.option(
        designs.CRITERIA_OF_DESIGNS, "What to minimise; max_... if conformal.", "airy_kavrayskiy", *opt.CRITERION
    ),
    degree: str = opt.option("auto|NUMBER", "Degree of the polynomials; auto: as long as it pays.", "auto"),
    poles: str = opt.option("auto|NUMBER", "Poles around the region, for max_...: less error, slower maps.", "0"),
    base: str | None = opt.option("PROJECTION", "The map to correct; by default the best."),
    balance: str = opt.option("NUMBER", "Weight of areas, 0 to 1: more keeps areas better, less keeps angles.", "0.5"),
    norm: str | None = opt.option("NUMBER", "Norm of ln k for conformal maps: 2, or more to spare the worst places."),
    weight: opt.Weight = None,
    background: str = opt.option(
        "auto|NUMBER", "Weight of the surroundings, 0 to 0.5, so that they do not fold.", "auto"
    ),
    symmetric: str = opt.option(designs.SYMMETRIES, "Axes of symmetry.", "none"),
    north: str | None = opt.option("LON,LAT", "Where north is up; by default the middle."),
    datum: opt.Datum = None,
    against: list[str] | None = opt.option(
        "PROJECTION", "A map to compare with, by default the best existing CRS; may be repeated."
    ),
    name: str | None = opt.option("TEXT", "The name of the CRS."),
    format: str | None = opt.file_format(_DESIGN_FORMS, ".json, .wkt, .html or .txt"),
    output: opt.Output = None,
    picture: str | None = opt.option("FILE", "Draw it beside the best existing map: .png, .svg or .pdf; -o is enough."),
    *,
    pictured: opt.PictureOptions,
) -> None:
    """Make the map that distorts a region least, as a CRS for PROJ and GDAL."""
    target, drawn = opt.text_and_picture(format, output, picture, pictured, _DESIGN_FORMS)
    opt.choice("symmetry", symmetric, designs.SYMMETRIES)
    area = opt.region_of(region, [] if base is None else [base], weight)
    up = None
    if north is not None:
        lon, comma, lat = north.partition(",")
        if not comma:
            refuse(f"Invalid north '{north}'. It must be LON,LAT in degrees.")
        up = _number("north", lon), _number("north", lat)
    with refusing(), working(_DOING["nodes"]) as show:
        found = designs.design(
            area,
            kind=kind,
            criterion=criterion,
            degree="auto" if degree == "auto" else _whole("degree", degree, "auto, or a whole number"),
            poles="auto" if poles == "auto" else _whole("poles", poles, "auto, or a whole number"),
            base=base,
            balance=_number("balance", balance),
            norm=None if norm is None else _number("norm", norm),
            background="auto" if background == "auto" else _number("background", background),
            symmetric=symmetric,
            north=up,
            datum=datum,
            against=against or "recommend",
            name=name,
            progress=lambda doing: show(_DOING[doing]),
        )
    # Beside the design is the best existing CRS, or else its first rival.
    existing = (one for one in found.rivals if one.kind == "best existing")
    beside = [*existing, *found.rivals][:1]
    titles = ["Made to measure", *(one.name for one in beside)]
    measure = "scale_error_ppm" if found.airy_kavrayskiy < _IN_PPM else "fisher"
    mapped = Mapped([found.projection, *(one.projection for one in beside)], titles, found.region, measure)
    if drawn is not None:
        drawn.save(plots.heatmap_figure, mapped.projections, measure=measure, region=found.region, titles=titles)
    report = Report(
        answer=[*_design_answer(found)],
        next={"-o map.wkt": "To keep it as a CRS, the same command with", **_picture(drawn)},
        title=f"{found.projection.name} ({say.size_text(found.region)})",
        lead=[*_design_lead(found)],
        tables=_design_tables(found),
        notes=[*_design_notes(found)],
        data=found.to_dict,
        copies=_copies(found.crs),
        about=found.projection.name,
        written=[drawn],
        maps=mapped,
    )
    present(report, *target)


def _copies(crs: Any) -> dict[str, Copy]:
    """The forms of a CRS, or the reason why the map has none."""
    missing = "A map of the world, or after a function, is not a CRS; JSON has its coefficients."
    forms = {"proj": "pipeline", "wkt": "wkt", "wkt-derived": "wkt_derived", "projjson": "projjson"}
    return {form: Copy(getattr(crs, key) if crs else None, missing) for form, key in forms.items()}


def _picture(drawn: opt.PictureFile | None) -> dict[str, str]:
    """How to draw the map, if it was not drawn."""
    return {} if drawn else {"-o map.png": "To draw it, the same command with"}


def _design_answer(found: designs.Design) -> Iterator[str]:
    """Sentences: the error of the new map, by how much it is below its rivals', and its proven bound."""
    place, worst = say.region_words(found.region), max(found.largest.value - 1.0, 1.0 - found.smallest.value)
    less = [f"{say.per_cent(one.gain, 2)} less than on {one.name}" for one in found.rivals if one.gain > 0.0]
    if found.criterion == "airy_kavrayskiy":
        error = f"scales are off by {say.rms_text(found.value)} (RMS)"
    else:
        error = f"{found.criterion} is {say.certain(found.value, found.error)} {found.unit}".rstrip()
    yield f"On a map made for {place}, {error}{', ' if less else ''}{support.listed(less, 'and')}."
    distances = say.distance_error(worst)
    yield f"Distances are {'' if distances == say.TRUE else 'off by at most '}{distances}."
    if found.proven:
        digit = 10.0 ** (np.floor(np.log10(found.proven)) - 3.0)  # the last of four
        least = say.certain(float(digit * np.floor(found.proven / digit)), float(digit))
        yield f"It is proven that no conformal map has less than {least} {found.unit}".rstrip() + "."


def _design_lead(found: designs.Design) -> Iterator[str]:
    """Figures of the design."""
    yield f"Degree {found.degree}{f', {found.poles} poles' if found.poles else ''} on {found.base.definition}"
    yield f"{found.criterion} {say.certain(found.value, found.error)} {found.unit}".rstrip()
    if found.criterion != "airy_kavrayskiy":
        yield f"airy_kavrayskiy {say.certain(found.airy_kavrayskiy)}"
    if found.limit is not None:
        best = "map" if found.kind == "any" else f"{found.kind} map"
        yield f"limit {say.certain(found.limit)}: about what the best possible {best} has"
    ends = ((say.rounded(one.value, one.error), one.lon, one.lat) for one in (found.smallest, found.largest))
    yield f"scales {' to '.join(f'{scale} (at {lon:.2f}, {lat:.2f})' for scale, lon, lat in ends)}"


def _design_tables(found: designs.Design) -> list[Table]:
    """The design and its rivals, and the criterion by degree."""
    made = {"kind": "made to measure", "name": "", "value": found.value, "error": found.error}
    value = Column("value", f"{found.criterion} {found.unit}".rstrip(), say.certain, error="error")
    gain = Column("gain", "less on the made map", functools.partial(say.per_cent, digits=3))
    at_nodes = Column("value", f"{found.criterion} at nodes {found.unit}".rstrip(), say.certain)
    share = Column("share", "share of surroundings", "{:g}".format)
    return [
        Table([made, *found.rivals], [Column("kind", "map", left=True), "name", value, gain]),
        Table(found.degrees, ["degree", at_nodes, share]),
    ]


def _design_notes(found: designs.Design) -> Iterator[str]:
    if found.overlaps is not None:
        yield "The image of the region covers itself." if found.overlaps else "The image does not cover itself."
    around = found.surroundings
    if around is not None:
        scales = f"{around.smallest_scale:.3g} to {around.largest_scale:.3g}"
        yield f"Within {around.within_km:.3g} km of the region, scales are {scales}."
    if np.isfinite(found.inverse_error):
        yield f"Transformed there and back, points of the region are off by at most {found.inverse_error:.0e} m."
    else:
        yield "PROJ cannot transform all points of the region back: this map has no inverse there."
    yield from found.notes
    yield _ELSEWHERE


def mean_map_command(
    projections: opt.Projections,
    region: opt.Region = None,
    weights: str | None = opt.option("NUMBERS", "Weights of the maps, such as 1,2; by default equal."),
    degree: str | None = opt.option(
        "NUMBER", "Degree of the polynomials, at most 12; 8 if not given, 9 for maps of the world."
    ),
    datum: opt.Datum = None,
    name: str | None = opt.option("TEXT", "The name of the map."),
    format: str | None = opt.file_format(_MEAN_FORMS, ".json, .wkt or .txt"),
    output: opt.Output = None,
    picture: str | None = opt.option("FILE", "Draw the mean beside the average: .png, .svg or .pdf; -o is enough."),
    *,
    pictured: opt.PictureOptions,
) -> None:
    """Find the mean of several maps: the map nearest to all of them in distortion."""
    target, drawn = opt.text_and_picture(format, output, picture, pictured, _MEAN_FORMS)
    area = opt.region_of(region, projections)
    counts = None if weights is None else opt.numbers(weights)
    if counts == []:
        refuse(f"Invalid weights '{weights}'. They must be numbers with commas, such as 1,2.")
    with refusing(), progress_bar("maps measured") as progress:
        found = designs.mean_map(
            projections,
            weights=counts,
            region=area,
            degree=None if degree is None else _whole("degree", degree, "a whole number"),
            datum=datum,
            name=name,
            progress=progress,
        )
    if drawn is not None:
        maps, titles = [found.projection, found.average], ["Mean", "Average of coordinates"]
        drawn.save(plots.heatmap_figure, maps, region=found.region, titles=titles)
    on = "in longitude and in latitude" if found.base is None else f"on {found.base.definition}"
    lead = [f"Degree {found.degree} {on}"]
    if len(set(found.weights)) > 1:
        lead.append(f"Weights {', '.join(f'{one:g}' for one in found.weights)}")
    total = Column("total", "sum of squared distances", functools.partial(say.certain, error=found.error))
    scaled = Column("airy_kavrayskiy", "airy_kavrayskiy_scaled", say.certain, error="error")
    report = Report(
        answer=[*_mean_answer(found)],
        next=_picture(drawn),
        title=f"{found.projection.name} over {found.region.name} ({say.size_text(found.region)})",
        lead=lead,
        tables=[Table(found.standings, [Column("kind", "map", left=True), "name", total, scaled])],
        notes=[
            "The distance of two maps is the Fisher distortion from the plane of the one to that of the other at the "
            "same point of the ground.",
            "The bound is that of the metrics' means at each point, which no map need have.",
            *found.notes,
            *([_ELSEWHERE] if found.crs is not None else []),
        ],
        data=found.to_dict,
        copies=_copies(found.crs),
        about=found.projection.name,
        written=[drawn],
    )
    present(report, *target)


def _mean_answer(found: designs.MeanMap) -> Iterator[str]:
    """Sentences: how near the mean is to the maps, compared with the bound and the average."""
    least, mean, average, *_ = found.standings
    place = say.region_words(found.region)
    maps = f"{len(found.maps)} map{'s' * (len(found.maps) > 1)}"
    total, bound, plain = (say.certain(one.total) for one in (mean, least, average))
    yield (
        f"The mean of {maps} over {place} is nearest to them: its squared distances from them add up to {total}, "
        f"those of the average of their coordinates to {plain}, and no map has less than {bound}."
    )
    yield f"On it, scales are off by {say.rms_text(mean.airy_kavrayskiy)} (RMS)."


# ---- world map -----------------------------------------------------------------------------------


def world_map_command(
    region: str | None = opt.argument("[REGION]", "What to show well, like --region of compare; by default all.", None),
    cut: str = opt.option(
        "LON|POINTS",
        "A meridian, or points such as '-170,40 -70,-62': from the first through the others to its antipode.",
        "180",
    ),
    weight: opt.Weight = None,
    elsewhere: str = opt.option("NUMBER", "The weight of everything outside the region, 1e-4 to 1.", "0.02"),
    until: str = opt.option("LAT", "The latitude where the map ends, north and south.", "90"),
    symmetric: str = opt.option(designs.WORLD_SYMMETRIES, "Axes of symmetry.", "auto"),
    exponent: str | None = opt.option("NUMBER", "Exponent of the energy, 0 (Airy-Kavrayskiy) to 1; 1/8 if not given."),
    cells: str | None = opt.option("NUMBER", "Cells of the mesh, each way, 8 to 128; by default 32, for a region 64."),
    against: list[str] | None = opt.option("PROJECTION", "A map to compare with; may be repeated."),
    format: str | None = opt.file_format(_WORLD_FORMS, ".json or .txt"),
    output: opt.Output = None,
    tinshift: str | None = opt.option("FILE", "Write triangles for PROJ's tinshift: .json."),
    step: str = opt.option("DEGREES", "Spacing of the triangles' corners.", "2"),
    picture: str | None = opt.option("FILE", "Draw the Fisher distortion: .png, .svg or .pdf; -o is enough."),
    *,
    pictured: opt.PictureOptions,
) -> None:
    """Make the map of the world that distorts a region least."""
    target, drawn = opt.text_and_picture(format, output, picture, pictured, _WORLD_FORMS)
    triangles = None
    if tinshift is not None:
        triangles = opt.file_of_kind(tinshift, (".json",), pictured.overwrite, "file of triangles")
    corners = opt.number("step", step, 0.2, 30.0, " of degrees")
    if weight is not None and region is None:
        refuse(f"Invalid weight '{weight}' without a region. Name one, such as globe.")
    options: dict[str, Any] = {
        "cut": _cut(cut),
        "elsewhere": opt.number("weight elsewhere", elsewhere, 1e-4, 1.0),
        "until": opt.number("end", until, 10.0, 90.0, " of degrees"),
        "symmetric": opt.choice("symmetry", symmetric, designs.WORLD_SYMMETRIES),
        "against": against or designs.AGAINST,
        "cells": None if cells is None else _whole("number of cells", cells, "even, within 8 and 128"),
    }
    if exponent is not None:
        options["exponent"] = opt.number("exponent", exponent, 0.0, 1.0)
    area = None if region is None else opt.region_of(region, weight=weight)
    with refusing(), progress_bar("cells") as progress:
        found = designs.world_map(area, **options, progress=progress)
    pipeline = None
    if triangles is not None:
        with drawing(triangles):
            pipeline = found.write_tinshift(triangles, step=corners, overwrite=pictured.overwrite)
    if drawn is not None:
        titles, figures = ["Made to measure"], [found.airy_kavrayskiy]
        drawn.save(plots.heatmap_figure, found.projection, titles=titles, airy_kavrayskiy=figures)
    columns = [Column("name", "map", left=True), Column("airy_kavrayskiy", "AK", say.certain, error="error_estimate")]
    if found.region.name != "globe" and found.until == 90.0:
        columns.append(Column("over_globe", "over the globe", functools.partial(say.certain, error=_GOOD)))
    size, energy = Column("cells", show="{0:d} x {0:d}".format), Column("energy", show="{:.6f}".format)
    at_nodes = Column("airy_kavrayskiy", "AK at nodes", "{:.6f}".format)
    best = "Airy-Kavrayskiy errors of other maps are at their best scales."
    lead = [f"airy_kavrayskiy {say.certain(found.airy_kavrayskiy, found.error_estimate)}"]
    lead += [] if found.symmetric == "none" else [f"Symmetric about: {found.symmetric}"]
    lead += say.covers(found.coverage)
    if found.mirrored:
        lead.append(f"It turns over {say.per_cent(found.mirrored)} of the region: take more cells.")
    least, name = min(((one.airy_kavrayskiy, one.name) for one in found.standings), default=(0.0, ""))
    ratio = least / found.airy_kavrayskiy
    less = f", {say.less_text(ratio)} than on {name}" if ratio > 1.0 else ""
    report = Report(
        answer=[
            f"On a map made for {say.region_words(found.region)}, scales are off by "
            f"{say.rms_text(found.airy_kavrayskiy)} (RMS){less}.",
            *([pipeline] if pipeline else []),
        ],
        next=_picture(drawn),
        title=f"{found.projection.name} ({say.size_text(found.region)})",
        lead=lead,
        tables=[
            Table(found._table(), columns),
            Table(found.refinements, [size, "unknowns", energy, at_nodes, "steps"]),
        ],
        notes=[best, f"PROJ: {pipeline}"] if pipeline else [best],
        data=lambda: found.to_dict() | {"pipeline": pipeline},
        written=[triangles, drawn],
    )
    present(report, *target)


def _cut(text: str) -> float | list[list[float]]:
    """Cut of the map: a longitude, or a list of points."""
    values = [opt.numbers(word) for word in text.split()]
    if len(values) == 1 and len(values[0]) == 1:
        return values[0][0]
    if len(values) < 2 or any(len(point) != 2 for point in values):
        refuse(f"Invalid cut '{text}'. It must be a longitude, or two or more points such as '-170,40 -70,-62'.")
    return values
