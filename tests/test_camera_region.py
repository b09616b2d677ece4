"""A region of the camera chip that differs from that of the calibration is refused, live and from recordings."""

from __future__ import annotations

from pathlib import Path

import pytest

import quadfringe as qf
from quadfringe.calibration.session import FolderCaptures, Session
from quadfringe.calibration.session.acquisition import keep_region
from quadfringe.config.cameras import AravisConfig, ChipConfig, VirtualConfig
from quadfringe.data import Calibration, CalibrationRecord
from quadfringe.devices.region import calibrated_offset_px, check_region, region_step
from quadfringe.recording import Recorder

SEEN, MOVED = (64, 20), (64, 0)


def of_region(calibration: Calibration, offset_px: tuple[int, int]) -> Calibration:
    made = {"made_utc": "2026-01-01T00:00:00+00:00", "quadfringe_version": "0", "rig": "bench"}
    return calibration.model_copy(update={"record": CalibrationRecord(**made, steps=(region_step(offset_px),))})


def sent(offset_px: tuple[int, int] | None) -> qf.SystemConfig:
    return qf.SystemConfig(capture=AravisConfig(visible=ChipConfig(offset_px=offset_px)))


def test_a_region_that_moved_is_refused(tmp_path: Path, bench: tuple[qf.Shot, Calibration]) -> None:
    shot, calibration = bench
    known = of_region(Calibration.load(saved(tmp_path, calibration)), SEEN)
    assert calibrated_offset_px(known) == SEEN
    for offset_px in (SEEN, None):
        check_region(known, offset_px)
    check_region(calibration, MOVED)
    take = tmp_path / "take.h5"
    with Recorder(take, sent(MOVED), calibration) as recorder:
        recorder.write(shot)
    with qf.open(qf.SystemConfig(capture={"kind": "replay", "file": take})) as scanner:
        assert isinstance(scanner.grab(), qf.Shot)
    known.save(tmp_path / "bench.json")
    replayed = qf.SystemConfig(capture={"kind": "replay", "file": take}, calibration=tmp_path / "bench.json")
    with pytest.raises(qf.InputError, match=r"begin at column 64 and row 0 of the chip.*set offset_px = \[64, 20\]"):
        qf.open(replayed)


def saved(folder: Path, calibration: Calibration) -> Path:
    of_region(calibration, SEEN).save(folder / "calibration.json")
    return folder / "calibration.json"


def test_a_session_keeps_the_region_of_its_first_capture(tmp_path: Path) -> None:
    Session(rig="bench").save(tmp_path / "session.json")
    captures = FolderCaptures(tmp_path)
    for config in (qf.SystemConfig(capture=VirtualConfig()), sent(None)):
        keep_region(captures, config)
    assert captures.session.offset_px is None
    keep_region(captures, sent(SEEN))
    again = FolderCaptures(tmp_path)
    assert again.session.offset_px == SEEN
    keep_region(again, sent(SEEN))
    with pytest.raises(qf.InputError, match=r"begin at column and row \[64, 0\].*earlier captures at \[64, 20\]"):
        keep_region(again, sent(MOVED))
