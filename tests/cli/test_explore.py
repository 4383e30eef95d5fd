"""`projdist explore`: what it prints and refuses, and that it leaves no process, however it ends."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")
pytest.importorskip("websockets")
pytest.importorskip("termios", reason="pseudo-terminals and signals of Unix")
from commands import refusal
from live_pages import Command, asked, descendants, ended, exploring, is_running, page
from refusals import says, wrong_words
from terminals import in_terminal

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("default_signals")]


def test_other_words_are_refused_before_anything_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("projdist.web.open_socket", lambda port: pytest.fail("it listens"))
    for words, code, message in wrong_words("_explore"):
        assert says(message, refusal("explore", *words.split(), code=code))


def test_without_the_extra_or_the_port_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        message = f"Invalid port '{port}'. It cannot be listened on: Address already in use."
        assert refusal("explore", "robinson", "--port", port) == message
    monkeypatch.setitem(sys.modules, "starlette", None)
    message = "The live page needs Starlette, uvicorn and websockets: pip install 'projdist[explore]'."
    assert refusal("explore", "robinson") == message


def test_its_help_loads_nothing_slow() -> None:
    """Neither a server nor what draws."""
    code = (
        "import sys; sys.argv = ['projdist', 'explore', '--help']\n"
        "from projdist.cli import main\n"
        "try: main()\nexcept SystemExit: pass\n"
        "slow = 'starlette uvicorn websockets shapely scipy matplotlib asyncio multiprocessing'\n"
        "print(sorted(set(slow.split()) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("\n[]\n")


def test_it_answers_as_soon_as_its_address_is_printed(tmp_path: Path) -> None:
    """Into a pipe, too; files of the command line are read by its processes; Ctrl-C leaves none of these."""
    path = tmp_path / "part.geojson"
    path.write_text('{"type": "Polygon", "coordinates": [[[0, 0], [10, 0], [10, 10], [0, 0]]]}')
    text = f"file:{path}"
    with exploring("robinson", "--region", text) as command:
        socket.create_connection(("127.0.0.1", command.port)).close()
        with page(command.port, command.token) as one:
            assert asked(one, kind="preview", region=text)["regional"]
            assert "must need no file" in asked(one, kind="preview", region=f"{text} ")["problem"]
            check_end(command, signal.SIGINT)


def check_end(command: Command, number: int) -> None:
    """A signal ends the command in time, without a word, with its exit code, and leaves no process."""
    pids = descendants(command.process.pid)
    assert len(pids) >= 4
    command.process.send_signal(number)
    assert command.process.wait(10) == 128 + number
    assert (command.process.stdout.read(), command.process.stderr.read()) == ("", "")
    assert ended(pids), subprocess.run(["ps", "-ef"], capture_output=True, text=True, check=True).stdout


def processes_of(command: Command) -> list[int]:
    """Those of a command whose page waits for advice, for which there are processes of processes."""
    deadline = time.monotonic() + 60.0
    while len(pids := descendants(command.process.pid)) < 7 and time.monotonic() < deadline:
        time.sleep(0.02)
    assert len(pids) >= 7 or os.cpu_count() == 1
    return pids


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGKILL"])
def test_signals_leave_no_process(name: str) -> None:
    """Also where the command is killed and its processes have to see that themselves."""
    with exploring("robinson") as command, page(command.port, command.token) as one:
        one.send('{"id": 1, "kind": "recommend", "region": "country:BR"}')
        pids = processes_of(command)
        if name == "SIGKILL":
            command.process.kill()
            command.process.wait()
            assert ended(pids)
        else:
            check_end(command, getattr(signal, name))


def of_session(pid: int) -> list[int]:
    """The processes of a session that are left."""
    left = subprocess.run(["ps", "-s", str(pid), "-o", "pid="], capture_output=True, text=True, check=False)
    return [*map(int, left.stdout.split())]


@pytest.mark.parametrize("delay", [0.3, 1.2, 2.0, 3.0])
@pytest.mark.parametrize("name", ["SIGINT", "SIGHUP"])
def test_it_is_ended_in_a_terminal(name: str, delay: float) -> None:
    """At any time: by Ctrl-C or as the terminal is closed; nothing is said but the address."""
    number = getattr(signal, name)
    screen = in_terminal("explore", "--no-browser", "robinson", kill=(delay, number))
    assert screen.code == 128 + number
    assert all(line.startswith("http://127.0.0.1:") for line in screen.lines if line), screen.text
    time.sleep(3.0)
    assert not [pid for pid in of_session(screen.pid) if is_running(pid)]


def test_an_output_that_is_closed_leaves_no_process() -> None:
    """As that of `projdist explore | true`."""
    command = [sys.executable, "-m", "projdist", "explore", "--no-browser", "robinson"]
    reading, writing = os.pipe()
    os.close(reading)
    with subprocess.Popen(command, stdout=writing, stderr=subprocess.PIPE, start_new_session=True) as process:
        os.close(writing)
        process.wait(30)
    assert ended(of_session(process.pid))


def test_a_browser_in_the_terminal_has_its_page(tmp_path: Path) -> None:
    """One that stays there, as lynx does, is answered while it runs."""
    script = tmp_path / "browser"
    script.write_text(
        f"#!{sys.executable}\nimport sys, urllib.request\n"
        "text = urllib.request.urlopen(sys.argv[1].split('#')[0], timeout=20).read()\n"
        f"open({str(tmp_path / 'seen')!r}, 'wb').write(text)\n"
    )
    script.chmod(0o755)
    command = [sys.executable, "-m", "projdist", "explore", "robinson"]
    environment = os.environ | {"BROWSER": f"{script} %s"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment) as process:
        deadline = time.monotonic() + 30.0
        while not (tmp_path / "seen").exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        process.terminate()
        process.communicate(timeout=10)
    assert b"<title>projdist explore</title>" in (tmp_path / "seen").read_bytes()


def test_two_pages_do_not_disturb_each_other() -> None:
    """One is closed while it waits for advice, whose process is ended; the other hears nothing of that."""
    with exploring("robinson") as command, page(command.port, command.token) as one:
        with page(command.port, command.token) as other:
            other.send('{"id": 9, "kind": "recommend", "region": "country:BR"}')
            assert [asked(one, id=number, kind="preview")["id"] for number in range(20)] == [*range(20)]
            assert "problem" not in asked(other, id=3, kind="preview")
        for kind in ("preview", "texts", "figures", "scales"):
            assert "problem" not in asked(one, kind=kind)
        found = asked(one, kind="recommend", region="cap:10,50,50", timeout=120)
        assert len(found["rows"]) > 3
