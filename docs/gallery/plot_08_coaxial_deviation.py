"""
When the projectors are not coaxial
===================================

One degree and half a millimetre between the two projectors make half of the fringe orders wrong, if the decoder takes
them for coaxial. With both projectors calibrated, the decoder knows the infrared fringes on every camera ray.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

import quadfringe as qf
from quadfringe.calibration.projector_pair import deviated

with qf.open() as scanner:
    visible = scanner.calibration.projector
infrared = deviated(visible, (1.0, 1.0, 1.0), (0.5, 0.5, 0.5))
system = qf.SystemConfig(projector=visible, infrared=infrared, scene=qf.SceneConfig(surface="plane", noise=0.01))
with qf.open(system) as scanner:
    shot, calibration = scanner.grab(), scanner.calibration

figure, row = plt.subplots(1, 2, figsize=(10.4, 4.4))
for axes, unwrapping in zip(row, ("coaxial", "pair"), strict=True):
    decode = qf.DecodeConfig(method="published", unwrapping=unwrapping)
    plan = qf.Plan(visible.width_px, calibration=calibration, decode=decode)
    shape = qf.Decoder(shot, plan).decode_without_verdict(shot)  # decode() refuses such a shot
    error_px = shape.column_px - shot.truth.column_px
    wrong = np.where(np.isfinite(error_px), np.abs(error_px) > visible.width_px / 36 / 2, np.nan)
    axes.imshow(wrong, cmap=ListedColormap(["#2a9d8f", "#e76f51"]), vmin=0, vmax=1, interpolation="nearest")
    axes.set_title(f'unwrapping = "{unwrapping}": {np.nanmean(wrong):.1%} wrong orders')
    axes.set_axis_off()
names = {"right order": "#2a9d8f", "wrong order": "#e76f51", "no data": "#181818"}
patches = [Patch(facecolor=colour, edgecolor="#8b95a5", label=name) for name, colour in names.items()]
figure.legend(handles=patches, loc="outside lower center", ncols=3)
plt.show()
