"""
How fine a relief is left?
==========================

Waves of 1 mm height become narrower to the right, from 40 mm to 2.5 mm, while a fringe is about 11 mm wide. Long after
they are narrower than a fringe, most of their height is left; then it falls, and so does that of any small detail.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LightSource

import quadfringe as qf
from quadfringe.config import HeightMapConfig

pitch_mm, width_mm = 0.25, 320.0
x_mm = np.arange(0, width_mm, pitch_mm)
periods_mm = np.geomspace(40, 2.5, x_mm.size)
heights_mm = np.tile(0.5 * np.sin(2 * np.pi * np.cumsum(pitch_mm / periods_mm)), (1000, 1))

with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "waves.npy"
    np.save(file, heights_mm)
    relief = HeightMapConfig(file=file, pitch_mm=(pitch_mm, pitch_mm), origin_mm=(-160.0, -125.0), z_mm=800.0)
    scene = qf.SceneConfig(height_map=relief, noise=0.005, seed=1)
    with qf.open(qf.SystemConfig(scene=scene)) as scanner:
        shot = scanner.grab()
        shape = scanner.decode(shot)

height_mm = 800 - shape.depth_mm
light = LightSource(azdeg=270, altdeg=40)
shaded = light.hillshade(np.nan_to_num(height_mm), vert_exag=2)
middle = slice(300, 460)

figure, (top, bottom) = plt.subplots(2, 1, figsize=(9.6, 5.2), sharex=True, gridspec_kw={"height_ratios": (1, 1.1)})
top.imshow(shaded[middle], cmap="gray", aspect="auto", extent=(0, shaded.shape[1], 160, 0))
top.set_title("measured surface, shaded")
top.set_yticks([])
bottom.plot(800 - shot.truth.xyz_mm[380, :, 2], color="#8b95a5", linewidth=3, alpha=0.5, label="truth")
bottom.plot(height_mm[380], linewidth=1.1, label="measured, one row of one shot")
bottom.set_ylim(-1.1, 1.1)
bottom.set_xlabel("column, px")
bottom.set_ylabel("height, mm")
figure.legend(*bottom.get_legend_handles_labels(), loc="outside lower right", ncols=2)
plt.show()
