"""Server of the live page, for browsers on this machine that know the token in its address."""

import asyncio
import contextlib
import json
import secrets
import signal
import socket
import threading
from collections.abc import Awaitable, Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from types import FrameType
from typing import Any

from projdist import projections, regions
from projdist.web.live import dispatcher
from projdist.web.live.worker import LIMITS, OnReply, Worker
from projdist.web.page import live_files

HOST = "127.0.0.1"
_NAMES = ("127.0.0.1", "localhost", "[::1]")
_TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css"}
_PATIENCE = 10.0  # seconds for the first message
_HTTP = 80  # port that addresses may leave out
_GRACE = 1  # second for closing pages when the server ends
_NO_TOKEN, _TOO_MANY = 4401, 4429  # codes for closing a connection
_MOST_PAGES = 24
_MOST_UNREAD = 256  # answers that a page has not read
_PAUSE = 0.02  # seconds

Scope = dict[str, Any]
Receive = Callable[[], Awaitable[dict[str, Any]]]
Send = Callable[[Mapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]


@dataclass(frozen=True, kw_only=True)
class Start:
    """Initial projections, region and measure of a page."""

    projections: tuple[str, ...]
    region: str
    measure: str


@dataclass
class LiveSite:
    """The live page at one address, with its worker processes; close it after use."""

    start: Start
    policy: dispatcher.InputPolicy
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))

    def __post_init__(self) -> None:
        self.workers = {name: Worker(name, self.policy) for name in LIMITS}
        self.pages = 0  # so far
        self.open_pages = 0

    def close(self) -> None:
        """End the processes."""
        for worker in self.workers.values():
            worker.close()

    def url(self, port: int) -> str:
        """Address of the page; the token is in its fragment, which is not sent."""
        return f"http://{HOST}:{port}/#token={self.token}"

    def app(self, port: int) -> App:
        """ASGI application of the page, its modules and its socket."""
        from starlette.applications import Starlette
        from starlette.responses import Response
        from starlette.routing import Route, WebSocketRoute

        files = live_files()

        async def file(request: Any) -> Response:
            name = request.path_params.get("name", "explore.html")
            if name not in files:
                return Response("There is no such file.", status_code=404, media_type="text/plain")
            return Response(files[name], media_type=_TYPES[f".{name.rpartition('.')[2]}"])

        routes = [Route("/", file), Route("/static/{name}", file), WebSocketRoute("/socket", self._converse)]
        return _guarded(Starlette(routes=routes), port)

    async def _converse(self, socket: Any) -> None:
        """Serve a page from its first message, the token, until it is closed."""
        await socket.accept()
        try:
            first = await asyncio.wait_for(socket.receive(), _PATIENCE)
        except TimeoutError:
            first = {}
        if first.get("type") == "websocket.disconnect":
            return
        if not secrets.compare_digest(_token_of(first.get("text") or ""), self.token.encode()):
            await socket.close(_NO_TOKEN)
            return
        if self.open_pages >= _MOST_PAGES:
            await socket.close(_TOO_MANY)
            return
        self.pages += 1
        self.open_pages += 1
        page = self.pages
        try:
            await self._serve(page, socket)
        finally:
            self.open_pages -= 1
            for worker in self.workers.values():
                worker.drop(page)

    async def _serve(self, page: int, socket: Any) -> None:
        """Answer a page until it is closed, or leaves too many answers unread."""
        waiting: asyncio.Queue[bytes | str] = asyncio.Queue(_MOST_UNREAD)
        loop, unread = asyncio.get_running_loop(), asyncio.Event()

        def put(block: bytes) -> None:
            try:
                waiting.put_nowait(block)
            except asyncio.QueueFull:
                unread.set()

        def on_reply(block: bytes) -> None:
            with contextlib.suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(put, block)

        known = {"names": sorted(projections.projection_names()), "countries": regions.region_names()}
        waiting.put_nowait(json.dumps(asdict(self.start) | known))
        tasks = [
            asyncio.create_task(self._listen(page, socket, waiting, on_reply)),
            asyncio.create_task(_send_all(socket, waiting)),
            asyncio.create_task(unread.wait()),
        ]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
        for task in done:
            task.result()  # raises what has gone wrong

    async def _listen(self, page: int, socket: Any, waiting: asyncio.Queue[bytes | str], on_reply: OnReply) -> None:
        """Receive requests of a page until it is closed, pausing while many answers are unread."""
        while (message := await socket.receive())["type"] != "websocket.disconnect":
            self._take(page, message, on_reply)
            await asyncio.sleep(0)  # so that answers are queued
            while waiting.qsize() > _MOST_UNREAD // 2:
                await asyncio.sleep(_PAUSE)

    def _take(self, page: int, message: Mapping[str, Any], on_reply: OnReply) -> None:
        """Hand a request to its worker."""
        try:
            request = _request_of(message)
        except dispatcher.RequestError as error:
            on_reply(dispatcher.failed(dispatcher.Request(id=0, kind="error"), str(error)))
            return
        if request.kind == dispatcher.STOP:
            what = str(request.options.get("what"))
            if what in dispatcher.WORKER_OF_KIND:
                self.workers[dispatcher.WORKER_OF_KIND[what]].drop(page, (what, request.slot))
            return
        self.workers[dispatcher.WORKER_OF_KIND[request.kind]].ask(page, (request.kind, request.slot), request, on_reply)


def _request_of(message: Mapping[str, Any]) -> dispatcher.Request:
    """Request of a message: a text, or its length, the text and a file."""
    text = message.get("text")
    if text is not None:
        return dispatcher.read_request(text)
    block = message.get("bytes") or b""
    length = int.from_bytes(block[:4], "little")
    if len(block) < 4 or length > min(dispatcher.LONGEST_MESSAGE, len(block) - 4):
        raise dispatcher.RequestError("Invalid message. It must be a length, a text and a file.")
    return dispatcher.read_request(block[4 : 4 + length], bytes(block[4 + length :]))


def _token_of(text: str) -> bytes:
    """Token of a page's first message, empty without one."""
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        return b""
    token = message.get("token") if isinstance(message, dict) else None
    return token.encode(errors="replace") if isinstance(token, str) else b""


async def _send_all(socket: Any, waiting: asyncio.Queue[bytes | str]) -> None:
    """Send queued messages until the page is closed."""
    from starlette.websockets import WebSocketDisconnect

    with contextlib.suppress(WebSocketDisconnect):
        while True:
            block = await waiting.get()
            await (socket.send_text(block) if isinstance(block, str) else socket.send_bytes(block))
            await asyncio.sleep(0)  # so that the loop notices that the page has left, before asyncio warns


def _guarded(app: App, port: int) -> App:
    """The application, restricted to hosts and origins of this machine, with security headers."""
    from starlette.datastructures import Headers
    from starlette.responses import Response

    hosts = {f"{name}:{port}" for name in _NAMES} | ({*_NAMES} if port == _HTTP else set())
    origins = {f"http://{host}" for host in hosts}
    policy = (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
        f"connect-src 'self' {' '.join(f'ws://{host}' for host in sorted(hosts) if '[' not in host)}; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    added = [
        (b"content-security-policy", policy.encode()),
        (b"x-content-type-options", b"nosniff"),
        (b"referrer-policy", b"no-referrer"),
        (b"cross-origin-resource-policy", b"same-origin"),
        (b"cache-control", b"no-store"),
    ]

    async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
        is_socket = scope["type"] == "websocket"

        async def sending(message: Mapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message.get("headers", []), *added]}
            await send(message)

        host, origin = (Headers(scope=scope).getlist(name) for name in ("host", "origin"))
        if len(host) != 1 or not hosts.issuperset(host):
            status = 400
        elif len(origin) > 1 or not origins.issuperset(origin) or (is_socket and not origin):
            status = 403
        else:
            await app(scope, receive, sending)
            return
        if is_socket:  # closed before it is accepted, which sends 403
            await send({"type": "websocket.close"})
        else:
            await Response(status_code=status)(scope, receive, sending)

    return guarded


def check_server() -> None:
    """Import what a server needs; raises ImportError in one line."""
    try:
        import starlette  # noqa: F401
        import uvicorn  # noqa: F401
        import websockets  # noqa: F401
    except ImportError as error:
        name = "The live page needs Starlette, uvicorn and websockets: pip install 'projdist[explore]'."
        raise ImportError(name, name=error.name) from error


def open_socket(port: int = 0) -> socket.socket:
    """Listening socket on this machine, on a free port for 0; raises OSError."""
    return socket.create_server((HOST, port))


def serve(site: LiveSite, listening: socket.socket) -> None:
    """Serve until a signal, which is raised again."""
    import uvicorn

    port = listening.getsockname()[1]
    config = uvicorn.Config(
        site.app(port),
        ws="websockets-sansio",
        ws_max_size=dispatcher.LARGEST_FILE + dispatcher.LONGEST_MESSAGE,
        ws_per_message_deflate=False,
        lifespan="off",
        log_level="error",
        access_log=False,
        timeout_graceful_shutdown=_GRACE,
    )
    server = uvicorn.Server(config)
    with _hanging_up(server):
        server.run(sockets=[listening])


@contextlib.contextmanager
def _hanging_up(server: Any) -> Iterator[None]:
    """Shut the server down in order on SIGHUP, as uvicorn does on its own signals."""
    number = getattr(signal, "SIGHUP", None)
    is_main = threading.current_thread() is threading.main_thread()
    if number is None or not is_main or signal.getsignal(number) == signal.SIG_IGN:
        yield
        return
    received: list[int] = []

    def end(number: int, _: FrameType | None) -> None:
        received.append(number)
        server.should_exit = True

    kept = signal.signal(number, end)
    yield
    signal.signal(number, kept)
    if received:
        signal.raise_signal(number)
