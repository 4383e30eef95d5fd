"""The command in a pseudo-terminal, as people run it, and what they see there."""

import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from dataclasses import dataclass
from pathlib import Path

from rich.cells import cell_len

Kill = tuple[float, signal.Signals]

_ROWS = 50
_TOKEN = re.compile(r"\x1b\[[?\d;]*[A-Za-z]|\x1b.|[\r\n]|[^\x1b\r\n]+", re.DOTALL)
_COLOUR = re.compile(r"\x1b\[[\d;]*m")


@dataclass(frozen=True)
class Screen:
    """What a command left: its exit code, what the terminal was sent, and its process."""

    code: int
    sent: str
    pid: int

    @property
    def colours(self) -> list[str]:
        """The escape codes of colours and weights."""
        return _COLOUR.findall(self.sent)

    @property
    def lines(self) -> list[str]:
        """What stays to be read, without colours, in lines as they were written, however long."""
        return [line.rstrip() for line in _drawn(self.sent)]

    @property
    def text(self) -> str:
        """The lines as one text."""
        return "\n".join(self.lines)

    @property
    def widest(self) -> int:
        """Cells of the longest line that was written, also of those that were drawn over."""
        return max(map(cell_len, re.split(r"[\r\n]", re.sub(r"\x1b\[[?\d;]*[A-Za-z]", "", self.sent))))


def _drawn(sent: str) -> list[str]:
    """Lines after all carriage returns, and moves up and erasures, which are what progress bars use."""
    lines, row, column = [""], 0, 0
    for token in _TOKEN.findall(sent):
        if token == "\n":
            row += 1
            lines += [""] * (row + 1 - len(lines))
        elif token == "\r":
            column = 0
        elif re.fullmatch(r"\x1b\[\d*A", token):
            row = max(0, row - int(token[2:-1] or 1))
        elif token in ("\x1b[2K", "\x1b[K"):
            lines[row] = "" if token == "\x1b[2K" else lines[row][:column]
        elif not token.startswith("\x1b"):
            lines[row] = lines[row][:column].ljust(column) + token + lines[row][column + len(token) :]
            column += len(token)
    return lines


def in_terminal(
    *words: str,
    columns: int = 80,
    folder: Path | None = None,
    stdout: Path | None = None,
    typed: str = "",
    timeout: float = 120.0,
    kill: Kill | None = None,
    **environment: str,
) -> Screen:
    """Run the command in a terminal so wide; with its standard output in a file if one is named.

    `kill` is a delay in seconds and a signal, which every process of the terminal gets, as after Ctrl-C.
    """
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", _ROWS, columns, 0, 0))
    inherited = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES", "NO_COLOR")}
    with open(stdout or os.devnull, "wb") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", "projdist", *words],
            stdin=theirs,
            stdout=file if stdout else theirs,
            stderr=theirs,
            cwd=folder,
            env=inherited | {"TERM": "xterm-256color"} | environment,
            start_new_session=True,
        )
    os.close(theirs)
    if typed:
        os.write(ours, typed.encode())
    try:
        sent = _read(ours, process, timeout, kill)
    finally:
        os.close(ours)
        if process.poll() is None:
            process.kill()
    return Screen(process.wait(), sent, process.pid)


def _read(ours: int, process: subprocess.Popen[bytes], timeout: float, kill: Kill | None) -> str:
    """All that comes until the last process has closed the terminal; raises TimeoutError."""
    sent, start = b"", time.monotonic()
    while True:
        passed = time.monotonic() - start
        if passed > timeout:
            raise TimeoutError(f"not done after {timeout} s: {sent.decode(errors='replace')}")
        if kill is not None and passed >= kill[0]:
            os.killpg(process.pid, kill[1])
            kill = None
        if select.select([ours], [], [], 0.01)[0]:
            try:
                sent += os.read(ours, 65536)
            except OSError:  # Linux says so where there is no other end
                return sent.decode()
