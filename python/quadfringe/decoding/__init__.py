"""From a shot to a shape: the kernel's decoder planned once, the verdict on its result, and the stages one by one.

>>> import numpy as np
>>> from quadfringe.decoding import *
>>> rows, columns = 24, 400
>>> steps = 2 * np.pi * np.arange(4) / 4
>>> stacks = [  # a flat board that a camera sees column by column, in four steps at three fringe numbers
...     np.tile(0.5 + 0.4 * np.cos(2 * np.pi * n * np.arange(columns) / columns + steps[:, None, None]), (1, rows, 1))
...     for n in (16, 15, 12)
... ]
>>> stacks = [stack.astype(np.float32) for stack in stacks]
>>> shape = decode_steps(stacks, (16, 15, 12), columns, settings=StepSettings(channel="ir"))
>>> float(np.round(shape.column_px[12, 200], 2))
200.0
>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> from quadfringe.io import write_image
>>> with TemporaryDirectory() as folder:
...     for i, image in enumerate(np.concatenate(stacks)):
...         write_image(Path(folder) / f"{i:02d}.png", np.round(255 * image).astype(np.uint8))
...     read = read_steps(folder, count=3, steps=4)
>>> [stack.shape for stack in read]
[(4, 24, 400), (4, 24, 400), (4, 24, 400)]
"""

from quadfringe.decoding.decoder import Decoder, decode
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.reference import StepSettings, decode_steps
from quadfringe.decoding.response import estimate_response
from quadfringe.decoding.step_files import read_steps

__all__ = ["Decoder", "Plan", "StepSettings", "decode", "decode_steps", "estimate_response", "read_steps"]
