"""
How sure is each pixel?
=======================

Each shape states the standard deviation of its depth at every pixel: small in bright light, larger on slopes, in the
dark and at edges. On the virtual bench the error is known, so that the statement can be checked.
"""

import matplotlib.pyplot as plt
import numpy as np

import quadfringe as qf

with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface="face", shading=True, noise=0.02, seed=7))) as scanner:
    shot = scanner.grab()
    shape = scanner.decode(shot)

known = np.isfinite(shape.uncertainty_mm) & ~shot.truth.edge
ratio = ((shape.depth_mm - shot.truth.xyz_mm[:, :, 2]) / shape.uncertainty_mm)[known]
centres = np.linspace(-4, 4, 401)

figure, (left, right) = plt.subplots(1, 2, gridspec_kw={"width_ratios": (1.25, 1)})
top = float(np.nanquantile(shape.uncertainty_mm, 0.98))
drawn = left.imshow(shape.uncertainty_mm, cmap="inferno", vmin=0, vmax=top)
left.set_facecolor("#4a5568")
left.set_title("standard deviation of the depth; slate: no data")
left.set_xticks([])
left.set_yticks([])
figure.colorbar(drawn, ax=left, label="mm", shrink=0.85, extend="max")

right.hist(ratio, bins=81, range=(-4, 4), density=True, color="#5ec8cf", alpha=0.75, label="error / uncertainty")
right.plot(centres, np.exp(-(centres**2) / 2) / np.sqrt(2 * np.pi), color="#f2a65a", label="normal distribution")
right.set_title(f"{np.mean(np.abs(ratio) < 1):.0%} of the errors are smaller than stated")
right.set_xlabel("error in units of its stated standard deviation")
right.set_ylabel("density")
figure.legend(*right.get_legend_handles_labels(), loc="outside lower right", ncols=2)
plt.show()
