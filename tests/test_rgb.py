"""Three colours and one projector: the whole chain without infrared, and what it loses against four channels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.bars import hold

import quadfringe as qf
from quadfringe import _core
from quadfringe.calibration.channels import fit_channels
from quadfringe.calibration.levels import dark_level, mean_levels
from quadfringe.calibration.session.virtual import VirtualCaptures
from quadfringe.config import Camera, ChannelResponse
from quadfringe.data import Calibration, read_shot, write_shot
from quadfringe.decoding.closures import closure_of
from quadfringe.decoding.stages import columns_from_phase, demodulate, discard_invalid, linear_light, order
from quadfringe.evaluation import three_colours, world

RGB = qf.Fringes(encoding="rgb", numbers=(16, 15))
THREE = qf.Fringes(encoding="rgb")
KINDS = pytest.mark.parametrize("fringes", [RGB, THREE], ids=["two", "three"])
SEEDS = world.REPORT
COLUMNS = 912


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    with qf.open(qf.SystemConfig(fringes=RGB)) as scanner:
        assert scanner.calibration is not None
        return scanner.calibration


def taken(surface: str = "face", fringes: qf.Fringes = RGB, **scene: Any) -> qf.Shot:
    config = qf.SystemConfig(
        fringes=fringes, scene=qf.SceneConfig(surface=surface, **({"noise": 0.03, "seed": 2} | scene))
    )
    with qf.open(config) as scanner:
        return scanner.grab()


@pytest.fixture(scope="module")
def face() -> qf.Shot:
    return taken()


def both(name: str, kind: str, calibration: Calibration) -> tuple[dict[str, float], dict[str, float]]:
    """Give the figures of a scene with infrared and without, at the same fringe period."""
    codes = three_colours.CODES[three_colours.SAME_PERIOD[kind]], three_colours.CODES[kind]
    four, rgb = (three_colours.figures_of(name, fringes, calibration, SEEDS) for fringes in codes)
    return four, rgb


@pytest.mark.parametrize("kind", three_colours.SAME_PERIOD)
def test_white_surfaces_lose_little(kind: str, calibration: Calibration) -> None:
    four, rgb = both("peaks", kind, calibration)
    hold("rgb.peaks_phase_ratio", rgb["phase_rms_rad"] / four["phase_rms_rad"])
    rgb = three_colours.figures_of("steps", three_colours.CODES[kind], calibration, SEEDS)
    hold("rgb.steps_returned_percent", rgb["returned_percent"])
    hold("rgb.steps_wrong_percent", rgb["wrong_percent"])
    hold("rgb.steps_inside_percent", rgb["inside_1_percent"])


@pytest.mark.parametrize("kind", three_colours.SAME_PERIOD)
@pytest.mark.parametrize("name", ["peaks_patches_20", "painted_face"])
def test_textured_surfaces_lose_less_than_half(name: str, kind: str, calibration: Calibration) -> None:
    four, rgb = both(name, kind, calibration)
    hold("rgb.textured_ratio", rgb["rms_mm"] / four["rms_mm"])
    hold("rgb.textured_returned_percent", rgb["returned_percent"])


def test_three_numbers_have_smaller_errors_than_two(calibration: Calibration) -> None:
    for name in ("steps", "peaks_patches_20", "face_patches_12"):
        two, three = (
            three_colours.figures_of(name, three_colours.CODES[kind], calibration, SEEDS[:1])
            for kind in ("two", "three")
        )
        hold("rgb.three_over_two", three["rms_mm"] / two["rms_mm"])
        hold("rgb.three_wrong_percent", three["wrong_percent"])


def test_real_captures_within_known_columns(data_dir: Path) -> None:
    for name, found in three_colours.captures(data_dir):
        hold(f"rgb.{name}_right_percent", found.right_percent)
        hold("rgb.captures_right_of_returned_percent", found.right_of_returned_percent)


def test_real_captures_with_three_numbers(data_dir: Path) -> None:
    for name, found in three_colours.captures_of_three(data_dir):
        hold(f"rgb.{name}_three_right_percent", found.right_percent)
        hold("rgb.captures_three_right_of_returned_percent", found.right_of_returned_percent)


def test_fringes_state_their_channels() -> None:
    assert (THREE.numbers, THREE.channel_numbers, THREE.quadrature) == ((36, 35, 30), (36, 35, 30), False)
    assert (THREE.code, RGB.code, qf.Fringes().code) == ((36, 35, 30, 0), (16, 15), (36, 35, 30))
    assert qf.Plan(COLUMNS, THREE.code).fringes == THREE
    assert (RGB.numbers, RGB.channels, RGB.channel_numbers) == ((16, 15), ("red", "green", "blue"), (16, 15, 16))
    assert qf.Fringes().channel_numbers == (36, 35, 36, 30)
    assert qf.Plan(COLUMNS, (16, 15)).fringes == RGB
    assert qf.Plan(COLUMNS, (36, 35, 30)).fringes == qf.Fringes()
    assert qf.Fringes.model_validate(RGB.model_dump()) == RGB


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"encoding": "rgb", "numbers": (36, 36, 30)}, r"three different numbers, of red, .* got \(36, 36, 30\)"),
        ({"encoding": "rgb", "numbers": (16, 15, 16)}, r"three different numbers, of red, .* got \(16, 15, 16\)"),
        ({"encoding": "rgb", "numbers": (36, 34, 30)}, r"joint range covers the projector, such as \(36, 35, 30\)"),
        ({"numbers": (16, 15)}, 'expected three fringe numbers, such as .36, 35, 30., got 2; .* encoding = "rgb"'),
        ({"encoding": "rgb", "numbers": (36, 35)}, r"joint range covers the projector, such as \(16, 15\)"),
        ({"encoding": "rgb", "columns_px": (300, 200)}, "two growing columns of the projector"),
        ({"encoding": "rgb", "predeformed_z_mm": 800}, 'of the infrared image, which encoding = "rgb" lacks'),
        ({"encoding": "cmyk"}, "encoding: expected 'rgb-ir' or 'rgb', got 'cmyk'"),
    ],
)
def test_fringes_that_do_not_fit_are_refused(settings: dict[str, Any], reason: str) -> None:
    with pytest.raises(qf.ConfigError, match=reason):
        qf.Fringes(**settings)


def test_a_shot_must_have_the_channels_of_the_plan(face: qf.Shot) -> None:
    with pytest.raises(qf.InputError, match=r"of red, green, blue, ir, and the shot has red, green, blue: give the"):
        qf.decode(face, qf.Plan(COLUMNS))
    with pytest.raises(ValueError, match=r"got 15 fringes in G and in another channel"):
        _core.check_code((16, 15, 15, 0), COLUMNS)
    four = qf.Shot(face.red, face.green, face.blue, face.green)
    with pytest.raises(qf.InputError, match=r"of red, green, blue, and the shot has red, green, blue, ir: leave ir"):
        qf.decode(four, qf.Plan(COLUMNS, RGB))
    with pytest.raises(ValueError, match=r"expected R, G and B, the channels of the encoding, got R, G, B and IR"):
        _core.Decoder(face.red.shape, RGB.numbers, COLUMNS).decode(face.red, face.green, face.blue, face.green)


def test_a_colour_image_is_a_shot(face: qf.Shot) -> None:
    shot = qf.Shot.from_rgb(np.dstack([face.red, face.green, face.blue]))
    assert all(np.array_equal(a, b) for a, b in zip(shot.images.values(), face.images.values(), strict=True))
    assert repr(shot) == "Shot(1024 x 768 uint8 up to 255, without infrared)"
    for wrong in (face.red, [face.red], np.zeros((4, 4, 4), np.uint8)):
        with pytest.raises(qf.InputError, match=r"rgb: expected a colour image \(H, W, 3\)"):
            qf.Shot.from_rgb(wrong)


@pytest.mark.parametrize("bayer", [None, "grbg"])
def test_files_keep_a_shot_without_infrared(tmp_path: Path, bayer: Any) -> None:
    shot = taken(bayer=bayer)
    paths = write_shot(tmp_path, shot)
    assert "ir" not in paths
    again = read_shot(tmp_path, bayer=bayer)
    assert again.ir is None
    assert all(np.array_equal(again.images[name], image) for name, image in shot.images.items())


@KINDS
def test_the_infrared_albedo_is_no_data(fringes: qf.Fringes, tmp_path: Path) -> None:
    shape = qf.decode(taken(fringes=fringes), qf.Plan(COLUMNS, fringes, response="linear"))
    assert shape.albedo is not None
    assert np.isnan(shape.albedo[..., 3]).all()
    hold("rgb.albedo_known_percent", 100 * np.isfinite(shape.albedo[shape.returned][:, :3]).mean())
    shape.save(tmp_path / "face.npz")
    again = qf.Shape.load(tmp_path / "face.npz")
    np.testing.assert_array_equal(again.albedo, shape.albedo)
    assert again.config["fringes"]["encoding"] == "rgb"


@KINDS
@pytest.mark.parametrize("bayer", [None, "rggb"])
def test_the_response_is_estimated_from_three_channels(bayer: Any, fringes: qf.Fringes) -> None:
    shot = taken(fringes=fringes, projector_exponent=2.2, bayer=bayer, noise=0.01)
    shape = qf.decode(shot, qf.Plan(COLUMNS, fringes))
    assert shape.config["response_from"] == "shots"
    hold("rgb.response_exponent", [shape.config["response"][name]["exponent"] for name in ("red", "green", "blue")])


@KINDS
def test_crosstalk_of_three_channels_is_removed(fringes: qf.Fringes, calibration: Calibration) -> None:
    mix = np.eye(4)
    mix[0, 1], mix[1, 2], mix[2, 0] = 0.12, 0.08, 0.1
    shot = taken("plane", fringes, crosstalk=mix.tolist())
    known = calibration.model_copy(update={"crosstalk": tuple(map(tuple, mix.tolist()))})
    plans = (qf.Plan(COLUMNS, fringes, one, "linear") for one in (known, calibration))
    after_mm, before_mm = (float(np.nanstd(qf.decode(shot, plan).depth_mm)) for plan in plans)
    hold("rgb.crosstalk_left_ratio", after_mm / before_mm)
    assert set(linear_light(shot, known)) == {"red", "green", "blue"}


def test_crosstalk_of_three_channels_is_calibrated() -> None:
    mix = np.eye(4)
    mix[0, 1], mix[1, 2], mix[2, 0], mix[0, 3] = 0.12, 0.08, 0.1, 0.3
    camera = Camera(width_px=256, height_px=192, focal_px=(645.0, 645.0), centre_px=(127.5, 95.5))
    scene = qf.SceneConfig(noise=0.01, gain=0.75, crosstalk=mix.tolist(), projector_exponent=1.4)
    captures = VirtualCaptures(qf.SystemConfig(fringes=RGB, scene=scene, camera=camera))
    session = captures.session
    assert (session.beams, session.step_plan.fringes.numbers) == (("visible",), (36, 35, 30))
    names = session.captures("levels")
    assert names[1] == "r012_g000_b000_e100"
    dark = dark_level([captures.shot("dark", name) for name in session.captures("dark")])
    seen = np.array([mean_levels(captures.shot("levels", name)) for name in names])
    found = fit_channels(session.level_plan, seen, dark.level)
    error = np.array(found.crosstalk)[:3, :3] - mix[:3, :3]
    hold("rgb.crosstalk_percent", 100 * np.abs(error).max())
    assert np.array_equal(np.array(found.crosstalk)[3], (0, 0, 0, 1))
    assert np.array_equal(np.array(found.crosstalk)[:3, 3], (0, 0, 0))
    assert (found.projector_response.ir, found.response.ir) == (ChannelResponse(), ChannelResponse())


@KINDS
def test_the_stages_of_the_published_method_agree_with_the_decoder(
    fringes: qf.Fringes, calibration: Calibration
) -> None:
    shot, code = taken("peaks", fringes, noise=0.01), fringes.code
    light = linear_light(shot, calibration)
    wrapped = demodulate(light, code)
    phase_rad, margin = order(wrapped, code, COLUMNS)
    phase_rad, _ = discard_invalid(phase_rad, margin, wrapped.modulation, modulation_min=0.02, quality_min=0.15)
    phase_rad, _ = columns_from_phase(phase_rad, code, COLUMNS)
    plan = qf.Plan(COLUMNS, fringes, calibration, qf.Response(), qf.DecodeConfig(method="published"))
    found = qf.Decoder(shot, plan).decode_without_verdict(shot).phase_rad
    # The phase of a block is not wrapped in the decoder, which rounds other last bits.
    np.testing.assert_allclose(phase_rad, found, rtol=0, atol=0 if fringes.quadrature else 1e-4)


@pytest.mark.parametrize("name", ["published", "joint"])
def test_both_methods_decode_three_numbers(name: str, calibration: Calibration) -> None:
    found = three_colours.figures_of("peaks", THREE, calibration, (1,), name)
    hold(f"rgb.three_{name}_phase_rad", found["phase_rms_rad"])
    assert found["wrong_percent"] == 0


@KINDS
@pytest.mark.parametrize("surface", ["face", "plane"])
@pytest.mark.parametrize("names", ["blue green red", "green red blue", "red blue green", "green blue red"])
def test_exchanged_channels_are_refused(surface: str, names: str, fringes: qf.Fringes) -> None:
    channels = taken(surface, fringes).channels
    with pytest.raises(qf.DecodeError, match="channels are red, green, blue in this order"):
        qf.decode(qf.Shot(*(channels[name] for name in names.split())), qf.Plan(COLUMNS, fringes, response="linear"))


@pytest.mark.parametrize("numbers", [(49, 48, 42), (25, 24, 20), (37, 36, 31)])
def test_other_numbers_of_three_are_refused(numbers: tuple[float, ...]) -> None:
    other = qf.Fringes(encoding="rgb", numbers=numbers)
    with pytest.raises(qf.DecodeError, match=r"are not those of this shot: .* which fits 36, 35, 30"):
        qf.decode(taken(fringes=THREE), qf.Plan(COLUMNS, other, response="linear"))


def test_exchanged_numbers_of_three_are_exchanged_channels() -> None:
    other = qf.Fringes(encoding="rgb", numbers=(36, 30, 35))
    with pytest.raises(qf.DecodeError, match="green and blue seem to be swapped"):
        qf.decode(taken(fringes=THREE), qf.Plan(COLUMNS, other, response="linear"))


@KINDS
@pytest.mark.parametrize("scene", [{"surface": "steps"}, {"surface": "peaks", "patch_mm": 20.0}])
def test_green_has_its_frequency_in_sound_shots(scene: dict[str, Any], fringes: qf.Fringes) -> None:
    closure = closure_of(taken(fringes=fringes, **scene), qf.Plan(COLUMNS, fringes, response="linear"))
    assert closure is not None
    hold("rgb.green_off", closure.green - 1)


def test_columns_of_the_scene_permit_finer_fringes() -> None:
    fringes = qf.Fringes(encoding="rgb", numbers=(36, 33), columns_px=(330, 620))
    with pytest.raises(qf.ConfigError, match="joint range"):
        qf.Fringes(encoding="rgb", numbers=(36, 33))
    assert _core.check_code((36, 33), COLUMNS, columns_px=(330, 620)) == pytest.approx(2 * np.pi / 12)
    config = qf.SystemConfig(fringes=fringes, scene=qf.SceneConfig(surface="plane", noise=0.03, seed=2))
    with qf.open(config) as scanner:
        shot = scanner.grab()
    column_px = qf.Decoder(shot, qf.Plan(COLUMNS, fringes)).decode_without_verdict(shot).column_px
    known = np.isfinite(column_px)
    hold("rgb.columns_beyond_px", np.maximum(330 - column_px[known], column_px[known] - 620).max())
    assert shot.truth is not None
    inside = known & (shot.truth.column_px > 345) & (shot.truth.column_px < 605)
    hold("rgb.columns_right_percent", 100 * np.mean(np.abs(column_px - shot.truth.column_px)[inside] < 1))
