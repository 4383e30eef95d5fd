"""Completion of words in shells."""

import os
import pty
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
import typer
from commands import refused, run_ok

from projdist.cli.app import COMMANDS, app, candidates
from projdist.matrices import MEASURES
from projdist.projections import projection_names

ROOT = typer.main.get_command(app)


BEGUN = {
    "wor": ["world-map"],
    "--v": ["--version"],
    "nosuch|": [],
    "compare|robin|--mea": ["--measure"],
    "recommend|co": ["country:", "continent:"],
    "info|robin|-r|co": ["country:", "continent:"],
    "recommend|st": ["state:"],
    "info|robin|-o|": [],
    "find|utm": [],
    "info|--format|": ["table", "json", "csv", "markdown", "html"],
    "heatmap|robin|--grid|": ["map", "lonlat"],
    "list|": ["projections", "measures", "figures", "criteria", "indices", "regions"],
    "completion|": ["bash", "zsh", "fish"],
    "info|": list(projection_names()),
    "compare|robin|": list(projection_names()),
    "compare|robin|-m|": list(MEASURES),
}


def test_commands() -> None:
    """All of them, those that begin so, and the options beside them; regions by their kinds, and no files."""
    assert candidates(ROOT, [""]) == candidates(ROOT, []) == list(COMMANDS)
    for words, found in BEGUN.items():
        assert candidates(ROOT, words.split("|")) == found
    assert {"--region", "--output", "--help"} <= set(candidates(ROOT, ["info", "-"]))


def test_scripts() -> None:
    """Each says where it goes; other shells are refused."""
    for shell in ("bash", "zsh", "fish"):
        assert f"projdist completion {shell}" in run_ok("completion", shell)
    assert "Invalid shell 'tcsh'. It must be bash, zsh or fish." in refused("completion", "tcsh")


TYPED = {"wor": "world-map", "info --reg": "--region", "factors winkel-t": "winkel-tripel"}


def installed(folder: Path) -> dict[str, str]:
    """The environment of a shell that finds the command of this Python."""
    (folder / "projdist").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m projdist "$@"\n')
    (folder / "projdist").chmod(0o755)
    return os.environ | {"PATH": f"{folder}:{os.environ['PATH']}", "HOME": str(folder), "TERM": "dumb", "PS1": "> "}


def typed_in(shell: str, setup: str, line: str, folder: Path) -> str:
    """What stands on the command line of an interactive shell after a tab."""
    ours, theirs = pty.openpty()
    streams = {"stdin": theirs, "stdout": theirs, "stderr": theirs}
    process = subprocess.Popen(shell.split(), **streams, env=installed(folder), cwd=folder, start_new_session=True)
    os.close(theirs)
    try:
        os.write(ours, f"{setup}; echo rea''dy\n".encode())
        _read_until(ours, "ready")
        os.write(ours, f"projdist {line}\t".encode())
        return _read_until(ours, TYPED[line])
    finally:
        process.kill()
        process.wait()
        os.close(ours)


def _read_until(terminal: int, word: str, seconds: float = 60.0) -> str:
    sent, end = b"", time.monotonic() + seconds
    while word not in sent.decode(errors="replace") and time.monotonic() < end:
        if select.select([terminal], [], [], 0.1)[0]:
            sent += os.read(terminal, 4096)
    return sent.decode(errors="replace")


SHELLS = {
    "bash": ("bash --norc --noprofile -i", 'eval "$(projdist completion bash)"'),
    "zsh": ("zsh -f -i", 'autoload -U compinit; compinit -u; eval "$(projdist completion zsh)"'),
}


@pytest.mark.slow
@pytest.mark.parametrize("line", TYPED)
@pytest.mark.parametrize("shell", SHELLS)
def test_a_shell_completes(shell: str, line: str, tmp_path: Path) -> None:
    """A command, an option and a name, by a tab in a terminal."""
    if shutil.which(shell) is None:
        pytest.skip(f"needs {shell}")
    assert TYPED[line] in typed_in(*SHELLS[shell], line, tmp_path)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("fish") is None, reason="needs fish")
@pytest.mark.parametrize("line", TYPED)
def test_fish_completes(line: str, tmp_path: Path) -> None:
    asked = f"projdist completion fish | source; complete --do-complete 'projdist {line}'"
    done = subprocess.run(["fish", "-c", asked], capture_output=True, text=True, env=installed(tmp_path), timeout=120)
    assert TYPED[line] in [word.split("\t")[0] for word in done.stdout.split("\n")]
