"""The figures of the table in the README: the figure by its name in `figure_rows`, and words that need no other row."""

from __future__ import annotations

CHOSEN = (
    ("proposed_rms_rad_row760", "phase error, peaks with 3 % noise, rad RMS along row 760 (published 0.0099)"),
    ("face_depth_rms_mm", "depth error, white face with 3 % noise, mm RMS"),
    ("face_wrong_order_percent", "wrong fringe orders on that face, % of the returned pixels"),
    ("steps_returned_percent", "steps with 3 % noise: lit pixels that return a point, %"),
    (
        "joint_peaks_printed_phase_rms_all_rad",
        "phase error with sharp random colours printed on the peaks, rad RMS",
    ),
    (
        "bottle_auto_response_right_percent",
        "real capture of a bottle, response unknown: pixels of the object that return with the right order, %",
    ),
    ("bottle_auto_response_right_of_returned_percent", "the returned pixels of the bottle with the right order, %"),
    ("sphere_1_form_6sigma_mm", "acceptance test with 1 % noise: form error of a sphere of 68 mm, mm"),
    (
        "infrared_after_rms_rad_row130",
        "projectors 1 degree and 0.5 mm apart, corrected: rad RMS along row 130 (published 0.031)",
    ),
    ("joint_2_threads_ms", "default method: one shot of 1024 x 768 pixels to X, Y, Z, on two cores, ms"),
)
