"""
Two methods on one shot
=======================

The published method treats every strip of rows alone and is fast; the joint method uses all channels and the
neighbourhood of each pixel. Both maps have one scale, linear up to 0.05 mm and then logarithmic; zero is white, and
slate is no data.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import SymLogNorm

import quadfringe as qf

scene = qf.SceneConfig(surface="peaks", patch_mm=25.0, noise=0.02, seed=9)
with qf.open(qf.SystemConfig(scene=scene)) as scanner:
    shot = scanner.grab()
    shapes = {"joint": scanner.decode(shot)}
    scanner.change_decode(method="published")
    shapes["published"] = scanner.decode(shot)

figure, row = plt.subplots(1, 2, figsize=(10.4, 3.9))
scale = SymLogNorm(linthresh=0.05, vmin=-3, vmax=3)  # linear up to 0.05 mm, then logarithmic
for axes, (method, shape) in zip(row, shapes.items(), strict=True):
    error_mm = shape.depth_mm - shot.truth.xyz_mm[:, :, 2]
    drawn = axes.imshow(error_mm, cmap="RdBu_r", norm=scale)
    axes.set_facecolor("#4a5568")
    rms_mm = np.sqrt(np.nanmean(np.clip(error_mm, -20, 20) ** 2))
    axes.set_title(f"{method}: {np.nanmedian(np.abs(error_mm)):.2f} mm median, {rms_mm:.2f} mm RMS")
    axes.set_xticks([])
    axes.set_yticks([])
figure.colorbar(drawn, ax=row, label="depth error, mm", shrink=0.85, extend="both")
plt.show()
