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
from tables import each

from projdist.cli.app import COMMANDS, app, candidates
from projdist.matrices import MEASURES
from projdist.projections import projection_names

ROOT = typer.main.get_command(app)


def test_commands() -> None:
    """All of them, those that begin so, and the options beside them."""
    assert candidates(ROOT, [""]) == candidates(ROOT, []) == list(COMMANDS)
    assert candidates(ROOT, ["wor"]) == ["world-map"]
    assert candidates(ROOT, ["--v"]) == ["--version"]
    assert candidates(ROOT, ["nosuch", ""]) == []
    assert candidates(ROOT, ["compare", "robin", "--mea"]) == ["--measure"]
    assert {"--region", "--output", "--help"} <= set(candidates(ROOT, ["info", "-"]))


VALUES = {
    "info --format": ["table", "json", "csv", "markdown", "html"],
    "heatmap robin --grid": ["map", "lonlat"],
    "list": ["projections", "measures", "figures", "criteria", "indices", "regions"],
    "completion": ["bash", "zsh", "fish"],
    "info": list(projection_names()),
    "compare robin": list(projection_names()),
    "compare robin -m": list(MEASURES),
}


@each("line", VALUES)
def test_values(line: str) -> None:
    """Of options and arguments whose words can be listed."""
    assert candidates(ROOT, [*line.split(), ""]) == VALUES[line]


def test_regions_and_files() -> None:
    assert candidates(ROOT, ["recommend", "co"]) == candidates(ROOT, ["info", "robin", "-r", "co"])
    assert candidates(ROOT, ["recommend", "co"]) == ["country:", "continent:"]
    assert candidates(ROOT, ["recommend", "st"]) == ["state:"]
    assert candidates(ROOT, ["info", "robin", "-o", ""]) == []
    assert candidates(ROOT, ["find", "utm"]) == []


def test_scripts() -> None:
    """Each says where it goes; other shells are refused."""
    for shell in ("bash", "zsh", "fish"):
        assert f"projdist completion {shell}" in run_ok("completion", shell)
    assert "Invalid shell 'tcsh'. It must be bash, zsh or fish." in refused("completion", "tcsh")


TYPED = {
    "projdist wor\t": "world-map",
    "projdist info --reg\t": "--region",
    "projdist factors winkel-t\t": "winkel-tripel",
}


def typed_in(shell: str, setup: str, line: str, folder: Path) -> str:
    """What stands on the command line of an interactive shell after a tab."""
    ours, theirs = pty.openpty()
    (folder / "projdist").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m projdist "$@"\n')
    (folder / "projdist").chmod(0o755)
    environment = os.environ | {
        "PATH": f"{folder}:{os.environ['PATH']}",
        "HOME": str(folder),
        "TERM": "dumb",
        "PS1": "> ",
    }
    process = subprocess.Popen(
        shell.split(), stdin=theirs, stdout=theirs, stderr=theirs, env=environment, cwd=folder, start_new_session=True
    )
    os.close(theirs)
    try:
        os.write(ours, f"{setup}; echo rea''dy\n".encode())
        _read_until(ours, "ready")
        os.write(ours, line.encode())
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
    (tmp_path / "projdist").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m projdist "$@"\n')
    (tmp_path / "projdist").chmod(0o755)
    asked = f"projdist completion fish | source; complete --do-complete '{line.rstrip()}'"
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "HOME": str(tmp_path)}
    done = subprocess.run(["fish", "-c", asked], capture_output=True, text=True, env=environment, timeout=120)
    assert TYPED[line] in [word.split("\t")[0] for word in done.stdout.split("\n")]
