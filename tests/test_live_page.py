"""The live page: what a page may send, and that its faults stay on the page."""

from __future__ import annotations

import gzip
import socket
from collections import deque
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any
from urllib.request import Request, urlopen

import msgspec
import numpy as np
import pytest
import viser
from support.page_clients import CLICK, VALUES, first_messages, opened, update
from websockets.exceptions import ConnectionClosedError, InvalidStatus

import quadfringe as qf
from quadfringe.errors import InputError, MissingExtraError
from quadfringe.evaluation._live import VIEWPOINT
from quadfringe.evaluation.demo import live_system
from quadfringe.scanner.streaming import Measured
from quadfringe.view import _server
from quadfringe.view._messages import LARGEST_MESSAGE_BYTES, acceptable
from quadfringe.view.viewer import Viewer

SMALL = """
[camera]
width_px = 160
height_px = 120
focal_px = [403.0, 403.0]
centre_px = [79.5, 59.5]

[scene]
surface = "hand"

[decode]
method = "published"
"""


@pytest.fixture(scope="module")
def viewer() -> Iterator[Viewer]:
    with Viewer(port=8355) as page:
        yield page


@pytest.fixture(scope="module")
def scanner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[qf.Scanner]:
    path = tmp_path_factory.mktemp("small") / "system.toml"
    path.write_text(SMALL)
    with qf.open(path) as opened:
        yield opened


@pytest.fixture(scope="module")
def measured(scanner: qf.Scanner) -> Measured:
    with scanner.stream(1) as stream:
        return next(iter(stream))


@pytest.mark.parametrize("packing", ["identity", "gzip"])
def test_the_tab_of_the_browser_has_a_title_of_its_own(viewer: Viewer, packing: str) -> None:
    with urlopen(Request(viewer.url, headers={"Accept-Encoding": packing})) as answer:
        page = answer.read()
        assert int(answer.headers["Content-Length"]) == len(page)
    page = gzip.decompress(page) if packing == "gzip" else page
    assert page.count(b"<title>quadfringe live</title>") == 1
    assert b"<title>Viser</title>" not in page


def test_without_a_system_a_hand_moves() -> None:
    with qf.open(live_system()) as scanner:
        scanner.projector.show(scanner.config.fringes)
        first, later = scanner.camera.stream(2, keep="all")
    assert np.abs(later.first.astype(float) - first.first).max() > 100


def port_of(page: Viewer) -> int:
    return int(page.url.partition("/?")[0].rsplit(":", 1)[1])


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"stride": 0}, "stride: expected a whole number from 1 to 64, got 0"),
        ({"stride": 2.5}, "stride: expected a whole number"),
        ({"clouds_per_s": 0.0}, "clouds_per_s: expected 0.1 to 100, got 0.0"),
        ({"clouds_per_s": float("nan")}, "clouds_per_s: expected 0.1 to 100, got nan"),
        ({"colouring": "red"}, "colouring: expected texture, height, quality, uncertainty, got 'red'"),
        ({"drawn": "lines"}, "drawn: expected surface, points, got 'lines'"),
    ],
)
def test_wrong_settings_are_named(settings: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Viewer(port=8345, **settings)


def test_a_viser_that_cannot_be_guarded_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    stopped = []
    other = SimpleNamespace(__version__="9", ViserServer=lambda **_: SimpleNamespace(stop=lambda: stopped.append(1)))
    real = _server.require
    monkeypatch.setattr(_server, "require", lambda name, extra: other if name == "viser" else real(name, extra))
    with pytest.raises(MissingExtraError, match="cannot be guarded with viser 9"):
        Viewer(port=8350)
    assert stopped == [1]
    with socket.create_server(("127.0.0.1", 8350)):  # the port is free again
        pass


def test_control_values_of_every_type_change_nothing_else(
    measured: Measured, scanner: qf.Scanner, capfd: pytest.CaptureFixture[str]
) -> None:
    with Viewer(port=8360) as page, opened(page.url) as client:
        controls = [message for message in first_messages(client) if {"uuid", "props"} <= message.keys()]
        uuids = [message["uuid"] for message in controls]
        assert len(uuids) >= 8
        for value in VALUES:
            for uuid in uuids:
                client.send(update(uuid, value=value))
            page.show(measured)
            page.show_shape(measured.shot, measured.shape)
        for name in ("removed", "sync_cb", "update_cb", "props", "uuid", "value", "__class__"):
            client.send(update(uuids[-1], **{name: 1, "value": 1}))
        for junk in (
            b"",
            b"\xc1",
            b"\x91" * 5000,
            msgspec.msgpack.encode({"type": "RunJavascriptMessage", "source": ""}),
        ):
            client.send(junk)
        client.send("text")
        with scanner.stream(3, keep="all") as stream:
            assert page.follow(stream) == 3
        assert page.fault is None
        with opened(page.url) as another:  # the page is still whole
            assert {message["type"] for message in controls} <= {m["type"] for m in first_messages(another)}
    assert capfd.readouterr() == ("", "")


def test_controls_stay_within_their_limits(measured: Measured) -> None:
    class Gui:
        def __getattr__(self, _name: str) -> Any:
            return lambda *_args, **_options: SimpleNamespace(value=None)

    from quadfringe.view._controls import Controls

    controls = Controls(Gui(), 2, 4.0, "height", "points")
    for value in VALUES:
        for name in ("_drawn", "_colouring", "_stride", "_clouds_per_s", "_quality", "_still"):
            getattr(controls, name).value = value
        assert controls.surface is (value == "surface")
        assert controls.colouring in ("texture", "height", "quality", "uncertainty")
        assert controls.stride in (1, 2, 4, 8, 16)
        assert 0.1 <= controls.clouds_per_s <= 100
        assert 0 <= controls.quality <= 1
        assert controls.still is (value is True)
    assert measured.shape is not None


@pytest.mark.parametrize(
    "change",
    [
        {"event_type": "rect-select"},
        {"event_type": "rect-select", "ray_origin": None, "ray_direction": None, "screen_pos": [[0, 0], [1, 1]]},
        {"event_type": ["click"]},
        {"modifier": "shift"},
        {"modifier": {}},
        {"ray_origin": None},
        {"ray_origin": [0.0, 0.0]},
        {"ray_origin": [0.0, 0.0, 1e7]},
        {"ray_origin": [0.0, 0.0, float("nan")]},
        {"ray_origin": [0.0, 0.0, True]},
        {"ray_direction": [0.0, 0.0, 2.0]},
        {"ray_direction": [0.0, 0.0, float("inf")]},
        {"ray_direction": "001"},
        {"screen_pos": []},
        {"screen_pos": [[0.5, 0.5], [0.5, 0.5]]},
        {"screen_pos": [[0.5, 1e3]]},
        {"screen_pos": [[0.5, [0.5]]]},
        {"screen_pos": {"0": [0.5, 0.5]}},
        {"owner": "1"},
        {"type": "SceneNodeClickMessage"},
    ],
    ids=str,
)
def test_only_plain_clicks_are_accepted(change: dict[str, Any]) -> None:
    assert acceptable(msgspec.msgpack.encode(CLICK))
    assert not acceptable(msgspec.msgpack.encode(CLICK | change))


def test_only_viewpoints_and_values_are_accepted() -> None:
    encode = msgspec.msgpack.encode
    value = {"type": "GuiUpdateMessage", "uuid": "u", "updates": {"value": 2}}
    assert acceptable(encode(VIEWPOINT))
    assert acceptable(encode(value))
    assert not acceptable(encode(VIEWPOINT | {"position": (float("nan"), 0.0, 0.0)}))
    assert not acceptable(encode(VIEWPOINT | {"position": [0.0] * 5}))
    assert not acceptable(encode(VIEWPOINT | {"fov": "1"}))
    assert not acceptable(encode(value | {"updates": {"value": 2, "removed": True}}))
    assert not acceptable(encode(value | {"uuid": []}))
    for kind in viser._messages.Message.get_subclasses():
        assert not acceptable(encode({"type": kind.__name__})) or kind.__name__ == "ViewerCameraMessage"


def test_long_messages_and_many_connections_are_refused(viewer: Viewer) -> None:
    with opened(viewer.url) as client:
        client.send(b"\x00" * (LARGEST_MESSAGE_BYTES + 1))
        with pytest.raises(ConnectionClosedError, match="1009"):
            deque(client, maxlen=0)
    idle = [socket.create_connection(("127.0.0.1", port_of(viewer)), timeout=10) for _ in range(_server.CONNECTIONS)]
    with socket.create_connection(("127.0.0.1", port_of(viewer)), timeout=10) as one_more:
        assert one_more.recv(1) == b""
    for guest in idle:
        guest.close()
    pages = [opened(viewer.url) for _ in range(_server.PAGES)]
    with pytest.raises(InvalidStatus, match="503"):
        opened(viewer.url)
    for page in pages:
        page.close()


def test_a_fault_of_the_page_ends_nothing(scanner: qf.Scanner, tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from quadfringe.recording import Recorder

    def fail(*_args: object, **_options: object) -> None:
        raise ZeroDivisionError("division by zero")

    recorder = Recorder(tmp_path / "take.h5", scanner.config, scanner.calibration)
    with Viewer(port=8370) as page, opened(page.url) as client:
        first_messages(client)
        for name in ("show_shape", "show_figures"):
            monkeypatch.setattr(page, name, fail)
        with recorder, scanner.stream(6, keep="all", taps={"record": recorder.write}) as stream:
            assert page.follow(stream, recorder.statistics) == 6
        assert page.fault == "the page failed: ZeroDivisionError: division by zero"
    done = recorder.statistics()
    assert (done.written, done.refused) == (6, 0)


def test_a_stopped_server_does_not_end_the_measurement(scanner: qf.Scanner) -> None:
    page = Viewer(port=8380)
    page.close()
    with scanner.stream(3, keep="all") as stream:
        assert page.follow(stream) == 3
    assert np.isfinite(stream.statistics().decoded_per_s)
