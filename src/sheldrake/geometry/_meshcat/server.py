"""The web server behind a Meshcat: viser's, made to listen only where and to whom it should.

viser starts its websocket server itself and leaves no hook for the socket, the handshake or the
logging. `_GuardedWebsockServer` runs viser's own worker with one name replaced, the function that
opens the server, in a private copy of the function's globals: nothing of viser is changed for
others in the same process.
"""

from __future__ import annotations

import contextlib
import errno
import gzip
import http
import logging
import socket
import threading
import types
from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from .dress import dress_page

if TYPE_CHECKING:
    import asyncio
    from types import ModuleType

    import viser
    import websockets.http11

log = logging.getLogger("drake")

FIRST_PORT, LAST_PORT = 7000, 7999
MAX_MESSAGE_SIZE = 8 * 2**20  # bytes; the largest a page has to send is a rendered picture
LOOPBACK_HOSTS = frozenset({"localhost", "127.0.0.1", "::1"})
ALL_INTERFACES = frozenset({"*", "0.0.0.0", "::", ""})


def open_socket(host: str, port: int | None) -> socket.socket:
    """Returns a listening socket.

    Args:
        host: Name or address; "*" for all interfaces.
        port: Port number, 0 for any free one, None for the first free one from 7000 on.

    Raises:
        RuntimeError: when the port is out of range.
        RuntimeError: when the host is unknown or no wanted port is free.
    """
    if port is not None and port != 0 and not 1024 <= port <= 65535:
        raise RuntimeError(f"Meshcat(): port must be 0 or from 1024 to 65535, got {port}.")
    address = {"*": "0.0.0.0", "localhost": "127.0.0.1"}.get(host, host)
    wanted = range(FIRST_PORT, LAST_PORT + 1) if port is None else [port]
    for candidate in wanted:
        try:
            family = socket.getaddrinfo(address, candidate, type=socket.SOCK_STREAM)[0][0]
        except (socket.gaierror, UnicodeError) as error:
            raise RuntimeError(f"Meshcat(): cannot listen on host '{host}': {error}.") from None
        listener = socket.socket(family, socket.SOCK_STREAM)
        try:
            if hasattr(socket, "SO_EXCLUSIVEADDRUSE"):  # Windows: SO_REUSEADDR there means "share"
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
            else:
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind((address, candidate))
            listener.listen(64)
            return listener
        except OSError as error:
            listener.close()
            if error.errno not in (errno.EADDRINUSE, errno.EACCES):
                raise RuntimeError(f"Meshcat(): cannot listen on {host}:{candidate}: {error}.") from None
    if port is None:
        raise RuntimeError(f"Meshcat(): every port from {FIRST_PORT} to {LAST_PORT} is in use on host '{host}'.")
    raise RuntimeError(
        f"Meshcat(): port {port} on host '{host}' is in use. Choose another one, or leave it out to get the first "
        f"free one from {FIRST_PORT} on."
    )


class Gatekeeper:
    """Decides which requests are answered.

    A browser says in "Origin" which page asks, and in "Host" whom it thinks it talks to. A page of
    another site has a foreign Origin; a page that re-pointed its own name to this machine (DNS
    rebinding) has a foreign Host. Both are refused. Programs that are not browsers send no Origin.

    Args:
        host: What the server listens on.
        public_host: Host name in the address that is given to users, for a server behind a proxy.
    """

    def __init__(self, host: str, public_host: str | None):
        self._any_host = host in ALL_INTERFACES
        self._hosts = LOOPBACK_HOSTS | {host.lower()} | ({public_host.lower()} if public_host else set())

    def refusal(self, host: str | None, origin: str | None) -> str | None:
        """Returns why a request is refused, or None."""
        name, page = _address(f"//{host}")[0] if host else None, _address(origin or "")[1]
        if name is None or not (self._any_host or name in self._hosts):
            return f"host {host!r} is not served here"
        if origin is not None and page != (host or "").lower():
            return f"pages of {origin!r} may not connect"
        return None


def _address(url: str) -> tuple[str | None, str | None]:
    """Name of the host, and the host with its port; None of what is no address."""
    try:
        parts = urlsplit(url)
        return parts.hostname, parts.netloc.lower()
    except ValueError:
        return None, None


def client_page(script: str, title: str) -> str:
    """Returns viser's page with our title and one script of ours at the end of its head."""
    page = (resources.files("viser") / "client" / "build" / "index.html").read_text(encoding="utf-8")
    return dress_page(page, script, title)


class Site:
    """What the server answers to plain HTTP requests.

    Args:
        gatekeeper: Decides who is answered.
        page: The page, as HTML.
        downloads: Path -> (media type, function that makes the content); run off the event loop.
    """

    def __init__(self, gatekeeper: Gatekeeper, page: str, downloads: dict[str, tuple[str, Callable[[], bytes]]]):
        self._gatekeeper = gatekeeper
        self._page = page.encode()
        self._page_gzipped = gzip.compress(self._page, compresslevel=6, mtime=0)
        self._downloads = downloads

    async def process_request(self, connection: Any, request: Any) -> Any:
        """Answers a request, or returns None to let a websocket handshake go on."""
        said = {name: request.headers.get_all(name) for name in ("Host", "Origin", "Upgrade")}
        if len(said["Host"]) != 1 or any(len(values) > 1 for values in said.values()):
            text = "Refused: one Host header, and at most one Origin and Upgrade, are expected.\n"
            return self._response(http.HTTPStatus.BAD_REQUEST, "text/plain", text.encode())
        host, origin, upgrade = ("".join(values) for values in said.values())
        refusal = self._gatekeeper.refusal(host, origin if said["Origin"] else None)
        if refusal is not None:
            log.debug("refused a connection: %s", refusal)
            return self._response(http.HTTPStatus.FORBIDDEN, "text/plain", f"Refused: {refusal}.\n".encode())
        if upgrade.lower() == "websocket":
            return None
        path = request.path.partition("?")[0]
        if path in ("/", "/index.html"):
            gzipped = any("gzip" in value for value in request.headers.get_all("Accept-Encoding"))
            body = self._page_gzipped if gzipped else self._page
            return self._response(http.HTTPStatus.OK, "text/html; charset=utf-8", body, gzipped)
        if path in self._downloads:
            import asyncio  # not above: what draws nothing does not wait for it

            media_type, make = self._downloads[path]
            body = await asyncio.get_running_loop().run_in_executor(None, make)
            return self._response(http.HTTPStatus.OK, media_type, body)
        return self._response(http.HTTPStatus.NOT_FOUND, "text/plain", b"Not found.\n")

    @staticmethod
    def _response(
        status: http.HTTPStatus, media_type: str, body: bytes, gzipped: bool = False
    ) -> websockets.http11.Response:
        from websockets.datastructures import Headers
        from websockets.http11 import Response

        headers = Headers(
            {
                "Content-Type": media_type,
                "Content-Length": str(len(body)),
                "Cache-Control": "no-cache",
                "X-Content-Type-Options": "nosniff",
                "Connection": "close",
            }
        )
        if gzipped:
            headers["Content-Encoding"] = "gzip"
        return Response(status.value, status.phrase, headers, body)


def _websocket_logger() -> logging.Logger:
    """Returns a logger that keeps handshake refusals and broken clients out of the user's terminal."""
    logger = logging.getLogger("sheldrake.meshcat.websocket")
    logger.setLevel(logging.CRITICAL)
    return logger


def _guarded_serve(listener: socket.socket, site: Site) -> Callable:
    """Returns a stand-in for websockets' `serve` that listens on our socket and asks our site first."""
    from websockets.asyncio.server import serve
    from websockets.exceptions import ConnectionClosed

    def guarded_serve(handler: Callable, _host: str, _port: int, **options: Any) -> Any:
        async def survive_bad_clients(connection: Any) -> None:
            try:
                await handler(connection)
            except ConnectionClosed:
                pass
            except Exception as error:
                log.info("closed the connection of a page that sent something unreadable: %r", error)
                await connection.close(1007, "unreadable message")

        options.update(max_size=MAX_MESSAGE_SIZE, process_request=site.process_request, logger=_websocket_logger())
        return serve(survive_bad_clients, sock=listener, **options)

    return guarded_serve


def _quiet_builtins() -> dict[str, Any]:
    """Returns builtins whose `import rich` gives something that logs instead of printing.

    viser prints its address and "Server stopped" whether or not it was asked to be quiet.
    """
    import builtins

    quiet_rich = types.SimpleNamespace(print=lambda *args: log.debug("%s", " ".join(map(str, args))))

    def import_quietly(
        name: str,
        globals: Mapping[str, object] | None = None,
        locals: Mapping[str, object] | None = None,
        fromlist: Sequence[str] = (),
        level: int = 0,
    ) -> ModuleType | types.SimpleNamespace:
        if name == "rich" and not fromlist:
            return quiet_rich
        return builtins.__import__(name, globals, locals, fromlist, level)

    return {**vars(builtins), "__import__": import_quietly}


def _with_globals(function: Callable, **replaced: object) -> Callable:
    """Returns a copy of a function that sees some other globals than the original."""
    names = {**function.__globals__, "__builtins__": _quiet_builtins(), **replaced}
    copy = types.FunctionType(function.__code__, names, function.__name__, function.__defaults__, function.__closure__)
    copy.__kwdefaults__ = function.__kwdefaults__
    return copy


def start_viser(listener: socket.socket, site: Site) -> viser.ViserServer:
    """Returns a running viser.ViserServer that answers on our socket through our site.

    Args:
        listener: A listening socket; the server owns it from now on.
        site: Answers plain requests and refuses foreign ones.
    """
    import viser
    from viser import _viser, infra

    serve = _guarded_serve(listener, site)
    base = infra.WebsockServer
    module = base._background_worker.__globals__
    websockets = module["websockets"]
    stand_in = types.SimpleNamespace(
        asyncio=types.SimpleNamespace(
            server=types.SimpleNamespace(serve=serve, ServerConnection=websockets.asyncio.server.ServerConnection)
        ),
        exceptions=websockets.exceptions,
        datastructures=websockets.datastructures,
    )

    class _GuardedWebsockServer(base):  # type: ignore[misc, valid-type]
        _background_worker = _with_globals(base._background_worker, websockets=stand_in)

    host, port = listener.getsockname()[:2]
    private_infra = types.SimpleNamespace(**{**vars(infra), "WebsockServer": _GuardedWebsockServer})
    server = viser.ViserServer.__new__(viser.ViserServer)
    construct = _with_globals(_viser.ViserServer.__init__, infra=private_infra)
    construct(server, host=host, port=port, verbose=False)
    for message in ("ShareUrlRequest", "ShareUrlDisconnect"):  # a page must not open a tunnel to the outside
        server._websock_server._incoming_handlers.pop(getattr(_viser._messages, message))
    loop = server.get_event_loop()
    loop.call_soon_threadsafe(loop.set_exception_handler, _log_quietly)
    return server


class Sweeper:
    """Has a server forget what it keeps for late joiners about things that are gone.

    That something is gone is kept until every page has read it. A page that reads nothing any more is let go before
    that becomes much; when it wakes up it connects again and gets the scene as it is then.

    Args:
        server: A viser.ViserServer.
    """

    _ROOM = 256  # messages, besides as many as there were after the last sweep
    _HELD_BACK = 2000  # messages about what is gone, kept for the slowest page

    def __init__(self, server: Any):
        self._server = server
        self._buffer = server._websock_server._broadcast_buffer
        self._kept = 0

    def sweep_if_due(self) -> None:
        """Sweeps when there is more than twice of what was needed the last time."""
        if len(self._buffer.message_from_id) > 2 * self._kept + self._ROOM:
            self._server._run_garbage_collector()
            self._let_go_of_stalled_pages()
            self._kept = len(self._buffer.message_from_id)

    def _let_go_of_stalled_pages(self) -> None:
        buffer, server = self._buffer, self._server._websock_server
        with buffer.buffer_lock:
            gone = [n for n, message in buffer.message_from_id.items() if message.lifecycle_phase == "remove"]
        if len(gone) <= self._HELD_BACK:
            return
        middle = gone[len(gone) // 2]
        for client, cursor in list(buffer.generator_cursors.items()):
            connection = server._live_connections.get(client)
            if cursor < middle and connection is not None:
                log.info("closed the connection of a page that does not read")
                self._server.get_event_loop().call_soon_threadsafe(connection.transport.abort)

    def drop(self, message: Any) -> None:
        """Forgets one message."""
        self._buffer.remove_from_buffer(lambda kept: kept is message)


def _log_quietly(_loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Keeps what a page made go wrong in a task out of the user's terminal."""
    log.debug("%s: %r", context.get("message"), context.get("exception"))


def stop_viser(server: viser.ViserServer) -> None:
    """Stops a server and its threads. Called from the server's own thread, it finishes in another."""
    if threading.current_thread() is server._websock_server._server_thread:
        threading.Thread(target=stop_viser, args=(server,), daemon=True).start()
        return
    with contextlib.suppress(Exception):
        server.stop()
