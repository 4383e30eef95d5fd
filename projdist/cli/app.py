"""The command line: its commands, in the order in which its help names them."""

from __future__ import annotations

import io
import os
import sys
import warnings
from collections.abc import Callable
from typing import Annotated

import typer

from projdist import __version__
from projdist.cli.check import check_command
from projdist.cli.clouds import clouds_command
from projdist.cli.compare import compare_command
from projdist.cli.convert import convert_command
from projdist.cli.correct import correct_command
from projdist.cli.design import design_command
from projdist.cli.draw import heatmap_command, tissot_command
from projdist.cli.factors import factors_command
from projdist.cli.ldp import ldp_command
from projdist.cli.lists import list_command
from projdist.cli.mean_map import mean_map_command
from projdist.cli.morph import morph_command
from projdist.cli.mosaic import mosaic_command
from projdist.cli.oldmap import oldmap_command
from projdist.cli.optimize import optimize_command
from projdist.cli.output import emit
from projdist.cli.parser import Command, Commands
from projdist.cli.profile import profile_command
from projdist.cli.published import tables_command
from projdist.cli.recommend import recommend_command
from projdist.cli.world_map import world_map_command
from projdist.support import orderly_end

app = typer.Typer(
    name="projdist",
    cls=Commands,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(wanted: bool) -> None:
    if wanted:
        emit(f"projdist {__version__}\n", None)
        raise typer.Exit


@app.callback(invoke_without_command=True)
def options(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Measure, compare and draw the distortion of any map projection."""
    if context.invoked_subcommand is None:
        sys.stderr.write(f"{context.get_help()}\n")
        raise typer.Exit(2)


_COMMANDS: dict[str, Callable[..., None]] = {
    "compare": compare_command,
    "factors": factors_command,
    "profile": profile_command,
    "tissot": tissot_command,
    "heatmap": heatmap_command,
    "morph": morph_command,
    "recommend": recommend_command,
    "optimize": optimize_command,
    "design": design_command,
    "mean-map": mean_map_command,
    "ldp": ldp_command,
    "world-map": world_map_command,
    "check": check_command,
    "convert": convert_command,
    "correct": correct_command,
    "mosaic": mosaic_command,
    "clouds": clouds_command,
    "oldmap": oldmap_command,
    "tables": tables_command,
    "list": list_command,
}
for _name, _function in _COMMANDS.items():
    # Of many projections or coordinates, `Command` itself tells what is an option that there is not.
    lax = _name in ("compare", "factors", "tissot", "heatmap", "mean-map")
    app.command(_name, cls=Command, context_settings={"ignore_unknown_options": lax})(_function)


def main() -> None:
    """Run the command line."""
    for name in ("stdin", "stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # it was closed: nothing to read, nobody to read it
            setattr(sys, name, io.StringIO())
        elif isinstance(stream, io.TextIOWrapper):
            # Bytes that are no text of the locale's encoding are shown as escapes, and stop nothing.
            stream.reconfigure(errors="backslashreplace")
    if not sys.warnoptions:  # of somebody who wants to see them
        warnings.simplefilter("ignore")  # what libraries warn of is for programmers; our own notices are said
        _part_from_libraries()
    with orderly_end():
        app()


def _part_from_libraries() -> None:
    """Leave the standard error to Python: what C libraries write there, as libtiff of a broken picture, is lost."""
    stream = sys.stderr
    named = any(name in word for word in sys.argv for name in ("/dev/stderr", "/fd/2"))  # it is to be written to
    if named or not isinstance(stream, io.TextIOWrapper):
        return
    stream.flush()
    own = os.dup(stream.fileno())
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
    sys.stderr = open(own, "w", buffering=1, encoding=stream.encoding, errors=stream.errors)  # noqa: SIM115
