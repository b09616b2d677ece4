"""Calibration of a bench: boards, detection, camera and projectors, responses and crosstalk, heights, acceptance.

The usual way is the guided calibration, `quadfringe.calibration.session`; the functions here are its parts.
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
