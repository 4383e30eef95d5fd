"""The parser of the command line: negative numbers without `--`, and errors of one line."""

from __future__ import annotations

import contextlib
import difflib
import re
from collections.abc import Iterator
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from projdist.cli.errors import notices_said, refuse

# What typer raises for a wrong command line. It has its own click in some versions and imports it in others.
_UsageError: type[Exception] = typer.BadParameter.__mro__[1]

_NEGATIVE = re.compile(r"-[\d.]")
_INFINITE = re.compile(r"-inf(inity)?", re.IGNORECASE)


@contextlib.contextmanager
def _one_line(command: str) -> Iterator[None]:
    """Say a usage error in one line, as every other error is said."""
    try:
        yield
    except _UsageError as error:
        message = error.format_message() if hasattr(error, "format_message") else str(error)
        refuse(f"{message}{'' if message.endswith(('.', '?')) else '.'} See '{command} --help'.", error)


class Commands(TyperGroup):
    """The commands."""

    def make_context(self, info_name: str | None, args: list[str], *others: Any, **extra: Any) -> Any:
        """Parse the options before the command."""
        with _one_line("projdist"):
            return super().make_context(info_name, args, *others, **extra)

    def invoke(self, ctx: Any) -> Any:
        """Parse and run the command."""
        with _one_line("projdist"):
            return super().invoke(ctx)


class Command(TyperCommand):
    """A command. Where unknown options reach the arguments, they are refused there if they are no number."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command; what the library warns of is said in one line each."""
        with notices_said():
            return super().invoke(ctx)

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """`[OPTIONS] REGION [NAME...]`, the same whatever typer's version."""
        arguments = [one for one in self.get_params(ctx) if one.param_type_name == "argument"]
        return ["[OPTIONS]", *(_name(one) if one.required else f"[{_name(one)}]" for one in arguments)]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Arguments and options with their help; newer versions of typer write the types of Python beside arguments."""
        rows: dict[str, list[tuple[str, str]]] = {"argument": [], "option": []}
        for one in self.get_params(ctx):
            if record := one.get_help_record(ctx):
                is_argument = one.param_type_name == "argument"
                rows[one.param_type_name].append((_name(one), record[1]) if is_argument else record)
        for kind, lines in rows.items():
            if lines:
                with formatter.section(f"{kind.title()}s"):
                    formatter.write_dl(lines)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words behind the command."""
        options = [name for parameter in self.params for name in parameter.opts if name.startswith("-")]
        words = _protected(args, options)
        with _one_line(ctx.command_path):
            given = self.make_parser(ctx).parse_args(args=list(words))[-1]
            rest = super().parse_args(ctx, words)
        for parameter in self.params:
            if given.count(parameter) > 1 and not getattr(parameter, "multiple", False):
                refuse(f"Invalid option '{max(parameter.opts, key=len)}'. It must be given once.")
            if parameter.param_type_name == "argument":
                _check_arguments(ctx, ctx.params[parameter.name], options)
        return rest


def _name(argument: Any) -> str:
    """What an argument is called in help."""
    name = str(argument.metavar or argument.name.upper())
    return name[1:-1] if name.startswith("[") else name


def _protected(words: list[str], options: list[str]) -> list[str]:
    """Words with a space before `-inf`, which would be the options -i, -n and -f; the value of an option is none."""
    pairs = zip(["", *words], words, strict=False)
    return [f" {word}" if _INFINITE.fullmatch(word) and last not in options else word for last, word in pairs]


def _check_arguments(ctx: Any, value: str | list[str] | None, options: list[str]) -> None:
    """Refuse arguments that look like an option."""
    for word in [value] if isinstance(value, str) else value or []:
        if word.startswith("-") and word != "-" and not _NEGATIVE.match(word):
            close = difflib.get_close_matches(word.partition("=")[0], options, n=1, cutoff=0.75)
            hint = f"Did you mean {close[0]}? " if close else ""
            refuse(f"Invalid option '{word}'. {hint}See '{ctx.command_path} --help'.")
