"""The live page in the browser, which `quadfringe live` serves.

>>> import quadfringe as qf
>>> with qf.open() as scanner, Viewer() as viewer, scanner.stream() as stream:  # doctest: +SKIP
...     viewer.follow(stream)
>>> from quadfringe.view.viewer import CLOUDS_PER_S, Colouring, Drawn, Viewer
>>> drawn: Drawn = "surface"
>>> colouring: Colouring = "height"
>>> with Viewer(drawn=drawn, colouring=colouring, clouds_per_s=CLOUDS_PER_S) as viewer:  # doctest: +SKIP
...     print(viewer.url)
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, Shape
from quadfringe.recording import RecorderStatistics
from quadfringe.scanner.streaming import LiveStream, Measured, StreamStatistics
from quadfringe.view._address import LOOPBACK
from quadfringe.view._bodies import body_of
from quadfringe.view._controls import CLOUDS_PER_S, Colouring, Controls, Drawn, check_controls
from quadfringe.view._scene import Scene
from quadfringe.view._server import serve_page
from quadfringe.view.colours import Picture, channels_picture, coloured, limits_for, limits_of, phase_picture, texture

__all__ = ["CLOUDS_PER_S", "Colouring", "Drawn", "Viewer"]

Map = NDArray[np.float32]
FIGURES_PERIOD_S = 0.1  # ten updates a second look continuous and cost little
PICTURES_PERIOD_S = 0.1
REPLAYED_MS = 60e3  # older shots come from a recording, which keeps its original time stamps


class Viewer:
    """Serves the page at `url` from background threads; close it, or use it in a `with` block.

    Only this machine can open the page, unless `host` says otherwise ("0.0.0.0": the whole network). Then the page
    opens only with a token, new for every viewer, which `url` contains; nothing is encrypted. Requests of other web
    pages are refused, and requests under a name other than localhost, `host`, the name of this machine, or one of
    `allow_hosts`.

    At most `clouds_per_s` shapes are sent per second (0.1 to 100), with every `stride`-th pixel of every `stride`-th
    row (1 to 64), as points or, with `drawn = "surface"`, as a shaded surface; a slower browser skips shapes and
    delays nothing else. A browser with a graphics card shows 10 and more per second; without one, use a `stride` of 4
    and few shapes. The page has controls for all of it. When `port` is taken, one of the next 99 is used; `url`
    contains it.

    Raises `InputError` for a host that is not of this machine and for values out of range, and `MissingExtraError`
    without the extra `view`.
    """

    def __init__(
        self,
        host: str = LOOPBACK,
        port: int = 8080,
        *,
        stride: int = 2,
        clouds_per_s: float = CLOUDS_PER_S,
        colouring: Colouring = "texture",
        drawn: Drawn = "points",
        allow_hosts: Iterable[str] = (),
    ) -> None:
        check_controls(stride, clouds_per_s, colouring, drawn)
        page = serve_page(host, port, allow_hosts, "quadfringe live")
        self._server, self.url = page.server, page.url
        self._faults = _Faults()
        self._scene = Scene(self._server)
        self._cloud_at = self._pictures_at = 0.0
        self._clouds = 0
        self._depth_mm: tuple[float, float] | None = None
        self._placed = False
        self._last: tuple[Measured, int] | None = None
        self._message = "waiting for the first shot"
        self._build(stride, clouds_per_s, colouring, drawn)
        self._server.on_client_connect(self._show_again)

    @property
    def fault(self) -> str | None:
        """The latest error of the page while it followed a stream; None if there was none."""
        return self._faults.latest

    def _build(self, stride: int, clouds_per_s: float, colouring: Colouring, drawn: Drawn) -> None:
        gui = self._server.gui
        gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False, control_width="large")
        gui.main_panel.dock_right()
        gui.set_panel_label("quadfringe live")
        self._controls = Controls(gui, stride, clouds_per_s, colouring, drawn)
        self._figures = gui.add_markdown(self._message)
        blank = np.full((48, 64, 3), 40, np.uint8)
        with gui.add_folder("Channels: red, green, blue, infrared"):
            self._channels = gui.add_image(blank, format="jpeg", jpeg_quality=80)
        with gui.add_folder("Absolute phase"):
            self._phase = gui.add_image(blank, format="jpeg", jpeg_quality=80)

    def follow(
        self,
        stream: LiveStream,
        recorder: Callable[[], RecorderStatistics] | None = None,
        columns: int = 912,
    ) -> int:
        """Show what a stream measures until it ends; return the number of shots. Figures update between shots too.

        An error of the page does not end the stream: the shot is not shown, and `fault` tells why.
        """
        ended = threading.Event()

        def show_figures() -> None:
            with self._faults:
                self.show_figures(stream.statistics(), recorder() if recorder else None)

        def figures() -> None:
            while not ended.wait(FIGURES_PERIOD_S):
                show_figures()

        watcher = threading.Thread(target=figures, name="figures", daemon=True)
        watcher.start()
        shots = 0
        try:
            for measured in stream:
                shots += 1
                with self._faults:
                    self.show(measured, columns)
        finally:
            ended.set()
            watcher.join()
            show_figures()
        return shots

    def show(self, measured: Measured, columns: int = 912) -> None:
        """Show a shot and its shape, or the reason why it has none; skip pictures and clouds above the page's rates."""
        now = time.monotonic()
        replayed = measured.latency_ms > REPLAYED_MS
        latency = "replayed" if replayed else f"latency {measured.latency_ms:.0f} ms"
        self._message = latency if measured.error is None else f"{latency} · **no shape:** {measured.error}"
        self._last = (measured, columns)
        if self._controls.still or not self._server.get_clients():
            return
        with self._scene.lock:
            self._draw(measured, columns, now)

    def _draw(self, measured: Measured, columns: int, now: float) -> None:
        shape = measured.shape
        if now - self._pictures_at >= PICTURES_PERIOD_S:
            self._pictures_at = now
            self._channels.image = channels_picture(measured.shot)
            if shape is not None:
                self._phase.image = phase_picture(shape, columns)
        period_s = 1.0 / self._controls.clouds_per_s
        if shape is not None and shape.xyz_mm is not None and now - self._cloud_at >= period_s:
            self._cloud_at = max(self._cloud_at + period_s, now - period_s)
            self.show_shape(measured.shot, shape)

    def _show_again(self, _: object) -> None:
        """Show the last shot to a page that has just connected; viser keeps what was drawn before."""
        if self._last is not None:
            with self._faults:
                self.show(*self._last)

    def show_shape(self, shot: AnyShot, shape: Shape) -> None:
        """Show the surface or the points of a calibrated shape immediately."""
        stride = self._controls.stride
        if (least := self._controls.quality) > 0:
            kept = shape.quality[:, :, None] >= least
            shape = replace(shape, xyz_mm=np.where(kept, np.asarray(shape.xyz_mm), np.float32(np.nan)))
        body = body_of(shape, stride, self._painted(shot, shape, stride), surface=self._controls.surface)
        with self._scene.lock:
            if not self._placed and len(body.points_mm):
                self._scene.look_at(body.points_mm)
                self._placed = True
            self._scene.draw(body)
            self._clouds += 1

    def _painted(self, shot: AnyShot, shape: Shape, stride: int) -> Picture:
        """Paint every `stride`-th pixel of every `stride`-th row."""
        colouring = self._controls.colouring
        if colouring == "texture":
            return texture(shot, shape, stride)
        if colouring == "height":
            depth_mm = np.asarray(shape.depth_mm)[::stride, ::stride]
            return coloured(-depth_mm, self._depth_limits(depth_mm))
        known = shape.quality if colouring == "quality" else shape.uncertainty_mm
        values = np.full_like(shape.quality, np.nan) if known is None else known
        return coloured(values[::stride, ::stride], limits_for(colouring, values))

    def _depth_limits(self, depth_mm: Map) -> tuple[float, float]:
        """Return limits of the negative depth that follow the scene slowly, so that the colours do not flicker."""
        near, far = limits_of(depth_mm)
        old = self._depth_mm or (near, far)
        self._depth_mm = (0.9 * old[0] + 0.1 * near, 0.9 * old[1] + 0.1 * far)
        return (-self._depth_mm[1], -self._depth_mm[0])

    def show_figures(self, stream: StreamStatistics, recording: RecorderStatistics | None = None) -> None:
        """Show rates, queues and losses."""
        self._figures.content = "\n".join(
            [f"{self._message} · clouds sent {self._clouds}", "", *_table(stream, recording, self.fault)]
        )

    def close(self) -> None:
        """Stop serving; further calls do nothing."""
        self._scene.close()
        with redirect_stdout(StringIO()):
            self._server.stop()

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


class _Faults:
    """Keeps errors of the page from the measurement that it shows, and remembers the latest."""

    latest: str | None = None

    def __enter__(self) -> None:
        pass

    def __exit__(self, _kind: object, error: BaseException | None, _traceback: object) -> bool:
        if not isinstance(error, Exception):
            return False
        self.latest = f"the page failed: {type(error).__name__}: {error}"
        return True


def _table(stream: StreamStatistics, recording: RecorderStatistics | None, page_fault: str | None) -> list[str]:
    camera = stream.camera
    rows = [
        ("captured", f"{stream.captured_per_s:.1f} /s"),
        ("decoded", f"{stream.decoded_per_s:.1f} /s"),
        ("without a shape", str(stream.refused)),
        ("dropped by the camera", str(camera.dropped)),
        *((f"queue {name}", f"{q.waiting} wait, {q.dropped} dropped") for name, q in stream.queues.items()),
    ]
    if camera.chips:
        rows.append(("frames missed, damaged, unpaired", f"{camera.missed}, {camera.damaged}, {camera.unpaired}"))
    if recording is not None:
        rows.append(("recorded", f"{recording.written} shots, {recording.image_bytes / 1e6:.0f} MB"))
        dropped = stream.queues["record"].dropped if "record" in stream.queues else 0
        rows.append(("not recorded", f"{recording.refused} refused by the disk, {dropped} because it is slow"))
    faults = [fault for fault in (stream.fault, recording.fault if recording else None, page_fault) if fault]
    lines = [f"| {name} | {value} |" for name, value in rows]
    return ["| figure | value |", "| --- | --- |", *lines, *(f"\n**fault:** {fault}" for fault in faults)]
