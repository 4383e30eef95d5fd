"""The command line: its parser, its commands in the order of its help, and completion in shells."""

import contextlib
import difflib
import functools
import gc
import inspect
import io
import logging
import os
import re
import sys
import warnings
from collections import UserDict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from importlib.resources import files
from typing import Annotated, Any, get_type_hints

import typer
from typer.core import TyperCommand, TyperGroup

from projdist import __version__, field, matrices, projections, support
from projdist.cli.errors import notices_said, refuse, without_progress

# Raised by typer for a wrong command line. Some versions of typer contain click, others import it.
_UsageError: type[Exception] = typer.BadParameter.__mro__[1]

_NEGATIVE = re.compile(r"-[\d.]")
_INFINITE = re.compile(r"-inf(inity)?", re.IGNORECASE)


@contextlib.contextmanager
def _one_line(command: str) -> Iterator[None]:
    """Report a usage error in one line, like every other error."""
    try:
        yield
    except _UsageError as error:
        message = error.format_message() if hasattr(error, "format_message") else str(error)
        refuse(f"{message}{'' if message.endswith(('.', '?')) else '.'} See '{command} --help'.", error)


class Command(TyperCommand):
    """A command that refuses unknown options among its arguments, unless they are numbers."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """`[OPTIONS] REGION [NAME...]`, the same in all versions of typer."""
        arguments = [one for one in self.get_params(ctx) if one.param_type_name == "argument"]
        return ["[OPTIONS]", *(_name(one) if one.required else f"[{_name(one)}]" for one in arguments)]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the help of arguments and options, without Python's types, which newer versions of typer add."""
        from projdist.cli.options import STYLE  # the command has loaded it

        rows: dict[str, list[tuple[str, str]]] = {"Arguments": [], "Options": [], "Style of pictures": []}
        for one in self.get_params(ctx):
            if record := one.get_help_record(ctx):
                if one.param_type_name == "argument":
                    rows["Arguments"].append((_name(one), record[1]))
                else:
                    rows["Style of pictures" if one.name in STYLE else "Options"].append(record)
        for title, lines in rows.items():
            if lines:
                with formatter.section(title):
                    formatter.write_dl(lines)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words after the command's name."""
        options = [name for parameter in self.params for name in parameter.opts if name.startswith("-")]
        # A leading space keeps -inf, unless it is an option's value, from being parsed as options -i, -n and -f.
        pairs = zip(["", *args], args, strict=False)
        words = [f" {word}" if _INFINITE.fullmatch(word) and last not in options else word for last, word in pairs]
        with _one_line(ctx.command_path):
            given = self.make_parser(ctx).parse_args(args=list(words))[-1]
            rest = super().parse_args(ctx, words)
        for parameter in self.params:
            if given.count(parameter) > 1 and not getattr(parameter, "multiple", False):
                refuse(f"Invalid option '{max(parameter.opts, key=len)}'. It must be given once.")
            value = ctx.params[parameter.name] if parameter.param_type_name == "argument" else None
            for word in [value] if isinstance(value, str) else value or []:
                if word.startswith("-") and word != "-" and not _NEGATIVE.match(word):
                    close = difflib.get_close_matches(word.partition("=")[0], options, n=1, cutoff=0.75)
                    hint = f"Did you mean {close[0]}? " if close else ""
                    refuse(f"Invalid option '{word}'. {hint}See '{ctx.command_path} --help'.")
        return rest


def _name(argument: Any) -> str:
    """Name of an argument in the help."""
    name = str(argument.metavar or argument.name.upper())
    return name[1:-1] if name.startswith("[") else name


# ---- completion ----------------------------------------------------------------------------------


ASKED = "PROJDIST_COMPLETE"
"""Environment variable by which the scripts `completion.SHELL` ask for candidates for the last word."""

_SHELLS = ("bash", "zsh", "fish")  # each with a script completion.SHELL
_REGIONS = (
    *("globe", "land", "ocean", "box:", "cap:", "country:", "continent:", "area:", "state:", "crs:", "file:"),
    *("polygon:", "geodesic:", "points:"),
)
_CHOICE = re.compile(r"[\w-]+(\|[\w-]+)+")


def completion_command(
    shell: Annotated[str, typer.Argument(metavar="bash|zsh|fish", help="The shell that the script is for.")],
) -> None:
    """Print the script that completes commands, options and names in a shell; its first lines say where it goes."""
    if shell not in _SHELLS:
        refuse(f"Invalid shell '{shell}'. It must be bash, zsh or fish.")
    sys.stdout.write((files("projdist") / "cli" / f"completion.{shell}").read_text(encoding="utf-8"))


def candidates(commands: Any, words: Sequence[str]) -> list[str]:
    """Completions of the last word; none where it may be a file or free text."""
    *before, last = words or [""]
    name = next((word for word in before if not word.startswith("-")), "")
    found: Iterable[str] = ()
    if not name:
        found = ["--help", "--version"] if last.startswith("-") else commands.commands
    elif name in commands.commands:
        command = commands.commands[name]
        options = {text: one for one in command.params if one.param_type_name == "option" for text in one.opts}
        arguments = [one for one in command.params if one.param_type_name == "argument"]
        place = sum(not word.startswith("-") for word in before) - 1
        previous = options.get(before[-1])
        if previous is not None and not previous.is_flag:
            found = _values(previous)
        elif last.startswith("-"):
            found = [*(text for text in options if text.startswith("--")), "--help"]
        elif arguments:
            found = _values(arguments[min(place, len(arguments) - 1)])
    return [word for word in dict.fromkeys(found) if word.startswith(last)]


def _values(parameter: Any) -> Iterable[str]:
    """Values of a parameter that can be listed."""
    what = parameter.metavar or ""
    if _CHOICE.fullmatch(what):
        return what.split("|")
    # Each of these loads what it lists.
    if what.startswith("PROJECTION") or parameter.name == "against":
        return projections.projection_names()
    if what == "REGION" or parameter.name == "region":
        return _REGIONS
    if parameter.name == "measure":
        return matrices.MEASURES
    if parameter.name == "criterion":
        return field.FIGURES
    return ()


COMMANDS = {
    "info": ("info", "What a projection is, what it keeps, and its errors."),
    "find": ("info", "CRSs by words in their names, areas of use, or codes."),
    "compare": ("compare", "Several maps of a region, ranked by distortion."),
    "factors": ("factors", "Scales, angles and other measures at points."),
    "profile": ("factors", "Scale, convergence and other measures along a line."),
    "check": ("data", "Errors of areas, lengths and bearings of your data."),
    "tissot": ("draw", "Draw Tissot's indicatrices."),
    "heatmap": ("draw", "Draw a measure as a field of colour, or as a GeoTIFF."),
    "morph": ("draw", "Make an animation of one map flowing into another."),
    "explore": ("draw", "Live maps in a browser, to drag and tune."),
    "tables": ("info", "A published table beside the same figures, recomputed."),
    "list": ("info", "The names of projections, measures, criteria or indices."),
    "recommend": ("recommend", "The best existing CRSs for a region, by measurement."),
    "atlas": ("recommend", "The same for 400 places at once, measured in advance."),
    "optimize": ("optimize", "The best parameters of one of PROJ's projections."),
    "design": ("designs", "A new projection, made for a region, as a CRS."),
    "ldp": ("optimize", "A low-distortion projection, for surveying on the ground."),
    "mean-map": ("designs", "The map that is nearest to several maps."),
    "world-map": ("designs", "A new map of the world, for the parts that matter to you."),
    "correct": ("optimize", "The linear map that reduces a map's distortion most."),
    "convert": ("data", "Layers and rasters in another CRS, even one you made."),
    "mosaic": ("registration", "Bring overlapping images into a common frame."),
    "clouds": ("registration", "Register point clouds or landmarks by affine maps."),
    "oldmap": ("oldmap", "The distortion of an old map, from control points."),
    "completion": ("app", "The script for completion in bash, zsh or fish."),
}
"""Commands, each with the module of its function and its line in the help, which loads none of the modules."""

_GROUPS = {"info": "Look", "recommend": "Choose", "optimize": "Make", "mosaic": "Beyond maps"}
"""The groups of help, by their first commands."""

# Arguments of these may begin with "-": click passes unknown options on, and `Command` refuses them.
_LAX = ("compare", "factors", "tissot", "heatmap", "mean-map")


class _Commands(TyperGroup):
    """The group of all commands, each loaded on first use: loading all takes 0.1 s."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.commands = _Loading(dict.fromkeys(COMMANDS))

    def make_context(self, info_name: str | None, args: list[str], *others: Any, **extra: Any) -> Any:
        """Parse the options before the command."""
        with _one_line("projdist"):
            return super().make_context(info_name, args, *others, **extra)

    def invoke(self, ctx: Any) -> Any:
        """Parse and run the command."""
        with _one_line("projdist"):
            return super().invoke(ctx)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """List the commands without loading their modules."""
        names = [*COMMANDS]
        firsts = [names.index(first) for first in _GROUPS]
        for title, start, end in zip(_GROUPS.values(), firsts, [*firsts[1:], None], strict=True):
            with formatter.section(title):
                formatter.write_dl([(name, COMMANDS[name][1]) for name in names[start:end]])


class _Loading(UserDict[str, Any]):
    """Commands by name, loaded on first use."""

    def __getitem__(self, name: str) -> Any:
        if self.data[name] is None:
            function = getattr(import_module(f"projdist.cli.{COMMANDS[name][0]}"), f"{name.replace('-', '_')}_command")
            alone = typer.Typer(add_completion=False, rich_markup_mode=None, context_settings=_HELP)
            settings = _HELP | {"ignore_unknown_options": name in _LAX}
            alone.command(name, cls=Command, context_settings=settings)(_with_groups(function))
            self.data[name] = typer.main.get_command(alone)
        return self.data[name]


_DETAILS = Annotated[bool, typer.Option("--details", help="Print all rows, columns and notes.")]
_QUIET = Annotated[bool, typer.Option("--quiet", help="Show no progress on standard error.")]


def _with_groups(function: Any) -> Any:
    """The function, with the fields of its option groups (dataclasses) as parameters in place of the groups."""
    # A parameter of the function replaces a field of the same name, and supplies its value. All commands have
    # `--quiet`, and those with `--format` have `--details`, which is the format of that name.
    given = inspect.signature(function, eval_str=True).parameters
    groups: dict[str, Any] = {name: one.annotation for name, one in given.items() if is_dataclass(one.annotation)}
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    parameters = {name: one.replace(kind=kind) for name, one in given.items() if name not in groups}
    own = set(parameters)
    for group in groups.values():
        hints = get_type_hints(group, include_extras=True)
        for one in fields(group):
            shared = inspect.Parameter(one.name, kind, default=one.default, annotation=hints[one.name])
            parameters.setdefault(one.name, shared)
    flags = {"details": _DETAILS, "quiet": _QUIET} if "format" in parameters else {"quiet": _QUIET}
    for name, annotation in flags.items():
        parameters[name] = inspect.Parameter(name, kind, default=False, annotation=annotation)

    @functools.wraps(function)
    def command(**words: Any) -> None:
        if words.get("details") and words["format"] in (None, "table"):  # the other formats have all
            words["format"] = "details"
        made = {name: group(**{one.name: words[one.name] for one in fields(group)}) for name, group in groups.items()}
        with notices_said(), without_progress(words["quiet"]):
            function(**{name: words[name] for name in own}, **made)

    command.__signature__ = inspect.Signature([*parameters.values()])  # type: ignore[attr-defined]
    command.__annotations__ = {name: one.annotation for name, one in parameters.items()}
    return command


_FIRST_COLLECTION = 100_000  # objects; with Python's 700, collections while libraries load take 0.3 s and free nothing
_HELP = {"help_option_names": ["-h", "--help"]}
app = typer.Typer(
    name="projdist",
    cls=_Commands,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings=_HELP,
)


@app.callback(invoke_without_command=True)
def options(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
) -> None:
    """Measure, compare and draw the distortion of any map projection."""
    if version:
        from projdist.cli.report import emit

        emit(f"projdist {__version__}\n", None)
        raise typer.Exit
    if context.invoked_subcommand is None:
        sys.stderr.write(f"{context.get_help()}\n")
        raise typer.Exit(2)


def main() -> None:
    """Run the command line."""
    for name in ("stdin", "stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed by the caller
            setattr(sys, name, io.StringIO())
        elif isinstance(stream, io.TextIOWrapper):
            # Bytes outside the locale's encoding are printed as escapes.
            stream.reconfigure(errors="backslashreplace")
    if not sys.warnoptions:  # unless the user asks to see them
        warnings.simplefilter("ignore")  # libraries warn programmers; our own notices are printed
        logging.getLogger().addHandler(logging.NullHandler())  # likewise their log
        _keep_stderr_from_libraries()
    gc.set_threshold(_FIRST_COLLECTION)
    with support.orderly_end():
        if os.environ.get(ASKED):
            words = candidates(typer.main.get_command(app), sys.argv[1:])
            sys.stdout.write("".join(f"{word}\n" for word in words))
        else:
            app()


def _keep_stderr_from_libraries() -> None:
    """Discard what C libraries write to standard error, as libtiff does on a broken picture."""
    stream = sys.stderr
    named = any(name in word for word in sys.argv for name in ("/dev/stderr", "/fd/2"))  # the user writes to it
    if named or not isinstance(stream, io.TextIOWrapper):
        return
    stream.flush()
    own = os.dup(stream.fileno())
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
    sys.stderr = open(own, "w", buffering=1, encoding=stream.encoding, errors=stream.errors)  # noqa: SIM115
