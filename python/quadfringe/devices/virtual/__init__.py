"""A bench without hardware: a camera and two projectors in front of a simulated scene.

>>> import numpy as np
>>> import quadfringe as qf
>>> from quadfringe.devices.virtual import *
>>> small = qf.Device(width_px=256, height_px=192, focal_px=(645, 645), centre_px=(127.5, 95.5))
>>> config = qf.SystemConfig(camera=small, scene=qf.SceneConfig(surface="plane"))
>>> bench = VirtualBench(config)
>>> projector, camera = VirtualProjector(bench), VirtualCamera(bench)
>>> projector.show(qf.Fringes())
>>> camera.snap().ir.shape
(192, 256)
>>> pose = np.eye(4)
>>> pose[2, 3] = 800.0
>>> ink = np.kron(np.indices((4, 4)).sum(axis=0) % 2, np.ones((20, 20))).astype(np.float32)  # a chequered board
>>> bench.place(PrintedBoard(ink, 1.0, ((-40.0, -40.0), (40.0, 40.0)), paper=(0.9,) * 4, ink=(0.1,) * 4), pose)
>>> bench.project_levels((1.0, 1.0, 1.0, 1.0))
>>> len(np.unique(bench.expose().red[96, 70:186])) > 1
True
>>> open_devices(config).config.camera == small  # what opens `capture = "virtual:"`
True
"""

from quadfringe.devices.virtual._bench import PrintedBoard, VirtualBench
from quadfringe.devices.virtual._devices import VirtualCamera, VirtualProjector, open_devices

__all__ = ["PrintedBoard", "VirtualBench", "VirtualCamera", "VirtualProjector", "open_devices"]
