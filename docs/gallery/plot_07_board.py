"""
The calibration board and its points
====================================

The ring board of the paper, tilted before the virtual camera. The centres of the rings are found to a small fraction
of a pixel; two dots show which corner is the first.
"""

import matplotlib.pyplot as plt

from quadfringe.calibration import find_target, ring_board
from quadfringe.calibration.rehearsal import VirtualBoard, board_poses
from quadfringe.config import SceneConfig, SystemConfig

board = VirtualBoard(SystemConfig(scene=SceneConfig(noise=0.01, blur_px=0.6)), ring_board())
pose = board_poses(board.target, 4)[1]
image = board.photograph(pose)
view = find_target(image, board.target)

figure, (left, right) = plt.subplots(1, 2, gridspec_kw={"width_ratios": (1.35, 1)})
left.imshow(image, cmap="gray", vmin=0, vmax=1)
drawn = left.scatter(*view.points_px.T, c=view.ids, s=22, cmap="cool", linewidths=0)
left.set_title(f"{len(view.ids)} rings, coloured by their number")
left.set_axis_off()

x_px, y_px = view.points_px[50]
right.imshow(image, cmap="gray", vmin=0, vmax=1, interpolation="nearest")
right.scatter(*view.points_px.T, marker="+", s=180, color="#5ec8cf", linewidths=1.4)
right.set_xlim(x_px - 45, x_px + 45)
right.set_ylim(y_px + 38, y_px - 38)
right.set_title("the same, enlarged")
right.set_xlabel("column, px")
right.set_ylabel("row, px")
plt.show()
