"""Ending the command: no traceback, the exit code of the signal, nothing left of files and processes."""

import functools
import io
import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("termios", reason="pseudo-terminals and signals of Unix")
from gis_files import some_slow
from tables import each
from terminals import in_terminal

from projdist.cli import app as cli_app, errors
from projdist.support import signals

pytestmark = pytest.mark.usefixtures("default_signals")

WRITING = """
import sys, time
from projdist.support import files
from projdist.cli import app

def write(text, output, overwrite):
    with files.replacing(output, overwrite=overwrite) as new:
        new.write_text("half")
        print("writing", flush=True)
        time.sleep(60)

app.app = lambda: write("", files.Path(sys.argv[1]), True)
app.main()
"""
LOADED = "import projdist, signal; assert signal.getsignal(signal.SIGINT) is signal.default_int_handler"
INTERRUPTED = """
import signal, sys

class Interrupter:
    def find_spec(self, name, *_):
        if name == "projdist.cli.app":
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, Interrupter())
"""


def children(pid: int) -> list[str]:
    """Processes of the session of a terminal that are left."""
    return subprocess.run(
        ["ps", "-s", str(pid), "-o", "pid="], capture_output=True, text=True, check=False
    ).stdout.split()


def started(*words: str, **options: object) -> subprocess.Popen:
    told = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([sys.executable, *words], **told, **options)


@pytest.mark.parametrize("name", some_slow(["SIGTERM", "SIGINT", "SIGHUP"], {"SIGINT", "SIGHUP"}))
def test_a_signal_during_a_write_leaves_the_old_file(name: str, tmp_path: Path) -> None:
    """And nothing beside it, nor a word; the exit code is that of the signal."""
    number, path = getattr(signal, name), tmp_path / "x.txt"
    path.write_text("old")
    with started("-c", WRITING, str(path)) as process:
        assert process.stdout.readline() == "writing\n"
        process.send_signal(number)
        assert process.stderr.read() == ""
    assert process.returncode == 128 + number
    assert {one: one.read_text() for one in tmp_path.iterdir()} == {path: "old"}


@pytest.mark.slow
def test_what_is_ignored_stays_ignored(tmp_path: Path) -> None:
    """Under nohup a command outlives its terminal."""
    code = "import signal\n" + WRITING.replace("time.sleep(60)", "signal.raise_signal(signal.SIGHUP)")
    ignore = functools.partial(signal.signal, signal.SIGHUP, signal.SIG_IGN)
    with started("-c", code, str(tmp_path / "x"), preexec_fn=ignore) as process:
        assert (process.wait(60), process.stderr.read()) == (0, "")
    assert (tmp_path / "x").read_text() == "half"


def test_a_program_keeps_its_signals() -> None:
    """Whoever imports projdist is interrupted by Ctrl-C as before."""
    subprocess.run([sys.executable, "-c", LOADED], check=True)


def test_ctrl_c_while_it_is_loaded(tmp_path: Path) -> None:
    """In the first second nothing is said."""
    (tmp_path / "sitecustomize.py").write_text(INTERRUPTED)
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    screen = in_terminal("--version", PYTHONPATH=path)
    assert (screen.code, screen.text) == (128 + signal.SIGINT, "")


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0.1, 0.2, 0.4, 0.7, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0])
def test_ctrl_c_at_any_time(delay: float, tmp_path: Path) -> None:
    """While all is loaded, CRSs are tried by several processes, a picture is drawn: no word, no process is left."""
    words = ("recommend", "box:5,45,6,46", "-o", str(tmp_path / "x.png"))
    screen = in_terminal(*words, kill=(delay, signal.SIGINT))
    assert screen.code == 0 or (screen.code, screen.text.strip()) == (128 + signal.SIGINT, ""), screen.text
    assert list(tmp_path.glob(".*")) == []
    end = time.monotonic() + 10.0  # on a busy machine the last one takes a moment to end
    while children(screen.pid) and time.monotonic() < end:
        time.sleep(0.1)
    assert children(screen.pid) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_no_workers_are_left(name: str) -> None:
    """Where the signal comes to the command alone, it ends its workers."""
    number = getattr(signal, name)
    with started("-m", "projdist", "recommend", "box:5,45,6,46", start_new_session=True) as process:
        deadline = time.monotonic() + 60.0
        while len(children(process.pid)) < 2 and time.monotonic() < deadline:
            time.sleep(0.05)
        os.kill(process.pid, number)
        assert (process.stdout.read(), process.stderr.read()) == ("", "")
    assert process.returncode == 128 + number
    assert children(process.pid) == []


# ---- in this process -------------------------------------------------------------------------
@each("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_the_work_orderly(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """It raises SystemExit once; a second one does not disturb the cleaning up; after it the process leaves at once."""
    codes: list[object] = []
    monkeypatch.setattr(os, "_exit", codes.append)

    def work() -> None:
        try:
            signal.raise_signal(number)
        finally:
            signal.raise_signal(number)
            codes.append("cleaned")

    with pytest.raises(SystemExit) as ended, signals.orderly_end():
        work()
    assert (ended.value.code, codes) == (128 + number, ["cleaned"])
    signal.raise_signal(number)
    assert codes == ["cleaned", 128 + number]


def test_a_signal_is_not_lost_where_exceptions_are_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in what runs after a fork, or when an object is deleted: it comes once more; other exceptions are told."""
    told: list[object] = []
    monkeypatch.setattr(sys, "__unraisablehook__", lambda lost: told.append(lost.exc_type))

    class Ignoring:
        def __init__(self, work: Callable[[], object]) -> None:
            self.work = work

        def __del__(self) -> None:
            self.work()

    def work() -> None:
        Ignoring(lambda: 1 / 0)
        Ignoring(lambda: signal.raise_signal(signal.SIGTERM))
        time.sleep(10.0)

    with pytest.raises(SystemExit) as ended, signals.orderly_end():
        work()
    assert ended.value.code == 128 + signal.SIGTERM
    assert told == [ZeroDivisionError]


@each("told", [True, False])
def test_another_error_made_of_a_signal(told: bool, capsys: pytest.CaptureFixture[str]) -> None:
    """As libraries in C++ do where a conversion failed: the command ends as it was told, without a word."""

    def work() -> None:
        try:
            signal.raise_signal(signal.SIGINT)
        except SystemExit:
            error = ValueError("Invalid bounding box")
        if told:
            errors.refuse(str(error))
        raise error

    with pytest.raises(SystemExit) as ended, signals.orderly_end():
        work()
    assert (ended.value.code, capsys.readouterr().err) == (128 + signal.SIGINT, "")


def test_workers_have_the_signals_of_the_system() -> None:
    """What ends the command ends them, but for what is ignored."""
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with signals.orderly_end():
        assert signal.getsignal(signal.SIGTERM) not in (signal.SIG_DFL, signal.SIG_IGN)
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
        signals.default_signals()
        assert signal.getsignal(signal.SIGTERM) == signal.getsignal(signal.SIGINT) == signal.SIG_DFL
    assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN


def test_threads_keep_the_signals_as_they_are() -> None:
    """Python lets none but the main thread change them."""

    def look() -> signal.Handlers:
        with signals.orderly_end():
            return signal.getsignal(signal.SIGTERM)

    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(look).result() == signal.getsignal(signal.SIGTERM)


@each(("argv", "words", "expected"), [
    (["/usr/bin/projdist", "list"], ["python", "/usr/bin/projdist", "list"], True),
    *((["-m", "list"], ["python", "-m", "projdist", "list"], True), (["-m"], ["python", "-mprojdist"], True)),
    (["-m", "projdist"], ["python", "-m", "pytest", "projdist"], False),
    *((["program.py"], ["python", "program.py"], False), ([], ["python"], False)),
])  # fmt: skip
def test_what_the_command_is(argv: list[str], words: list[str], expected: bool, monkeypatch: Any) -> None:
    """Python was started as `projdist`, or with its module; not for another one."""
    monkeypatch.setattr(sys, "argv", argv)
    monkeypatch.setattr(sys, "orig_argv", words)
    assert signals._is_command() is expected


def test_what_c_libraries_say_is_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command's own words are not; a closed input is an empty one, and letters that cannot be shown are escaped."""
    path = tmp_path / "stderr"
    monkeypatch.setattr(sys, "stdin", None)
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), encoding="ascii"))
    monkeypatch.setattr(sys, "argv", ["projdist"])
    with open(path, "w", encoding="ascii") as stream, warnings.catch_warnings():

        def command() -> None:
            os.write(stream.fileno(), b"of C")
            sys.stderr.write("ä of Python\n")
            sys.stdout.write("ä\n")
            sys.stdout.flush()
            warnings.warn("of a library", stacklevel=1)
            assert sys.stdin.read() == ""

        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setattr(cli_app, "app", command)
        cli_app.main()
        sys.stderr.close()
        assert sys.stdout.buffer.getvalue() == b"\\xe4\n"
    assert path.read_text() == "\\xe4 of Python\n"
