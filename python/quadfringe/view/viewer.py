"""The live page in the browser, which `quadfringe live` serves.

>>> from quadfringe.view.viewer import Viewer                                            # doctest: +SKIP
>>> with qf.open() as scanner, Viewer() as viewer, scanner.stream() as stream:
...     viewer.follow(stream)
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from socket import gethostname
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, Shape
from quadfringe.errors import require
from quadfringe.recording import RecorderStatistics
from quadfringe.scanner.streaming import LiveStream, Measured, StreamStatistics
from quadfringe.view.colours import Picture, channels_picture, coloured, limits_of, phase_picture, texture

if TYPE_CHECKING:
    import viser

__all__ = ["CLOUDS_PER_S", "Colouring", "Viewer"]

Colouring = Literal["texture", "height", "quality"]
Map = NDArray[np.float32]
COLOURINGS: tuple[Colouring, ...] = ("texture", "height", "quality")
CLOUDS_PER_S = 4.0  # the default: a browser without a graphics card keeps up with it
STRIDES = ("1", "2", "4", "8", "16")
M_PER_MM = 1e-3  # the page uses metres, which suit the near and far planes of its camera
FIGURES_PERIOD_S = 0.1  # ten updates a second look continuous and cost little
PICTURES_PERIOD_S = 0.1
LOCAL = "127.0.0.1"
EVERYBODY = ("0.0.0.0", "::")
REPLAYED_MS = 60e3  # older shots come from a recording, which keeps its original time stamps


class Viewer:
    """Serves the page at `url` from background threads; close it, or use it in a `with` block.

    Only this machine can open the page, unless `host` says otherwise ("0.0.0.0": the whole network, without a
    password). At most `clouds_per_s` point clouds are sent per second, with every `stride`-th pixel of every
    `stride`-th row; a slower browser skips clouds and delays nothing else. A browser with a graphics card shows 10 and
    more per second; without one, use a `stride` of 4 and few clouds. The page has controls for both. When `port` is
    taken, the next free one is used; `url` contains it. Raises `MissingExtraError` without the extra `view`.
    """

    def __init__(
        self,
        host: str = LOCAL,
        port: int = 8080,
        *,
        stride: int = 2,
        clouds_per_s: float = CLOUDS_PER_S,
        colouring: Colouring = "texture",
    ) -> None:
        self._server = _serve(host, port)
        self.url = f"http://{gethostname() if host in EVERYBODY else host}:{self._server.get_port()}"
        self._cloud_at = self._pictures_at = 0.0
        self._clouds = 0
        self._depth_mm: tuple[float, float] | None = None
        self._placed = False
        self._last: tuple[Measured, int] | None = None
        self._message = "waiting for the first shot"
        self._build(str(stride), clouds_per_s, colouring)
        self._server.on_client_connect(self._show_again)

    def _build(self, stride: str, clouds_per_s: float, colouring: Colouring) -> None:
        gui = self._server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
        gui.main_panel.dock_right()
        gui.set_panel_label("quadfringe live")
        strides = sorted({stride, *STRIDES}, key=int)
        self._colour = gui.add_dropdown("Colour", COLOURINGS, initial_value=colouring)
        self._stride = gui.add_dropdown("Every n-th point", strides, initial_value=stride)
        self._clouds_per_s = gui.add_slider(
            "Clouds a second",
            min=min(1.0, clouds_per_s),
            max=max(20.0, clouds_per_s),
            step=0.5,
            initial_value=clouds_per_s,
        )
        self._quality = gui.add_slider("Least quality", min=0.0, max=1.0, step=0.05, initial_value=0.0)
        self._frozen = gui.add_checkbox("Hold still", initial_value=False)
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
        """Show what a stream measures until it ends; return the number of shots. Figures update between shots too."""
        ended = threading.Event()

        def figures() -> None:
            while not ended.wait(FIGURES_PERIOD_S):
                self.show_figures(stream.statistics(), recorder() if recorder else None)

        watcher = threading.Thread(target=figures, name="figures", daemon=True)
        watcher.start()
        shots = 0
        try:
            for measured in stream:
                shots += 1
                self.show(measured, columns)
        finally:
            ended.set()
            watcher.join()
            self.show_figures(stream.statistics(), recorder() if recorder else None)
        return shots

    def show(self, measured: Measured, columns: int = 912) -> None:
        """Show a shot and its shape, or the reason why it has none; skip pictures and clouds above the page's rates."""
        now = time.monotonic()
        replayed = measured.latency_ms > REPLAYED_MS
        latency = "replayed" if replayed else f"latency {measured.latency_ms:.0f} ms"
        self._message = latency if measured.error is None else f"{latency} · **no shape:** {measured.error}"
        self._last = (measured, columns)
        if self._frozen.value or not self._server.get_clients():
            return
        shape = measured.shape
        if now - self._pictures_at >= PICTURES_PERIOD_S:
            self._pictures_at = now
            self._channels.image = channels_picture(measured.shot)
            if shape is not None:
                self._phase.image = phase_picture(shape, columns)
        period_s = 1.0 / self._clouds_per_s.value
        if shape is not None and shape.xyz_mm is not None and now - self._cloud_at >= period_s:
            self._cloud_at = max(self._cloud_at + period_s, now - period_s)
            self.show_shape(measured.shot, shape)

    def _show_again(self, _: object) -> None:
        """Show the last shot to a page that has just connected."""
        if self._last is not None:
            self._cloud_at = self._pictures_at = 0.0
            self.show(*self._last)

    def show_shape(self, shot: AnyShot, shape: Shape) -> None:
        """Show the points of a calibrated shape immediately."""
        stride = int(self._stride.value)
        points_mm, colours = self._points(shot, shape, stride)
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
        valid = np.flatnonzero(np.isfinite(xyz_mm[:, :, 2]) & (quality >= self._quality.value))
        picture = self._painted(shot, shape, xyz_mm[:, :, 2], quality, stride)
        return xyz_mm.reshape(-1, 3).take(valid, axis=0), picture.reshape(-1, 3).take(valid, axis=0)

    def _painted(self, shot: AnyShot, shape: Shape, depth_mm: Map, quality: Map, stride: int) -> Picture:
        colouring = self._colour.value
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
            [f"{self._message} · clouds sent {self._clouds}", "", *_table(stream, recording)]
        )

    def close(self) -> None:
        """Stop serving; further calls do nothing."""
        with redirect_stdout(StringIO()):
            self._server.stop()

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def _serve(host: str, port: int) -> viser.ViserServer:
    module: Any = require("viser", "view")
    with redirect_stdout(StringIO()):  # viser prints a banner even with verbose=False
        server: viser.ViserServer = module.ViserServer(host=host, port=port, label="quadfringe", verbose=False)
    return server


def _pixel_mm(points_mm: Map, shape: Shape) -> float:
    """Return the size of a point on the surface, mm: one and a half times the distance of neighbouring pixels."""
    if shape.calibration is None or not len(points_mm):
        return 0.3
    depth_mm = float(np.median(points_mm[:: max(1, len(points_mm) // 5000), 2]))
    return 1.5 * depth_mm / shape.calibration.camera.focal_px[0]


def _table(stream: StreamStatistics, recording: RecorderStatistics | None) -> list[str]:
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
        rows.append(("not recorded", str(recording.refused)))
    faults = [fault for fault in (stream.fault, recording.fault if recording else None) if fault]
    lines = [f"| {name} | {value} |" for name, value in rows]
    return ["| figure | value |", "| --- | --- |", *lines, *(f"\n**fault:** {fault}" for fault in faults)]
