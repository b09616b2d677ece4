"""
A mesh with colours
===================

The points become triangles, except across steps in depth. The mesh keeps the colours of the shot, and is saved for
Blender, MeshLab or CloudCompare by ``shape.save("face.glb")``.
"""

import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import quadfringe as qf

scene = qf.SceneConfig(surface="face", patch_mm=36.0, shading=True, noise=0.005, seed=4)
with qf.open(qf.SystemConfig(scene=scene)) as scanner:
    shape = scanner.measure()
mesh = shape.mesh(step=8)

x, y, z = mesh.vertices_mm.T
corners = np.column_stack([x, z.max() - z, -y])[mesh.faces]
towards_light = np.array([-0.45, -0.5, -0.74], np.float32)
shade = 0.3 + 0.8 * np.clip(np.nan_to_num(mesh.normals) @ towards_light, 0, 1)
colour = np.clip(mesh.colour / 255 * shade[:, None], 0, 1)[mesh.faces].mean(axis=1)

figure = plt.figure(figsize=(9.6, 5.6), layout="none")
axes = figure.add_axes((-0.2, -0.32, 1.4, 1.6), projection="3d")
axes.add_collection3d(Poly3DCollection(corners, facecolors=colour, edgecolors=colour * 0.75, linewidths=0.25))
axes.set(xlim=(x.min(), x.max()), ylim=(0, np.ptp(z)), zlim=(-y.max(), -y.min()))
axes.set_box_aspect((np.ptp(x), np.ptp(z), np.ptp(y)))
axes.view_init(elev=12, azim=62)
axes.set_axis_off()
figure.text(0.98, 0.04, f"{len(mesh.faces):,} triangles\nof every eighth pixel", ha="right", color="#8b95a5")
plt.show()
