"""The rows of the README's table of figures: for each command, the figures it measures, their words and their bars."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from quadfringe.evaluation._scenes import data_folder

ROOT = Path(__file__).resolve().parents[1]
LOOPBACK = ROOT / "scripts" / "loopback"


@dataclass(frozen=True)
class Source:
    """A command that writes figures as JSON, and its rows: figure, words, and key of the bar (for times the bar)."""

    command: tuple[str, ...]
    rows: tuple[tuple[str, str, str], ...]
    there: Callable[[], bool] = lambda: True  # whether what it needs is there
    out: str = ""


SURFACES = ("plane", "peaks", "steps", "sphere")
ROUND_TRIP = (
    (
        "identity_max_difference",
        "bench identity: captured against projected image, share of full scale",
        "round_trip.identity",
    ),
    *(
        row
        for name in SURFACES
        for row in (
            (
                f"{name}_phase_rms_rad",
                f"{name} without noise: phase RMS a fringe away from edges, rad",
                "round_trip.phase_rms_rad",
            ),
            (
                f"{name}_wrong_pixels",
                f"{name} without noise: wrong orders among returned pixels, pixels",
                "round_trip.wrong_pixels",
            ),
            (
                f"{name}_in_shadow_pixels",
                f"{name} without noise: returned in shadow, pixels",
                "round_trip.in_shadow_pixels",
            ),
        )
    ),
)
DEMO = (
    *(
        row
        for name in ("steps", "face")
        for row in (
            (f"{name}_depth_rms_mm", f"{name}, 3 % noise, 8 bit: depth RMS away from edges, mm", "demo.depth_rms_mm"),
            (
                f"{name}_wrong_order_percent",
                f"{name}: wrong fringe orders among returned pixels, %",
                "demo.wrong_order_percent",
            ),
            (f"{name}_returned_percent", f"{name}: lit pixels returned, %", "demo.returned_percent"),
        )
    ),
    ("decode_ms", "one decode and its verdict, 1024 x 768 to X, Y, Z, best of 5, ms", ""),
)
PEAKS = (
    ("traditional_ftp_rms_rad", "peaks, 3 % noise: traditional FTP, full field, rad", "fails at slopes"),
    ("traditional_ftp_rms_rad_row760", "the same along row 760, rad (published 0.1316)", "fails at slopes"),
    ("improved_ftp_rms_rad", "improved FTP, full field, rad", "peaks.improved_ftp_rms_rad"),
    ("improved_ftp_rms_rad_row760", "the same along row 760, rad (published 0.0408)", "peaks.improved_ftp_rms_rad"),
    ("proposed_rms_rad", "proposed, full field, rad", "peaks.proposed_rms_rad"),
    ("proposed_rms_rad_row760", "the same along row 760, rad (published 0.0099)", "peaks.proposed_rms_rad"),
)
PAIR_TOLERANCE = tuple(
    (axis, f"allowable deviation of the infrared projector, {axis.replace('_', ', ')}", "")
    for axis in ("rx_deg", "ry_deg", "rz_deg", "tx_mm", "ty_mm", "tz_mm")
)
PAIR_CORRECTION = (
    ("infrared_before_rms_rad_row130", "pair 1 degree and 0.5 mm apart, row 130: infrared fringes before, rad", ""),
    ("infrared_after_rms_rad_row130", "the same with a pre-deformed image, rad (published 0.031)", "pair.rms_rad"),
    ("infrared_after_rms_rad", "the same over the field, rad", "pair.rms_rad"),
    ("after_rms_rad", "unwrapped phase against one projector, published method, rad", "pair.rms_rad"),
    ("after_joint_rms_rad", "unwrapped phase against one projector, joint method, rad", "pair.rms_rad"),
    ("after_wrong_order_percent", "wrong orders after the correction, %", "pair.wrong_order_percent"),
)
PAIR_DEPTH = tuple(
    row
    for way, words in (("corrected", "pre-deformed image"), ("searched", "search along the ray"))
    for row in (
        (
            f"{way}_0.5mm_infrared_rms_rad",
            f"{words}, 700 to 900 mm: infrared against expectation, worst, rad",
            "pair.rms_rad" if way == "searched" else "",
        ),
        (
            f"{way}_0.5mm_wrong_order_percent",
            f"{words}, 1 degree and 0.5 mm apart: wrong orders, worst, %",
            "pair.wrong_order_percent",
        ),
        (
            f"{way}_5mm_wrong_order_percent",
            f"{words}, 1 degree and 5 mm apart: wrong orders, worst, %",
            "pair.wrong_order_percent" if way == "searched" else "",
        ),
        (f"{way}_5mm_returned_percent", f"{words}, 1 degree and 5 mm apart: returned, least, %", ""),
    )
)
CAPTURES = (
    *(
        row
        for name in ("plate", "bottle")
        for key, words, bar in (
            ("auto_response", "as it came", "captures.auto_right_percent"),
            ("with_response", "with its response", "captures.right_percent"),
        )
        for row in (
            (f"{name}_{key}_right_percent", f"real capture, {name}, {words}: right order, object pixels, %", bar),
            (
                f"{name}_{key}_right_of_returned_percent",
                f"real capture, {name}, {words}: right order, returned pixels, %",
                "captures.right_of_returned_percent",
            ),
        )
    ),
    *(
        row
        for name in ("plane", "peaks")
        for row in (
            (
                f"{name}_noise_3_percent_depth_rms_mm",
                f"independent render, {name}, 3 % noise: depth RMS, mm",
                "renders.depth_rms_mm",
            ),
            (
                f"{name}_noise_3_percent_right_of_returned_percent",
                f"independent render, {name}: right order, returned pixels, %",
                "renders.right_of_returned_percent",
            ),
        )
    ),
)
BAYER = (
    *(
        row
        for period in (20, 10)
        for row in (
            (f"fringes_{period}_px_mosaic_phase_rms_rad", f"raw mosaic, fringes of {period} px: phase RMS, rad", ""),
            (f"fringes_{period}_px_opencv_phase_rms_rad", "the same mosaic interpolated by OpenCV, rad", ""),
        )
    ),
    ("noise_left_mosaic", "raw mosaic: share of white noise left in red", ""),
    ("noise_left_opencv", "the same mosaic interpolated by OpenCV", ""),
    ("peaks_noise_0_percent_published_full_phase_rms_rad", "peaks, published method, all colours: phase RMS, rad", ""),
    ("peaks_noise_0_percent_published_mosaic_phase_rms_rad", "the same from a raw mosaic, rad", ""),
    ("peaks_noise_0_percent_published_bilinear_phase_rms_rad", "the same from bilinear planes, rad", ""),
    ("face_noise_3_percent_joint_full_phase_rms_rad", "face, 3 % noise, all colours: phase RMS, rad", ""),
    ("face_noise_3_percent_joint_mosaic_phase_rms_rad", "the same from a raw mosaic, rad", ""),
    ("face_noise_3_percent_joint_bilinear_phase_rms_rad", "the same from bilinear planes, rad", ""),
    ("steps_noise_3_percent_joint_mosaic_wrong_pixels", "steps, 3 % noise, raw mosaic: wrong orders, lit pixels", ""),
    ("steps_noise_3_percent_joint_mosaic_returned_percent", "the same: lit pixels returned, %", ""),
)
CALIBRATION = (
    ("ring_centre_rms_px", "centres of rings, RMS, px", "calibration.ring_centre_rms_px"),
    ("camera_mean_px", "mean reprojection error, camera, px", "calibration.camera_mean_px"),
    ("visible_mean_px", "the same, visible projector, px (published 0.269)", "calibration.visible_mean_px"),
    ("infrared_mean_px", "the same, infrared projector, px (published 0.221)", "calibration.infrared_mean_px"),
    ("focal_error_percent", "worst focal length, %", "calibration.focal_error_percent"),
    ("centre_error_px", "worst principal point, px", "calibration.centre_error_px"),
    ("pair_rotation_error_deg", "rotation between the projectors, deg", "calibration.pair_rotation_error_deg"),
    ("pair_translation_error_mm", "translation between the projectors, mm", "calibration.pair_translation_error_mm"),
    ("outside_their_interval", "of the six, outside the joint interval of 95 %", "calibration.outside_their_interval"),
)
LIGHT = (
    (
        "stray_after_percent",
        "gamma 2.2, crosstalk 15 % each way: stray light left, % of full scale",
        "calibration.stray_after_percent",
    ),
    ("level_rms_after_percent", "the same: RMS of the levels, % of full scale", "calibration.level_rms_after_percent"),
)
ACCEPTANCE = (
    ("plane_1_form_mm", "acceptance, noise 1 %: form of a plane, mm", "acceptance.plane_form_mm"),
    ("sphere_1_form_6sigma_mm", "the same: form of a sphere, mm", "acceptance.sphere_form_mm"),
    ("sphere_1_size_error_mm", "the same: diameter of a sphere, mm", "acceptance.sphere_size_mm"),
    ("steps_1_50mm_error_mm", "the same: step of 50 mm, mm", "acceptance.step_mm"),
)
PRINTS = (
    ("joint_peaks_phase_rms_all_rad", "peaks, 3 % noise, white: phase RMS, rad", "textures.white_rms_rad"),
    ("joint_peaks_shades_phase_rms_all_rad", "the same with coloured shades, rad", "textures.shades_rms_rad"),
    (
        "joint_peaks_patches_phase_rms_all_rad",
        "the same with coloured squares of 20 mm, rad",
        "textures.patches_rms_rad",
    ),
    ("joint_peaks_patches_phase_median_rad", "the same, median, rad", "textures.patches_median_rad"),
    (
        "joint_peaks_printed_phase_rms_all_rad",
        "the same with shades and sharp random colours, rad",
        "textures.printed_rms_rad",
    ),
    ("joint_peaks_printed_phase_median_rad", "the same, median, rad", "textures.printed_median_rad"),
)
SPEED = (
    ("numpy_float64_ms", "published chain in plain NumPy, float64, 1024 x 768, u8 to X, Y, Z, ms", ""),
    ("numpy_float32_ms", "the same in float32, ms", ""),
    ("published_2_threads_ms", "published method, 2 threads, same run, ms", ""),
    ("published_2_threads_times_numpy_float64", "published method: times as fast as NumPy in float64", "35"),
    ("published_2_threads_times_numpy_float32", "published method: times as fast as NumPy in float32", "35"),
    ("joint_2_threads_ms", "joint method, 2 threads, same run, ms", ""),
)
CAMERA = (
    ("wire_lost_shots", "two cameras on loopback GigE Vision at 30 fps, 60 s: shots lost of 1800", "0"),
    ("wire_wrong_pixels", "the same: wrong pixels", "0"),
    ("decode_lost_shots", "decoded by the published method and recorded: shots lost of 1800", "0"),
    ("decode_wrong_pixels", "the same: shots with wrong pixels", "0"),
    ("decode_latency_ms", "from the arrival of the second frame to the shape, median, ms", "40"),
    ("rate_shapes_per_s", "cameras at 66 fps, recorded: shapes/s by the published method", "60"),
    ("faults_slowest_error_s", "from a fault of a camera to its error, the slowest, s", "3"),
)
RECORDING = (
    ("recording_mb_per_s", "recording, MB/s", "150, or the disk"),
    ("plain_file_mb_per_s", "the same bytes into a plain file, MB/s", ""),
    ("kills_shots_lost", "shots reported as written that 20 kill -9 took away", "0"),
)
LIVE = (
    ("live_client_clouds_per_s", "live view while decoding: full-resolution clouds/s to a client", "10"),
    ("live_client_memory_growth_mb", "memory of the server, last third against the middle one, MB", "flat"),
)
BROWSER = tuple(
    (f"live_browser_{name}_per_s", f"page in a browser without a graphics card: {words}/s", bar)
    for name, words, bar in (
        ("clouds", "clouds of every 4th point of every 4th row", "1"),
        ("pictures", "pictures", "5"),
        ("figures", "figures", "5"),
    )
)
BATCH = (
    ("batch_two_workers_over_one", "batch of 200 shots: two workers against one", "1.7"),
    ("batch_files_that_differ", "files that differ after kill -9 and the same command again", "0"),
)


def has_data() -> bool:
    return (data_folder() / "renders" / "rig.json").is_file()


def has_cameras() -> bool:
    return find_spec("gi") is not None and subprocess.run([LOOPBACK, "true"], capture_output=True).returncode == 0


def has_browser() -> bool:
    return shutil.which("chromium") is not None


SOURCES = (
    Source(("evaluation/round_trip.py",), ROUND_TRIP),
    Source(("evaluation/bayer.py",), BAYER),
    Source(("evaluation/calibration.py",), (*CALIBRATION, *LIGHT)),
    Source(("evaluation/calibration.py", "--layout", "diamond"), CALIBRATION),
    Source(("quadfringe", "accept"), ACCEPTANCE, out="acceptance.png"),
    Source(("quadfringe", "demo"), DEMO),
    Source(("quadfringe", "reproduce", "peaks"), PEAKS),
    Source(("quadfringe", "reproduce", "tolerance"), PAIR_TOLERANCE),
    Source(("quadfringe", "reproduce", "correction"), PAIR_CORRECTION),
    Source(("quadfringe", "reproduce", "depth"), PAIR_DEPTH),
    Source(("evaluation/accuracy.py",), PRINTS),
    Source(("evaluation/captures_report.py",), CAPTURES, has_data),
    Source(("benches/bench_decode.py",), SPEED),
    Source(("benches/first_frame.py",), (("first_frame_s", "first frame from process start, s", "1.5"),)),
    Source(("scripts/loopback", "benches/camera.py"), CAMERA, has_cameras),
    Source(("benches/recording.py",), RECORDING),
    Source(("benches/live.py",), LIVE),
    Source(("benches/live.py", "--browser"), BROWSER, has_browser),
    Source(("benches/batch.py",), BATCH),
)
