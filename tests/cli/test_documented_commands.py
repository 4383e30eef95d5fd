"""Commands in the README and the documentation: there are such commands, and they have such options."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

from tables import each
from typer.main import get_command

from projdist.cli.app import app

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
_BLOCK = re.compile(r"^```(?:sh|text)\n(.*?)^```", re.MULTILINE | re.DOTALL)
_LINE = re.compile(r"^(?:\$ )?projdist (?:\\\n|.)*", re.MULTILINE)
_INLINE = re.compile(r"`(projdist [^`\n]+)`")


def commands(text: str) -> Iterator[list[str]]:
    """The words of each command, without comments and what it is piped to."""
    for found in [*_LINE.findall("\n".join(_BLOCK.findall(text))), *_INLINE.findall(text)]:
        line = found.removeprefix("$ ").replace("\\\n", " ").split(" | ")[0].split(" > ")[0]
        yield shlex.split(line, comments=True)[1:]


@each("page", PAGES)
def test_commands_are_those_that_there_are(page: Path) -> None:
    group = get_command(app)
    for words in commands(page.read_text(encoding="utf-8")):
        name = words[0].rstrip(",")
        if name.isupper() or name.startswith("-"):
            continue
        command = group.commands[name]
        options = {"--help", "-h", *(option for one in command.params for option in [*one.opts, *one.secondary_opts])}
        used = {word.partition("=")[0] for word in words if re.fullmatch(r"--?[a-z][\w-]*(=.*)?", word)}
        assert used <= options, (name, used - options)


def test_there_are_some() -> None:
    """The patterns find commands in blocks and in lines of text."""
    text = "```sh\nprojdist compare a b \\\n  -r globe  # it's\n```\nor `projdist list figures`, `projdist ldp REGION`."
    assert [*commands(text)] == [["compare", "a", "b", "-r", "globe"], ["list", "figures"], ["ldp", "REGION"]]
