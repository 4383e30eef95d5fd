"""The commands `recommend` (the best CRSs for a region, or for each of many) and `atlas` (measured in advance)."""

from __future__ import annotations

import math
import shlex
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

from projdist import decisions, designs, field, gis, plots, projections, regions, support
from projdist.cli import options as opt, wording as say
from projdist.cli.batches import SHOWN, RegionalWork, executor_opened, notices_note, regions_given
from projdist.cli.errors import progress_bar, refuse, refusing
from projdist.cli.report import TABLE, Column, Columns, Mapped, Report, Row, Table, drawing, present, tell_written
from projdist.cli.wording import area_text, certain, change, per_cent, rounded, shortened, size_text

_DRAWN = 4  # maps in the picture
_KINDS = ("conformal", "equal-area")  # purposes with a limit of their own
_ROUNDING = 1e-6  # degrees; smaller angles are shown as 0
_REJECTED = {
    "Its area of use": "whose area of use holds too little of the region",
    "It can be projected": "that project too little of it",
    decisions.INTERRUPTED: "that are interrupted",
    projections.OF_A_SPHERE: "on a sphere",
}
_LONGEST = 40  # characters of the name of an area, up to its first full stop
_HOLDS = 0.9  # share of the region; the answer says so if an area of use has less


class _Use(NamedTuple):
    """The options that a use stands for; if only one CRS serves it, its code and the reason."""

    purpose: str = "any"
    criterion: str = "airy_kavrayskiy"
    codes: tuple[str, ...] = ()
    reason: str = ""
    uninterrupted: bool = False


_USES = {
    "areas": _Use("equal-area"),
    "distances": _Use(criterion="max_scale_error_ppm"),
    "angles": _Use("conformal"),
    "navigation": _Use(codes=("EPSG:3395",), reason="on which a course of constant bearing is straight"),
    "web": _Use(codes=("EPSG:3857",), reason="in which web maps are drawn; measure on another one"),
    "print": _Use(uninterrupted=True),
}


def recommend_command(
    region: Annotated[
        str | None, opt.argument("REGION", "Like --region of compare: country:DE, box:W,S,E,N, ...")
    ] = None,
    regions: opt.Regions = None,
    use: str | None = opt.option(
        _USES, "What the map is for: true areas, true angles, nearly true distances, ...", None, "--for"
    ),
    purpose: str | None = opt.option(decisions.PURPOSES, "What the map must keep, as measured; any if not given."),
    criterion: str | None = opt.option(
        "NAME", "What to rank by: a name from 'projdist list figures'; airy_kavrayskiy if not given."
    ),
    authority: str = opt.option("NAMES", "EPSG, ESRI or IGNF, with commas.", "EPSG,ESRI"),
    datum: str | None = opt.option("TEXT", "Part of the datum's name, such as WGS 84 or ETRS89."),
    contains: bool = opt.flag("--contains", "Only CRSs whose area of use holds the region."),
    intersects: bool = opt.flag("--intersects", "Do not prefer CRSs whose area of use holds the region."),
    deprecated: bool = opt.flag("--deprecated", "Include deprecated CRSs."),
    limit: str = opt.option("NUMBER", "How many to print.", "10"),
    uninterrupted: bool = opt.flag(
        "--uninterrupted", "Leave out maps cut in the region; around the Earth, one cut is allowed."
    ),
    custom: bool = opt.flag("--custom", "Add the best custom projections, and how much better they are than the CRSs."),
    executor: opt.Executor = None,
    partial: opt.Partial = None,
    format: str | None = opt.report_format(),
    output: str | None = opt.output(
        "Heat maps of the best: .png, .svg or .pdf; or everything as a page: .html. With --regions: as in compare."
    ),
    *,
    pictured: opt.PictureOptions,
) -> None:
    """Find the best existing CRSs for a region, or for each of many, by measuring all candidates."""
    most = opt.whole_number("limit", limit, 1, 10_000)
    if contains and intersects:
        refuse("Invalid option '--intersects'. It cannot be used with --contains.")
    chosen = _Use() if use is None else _USES[opt.choice("use", use, _USES)]
    if use is not None:
        opt.refuse_given({"--purpose": purpose, "--criterion": criterion}, "--for tells it.", " with --for")
    options: dict[str, Any] = {
        "purpose": purpose or chosen.purpose,
        "criterion": criterion or chosen.criterion,
        "codes": chosen.codes,
        "authorities": authority.split(","),
        "datum": datum,
        "area": "contains" if contains else "intersects" if intersects else "preferred",
        "deprecated": deprecated,
        "limit": most,
        "uninterrupted": uninterrupted or chosen.uninterrupted,
        "custom": custom,
    }
    if regions is not None:
        opt.refuse_given(pictured.given(), "It cannot be used with --regions.")
        work = RegionalWork(format, output, overwrite=pictured.overwrite, executor=executor, partial=partial)
        _recommend_regions(regions, region, options, work)
        return
    if region is None:
        refuse("Missing argument 'REGION', or --regions. See 'projdist recommend --help'.")
    opt.refuse_given({"--partial": partial}, "It needs --regions.")
    target = opt.page_target(format, output, pictured.overwrite)
    area = opt.region_of(region)
    picture = opt.picture_of(output, pictured, beside=(opt.PAGE_SUFFIX,))
    with refusing(), executor_opened(executor) as workers, progress_bar("maps", after=0.0) as progress:
        result = decisions.recommend(area, **options, executor=workers, progress=progress)
    if not result.results:
        refuse(f"No CRS serves the region '{area.name}' with these options.", code=1)
    # The best are drawn; a custom projection takes one of the places.
    own = result.custom[:1]
    best = _drawable(result)[: _DRAWN - len(own)]
    titles = [*(say.caption(one.code, one.name) for one in best), *(f"custom {one.family}" for one in own)]
    mapped = Mapped([*(one.code for one in best), *(one.proj for one in own)], titles, result.region)
    if picture is not None:
        figures = [*(one.distortion.airy_kavrayskiy for one in best), *(one.distortion.airy_kavrayskiy for one in own)]
        shown: dict[str, Any] = {"measure": mapped.measure, "titles": titles, "airy_kavrayskiy": figures}
        picture.save(plots.heatmap_figure, mapped.projections, region=result.region, **shown)
    present(_report(result, chosen, mapped, picture), *target)


def _drawable(result: decisions.Recommendation) -> tuple[decisions.Candidate, ...]:
    """Candidates that do not cut the region, unless it spans all longitudes or all candidates cut it."""
    west, _, east, _ = result.region.bounds
    whole = tuple(one for one in result.results if east - west >= 360.0 or not one.distortion.cut_km)
    return whole or result.results


def _report(result: decisions.Recommendation, use: _Use, mapped: Mapped, picture: opt.PictureFile | None) -> Report:
    rows = result.rows()
    finite_rows = [
        {key: "" if isinstance(value, float) and not math.isfinite(value) else value for key, value in row.items()}
        for row in rows
    ]
    existing, own = rows[: len(result.results)], rows[len(result.results) :]
    tables = [Table(existing, _columns(result))]
    if own:
        name, definition = Column("method", "name", "custom {}".format), Column("proj", "definition")
        tables.append(Table(own, [name, *_figures(result.criterion), definition]))
    share, value = Column("share", "in area", per_cent), Column("value", result.criterion, certain)
    columns: Columns = ["code", Column("name", "zone"), share, value, "max_scale_error_ppm"]
    tables += [Table(one.zones, columns, _zones_text(len(one.zones), one)) for one in result.zones]
    return Report(
        answer=[*_answer(result, use)],
        brief=[_brief_table(result)],
        next=_next(result, use),
        title=f"{result.region.name} ({size_text(result.region)}), {result.purpose}, by {result.criterion}",
        heading=f"Maps for {say.region_words(result.region)}",
        tables=tables,
        notes=[*_notes(result)],
        data=result.to_dict,
        rows=lambda: finite_rows,
        header=["code"],
        written=[picture],
        maps=mapped,
    )


# ---- the answer ----------------------------------------------------------------------------------


_ROWS = 3
_NAMED = 5  # zones that are all named
_BETTER = 1.5  # ratio of distortions from which on a better map is mentioned
_VIEW = "To see where it distorts"


def _best(result: decisions.Recommendation) -> list[decisions.Candidate]:
    """The official map and the best others, those of the world or a continent only where there are no others."""
    wide = result.results[0].wide
    others = [one for one in result.results if wide or not one.wide]
    official = result.official
    return others if official is None else [official, *(one for one in others if one.code not in official.codes)]


def _own_zones(result: decisions.Recommendation) -> decisions.ZoneSystem | None:
    """The country's own zones, on the datum of its official map if it has one."""
    datum = "" if result.official is None else result.official.name.partition(" / ")[0]
    return next((one for one in result.zones if one.national and one.name.startswith(datum)), None)


def _answer(result: decisions.Recommendation, use: _Use) -> Iterator[str]:
    """Sentences: which map to use, its errors and the reason; zones; and alternatives."""
    place, country, official = say.region_words(result.region), say.with_article(result.country), result.official
    first, *others = _best(result)
    zones = _own_zones(result)
    name, errors = say.named(first.code, first.name), say.distortion_text(first.distortion)
    if use.reason:
        yield f"Use {name}, {use.reason}. For {place}, {errors}."
        return
    part = f", which is made for {say.per_cent(first.share, 2)} of it" if first.share < _HOLDS else ""
    alone = first.wide and not result.region.name.startswith("continent:")
    wide = " None is made for it alone; this one is for the world or a continent." if alone else ""
    if zones is not None and official is None:
        made_for = place if place in zones.name else country
        whole = "Use" if place == made_for else f"For {place}, use"
        yield _zones_sentence(zones, f"{whole} the zones made for {made_for}")
        yield f"For all of it, {name}{part}: {errors}.{wide}"
    else:
        made_for = place if place in first.area_name else country
        own = f" It is made for {made_for}." if first.national and not part else ""
        yield f"Use {name} for {place}{part}: {errors}.{own}{wide}"
    if zones is not None and official is not None:
        most = "" if zones.max_scale_error_ppm < first.distortion.max_scale_error_ppm else " in most of it"
        yield _zones_sentence(zones, f"For more accuracy{most}, use the zones")
    if not first.national and (national := next((one for one in others if one.national), None)):
        name = say.named(national.code, national.name)
        yield f"The best made for {country} is {name}: {say.distortion_text(national.distortion)}."
    # Ratios of other figures may be ratios of rounding errors.
    known = official is not None and result.criterion == "airy_kavrayskiy"
    for better in [one for one in others if known and one.share >= _HOLDS and one.value * _BETTER < first.value][:1]:
        older = ", on an older datum" if better.since < first.since else ""
        less = say.less_text(first.value / better.value)
        yield f"On average, {say.named(better.code, better.name)} has {less} distortion{older}."
    for one in result.custom[:1]:
        yield f"The best custom map is {one.proj}: {say.distortion_text(one.distortion)}."


def _zones_sentence(system: decisions.ZoneSystem, words: str) -> str:
    """Sentence on zones: each with its part of the region, or the first and the last of many."""
    zones, parts = system.zones, {one.part for one in system.zones}
    names = [say.named(one.code, one.name) for one in zones]
    if len(zones) > _NAMED:
        those = f"{len(zones)} from {names[0]} to {names[-1]}"
    elif len(parts) < len(zones):
        those = support.listed(names, "and")
    else:
        those = support.listed([f"{name} in the {one.part}" for name, one in zip(names, zones, strict=True)], "and")
    error = say.distance_error(1e-6 * system.max_scale_error_ppm)
    return f"{words}, {those}: distances are off by at most {error}; angles are true."


def _brief_table(result: decisions.Recommendation) -> Table:
    """The best maps with their largest errors, or with their means where one has no bound."""
    best = _best(result)
    bounded = all(math.isfinite(one.distortion.max_scale_error_ppm) for one in best[:_ROWS])
    of = "max" if bounded else "mean"
    rows = [
        {
            "code": one.code,
            "name": one.name.replace("_", " "),
            "distances": say.distance_error(1e-6 * getattr(one.distortion, f"{of}_scale_error_ppm")),
            "areas": say.area_error(1e-6 * getattr(one.distortion, f"{of}_areal_error_ppm")),
            "angles": say.angle_error(getattr(one.distortion, f"{of}_omega")),
        }
        for one in best
    ]
    figures = [Column(key, left=False) for key in ("distances", "areas", "angles")]
    return Table(rows, ["code", "name", *figures], most=_ROWS)


def _next(result: decisions.Recommendation, use: _Use) -> dict[str, str]:
    """Commands to go on with: to see the map, and to make better ones."""
    region, best = shlex.quote(result.region.name), _best(result)[0]
    found = {f"projdist heatmap {best.code} -r {region}": _VIEW}
    if use.reason:
        return found | {f"projdist recommend {region}": "For a map to measure on"}
    kind = f" --kind {result.purpose}" if result.purpose in _KINDS else ""
    if best.over_limit is not None and best.over_limit > _BETTER:
        words = f"For a map made to measure, with about {say.less_text(best.over_limit)} distortion"
        found[f"projdist design {region}{kind}"] = words
    if result.region == regions.GLOBE:
        return found | {"projdist world-map": "For a map of the world made to measure"}
    return found | {f"projdist optimize auto {region}": "For a standard projection with the best parameters"}


# ---- all figures ---------------------------------------------------------------------------------


def _columns(result: decisions.Recommendation) -> Iterator[Column | str]:
    """Columns of existing CRSs."""

    def made_for(row: Row) -> str:
        return "national" if row["national"] else "continent or world" if row["wide"] else ""

    yield from ("code", "name")
    yield Column("method", show=lambda method: method.replace("_", " "))
    yield Column("ranked", "ranks by", certain)
    value, *others = _figures(result.criterion)
    yield from (value, *(["over_limit"] if result.limit is not None else []), *others)
    if result.custom:
        yield Column("ratio_to_custom", "against custom", change)
    yield from ("cut_km", "coverage", "share_in_area_of_use")
    yield Column("national", "made for", of=made_for, left=True)
    yield Column("area_of_use", "area of use", lambda text: shortened(text.partition(". ")[0].rstrip("."), _LONGEST))


def _figures(criterion: str) -> Iterator[Column | str]:
    """Columns of the figures of a CRS."""

    def span(row: Row) -> str:
        """Range of areal scales with certain decimals: `0.99920 .. 1.00426`."""
        ends = ((row[f"{end}_areal_scale"], row[f"{end}_areal_scale_error"]) for end in ("min", "max"))
        return " .. ".join("inf" if math.isinf(value) else rounded(value, max(error, 1e-5)) for value, error in ends)

    yield Column("value", criterion, certain, error=f"{criterion}_error")
    yield from ("max_scale_error_ppm", "mean_scale_error_ppm")
    yield Column(
        "max_omega",
        "omega max",
        lambda degrees, error: "0" if abs(degrees) < _ROUNDING else certain(degrees, error),
        error="max_omega_error",
    )
    yield Column("max_areal_scale", "areal scale", of=span)
    yield "keeps"


def _zones_text(count: int, system: decisions.ZoneSystem | designs.AtlasZones) -> str:
    whose, worst = "national zones" if system.national else "zones of the world", certain(system.max_scale_error_ppm)
    return f"{count} {whose}, each in its part at most {worst} ppm"


def _notes(result: decisions.Recommendation) -> Iterator[str]:
    """Notes on the columns, identical maps and rejected CRSs."""
    yield from result.notes
    yield (
        "ppm: |scale - 1| in parts per million; omega: angular deformation in degrees; keeps: as measured; "
        "in area: the share of the region in the CRS's area of use."
    )
    official = result.official
    if official is not None:
        own = f"The best of {result.country}'s own for general use, on its datum in force: {official.code}"
        if official.code not in (one.code for one in result.results):
            worst = certain(official.distortion.max_scale_error_ppm)
            own += f", {official.name}, {result.criterion} {certain(official.value)}, at most {worst} ppm"
        yield f"{own}."
    if result.limit is not None:
        kind = f"{result.purpose} " if result.purpose in _KINDS else ""
        yield (
            f"Over limit: {result.criterion} over {result.limit:.3g}, about what the best possible {kind}map of "
            "the region has; 'projdist design' makes such maps."
        )
    if result.area == "preferred":
        yield (
            "Ranks by: the figure over the share of the region in the area of use (--intersects: the figure alone), "
            f"and {decisions.WIDE_FACTOR:g} times that for maps of the world or a continent."
        )
    if result.area != "intersects":
        yield (
            f"Maps within {100 * decisions.CLOSE:g} % of the best count as equally good: of these, national ones come "
            "first, then those on a datum in force."
        )
    if result.zones:
        yield (
            f"Zones: no conformal map keeps all of the region within {decisions.ENGINEERING_PPM:g} ppm; these do "
            "better, each in its part."
        )
    for one in result.results:
        if one.same:
            yield f"{one.code} draws the same map as {', '.join(code for code, _ in one.same)}."
    if any(one.distortion.cut_km for one in result.results):
        yield "Cuts: their length within the region, which is not ranked; one from pole to pole is 20,015 km long."
    if result.custom:
        yield "Custom: the best of each family that suits the region, on WGS 84; against custom: of them all."
    yield from (f"No custom {one.name}: {one.reason}" for one in result.not_custom)
    reasons = Counter(
        next((words for start, words in _REJECTED.items() if one.reason.startswith(start)), "that PROJ cannot compute")
        for one in result.rejected
    )
    counts = "; ".join(f"{count} {reason}" for reason, count in reasons.most_common())
    tried = f"{result.candidates} CRSs were tried, {result.maps} different maps serve the purpose."
    yield f"{tried} Rejected (listed in JSON): {counts}." if counts else tried


def _recommend_regions(
    regions: Sequence[str], region: str | None, options: Mapping[str, Any], work: RegionalWork
) -> None:
    """Find the best CRSs of each region."""
    criterion = options["criterion"]
    with refusing():
        decisions.get_purpose(options["purpose"])
        field.get_figure(criterion)
        projections.check_authorities(options["authorities"])
    areas = regions_given(regions, {"a region": region})
    found = work.run(decisions.recommend, areas, None, options)
    rows = [[{"region": one.region, "area_km2": one.area_km2, **row} for row in one.rows] for one in found.results]
    best = [group[0] for group, one in zip(rows, found.results, strict=True) if one.answer["results"]]
    unserved = [one.region for one in found.results if not one.answer["results"]]
    columns: Columns = [
        *("region", "code", "name"),
        Column("value", criterion, certain, error=f"{criterion}_error"),
        "max_scale_error_ppm",
        Column("max_omega", "omega max", certain, error="max_omega_error"),
        *("keeps", "coverage", "share_in_area_of_use"),
    ]
    notes = [
        "The best CRS of each region; JSON and CSV have the others, too.",
        "ppm: |scale - 1| in parts per million; omega: angular deformation in degrees; in area: the share of the "
        "region in the CRS's area of use.",
        *notices_note(found),
    ]
    known = [row for row in best if row["value"] is not None]
    worst = max(known, key=lambda row: row["value"]) if len(known) > 1 else None
    most = f"; it is largest for {worst['region']}: {certain(worst['value'])} on {worst['code']}" if worst else ""
    report = Report(
        answer=[f"The best CRS of each region, by {criterion}{most}."] if best else [],
        title=f"{len(best)} regions, {options['purpose']}, by {criterion}" if best else "No region is served.",
        tables=[Table(best, columns, most=SHOWN)] if best else [],
        notes=notes if best else [],
        data=lambda: {
            "regions": [
                {**one.answer, "region": {"name": one.region, "area_km2": one.area_km2}, "notices": list(one.notices)}
                for one in found.results
            ],
            "failures": [one.to_dict() for one in found.failures],
        },
        rows=lambda: [row for group in rows for row in group],
        header=["region"],
    )
    work.leave(report, found, best, [f"{name}: No CRS serves it with these options." for name in unserved])


# ---- atlas ---------------------------------------------------------------------------------------

_MADE = ("any", "made")  # purpose and kind of the map made to measure that the answer shows
_ON = "WGS 84"  # datum of maps without a code
_LEGEND = (
    "The best existing map for each purpose, and the best of all made to measure. RMS: by how much scales are off, as "
    "the root of their mean square over the place; at most: where it is worst.",
)


def atlas_command(
    place: str | None = opt.argument(
        "PLACE", "A country, state, continent, other area, ocean or UTM zone: NZ, state:CA, Europe, EU.", None
    ),
    format: str | None = opt.report_format(),
    export: str | None = opt.option(
        "FILE",
        "Write the data of the place or of all instead of printing: .csv or .parquet (a row for each map of each "
        "purpose) or .gpkg (the outline of each place).",
    ),
    overwrite: opt.Overwrite = False,
) -> None:
    """Show the best maps of a place, measured in advance; without a place, list the places."""
    form = TABLE if format is None else opt.format_of(format)
    if export is not None and format is not None:
        refuse(f"Invalid format '{format}' for '{export}'. Its suffix tells the format.")
    with refusing():
        entries = [designs.atlas(name) for name in (designs.atlas_names() if place is None else [place])]
    if export is not None:
        path = opt.file_of_kind(export, gis.ATLAS_SUFFIXES, overwrite)
        with drawing(path):
            gis.save_atlas(entries, path, overwrite=overwrite)
        tell_written(path)
        return
    present(_atlas_overview(entries) if place is None else _place_report(entries[0]), form)


def _atlas_overview(entries: Sequence[designs.AtlasEntry]) -> Report:
    rows = [entry.summary() for entry in entries]
    columns: Columns = [
        *("place", "kind"),
        Column("official", left=True),
        Column("official_error", "error", certain),
        Column("existing", "best existing", left=True),
        Column("existing_saves", "saves", _saved),
        Column("custom_saves", "custom saves", _saved),
        Column("made_saves", "made saves", _saved),
        Column("official_over_limit", "official over limit", "x {:.3g}".format),
    ]
    note = (
        "Errors are Airy-Kavrayskiy's. Existing: the best CRS of the registries; custom: the best of PROJ's families; "
        "made: to measure. Saves: against the official CRS, else the best existing one."
    )
    return Report(
        answer=[f"The atlas has the best maps of {len(entries)} places, as of New Zealand by: projdist atlas NZ"],
        brief=[],
        title=f"The atlas: {len(entries)} places",
        tables=[Table(rows, columns)],
        notes=[note],
        data=lambda: {"entries": [entry.to_dict() for entry in entries]},
    )


def _place_report(entry: designs.AtlasEntry) -> Report:
    rows, reference = entry.rows(), entry.reference
    datum = Column("datum", show=lambda name: name or _ON, left=True)
    columns: Columns = [
        Column("purpose", show=lambda name: name or "-"),
        "what",
        # The code of the map, or the name of its family in place of a long PROJ string.
        Column("projection", "map", of=lambda row: row["name" if row["projection"].startswith("+") else "projection"]),
        datum,
        Column("airy_kavrayskiy", show=certain),
        "over_limit",
        Column("saves", show=_saved),
        *("max_scale_error_ppm", "mean_scale_error_ppm"),
        Column("max_omega", "omega max", "{:.4f}".format),
        *("cut_km", "keeps"),
    ]
    first: Columns = [
        Column("purpose", show=lambda name: name or "official"),
        Column("projection", "map", of=lambda row: "made to measure" if row["what"] == "made" else row["projection"]),
        datum,
        Column("airy_kavrayskiy", "RMS", say.rms_text, left=False),
        Column("max_scale_error_ppm", "at most", lambda ppm: say.area_error(1e-6 * ppm), left=False),
    ]
    told = [row for row in rows if row["what"] in ("official", "existing") or (row["purpose"], row["what"]) == _MADE]
    region = shlex.quote(entry.region)
    view = {} if reference is None else {f"projdist heatmap {reference.projection} -r {region}": _VIEW}
    return Report(
        answer=[*_place_answer(entry)],
        brief=[Table(told, first, keys=len(first), most=None)],
        legend=_LEGEND,
        next=view | {f"projdist design {region} -o map.wkt": "To have the one made to measure as a CRS"},
        title=f"{entry.title} ({area_text(entry.area_km2)})",
        tables=[Table(rows, columns, keys=2)],
        notes=[*_place_notes(entry, rows)],
        data=entry.to_dict,
    )


def _place_answer(entry: designs.AtlasEntry) -> Iterator[str]:
    """Sentences: the official map and the best existing one, and without an official one the zones."""
    place, official = say.with_article(entry.title), entry.official
    best = next((one.existing for one in entry.purposes.values() if one.existing is not None), None)
    if official is not None:
        yield f"The official map of {place} is {_with_error(official)}."
    if best is not None and (official is None or best.projection != official.projection):
        yield f"The best existing map{'' if official else f' of {place}'} is {_with_error(best)}."
    for system in entry.zones[: official is None]:
        yield f"The zones {system.name} are off by at most {say.distance_error(1e-6 * system.max_scale_error_ppm)}."


def _with_error(one: designs.AtlasMap) -> str:
    error = "" if one.airy_kavrayskiy is None else f": scales are off by {say.rms_text(one.airy_kavrayskiy)} (RMS)"
    part = "" if one.share is None or one.share >= _HOLDS else f", which is made for {say.per_cent(one.share, 2)} of it"
    return f"{say.named(one.projection, one.name)}{part}{error}"


def _saved(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share >= 0.0 else "nothing"


def _place_notes(entry: designs.AtlasEntry, rows: Sequence[Row]) -> Iterator[str]:
    official, purposes = entry.official, entry.purposes.values()
    if official is not None:
        own = f"the best of {entry.country}'s own for general use, on its datum in force"
        yield f"Official: {own}: {official.projection}, {official.name}."
    elif entry.country:
        yield f"Official: no CRS of {entry.country}'s own is made for the place and holds nine tenths of it."
    yield "Existing: as 'projdist recommend' ranks them; maps of the world or a continent count double."
    names = {one.existing.projection: one.existing.name for one in purposes if one.existing is not None}
    yield f"{'; '.join(f'{code}: {name}' for code, name in names.items())}."
    for system in entry.zones:
        yield f"Zones: {system.name}, {_zones_text(system.zones, system)}."
    reasons = dict.fromkeys(one.reason for one in purposes if one.reason)
    yield from (f"No map made to measure: {reason}" for reason in reasons)
    against = "the official CRS" if official else "the best existing CRS"
    yield (
        f"Saves: the share of the error of {against} that a map saves. For the purpose least scale "
        "error, it is a share of the largest scale error."
    )
    yield "Over limit: the Airy-Kavrayskiy error over about that of the best possible map of the purpose in one piece."
    if any(row["cut_km"] for row in rows):
        yield "Cuts: their length within the place, kilometres; a map that is cut may be below the limit."
    versions = entry.versions
    yield f"Measured with projdist {versions['projdist']} and {versions['PROJ']}; --format json has PROJ strings."
