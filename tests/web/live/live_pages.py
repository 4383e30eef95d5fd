"""Pages of `projdist explore` without a browser: its server, requests over its socket, and workers that misbehave."""

import contextlib
import json
import os
import queue
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pyproj.datadir import get_user_data_dir
from pyproj.network import is_network_enabled

from projdist import factors
from projdist.projections import Projection, ProjectionError
from projdist.web.live.dispatcher import InputPolicy, Request
from projdist.web.live.worker import Worker

ADDRESS = re.compile(r"http://127\.0\.0\.1:(\d+)/#token=([\w-]+)\n")
_TRAPS = ("sleep", "killed", "killed-once", "forks", "forks-and-dies")


def header_of(block: bytes) -> dict[str, Any]:
    """What a reply says, without its arrays."""
    return json.loads(block[4 : 4 + int.from_bytes(block[:4], "little")])


def decoded(block: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The header of a block and its arrays, as a page reads them."""
    header, start = header_of(block), 4 + int.from_bytes(block[:4], "little")
    return header, {
        name: np.frombuffer(block, kind, int(np.prod(shape)), start + offset).reshape(shape)
        for name, (kind, offset, shape) in header["arrays"].items()
    }


def geographic(header: dict[str, Any], u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Longitudes and latitudes of grid coordinates of a frame."""
    if header["axes"] is None:
        return (u + 180.0) % 360.0 - 180.0, v
    u, v = np.radians(u), np.radians(v)
    x, y, z = np.reshape(header["axes"], (3, 3)) @ np.array([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)])
    return np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(z, np.hypot(x, y)))


def right_nodes(
    header: dict[str, Any], arrays: dict[str, np.ndarray], projection: Any, within: float
) -> tuple[float, float]:
    """Share of whole cells, and of random nodes of them those whose a and b are within an error, in logs and ratios."""
    rows, columns = header["shape"]
    whole = np.flatnonzero(np.unpackbits(arrays["whole"])[: rows * columns])
    chosen = np.random.default_rng(1).choice(whole, 300)
    log, _, re, im = arrays["fields"].astype(float)[:, chosen]
    ratio = np.hypot(re, im)
    a, b = np.exp(log) * (1 + ratio), np.exp(log) * np.abs(1 - ratio)
    true = factors(projection, *geographic(header, arrays["u"][chosen % columns], arrays["v"][chosen // columns]))
    off = np.maximum(np.abs(np.log(a / true.a)), np.abs(a / true.a - 1.0))
    return whole.size / (rows * columns), ((off < within) & (np.abs(b - true.b) < within * true.a)).mean()


def until(reached: Callable[[], object], seconds: float = 10.0) -> bool:
    """Wait until something is so, or for so long; whether it is."""
    deadline = time.monotonic() + seconds
    while not (is_so := bool(reached())) and time.monotonic() < deadline:
        time.sleep(0.01)
    return is_so


@dataclass(frozen=True)
class Traps(InputPolicy):
    """A policy whose requests sleep, fall, are killed or start processes; marks stand in a folder."""

    folder: str = ""

    def projection(self, text: str) -> Projection:
        """The projection of a text, or a trap: `sleep:SECONDS`, or a word."""
        word, _, seconds = text.partition(":")
        if word == "sleep":
            time.sleep(float(seconds))
        if word == "fall":
            raise LookupError("nobody foresaw this")
        if word == "proj":
            raise ProjectionError(json.dumps([is_network_enabled(), get_user_data_dir()]))
        if word in ("forks", "forks-and-dies"):
            child = os.fork()
            if child == 0:
                time.sleep(600.0)
            Path(self.folder, "child").write_text(str(child))
        mark = Path(self.folder, word)
        if word in ("killed", "forks-and-dies") or (word == "killed-once" and not mark.exists()):
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        if word == "forks":
            time.sleep(600.0)
        return super().projection("robinson" if word in _TRAPS else text)


@dataclass
class Hearing:
    """What a worker tells."""

    blocks: queue.Queue[bytes] = field(default_factory=queue.Queue)

    def __call__(self, block: bytes) -> None:
        """Keep a reply."""
        self.blocks.put(block)

    def next(self) -> dict[str, Any]:
        """The header of the next reply."""
        return header_of(self.blocks.get(timeout=60.0))

    def ask(self, found: Worker, number: int, projection: str = "robinson") -> dict[str, Any]:
        """The header of the reply to a request for the texts of a map, or for a trap."""
        found.ask("page", "a", wanted(number, projection), self)
        return self.next()


@contextlib.contextmanager
def worker(policy: InputPolicy | None = None, limit: float = 60.0) -> Iterator[Worker]:
    """A worker that is closed at the end."""
    with contextlib.closing(Worker("preview", policy or InputPolicy(), limit)) as found:
        yield found


def wanted(number: int, projection: str = "robinson") -> Request:
    """A request for the texts of a map, or for a trap."""
    return Request(id=number, kind="texts", projection=projection)


def listed(*words: str) -> str:
    """What ps tells."""
    return subprocess.run(["ps", *words], capture_output=True, text=True, check=False).stdout


def is_running(pid: int) -> bool:
    """Whether there is a process of this number that has not ended."""
    state = listed("-o", "stat=", "-p", str(pid))
    return bool(state) and not state.startswith("Z")


def ended(pids: Sequence[int], seconds: float = 3.0) -> bool:
    """Whether processes have ended before so much time has passed."""
    return until(lambda: not any(map(is_running, pids)), seconds)


def descendants(pid: int) -> list[int]:
    """Processes that a process has started, and those that these have."""
    pairs, found = [tuple(map(int, line.split())) for line in listed("-e", "-o", "pid=,ppid=").splitlines()], [pid]
    for one in found:
        found += [child for child, parent in pairs if parent == one]
    return found[1:]


@dataclass
class Command:
    """`projdist explore` as it runs, with the port and the token of its address."""

    process: subprocess.Popen[str]
    port: int
    token: str


@contextlib.contextmanager
def exploring(*words: str, **options: Any) -> Iterator[Command]:
    """The command without a browser, from the time that it has printed its address."""
    command = [sys.executable, "-m", "projdist", "explore", "--no-browser", *words]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True, **options
    ) as process:
        try:
            line = process.stdout.readline()
            match = ADDRESS.fullmatch(line)
            assert match, (line, process.stderr.read())
            yield Command(process, int(match[1]), match[2])
        finally:
            if process.poll() is None:
                process.terminate()


@contextlib.contextmanager
def served(site: Any) -> Iterator[int]:
    """The port of a site that is served by a thread."""
    import pytest
    import uvicorn

    from projdist.web.live.server import open_socket, serve

    made, servers = uvicorn.Server, list[uvicorn.Server]()

    def server(config: uvicorn.Config) -> uvicorn.Server:
        servers.append(made(config))
        return servers[0]

    with pytest.MonkeyPatch.context() as patch, open_socket() as listening:
        patch.setattr(uvicorn, "Server", server)
        thread = threading.Thread(target=serve, args=(site, listening))
        thread.start()
        try:
            yield listening.getsockname()[1]
        finally:
            until(lambda: servers)
            servers[0].should_exit = True
            thread.join()
            site.close()


@contextlib.contextmanager
def page(port: int, token: str, **options: Any) -> Iterator[Any]:
    """The socket of a page that has told its token and was welcomed."""
    with connected(port, **options) as socket:
        socket.send(json.dumps({"token": token}))
        assert json.loads(socket.recv(timeout=30))["projections"]
        yield socket


def connected(port: int, **options: Any) -> Any:
    """The socket of a page that has not told its token."""
    from websockets.sync.client import connect

    given = {"origin": f"http://127.0.0.1:{port}", "max_size": None, "compression": None, **options}
    return connect(f"ws://127.0.0.1:{port}/socket", **given)


def asked(socket: Any, timeout: float = 60.0, **request: Any) -> dict[str, Any]:
    """The header of the reply to a request, after those of progress."""
    socket.send(json.dumps({"id": 1, "projection": "robinson"} | request))
    while "progress" in (header := header_of(socket.recv(timeout=timeout))):
        pass
    return header
