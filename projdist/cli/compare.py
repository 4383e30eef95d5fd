"""The command `compare`: maps over a region, or over each of many."""

from __future__ import annotations

import functools
import math
import shlex
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from projdist import answers, field, plots, projections, regions, support
from projdist.cli import options as opt, wording as say
from projdist.cli.batches import SHOWN, RegionalWork, notices_note, regions_given
from projdist.cli.errors import progress_bar, refuse, refusing, tell_problems
from projdist.cli.report import SHARED, Column, Mapped, Report, Row, Table, present

_CONVENTION = (
    "AK: Airy-Kavrayskiy error, the RMS of sqrt(ln^2 a + ln^2 b) by true area. Smaller is better, * is the best.",
    "With a half under the root, as in much of the literature, it is 1/sqrt(2) of that.",
    "Scaled: after the best uniform scale; affine: after the best linear map (MDT).",
)
_AK = "airy_kavrayskiy"
_LEAST_SHARE = 0.005  # of a map's distortion; modes with less are not shown
_LAST_OF_INDICES = 1e-5
_MAP = Column("projection", of=lambda row: say.label_of(row["projection"], row["name"]), left=True)
_COVERAGE = replace(SHARED["coverage"], only=lambda share: share < say.WHOLE)
DISTRIBUTIONS = ("histogram", "cumulative", "pareto")  # of `plots`, which is slow to load
PLOTS = ("maps", *DISTRIBUTIONS, "modes", "space")
_DRAWN = 4  # maps in the suggested picture, and in a heading that names them
_GROUPS = ", ".join(answers.GROUPS)


def compare_command(
    given: opt.Projections,
    region: opt.Region = None,
    regions: opt.Regions = None,
    weight: opt.Weight = None,
    measure: opt.Measures = None,
    indices: list[str] | None = opt.option(
        "NAME",
        f"Published indices of the map: {_GROUPS}, all, or names (see 'projdist list indices'), with commas; may be "
        "repeated.",
    ),
    modes: bool = opt.flag(
        "--modes", "The independent ways in which each map distorts, and their shares of the whole."
    ),
    sort: str = opt.option(
        "COLUMN", "given, name, an airy_kavrayskiy..., INDEX, MEASURE or MEASURE.STATISTIC.", "airy_kavrayskiy"
    ),
    tolerance: str = opt.option(
        "NUMBER", "Largest error of the Airy-Kavrayskiy figures.", f"{field.DEFAULT_TOLERANCE:g}"
    ),
    plot: str | None = opt.option(
        PLOTS,
        "What -o FILE.png, .svg or .pdf shows: maps coloured by a measure (fisher, or the first --measure), as without "
        "--plot; the shares of the area by it, in bins or up to a value; errors of areas against those of angles; the "
        "modes as fields over the maps; or the Jacobians in the hyperbolic plane, with their mean and median.",
    ),
    format: str | None = opt.file_format(),
    output: opt.Output = None,
    executor: opt.Executor = None,
    partial: opt.Partial = None,
    *,
    pictured: opt.GraphOptions,
) -> None:
    """Compare projections over one region or many: Airy-Kavrayskiy errors, measures, published indices."""
    largest = opt.number("tolerance", tolerance, 1e-15, 1.0)  # rounding alone is of the order of 1e-15
    names, chosen = opt.measure_names(measure), opt.names_of(indices)
    options: dict[str, Any] = {"measures": names, "indices": chosen, "tolerance": largest}
    if regions is not None:
        opt.refuse_given({"--plot": plot} | pictured.given(), "It cannot be used with --regions.")
        work = RegionalWork(format, output, overwrite=pictured.overwrite, executor=executor, partial=partial)
        areas = regions_given(regions, {"--region": region, "--weight": weight})
        _compare_regions(given, areas, options, sort, work)
        return
    opt.refuse_given({"--executor": executor, "--partial": partial}, "It needs --regions.")
    picture = None
    if plot is None and opt.is_picture(output):
        plot = "maps"
    if plot is None:
        opt.refuse_given(pictured.given(), f"It needs a picture to draw: --plot {'|'.join(PLOTS)}.")
    else:
        opt.choice("plot", plot, PLOTS)
        if output is None:
            refuse(f"Invalid option '--plot {plot}'. It needs a picture to draw to: -o FILE.png.")
        picture = opt.PictureFile(output, pictured)
    target = opt.target(format, None if picture else output, pictured.overwrite, others=plots.SUFFIXES)
    area = opt.region_of(region, given, weight)
    with refusing(), progress_bar("maps") as progress:
        options |= {"modes": modes or plot == "modes", "sort": sort, "progress": progress}
        found = answers.compare(given, area, **options)
    report = comparison_report(found, names, sort, largest)
    if picture is not None and report.maps:
        maps, first = report.maps.projections, report.maps.measure
        if plot in DISTRIBUTIONS:
            picture.save(plots.distribution_figure, maps, plot, measure=first, region=found.region)
        elif plot == "maps":
            titles = report.maps.titles
            picture.save(plots.heatmap_figure, maps, measure=first, region=found.region, titles=titles)
        else:
            picture.save(plots.modes_figure if plot == "modes" else plots.space_figure, maps, region=found.region)
        report = replace(report, written=[picture])
    present(report, *target)
    tell_problems([failure.error for failure in found.failures])


def comparison_report(found: answers.Comparison, measures: Sequence[str], sort: str, tolerance: float) -> Report:
    """Report of a comparison with these measures, sort key and tolerance."""
    if not found.results:
        return Report(title="No projection could be measured.", data=found.to_dict, header=["projection"])
    first, rows = measures[0] if measures else "fisher", found.plain_rows()
    maps = [one.projection for one in found.results]
    titles = [say.caption(say.label_of(one.given, one.projection.name), one.projection.name) for one in found.results]
    bars = answers.sort_column(sort, measures, [index.name for index in found.published])
    columns = [*_columns(measures, found.published)]
    tables = [Table(rows, columns, bars=bars)]
    wanted = {"projection", _AK, *(f"{name}_{what}" for name in measures for what in ("mean", "max"))}
    first_columns = sorted(columns, key=lambda column: column.key not in wanted)
    modes = [
        {"projection": one.given, "name": one.projection.name, **mode}
        for one in found.results
        for k, mode in enumerate(one.modes.rows if one.modes else ())
        if mode["share"] >= _LEAST_SHARE or k == 0
    ]
    if modes:
        share = Column("share", show=lambda share: f"{100.0 * share:.1f} %")
        of_modes = [_MAP, share, Column("words", "mode", left=True), Column("rms", "RMS", "{:.4f}".format)]
        tables.append(Table(modes, of_modes, "Modes, after the best linear map", keys=3))
    names = [say.spoken(one.given, one.projection.name) for one in found.results]
    heading = support.listed(names, "and") if len(names) <= _DRAWN else f"Distortion of {len(names)} maps"
    drawn = [one.given for one in found.results[:_DRAWN]]
    draw = shlex.join(["projdist", "compare", *drawn, "-r", found.region.name, "-o", "maps.png"])
    elsewhere = maps[0].ellipsoid.is_of_another_body or isinstance(found.region, regions.PointSet)
    advice = f"projdist recommend {shlex.quote(found.region.name)}"
    return Report(
        answer=[*least_distorting(found, bars)],
        brief=[Table(rows, first_columns, bars=bars), *tables[1:]],
        next={draw: "To see where they distort"} | ({} if elsewhere else {advice: "For the best CRS"}),
        title=f"{found.region.name} ({say.size_text(found.region)}), by {sort}",
        heading=f"{heading} over {say.region_words(found.region)}",
        tables=tables,
        notes=[*_notes(found, rows, measures, tolerance)],
        data=found.to_dict,
        maps=Mapped(maps, titles, found.region, first),
    )


def least_distorting(found: answers.Comparison, column: str = "") -> Iterator[str]:
    """Sentences: the map that distorts least, how much more the others do, and the first by another column."""
    best = min(found.results, key=lambda one: one.airy_kavrayskiy)
    place, others = say.region_words(found.region), [one for one in found.results if one is not best]
    names = {id(one): say.spoken(one.given, one.projection.name) for one in found.results}
    error = f"scales are off by {say.rms_text(best.airy_kavrayskiy)} (RMS)"
    if not others:
        yield f"On {names[id(best)]}, {error} over {place}."
    else:
        far = max(others, key=lambda one: one.airy_kavrayskiy)
        told = [min(others, key=lambda one: one.airy_kavrayskiy), *([far] if len(others) > 1 else [])]
        more = [
            f"on {names[id(one)]} by {say.rms_text(one.airy_kavrayskiy)} "
            f"({say.times_text(one.airy_kavrayskiy / best.airy_kavrayskiy)})"
            for one in told
        ]
        yield f"{names[id(best)]} distorts {place} least: {error}; {support.listed(more, 'and')}."
    first = found.results[0]
    if column not in (*answers.SORTS, "") and first is not best:
        yield f"By {column} the first is {names[id(first)]}."
    for one in found.results:
        if one.coverage < say.WHOLE:
            yield f"{names[id(one)]} shows only {say.per_cent(one.coverage)} of it."


def _columns(measures: Sequence[str], indices: Sequence[answers.Index]) -> Iterator[Column]:
    yield _MAP
    for version in ("", " scaled", " affine"):
        key = f"airy_kavrayskiy{version.replace(' ', '_')}"
        yield Column(key, f"AK{version}", say.rounded, error="error_estimate", best=True)
    yield Column("error_estimate", "error", "{:.0e}".format)
    for name in dict.fromkeys(measures):
        for statistic in answers.STATISTICS:
            yield Column(f"{name}_{statistic}", f"{name} {statistic}", say.certain, error=f"{name}_{statistic}_error")
    for index in indices:
        yield Column(index.name, index.symbol, _rounded_index, error=f"{index.name}_error")
        if index.best_scale is not None:
            yield Column(f"{index.name}_best", f"{index.symbol} best", _rounded_index, error=f"{index.name}_best_error")
    yield _COVERAGE


def _notes(found: answers.Comparison, rows: Sequence[Row], measures: Sequence[str], tolerance: float) -> Iterator[str]:
    """Notes on the columns, and on missing or less certain figures."""
    indices, weighed = found.published, isinstance(found.region, regions.PointSet)
    yield from (text.replace("by true area", "by the points' weights") if weighed else text for text in _CONVENTION)
    if any(one.modes is not None for one in found.results):
        yield "Modes: parts of the distortion independent of each other; their squares add to that of AK affine."
        yield "Horizontal, vertical: on the map; shape: wide and low, or narrow and high; shear: that at 45 degrees."
    if any(index.best_scale is not None for index in indices):
        yield "Best: an index at the scale that makes it best."
    if indices:
        yield "In brackets: the error, of the last digit; without them it is below 0.00001."
    if any(row[index.name] is None for row in rows for index in indices):
        yield "-: the index diverges, has no bound, or is not defined for the region."
    symbols: dict[str, list[str]] = {}
    for index in indices:
        if index.published_over:
            symbols.setdefault(index.published_over, []).append(index.symbol)
    for part, names in symbols.items():
        over = f"over {part} only, and these here are for the whole region."
        yield f"{', '.join(names)}: most published figures come out {over}"
    if any(row["coverage"] < say.WHOLE for row in rows):
        yield "Covers: the share of the region that can be projected; the figures are for that share."
    if any(row[f"{name}_{statistic}"] is None for row in rows for name in measures for statistic in answers.STATISTICS):
        yield "-: the integral diverges, or the measure has no bound."
    if any((row["error_estimate"] or 0.0) > 2.0 * tolerance for row in rows):
        yield "Error: above the tolerance where the projection's own rounding or the work allowed set the limit."


def _rounded_index(value: float, error: float | None) -> str:
    """Index with at most five decimals (published ones have two to four); a larger error in brackets."""
    if error is None or not error > _LAST_OF_INDICES:
        return say.rounded(value, _LAST_OF_INDICES)
    decimals = max(0, math.ceil(-math.log10(error)))
    return f"{value:.{decimals}f}({math.ceil(error * 10**decimals)})"


# ---- many regions --------------------------------------------------------------------------------


_NO_FIGURE = ("given", "name")  # sort keys that rank no map as the best


def _compare_regions(
    given: Sequence[str], areas: Sequence[answers.Area], options: Mapping[str, Any], sort: str, work: RegionalWork
) -> None:
    """Compare maps over each region, and report the best."""
    with refusing():
        indices = answers.get_indices(options["indices"])
        column = answers.sort_column(sort, options["measures"], [index.name for index in indices])
    maps, problems = [], []
    for text in dict.fromkeys(given):
        try:
            projections.Projection.from_user_input(text)
            maps.append(text)
        except projections.ProjectionError as error:
            problems.append(str(error))
    if not maps:
        tell_problems(problems)
    found = work.run(answers.summarize, areas, maps, options)
    results: dict[str, list[answers.BatchResult]] = {}
    for one in found.results:
        results.setdefault(one.region, []).append(one)

    def rank(row: Row, column: str) -> tuple[bool, Any]:
        """Sort key of a row of a region, the best first."""
        return answers.sort_order(math.nan if row[column] is None else row[column])

    if column != "given":
        for group in results.values():
            group.sort(key=lambda one: rank(one.rows[0], column))
    groups = {
        name: [{"region": name, "area_km2": one.area_km2, **one.rows[0]} for one in group]
        for name, group in results.items()
    }
    figure = _AK if column in _NO_FIGURE else column
    best = {name: min(group, key=lambda row: rank(row, figure)) for name, group in groups.items()}

    def comparison(name: str) -> dict[str, Any]:
        """The maps of a region, with failures and notices."""
        measured = results[name]
        failed = [one for one in found.failures if one.region == name]
        return {
            "region": {"name": name, "area_km2": measured[0].area_km2},
            "results": [one.answer for one in measured],
            "failures": [{"projection": one.projection, "error": one.error} for one in failed],
            "notices": [*dict.fromkeys(word for one in measured for word in one.notices)],
        }

    over = {index.name: index.published_over for index in indices if index.published_over}
    note = "* is the best of a region. JSON and CSV have all figures of every map over every region."
    firsts = [row["projection"] for row in best.values()]
    leader, *others = sorted((one for one in maps if one in firsts), key=firsts.count, reverse=True) or [""]
    counts = [f"{leader} is the best in {firsts.count(leader)}", *(f"{one} in {firsts.count(one)}" for one in others)]
    several = f"Of {len(groups)} regions {support.listed(counts, 'and')}"
    said = several if len(groups) > 1 else f"{leader} is the best over {next(iter(groups), '')}"
    report = Report(
        answer=[f"{said}, by {figure}."] if groups else [],
        title=f"{len(groups)} regions, {len(maps)} maps, {figure}" if groups else "No region could be measured.",
        tables=[*_regional_tables(groups, best, maps, figure)] if groups else [],
        notes=[note, *notices_note(found)] if groups else [],
        data=lambda: {
            "regions": [*map(comparison, groups)],
            "failures": [one.to_dict() for one in found.failures],
            **({"published_over": over} if indices else {}),
        },
        rows=lambda: [row for group in groups.values() for row in group],
        header=["region"],
    )
    work.leave(report, found, [*best.values()], problems)


def _regional_tables(
    groups: Mapping[str, Sequence[Row]], best: Mapping[str, Row], maps: Sequence[str], figure: str
) -> Iterator[Table]:
    """One row per region, with its best map and the figure of each; one row per map, with its figures over all."""
    show, error = (say.rounded, "error_estimate") if figure.startswith(_AK) else (say.certain, f"{figure}_error")

    def cell(one: str, row: Row) -> str:
        if row.get(one) is None:
            return "-"
        mark = "*" if best[row["region"]]["projection"] == one else " "
        return show(row[one], row["maps"][one].get(error)) + mark

    regions = [
        {
            "region": name,
            "best": say.label_of(best[name]["projection"], best[name]["name"]),
            "coverage": min(row["coverage"] for row in group),
            "maps": {row["projection"]: row for row in group},
        }
        | {row["projection"]: row[figure] for row in group}
        for name, group in groups.items()
    ]
    names = {row["projection"]: row["name"] for group in groups.values() for row in group}
    of_maps = [Column(one, say.label_of(one, names.get(one, one)), of=functools.partial(cell, one)) for one in maps]
    yield Table(regions, ["region", Column("best", left=True), *of_maps, _COVERAGE], most=SHOWN)
    totals: list[dict[str, Any]] = []
    for one in maps:
        of_it = [row for group in groups.values() for row in group if row["projection"] == one]
        known = {row["region"]: row[figure] for row in of_it if row[figure] is not None}
        totals.append({"projection": one, "best": sum(row["projection"] == one for row in best.values())})
        if known:
            worst = max(known, key=known.__getitem__)
            totals[-1] |= {"median": statistics.median(known.values()), "largest": known[worst], "where": worst}
    columns = [Column("best", "best in"), Column("median", show=say.certain), Column("largest", show=say.certain)]
    yield Table(totals, ["projection", *columns, "where"], f"{figure} over all regions")
