"""The command `optimize`."""

from __future__ import annotations

import enum
import math
import operator
from pathlib import Path
from typing import Annotated, Any

import typer

from projdist.cli.errors import fail, refuse
from projdist.cli.formats import area_text, json_text, notes_text, rounded, table_text
from projdist.cli.options import (
    OutputOption,
    OverwriteOption,
    file_format,
    format_for,
    number,
    printed_or_file,
    region_of,
)
from projdist.cli.output import emit
from projdist.decisions import FAMILIES, Optimum, optimize, recommend
from projdist.projections import ProjectionError, number_text
from projdist.regions import Place

_RECOMMENDED = "recommend"
_LAST = 0.1  # digit of values above 1
_DIGIT = 1e-5  # of a value: what figures of a table are shown to


class _Form(enum.StrEnum):
    TABLE = "table"
    PROJ = "proj"
    WKT = "wkt"
    JSON = "json"


def optimize_command(
    family: Annotated[
        str,
        typer.Argument(
            metavar="FAMILY",
            help=f"auto, {', '.join(FAMILIES)}, or a PROJ string with ranges, as '+proj=lcc +lat_1={{20..60}}'.",
        ),
    ],
    region: Annotated[str, typer.Argument(metavar="REGION", help="As --region of compare.")],
    free: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES", help="Parameters to choose, with commas: lat_1,lat_2,lat_0,lon_0,k_0,alpha,pole, ..."
        ),
    ] = None,
    criterion: Annotated[
        str,
        typer.Option(
            "--criterion", "-c", metavar="NAME", help="What to make small: a name of 'projdist list figures'."
        ),
    ] = "airy_kavrayskiy",
    ellipsoid: Annotated[
        str | None, typer.Option(metavar="NAME", help="sphere or one of PROJ's; WGS84 where there are formulas for it.")
    ] = None,
    round: Annotated[
        str | None, typer.Option(metavar="NUMBER", help="Degrees of which angles are multiples; k_0 has six decimals.")
    ] = None,
    against: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PROJECTION", help="A map to compare with, or 'recommend': the best existing CRS. May be repeated."
        ),
    ] = None,
    format: Annotated[str | None, file_format(_Form, ".json, .wkt or .txt")] = None,
    output: OutputOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Find the parameters with which a family of projections distorts a region least."""
    path = printed_or_file(output, overwrite)
    form = _Form(format_for(format, path, list(_Form)))
    step = None if round is None else number("rounding", round, 1e-9, 45.0, " of degrees")
    area = region_of(region)
    names = None if free is None else [name.strip() for name in free.split(",") if name.strip()]
    try:
        others = [_best_existing(area, criterion) if one == _RECOMMENDED else one for one in against or []]
        found = optimize(
            family, area, free=names, criterion=criterion, ellipsoid=ellipsoid, round_to=step, against=others
        )
    except ProjectionError as error:
        fail(str(error))
        raise typer.Exit(1) from error
    except ValueError as error:
        refuse(str(error), error)
    emit(_text(found, form, path), path, overwrite)


def _best_existing(region: Place, criterion: str) -> str:
    """The code of the best existing CRS by the criterion of an optimisation; raises ValueError."""
    best = recommend(region, criterion=criterion, limit=1).results
    if not best:
        raise ValueError(f"Invalid option '--against {_RECOMMENDED}'. No CRS serves the region '{region.name}'.")
    return best[0].code


def _text(found: Optimum, form: _Form, output: Path | None) -> str:
    if form is _Form.JSON:
        return json_text(found.to_dict())
    if form is _Form.PROJ:
        return f"{found.proj}\n"
    if form is _Form.TABLE:
        return _report(found, output)
    if found.wkt is None:
        fail(f"Invalid format 'wkt' for {found.projection.name}. {found.wkt_reason}")
        raise typer.Exit(1)
    return f"{found.wkt}\n"


def _report(found: Optimum, output: Path | None) -> str:
    unit = f" {found.unit}" if found.unit else ""
    lines = [
        f"{found.projection.name} for {found.region.name} ({area_text(found.region.area_km2)})",
        *(f"{name:8} {number_text(value)}" for name, value in found.parameters.items()),
        f"Airy-Kavrayskiy {_shown(found.airy_kavrayskiy)}",
        f"{found.criterion} {_shown(found.value, found.error_estimate)}{unit}"
        if found.criterion != "airy_kavrayskiy"
        else "",
        *found.remarks,
        *(f"{name} is at the end of its range." for name in found.at_limit),
        f"Covers {100 * found.coverage:.4g} % of the region." if found.coverage < 0.9999995 else "",
    ]
    text = notes_text([*filter(None, lines), ""], output)
    # Where the criterion vanishes there is only rounding to compare.
    name, unit = ("airy_kavrayskiy", "") if found.note else (found.criterion, unit)
    figure = operator.attrgetter("airy_kavrayskiy" if found.note else "value")
    this = figure(found)
    compared: list[tuple[str, Any, str]] = [("this", found, found.proj)]
    compared += [(b.name, b, b.definition) for b in found.baselines]
    compared += [(other.family, other, other.proj) for other in found.others]
    text += table_text(
        {
            "map": [name for name, _, _ in compared],
            f"{name}{unit}": [_shown(figure(one), 0.0 if found.note else one.error_estimate) for _, one, _ in compared],
            "against this": [f"{100 * (figure(one) / this - 1):+.2f} %" if this else "-" for _, one, _ in compared],
            "definition": [definition for _, _, definition in compared],
        },
        "",
        output=output,
    )
    if found.roundings:
        text += table_text(
            {
                "rounded to": [f"{one.step:g} deg" for one in found.roundings],
                "costs": [f"{100 * one.loss:+.2f} %" for one in found.roundings],
                **{
                    name: [number_text(one.parameters[name]) for one in found.roundings]
                    for name in found.roundings[0].parameters
                },
            },
            "",
            output=output,
        )
    notes = [
        *(f"{failure.given}: {failure.error}" for failure in found.failures),
        "",
        f"PROJ: {found.proj}",
        "WKT2: see --format wkt" if found.wkt else f"WKT2: none; {found.wkt_reason}",
    ]
    return text + notes_text(notes, output)


def _shown(value: float, error: float = 0.0) -> str:
    """One decimal, or five digits of what is small, and none that the error makes doubtful."""
    if value < 1.0:
        return rounded(value, max(_DIGIT * value, error))
    return f"{value:,.1f}" if error <= _LAST else f"{round(value, -math.ceil(math.log10(error))):,.0f}"
