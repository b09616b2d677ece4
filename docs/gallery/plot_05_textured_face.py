"""
A painted face
==============

The printed squares change the brightness of every channel at once. The shape below them must not change: their edges
are edges of colour, not of depth.
"""

import matplotlib.pyplot as plt
import numpy as np

import quadfringe as qf
from quadfringe.view.movie import solid_picture

scene = qf.SceneConfig(surface="face", patch_mm=14.0, shading=True, noise=0.01, seed=2)
with qf.open(qf.SystemConfig(scene=scene)) as scanner:
    shot = scanner.grab()
    shape = scanner.decode(shot)

plaster = np.full_like(shape.colour, 205)
view = {"turn_deg": (-26, -8), "size_px": (800, 640), "field_mm": 310}
pictures = {
    "captured: fringes on colours": np.dstack([shot.red, shot.green, shot.blue]),
    "surface with its colours": solid_picture(shape, shape.colour, **view),
    "surface alone": solid_picture(shape, plaster, **view),
}
figure, row = plt.subplots(1, 3, figsize=(12, 3.4))
for axes, (title, picture) in zip(row, pictures.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()
