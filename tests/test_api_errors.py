"""First calls of a new user: errors that name the argument at fault, options of one method, and reprs of one line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import quadfringe as qf


@pytest.mark.parametrize(
    ("call", "reason"),
    [
        (lambda: qf.Fringes([36, 35, 30]), r"Fringes: expected fields by name, such as numbers=\.\.\."),
        (lambda: qf.Fringes(numbers=[36, 35]), "numbers: expected three fringe numbers"),
        (lambda: qf.decode((64, 64), qf.Plan(912)), r"expected a shot, got \(64, 64\)"),
        (lambda: qf.decode("folder", qf.Plan(912)), "read it with qf.read_shot"),
        (lambda: qf.Decoder("folder", qf.Plan(912)), "read it with qf.read_shot"),
        (lambda: qf.estimate_response(Path("folder"), qf.Plan(912)), "read it with qf.read_shot"),
        (lambda: qf.open_system(3), r"expected a system file \(.toml\), .* got 3"),
        (lambda: qf.optimum(-3, 912), "n: expected a number from 1 to 65536, got -3"),
        (lambda: qf.optimum(2.5, 912), "n: expected a whole number, got 2.5"),
        (lambda: qf.pattern("violet", (36, 35, 30), 912, 4), "channel: expected one of red, green, blue, ir"),
        (lambda: qf.pattern("red", 36, 912, 4), "expected three fringe numbers"),
        (lambda: qf.stages.demodulate({}, 36), "expected three fringe numbers"),
        (lambda: qf.Stamp("a", "b", 3), "id: expected an integer, got 'a'"),
        (lambda: qf.Stamp(1, 2, 3), "device: expected the name of a camera, got 3"),
    ],
)
def test_a_call_names_the_argument_at_fault(call: Callable[[], object], reason: str) -> None:
    with pytest.raises(qf.InputError, match=reason):
        call()


def test_a_channel_has_the_name_of_the_records_or_a_letter() -> None:
    for name, letters in (("red", "R"), ("green", "G"), ("blue", "B"), ("ir", "IR")):
        first, second = (qf.pattern(word, (36, 35, 30), 912, 2) for word in (name, letters))
        np.testing.assert_array_equal(first, second)


def test_options_go_with_their_method() -> None:
    with pytest.raises(qf.ConfigError, match='channel_instants_us needs method = "joint"'):
        qf.DecodeConfig(method="published", channel_instants_us=(0, 1, 2, 3))
    assert qf.DecodeConfig(channel_instants_us=(0, 1, 2, 3)).channel_instants_us == (0, 1, 2, 3)


def test_an_object_without_a_record_has_a_repr_of_one_line(small_bench: Path, tmp_path: Path) -> None:
    with qf.open(small_bench) as scanner:
        shot = scanner.grab()
        wrapped = qf.stages.demodulate(qf.stages.linear_light(shot), scanner.config.fringes.numbers)
        decoder = qf.Decoder(shot, scanner.plan)
        take = tmp_path / "take.h5"
        with qf.recording.Recorder(take) as recorder:
            recorder.write(shot)
        with qf.recording.Recording(take) as recording, qf.open_camera(f"replay:{take}") as replay:
            stream = scanner.stream(1)
            assert [measured.shape is not None for measured in stream] == [True]
            others = (recording, replay, stream, qf.devices.ExternalLight())
        assert repr(recording) == "Recording(take.h5, 1 shots of 512 x 384 uint8)"
        assert "response='" in repr(stream.statistics()) or "response=Response" in repr(stream.statistics())
        for made in (scanner, scanner.camera, scanner.projector, decoder, wrapped, *others):
            assert type(made).__name__ in repr(made)
            assert " at 0x" not in repr(made)
            assert len(repr(made)) <= 120
