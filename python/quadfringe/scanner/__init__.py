"""A projector, a camera and a decoder that belong together: single shots and streams.

>>> import quadfringe as qf
>>> from quadfringe.scanner import *
>>> camera = qf.Device(width_px=256, height_px=192, focal_px=(645, 645), centre_px=(127.5, 95.5))
>>> system = qf.SystemConfig(camera=camera, scene=qf.SceneConfig(surface="sphere", noise=0.01))
>>> seen: list[int] = []
>>> count: Tap = lambda shot: seen.append(shot.stamp.id)  # called with every shot, in another thread
>>> with open_system(system) as scanner, scanner.stream(3, keep="all", taps={"count": count}) as stream:
...     isinstance(scanner, Scanner), isinstance(stream, LiveStream)
...     for measured in stream:
...         assert isinstance(measured, Measured) and measured.result().returned.any()
...     statistics = stream.statistics()
(True, True)
>>> isinstance(statistics, StreamStatistics), statistics.refused, len(seen)
(True, 0, 3)
"""

from quadfringe.scanner.scanner import Scanner, open_system
from quadfringe.scanner.streaming import LiveStream, Measured, StreamStatistics, Tap

__all__ = ["LiveStream", "Measured", "Scanner", "StreamStatistics", "Tap", "open_system"]
