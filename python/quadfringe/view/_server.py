"""The server of the live page: viser behind a guard.

viser (1.1) offers no hook for requests. It serves page and WebSocket by one call of `websockets.asyncio.server.serve`,
whose public arguments are all that a guard needs, so this module stands in for that function while viser starts. The
alternative, a proxy, would copy every cloud once more and leave viser's own port open. A viser that starts
in another way is stopped, and an error says so.
"""

from __future__ import annotations

import asyncio
import gzip
import logging
import secrets
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from functools import lru_cache
from html import escape
from io import StringIO
from socket import socket
from typing import TYPE_CHECKING, Any

from quadfringe.errors import MissingExtraError, require
from quadfringe.view._address import LOOPBACK, listen
from quadfringe.view._guard import Guard
from quadfringe.view._messages import LARGEST_MESSAGE_BYTES, acceptable

if TYPE_CHECKING:
    import viser

__all__ = ["ServedPage", "serve_page"]

logger = logging.getLogger(__name__)
logger.addHandler(logging.NullHandler())

TOKEN_BYTES = 24
CONNECTIONS = 64  # open sockets; without a limit a client could take all file descriptors, the recording's too
PAGES = 8  # each open page may hold two clouds, which are up to 20 MB each
MESSAGES_PER_S = 200.0  # of a page; dragging the viewpoint sends 60
HEADERS = {
    "Content-Security-Policy": "frame-ancestors 'none'; object-src 'none'; base-uri 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


@dataclass(frozen=True)
class ServedPage:
    """A running server and the address to open, which contains the token if there is one."""

    server: viser.ViserServer
    url: str


def serve_page(host: str, port: int, allow_hosts: Iterable[str], title: str) -> ServedPage:
    """Serve an empty page with a title at `host`, to other machines only with a token that is new each time.

    Raises `InputError` for a host or port that cannot be served, and `MissingExtraError` without the extra `view` or
    when the installed viser cannot be guarded.
    """
    address = listen(host, port)  # before viser is imported, which takes a second
    token = None if address.is_loopback else secrets.token_hex(TOKEN_BYTES)
    guard = Guard(address.names(allow_hosts), token, cookie=f"quadfringe-live-{address.port}")
    try:
        server = _start(address.listening, guard, title)
    except BaseException:
        address.listening.close()
        raise
    return ServedPage(server, address.url if token is None else f"{address.url}/?token={token}")


def _start(listening: socket, guard: Guard, title: str) -> viser.ViserServer:
    """Start viser on a listening socket, behind a guard."""
    module: Any = require("viser", "view")
    websockets: Any = require("websockets.asyncio.server", "view")
    started: list[bool] = []

    def guarded(serve: Callable[..., Any]) -> Callable[..., Any]:
        def serve_guarded(handler: object, host: object, port: object, **options: Any) -> Any:
            if not getattr(options.get("process_request"), "__module__", "").startswith("viser."):
                return serve(handler, host, port, **options)  # another server of this process
            asyncio.get_running_loop().set_exception_handler(_log)
            started.append(True)
            page = _titled(options["process_request"], title)
            return serve(handler, sock=listening, **options | _guarding(websockets, guard, page))

        return serve_guarded

    with _replaced(websockets, "serve", guarded), redirect_stdout(StringIO()):  # viser prints even with verbose=False
        # The host counts only for a viser that is not guarded, which is stopped at once.
        server: viser.ViserServer = module.ViserServer(host=LOOPBACK, label="quadfringe", verbose=False)
        if not started:
            server.stop()
            raise MissingExtraError(
                f'the live page cannot be guarded with viser {module.__version__}: pip install "quadfringe[view]"'
            )
    return server


_replacing = threading.Lock()


@contextmanager
def _replaced(module: Any, name: str, change: Callable[[Callable[..., Any]], Callable[..., Any]]) -> Iterator[None]:
    """Replace a function of a module for the time of a block."""
    with _replacing:
        original = getattr(module, name)
        setattr(module, name, change(original))
        try:
            yield
        finally:
            setattr(module, name, original)


def _log(_loop: object, context: dict[str, Any]) -> None:
    """Keep faults of single requests off the terminal: any client can cause them."""
    logger.debug("%s: %r", context.get("message"), context.get("exception"))


def _titled(answer: Callable[[Any, Any], Any], title: str) -> Callable[[Any, Any], Any]:
    """Give the page of viser a title in the tab of the browser."""

    def answer_titled(connection: Any, request: Any) -> Any:
        response = answer(connection, request)
        if response is not None and response.headers.get("Content-Type", "").startswith("text/html"):
            response.body = _with_title(response.body, title, response.headers.get("Content-Encoding") == "gzip")
            del response.headers["Content-Length"]
            response.headers["Content-Length"] = str(len(response.body))
        return response

    return answer_titled


@lru_cache(maxsize=4)
def _with_title(body: bytes, title: str, packed: bool) -> bytes:
    text = gzip.decompress(body) if packed else body
    text = text.replace(b"<title>Viser</title>", f"<title>{escape(title)}</title>".encode("utf-8", "replace"), 1)
    return gzip.compress(text, mtime=0) if packed else text


def _guarding(websockets: Any, guard: Guard, answer: Callable[[Any, Any], Any]) -> dict[str, Any]:
    """Give the arguments of `serve` that let only requests pass that the guard allows."""

    def process_request(connection: Any, request: Any) -> Any:
        refused = guard.refusal(request.path, request.headers)
        if refused is not None:
            return connection.respond(refused.status, f"{refused.text}\n")
        if len(connection.server.connections) >= PAGES and request.headers.get_all("Upgrade"):
            return connection.respond(503, f"the live page is open {PAGES} times already\n")
        return answer(connection, request)

    def process_response(_connection: Any, _request: Any, response: Any) -> None:
        for name, value in HEADERS.items():
            response.headers[name] = value
        if response.status_code == 200 and (cookie := guard.set_cookie()) is not None:
            response.headers["Set-Cookie"] = cookie

    return {
        "process_request": process_request,
        "process_response": process_response,
        "create_connection": _guarded_connection(websockets),
        "logger": logger,
        "max_size": LARGEST_MESSAGE_BYTES,
    }


def _guarded_connection(websockets: Any) -> type:
    """Make the class of connections: limited in number, and in what and how often their pages send."""
    still_open: set[object] = set()

    class Connection(websockets.ServerConnection):  # type: ignore[misc]
        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            still_open.add(self)
            if len(still_open) > CONNECTIONS:
                transport.abort()

        def connection_lost(self, exc: Exception | None) -> None:
            still_open.discard(self)
            super().connection_lost(exc)

        async def recv(self, decode: bool | None = None) -> Any:
            while True:
                message = await super().recv(decode)
                await asyncio.sleep(1 / MESSAGES_PER_S)  # a faster sender is held back by TCP
                if acceptable(message):
                    return message

    return Connection
