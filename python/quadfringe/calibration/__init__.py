"""Calibration of a bench: boards, detection, camera and projectors, responses and crosstalk, heights, acceptance.

The usual way is the guided calibration, `quadfringe.calibration.session`; the functions here are its parts.

Boards and their points, and a camera from nine poses:

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> import numpy as np
>>> import quadfringe as qf
>>> from quadfringe.calibration import *
>>> boards = [ring_board(), circle_grid(), asymmetric_grid(), charuco_board()]
>>> [isinstance(board, Target) for board in boards], len(boards[0].points_mm)
([True, True, True, True], 108)
>>> from quadfringe.calibration.rehearsal import board_poses
>>> import cv2
>>> board, lens = boards[0], np.array([[1290.0, 0, 511.5], [0, 1290.0, 383.5], [0, 0, 1]])
>>> views = []
>>> for pose in board_poses(board, 9):
...     seen = cv2.projectPoints(board.points_mm, cv2.Rodrigues(pose[:3, :3])[0], pose[:3, 3], lens, None)[0][:, 0]
...     views.append(View(seen, np.arange(len(seen)), (1024, 768)))
>>> isinstance(check_poses(views, board), PoseSpread)
True
>>> try:
...     check_poses(views[:1], board)
... except DegeneratePosesError as error:
...     print(error.reason)
too_few
>>> try:
...     find_target(np.zeros((768, 1024), np.uint8), board)
... except TargetNotFoundError as error:
...     print(error.reason)
dark
>>> found = calibrate_camera(views, board)
>>> isinstance(found, RigCalibration), isinstance(found.camera, DeviceFit), isinstance(found.camera.sd, DeviceSd)
(True, True, True)
>>> round(found.camera.device.focal_px[0])
1290
>>> [Pose(view) for view in views][0].visible is None  # `calibrate_rig(poses, board)` takes projectors, too
True
>>> registered = register_views(views, views)
>>> isinstance(registered, Registration), registered.after_rms_px < 1e-6
(True, True)
>>> shifted = register_infrared(views[0].points_px, views[0].points_px + [2.0, 0.0])
>>> round(shifted.shift_px[0], 6)
2.0

Projectors, from N-step fringes along columns and rows, or from their pixels at the points of the board:

>>> plan = StepPlan(qf.Fringes(numbers=(16, 15, 12)), steps=4, size_px=(400, 400))
>>> y, x = np.mgrid[0:400, 0:400]  # a camera that sees the projector pixel by pixel
>>> def stacks(place):
...     shift = np.array([plan.shift_rad(step) for step in range(4)])[:, None, None]
...     return [(0.5 + 0.4 * np.cos(2 * np.pi * n * place / 400 + shift)).astype(np.float32) for n in (16, 15, 12)]
>>> lit = projector_map(stacks(x), stacks(y), plan)
>>> isinstance(lit, ProjectorMap), round(float(lit.column_px[200, 100]), 2)
(True, 100.0)
>>> small = View(np.array([[100.0, 100.0], [150.0, 100.0], [100.0, 150.0]]), np.arange(3), (400, 400))
>>> found = projector_points(lit, small)
>>> isinstance(found, ProjectorPoints), found.points_px.round(1)[1].tolist()
(True, [150.0, 100.0])
>>> beside_mm, poses = np.array([-100.0, 0.0, 0.0]), []
>>> for view, pose in zip(views, board_poses(board, 9)):
...     place_mm = pose[:3, 3] + beside_mm
...     seen = cv2.projectPoints(board.points_mm, cv2.Rodrigues(pose[:3, :3])[0], place_mm, lens, None)[0][:, 0]
...     poses.append(Pose(view, ProjectorPoints(seen, np.tile(np.eye(2), (108, 1, 1)), view.ids, (1024, 768))))
>>> rig = calibrate_rig(poses, board)
>>> rig.visible.device.translation_mm[0] < -99.9
True
>>> pair = pair_pose(np.eye(3), [0.0, 0.0, 0.0], np.eye(3), [1.0, 0.0, 0.0])
>>> isinstance(pair, PairPose), pair.translation_mm.tolist()
(True, [1.0, 0.0, 0.0])
>>> calibration = qf.Calibration(camera=rig.camera.device, projector=rig.visible.device)
>>> with TemporaryDirectory() as folder:
...     write_opencv(Path(folder) / "bench.yml", calibration)
...     again = read_opencv(Path(folder) / "bench.yml")
>>> again.camera.width_px
1024

Light and heights:

>>> grey = lambda level: qf.Shot(*[np.full((48, 64), level, np.uint8)] * 4)
>>> dark = dark_level([grey(2), grey(2)])
>>> isinstance(dark, DarkLevel), round(255 * dark.level[0])
(True, 2)
>>> levels = level_plan()
>>> isinstance(levels, LevelPlan), mean_levels(grey(51)).round(3).tolist()
(True, [0.2, 0.2, 0.2, 0.2])
>>> channels = fit_channels(levels, 0.01 + 0.8 * levels.exposure[:, None] * levels.levels**2.2)
>>> isinstance(channels, Channels), round(1 / channels.projector_response.green.exponent, 1)
(True, 2.2)
>>> heights_mm = (-40.0, -20.0, 0.0, 20.0, 40.0)
>>> planes = [np.full((4, 5), 100 + 0.5 * height, np.float32) for height in heights_mm]  # rad
>>> polynomial = fit_heights(heights_mm, planes, degree=1)
>>> isinstance(polynomial, HeightCalibration), round(float(polynomial.height_from_phase(planes[3])[0, 0]), 3)
(True, 20.0)
"""

from quadfringe.calibration.bundle import Pose, RigCalibration, calibrate_camera, calibrate_rig
from quadfringe.calibration.channels import Channels, fit_channels
from quadfringe.calibration.detect import TargetNotFoundError, View, find_target
from quadfringe.calibration.device_fit import DeviceFit, DeviceSd
from quadfringe.calibration.height import HeightCalibration, fit_heights
from quadfringe.calibration.levels import DarkLevel, LevelPlan, dark_level, level_plan, mean_levels
from quadfringe.calibration.opencv_files import read_opencv, write_opencv
from quadfringe.calibration.poses import DegeneratePosesError, PoseSpread, check_poses
from quadfringe.calibration.projector import ProjectorMap, ProjectorPoints, StepPlan, projector_map, projector_points
from quadfringe.calibration.projector_pair import PairPose, pair_pose
from quadfringe.calibration.registration import Registration, register_infrared, register_views
from quadfringe.calibration.targets import Target, asymmetric_grid, charuco_board, circle_grid, ring_board

__all__ = [
    "Channels",
    "DarkLevel",
    "DegeneratePosesError",
    "DeviceFit",
    "DeviceSd",
    "HeightCalibration",
    "LevelPlan",
    "PairPose",
    "Pose",
    "PoseSpread",
    "ProjectorMap",
    "ProjectorPoints",
    "Registration",
    "RigCalibration",
    "StepPlan",
    "Target",
    "TargetNotFoundError",
    "View",
    "asymmetric_grid",
    "calibrate_camera",
    "calibrate_rig",
    "charuco_board",
    "check_poses",
    "circle_grid",
    "dark_level",
    "find_target",
    "fit_channels",
    "fit_heights",
    "level_plan",
    "mean_levels",
    "pair_pose",
    "projector_map",
    "projector_points",
    "read_opencv",
    "register_infrared",
    "register_views",
    "ring_board",
    "write_opencv",
]
