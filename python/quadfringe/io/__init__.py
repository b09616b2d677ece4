"""Read and write images, points and depth maps. This package handles arrays only; records are in `quadfringe.data`."""

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
