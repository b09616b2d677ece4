"""Live view: point clouds per second to a websocket client and to a browser while decoding, and memory.

    python benches/live.py [--seconds 30] [--browser [--screenshot FILE.png]] [--surface] [--clouds 2] [--json FILE]
    python benches/live.py --bench [--seconds 30] [--json FILE]

A camera of 30 shots a second repeats six shots of the moving hand, 1024 x 768; the published method decodes them and
the viewer serves them. A client in another process receives full-resolution clouds without drawing them. The memory
figure is the growth of the serving process from the second third of the time to the last. With --browser, Debian's
chromium draws every 4th point of every 4th row in software, at the rate of `quadfringe live`; --clouds sets another
rate: more clouds leave less time for pictures and figures. With --surface, a cloud is a surface through these points.
Clouds are counted at their upload to OpenGL, pictures and figures at changes of the page. Bars: 10 clouds/s to the
client; 1 cloud/s, 5 pictures/s and 5 figures/s in the browser; the exit status is 1 below them. Surfaces, which are
for graphics cards, have no bars.

With --bench, the camera is the virtual bench of `quadfringe live`, which renders the moving hand: shots a second that
are rendered and decoded while one client gets the surfaces of the page. Bar: 10 shots/s on two cores. Before that,
the shortest of some shots of the reference bench, 1024 x 768, of the hand at rest and moving, with the processor time.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import quadfringe as qf
from quadfringe.config.cameras import VirtualConfig
from quadfringe.data import AnyShot
from quadfringe.evaluation._live import VIEWPOINT, Carousel
from quadfringe.evaluation._page import Page
from quadfringe.evaluation.demo import live_system
from quadfringe.evaluation.machine import resident_bytes
from quadfringe.files import figures_text
from quadfringe.scanner.streaming import LiveStream
from quadfringe.view.viewer import CLOUDS_PER_S, Drawn, Viewer

SHOTS, RATE_HZ = 6, 30.0
WARM_UP_S = 8.0
SENT_PER_S = 20.0  # requested clouds: more than the client receives
CLOUD_BYTES = 5_000_000
BARS = {"clouds": 10.0}
BENCH_BAR = 10.0
GRABS = 8
BROWSER_BARS = {"clouds": 1.0, "pictures": 5.0, "figures": 5.0}
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


def hand_shots() -> tuple[list[AnyShot], qf.Scanner]:
    scene = qf.SceneConfig(surface="hand", noise=0.01)
    decode = qf.DecodeConfig(method="published")
    scanner = qf.open(qf.SystemConfig(capture=VirtualConfig(frame_rate_hz=5.0), scene=scene, decode=decode))
    scanner.projector.show(scanner.config.fringes)
    return list(scanner.camera.stream(SHOTS, keep="all")), scanner


def served(
    seconds: float, clouds_per_s: float, *, browser: bool, drawn: Drawn, screenshot: Path | None = None
) -> dict[str, float]:
    shots, scanner = hand_shots()
    memory: list[float] = []
    command = [sys.executable, __file__, "--seconds", str(seconds), *(["--browser"] if browser else [])]
    command += [*(["--screenshot", str(screenshot)] if screenshot else [])]
    command += [*(["--surface"] if drawn == "surface" else []), "--client"]
    with (
        scanner,
        Viewer(port=8400, stride=4 if browser else 1, clouds_per_s=clouds_per_s, drawn=drawn) as viewer,
        LiveStream(Carousel(shots, RATE_HZ), scanner.decode) as stream,  # type: ignore[arg-type]
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


def bench(seconds: float) -> dict[str, float]:
    command = [sys.executable, __file__, "--seconds", str(seconds), "--client"]
    with qf.open(live_system()) as scanner, Viewer(port=8400, drawn="surface") as viewer, scanner.stream() as stream:
        follower = threading.Thread(target=viewer.follow, args=(stream,))
        follower.start()
        with subprocess.Popen([*command, viewer.url], stdout=subprocess.DEVNULL) as client:
            time.sleep(WARM_UP_S)
            shots, begin, spent = stream.statistics().camera.shots, time.monotonic(), time.process_time()
            time.sleep(seconds)
            seen = stream.statistics().camera.shots - shots
            spent_s, cpu_s = time.monotonic() - begin, time.process_time() - spent
            client.terminate()
        stream.close()
        follower.join()
    return {"live_bench_shots_per_s": seen / spent_s, "live_bench_cpu_ms": 1e3 * cpu_s / seen}


def grabs() -> dict[str, float]:
    found = {}
    for name, rate_hz in (("still", None), ("moving", 5.0)):
        scene = qf.SceneConfig(surface="hand", noise=0.01)
        with qf.open(qf.SystemConfig(capture=VirtualConfig(frame_rate_hz=rate_hz), scene=scene)) as scanner:
            scanner.grab()
            spent = []
            for _ in range(GRABS):
                begin, cpu = time.perf_counter(), time.process_time()
                scanner.camera.snap()
                spent.append((time.perf_counter() - begin, time.process_time() - cpu))
        wall_s, cpu_s = (min(times) for times in zip(*spent, strict=True))
        found |= {f"grab_{name}_ms": 1e3 * wall_s, f"grab_{name}_cpu_ms": 1e3 * cpu_s}
    return found


def client(url: str, seconds: float) -> dict[str, float]:
    import msgspec
    import viser
    from websockets.asyncio.client import connect as connect_async

    async def count() -> float:
        protocol: Any = f"viser-v{viser.__version__}"
        address = url.replace("http", "ws")
        async with connect_async(address, subprotocols=[protocol], max_size=None, compression=None) as socket:
            await socket.send(msgspec.msgpack.encode(VIEWPOINT))  # as a page does; before, it counts as not there yet
            clouds, begin = 0, time.monotonic() + WARM_UP_S
            while (now := time.monotonic()) < begin + seconds:
                message = await socket.recv()
                clouds += len(message) > CLOUD_BYTES and now >= begin
            return clouds / seconds

    return {"clouds": asyncio.run(count())}


def browser(url: str, seconds: float, screenshot: Path | None, *, surface: bool) -> dict[str, float]:
    # A surface has several arrays of floats, and one of corners.
    counters = COUNTERS.replace("Float32Array", "Uint32Array") if surface else COUNTERS
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder, closing(Page(folder)) as page:
        page.ask("Page.enable")
        page.ask("Page.addScriptToEvaluateOnNewDocument", source=counters)
        page.ask("Page.navigate", url=url)
        time.sleep(2 * WARM_UP_S)
        before, begin = page.value("({...window.counts})"), time.monotonic()
        time.sleep(seconds)
        after, spent_s = page.value("({...window.counts})"), time.monotonic() - begin
        if screenshot is not None:
            page.picture(screenshot)
    return {name: (after[name] - before[name]) / spent_s for name in after}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--browser", action="store_true")
    parser.add_argument("--screenshot", type=Path, help="with --browser: the page at the end")
    parser.add_argument("--surface", action="store_true", help="a shaded surface in place of points")
    parser.add_argument("--clouds", type=float, help="clouds a second that are asked for")
    parser.add_argument("--bench", action="store_true", help="the virtual bench as the camera")
    parser.add_argument("--client", help=argparse.SUPPRESS)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    if options.client:
        seconds, url = options.seconds, options.client
        if options.browser:
            counted = browser(url, seconds, options.screenshot, surface=options.surface)
        else:
            counted = client(url, seconds)
        print(json.dumps(counted))
        return 0
    if options.bench:
        return report(grabs() | bench(options.seconds), options.json, {"live_bench_shots_per_s": BENCH_BAR})
    clouds_per_s = options.clouds or (CLOUDS_PER_S if options.browser else SENT_PER_S)
    drawn: Drawn = "surface" if options.surface else "points"
    figures = served(options.seconds, clouds_per_s, browser=options.browser, drawn=drawn, screenshot=options.screenshot)
    place, bars = ("browser", BROWSER_BARS) if options.browser else ("client", BARS)
    held = {} if options.surface else {f"live_{place}_{name}_per_s": bar for name, bar in bars.items()}
    return report(figures, options.json, held)


def report(figures: dict[str, float], file: Path | None, bars: dict[str, float]) -> int:
    for key, value in figures.items():
        print(f"{key:36}{value:10.4g}")
    if file:
        file.write_text(figures_text(figures))
    return int(any(figures[name] < bar for name, bar in bars.items()))


if __name__ == "__main__":
    sys.exit(main())
