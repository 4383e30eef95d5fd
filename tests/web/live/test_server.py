"""The live page's server: for this machine's own pages that know the token, whatever they send."""

import asyncio
import json
import threading
from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import Any

import pytest
from tables import each

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")
pytest.importorskip("websockets")
from hypothesis import given, settings, strategies as st
from live_pages import asked, connected, header_of, page, served, until
from websockets.exceptions import ConnectionClosed, InvalidStatus

from projdist.web.live import server
from projdist.web.live.dispatcher import LARGEST_FILE, LONGEST_MESSAGE, WORKER_OF_KIND, Dispatcher, InputPolicy, Request
from projdist.web.live.server import LiveSite, Start
from projdist.web.page import live_files

PORT = 5000
OWN = f"127.0.0.1:{PORT}"
START = Start(projections=("robinson",), region="globe", measure="fisher")
Headers = Sequence[tuple[bytes, bytes]]


class _Clerk:
    """In place of a worker: answers at once, in this process, and keeps what was dropped and which page was closed."""

    def __init__(self, name: str, policy: InputPolicy) -> None:
        self.dispatcher, self.dropped = Dispatcher(policy), []

    def ask(self, page: Hashable, key: Hashable, request: Request, told: Callable[[bytes], None]) -> None:
        told(self.dispatcher.answer(request))

    def drop(self, page: Hashable, key: Hashable = None) -> None:
        self.dropped.append((page, key))

    def close(self) -> None:
        """There is no process."""


@pytest.fixture(scope="module")
def site() -> Iterator[LiveSite]:
    """A site without processes, for which a file was named on the command line."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(server, "Worker", _Clerk)
        yield LiveSite(START, InputPolicy(frozenset({"+proj=merc +nadgrids=x.gsb"})), token="right")


@pytest.fixture(scope="module")
def port(site: LiveSite) -> Iterator[int]:
    with served(site) as number:
        yield number


def answer(
    site: LiveSite,
    path: str = "/",
    method: str = "GET",
    kind: str = "http",
    more: Headers = (),
    at: int = PORT,
    **named: str,
) -> tuple[int, dict[str, Any]]:
    """The status and the headers of the reply to a request with some headers; `body` is its body."""
    headers = [(name.encode(), value.encode()) for name, value in ({"host": OWN} | named).items() if value]
    sent: list[dict[str, Any]] = []
    coming = iter(["http.request"] if kind == "http" else ["websocket.connect", "websocket.disconnect"])

    async def receive() -> dict[str, Any]:
        return {"type": next(coming), "code": 1000}

    async def send(message: Any) -> None:
        sent.append(dict(message))

    scope = {"type": kind, "path": path, "raw_path": path.encode(), "method": method, "headers": [*headers, *more]}
    scope |= {"query_string": b"", "root_path": "", "scheme": "http", "http_version": "1.1", "subprotocols": []}
    asyncio.run(site.app(at)(scope, receive, send))
    if kind == "websocket":
        return {"websocket.accept": 101, "websocket.close": 403}[sent[0]["type"]], {}
    found = {name.decode().lower(): value.decode() for name, value in sent[0]["headers"]}
    return sent[0]["status"], found | {"body": b"".join(one.get("body", b"") for one in sent[1:])}


@each(("host", "port"), [
    (OWN, PORT), (f"localhost:{PORT}", PORT), (f"[::1]:{PORT}", PORT), ("127.0.0.1", 80), ("127.0.0.1:80", 80),
])  # fmt: skip
def test_the_names_of_this_machine_are_answered(site: LiveSite, host: str, port: int) -> None:
    """With the port of the page, which browsers leave out if it is 80."""
    assert answer(site, host=host, at=port)[0] == 200
    assert answer(site, "/socket", kind="websocket", host=host, origin=f"http://{host}", at=port)[0] == 101
    assert answer(site, host=host, more=[(b"host", host.encode())], at=port)[0] == 400
    assert answer(site, host="evil.example", at=port)[0] == 400


@each("host", [
    "", "127.0.0.1", "localhost", "127.0.0.1:80", "evil.example:5000", "127.0.0.1.evil.example:5000", "::1:5000",
    "user@127.0.0.1:5000", "127.0.0.1:5000, x", "0.0.0.0:5000",
])  # fmt: skip
def test_other_hosts_are_refused(site: LiveSite, host: str) -> None:
    """As those of a name that was bound to this machine's address, also on the socket; and so are two."""
    assert answer(site, host=host)[0] == 400
    assert answer(site, "/socket", kind="websocket", host=host, origin=f"http://{OWN}")[0] == 403
    assert answer(site, more=[(b"host", host.encode())])[0] == 400


@each("origin", [
    "http://evil.example", "null", f"https://{OWN}", "http://127.0.0.1", f"http://{OWN}/", f"http://{OWN}.evil.example",
])  # fmt: skip
def test_other_origins_are_refused(site: LiveSite, origin: str) -> None:
    """On the socket, and for the page; on the socket, where browsers tell it always, so are none and two, too."""
    assert answer(site, "/socket", kind="websocket", origin=origin)[0] == 403
    assert answer(site, origin=origin)[0] == 403
    assert answer(site, "/socket", kind="websocket")[0] == 403
    own = f"http://{OWN}"
    assert answer(site, "/socket", kind="websocket", origin=own, more=[(b"origin", own.encode())])[0] == 403


WRITING = ("PUT", "DELETE", "PATCH", "OPTIONS", "TRACE")
OUTSIDE = [
    "../inputs.py", "..%2finputs.py", "inputs.py", "/etc/passwd", "../../page.py", "..\\inputs.py", "__init__.py",
    "live/start.js", "", ".",
]  # fmt: skip


SAFETY = {
    "x-content-type-options": "nosniff", "cross-origin-resource-policy": "same-origin", "cache-control": "no-store",
    "referrer-policy": "no-referrer",
}  # fmt: skip


@each(("path", "method", "host", "status"), [
    ("/", "GET", OWN, 200), ("/static/start.js", "GET", OWN, 200), ("/static/none.js", "GET", OWN, 404),
    ("/none", "GET", OWN, 404), ("/", "POST", OWN, 405), ("/", "GET", "evil.example", 400), ("/", "HEAD", OWN, 200),
    ("/static/explore.css", "OPTIONS", OWN, 405), ("/socket", "GET", OWN, 404),
    *(("/", method, OWN, 405) for method in WRITING),
    *(("/static/start.js", method, OWN, 405) for method in ("POST", *WRITING)),
    *((f"/static/{name}", "GET", OWN, 404) for name in OUTSIDE),
])  # fmt: skip
def test_every_reply_has_the_headers_of_safety(site: LiveSite, path: str, method: str, host: str, status: int) -> None:
    """Nothing of elsewhere is run, shown or framed; no cookies. Pages are read only, and no file but theirs is read."""
    found, headers = answer(site, path, method, host=host)
    assert found == status
    policy = dict(part.strip().partition(" ")[::2] for part in headers["content-security-policy"].split(";"))
    none, own = ("default-src", "frame-ancestors", "base-uri", "form-action"), ("script-src", "style-src")
    assert {name: policy[name] for name in (*none, *own)} == dict.fromkeys(none, "'none'") | dict.fromkeys(
        own, "'self'"
    )
    assert "unsafe" not in headers["content-security-policy"]
    assert headers.items() >= SAFETY.items()
    assert not {"set-cookie", "access-control-allow-origin", "server"} & set(headers)


def test_the_page_and_its_modules_are_there(site: LiveSite) -> None:
    """With their types, and all that they import."""
    status, page = answer(site)
    assert (status, page["content-type"]) == (200, "text/html; charset=utf-8")
    files = live_files()
    for name, text in files.items():
        status, found = answer(site, f"/static/{name}")
        assert (status, found["body"]) == (200, text.encode())
        assert found["content-type"].startswith(server._TYPES[f".{name.rpartition('.')[2]}"])
        if name.endswith(".js") and name != "widget.js":  # that of notebooks
            imported = [line.split('"')[1] for line in text.splitlines() if line.startswith("import")]
            assert {one.removeprefix("./") for one in imported} <= set(files)


def closed_with(socket: Any, message: str | bytes | None = None) -> int | None:
    """The code with which the server ends a connection, on a message or by itself; None if it was not heard."""
    with pytest.raises(ConnectionClosed) as caught:  # noqa: PT012  (it may be while the message is sent)
        if message is not None:
            socket.send(message)
        socket.recv(timeout=10)
    return caught.value.rcvd.code if caught.value.rcvd else None


def test_strangers_have_no_socket(port: int, capfd: pytest.CaptureFixture[str]) -> None:
    """Their handshakes are answered with 403, and not spoken of."""
    for origin in ("http://evil.example", "null", None):
        with pytest.raises(InvalidStatus) as caught:
            connected(port, origin=origin)
        assert caught.value.response.status_code == 403
    assert capfd.readouterr().err == ""


@each("first", [
    "", "right", '"right"', "[]", '["right"]', '{"token": "wrong"}', '{"token": ["right"]}', '{"token": null}', "{",
    '{"token": "righ"}', '{"token": "\\ud800"}', "[" * 9000, b'{"token": "right"}',
])  # fmt: skip
def test_a_wrong_token_ends_a_connection(port: int, first: str | bytes) -> None:
    with connected(port) as socket:
        assert closed_with(socket, first) == 4401


@pytest.mark.parametrize("first", ['{"token": "right"}', '{"token":"right"}', '{ "token" : "\\u0072ight" }'])
def test_the_token_may_be_spelt_as_json_is(port: int, first: str) -> None:
    with connected(port) as socket:
        socket.send(first)
        assert json.loads(socket.recv(timeout=10))["measure"] == "fisher"


def test_who_tells_no_token_is_left(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "_PATIENCE", 0.2)
    with connected(port) as socket:
        assert closed_with(socket) == 4401


def test_it_is_bound_to_this_machine(port: int) -> None:
    """To one address of it, at which no second server can be."""
    with server.open_socket() as listening:
        assert listening.getsockname()[0] == "127.0.0.1"
    with pytest.raises(OSError, match="in use"):
        server.open_socket(port)


READING = {"projection": "+proj=merc +nadgrids=x.gsb", "region": "file:x.geojson"}
NAMING = [
    *((kind, "projection") for kind in sorted({*WORKER_OF_KIND} - {"recommend", "design", "scales", "outline"})),
    *((kind, "region") for kind in sorted({*WORKER_OF_KIND} - {"check"})),
]


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "name"), NAMING)
def test_no_request_names_files(kind: str, name: str) -> None:
    """Projections and regions, of whatever kind it is, but for those that have none; the command line does."""
    given = {"projection": "robinson", "region": "country:DE", name: READING[name]}
    request = Request(id=1, kind=kind, file=b'{"type": "Point", "coordinates": [1, 2]}', **given)
    assert "must need no file" in header_of(Dispatcher().answer(request))["problem"]
    opened = Dispatcher(InputPolicy(frozenset({READING[name]})))
    assert "must need no file" not in header_of(opened.answer(request)).get("problem", "")


def test_files_of_the_command_line_are_for_pages(port: int) -> None:
    with page(port, "right") as socket:
        for end, is_refused in (("", False), (" ", True)):
            reply = asked(socket, kind="texts", projection=f"{READING['projection']}{end}")
            assert ("must need no file" in reply.get("problem", "")) is is_refused


def test_large_messages_are_refused(port: int) -> None:
    """In words up to the largest file; what is larger ends its own connection only."""
    with page(port, "right") as socket:
        socket.send("x" * (LONGEST_MESSAGE + 1))
        assert "too long" in header_of(socket.recv(timeout=10))["problem"]
        request = json.dumps({"id": 7, "kind": "check"}).encode()
        socket.send(len(request).to_bytes(4, "little") + request + bytes(LARGEST_FILE + 1))
        assert "too long" in header_of(socket.recv(timeout=30))["problem"]
        with page(port, "right") as other:
            assert closed_with(other, bytes(LARGEST_FILE + 2 * LONGEST_MESSAGE)) in (1009, None)
        assert asked(socket, kind="texts")["texts"]["PROJ"].startswith("+proj=robin")


def test_what_is_stopped_and_closed_is_dropped(site: LiveSite, port: int) -> None:
    """That of a map by its kind and its place; of a page all."""
    site.pages = 400  # of which no other test has one
    with page(port, "right") as socket:
        for what in ("recommend", "nothing", 3, None):
            socket.send(json.dumps({"id": 1, "kind": "stop", "slot": "b", "options": {"what": what}}))
        asked(socket, kind="texts")
    until(lambda: (401, None) in site.workers["long"].dropped)
    assert site.workers["long"].dropped[-2:] == [(401, ("recommend", "b")), (401, None)]
    assert all(clerk.dropped[-1] == (401, None) for clerk in site.workers.values())


def test_there_are_so_many_pages(site: LiveSite, port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    until(lambda: not site.open_pages)
    monkeypatch.setattr(server, "_MOST_PAGES", 2)
    with page(port, "right") as one:
        with page(port, "right"), connected(port) as third:
            assert closed_with(third, '{"token": "right"}') == 4429
        assert asked(one, kind="texts")["texts"]
        until(lambda: site.open_pages <= 1)
        with page(port, "right") as other:
            assert asked(other, kind="texts")["texts"]


def test_a_page_that_does_not_read_is_closed(site: LiveSite, port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "_MOST_UNREAD", 3)
    block, told = bytes(2_000_000), threading.Event()

    def ask(self: _Clerk, page: Hashable, key: Hashable, request: Request, tell: Callable[[bytes], None]) -> None:
        for _ in range(40 if request.kind == "scales" else 0):  # the socket of the test keeps up to 16 of them
            tell(block)
        told.set()
        if request.kind != "scales":
            tell(self.dispatcher.answer(request))

    monkeypatch.setattr(_Clerk, "ask", ask)
    with page(port, "right") as socket:
        before = site.open_pages
        socket.send(json.dumps({"id": 1, "kind": "scales"}))
        assert told.wait(10.0)
        until(lambda: site.open_pages < before)
        assert site.open_pages < before
        with page(port, "right") as other:
            assert asked(other, kind="texts")["texts"]


words = st.sampled_from(
    [*WORKER_OF_KIND, "stop", "robinson", "EPSG:3035", "globe", "box:170,-50,-170,10", "+proj=laea", "@", "none"]
)
atoms = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=20), words)
values = st.recursive(
    atoms, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5) | words, inner)
)
fields = ["id", "kind", "slot", "projection", "values", "centre", "region", "beside", "options"]
optional = {
    **dict.fromkeys(["projection", "region"], words | st.text(max_size=20)),
    "values": st.dictionaries(
        st.sampled_from(["lon_0", "lat_0", "lat_1", "x_0", ""]), st.floats(-200, 200), max_size=2
    ),
    "centre": st.lists(st.floats(-400, 400), min_size=2, max_size=2),
    "options": st.dictionaries(st.sampled_from(["what", "kind"]), atoms, max_size=2),
    "beside": st.lists(st.text(max_size=9), max_size=3),
}
kinds = st.sampled_from(["preview", "texts", "scales", "outline", "stop"])
likely = st.fixed_dictionaries({"id": st.integers(0, 9), "kind": kinds}, optional=optional)
objects = st.dictionaries(st.sampled_from(fields) | st.text(max_size=5), values, max_size=8) | likely


def with_file(pair: tuple[object, bytes]) -> bytes:
    """As a page sends a file with a request."""
    text = json.dumps(pair[0]).encode()
    return len(text).to_bytes(4, "little") + text + pair[1]


messages = st.one_of(
    *(st.text(max_size=200), objects.map(lambda value: json.dumps(value)), st.binary(max_size=200)),
    st.tuples(objects, st.binary(max_size=60)).map(with_file),
)


@pytest.mark.slow
def test_no_message_ends_the_server(site: LiveSite) -> None:

    @settings(max_examples=300)
    @given(messages)
    def swallow(message: str | bytes) -> None:
        told: list[bytes] = []
        block = {"text": message} if isinstance(message, str) else {"bytes": message}
        site._take(1, {"type": "websocket.receive", **block}, told.append)
        assert all(isinstance(header_of(one)["id"], int) for one in told)

    swallow()


@pytest.mark.slow
def test_closed_pages_are_not_spoken_of(site: LiveSite, port: int, capfd: pytest.CaptureFixture[str]) -> None:
    """Pages that leave without a word, while they are answered, in the middle of a message."""

    def leave(number: int) -> None:
        with page(port, "right") as socket:
            for _ in range(number):
                socket.send(json.dumps({"id": 1, "kind": "preview", "projection": "robinson"}))
            socket.socket.close()

    threads = [threading.Thread(target=leave, args=(number,)) for number in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with page(port, "right") as socket:
        assert asked(socket, kind="texts")["texts"]
    assert capfd.readouterr().err == ""
