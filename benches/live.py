"""Live view: clouds a second to a websocket client and in a browser, beside decoding, and the memory it takes.

    python benches/live.py [--seconds 30] [--browser] [--json FILE]

A camera of 30 shots a second shows six shots of the moving hand, 1024 x 768, in turn; they are decoded with the
published method and served. A client in another process takes the full-resolution clouds and draws nothing; memory is
what the serving process grows by from the second third of the time to the last. With --browser Debian's chromium draws
every 4th point of every 4th row in software instead: clouds are counted where they go to OpenGL, pictures and figures
where the page changes. Bars: 10 clouds/s to the client; 1 cloud/s, 5 pictures/s and 5 figures/s in the browser; exit
status 1 below them.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import shutil
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from itertools import cycle
from pathlib import Path
from typing import Any

import quadfringe as qf
from quadfringe.capture import VirtualConfig
from quadfringe.data import AnyShot
from quadfringe.devices import CameraStatistics, Keep
from quadfringe.files import figures_text
from quadfringe.machine import resident_bytes
from quadfringe.streaming import LiveStream
from quadfringe.viewer import Viewer

SHOTS, RATE_HZ = 6, 30.0
WARM_UP_S = 8.0
CLOUD_BYTES = 5_000_000
BARS = {"clouds": 10.0}
BROWSER_BARS = {"clouds": 1.0, "pictures": 5.0, "figures": 5.0}
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, 0.0, 0.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 800,
    "image_width": 1280,
    "look_at": (0.0, 0.0, 1.0),
    "up_direction": (0.0, -1.0, 0.0),
}
COUNTERS = """
window.counts = {clouds: 0, pictures: 0, figures: 0};
for (const name of ["bufferData", "bufferSubData"]) {
  const upload = WebGL2RenderingContext.prototype[name];
  WebGL2RenderingContext.prototype[name] = function (...args) {
    const data = args.find(value => ArrayBuffer.isView(value));
    if (data instanceof Float32Array && data.byteLength > 200000) window.counts.clouds += 1;
    return upload.apply(this, args);
  };
}
const watch = new MutationObserver(changes => {
  if (changes.some(change => change.target.nodeName === "IMG")) window.counts.pictures += 1;
  if (changes.some(change => change.type === "characterData" || change.target.closest?.("table, p")))
    window.counts.figures += 1;
});
document.addEventListener("DOMContentLoaded", () => watch.observe(document.body,
  {subtree: true, childList: true, characterData: true, attributes: true, attributeFilter: ["src"]}));
"""


class Carousel:
    """A camera that shows the same shots for ever, at its own pace."""

    name, paced, calibration = "carousel", True, None

    def __init__(self, shots: list[AnyShot]) -> None:
        self._shots = shots
        self._given = 0

    def stream(self, count: int | None = None, *, keep: Keep = "latest") -> Iterator[AnyShot]:  # noqa: ARG002
        due = time.monotonic()
        for shot in cycle(self._shots):
            due += 1 / RATE_HZ
            time.sleep(max(0.0, due - time.monotonic()))
            self._given += 1
            yield shot

    def statistics(self) -> CameraStatistics:
        return CameraStatistics(shots=self._given)


def hand_shots() -> tuple[list[AnyShot], qf.Scanner]:
    scene = qf.SceneConfig(surface="hand", noise=0.01)
    decode = qf.DecodeConfig(method="published")
    scanner = qf.open(qf.SystemConfig(capture=VirtualConfig(frame_rate_hz=5.0), scene=scene, decode=decode))
    scanner.projector.show(scanner.config.fringes)
    return list(scanner.camera.stream(SHOTS, keep="all")), scanner


def served(seconds: float, *, browser: bool) -> dict[str, float]:
    shots, scanner = hand_shots()
    memory: list[float] = []
    command = [sys.executable, __file__, "--seconds", str(seconds), *(["--browser"] if browser else []), "--client"]
    with (
        scanner,
        Viewer(port=8400, stride=4 if browser else 1, clouds_per_s=20.0) as viewer,
        LiveStream(Carousel(shots), scanner.decode) as stream,  # type: ignore[arg-type]
    ):
        follower = threading.Thread(target=viewer.follow, args=(stream,))
        follower.start()
        with subprocess.Popen([*command, viewer.url], stdout=subprocess.PIPE, text=True) as client:
            while client.poll() is None:
                time.sleep(0.5)
                memory.append((resident_bytes() or 0) / 1e6)
            assert client.stdout is not None
            counted: dict[str, float] = json.loads(client.stdout.read())
        decoded = stream.statistics().decoded_per_s
        stream.close()
        follower.join()
    third = max(1, len(memory) // 3)
    place = "browser" if browser else "client"
    return {
        **{f"live_{place}_{name}_per_s": rate for name, rate in counted.items()},
        f"live_{place}_decoded_per_s": decoded,
        f"live_{place}_memory_mb": statistics.median(memory[-third:]),
        f"live_{place}_memory_growth_mb": statistics.median(memory[-third:])
        - statistics.median(memory[third : 2 * third]),
    }


def client(url: str, seconds: float) -> dict[str, float]:
    import msgspec
    import viser
    from websockets.asyncio.client import connect

    async def count() -> float:
        protocol: Any = f"viser-v{viser.__version__}"
        address = url.replace("http", "ws")
        async with connect(address, subprotocols=[protocol], max_size=None, compression=None) as socket:
            await socket.send(msgspec.msgpack.encode(CAMERA))  # as a page does; before, it counts as not there yet
            clouds, begin = 0, time.monotonic() + WARM_UP_S
            while (now := time.monotonic()) < begin + seconds:
                message = await socket.recv()
                clouds += len(message) > CLOUD_BYTES and now >= begin
            return clouds / seconds

    return {"clouds": asyncio.run(count())}


def browser(url: str, seconds: float) -> dict[str, float]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        page = chromium.new_page(viewport={"width": 1280, "height": 800})
        page.add_init_script(COUNTERS)
        page.goto(url)
        page.wait_for_timeout(2e3 * WARM_UP_S)
        before, begin = page.evaluate("({...window.counts})"), time.monotonic()
        page.wait_for_timeout(1e3 * seconds)
        after, spent_s = page.evaluate("({...window.counts})"), time.monotonic() - begin
        chromium.close()
    return {name: (after[name] - before[name]) / spent_s for name in after}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--browser", action="store_true")
    parser.add_argument("--client", help=argparse.SUPPRESS)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    if options.client:
        print(json.dumps((browser if options.browser else client)(options.client, options.seconds)))
        return 0
    figures = served(options.seconds, browser=options.browser)
    for key, value in figures.items():
        print(f"{key:36}{value:10.4g}")
    if options.json:
        options.json.write_text(figures_text(figures))
    place, bars = ("browser", BROWSER_BARS) if options.browser else ("client", BARS)
    return int(any(figures[f"live_{place}_{name}_per_s"] < bar for name, bar in bars.items()))


if __name__ == "__main__":
    sys.exit(main())
