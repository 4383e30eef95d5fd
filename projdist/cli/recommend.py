"""The command `recommend`: the best CRSs for a region, or for each of many."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

import typer

from projdist import plots
from projdist.answers import Batch
from projdist.cli import options as opt
from projdist.cli.batches import RegionalWork, executor_opened, notices_note, regions_given
from projdist.cli.errors import progress_bar, refuse, refusing
from projdist.cli.formats import present
from projdist.cli.number_format import certain, change, per_cent, rounded, size_text
from projdist.cli.pictures import PictureFile, PictureOptions, picture_of
from projdist.cli.report import Column, Mapped, Report, Row, Table
from projdist.decisions import (
    CLOSE,
    ENGINEERING_PPM,
    INTERRUPTED,
    PURPOSES,
    WIDE_FACTOR,
    Candidate,
    Recommendation,
    ZoneSystem,
    get_purpose,
    recommend,
)
from projdist.field import get_figure
from projdist.projections import OF_A_SPHERE, check_authorities


def recommend_regions(
    regions: Sequence[str],
    others: Mapping[str, object],
    options: Mapping[str, Any],
    work: RegionalWork,
) -> None:
    """Find the best CRSs of each region."""
    with refusing():
        get_purpose(options["purpose"])
        get_figure(options["criterion"])
        check_authorities(options["authorities"])
    areas = regions_given(regions, others)
    found = work.run(recommend, areas, None, options)
    best = [_best(one.region, one.area_km2, one.rows) for one in found.results if one.answer["results"]]
    unserved = [
        f"{one.region}: No CRS serves it with these options." for one in found.results if not one.answer["results"]
    ]
    work.leave(_regions_report(found, best, options), found, best, {area.name: area for area in areas}, unserved)


def _best(region: str, area_km2: float, rows: Sequence[Row]) -> Row:
    return {"region": region, "area_km2": area_km2, **rows[0]}


def _regions_report(found: Batch, best: Sequence[Row], options: Mapping[str, Any]) -> Report:
    criterion = options["criterion"]
    return Report(
        title=f"{len(best)} regions, {options['purpose']}, by {criterion}" if best else "No region is served.",
        tables=[Table(best, [*_region_columns(criterion)])] if best else [],
        notes=[
            "The best CRS of each region; JSON and CSV have the others, too.",
            "ppm: |scale - 1| in parts per million; omega: angular deformation in degrees; in area: the share of the "
            "region in the CRS's area of use.",
            *notices_note(found),
        ]
        if best
        else [],
        data=lambda: {
            "regions": [
                {**one.answer, "region": {"name": one.region, "area_km2": one.area_km2}, "notices": list(one.notices)}
                for one in found.results
            ],
            "failures": [one.to_dict() for one in found.failures],
        },
        rows=lambda: [_best(one.region, one.area_km2, [row]) for one in found.results for row in one.rows],
        header=["region"],
    )


def _region_columns(criterion: str) -> Iterator[Column | str]:
    yield "region"
    yield "code"
    yield "name"
    yield Column("value", criterion, certain, error=f"{criterion}_error")
    yield "max_scale_error_ppm"
    yield Column("max_omega", "omega max", certain, error="max_omega_error")
    yield "keeps"
    yield "coverage"
    yield "share_in_area_of_use"


# ---- recommend -----------------------------------------------------------------------------------


_DRAWN = 4  # maps in the picture
_KINDS = ("conformal", "equal-area")  # purposes that have a limit of their own
_ROUNDING = 1e-6  # of an angle, degrees

RegionArgument = Annotated[
    str | None, typer.Argument(metavar="REGION", help="As --region of compare: country:DE, box:W,S,E,N, ...")
]


def recommend_command(
    region: RegionArgument = None,
    regions: opt.Regions = None,
    purpose: str = opt.option(PURPOSES, "What the map shall keep, as measured.", "any"),
    criterion: str = opt.option("NAME", "What to rank by: a name of 'projdist list figures'.", "airy_kavrayskiy"),
    authority: str = opt.option("NAMES", "EPSG, ESRI, IGNF, with commas.", "EPSG,ESRI"),
    datum: str | None = opt.option("TEXT", "A part of the name, as WGS 84 or ETRS89."),
    contains: bool = opt.flag("--contains", "Only those whose area of use holds the region."),
    intersects: bool = opt.flag("--intersects", "Do not prefer those whose area of use holds the region."),
    deprecated: bool = opt.flag("--deprecated", "Deprecated ones, too."),
    limit: str = opt.option("NUMBER", "How many to print.", "10"),
    uninterrupted: bool = opt.flag(
        "--uninterrupted", "Not those cut in the region; around the Earth, in one line only."
    ),
    custom: bool = opt.flag("--custom", "Also the best custom projections, and what the CRSs lose against them."),
    executor: opt.Executor = None,
    partial: opt.Partial = None,
    format: str | None = opt.report_format(),
    output: str | None = opt.output(
        "Heat maps of the best: .png, .svg or .pdf; or all as a page: .html. With --regions: as of compare."
    ),
    *,
    pictured: PictureOptions,
) -> None:
    """Find the best existing CRSs for a region, or for each of many, by measuring every candidate."""
    most = opt.whole_number("limit", limit, 1, 10_000)
    if contains and intersects:
        refuse("Invalid option '--intersects'. It cannot be used with --contains.")
    options: dict[str, Any] = {
        "purpose": purpose,
        "criterion": criterion,
        "authorities": authority.split(","),
        "datum": datum,
        "area": "contains" if contains else "intersects" if intersects else "preferred",
        "deprecated": deprecated,
        "limit": most,
        "uninterrupted": uninterrupted,
        "custom": custom,
    }
    if regions is not None:
        opt.refuse_given(pictured.given(), "It cannot be used with --regions.")
        work = RegionalWork(format, output, overwrite=pictured.overwrite, executor=executor, partial=partial)
        recommend_regions(regions, {"a region": region}, options, work)
        return
    if region is None:
        refuse("Missing argument 'REGION', or --regions. See 'projdist recommend --help'.")
    opt.refuse_regional_options(None, partial)
    form, page = opt.form_and_page(format, output, pictured.overwrite)
    area = opt.region_of(region)
    picture = picture_of(output, pictured, beside=(opt.PAGE_SUFFIX,))
    with refusing(), executor_opened(executor) as workers, progress_bar("maps", after=0.0) as progress:
        result = recommend(area, **options, executor=workers, progress=progress)
    if not result.results:
        refuse(f"No CRS serves the region '{area.name}' with these options.", code=1)
    if picture is not None:
        _draw(result, picture)
    present(_report(result, picture), form, page, pictured.overwrite)


def _draw(result: Recommendation, picture: PictureFile) -> None:
    """Draw heat maps of the best CRSs, with one colour bar."""
    maps, titles, region, measure, *_ = _mapped(result)
    distortions = [*(one.distortion for one in _drawn(result)), *(one.distortion for one in result.custom[:1])]
    figures = [one.airy_kavrayskiy for one in distortions]
    picture.save(plots.heatmap_figure, maps, measure=measure, region=region, titles=titles, airy_kavrayskiy=figures)


def _drawn(result: Recommendation) -> Sequence[Candidate]:
    """Candidates that are drawn; a custom projection takes one of the places."""
    return _drawable(result)[: _DRAWN - len(result.custom[:1])]


def _mapped(result: Recommendation) -> Mapped:
    """The best candidates, titled by code, and the best custom projection."""
    best, custom = _drawn(result), result.custom[:1]
    maps = [*(one.code for one in best), *(one.proj for one in custom)]
    return Mapped(maps, [*(one.code for one in best), *(f"custom {one.family}" for one in custom)], result.region)


def _drawable(result: Recommendation) -> tuple[Candidate, ...]:
    """Candidates that do not cut the region, unless it spans all longitudes or all candidates cut it."""
    west, _, east, _ = result.region.bounds
    whole = tuple(one for one in result.results if east - west >= 360.0 or not one.distortion.cut_km)
    return whole or result.results


# ---- the report -----------------------------------------------------------------------------


def _report(result: Recommendation, picture: PictureFile | None) -> Report:
    rows = result.rows()
    existing, custom = rows[: len(result.results)], rows[len(result.results) :]
    designed = [Column("method", "name", "custom {}".format), *_figures(result.criterion), Column("proj", "definition")]
    return Report(
        title=f"{result.region.name} ({size_text(result.region)}), {result.purpose}, by {result.criterion}",
        tables=[
            Table(existing, [*_columns(existing, result)]),
            *([Table(custom, designed)] if custom else []),
            *(_zones(system, result.criterion) for system in result.zones),
        ],
        notes=_notes(result),
        data=result.to_dict,
        rows=lambda: [{key: _finite(value) for key, value in row.items()} for row in rows],
        header=["code"],
        written=[picture.path if picture else None],
        maps=_mapped(result),
    )


def _columns(rows: Sequence[Row], result: Recommendation) -> Iterator[Column | str]:
    """Columns of existing CRSs."""
    yield "code"
    yield "name"
    yield Column("method", show=lambda method: method.replace("_", " "))
    yield Column("ranked", "ranks by", certain)
    value, *others = _figures(result.criterion)
    yield value
    if result.limit is not None:
        yield "over_limit"
    yield from others
    if result.custom:
        yield Column("ratio_to_custom", "against custom", change)
    yield "cut_km"
    yield "coverage"
    yield "share_in_area_of_use"
    yield Column("national", "made for", of=_made_for, left=True)
    yield Column("area_of_use", "area of use", _short)


def _figures(criterion: str) -> Iterator[Column | str]:
    """Columns of the figures of a CRS."""
    yield Column("value", criterion, certain, error=f"{criterion}_error")
    yield "max_scale_error_ppm"
    yield "mean_scale_error_ppm"
    yield Column("max_omega", "omega max", _angle, error="max_omega_error")
    yield Column("max_areal_scale", "areal scale", of=_span)
    yield "keeps"


def _zones(system: ZoneSystem, criterion: str) -> Table:
    """Table of a zone system, titled with its largest scale error."""
    whose = "national zones" if system.national else "zones of the world"
    columns: list[Column | str] = [
        "code",
        Column("name", "zone"),
        Column("share", "in area", per_cent),
        Column("value", criterion, certain),
        "max_scale_error_ppm",
    ]
    worst = certain(system.max_scale_error_ppm)
    title = f"{len(system.zones)} {whose}, each in its part at most {worst} ppm"
    return Table(system.zones, columns, title)


def _notes(result: Recommendation) -> list[str]:
    """Notes on the columns, identical maps and rejected CRSs."""
    notes = [
        *result.notes,
        "ppm: |scale - 1| in parts per million; omega: angular deformation in degrees; keeps: as measured; "
        "in area: the share of the region in the CRS's area of use.",
    ]
    if result.official is not None:
        notes.append(_own(result.official, result))
    if result.limit is not None:
        kind = f"{result.purpose} " if result.purpose in _KINDS else ""
        notes.append(
            f"Over limit: {result.criterion} over {result.limit:.3g}, about what the best of all {kind}maps of the "
            "region has; 'projdist design' makes such maps."
        )
    if result.area == "preferred":
        notes.append(
            "Ranks by: the figure over the share of the region in the area of use (--intersects: the figure alone), "
            f"and {WIDE_FACTOR:g} times that for maps of the world or a continent."
        )
    if result.area != "intersects":
        notes.append(
            f"Maps within {100 * CLOSE:g} % of the best of them are as good: of these national ones come first, then "
            "those of a datum that is in force."
        )
    if result.zones:
        notes.append(
            f"Zones: no conformal map serves all of the region to {ENGINEERING_PPM:g} ppm; these do better, each in "
            "its part."
        )
    notes += [
        f"{one.code} draws the same map as {', '.join(code for code, _ in one.same)}."
        for one in result.results
        if one.same
    ]
    if any(one.distortion.cut_km for one in result.results):
        notes.append("Cuts: their length within the region, which does not count; one from pole to pole has 20,015 km.")
    if result.custom:
        notes.append("Custom: the best of each family that suits the region, on WGS 84; against custom: of them all.")
    notes += [f"No custom {one.name}: {one.reason}" for one in result.not_custom]
    reasons = Counter(_kind(rejected.reason) for rejected in result.rejected)
    counts = "; ".join(f"{count} {reason}" for reason, count in reasons.most_common())
    notes.append(
        f"{result.candidates} CRSs were tried, {result.maps} different maps serve the purpose."
        + (f" Rejected (listed in JSON): {counts}." if counts else "")
    )
    return notes


def _own(official: Candidate, result: Recommendation) -> str:
    """Note on the country's official CRS, with its figures if it is not in the table."""
    own = f"The best of {result.country}'s own for general use, on its datum in force: {official.code}"
    if official.code in (one.code for one in result.results):
        return f"{own}."
    worst = certain(official.distortion.max_scale_error_ppm)
    return f"{own}, {official.name}, {result.criterion} {certain(official.value)}, at most {worst} ppm."


def _kind(reason: str) -> str:
    """Kind of a reason for rejection, in the plural."""
    if reason.startswith("Its area of use"):
        return "whose area of use holds too little of the region"
    if reason.startswith("It can be projected"):
        return "that project too little of it"
    if reason == INTERRUPTED:
        return "that are interrupted"
    return "on a sphere" if reason.startswith(OF_A_SPHERE) else "that PROJ cannot compute"


def _angle(degrees: float, error: float) -> str:
    """Angle in degrees; 0 within rounding."""
    return "0" if abs(degrees) < _ROUNDING else certain(degrees, error)


def _span(row: Row) -> str:
    """Range of areal scales with certain decimals: `0.99920 .. 1.00426`."""
    ends = ((row[f"{end}_areal_scale"], row[f"{end}_areal_scale_error"]) for end in ("min", "max"))
    return " .. ".join("inf" if value == float("inf") else rounded(value, max(error, 1e-5)) for value, error in ends)


def _made_for(row: Row) -> str:
    """Extent that the CRS is made for: national, or continent or world."""
    return "national" if row["national"] else "continent or world" if row["wide"] else ""


def _short(text: str) -> str:
    """Text up to its first full stop, at most 40 characters."""
    beginning = text.partition(". ")[0].rstrip(".")
    return beginning if len(beginning) <= 40 else f"{beginning[:37].rstrip()}..."


def _finite(value: Any) -> Any:
    """Cell of CSV; infinity and NaN become empty."""
    return "" if isinstance(value, float) and not abs(value) < float("inf") else value
