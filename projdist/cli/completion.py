"""Completion of words in shells: the scripts of the command `completion`, and what they ask for."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Sequence
from typing import Annotated, Any

import typer

from projdist.cli.errors import refuse

ASKED = "PROJDIST_COMPLETE"
"""The variable of the environment by which a script asks for the words that may stand last on the command line."""

_BASH = f"""\
# eval "$(projdist completion bash)" in ~/.bashrc
_projdist_completion() {{
    local IFS=$'\\n'
    COMPREPLY=($({ASKED}=1 "$1" "${{COMP_WORDS[@]:1:COMP_CWORD}}" 2>/dev/null))
    if [[ ${{#COMPREPLY[@]}} == 1 && ${{COMPREPLY[0]}} == *: ]]; then
        compopt -o nospace
    fi
}}
complete -o bashdefault -o default -F _projdist_completion projdist
"""
_ZSH = f"""\
#compdef projdist
# eval "$(projdist completion zsh)" in ~/.zshrc, below compinit
_projdist() {{
    local -a found
    found=("${{(@f)$({ASKED}=1 "${{words[1]}}" "${{(@)words[2,CURRENT]}}" 2>/dev/null)}}")
    if [[ -n "${{found[1]}}" ]]; then
        compadd -S '' -- ${{(M)found:#*:}}
        compadd -- ${{found:#*:}}
    else
        _files
    fi
}}
compdef _projdist projdist
"""
_FISH = f"""\
# projdist completion fish > ~/.config/fish/completions/projdist.fish
function __projdist_completion
    set -l given (commandline -opc) (commandline -ct)
    {ASKED}=1 $given[1] $given[2..] 2>/dev/null
end
complete -c projdist -a '(__projdist_completion)'
"""
_SCRIPTS = {"bash": _BASH, "zsh": _ZSH, "fish": _FISH}
_REGIONS = (
    *("globe", "land", "ocean", "box:", "cap:", "country:", "continent:", "state:", "crs:", "file:"),
    *("geodesic:", "points:"),
)
_CHOICE = re.compile(r"[\w-]+(\|[\w-]+)+")


def completion_command(
    shell: Annotated[str, typer.Argument(metavar="bash|zsh|fish", help="The shell that the script is for.")],
) -> None:
    """Print the script that completes commands, options and names in a shell; its first lines tell where it goes."""
    if shell not in _SCRIPTS:
        refuse(f"Invalid shell '{shell}'. It must be bash, zsh or fish.")
    sys.stdout.write(_SCRIPTS[shell])


def candidates(commands: Any, words: Sequence[str]) -> list[str]:
    """What the last of the words may become; nothing where that is a file, or anything."""
    *before, last = words or [""]
    name = next((word for word in before if not word.startswith("-")), "")
    if not name:
        return _beginning(last, ["--help", "--version"] if last.startswith("-") else commands.commands)
    if name not in commands.commands:
        return []
    command = commands.commands[name]
    options = {text: one for one in command.params if one.param_type_name == "option" for text in one.opts}
    previous = options.get(before[-1]) if before else None
    if previous is not None and not previous.is_flag:
        return _beginning(last, _values(previous))
    if last.startswith("-"):
        long = [text for text in options if text.startswith("--")]
        return _beginning(last, [*long, "--help"])
    arguments = [one for one in command.params if one.param_type_name == "argument"]
    place = sum(not word.startswith("-") for word in before) - 1
    if not arguments:
        return []
    return _beginning(last, _values(arguments[min(place, len(arguments) - 1)]))


def _beginning(text: str, words: Iterable[str]) -> list[str]:
    return [word for word in dict.fromkeys(words) if word.startswith(text)]


def _values(parameter: Any) -> Iterable[str]:
    """The words that a parameter takes, as far as they can be listed."""
    what = parameter.metavar or ""
    if _CHOICE.fullmatch(what):
        return what.split("|")
    # Each of these loads what it lists.
    if what.startswith("PROJECTION") or parameter.name == "against":
        from projdist.projections import projection_names

        return projection_names()
    if what == "REGION" or parameter.name == "region":
        return _REGIONS
    if parameter.name == "measure":
        from projdist.matrices import MEASURES

        return MEASURES
    if parameter.name == "criterion":
        from projdist.field import FIGURES

        return FIGURES
    return ()
