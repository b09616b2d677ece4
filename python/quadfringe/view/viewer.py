"""The live page in the browser, which `quadfringe live` serves.

>>> from quadfringe.view.viewer import Viewer                                            # doctest: +SKIP
>>> with qf.open() as scanner, Viewer() as viewer, scanner.stream() as stream:
...     viewer.follow(stream)
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from contextlib import redirect_stdout
from io import StringIO

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, Shape
from quadfringe.recording import RecorderStatistics
from quadfringe.scanner.streaming import LiveStream, Measured, StreamStatistics
from quadfringe.view._address import LOOPBACK
from quadfringe.view._controls import CLOUDS_PER_S, Colouring, Controls, check_controls
from quadfringe.view._server import serve_page
from quadfringe.view.colours import Picture, channels_picture, coloured, limits_of, phase_picture, texture

__all__ = ["CLOUDS_PER_S", "Colouring", "Viewer"]

Map = NDArray[np.float32]
M_PER_MM = 1e-3  # the page uses metres, which suit the near and far planes of its camera
FIGURES_PERIOD_S = 0.1  # ten updates a second look continuous and cost little
PICTURES_PERIOD_S = 0.1
REPLAYED_MS = 60e3  # older shots come from a recording, which keeps its original time stamps


class Viewer:
    """Serves the page at `url` from background threads; close it, or use it in a `with` block.

    Only this machine can open the page, unless `host` says otherwise ("0.0.0.0": the whole network). Then the page
    opens only with a token, new for every viewer, which `url` contains; nothing is encrypted. Requests of other web
    pages are refused, and requests under a name other than localhost, `host`, the name of this machine, or one of
    `allow_hosts`.

    At most `clouds_per_s` point clouds are sent per second (0.1 to 100), with every `stride`-th pixel of every
    `stride`-th row (1 to 64); a slower browser skips clouds and delays nothing else. A browser with a graphics card
    shows 10 and more per second; without one, use a `stride` of 4 and few clouds. The page has controls for both. When
    `port` is taken, one of the next 99 is used; `url` contains it.

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
        allow_hosts: Iterable[str] = (),
    ) -> None:
        check_controls(stride, clouds_per_s, colouring)
        page = serve_page(host, port, allow_hosts)
        self._server, self.url = page.server, page.url
        self._faults = _Faults()
        # Pages that connect draw from other threads, and viser fails when two of them replace a cloud at once.
        self._drawing = threading.RLock()
        self._cloud_at = self._pictures_at = 0.0
        self._clouds = 0
        self._depth_mm: tuple[float, float] | None = None
        self._placed = False
        self._last: tuple[Measured, int] | None = None
        self._message = "waiting for the first shot"
        self._build(stride, clouds_per_s, colouring)
        self._server.on_client_connect(self._show_again)

    @property
    def fault(self) -> str | None:
        """The latest error of the page while it followed a stream; None if there was none."""
        return self._faults.latest

    def _build(self, stride: int, clouds_per_s: float, colouring: Colouring) -> None:
        gui = self._server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
        gui.main_panel.dock_right()
        gui.set_panel_label("quadfringe live")
        self._controls = Controls(gui, stride, clouds_per_s, colouring)
        self._figures = gui.add_markdown(self._message)
        blank = np.full((48, 64, 3), 40, np.uint8)
        with gui.add_folder("Channels: red, green, blue, infrared"):
            self._channels = gui.add_image(blank, format="jpeg", jpeg_quality=80)
        with gui.add_folder("Absolute phase"):
            self._phase = gui.add_image(blank, format="jpeg", jpeg_quality=80)
        self._server.scene.set_up_direction("-y")
        # Points are drawn unshaded, so lights and shadows would cost time and change nothing.
        self._server.scene.configure_default_lights(enabled=False, cast_shadow=False)
        # The page makes a new material for each cloud and drops the compiled shader with the last one. Two invisible
        # points keep the shader; otherwise a browser without a graphics card would compile it for every cloud.
        self._add_cloud("/shader", np.zeros((2, 3), np.float32), np.zeros((2, 3), np.uint8), point_size=1e-6)

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
        with self._drawing:
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
        """Show the points of a calibrated shape immediately."""
        stride = self._controls.stride
        points_mm, colours = self._points(shot, shape, stride)
        with self._drawing:
            if not self._placed and len(points_mm):
                self._place_camera(points_mm)
            self._add_cloud("/shape", points_mm, colours, M_PER_MM * stride * _pixel_mm(points_mm, shape))
            self._clouds += 1

    def _add_cloud(self, name: str, points_mm: Map, colours: Picture, point_size: float) -> None:
        self._server.scene.add_point_cloud(
            name,
            points=points_mm,
            colors=colours,
            point_size=point_size,
            point_shape="square",
            point_shading="flat",
            precision="float32",
            scale=M_PER_MM,
        )

    def _points(self, shot: AnyShot, shape: Shape, stride: int) -> tuple[Map, Picture]:
        """Return the valid points, (N, 3) mm, and their colours, (N, 3)."""
        xyz_mm = np.ascontiguousarray(np.asarray(shape.xyz_mm)[::stride, ::stride])
        quality = shape.quality[::stride, ::stride]
        valid = np.flatnonzero(np.isfinite(xyz_mm[:, :, 2]) & (quality >= self._controls.quality))
        picture = self._painted(shot, shape, xyz_mm[:, :, 2], quality, stride)
        return xyz_mm.reshape(-1, 3).take(valid, axis=0), picture.reshape(-1, 3).take(valid, axis=0)

    def _painted(self, shot: AnyShot, shape: Shape, depth_mm: Map, quality: Map, stride: int) -> Picture:
        colouring = self._controls.colouring
        if colouring == "height":
            return coloured(-depth_mm, self._depth_limits(depth_mm))
        if colouring == "quality":
            return coloured(quality, (0.0, 1.0))
        return texture(shot, shape, stride)

    def _depth_limits(self, depth_mm: Map) -> tuple[float, float]:
        """Return limits of the negative depth that follow the scene slowly, so that the colours do not flicker."""
        near, far = limits_of(depth_mm)
        old = self._depth_mm or (near, far)
        self._depth_mm = (0.9 * old[0] + 0.1 * near, 0.9 * old[1] + 0.1 * far)
        return (-self._depth_mm[1], -self._depth_mm[0])

    def _place_camera(self, points_mm: Map) -> None:
        """Set the viewpoint for the first shape: near the camera, slightly from the side."""
        middle_mm = np.median(points_mm[:: max(1, len(points_mm) // 5000)], axis=0)
        middle = M_PER_MM * middle_mm
        eye = middle + float(middle[2]) * np.array([-0.30, -0.22, -0.62])
        view = self._server.initial_camera
        view.position, view.look_at, view.up = tuple(eye), tuple(middle), (0.0, -1.0, 0.0)
        for client in self._server.get_clients().values():
            client.camera.up_direction = (0.0, -1.0, 0.0)
            client.camera.position, client.camera.look_at = tuple(eye), tuple(middle)
        self._placed = True

    def show_figures(self, stream: StreamStatistics, recording: RecorderStatistics | None = None) -> None:
        """Show rates, queues and losses."""
        self._figures.content = "\n".join(
            [f"{self._message} · clouds sent {self._clouds}", "", *_table(stream, recording, self.fault)]
        )

    def close(self) -> None:
        """Stop serving; further calls do nothing."""
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


def _pixel_mm(points_mm: Map, shape: Shape) -> float:
    """Return the size of a point on the surface, mm: one and a half times the distance of neighbouring pixels."""
    if shape.calibration is None or not len(points_mm):
        return 0.3
    depth_mm = float(np.median(points_mm[:: max(1, len(points_mm) // 5000), 2]))
    return 1.5 * depth_mm / shape.calibration.camera.focal_px[0]


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
