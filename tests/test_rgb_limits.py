"""Three colours: motion between them, and the width of their fringes on small images."""

from __future__ import annotations

import numpy as np
import pytest
from support.bars import hold

import quadfringe as qf
from quadfringe.calibration.acceptance import SPHERE_DIAMETER_MM, Artefacts, accept
from quadfringe.config import Camera
from quadfringe.data import xyz_mm_of
from quadfringe.devices.virtual import VirtualBench

RGB = qf.Fringes(encoding="rgb", numbers=(16, 15))
THREE = qf.Fringes(encoding="rgb")
COLUMNS = 912


@pytest.mark.parametrize(("fringes", "bar"), [(RGB, "rgb.motion_left_ratio"), (THREE, "rgb.motion_left_three_ratio")])
def test_instants_are_those_of_the_channels(fringes: qf.Fringes, bar: str) -> None:
    """A plane that moves by 0.5 mm from colour to colour."""
    bench = VirtualBench(qf.SystemConfig(fringes=fringes, scene=qf.SceneConfig(noise=0.01)))
    calibration = bench.calibration()
    bench.project(fringes)
    shots = []
    for n, off_mm in enumerate((-0.5, 0.0, 0.5)):
        bench.place_plane((0.0, 0.0, 800.0 + off_mm), (0.2588, 0.0, -0.9659))
        shots.append(bench.expose(seed=7 + n))
    shot, truth = qf.Shot(shots[0].red, shots[1].green, shots[2].blue), shots[1].truth
    assert truth is not None
    instants = (-5500.0, 0.0, 5500.0)
    errors_mm = []
    for settings in ({}, {"channel_instants_us": instants}):
        shape = qf.decode(shot, qf.Plan(COLUMNS, fringes, calibration, "linear", settings))
        errors_mm.append(np.nanstd(shape.depth_mm - truth.xyz_mm[..., 2]))
    assert shape.config["decode"]["channel_instants_us"] == list(instants)
    print(f"depth errors, mm: {errors_mm}")
    hold(bar, errors_mm[1] / errors_mm[0])


@pytest.mark.parametrize(
    ("instants", "fringes", "words"),
    [
        ((0, 1, 2, 3), RGB, "expected 3 times, of red, green, blue, got 4"),
        ((0, 1, 2), qf.Fringes(), "expected 4 times, of red, green, blue, ir, got 3"),
        ((0, 1), RGB, "expected four times, of R, G, B and IR, or three without infrared"),
    ],
)
def test_every_channel_has_one_instant(instants: tuple[float, ...], fringes: qf.Fringes, words: str) -> None:
    with pytest.raises(qf.InputError, match=words):
        qf.Plan(COLUMNS, fringes, decode={"channel_instants_us": instants})


def test_wide_fringes_and_not_the_calibration_bend_a_small_sphere() -> None:
    """Half the pixels a side, no noise, the exact calibration: the form is that of 16 fringes with infrared."""
    camera = Camera(width_px=512, height_px=384, focal_px=(1290.3, 1290.3), centre_px=(255.5, 191.5))
    codes = {"rgb": RGB, "16": qf.Fringes(numbers=(16, 15, 13)), "36": qf.Fringes()}
    found = {}
    for name, fringes in codes.items():
        scene = qf.SceneConfig(surface="sphere")
        with qf.open(qf.SystemConfig(camera=camera, fringes=fringes, scene=scene)) as scanner:
            sphere = accept(Artefacts(spheres=(xyz_mm_of(scanner.measure()),), sphere_diameter_mm=SPHERE_DIAMETER_MM))
        found[name] = sphere.figures["sphere_1_form_6sigma_mm"]
    print(f"6 sigma form of a sphere, mm: {found}")
    hold("rgb.half_size_form_mm", found["rgb"])
    hold("rgb.half_size_form_ratio", found["rgb"] / found["16"])
    hold("rgb.half_size_form_over_36", found["rgb"] / found["36"])
