"""A changed shot of a recording is named and not delivered; a recording of version 1 is read with a warning."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from support.takes import SHOTS, Change, changed
from typer.testing import CliRunner, Result

import quadfringe as qf
from quadfringe.cli import app
from quadfringe.data import FrameStamp, Stamp
from quadfringe.errors import InputError, RecordingError, RecordingWarning
from quadfringe.evaluation._takes import numbered_shot, whole
from quadfringe.io.bounded import Helper, Limits
from quadfringe.recording import Recorder, Recording, RecordingWriter, Verification, recover
from quadfringe.recording._layout import Header
from quadfringe.recording._params import OPEN_MAX
from quadfringe.recording._seal import read_seal
from quadfringe.recording._source import other_reader
from quadfringe.recording.replay import ReplayCamera

GOLDEN = Path(__file__).parent / "golden" / "take.h5"


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("takes") / "take.h5"
    with qf.open() as scanner, Recorder(path, scanner.config, scanner.calibration) as recorder:
        for number in range(SHOTS):
            frames = {name: FrameStamp(number, 7 * number, 9 * number) for name in ("visible", "ir")}
            stamp = Stamp(10 + number, 1_000_000 + 20_000 * number, "twin", frames)
            recorder.write(replace(numbered_shot(number), stamp=stamp))
    return path


@pytest.fixture
def take(original: Path, tmp_path: Path) -> Path:
    path = tmp_path / "take.h5"
    path.write_bytes(original.read_bytes())
    return path


def overwrite(take: Path, old: bytes, new: bytes) -> Path:
    data = take.read_bytes()
    assert data.count(old) == 1
    take.write_bytes(data.replace(old, new))
    return take


def damage_pixels(take: Path, shot: int) -> Path:
    with h5py.File(take) as file:
        place = file["blue"].id.get_chunk_info_by_coord((shot, 0, 0)).byte_offset
    with take.open("r+b") as raw:
        raw.seek(place + 100)
        raw.write(b"\xff\x00\xff\x00")
    return take


def run(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def opened(path: Path, reason: str) -> Recording:
    with pytest.warns(RecordingWarning, match=reason):
        return Recording(path)


def test_a_closed_recording_is_sealed_and_whole(take: Path) -> None:
    seal = read_seal(take)
    assert seal is not None
    assert (seal.shots, seal.holds) == (SHOTS, True)
    with Recording(take) as recording:
        assert recording.verifiable
        assert recording.verify() == Verification(SHOTS, (), ())
        assert recording.stamped.all()
    done = run("info", take, "--verify")
    assert done.exit_code == 0, done.output
    assert "6 of 6 shots are whole" in done.stdout
    assert f"SHA-256: {recording.sha256}" in done.stdout
    assert f"SHA-256: {recording.sha256}" in run("info", take).stdout


def test_a_byte_anywhere_outside_the_pixels_breaks_the_seal(take: Path) -> None:
    data = take.read_bytes()
    with h5py.File(take) as file:
        chunks: list[h5py.h5d.StoreInfo] = []
        for name in ("red", "green", "blue", "ir"):
            file[name].id.chunk_iter(chunks.append)
    pixels = np.zeros(len(data), bool)
    for chunk in chunks:
        pixels[chunk.byte_offset : chunk.byte_offset + chunk.size] = True
    for place in np.flatnonzero(~pixels)[::97].tolist():
        take.write_bytes(data[:place] + bytes([data[place] ^ 4]) + data[place + 1 :])
        seal = read_seal(take)
        assert seal is None or not seal.holds, place


def test_a_changed_calibration_is_refused_and_left_out_by_recover(take: Path, tmp_path: Path) -> None:
    with Recording(take) as recording:
        assert recording.calibration is not None
        focal = json.dumps(recording.calibration.camera.focal_px[0]).encode()
    data = take.read_bytes()
    place = data.rindex(b'"focal_px":[' + focal)
    take.write_bytes(data[:place] + data[place:].replace(focal, b"9" + focal[1:], 1))
    with pytest.raises(InputError, match=r"take\.h5: calibration was changed; quadfringe recover copies the shots"):
        Recording(take)
    failed = run("info", take, "--verify")
    assert failed.exit_code == 1
    assert "not as it was recorded" in failed.stderr
    assert "calibration was changed" in failed.stderr
    done = run("recover", take, "--out", tmp_path / "whole.h5")
    assert done.exit_code == 0, done.output
    assert "calibration was changed, and is left out" in done.stderr
    with Recording(tmp_path / "whole.h5") as recovered:
        assert (len(recovered), recovered.calibration) == (SHOTS, None)
        assert recovered.config is not None


def test_a_changed_stamp_is_refused_with_its_shot(take: Path, tmp_path: Path) -> None:
    for name, row in (("time_us", 2), ("id", 3), ("chip_stamps", 4)):
        changed(take, lambda file, name=name, row=row: file[name].__setitem__(row, file[name][row] + 1))  # type: ignore[misc]
    with opened(take, "no sound stamps of 3 shots: 2, 3, 4") as recording:
        assert recording.stamped.tolist() == [True, True, False, False, False, True]
        assert recording.ids.tolist() == [10, 11, 0, 0, 0, 15]
        assert recording.times_us[2:5].tolist() == [0, 0, 0]
        with pytest.raises(InputError, match="shot 2 is damaged"):
            recording[2]
        assert recording.verify().damaged == (2, 3, 4)
    with pytest.warns(RecordingWarning):
        found = recover(take, tmp_path / "whole.h5")
    assert (found.shots, found.damaged) == (3, (2, 3, 4))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda file: file.attrs.modify("device", "other"), "the header does not match its checksum"),
        (lambda file: file.attrs.modify("full_scale", 254.0), "the header does not match its checksum"),
        (lambda file: file.attrs.modify("schema_version", 1), "not the type or size of a recording"),
        (lambda file: file.attrs.modify("schema_version", 3), "recording version 3, expected 2 or 1"),
        (lambda file: file.attrs.__setitem__("format", [1, 2]), "got another HDF5 file"),
        (lambda file: file.attrs.__setitem__("schema_version", [1, 2]), r"recording version \[1, 2\]"),
        (lambda file: file.pop("closed"), "lacks closed"),
        (lambda file: file.__setitem__("extra", file.pop("time_us")[:]), "lacks time_us"),
        (lambda file: file["id"].resize((1 << 30,)), "claims 1073741824 shots"),
    ],
)
def test_a_changed_header_is_refused(take: Path, change: Change, reason: str) -> None:
    with pytest.raises(InputError, match=rf"take\.h5: .*{reason}"):
        Recording(changed(take, change))


def test_shots_that_were_taken_away_are_missed(take: Path) -> None:
    """The seal states the number of shots; without a seal, the longest dataset does."""
    changed(take, lambda file: [file[name].resize(SHOTS - 2, axis=0) for name in ("id", "time_us", "crc32")])
    with opened(take, "no sound stamps of 2 shots: 4, 5") as recording:
        assert len(recording) == SHOTS
        assert recording.read(5) is None
        assert whole(recording[3], 3)


def test_a_recording_cut_to_half_does_not_pass_as_whole(take: Path) -> None:
    take.write_bytes(take.read_bytes()[: take.stat().st_size // 2])
    for options in ((), ("--verify",)):
        result = run("info", take, *options)
        assert "cut short by" in result.stderr
        assert result.exit_code == (1 if options else 0)
    assert "damaged shots: " in result.stderr
    assert "4, 5\n" in result.stderr


def test_a_recording_without_its_tables_is_an_error_in_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """HDF5 would wait for the tables of a file whose writer was killed."""
    monkeypatch.setattr(other_reader, "helper", Helper(Limits(time_s=0.5, memory_bytes=1 << 28)))
    first = numbered_shot(0)
    with RecordingWriter(tmp_path / "growing.h5", Header.of(first, None, None)) as writer:
        for number in range(SHOTS):
            writer.append(numbered_shot(number))
        data = bytearray(writer.path.read_bytes())
    path = tmp_path / "killed.h5"
    tables = [place for place in range(len(data)) if data[place : place + 4] in (b"EAHD", b"EAIB", b"OHDR")]
    assert len(tables) > 5
    for place in tables[::3]:
        data[place + 6] ^= 0x40
    path.write_bytes(data)
    with pytest.raises(RecordingError, match=r"killed\.h5: cannot be read: reading it does not end within 0\.5 s"):
        Recording(path)
    os.truncate(path, len(data) // 2)
    with pytest.raises(
        RecordingError, match=r"killed\.h5: \d+ bytes are missing, and it cannot be read: .*copy it again"
    ):
        Recording(path)


def test_hdf5_opens_no_file_in_this_process(take: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A seal is no reason: whoever damages a file can compute it anew."""

    def refuse(*_arguments: object, **_named: object) -> None:
        raise AssertionError("opened in this process")

    monkeypatch.setattr(h5py, "File", refuse)
    with Recording(take) as recording:
        assert all(whole(shot, number) for number, shot in enumerate(recording))


def test_images_that_another_program_stored_otherwise_are_read(take: Path) -> None:
    def compress(file: h5py.File) -> None:
        for name in ("red", "green", "blue", "ir"):
            images = file.pop(name)[:]
            file.create_dataset(name, data=images, chunks=(2, *images.shape[1:]), compression="gzip")

    with opened(changed(take, compress), "changed since it was closed") as recording:
        assert all(whole(shot, number) for number, shot in enumerate(recording))


def test_many_files_are_open_at_once_and_closed_ones_stay_closed(take: Path) -> None:
    opened = [Recording(take) for _ in range(OPEN_MAX + 3)]
    for number in range(SHOTS):
        assert all(whole(recording[number], number) for recording in opened)
    for recording in opened:
        recording.close()
        recording.close()


def test_verify_names_damaged_shots(take: Path) -> None:
    damage_pixels(damage_pixels(take, 1), 4)
    result = run("info", take, "--verify")
    assert result.exit_code == 1
    assert "4 of 6 shots are whole" in result.stdout
    assert "damaged shots: 1, 4" in result.stderr
    assert run("info", take).exit_code == 0
    wrong = run("info", __file__, "--verify")
    assert (wrong.exit_code, "--verify is for recordings" in wrong.stderr) == (2, True)


def test_replay_leaves_out_damaged_shots_and_counts_them(take: Path) -> None:
    camera = ReplayCamera(Recording(damage_pixels(take, 2)), "full")
    with pytest.warns(RecordingWarning, match="shot 2 is damaged"):
        assert [shot.stamp.id for shot in camera.stream() if shot.stamp] == [10, 11, 13, 14, 15]
    assert (camera.statistics().shots, camera.statistics().damaged) == (5, 1)
    camera.close()
    camera = ReplayCamera(Recording(take))
    camera.snap()
    camera.snap()
    with pytest.raises(InputError, match="shot 2 is damaged"):
        camera.snap()
    assert camera.snap().id == 13
    camera.close()


def test_a_recording_of_version_1_is_read_with_a_warning(tmp_path: Path) -> None:
    with opened(GOLDEN, "earlier version: stamps, settings and calibration have no checksums") as recording:
        assert not recording.verifiable
        assert recording.verify() == Verification(1, (), ())
        assert recording.calibration is not None
    done = run("info", GOLDEN, "--verify")
    assert (done.exit_code, "warning: " in done.stderr) == (0, True), done.output
    assert "cannot be verified" in done.stderr
    for source, copy in ((GOLDEN, "new.h5"), (tmp_path / "new.h5", "newer.h5")):
        with pytest.warns(RecordingWarning):
            assert recover(source, tmp_path / copy).shots == 1
        with opened(tmp_path / copy, "an earlier version, whose stamps, settings and cal") as recovered:
            assert not recovered.verifiable


def test_wild_times_of_version_1_are_described_and_replayed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They have no checksum there."""
    path = tmp_path / "take.h5"
    path.write_bytes(GOLDEN.read_bytes())
    changed(path, lambda file: file["time_us"].__setitem__(0, (1 << 63) - 1))
    done = run("info", path)
    assert done.exit_code == 0, done.output
    assert "begin: 294247-01-10T04:00:54.775Z" in done.stdout
    monkeypatch.setattr("quadfringe.recording.replay.TIMEOUT_MAX", 0.0)
    with pytest.warns(RecordingWarning):
        camera = ReplayCamera(Recording(path))
    assert len(list(camera.stream())) == 1
    camera.close()


def test_the_identity_is_that_of_the_content(take: Path, original: Path, tmp_path: Path) -> None:
    with Recording(take) as one, Recording(original) as same:
        assert one.sha256 == same.sha256
        other = tmp_path / "other.h5"
        with Recorder(other, one.config, one.calibration) as recorder:
            for shot in one:
                assert shot.stamp is not None
                recorder.write(replace(shot, stamp=replace(shot.stamp, time_us=shot.stamp.time_us + 1)))
    with Recording(other) as another:
        assert another.sha256 != one.sha256
