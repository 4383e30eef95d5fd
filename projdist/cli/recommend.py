"""The command `recommend`."""

from __future__ import annotations

import contextlib
import functools
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from projdist.cli.errors import fail, refuse
from projdist.cli.formats import Format, certain, csv_text, json_text, markdown_text, notes_text, rounded, table_text
from projdist.cli.options import DpiOption, FormatOption, OverwriteOption, SizeOption, format_of, number, region_of
from projdist.cli.output import emit, wrote
from projdist.cli.pictures import PictureFile, picture_of
from projdist.decisions import (
    CLOSE,
    ENGINEERING_PPM,
    INTERRUPTED,
    PURPOSES,
    WIDE_FACTOR,
    Candidate,
    Recommendation,
    ZoneSystem,
    recommend,
)
from projdist.projections import OF_A_SPHERE
from projdist.support import check_executor, open_executor

_DRAWN = 4  # maps in the picture

RegionArgument = Annotated[str, typer.Argument(metavar="REGION", help="As --region of compare.")]


def recommend_command(
    region: RegionArgument,
    purpose: Annotated[
        str, typer.Option(metavar="|".join(PURPOSES), help="What the map shall keep, as measured.")
    ] = "any",
    criterion: Annotated[
        str, typer.Option(metavar="NAME", help="What to rank by: a name of 'projdist list figures'.")
    ] = "airy_kavrayskiy",
    authority: Annotated[str, typer.Option(metavar="NAMES", help="EPSG, ESRI, IGNF, with commas.")] = "EPSG,ESRI",
    datum: Annotated[str | None, typer.Option(metavar="TEXT", help="A part of the name, as WGS 84 or ETRS89.")] = None,
    contains: Annotated[
        bool, typer.Option("--contains", help="Only those whose area of use holds the region.")
    ] = False,
    intersects: Annotated[
        bool, typer.Option("--intersects", help="Do not prefer those whose area of use holds the region.")
    ] = False,
    deprecated: Annotated[bool, typer.Option("--deprecated", help="Deprecated ones, too.")] = False,
    limit: Annotated[str, typer.Option(metavar="NUMBER", help="How many to print.")] = "10",
    uninterrupted: Annotated[
        bool, typer.Option("--uninterrupted", help="Not those cut in the region; around the Earth, in one line only.")
    ] = False,
    custom: Annotated[
        bool, typer.Option("--custom", help="Also the best custom projections, and what the CRSs lose against them.")
    ] = False,
    executor: Annotated[
        str | None, typer.Option(metavar="dask://HOST:PORT", help="A Dask scheduler to run the work on.")
    ] = None,
    format: FormatOption = "table",
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="FILE", help="Heat maps of the best: .png, .svg or .pdf."),
    ] = None,
    size: SizeOption = None,
    dpi: DpiOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Find the best existing CRSs for a region, by measuring every candidate."""
    form, area = format_of(format), region_of(region)
    most = number("limit", limit, 1, 10_000)
    if most != int(most):
        refuse(f"Invalid limit '{limit}'. It must be a whole number.")
    if contains and intersects:
        refuse("Invalid option '--intersects'. It cannot stand with --contains.")
    picture = picture_of(output, size=size, dpi=dpi, overwrite=overwrite)
    with _usage(), _executor(executor) as workers, _bar() as progress:
        result = recommend(
            area,
            purpose=purpose,
            criterion=criterion,
            authorities=authority.split(","),
            datum=datum,
            area="contains" if contains else "intersects" if intersects else "preferred",
            deprecated=deprecated,
            limit=int(most),
            uninterrupted=uninterrupted,
            custom=custom,
            executor=workers,
            progress=progress,
        )
    if not result.results:
        fail(f"No CRS serves the region '{area.name}' with these options.")
        raise typer.Exit(1)
    text = _text(result, form)
    if picture is not None:
        _draw(result, picture)
        text += wrote(picture.path) if form is Format.TABLE else ""
    emit(text, None)


# ---- the surroundings of the work -----------------------------------------------------------


@contextlib.contextmanager
def _usage() -> Iterator[None]:
    """Say what was wrong in the words of an option."""
    try:
        yield
    except ValueError as error:
        refuse(str(error), error)


@contextlib.contextmanager
def _executor(text: str | None) -> Iterator[Executor | None]:
    """The executor of `--executor`; None for processes of our own."""
    if text is None:
        yield None
        return
    check_executor(text)
    with contextlib.ExitStack() as stack:
        try:
            workers = stack.enter_context(open_executor(text))
        except (ImportError, OSError) as error:
            fail(str(error) if isinstance(error, ImportError) else f"Invalid executor '{text}'. Nothing answers there.")
            raise typer.Exit(1) from error
        yield workers


@contextlib.contextmanager
def _bar() -> Iterator[Callable[[int, int], None] | None]:
    """A listener that moves a progress bar; None where the standard error is no terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    columns = (MofNCompleteColumn(), TextColumn("maps"), BarColumn(), TimeRemainingColumn())
    # Drawn when there is news, without a thread that would draw it: processes with threads are not forked.
    with Progress(*columns, console=Console(stderr=True), transient=True, auto_refresh=False) as progress:
        task = progress.add_task("", total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total, refresh=True)


def _draw(result: Recommendation, picture: PictureFile) -> None:
    """Heat maps of the best, the last of them the best custom projection if there is one, with one colour bar."""
    from projdist import plots  # matplotlib is slow to load, and --help must not wait for it

    custom = result.custom[:1]
    best = _drawable(result)[: _DRAWN - len(custom)]
    distortions = [*(one.distortion for one in best), *(one.distortion for one in custom)]
    picture.save(
        functools.partial(
            plots.heatmap_figure,
            [*(one.code for one in best), *(one.proj for one in custom)],
            measure="fisher",
            region=result.region,
            titles=[*(one.code for one in best), *(f"custom {one.family}" for one in custom)],  # names do not fit
            airy_kavrayskiy=[distortion.airy_kavrayskiy for distortion in distortions],
        )
    )


def _drawable(result: Recommendation) -> tuple[Candidate, ...]:
    """Results that do not tear a region that does not go round the Earth: its parts would be specks far apart."""
    west, _, east, _ = result.region.bounds
    whole = tuple(one for one in result.results if east - west >= 360.0 or not one.distortion.cut_km)
    return whole or result.results


# ---- formats --------------------------------------------------------------------------------


def _text(result: Recommendation, form: Format) -> str:
    """A recommendation in a format."""
    if form is Format.JSON:
        return json_text(result.to_dict())
    rows = result.rows()
    if form is Format.CSV:
        return csv_text([{key: _finite(value) for key, value in row.items()} for row in rows], ["code"])
    existing, custom = rows[: len(result.results)], rows[len(result.results) :]
    optional = {"against custom": [_loss(row["ratio_to_custom"]) for row in existing]} if custom else {}
    if any(row["cut_km"] for row in existing):
        optional["cuts km"] = [f"{row['cut_km']:,.0f}" for row in existing]
    columns = {
        "code": [row["code"] for row in existing],
        "name": [row["name"] for row in existing],
        "method": [row["method"].replace("_", " ") for row in existing],
        "ranks by": [_figure(row["ranked"]) for row in existing],
        **_figures(existing, result.criterion),
        **optional,
        "covers": [_percent(row["coverage"]) for row in existing],
        "in area": [_percent(row["share_in_area_of_use"]) for row in existing],
        "made for": [_made_for(row) for row in existing],
        "area of use": [_short(row["area_of_use"]) for row in existing],
    }
    designed = {
        "name": [f"custom {row['method']}" for row in custom],
        **_figures(custom, result.criterion),
        "definition": [row["proj"] for row in custom],
    }
    notes = _notes(result)
    if form is Format.MARKDOWN:
        tables = [markdown_text(columns), *([markdown_text(designed)] if custom else [])]
        tables += [markdown_text(_zones(system, result.criterion)) for system in result.zones]
        return "\n".join(tables) + "\n" + "\n".join(f"- {note}" for note in notes) + "\n"
    title = f"{result.region.name} ({result.region.area_km2:,.0f} km2), {result.purpose}, by {result.criterion}"
    tables = [table_text(columns, title), *([table_text(designed, "")] if custom else [])]
    tables += [table_text(_zones(system, result.criterion), _zones_title(system)) for system in result.zones]
    return "".join(tables) + notes_text(notes)


def _figures(rows: list[dict[str, Any]], criterion: str) -> dict[str, list[str]]:
    """The columns of figures."""
    return {
        criterion: [_figure(row["value"], row.get(f"{criterion}_error", 0.0)) for row in rows],
        "ppm max": [_figure(row["max_scale_error_ppm"], row["max_scale_error_ppm_error"]) for row in rows],
        "ppm mean": [_figure(row["mean_scale_error_ppm"]) for row in rows],
        "omega max": [_figure(row["max_omega"], row["max_omega_error"], 1e-6) for row in rows],
        "areal scale": [_span(row) for row in rows],
        "keeps": [row["keeps"] or "-" for row in rows],
    }


def _zones(system: ZoneSystem, criterion: str) -> dict[str, list[str]]:
    """The columns of a system of zones."""
    figures = {
        "in area": [_percent(zone.share) for zone in system.zones],
        criterion: [_figure(zone.value) for zone in system.zones],
        "ppm max": [_figure(zone.max_scale_error_ppm) for zone in system.zones],
    }
    return {"code": [zone.code for zone in system.zones], "zone": [zone.name for zone in system.zones]} | figures


def _zones_title(system: ZoneSystem) -> str:
    """How many zones there are, whose, and what they are off by at most."""
    whose = "national zones" if system.national else "zones of the world"
    return f"{len(system.zones)} {whose}, each in its part at most {_figure(system.max_scale_error_ppm)} ppm"


def _notes(result: Recommendation) -> list[str]:
    """What the columns mean, which CRSs draw the same map, and how many are none."""
    notes = [
        *result.notes,
        "ppm: |scale - 1| in parts per million; omega: angular deformation in degrees; keeps: to 0.1 ppm, as measured; "
        "in area: the share of the region in the CRS's area of use.",
    ]
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


def _kind(reason: str) -> str:
    """What sort of reason it is."""
    if reason.startswith("Its area of use"):
        return "whose area of use holds too little of the region"
    if reason.startswith("It can be projected"):
        return "that project too little of it"
    if reason == INTERRUPTED:
        return "that are interrupted"
    return "on a sphere" if reason.startswith(OF_A_SPHERE) else "that PROJ cannot compute"


def _figure(value: float, error: float = 0.0, rounding: float = 0.0) -> str:
    """Five significant digits at most, as the error allows; what is below the rounding is 0."""
    if value != value:
        return "-"
    if value == float("inf"):
        return "inf"
    return "0" if abs(value) < rounding else certain(value, error)


def _loss(ratio: float | None) -> str:
    """What a map is worse, as a share of the best."""
    return "-" if ratio is None or not abs(ratio) < float("inf") else f"{100 * (ratio - 1):+.2f} %"


def _span(row: dict[str, Any]) -> str:
    """`0.99920 .. 1.00426`, with fewer decimals where the errors ask for it."""
    ends = ((row[f"{end}_areal_scale"], row[f"{end}_areal_scale_error"]) for end in ("min", "max"))
    return " .. ".join("inf" if value == float("inf") else rounded(value, max(error, 1e-5)) for value, error in ends)


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def _made_for(row: dict[str, Any]) -> str:
    """Whose a map is, as far as that counts."""
    return "national" if row["national"] else "continent or world" if row["wide"] else ""


def _short(text: str) -> str:
    """The beginning of a text, to its first full stop or for 40 characters."""
    beginning = text.partition(". ")[0].rstrip(".")
    return beginning if len(beginning) <= 40 else f"{beginning[:37].rstrip()}..."


def _finite(value: Any) -> Any:
    """A cell of CSV; infinite and undefined ones are empty."""
    return "" if isinstance(value, float) and not abs(value) < float("inf") else value
