"""
From fringes to absolute phase
==============================

Red and blue give the phase within one fringe, from -π to π at every pixel. Green and infrared tell which fringe it is,
so that the phase grows without jumps over the whole image, and the depth follows. Slate is no data: shadows and edges.
"""

import matplotlib.pyplot as plt
import numpy as np

import quadfringe as qf
from quadfringe import stages

with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface="face", shading=True, noise=0.02, seed=3))) as scanner:
    shot = scanner.grab()
    shape = scanner.decode(shot)
    light = stages.linear_light(shot, scanner.calibration)
wrapped = stages.wrapped_phases(light, scanner.config.fringes.numbers)

panels = (
    ("wrapped phase of red and blue", np.where(shape.returned, wrapped[0], np.nan), "twilight", "rad"),
    ("absolute phase", shape.phase_rad, "turbo", "rad"),
    ("depth", shape.depth_mm, "cividis_r", "mm"),
)
figure, row = plt.subplots(1, 3, figsize=(12, 3.3))
for axes, (title, values, colours, unit) in zip(row, panels, strict=True):
    drawn = axes.imshow(values, cmap=colours)
    axes.set_title(title)
    axes.set_facecolor("#4a5568")
    axes.set(xticks=[], yticks=[])
    figure.colorbar(drawn, ax=axes, label=unit, shrink=0.85, pad=0.02)
plt.show()
