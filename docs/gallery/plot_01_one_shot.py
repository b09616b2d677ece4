"""
Four fringe patterns in one exposure
====================================

What the camera sees in a single shot, and the surface that the shot becomes. Red, green and blue are the visible
projector, infrared is the second one.
"""

import matplotlib.pyplot as plt
import numpy as np

import quadfringe as qf
from quadfringe.view.movie import solid_picture

scene = qf.SceneConfig(surface="face", albedo=(0.9, 0.72, 0.62, 0.85), shading=True, noise=0.01, seed=1)
with qf.open(qf.SystemConfig(scene=scene)) as scanner:
    shot = scanner.grab()
    shape = scanner.decode(shot)

visible = np.dstack([shot.red, shot.green, shot.blue]) / shot.full_scale_value
infrared = np.repeat(shot.ir[:, :, None] / shot.full_scale_value, 3, axis=2)
middle = visible.shape[1] // 2
captured = np.hstack([visible[:, :middle], infrared[:, middle:]])

figure, (left, right) = plt.subplots(1, 2, figsize=(10.4, 4.3))
left.imshow(captured)
left.axvline(middle, color="white", linewidth=1)
left.set_title("one exposure: visible | infrared")
right.imshow(solid_picture(shape, shape.colour, turn_deg=(-28, -8), size_px=(1024, 768), field_mm=330))
right.set_title(f"one surface: {shape.returned.sum():,} points")
for axes in (left, right):
    axes.set_axis_off()
plt.show()
