"""The command `optimize`."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterator
from typing import Annotated, Any

from projdist.cli import options as opt
from projdist.cli.errors import progress_bar, refusing
from projdist.cli.formats import HTML, JSON, TABLE, present
from projdist.cli.number_format import change, covers, rounded, size_text
from projdist.cli.report import Column, Copy, Mapped, Report, Table
from projdist.decisions import FAMILIES, Optimum, optimize, recommend
from projdist.projections import ProjectionLike, number_text
from projdist.regions import Place

_RECOMMENDED = "recommend"
_LAST = 0.1  # digit of values above 1
_LIMIT_DIGIT = 1e-3  # of a limit, which is no more than a good prediction
_DIGIT = 1e-5  # of a value: what figures of a table are shown to


_FORMS = (TABLE, "proj", "wkt", JSON, HTML)


_FAMILY = f"auto, {', '.join(FAMILIES)}, or a PROJ string with ranges, as '+proj=lcc +lat_1={{20..60}}'."


def optimize_command(
    family: Annotated[str, opt.argument("FAMILY", _FAMILY)],
    region: opt.RegionArgument,
    free: str | None = opt.option(
        "NAMES", "Parameters to choose, with commas: lat_1,lat_2,lat_0,lon_0,k_0,alpha,pole, ..."
    ),
    criterion: str = opt.option(
        "NAME", "What to make small: a name of 'projdist list figures'.", "airy_kavrayskiy", *opt.CRITERION
    ),
    ellipsoid: str | None = opt.option("NAME", "sphere or one of PROJ's; WGS84 where there are formulas for it."),
    round: str | None = opt.option("NUMBER", "Degrees of which angles are multiples; k_0 has six decimals."),
    against: list[str] | None = opt.option(
        "PROJECTION", "A map to compare with, or 'recommend': the best existing CRS. May be repeated."
    ),
    format: str | None = opt.file_format(_FORMS, ".json, .wkt, .html or .txt"),
    output: opt.Output = None,
    overwrite: opt.Overwrite = False,
) -> None:
    """Find the parameters with which a family of projections distorts a region least."""
    path = opt.printed_or_file(output, overwrite)
    form = opt.format_for(format, path, _FORMS)
    step = opt.number("rounding", round, 1e-9, 45.0, " of degrees")
    area = opt.region_of(region)
    names = None if free is None else [name.strip() for name in free.split(",") if name.strip()]
    with refusing(), progress_bar("families") as progress:
        others = [_best_existing(area, criterion) if one == _RECOMMENDED else one for one in against or []]
        found = optimize(
            family,
            area,
            free=names,
            criterion=criterion,
            ellipsoid=ellipsoid,
            round_to=step,
            against=others,
            progress=progress,
        )
    present(_report(found), form, path, overwrite)


def _best_existing(region: Place, criterion: str) -> str:
    """The code of the best existing CRS by the criterion of an optimisation; raises ValueError."""
    best = recommend(region, criterion=criterion, limit=1).results
    if not best:
        raise ValueError(f"Invalid option '--against {_RECOMMENDED}'. No CRS serves the region '{region.name}'.")
    return best[0].code


def _report(found: Optimum) -> Report:
    name = found.projection.name
    return Report(
        title=f"{name} for {found.region.name} ({size_text(found.region)})",
        lead=[*_lead(found)],
        tables=[_maps(found), *([_roundings(found)] if found.roundings else [])],
        notes=[
            *(f"{failure.given}: {failure.error}" for failure in found.failures),
            "",
            f"PROJ: {found.proj}",
            "WKT2: see --format wkt" if found.wkt else f"WKT2: none; {found.wkt_reason}",
        ],
        data=found.to_dict,
        copies={"proj": Copy(found.proj), "wkt": Copy(found.wkt, found.wkt_reason)},
        about=name,
        maps=_mapped(found),
    )


def _mapped(found: Optimum) -> Mapped:
    """The optimum and its baselines."""
    maps: list[ProjectionLike] = [found.projection, *(one.definition for one in found.baselines)]
    return Mapped(maps, ["Optimised", *(one.name for one in found.baselines)], found.region)


def _lead(found: Optimum) -> Iterator[str]:
    """Parameters and figures of the optimum."""
    yield from (f"{name:8} {number_text(value)}" for name, value in found.parameters.items())
    yield f"Airy-Kavrayskiy {_shown(found.airy_kavrayskiy)}"
    if found.criterion != "airy_kavrayskiy":
        yield f"{found.criterion} {_shown(found.value, found.error_estimate)} {found.unit}".rstrip()
    if found.limit is not None:
        over = f"{found.value / found.limit:.3g} times"
        yield f"{over} the limit {_shown(found.limit, _LIMIT_DIGIT * found.limit)}: about what the best of all maps has"
    yield from found.remarks
    yield from (f"{name} is at the end of its range." for name in found.at_limit)
    yield from covers(found.coverage)


def _maps(found: Optimum) -> Table:
    """Table of the optimum and other maps, by Airy-Kavrayskiy error where the criterion vanishes."""
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
    columns: list[Column | str] = [
        "map",
        Column("value", name, _shown, error="error", unit=unit),
        Column("against_this", "against this", change),
        "definition",
    ]
    return Table(rows, columns)


def _roundings(found: Optimum) -> Table:
    """Table of the costs of rounded parameters."""
    rows = [{"step": one.step, "cost": 1.0 + one.loss} | one.parameters for one in found.roundings]
    parameters = [Column(name, show=number_text) for name in found.roundings[0].parameters]
    return Table(rows, [Column("step", "rounded to", "{:g} deg".format), Column("cost", "costs", change), *parameters])


def _shown(value: float, error: float = 0.0) -> str:
    """A value with one decimal, or five digits below 1, and only certain ones."""
    if value < 1.0:
        return rounded(value, max(_DIGIT * value, error))
    return f"{value:,.1f}" if error <= _LAST else f"{round(value, -math.ceil(math.log10(error))):,.0f}"
