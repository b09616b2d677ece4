"""Read and write images, points and depth maps. This package handles arrays only; records are in `quadfringe.data`.

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> import numpy as np
>>> from quadfringe.io import *
>>> grey = np.arange(12, dtype=np.uint16).reshape(3, 4)
>>> colour = np.zeros((3, 4, 3), np.uint8)
>>> depth_mm = np.full((3, 4), 800.0, np.float32)
>>> with TemporaryDirectory() as name:
...     folder = Path(name)
...     write_image(folder / "grey.png", grey)
...     write_image(folder / "colour.png", colour)
...     read_grey(folder / "grey.png").dtype, read_image(folder / "grey.png").shape
...     read_rgb(folder / "colour.png").shape
...     write_npz(folder / "maps.npz", {"depth_mm": depth_mm}, {"note": "a text"})
...     sorted(read_npz(folder / "maps.npz"))
...     np.save(folder / "depth.npy", depth_mm)
...     read_npy(folder / "depth.npy").shape
...     write_depth(folder / "depth.tif", depth_mm)
...     write_ply(folder / "points.ply", depth_mm.reshape(4, 3), colour[0], {"quality": np.ones(4, np.float32)})
(dtype('uint16'), (3, 4))
(3, 4, 3)
['depth_mm', 'note']
(3, 4)
"""

from quadfringe.io.arrays import read_npy, read_npz
from quadfringe.io.export import write_depth, write_npz, write_ply
from quadfringe.io.images import read_grey, read_image, read_rgb, write_image

__all__ = [
    "read_grey",
    "read_image",
    "read_npy",
    "read_npz",
    "read_rgb",
    "write_depth",
    "write_image",
    "write_npz",
    "write_ply",
]
