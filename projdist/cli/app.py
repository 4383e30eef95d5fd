"""The command line: its commands, in the order in which its help names them."""

from __future__ import annotations

import gc
import io
import logging
import os
import sys
import warnings
from collections.abc import Iterator, MutableMapping
from importlib import import_module
from typing import Annotated, Any

import typer

from projdist import __version__
from projdist.cli.completion import ASKED, candidates
from projdist.cli.parser import Command, Commands
from projdist.support import orderly_end

COMMANDS = {
    "info": ("info", "Show what a projection is, what it keeps, and its errors."),
    "find": ("find", "Find CRSs by words of their names, areas of use, or codes."),
    "compare": ("compare", "Compare projections over a region by their distortion."),
    "factors": ("factors", "Scales, angles and other measures at points."),
    "profile": ("profile", "Scale, convergence and other measures along a line."),
    "tissot": ("draw", "Draw Tissot's indicatrices."),
    "heatmap": ("draw", "Draw a measure as a field of colour, or as a GeoTIFF."),
    "morph": ("morph", "Make a film of one map that flows into another."),
    "explore": ("explore", "See maps live in a browser, drag and tune them."),
    "recommend": ("recommend", "Find the best existing CRSs for a region."),
    "atlas": ("atlas", "Show the best maps of a country, measured beforehand."),
    "optimize": ("optimize", "Find the best parameters of a family of projections."),
    "design": ("design", "Make the map that distorts a region least, as a CRS."),
    "mean-map": ("mean_map", "Find the map that is nearest to several maps."),
    "ldp": ("ldp", "Design a low-distortion projection for surveying."),
    "world-map": ("world_map", "Make the map of the world that distorts a region least."),
    "check": ("check", "Check areas, lengths and bearings of data in a CRS."),
    "convert": ("convert", "Transform layers and rasters to another CRS."),
    "correct": ("correct", "Find the linear map that reduces a map's distortion most."),
    "mosaic": ("mosaic", "Bring overlapping images into a common frame."),
    "clouds": ("clouds", "Register point clouds or landmarks by affine maps."),
    "oldmap": ("oldmap", "Measure the distortion of an old map by control points."),
    "tables": ("published", "Print a published table beside figures measured today."),
    "list": ("lists", "List projections, measures, criteria or indices."),
    "completion": ("completion", "Print the script for completion in bash, zsh or fish."),
}
"""The commands, the modules that have their functions, and what help says of them without loading any."""

# Of many projections or coordinates, `Command` itself tells what is an option that there is not.
_LAX = ("compare", "factors", "tissot", "heatmap", "mean-map")


class _Commands(Commands):
    """The commands, each loaded when it is asked for: all of them take 0.1 s."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.commands = _Loading()

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Name the commands; their modules stay unloaded."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, words) for name, (_, words) in COMMANDS.items()])


class _Loading(MutableMapping[str, Any]):
    """Commands by their names."""

    def __init__(self) -> None:
        self._loaded: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._loaded:
            module = import_module(f"projdist.cli.{COMMANDS[name][0]}")
            self[name] = _command(name, getattr(module, f"{name.replace('-', '_')}_command"))
        return self._loaded[name]

    def __setitem__(self, name: str, command: Any) -> None:
        self._loaded[name] = command

    def __delitem__(self, name: str) -> None:
        del self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(COMMANDS)

    def __len__(self) -> int:
        return len(COMMANDS)


def _command(name: str, function: Any) -> Any:
    """A function as a command."""
    alone = typer.Typer(add_completion=False, rich_markup_mode=None, context_settings=_HELP)
    settings = _HELP | {"ignore_unknown_options": name in _LAX}
    alone.command(name, cls=Command, context_settings=settings)(function)
    return typer.main.get_command(alone)


_FIRST_COLLECTION = 100_000  # objects; Python's 700, as libraries load, take 0.3 s, and find nothing
_HELP = {"help_option_names": ["-h", "--help"]}
app = typer.Typer(
    name="projdist",
    cls=_Commands,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings=_HELP,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from projdist.cli.output import emit  # loads rich

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
        logging.getLogger().addHandler(logging.NullHandler())  # and what they log, as matplotlib of a HOME without room
        _part_from_libraries()
    gc.set_threshold(_FIRST_COLLECTION)
    with orderly_end():
        if os.environ.get(ASKED):
            words = candidates(typer.main.get_command(app), sys.argv[1:])
            sys.stdout.write("".join(f"{word}\n" for word in words))
        else:
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
