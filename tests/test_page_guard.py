"""Who may open the live page: itself, under its names, and other machines only with the token."""

from __future__ import annotations

import http.client
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import pytest
from support.page_clients import PROTOCOL, first_messages, opened
from typer.testing import CliRunner
from websockets.datastructures import Headers
from websockets.exceptions import InvalidStatus

from quadfringe.cli import app
from quadfringe.errors import InputError
from quadfringe.view import _address
from quadfringe.view._guard import Guard
from quadfringe.view.viewer import Viewer


@pytest.fixture(scope="module")
def viewer() -> Iterator[Viewer]:
    with Viewer(port=8300) as page:
        yield page


@pytest.fixture(scope="module")
def guarded() -> Iterator[Viewer]:
    with Viewer("0.0.0.0", port=8320, allow_hosts=["scanner.lab"]) as page:
        yield page


def port_of(page: Viewer) -> int:
    return int(page.url.partition("/?")[0].rsplit(":", 1)[1])


@dataclass
class Answer:
    status: int
    headers: Any
    text: str


def answer(page: Viewer, path: str = "/", **fields: str) -> Answer:
    """The answer to a request with these header fields; `Host` in place of the right one."""
    connection = http.client.HTTPConnection("127.0.0.1", port_of(page), timeout=10)
    fields = {"Host": f"127.0.0.1:{port_of(page)}", **fields}
    connection.putrequest("GET", path, skip_host=True)
    for name, value in fields.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    with closing(connection), connection.getresponse() as response:
        text = "" if response.status == 101 else response.read().decode(errors="replace")
        return Answer(response.status, response.headers, text)


FOREIGN = [
    {"Host": "evil.example"},
    {"Host": "evil.example:8300", "Origin": "http://evil.example:8300"},  # DNS rebinding
    {"Host": "127.0.0.1.evil.example"},
    {"Host": "localhost.evil.example:8300"},
    {"Host": "192.0.2.7"},
    {"Host": ""},
    {"Host": "127.0.0.1@evil.example"},
    {"Host": "127.0.0.1:8300, evil.example"},
    {"Origin": "http://evil.example"},
    {"Origin": "null"},
    {"Origin": "http://127.0.0.1:3000"},  # another page of this machine
    {"Origin": "http://localhost:8300"},  # another origin than 127.0.0.1 to a browser
    {"Origin": "file://"},
]


@pytest.mark.parametrize("fields", FOREIGN, ids=str)
def test_foreign_requests_are_refused(viewer: Viewer, fields: dict[str, str]) -> None:
    response = answer(viewer, **fields)
    assert response.status == 403
    assert "<html" not in response.text


@pytest.mark.parametrize("fields", [fields for fields in FOREIGN if fields.get("Host") != ""], ids=str)
def test_foreign_websockets_are_refused(viewer: Viewer, fields: dict[str, str]) -> None:
    upgrade = {
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "OgExNbk/KbdFPogkDYQejw==",
        "Sec-WebSocket-Protocol": PROTOCOL,
    }
    assert answer(viewer, **upgrade).status == 101
    assert answer(viewer, **upgrade, **fields).status == 403


def test_repeated_fields_are_refused() -> None:
    guard = Guard(frozenset({"here"}), None, "cookie")
    twice = Headers([("Host", "localhost"), ("Host", "evil.example")])
    assert guard.refusal("/", twice) is not None
    assert guard.refusal("/", Headers([("Host", "localhost"), ("Origin", "a"), ("Origin", "http://localhost")]))
    assert guard.refusal("/", Headers([("Host", "HERE:1"), ("Origin", "http://here:1")])) is None


def test_own_page_opens_by_every_name_of_loopback(viewer: Viewer) -> None:
    port = port_of(viewer)
    for host in (f"127.0.0.1:{port}", f"localhost:{port}", f"LOCALHOST:{port}", f"[::1]:{port}", "localhost:9000"):
        response = answer(viewer, Host=host, Origin=f"http://{host.lower()}")
        assert response.status == 200, host
        assert response.headers["X-Frame-Options"] == "DENY"
        assert response.headers["Set-Cookie"] is None
    with opened(viewer.url, origin=f"http://127.0.0.1:{port}") as client:
        assert first_messages(client)


def test_the_page_takes_no_content_from_elsewhere(viewer: Viewer) -> None:
    assert answer(viewer, "/?websocket=ws://evil.example").status == 400
    assert answer(viewer, "/?token=unasked").status == 200


def test_many_parameters_and_odd_bytes_are_refused(viewer: Viewer, guarded: Viewer) -> None:
    """Servers of other ports may set the cookie, to any bytes; the right one counts all the same."""
    assert answer(viewer, f"/?{'a=1&' * 500}").status == 400
    name, token = f"quadfringe-live-{port_of(guarded)}", guarded.url.partition("token=")[2]
    assert answer(guarded, Cookie=f"{name}=\xff\xfe").status == 403
    assert answer(guarded, Cookie=f"{name}=\xff\xfe; {name}={token}").status == 200


def test_other_machines_need_the_token(guarded: Viewer) -> None:
    address, _, token = guarded.url.partition("/?token=")
    bare = f"http://127.0.0.1:{port_of(guarded)}"
    assert address == f"http://{socket.gethostname()}:{port_of(guarded)}"
    assert len(token) >= 32
    for path in (
        "/",
        "/?token=",
        f"/?token={token[:-1]}",
        "/?token=%00",
        "/?token=%C3%A9",
        f"/?token=x&token={token}x",
    ):
        refused = answer(guarded, path)
        assert refused.status == 403
        assert "quadfringe printed" in refused.text
    with pytest.raises(InvalidStatus, match="403"), opened(bare):
        pass
    allowed = answer(guarded, f"/?token={token}", Host=f"scanner.lab:{port_of(guarded)}")
    assert allowed.status == 200
    cookie = allowed.headers["Set-Cookie"].partition(";")[0]
    assert {"HttpOnly", "SameSite=Strict"} <= set(allowed.headers["Set-Cookie"].split("; "))
    with opened(bare, additional_headers={"Cookie": f"other=1; {cookie}"}) as client:
        assert first_messages(client)
    with pytest.raises(InvalidStatus, match="403"), opened(bare, additional_headers={"Cookie": cookie[:-1]}):
        pass
    with (
        pytest.raises(InvalidStatus, match="403"),
        opened(bare, additional_headers={"Cookie": cookie}, origin="http://evil.example"),
    ):
        pass
    assert answer(guarded, "/", Host="evil.example", Cookie=cookie).status == 403


def test_every_viewer_has_another_token(guarded: Viewer) -> None:
    with Viewer("0.0.0.0", port=8330) as other:
        assert other.url.partition("token=")[2] != guarded.url.partition("token=")[2]


@pytest.mark.parametrize(
    ("host", "words"),
    [
        ("192.0.2.1", "cannot serve at '192.0.2.1'"),
        ("", "'' is not known here"),
        ("no such host", "'no such host' is not known here"),
        ("\udcff", "is not known here"),
        ("a" * 300, "is not known here"),
    ],
)
def test_a_host_of_another_machine_is_an_error(host: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Viewer(host, port=8340)


def test_a_silent_name_server_is_not_awaited(monkeypatch: pytest.MonkeyPatch) -> None:
    ended = threading.Event()

    def wait(*_args: object, **_options: object) -> None:
        ended.wait(60)
        raise socket.gaierror("no answer")

    monkeypatch.setattr(_address.socket, "getaddrinfo", wait)
    monkeypatch.setattr(_address, "RESOLVE_S", 0.2)
    began = time.monotonic()
    with pytest.raises(InputError, match="'lab' is not known here"):
        _address.listen("lab", 8340)
    waited_s = time.monotonic() - began
    ended.set()
    assert waited_s < 30, "it waited for the name server"


def test_the_command_names_a_wrong_host_and_leaves_no_recording(tmp_path: Any) -> None:
    recording = tmp_path / "take.h5"
    result = CliRunner().invoke(app, ["live", "--host", "192.0.2.1", "--record", str(recording)])
    assert result.exit_code == 2
    assert result.stderr.startswith("error: host: cannot serve at '192.0.2.1'")
    assert list(tmp_path.iterdir()) == []


def test_a_taken_port_gives_the_next(viewer: Viewer) -> None:
    with Viewer(port=port_of(viewer)) as other:
        assert port_of(other) > port_of(viewer)
    with pytest.raises(InputError, match="port: expected 1 to 65535, got 0"):
        Viewer(port=0)
