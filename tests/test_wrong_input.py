"""What a person may type first: every call with a plausible wrong argument says what it expects."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from pydantic import BaseModel
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe import config, data, devices, stages
from quadfringe.cli import app

SHOT = qf.Shot(*np.zeros((4, 64, 64), np.uint8))
NUMBERS = (36, 35, 30)


@pytest.mark.parametrize(
    ("plan", "made"),
    [
        (912, "912"),
        (1920, "1920"),
        ("calibration.json", "912, calibration='calibration.json'"),
        (qf.DecodeConfig(threads=1), r"912, decode=DecodeConfig\(threads=1\)"),
        (qf.Fringes(), r"912, fringes=Fringes\(\)"),
        (None, "912"),
    ],
)
@pytest.mark.parametrize("call", [qf.decode, qf.Decoder, qf.estimate_response])
def test_anything_but_a_plan_says_how_to_make_one(call: Callable[..., object], plan: Any, made: str) -> None:
    with pytest.raises(qf.InputError, match=rf"plan: expected a Plan, such as qf.Plan\({made}\), got "):
        call(SHOT, plan)


@pytest.mark.parametrize(
    ("call", "reason"),
    [
        (lambda: qf.open_projector("x"), r"config: expected a SystemConfig, .* got 'x'; .* qf.config.load_system"),
        (lambda: devices.open_devices(5), r"config: expected a SystemConfig, such as qf.SystemConfig\(\), got 5"),
        (lambda: qf.Scanner("x", None, None), "config: expected a SystemConfig"),
        (lambda: qf.Scanner(qf.SystemConfig(), None, None, 5), "calibration: expected a Calibration or the path"),
        (lambda: stages.linear_light("shot"), "expected a shot, got the path 'shot'; read it with qf.read_shot"),
        (lambda: stages.response_of_shot(None, None, NUMBERS, 912), "expected a shot, got None"),
        (lambda: stages.order(SHOT, NUMBERS, 912), r"wrapped: expected a Wrapped, .* got Shot\("),
        (lambda: stages.demodulate(None, NUMBERS), "light: expected red, green, blue, ir by name, .* got None"),
        (lambda: stages.demodulate({"red": SHOT.red}, NUMBERS), "light: expected .* got only red"),
        (lambda: stages.demodulate(dict.fromkeys(SHOT.channels, 1), NUMBERS), "red: expected an array .* got int"),
        (lambda: stages.wrapped_phases(SHOT, NUMBERS), "light: expected .* stages.linear_light"),
    ],
)
def test_a_call_says_what_it_expects(call: Callable[[], object], reason: str) -> None:
    with pytest.raises(qf.InputError, match=reason):
        call()


# Records


DEVICE = {"width_px": 8, "height_px": 6, "focal_px": (20, 20), "centre_px": (3, 2)}
PAIR = {"method": "published", "unwrapping": "pair"}


@pytest.mark.parametrize(
    ("record", "values", "reason"),
    [
        (
            qf.DecodeConfig,
            {"channel_instants_us": (0,) * 4},
            "channel_instants_us: expected times that differ, or none",
        ),
        (qf.DecodeConfig, PAIR | {"depth_range_mm": (1000, 600)}, "depth_range_mm: expected two growing depths"),
        (qf.DecodeConfig, PAIR | {"depth_range_mm": (-1, 600)}, "depth_range_mm: expected two growing depths"),
        (qf.DecodeConfig, {"modulation_min": 5}, r"modulation_min: expected a fraction in \[0, 1\), got 5$"),
        (qf.DecodeConfig, {"quality_min": -0.1}, r"quality_min: expected a fraction in \[0, 1\), got -0.1$"),
        (qf.Fringes, {"numbers": (36, 36, 30)}, r"numbers: expected .* joint range .*, got \(36, 36, 30\)"),
        (qf.Fringes, {"numbers": (16, 8, 4)}, "numbers: expected .* joint range"),
        (qf.Fringes, {"numbers": (-36, 35, 30)}, "numbers.0: expected a number above 0, got -36"),
        (qf.Device, DEVICE | {"rotation": ((1, 0, 0), (0, 1, 0), (0, 0, 5))}, "rotation: expected a proper rotation"),
    ],
)
def test_settings_check_themselves_by_the_rules_of_the_kernel(
    record: Callable[..., object], values: dict[str, Any], reason: str
) -> None:
    with pytest.raises(qf.ConfigError, match=reason):
        record(**values)


def test_a_plan_checks_its_fringes_over_its_columns() -> None:
    for numbers in ((36, 36, 30), (-36, 35, 30)):
        with pytest.raises(qf.ConfigError, match="fringes: 1 problem\n  numbers"):
            qf.Plan(912, numbers)
    with pytest.raises(qf.InputError, match=r"below 30 \(half the projector width\), got 36"):
        qf.Plan(60, NUMBERS)


def test_images_and_maps_have_pixels() -> None:
    with pytest.raises(qf.InputError, match=r"red: expected one grey image .* without pixels, of shape \(0, 0\)"):
        qf.Shot(*np.zeros((4, 0, 0), np.uint8))
    with pytest.raises(qf.InputError, match=r"phase_rad: expected an array \(H, W\), got an array of shape \(0, 5\)"):
        qf.Shape(*np.zeros((4, 0, 5), np.float32))


@pytest.mark.parametrize("bits", [0, -3, 17, 99, 12.5, "12"])
def test_bits_are_those_of_a_file(tmp_path: Path, bits: Any) -> None:
    data.write_shot(tmp_path, qf.Shot(*np.zeros((4, 6, 8), np.uint16)))
    with pytest.raises(qf.InputError, match=f"bits: expected the number of bits in use, from 1 to 16, .* got {bits!r}"):
        qf.read_shot(tmp_path, bits)
    assert qf.read_shot(tmp_path, 16).full_scale == 65535


def test_bits_of_other_files_are_refused(tmp_path: Path) -> None:
    data.write_shot(tmp_path, qf.Shot(*np.zeros((4, 6, 8), np.uint8)))
    with pytest.raises(
        qf.InputError, match=r"red.png: expected uint16 pixels for bits = 12, got uint8; leave bits out"
    ):
        qf.read_shot(tmp_path, 12)


# Words of a wrong setting


class Every(config.Model):
    """One field of each kind whose problems are put into words."""

    number: config.Positive = 1.0
    part: config.NotNegative = 0.0
    count: config.Pixels = 1
    flag: bool = False
    text: str = ""
    word: Literal["a", "b"] = "a"
    file: Path = Path()
    pair: tuple[config.Finite, config.Finite] = (0.0, 0.0)
    table: dict[str, int] = {}  # noqa: RUF012 - pydantic copies it
    fringes: qf.Fringes = qf.Fringes()
    capture: config.AnyCapture = config.VirtualConfig()


@pytest.mark.parametrize(
    ("values", "line"),
    [
        ({"number": "x"}, "number: expected a number, got 'x'"),
        ({"number": [1]}, "number: expected a number, got [1]"),
        ({"number": 0}, "number: expected a number above 0, got 0"),
        ({"number": float("inf")}, "number: expected a finite number, got inf"),
        ({"part": -1}, "part: expected a number of at least 0, got -1"),
        ({"count": 1.5}, "count: expected a whole number, got 1.5"),
        ({"count": "x"}, "count: expected a whole number, got 'x'"),
        ({"count": 65537}, "count: expected a number of at most 65536, got 65537"),
        ({"flag": "maybe"}, "flag: expected true or false, got 'maybe'"),
        ({"text": 5}, "text: expected a text, got 5"),
        ({"word": "c"}, "word: expected 'a' or 'b', got 'c'"),
        ({"file": 5}, "file: expected a path, got 5"),
        ({"pair": 5}, "pair: expected a list, got 5"),
        ({"pair": (1,)}, "pair.1: this entry is required and missing"),
        ({"pair": (1, 2, 3)}, "pair: expected at most 2 entries, got (1, 2, 3)"),
        ({"table": 5}, "table: expected a table, got 5"),
        ({"fringes": 5}, "fringes: expected a table of the keys of Fringes, got 5"),
        (
            {"capture": 5},
            'capture: expected "virtual:", "aravis:NAME", "uvc:NUMBER", "files:FOLDER" or "replay:FILE", got 5',
        ),
        ({"capture": {}}, "capture: expected a table with the key 'kind', got {}"),
        (
            {"capture": {"kind": "x"}},
            "capture: expected one of 'virtual', 'aravis', 'uvc', 'files', 'replay' as 'kind'",
        ),
        ({"nmber": 1}, "nmber: this key is not known; did you mean number?"),
    ],
)
def test_errors_of_settings_have_one_form(values: dict[str, Any], line: str) -> None:
    with pytest.raises(qf.ConfigError) as caught:
        Every(**values)
    assert str(caught.value).splitlines()[1].strip().startswith(line)


def test_no_setting_has_words_of_pydantic() -> None:
    models = [m for m in vars(config).values() if isinstance(m, type) and issubclass(m, BaseModel) and m.model_fields]
    wrong = (object(), "?", -1, 2.5, 1e9, float("nan"), "", (), {})
    for model in models:
        for name, value in ((name, value) for name in model.model_fields for value in wrong):
            with suppress(qf.ConfigError):
                model(**{name: value})
                continue
            with pytest.raises(qf.ConfigError) as caught:
                model(**{name: value})
            assert not {"Input", "String", "Value", "valid"} & set(str(caught.value).split()), str(caught.value)


# Options of commands


def said_of(*arguments: object) -> str:
    result = CliRunner().invoke(app, [str(a) for a in arguments], env={"NO_COLOR": "1", "COLUMNS": "300"})
    assert result.exit_code == 2, result.output
    return " ".join(result.stderr.replace("│", " ").split())


DECODE = ("decode", "shot", "--out", "x.npz", "--projector-width", 912, "--fringes", 36, 35)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (
            (*DECODE, 30, "--depth-range-mm", 600, 1000),
            "error: --depth-range-mm needs --calibration FILE: without a calibration there are no depths",
        ),
        (
            (*DECODE, 30, "--method", "published", "--channel-instants-us", 0, 1, 2, 3),
            "--channel-instants-us needs --method joint, and the method is published: "
            "change the method, or leave --channel-instants-us out",
        ),
        (
            (*DECODE, 30, "--period-px", 150, 80),
            "--period-px: expected the shortest period before the longest, got 150 and 80",
        ),
        (
            (*DECODE, 30, "--channel-instants-us", 0, 0, 0, 0),
            "--channel-instants-us: expected times that differ, or none, got (0, 0, 0, 0)",
        ),
        (
            (*DECODE, "--linear"),
            "numbers: expected three fringe numbers, such as (36, 35, 30), got 2; without infrared",
        ),
        ((*DECODE, 35), "error: --fringes: 1 problem numbers: expected fringe numbers whose joint range"),
        ((*DECODE, 30, "--method", "cow"), "expected joint or published, got 'cow'"),
        *(
            (
                (*DECODE, 30, "--bits", bits),
                f"'--bits': expected one of '8', '9', '10', '11', '12', '13', '14', '15', '16', got '{bits}'",
            )
            for bits in (7, 17)
        ),
        (("target", "cow"), "expected one of 'rings', 'circles', 'asymmetric', 'charuco', got 'cow'"),
        (("live", "--port", "x"), "'--port': expected a whole number, got 'x'"),
        (("simulate", "--surface", "cow", "--out", "x"), "scene.surface: expected 'plane', 'peaks',"),
    ],
)
def test_a_command_says_what_an_option_expects(arguments: tuple[object, ...], reason: str) -> None:
    said = said_of(*arguments)
    assert reason in said
    assert "None" not in said
    assert "top level" not in said


# Files of another kind


@pytest.mark.parametrize("suffix", [".ply", ".tif"])
def test_a_shape_is_loaded_from_npz(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(qf.InputError, match=rf"shape{suffix}: expected a shape saved as .npz; the other files "):
        qf.Shape.load(tmp_path / f"shape{suffix}")
    (tmp_path / "x.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    with pytest.raises(
        qf.InputError, match=r"x.png: expected an archive of arrays \(\.npz\), got another kind of file$"
    ):
        qf.Shape.load(tmp_path / "x.png")


def test_a_size_of_one_entry_is_written_as_a_tuple() -> None:
    with pytest.raises(qf.InputError, match=r"expected a shot or a size \(rows, columns\), got \(768,\)"):
        qf.Decoder((768,), qf.Plan(912))
