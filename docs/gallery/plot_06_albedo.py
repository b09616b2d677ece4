"""
Colours from the same shot
==========================

The joint method separates the fringes from the surface. The rest is the albedo of each channel, as if an even light
had shone, together with the infrared.
"""

import matplotlib.pyplot as plt
import numpy as np

import quadfringe as qf

scene = qf.SceneConfig(surface="plane", patch_mm=24.0, noise=0.01, seed=11)
with qf.open(qf.SystemConfig(scene=scene)) as scanner:
    shot = scanner.grab()
    shape = scanner.decode(shot)

pictures = {
    "captured": np.dstack([shot.red, shot.green, shot.blue]),
    "albedo of red, green and blue": shape.colour,
    "albedo of infrared": shape.albedo[:, :, 3],
}
figure, row = plt.subplots(1, 3, figsize=(12, 3.4))
for axes, (title, picture) in zip(row, pictures.items(), strict=True):
    drawn = axes.imshow(picture, cmap="magma")
    axes.set_title(title)
    axes.set_axis_off()
figure.colorbar(drawn, ax=row[-1], label="share of full scale", shrink=0.8)
plt.show()
