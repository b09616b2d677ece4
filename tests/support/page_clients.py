"""Clients of the live page that a test runs as a process: `python -m support.page_clients KIND URL`, until killed.

`reader` takes everything at once, `slow` one message a second, and `hostile` sends what no page sends.
"""

from __future__ import annotations

import random
import socket
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any
from urllib.parse import urlsplit

import msgspec
import viser
import zstandard
from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect

from quadfringe.evaluation._live import VIEWPOINT

PROTOCOL: Any = f"viser-v{viser.__version__}"
# Values that a control could be sent, of every type that a message can hold.
VALUES: list[Any] = [
    *(0, -1, 1, 3, 2**63, -(2**63), 0.0, -0.0, 0.5, 1e-300, 1e300, float("nan"), float("inf"), -float("inf")),
    *("", "0", "-1", "1e9", "nan", "texture", "surface", "x" * 64, "x" * 10_000, "\x1b[2J", "\x00"),
    *(None, True, False, b"", b"\x00" * 100, [], [1], [[[[]]]], {}, {"value": 1}, {"a": {"b": []}}),
]
# What a page sends for a click into the scene.
CLICK: dict[str, Any] = {
    "type": "ScenePointerMessage",
    "event_type": "click",
    "ray_origin": [0.0, 0.0, 0.0],
    "ray_direction": [0.0, 0.0, 1.0],
    "screen_pos": [[0.5, 0.5]],
    "modifier": None,
}


def opened(address: str, host: str | None = None, receive_bytes: int | None = None, **options: Any) -> ClientConnection:
    """A WebSocket to the page, under another host name and with another origin if they are given."""
    parts = urlsplit(address)
    place = socket.socket()
    if receive_bytes is not None:
        place.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
    place.settimeout(10)
    place.connect(("127.0.0.1", parts.port))
    target = f"ws://{host or parts.netloc}{parts.path}?{parts.query}".rstrip("?")
    return connect(
        target, sock=place, subprotocols=[PROTOCOL], compression=None, max_size=None, close_timeout=1, **options
    )


def first_messages(client: ClientConnection) -> list[dict[str, Any]]:
    """The messages that the page is built from, after a viewpoint as a browser sends it."""
    client.send(msgspec.msgpack.encode(VIEWPOINT))
    found: list[dict[str, Any]] = []
    while not any(message["type"] == "ReplayDoneMessage" for message in found):
        packed = client.recv(timeout=30)
        assert isinstance(packed, bytes)
        size, compressed = (int.from_bytes(packed[first : first + 8], "little") for first in (0, 8))
        inner = zstandard.ZstdDecompressor().decompress(packed[16 : 16 + compressed], max_output_size=size)
        found += msgspec.msgpack.decode(inner)["messages"]
    return found


def update(control: str, /, **values: Any) -> bytes:
    """The message that sets attributes of a control."""
    return msgspec.msgpack.encode({"type": "GuiUpdateMessage", "uuid": control, "updates": values})


def read(address: str) -> None:
    """Read everything at once, as a fast browser does."""
    with opened(address) as client:
        client.send(msgspec.msgpack.encode(VIEWPOINT))
        for _ in client:
            pass


def read_slowly(address: str) -> None:
    """Read one message a second, so that the server can hardly send."""
    with opened(address, receive_bytes=8192, ping_interval=None) as client:
        client.send(msgspec.msgpack.encode(VIEWPOINT))
        for _ in client.recv_streaming():
            time.sleep(1)


def attack(address: str, seed: int = 1) -> None:
    """Connect, send nonsense and break off, again and again."""
    chance = random.Random(seed)
    attacks: list[Callable[[str, random.Random], None]] = [
        *(send_values, send_clicks, flood, pretend, break_off, ask_for_files)
    ]
    while True:
        with suppress(OSError, TimeoutError, EOFError, WebSocketException):
            chance.choice(attacks)(address, chance)


def send_values(address: str, chance: random.Random) -> None:
    """Set controls and other attributes to values of every type."""
    with opened(address) as client:
        uuids = [message["uuid"] for message in first_messages(client) if {"uuid", "props"} <= message.keys()]
        for _ in range(50):
            name = chance.choice(["value", "value", "removed", "sync_cb", "update_cb", "props", "uuid"])
            client.send(update(chance.choice(uuids), **{name: chance.choice(VALUES)}))


def send_clicks(address: str, chance: random.Random) -> None:
    """Click everywhere, and nowhere: with values of every type in place of the ray."""
    with opened(address) as client:
        first_messages(client)
        for _ in range(50):
            client.send(msgspec.msgpack.encode(CLICK | {"ray_direction": [chance.uniform(-1, 1) for _ in range(3)]}))
            client.send(msgspec.msgpack.encode(CLICK | {chance.choice(list(CLICK)): chance.choice(VALUES)}))


def flood(address: str, chance: random.Random) -> None:
    """Send many messages at once, random bytes and viewpoints, some too long."""
    with opened(address) as client:
        for _ in range(2000):
            client.send(chance.randbytes(chance.choice([1, 100, 10_000])))
            client.send(msgspec.msgpack.encode(VIEWPOINT))
        client.send(bytes(1 << 20))


def pretend(address: str, chance: random.Random) -> None:
    """Pretend to be another page, or to have come by another name."""
    port = urlsplit(address).port
    host = chance.choice([f"evil.example:{port}", None])
    opened(address, host, origin=f"http://evil.example:{port}").close()


def break_off(address: str, chance: random.Random) -> None:
    """Open many connections, say half a word, and leave."""
    place = ("127.0.0.1", urlsplit(address).port or 0)
    guests = [socket.create_connection(place, timeout=5) for _ in range(chance.randrange(1, 100))]
    for guest in guests:
        with suppress(OSError):
            guest.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n"[: chance.randrange(60)])
    for guest in guests:
        guest.close()


def ask_for_files(address: str, chance: random.Random) -> None:
    """Ask for files that the page does not serve."""
    path = chance.choice(["/../../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/" + "a" * 9000, "/\x00", "*"])
    with socket.create_connection(("127.0.0.1", urlsplit(address).port or 0), timeout=5) as guest:
        guest.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        assert b"root:" not in guest.recv(1 << 20)


if __name__ == "__main__":
    kind, url = sys.argv[1:]
    {"reader": read, "slow": read_slowly, "hostile": attack}[kind](url)
