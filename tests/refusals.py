"""Calls that must be refused, and tables of texts that are."""

import re
import shlex
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest


def refuses(match: str, function: Callable[..., Any], *args: Any, **words: Any) -> None:
    """The call raises ValueError with a message that matches."""
    with pytest.raises(ValueError, match=match):
        function(*args, **words)


def wrong_words(name: str = "") -> Iterator[tuple[str, int, str]]:
    """Command lines of a table of words that are refused, their exit codes, and what the refusals say."""
    first, code = "", 2
    for line in (Path(__file__).parent / "data" / f"wrong_words{name}.txt").read_text(encoding="utf-8").splitlines():
        if not line.startswith(" "):
            first, code = ("", 1) if line == "exit code 1" else (line.removeprefix("projdist"), 2)
            continue
        words, message, *values = line[4:].split(" | ")
        for value in shlex.split(*values) if values else ["-"]:
            words_of_value = words.replace("{}", value or "''")
            yield f"{first} {words_of_value}", code, message.replace("{}", value)


def says(message: str, text: str) -> bool:
    """True if a text begins as a message of such a table."""
    return re.match(re.escape(message).replace("…", ".*").replace(r"\$", "$"), text) is not None
