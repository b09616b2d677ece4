"""
A moving hand, shot by shot
===========================

The fingers close and open. Every picture is one exposure and one complete surface: nothing is carried over from the
shot before.
"""

import matplotlib.pyplot as plt

import quadfringe as qf
from quadfringe.evaluation.moving_scene import hand_system
from quadfringe.view.movie import solid_picture

camera = qf.Device(width_px=640, height_px=480, focal_px=(1612, 1612), centre_px=(319.5, 239.5))
times_s = (0.0, 0.4, 0.8, 1.2, 1.6)
pictures = []
for time_s in times_s:
    system = hand_system()
    scene = system.scene.model_copy(update={"time_s": time_s})
    with qf.open(system.model_copy(update={"scene": scene, "camera": camera})) as scanner:
        shape = scanner.measure()
    view = {"turn_deg": (-24.0, -14.0), "middle_mm": (0.0, 10.0, 760.0), "size_px": (460, 560), "field_mm": 235.0}
    pictures.append(solid_picture(shape, shape.colour, **view))

figure, row = plt.subplots(1, len(times_s), figsize=(12, 3.1))
for axes, time_s, picture in zip(row, times_s, pictures, strict=True):
    axes.imshow(picture)
    axes.set_title(f"{time_s:.1f} s")
    axes.set_axis_off()
plt.show()
