"""
Steps without a connecting path
===============================

Blocks of different height stand apart. No path over the surface tells which fringe a block begins with; the
four channels do. The profile crosses all steps, and its edges keep their place.
"""

import matplotlib.pyplot as plt
import numpy as np

import quadfringe as qf

with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface="steps", noise=0.02, seed=5))) as scanner:
    shot = scanner.grab()
    shape = scanner.decode(shot)

row = shape.depth_mm.shape[0] // 2
truth_mm = shot.truth.xyz_mm[row, :, 2]

figure, (left, right) = plt.subplots(1, 2, gridspec_kw={"width_ratios": (1, 1.25)})
drawn = left.imshow(shape.depth_mm, cmap="viridis_r")
left.axhline(row, color="white", linewidth=1, linestyle=(0, (6, 4)))
left.set_title("depth, and the row of the profile; slate: no data")
left.set_facecolor("#4a5568")
left.set(xticks=[], yticks=[])
figure.colorbar(drawn, ax=left, label="mm", shrink=0.85)

right.plot(truth_mm, color="#8b95a5", linewidth=4, alpha=0.5, label="truth")
right.plot(shape.depth_mm[row], linewidth=1.2, label="measured")
right.invert_yaxis()
right.set_title(f"row {row}: error {np.nanstd(shape.depth_mm[row] - truth_mm):.2f} mm RMS")
right.set_xlabel("column, px")
right.set_ylabel("depth, mm (near is up)")
figure.legend(*right.get_legend_handles_labels(), loc="outside lower right", ncols=2)
plt.show()
