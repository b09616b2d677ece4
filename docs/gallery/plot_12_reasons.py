"""
A reason for every hole
=======================

A pixel without data says why: too little light, a step in depth, a doubtful fringe order, and so on. The map is part of
every shape.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch

import quadfringe as qf
from quadfringe.view.page.figures import COLOURS

scene = qf.SceneConfig(surface="hand", albedo=(0.5, 0.4, 0.35, 0.5), shading=True, ambient=0.1, noise=0.05, seed=6)
with qf.open(qf.SystemConfig(scene=scene)) as scanner:
    shape = scanner.measure()

palette = {**COLOURS, qf.Reason.SHADOW: "#6f86c9"}
picture = np.repeat(shape.colour.mean(axis=2, keepdims=True) / 400, 3, axis=2)  # grey where there is data
for number, colour in palette.items():
    if number != qf.Reason.RETURNED:
        picture[shape.reason == number] = to_rgb(colour)

figure, axes = plt.subplots(figsize=(9.6, 5.0))
axes.imshow(picture)
axes.set_title(f"{shape.returned.mean():.0%} of the pixels have data: they are grey, as bright as the surface")
axes.set_axis_off()
shares = {number: float((shape.reason == number).mean()) for number in palette if number != qf.Reason.RETURNED}
patches = [
    Patch(facecolor=palette[number], label=f"{number.words}: {share:.2%}") for number, share in shares.items() if share
]
figure.legend(handles=patches, loc="outside right center")
plt.show()
