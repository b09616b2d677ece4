"""A response that nobody states is estimated once from the first sound shots, then held and reported."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.bars import hold, tolerance
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.cli.app import app
from quadfringe.data import AnyShot
from quadfringe.decoding.response import SHOTS_TRIED
from quadfringe.devices import CameraStatistics, ExternalLight
from quadfringe.scanner import LiveStream

CAMERA = qf.Device(width_px=512, height_px=384, focal_px=(1290.0, 1290.0), centre_px=(255.5, 191.5))
PLAN = qf.Plan(912)
SILENT = {"response": None, "crosstalk": None, "projector_response": None}


def taken(**scene: Any) -> qf.Shot:
    config = qf.SystemConfig(camera=CAMERA, scene=qf.SceneConfig(noise=0.01, seed=1, **scene))
    with qf.open(config) as scanner:
        shot = scanner.grab()
    assert isinstance(shot, qf.Shot)
    return shot


@pytest.fixture(scope="module")
def bent() -> list[qf.Shot]:
    return [taken(surface=name, projector_exponent=1.8) for name in ("face", "sphere", "steps")]


@pytest.fixture(scope="module")
def straight() -> qf.Shot:
    return taken(surface="steps")


def black(shot: qf.Shot) -> qf.Shot:
    return replace(shot, ir=np.zeros_like(shot.ir))


def test_the_first_sound_shot_decides(bent: list[qf.Shot]) -> None:
    decoder = qf.Decoder(bent[0], PLAN)
    assert decoder.response == "auto"
    with pytest.raises(qf.DecodeError, match="ir is black"):
        decoder.decode(black(bent[1]))
    assert decoder.response == "auto"
    first = decoder.decode(bent[0])
    held = decoder.response
    assert isinstance(held, qf.Response)
    assert held == qf.estimate_response(bent[0], PLAN)
    second = decoder.decode(bent[1])
    assert decoder.response == held
    for shape in (first, second):
        assert (shape.config["response"], shape.config["response_from"]) == (held.model_dump(), "shots")
    known = qf.decode(bent[1], replace(PLAN, response=held))
    np.testing.assert_array_equal(second.phase_rad, known.phase_rad)
    assert (known.config["response"], known.config["response_from"]) == (held.model_dump(), "plan")


def test_light_is_linear_after_shots_that_show_no_response(bent: list[qf.Shot], straight: qf.Shot) -> None:
    decoder = qf.Decoder(straight, PLAN)
    for _ in range(SHOTS_TRIED - 1):
        decoder.decode(straight)
        assert decoder.response == "auto"
    decoder.decode(straight)
    assert decoder.response == "linear"
    assert decoder.decode(bent[0]).config["response"] is None
    late = qf.Decoder(straight, PLAN)
    late.decode(straight)
    late.decode(bent[0])
    assert isinstance(late.response, qf.Response)


def test_a_shape_without_a_verdict_holds_nothing(bent: list[qf.Shot]) -> None:
    decoder = qf.Decoder(bent[0], PLAN)
    shape = decoder.decode_without_verdict(bent[0])
    assert decoder.response == "auto"
    np.testing.assert_array_equal(shape.phase_rad, decoder.decode(bent[0]).phase_rad)


@pytest.mark.parametrize("response", ["linear", qf.Response(red={"exponent": 0.5})])
def test_a_stated_response_is_in_force_from_the_start(bent: list[qf.Shot], response: Any) -> None:
    decoders = [
        qf.Decoder(bent[0], plan)
        for plan in (qf.Plan(912, response=response), qf.Plan(912, decode={"response": response}))
    ]
    assert [decoder.response for decoder in decoders] == [response, response]


def test_linear_corrects_neither_camera_nor_projector(bent: list[qf.Shot]) -> None:
    crosstalk = tuple(tuple(1.0 if a == b else 0.02 for b in range(4)) for a in range(4))
    config = qf.SystemConfig(camera=CAMERA, scene={"crosstalk": crosstalk, "projector_exponent": 1.8})
    with qf.open(config) as scanner:
        calibration = scanner.calibration
    assert calibration is not None
    assert calibration.projector_response is not None
    without = calibration.model_copy(update={"response": None, "projector_response": None})
    shapes = [
        qf.decode(bent[0], qf.Plan(912, calibration=known, response="linear")) for known in (calibration, without)
    ]
    np.testing.assert_array_equal(shapes[0].phase_rad, shapes[1].phase_rad)


def test_search_along_rays_estimates_a_response_too() -> None:
    """The joint method, which finds a response best, cannot search along camera rays."""
    config = qf.SystemConfig(camera=CAMERA, scene={"surface": "face", "projector_exponent": 1.8, "noise": 0.01})
    with qf.open(config) as scanner:
        shot, calibration = scanner.grab(), scanner.calibration
    assert calibration is not None
    silent = calibration.model_copy(update=SILENT)
    plan = qf.Plan(912, calibration=silent, decode={"method": "published", "unwrapping": "pair"})
    shape, linear = qf.decode(shot, plan), qf.decode(shot, replace(plan, response="linear"))
    assert shape.config["response_from"] == "shots"
    assert shape.config["response"]["red"]["exponent"] == pytest.approx(
        1 / 1.8, rel=tolerance("response.exponent_error")
    )
    assert shape.depth_mm is not None
    assert linear.depth_mm is not None
    assert shot.truth is not None
    errors = [np.nanmedian(np.abs(found.depth_mm - shot.truth.depth_mm)) for found in (shape, linear)]
    hold("response.depth_of_uncorrected_along_rays", errors[0] / errors[1])


class Feed:
    """A camera that gives these shots."""

    name, paced, calibration = "feed", False, None

    def __init__(self, shots: list[qf.Shot]) -> None:
        self._shots = shots

    def stream(self, count: int | None = None, *, keep: str = "latest") -> Iterator[AnyShot]:  # noqa: ARG002
        yield from self._shots

    def interrupt(self) -> None:
        pass

    def statistics(self) -> CameraStatistics:
        return CameraStatistics()

    def close(self) -> None:
        pass


@pytest.mark.parametrize("method", ["joint", "published"])
def test_a_stream_holds_what_its_first_sound_shot_shows(bent: list[qf.Shot], method: str) -> None:
    shots = [black(bent[2]), *bent]
    config = qf.SystemConfig(decode={"method": method})
    expected = qf.estimate_response(bent[0], qf.Plan(912, decode={"method": method}))
    with qf.Scanner(config, ExternalLight(), Feed(shots), None) as scanner:  # type: ignore[arg-type]
        assert scanner.response == "auto"
        with scanner.stream(keep="all") as stream:
            found = list(stream)
            assert stream.statistics().response == scanner.response == expected
    assert [measured.error is None for measured in found] == [False, True, True, True]
    assert all(m.result().config["response"] == expected.model_dump() for m in found[1:])  # type: ignore[union-attr]


def test_shots_are_decoded_one_by_one_until_the_response_is_held() -> None:
    """Two threads would otherwise estimate from whichever shot comes first."""
    shot = qf.Shot(*np.zeros((4, 2, 2), np.uint8))
    decoding, most, order, lock = 0, {"auto": 0, "linear": 0}, [], threading.Lock()
    response: Any = "auto"

    def decode(shot: AnyShot) -> qf.Shape:
        nonlocal decoding, response
        with lock:
            decoding += 1
            most[response] = max(most[response], decoding)
            order.append(shot.id)
        time.sleep(0.02)
        with lock:
            decoding -= 1
            response = "linear" if shot.id == 4 else response
        return qf.Shape(*np.zeros((4, 2, 2), np.float32))

    shots = [replace(shot, stamp=qf.Stamp(number, 0, "feed")) for number in range(12)]
    with LiveStream(Feed(shots), decode, keep="all", at_once=2, response=lambda: response) as stream:  # type: ignore[arg-type]
        assert len(list(stream)) == len(shots)
    assert most == {"auto": 1, "linear": 2}
    assert order[:5] == list(range(5))


def test_a_system_file_names_a_response(tmp_path: Path) -> None:
    stated = qf.ResponseCalibration(red={"exponent": 0.5})
    stated.save(tmp_path / "response.json")
    for text in ('response = "response.json"', "response = { red = { exponent = 0.5 } }"):
        (tmp_path / "system.toml").write_text(f"[decode]\n{text}\n")
        with qf.open(tmp_path) as scanner:
            assert scanner.response == qf.Response(red={"exponent": 0.5}) or scanner.response == stated
            recorded = qf.SystemConfig.model_validate_json(scanner.config.model_dump_json(exclude_none=True))
            assert isinstance(recorded.decode.response, qf.Response)
    (tmp_path / "system.toml").write_text('[decode]\nresponse = "liner"\n')
    with pytest.raises(qf.ConfigError, match=r'decode\.response: expected "auto", "linear"'):
        qf.open(tmp_path)


@pytest.mark.parametrize(
    ("words", "source", "exponent"),
    [
        ([], "shots", 1 / 1.8),
        (["--response", "auto"], "shots", 1 / 1.8),
        (["--response", "linear"], "plan", None),
        (["--linear"], "plan", None),
        (["--response", "linear", "--linear"], "plan", None),
        (["--response", "response.json"], "plan", 0.5),
    ],
)
def test_the_command_line_names_a_response(
    bent: list[qf.Shot], tmp_path: Path, words: list[str], source: str, exponent: float | None
) -> None:
    files = qf.data.write_shot(tmp_path, bent[0])
    half = {"exponent": 0.5}
    qf.ResponseCalibration(red=half, green=half, blue=half, ir=half).save(tmp_path / "response.json")
    words = [str(tmp_path / word) if word.endswith(".json") else word for word in words]
    images = [word for name, path in files.items() for word in (f"--{name}", str(path))]
    fringes = ["--fringes", "36", "35", "30", "--projector-width", "912", "--out", str(tmp_path / "x.npz")]
    done = CliRunner().invoke(app, ["decode", *images, *fringes, *words])
    assert done.exit_code == 0, done.output
    config = qf.Shape.load(tmp_path / "x.npz").config
    assert config["response_from"] == source
    if exponent is None:
        assert config["response"] is None
    else:
        assert config["response"]["red"]["exponent"] == pytest.approx(
            exponent, rel=tolerance("response.exponent_error")
        )
