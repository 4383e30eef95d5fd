"""The commands that make a map better: `optimize` and `ldp` by its parameters, `correct` by a linear map."""

from __future__ import annotations

import math
import operator
import re
import shlex
from collections.abc import Iterator
from typing import Annotated, Any

import numpy as np

from projdist import answers, decisions, plots, projections, regions
from projdist.cli import options as opt, wording as say
from projdist.cli.errors import progress_bar, refuse, refusing, working
from projdist.cli.report import CSV, DETAILS, HTML, JSON, TABLE, Column, Copy, Mapped, Report, Table, drawing, present

_OPTIMUM_FORMS = (TABLE, "proj", "wkt", JSON, HTML)
_LDP_FORMS = (TABLE, "proj", "wkt", "esri", JSON, CSV, HTML)
_CORRECTION_FORMS = (TABLE, JSON, HTML, "proj", "wkt")

_RECOMMENDED = "recommend"
_LAST = 0.1  # last digit shown of values above 1
_LIMIT_DIGIT = 1e-3  # last digit shown of a limit, relative to it: it is only a good prediction
_DIGIT = 1e-5  # last digit shown of values below 1, relative to them
_FAMILY = f"auto, {', '.join(decisions.FAMILIES)}, or a PROJ string with ranges, such as '+proj=lcc +lat_1={{20..60}}'."


def optimize_command(
    family: Annotated[str, opt.argument("FAMILY", _FAMILY)],
    region: opt.RegionArgument,
    free: str | None = opt.option(
        "NAMES", "Parameters to choose, with commas: lat_1,lat_2,lat_0,lon_0,k_0,alpha,pole, ..."
    ),
    criterion: str = opt.option(
        "NAME", "What to minimise: a name from 'projdist list figures'.", "airy_kavrayskiy", *opt.CRITERION
    ),
    ellipsoid: str | None = opt.option("NAME", "sphere or one of PROJ's; by default WGS84 if there are formulas."),
    round: str | None = opt.option("NUMBER", "Round angles to multiples of this many degrees, k_0 to six decimals."),
    against: list[str] | None = opt.option(
        "PROJECTION", "A map to compare with, or 'recommend': the best existing CRS; may be repeated."
    ),
    format: str | None = opt.file_format(_OPTIMUM_FORMS, ".json, .wkt, .html or .txt"),
    output: opt.Output = None,
    overwrite: opt.Overwrite = False,
) -> None:
    """Find the parameters with which a family of projections distorts a region least."""
    target = opt.target(format, output, overwrite, _OPTIMUM_FORMS)
    step = opt.number("rounding", round, 1e-9, 45.0, " of degrees")
    area = opt.region_of(region)
    names = None if free is None else [name.strip() for name in free.split(",") if name.strip()]
    with refusing(), progress_bar("families") as progress:
        others = [_best_existing(area, criterion) if one == _RECOMMENDED else one for one in against or []]
        found = decisions.optimize(
            family,
            area,
            free=names,
            criterion=criterion,
            ellipsoid=ellipsoid,
            round_to=step,
            against=others,
            progress=progress,
        )
    name = found.projection.name
    maps: list[projections.ProjectionLike] = [found.projection, *(one.definition for one in found.baselines)]
    tables = [*_optimum_tables(found)]
    report = Report(
        answer=[*_optimum_answer(found)],
        brief=[Table(tables[0].rows, [one for one in tables[0].columns if one.key != "definition"])],
        next={
            shlex.join(["projdist", "heatmap", found.proj, "-r", found.region.name]): "To see where it distorts",
            f"projdist design {shlex.quote(found.region.name)}": "For a map made to measure",
        },
        title=f"{name} for {found.region.name} ({say.size_text(found.region)})",
        lead=[*_optimum_lead(found)],
        tables=tables,
        notes=[
            *(f"{failure.given}: {failure.error}" for failure in found.failures),
            "",
            f"PROJ: {found.proj}",
            "WKT2: see --format wkt" if found.wkt else f"WKT2: none; {found.wkt_reason}",
        ],
        data=found.to_dict,
        copies={"proj": Copy(found.proj), "wkt": Copy(found.wkt, found.wkt_reason)},
        about=name,
        maps=Mapped(maps, ["Optimised", *(one.name for one in found.baselines)], found.region),
    )
    present(report, *target)


def _best_existing(region: regions.Place, criterion: str) -> str:
    """The code of the best existing CRS by the criterion of an optimisation; raises ValueError."""
    best = decisions.recommend(region, criterion=criterion, limit=1).results
    if not best:
        raise ValueError(f"Invalid option '--against {_RECOMMENDED}'. No CRS serves the region '{region.name}'.")
    return best[0].code


def _optimum_answer(found: decisions.Optimum) -> Iterator[str]:
    """Sentences: the best map, its error beside that of others, its PROJ string, and remarks."""
    if found.criterion == "airy_kavrayskiy" or found.note:
        error = f"scales are off by {say.rms_text(found.airy_kavrayskiy)} (RMS)"
    else:
        error = f"{found.criterion} is {_shown(found.value, found.error_estimate)} {found.unit}".rstrip()
    figure = operator.attrgetter("airy_kavrayskiy" if found.note else "value")
    rivals = [(figure(one), one.name) for one in found.baselines] + [(figure(one), one.family) for one in found.others]
    (least, name), own = min(rivals, default=(0.0, "")), figure(found)
    less = f", {say.less_text(least / own)} than the next best ({name})" if least > own > 0.0 else ""
    yield f"The best map of the family {found.family} for {say.region_words(found.region)}: {error}{less}."
    yield found.proj
    yield from (f"{parameter} is at the end of its range." for parameter in found.at_limit)
    if found.coverage < say.WHOLE:
        yield f"It shows only {say.per_cent(found.coverage)} of the region."


def _optimum_lead(found: decisions.Optimum) -> Iterator[str]:
    """Parameters and figures of the optimum."""
    yield from (f"{name:8} {projections.number_text(value)}" for name, value in found.parameters.items())
    yield f"Airy-Kavrayskiy {_shown(found.airy_kavrayskiy)}"
    if found.criterion != "airy_kavrayskiy":
        yield f"{found.criterion} {_shown(found.value, found.error_estimate)} {found.unit}".rstrip()
    if found.limit is not None:
        far = f"{found.value / found.limit:.3g} times"
        yield f"{far} the limit {_shown(found.limit, _LIMIT_DIGIT * found.limit)}: about what the best possible map has"
    yield from found.remarks
    yield from (f"{name} is at the end of its range." for name in found.at_limit)
    yield from say.covers(found.coverage)


def _optimum_tables(found: decisions.Optimum) -> Iterator[Table]:
    """The optimum and others, by Airy-Kavrayskiy error where the criterion vanishes; costs of rounded parameters."""
    name, unit = ("airy_kavrayskiy", "") if found.note else (found.criterion, found.unit)
    figure = operator.attrgetter("airy_kavrayskiy" if found.note else "value")
    this = figure(found)
    compared: list[tuple[str, Any, str]] = [("this", found, found.proj)]
    compared += [(one.name, one, one.definition) for one in found.baselines]
    compared += [(one.family, one, one.proj) for one in found.others]
    rows = [
        {
            "map": label,
            "value": figure(one),
            "error": 0.0 if found.note else one.error_estimate,
            "against_this": figure(one) / this if this else None,
            "definition": definition,
        }
        for label, one, definition in compared
    ]
    value = Column("value", f"{name} {unit}".rstrip(), _shown, error="error")
    yield Table(rows, ["map", value, Column("against_this", "against this", say.change), "definition"])
    if found.roundings:
        costs = [{"step": one.step, "cost": 1.0 + one.loss} | one.parameters for one in found.roundings]
        parameters = [Column(name, show=projections.number_text) for name in found.roundings[0].parameters]
        step = Column("step", "rounded to", "{:g} deg".format)
        yield Table(costs, [step, Column("cost", "costs", say.change), *parameters])


def _shown(value: float, error: float = 0.0) -> str:
    """A value with one decimal, or five digits below 1, and only certain ones."""
    if value < 1.0:
        return say.rounded(value, max(_DIGIT * value, error))
    return f"{value:,.1f}" if error <= _LAST else f"{round(value, -math.ceil(math.log10(error))):,.0f}"


# ---- ldp -----------------------------------------------------------------------------------------


def ldp_command(
    region: opt.RegionArgument,
    heights: str | None = opt.option(
        "FILE", "Points (.csv with lon, lat and ellipsoidal h) or a raster (.tif, with rasterio)."
    ),
    height: str | None = opt.option("NUMBER", "The ellipsoidal height of the whole region."),
    height_units: str = opt.option(projections.LINEAR_UNITS, "The unit of these heights.", "m"),
    geoid: str | None = opt.option(
        "NAME|FILE",
        "Heights are orthometric, above this grid: a file, or one that PROJ has, such as us_nga_egm96_15.tif.",
    ),
    geoid_height: str | None = opt.option(
        "METRES", "Heights are orthometric, above a geoid of this height, such as -17.5."
    ),
    families: str = opt.option("NAMES", "Families to try, with commas.", ",".join(decisions.LDP_FAMILIES)),
    criterion: str = opt.option(
        "NAME",
        "share (the most points within the target), max_scale_error_ppm, rms_scale_error_ppm, ...",
        "share",
        *opt.CRITERION,
    ),
    target_ppm: str = opt.option("PPM", "The target for share.", "20"),
    round_k: str = opt.option("NUMBER", "Round the scale factor to a multiple of this.", "1e-6"),
    round_axis: str = opt.option("ANGLE", "Round the axis to a multiple of this: 1', 30\", 0.5 (degrees).", "1'"),
    geodetic: str = opt.option("CRS", "The geographic CRS to base it on.", "EPSG:4326"),
    against: list[str] | None = opt.option("PROJECTION", "A map to compare with; may be repeated."),
    units: str = opt.option(projections.LINEAR_UNITS, "Unit of the CRS: metres, US survey or international feet.", "m"),
    false_easting: str | None = opt.option("NUMBER", "x_0 in the unit of the CRS; a round one if not given."),
    false_northing: str | None = opt.option("NUMBER", "y_0 in the unit of the CRS; a round one if not given."),
    name: str | None = opt.option("TEXT", "The name of the CRS."),
    format: str | None = opt.report_format(_LDP_FORMS),
    output: str | None = opt.output(
        "A map of the distortion in ppm: .png, .svg or .pdf; or a sheet to sign, with test points: .html."
    ),
    *,
    pictured: opt.PictureOptions,
) -> None:
    """Design a low-distortion projection: grid distances match those on the ground, at ellipsoidal heights."""
    target = opt.page_target(format, output, pictured.overwrite, _LDP_FORMS)
    area = opt.region_of(region)
    own = isinstance(area, regions.PointSet) and area.height is not None
    if (heights is not None) + (height is not None) > 1 or not (own or heights or height):
        refuse("Invalid heights. Either --heights FILE or --height NUMBER must be given.")
    if own and not height and height_units != "m":
        refuse(f"Invalid units of heights '{height_units}'. The points of a region have theirs in metres.")
    picture = opt.picture_of(output, pictured, beside=(opt.PAGE_SUFFIX,))
    options: dict[str, Any] = {
        "families": [word.strip() for word in families.split(",") if word.strip()],
        "criterion": criterion,
        "target_ppm": opt.number("target", target_ppm, 1e-3, 1e5, " of ppm"),
        "round_k": opt.number("rounding of k_0", round_k, 1e-10, 1e-3),
        "round_axis": _angle(round_axis),
        "geodetic": geodetic,
        "against": against or [],
        "name": name,
        "units": opt.choice("units", units, projections.LINEAR_UNITS),
    }
    if geoid is not None and geoid_height is not None:
        refuse("Invalid option '--geoid-height'. It cannot be used with --geoid.")
    above = opt.number("height of the geoid", geoid_height, -120.0, 120.0, " of metres")
    options["geoid"] = geoid if above is None else above
    unit = projections.LINEAR_UNITS[units]
    of_heights = projections.LINEAR_UNITS[opt.choice("units of heights", height_units, projections.LINEAR_UNITS)]
    for key, text in (("easting", false_easting), ("northing", false_northing)):
        options[f"false_{key}"] = opt.number(f"false {key}", text, -1e8, 1e8, f" of {unit.plural}")
    with refusing(), working("Designing"):
        if height is not None:
            low, high = -500.0 / of_heights.metres, 9000.0 / of_heights.metres
            options["height"] = of_heights.metres * opt.number("height", height, low, high, f" of {of_heights.plural}")
        elif heights is not None:
            options["heights"] = decisions.read_heights(heights) * [1.0, 1.0, of_heights.metres]
        found = decisions.ldp(area, **options)
    if picture is not None:
        picture.save(plots.ldp_figure, found)
    # A page shows the design and its baselines, with scales on the ground at the mean height.
    mean = float(np.average(found.height, weights=found.weight))
    height_text = f"{mean / unit.metres:,.0f} {unit.name}"
    at = f"at {height_text}" if np.ptp(found.height) < 0.5 else f"at the mean height, {height_text}"
    maps: list[projections.ProjectionLike] = [found.projection, *(against or [])]
    labels = [found.family, *(label for label, _ in found.baselines)]
    titles = [f"{label}, on the ground {at}" for label, _ in zip(labels, maps, strict=False)]
    place = regions.Box.between(found.region.bounds) if isinstance(found.region, regions.PointSet) else found.region
    statistics = _ldp_table(found)
    copies = {"proj": found.proj, "wkt": found.wkt, "esri": found.esri}
    points = {"lon": found.lon, "lat": found.lat, "height": found.height, "ppm": found.ppm}
    report = Report(
        answer=[*_ldp_answer(found)],
        brief=[statistics],
        next={}
        if picture
        else {"-o map.png": "To draw it, the same command with", "-o sheet.html": "For a sheet to sign"},
        heading=name or "",
        title=f"{found.projection.name} for {found.region.name} ({say.size_text(found.region)}), by {found.criterion}",
        tables=[Table([*_ldp_parameters(found)], ["parameter", "value", "PROJ"]), statistics, *_ldp_tests(found)],
        notes=[*_ldp_notes(found)],
        data=found.to_dict,
        rows=lambda: [
            dict(zip(points, row, strict=True)) for row in zip(*(one.tolist() for one in points.values()), strict=True)
        ],
        copies={form: Copy(text, "There is no such form of it.") for form, text in copies.items()},
        about=found.projection.name,
        written=[picture],
        maps=Mapped(maps, titles, place, "scale_error_ppm", mean),
        signed=("Name", "Licence number", "Signature", "Date"),
    )
    present(report, *target)


def _ldp_answer(found: decisions.LDP) -> Iterator[str]:
    """Sentences: how near grid distances are to those on the ground, the PROJ string, and the false origin."""
    figures, target = found.statistics, found.target_ppm
    worst, share = max(abs(figures.min), abs(figures.max)), figures.within.get(target)
    ratio = "" if worst < 1.0 else f" ({say.distance_error(1e-6 * worst)})"
    within = "" if share is None else f"; {say.per_cent(share, 3)} of it is within {target:g} ppm"
    place = say.region_words(found.region)
    yield f"In {place}, grid distances differ from those on the ground by at most {say.up(worst)} ppm{ratio}{within}."
    yield found.proj
    if found.unit.name != "m":
        east, north = (f"{value:,.10g}" for value in found.false_origin)
        yield f"False easting {east}, false northing {north} {found.unit.plural}; PROJ's x_0 and y_0 are in metres."


def _angle(text: str) -> float:
    """Angle in degrees, given as `0.5`, `1'` or `30"`."""
    match = re.fullmatch(r"\s*((?:\d+\.?\d*|\.\d+)(?:e-?\d+)?)\s*(['\"′″°]?)\s*", text)
    units = {"'": 60.0, "′": 60.0, '"': 3600.0, "″": 3600.0}
    degrees = float(match[1]) / units.get(match[2], 1.0) if match else math.nan
    if not 1e-7 <= degrees <= 1.0:
        refuse(f"Invalid rounding of the axis '{text}'. It must be an angle up to 1 degree, such as 1', 30\" or 0.5.")
    return degrees


def _degrees(value: float, decimals: int = 5, letters: str = "") -> str:
    """Angle in degrees, minutes and seconds, with a sign, or with one of two letters: EW or NS."""
    scale = 10**decimals
    minutes, seconds = divmod(round(abs(value) * 3600 * scale), 60 * scale)
    shown = projections.number_text(seconds / scale) if decimals > _SHORT else f"{seconds / scale:.{decimals}f}"
    whole, _, rest = shown.partition(".")
    sign = "-" if value < 0 and not letters and minutes + seconds else ""
    text = f"{sign}{minutes // 60}°{minutes % 60:02d}'{whole.zfill(2)}{rest and '.'}{rest}\""
    return f"{text} {letters[value < 0]}" if letters else text


_SHORT = 2  # decimals of seconds up to which trailing zeros are shown
_PARAMETERS = {
    **{"lon_0": "Central meridian", "lonc": "Longitude of the centre", "lat_1": "Standard parallel"},
    **{"lat_0": "Latitude of origin", "alpha": "Azimuth of the axis", "k_0": "Scale factor on the axis"},
    **{"x_0": "False easting", "y_0": "False northing"},
}
_LETTERS = {"lon_0": "EW", "lonc": "EW", "lat_0": "NS", "lat_1": "NS"}


def _ldp_parameters(found: decisions.LDP) -> Iterator[dict[str, str]]:
    """Rows of all that defines the map, as surveyors and as PROJ write it."""
    words = {word.partition("=")[0]: word for word in found.proj.split()}
    crs, ellipsoid, unit = projections.crs_of(found.geodetic), found.projection.ellipsoid, found.unit
    datum, figure = (getattr(one, "name", "") for one in (crs.datum, crs.ellipsoid))
    shape = f"a = {ellipsoid.a:.10g} m, 1/f = {1.0 / ellipsoid.f:.12g}" if ellipsoid.f else f"R = {ellipsoid.a:.10g} m"
    rows = {
        "Projection": (found.projection.name, words["+proj"]),
        "Geographic CRS": (say.named(found.geodetic, crs.name), ""),
        "Datum": (datum, ""),
        "Ellipsoid": (f"{figure}: {shape}", words.get("+ellps", "")),
        "Unit": (f"{unit.title}, {unit.metres:.12g} m (EPSG:{unit.code})", words.get("+units", "")),
    }
    false_origin = dict(zip(("x_0", "y_0"), found.false_origin, strict=True))
    for key, value in found.parameters.items():
        if key in false_origin:
            shown = f"{projections.number_text(false_origin[key])} {unit.plural}"
        else:
            shown = projections.number_text(value) if key == "k_0" else _degrees(value, letters=_LETTERS.get(key, ""))
        label = "Latitude of the centre" if key == "lat_0" and "+lonc" in words else _PARAMETERS[key]
        rows[label] = shown, words[f"+{key}"] + " (metres)" * (key in false_origin and unit.name != "m")
    yield from ({"parameter": key, "value": value, "PROJ": word} for key, (value, word) in rows.items())


def _ldp_tests(found: decisions.LDP) -> Iterator[Table]:
    """Points and lines to check a program with, in the unit of the map."""
    unit = found.unit

    def of_heights(value: float) -> str:
        return f"{value / unit.metres:.3f}"

    columns: list[Column | str] = [
        *("point", Column("lon", "longitude", lambda value: _degrees(value, 0, "EW"), left=False)),
        Column("lat", "latitude", lambda value: _degrees(value, 0, "NS"), left=False),
        Column("geoid_height", f"geoid {unit.name}", of_heights, only=lambda value: value is not None),
        Column("height", f"h {unit.name}", of_heights),
        *(Column(key, f"{key[0].upper()} {unit.name}", "{:.4f}".format) for key in ("easting", "northing")),
        *(Column(f"{key}_factor", key.replace("_", " "), "{:.9f}".format) for key in ("grid_scale", "elevation")),
        Column("combined_factor", "combined", "{:.9f}".format),
        Column("convergence", show=lambda value: _degrees(value, 2), left=False),
    ]
    yield Table(found.test_points, columns, "Test points, h above the ellipsoid")
    if not found.test_lines:  # of one point
        return
    kinds = [Column(f"{kind}_distance", f"{kind} {unit.name}", "{:.4f}".format) for kind in ("grid", "ground")]
    yield Table(found.test_lines, ["line", *kinds, Column("ppm", "difference ppm", "{:.3f}".format)], "Test lines")


def _ldp_table(found: decisions.LDP) -> Table:
    """Table of ppm statistics of the design, other families and baselines."""
    maps = [(found.family, found.statistics), *((other.family, other.statistics) for other in found.others)]
    rows = [
        {"map": label} | vars(statistics) | {f"within {ppm:g}": share for ppm, share in statistics.within.items()}
        for label, statistics in (*maps, *found.baselines)
    ]
    figures = [Column(name, f"{name} ppm", "{:.2f}".format) for name in ("min", "max", "mean", "std", "rms")]
    within = [f"within {ppm:g}" for ppm in found.statistics.within]
    return Table(rows, ["map", *figures, *(Column(key, show=lambda share: f"{100.0 * share:.1f} %") for key in within)])


def _ldp_notes(found: decisions.LDP) -> Iterator[str]:
    def span(metres: Any) -> str:
        low, high = (f"{value / found.unit.metres:,.1f}" for value in (metres.min(), metres.max()))
        return f"{low}{'' if low == high else f' to {high}'} {found.unit.name}"

    if found.geoid_height is None:
        yield f"Heights are ellipsoidal, not orthometric: {span(found.height)} at {found.lon.size:,} points."
    else:
        yield (
            f"Ellipsoidal heights, {span(found.height)} at {found.lon.size:,} points, are the orthometric ones with "
            f"the geoid's added, {span(found.geoid_height)}{f' ({found.geoid})' if found.geoid else ''}."
        )
    yield from found.notes
    yield (
        "The combined factor is the grid scale factor times the elevation factor R / (R + h), R = sqrt(MN) (J. E. "
        "Stem 1989, NOAA Manual NOS NGS 5). Ground distances are those of geodesics, raised to heights that are "
        "linear between both ends."
    )
    yield f"PROJ: {found.proj}"
    if found.simpler:
        yield f"PROJ, {found.simpler.family}: {found.simpler.proj}"
    forms = [form for form, text in (("wkt", found.wkt), ("esri", found.esri)) if text]
    if forms:
        yield f"WKT: see --format {' or '.join(forms)}"


# ---- correct -------------------------------------------------------------------------------------


def correct_command(
    projection: opt.OneProjection,
    region: opt.Region = None,
    criterion: str = opt.option(
        answers.CORRECTION_CRITERIA,
        "Minimise the mean square of the distortion, or its mean (by the geometric median of the Jacobians).",
        "mean",
    ),
    constraint: str = opt.option(
        answers.CONSTRAINTS, "Any linear map, one that keeps areas, or only a scale.", "affine"
    ),
    keep_north: bool = opt.flag(
        "--keep-north/--free", "Keep the map's vertical, or turn it so that north is up on average.", True
    ),
    format: str | None = opt.report_format(_CORRECTION_FORMS),
    output: str | None = opt.output("A picture of the map before and after: .png, .svg or .pdf; or a page: .html."),
    local: str | None = opt.option("KM", "Draw instead the corrections that caps of this radius would have."),
    step: str | None = opt.option("NUMBER", "Degrees between the ellipses or caps."),
    *,
    pictured: opt.PictureOptions,
) -> None:
    """Find the linear map that reduces a map's distortion most, and the corrected map."""
    target = opt.page_target(format, output, pictured.overwrite, _CORRECTION_FORMS)
    area = opt.region_of(region, [projection])
    opt.choice("criterion", criterion, answers.CORRECTION_CRITERIA)
    opt.choice("constraint", constraint, answers.CONSTRAINTS)
    picture = opt.picture_of(output, pictured, step=step, beside=(opt.PAGE_SUFFIX,))
    with refusing():
        measured = projections.Projection.from_user_input(projection)
        if local is not None:
            if criterion != "mean":
                refuse("Invalid option '--criterion' with --local. Local corrections are by the mean.")
            bounds = {"--constraint": constraint != "affine" or None, "--free": not keep_north or None}
            opt.refuse_given(bounds, "Local corrections are symmetric and have no constraint.", " with --local")
            _present_local(measured, area, local, picture, target.form)
            return
        result = answers.correct(measured, area, criterion=criterion, constraint=constraint, keep_north=keep_north)
    maps = [result.projection, result.corrected]
    if picture is not None:
        figures = [result.airy_kavrayskiy, result.airy_kavrayskiy_corrected]
        picture.save(plots.tissot_figure, maps, region=result.region, step=picture.step, airy_kavrayskiy=figures)
    report = Report(
        answer=[*_correction_answer(result)],
        next={} if picture else {"-o both.png": "To draw it before and after, the same command with"},
        title=f"{result.projection.name} over {result.region.name} ({say.size_text(result.region)})",
        tables=[_correction_table(result)],
        notes=[*_correction_notes(result)],
        data=lambda: result.to_dict() | {"projection": projection},
        copies={
            "proj": Copy(result.pipeline, "A function has no PROJ pipeline."),
            "wkt": Copy(result.wkt, result.wkt_reason),
        },
        about=result.projection.name,
        written=[picture],
        maps=Mapped(maps, ["As it is", "Corrected"], result.region),
    )
    present(report, *target)


def _correction_answer(result: answers.Correction) -> Iterator[str]:
    """Sentences: the linear map, the distortion before and after, and the pipeline."""
    before, after = result.airy_kavrayskiy, result.airy_kavrayskiy_corrected
    ratio = before / after if after else 1.0
    less = say.less_text(ratio) if ratio > 1.0 else "no less"
    yield (
        f"{result.projection.name} distorts {say.region_words(result.region)} {less} after {result.words}: scales are "
        f"off by {say.rms_text(after)} (RMS), by {say.rms_text(before)} before."
    )
    if result.pipeline:
        yield result.pipeline
    yield from say.covers(result.coverage)


def _present_local(
    measured: projections.Projection, area: regions.Place | None, local: str, picture: opt.PictureFile | None, form: str
) -> None:
    """Draw the field of local corrections, or print it as JSON."""
    if form not in (TABLE, DETAILS, JSON):
        refuse(f"Invalid format '{form}' with --local. It must be table or json.")
    if picture is None and form != JSON:
        refuse("Invalid option '--local'. It needs a picture to draw to, -o FILE, or --format json.")
    km = opt.number("radius", local, 1e-3, 10_000.0, " of km")
    if picture is None:
        field = plots.local_figure(measured, km, region=area)[1]
    else:
        shown: dict[str, Any] = {"step": picture.step, "size": picture.size, "dpi": picture.dots, "look": picture.look}
        with drawing(picture.path):
            figure, field = plots.local_figure(measured, km, region=area, **shown)
        picture.save(lambda **_: figure)
    present(Report(data=field.to_dict, written=[picture]), form)


def _correction_table(result: answers.Correction) -> Table:
    """The errors before and after, and where they are known the mean and the median distortion."""
    by = result.constraint if result.criterion == "mean" else result.criterion
    figures = {
        "as it is": (result.airy_kavrayskiy, result.spread),
        "after the best scale": (result.airy_kavrayskiy_scaled, None),
        "after the best linear map (MDT)": (result.airy_kavrayskiy_affine, result.spread_affine),
        f"corrected ({by}), measured again": (result.airy_kavrayskiy_corrected, result.spread_corrected),
    }
    keys = ("mean", "mean_error", "half", "half_error")
    rows = [
        {"map": name, "value": value, "error": result.error_estimate}
        | (dict(zip(keys, (*spread.mean, *spread.median), strict=True)) if spread else {})
        for name, (value, spread) in figures.items()
        if spread or not result.spread
    ]
    airy = Column("value", "Airy-Kavrayskiy", say.rounded, error="error")
    mean = Column("mean", "mean distortion", say.rounded, error="mean_error")
    half = Column("half", "half the area below", say.rounded, error="half_error")
    return Table(rows, ["map", airy, *([mean, half] if result.spread else [])])


def _correction_notes(result: answers.Correction) -> Iterator[str]:
    (xx, xy), (yx, yy) = result.matrix
    if result.spread is None:
        yield f"The error of these figures is about {result.error_estimate:.0e}."
    else:
        yield f"The error of the matrix is about {result.matrix_error:.0e}."
    yield f"x' = {xx:.9g} x {xy:+.9g} y" if xy else f"x' = {xx:.9g} x"
    yield f"y' = {yx:.9g} x {yy:+.9g} y" if yx else f"y' = {yy:.9g} y"
    yield f"That is {result.words}."
    if result.note:
        yield result.note
    yield from say.covers(result.coverage)
    yield ""
    if result.parameters:
        yield f"By its own parameters: {result.parameters}"
    yield f"PROJ: {result.pipeline}" if result.pipeline else "PROJ: none; a function has no pipeline."
    yield "WKT2: see --format wkt" if result.wkt else f"WKT2: none; {result.wkt_reason}"
