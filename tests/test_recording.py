"""Recordings: shots reported as written are readable, also after faults of the writer, the disk or the file."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import quadfringe as qf
from quadfringe.config.cameras import ReplayConfig
from quadfringe.data import AnyShot, BayerShot, FrameStamp, Stamp
from quadfringe.devices import open_camera
from quadfringe.errors import InputError, RecordingError, RecordingWarning, ShotTimeoutError
from quadfringe.evaluation._takes import kill_writer, numbered_shot, run_with_file_limit, whole
from quadfringe.recording import Recorder, Recording, RecordingWriter, recover
from quadfringe.recording._layout import Header
from quadfringe.recording.inspection import lines_about
from quadfringe.recording.replay import ReplayCamera


def stamped(shot: AnyShot, number: int, period_us: int = 20_000) -> AnyShot:
    frames = {name: FrameStamp(number + i, 7 * number + i, 9 * number + i) for i, name in enumerate(("visible", "ir"))}
    return replace(shot, stamp=Stamp(number, 1_000_000 + period_us * number, "twin", frames))


def mosaic(number: int) -> AnyShot:
    shot = numbered_shot(number)
    return BayerShot(shot.images["red"].astype(np.uint16) * 16, "rggb", shot.images["ir"].astype(np.uint16), 4095.0)


def record(path: Path, shots: list[AnyShot], **settings: object) -> Path:
    with Recorder(path, **settings) as recorder:  # type: ignore[arg-type]
        for shot in shots:
            recorder.write(shot)
        assert recorder.statistics().written == len(shots)
    return path


@pytest.fixture
def take(tmp_path: Path) -> Path:
    return record(tmp_path / "take.h5", [stamped(numbered_shot(k), k) for k in range(6)])


@pytest.mark.parametrize("make", [numbered_shot, mosaic])
def test_shots_come_back_as_they_went_in(tmp_path: Path, make: Callable[[int], AnyShot]) -> None:
    shots = [stamped(make(k), k) for k in range(5)]
    with Recording(record(tmp_path / "a.h5", shots)) as take:
        assert (len(take), take.closed_in_order) == (5, True)
        for before, after in zip(shots, take, strict=True):
            assert type(after) is type(before)
            assert (after.stamp, after.full_scale_value) == (before.stamp, before.full_scale_value)
            for name, image in before.images.items():
                assert after.images[name].dtype == image.dtype
                np.testing.assert_array_equal(after.images[name], image)
        np.testing.assert_array_equal(take[-1].images["ir"], shots[-1].images["ir"])
        with pytest.raises(IndexError):
            take[5]


def test_settings_and_calibration_travel_with_a_take(tmp_path: Path) -> None:
    with qf.open() as scanner:
        path = record(tmp_path / "a.h5", [scanner.grab()], config=scanner.config, calibration=scanner.calibration)
        expected = scanner.decode(scanner.grab())
    with qf.open(qf.SystemConfig(capture=ReplayConfig(file=path))) as replayed:
        assert replayed.calibration == scanner.calibration
        assert replayed.config.projector == scanner.config.projector
        shape = replayed.measure()
    np.testing.assert_array_equal(shape.xyz_mm, expected.xyz_mm)


def test_a_take_can_be_read_while_it_grows(tmp_path: Path) -> None:
    first = stamped(numbered_shot(0), 0)
    with RecordingWriter(tmp_path / "a.h5", Header.of(first, None, None)) as writer:
        for number in range(3):
            writer.append(stamped(numbered_shot(number), number))
            with Recording(writer.path) as take:
                assert (len(take), take.closed_in_order) == (number + 1, False)
                assert whole(take[number], number)


def test_nothing_reported_is_lost_when_the_writer_is_killed(tmp_path: Path) -> None:
    for run in range(3):
        path = tmp_path / f"{run}.h5"
        reported = kill_writer(path, after_s=0.1 * run)
        with Recording(path) as take:
            assert len(take) >= reported > 0
            assert not take.closed_in_order
            assert all(whole(shot, number) for number, shot in enumerate(take))
        assert recover(path, tmp_path / f"whole{run}.h5").shots >= reported
        with h5py.File(tmp_path / f"whole{run}.h5") as file:  # as other programs open it
            assert len(file["red"]) >= reported


def test_nothing_reported_is_lost_when_the_disk_refuses(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    reported, reason = run_with_file_limit(path, limit_bytes=3_000_000)
    assert "could not be written" in reason
    assert f"the {reported} shots before it are safe" in reason
    with Recording(path) as take:
        assert len(take) == reported > 5
        assert not take.closed_in_order
        assert all(whole(shot, number) for number, shot in enumerate(take))


def test_recording_goes_on_when_a_full_disk_has_room_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    free = {"bytes": 1 << 40}
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=free["bytes"]))
    monkeypatch.setattr("quadfringe.recording.recorder.RETRY_S", 0.0)
    with Recorder(tmp_path / "a.h5") as recorder:
        recorder.write(numbered_shot(0))
        free["bytes"] = 1 << 10
        for number in (1, 2):
            recorder.write(numbered_shot(number))
        full = recorder.statistics()
        assert (full.written, full.refused) == (1, 2)
        assert "the disk is full" in str(full.fault)
        free["bytes"] = 1 << 40
        recorder.write(numbered_shot(3))
    done = recorder.statistics()
    assert (done.written, done.refused, done.fault) == (2, 2, None)
    assert [path.name for path in done.files] == ["a.h5", "a_001.h5"]
    for path, number in zip(done.files, (0, 3), strict=True):
        with Recording(path) as take:
            assert len(take) == 1
            assert take.closed_in_order
            assert whole(take[0], number)


def test_a_long_take_is_cut_into_files(tmp_path: Path) -> None:
    size_gb = Header.of(numbered_shot(0), None, None).shot_bytes / 1e9
    with Recorder(tmp_path / "a.h5", file_gb=2.5 * size_gb) as recorder:
        for number in range(5):
            recorder.write(numbered_shot(number))
    lengths = [len(Recording(path)) for path in recorder.statistics().files]
    assert lengths == [2, 2, 1]


def test_a_damaged_shot_is_named_and_left_behind(take: Path, tmp_path: Path) -> None:
    with h5py.File(take) as file:
        place = file["blue"].id.get_chunk_info_by_coord((2, 0, 0)).byte_offset
    with take.open("r+b") as raw:
        raw.seek(place + 100)
        raw.write(b"\xff\x00\xff\x00")
    with Recording(take) as damaged:
        assert len(damaged) == 6
        with pytest.raises(InputError, match="shot 2 is damaged"):
            damaged[2]
    found = recover(take, tmp_path / "b.h5")
    assert (found.shots, found.damaged) == (5, (2,))
    with Recording(tmp_path / "b.h5") as take_again:
        assert take_again.ids.tolist() == [0, 1, 3, 4, 5]


def cut(take: Path, share: float) -> Path:
    short = take.with_name("short.h5")
    data = take.read_bytes()
    short.write_bytes(data[: int(share * len(data))])
    return short


def test_a_file_without_its_tables_is_refused(take: Path) -> None:
    with pytest.raises(InputError, match=r"short\.h5: .*cut short"):
        Recording(cut(take, 0.02))


def test_of_a_file_cut_short_the_shots_that_are_there_are_recovered(take: Path, tmp_path: Path) -> None:
    short = cut(take, 0.6)
    with pytest.warns(RecordingWarning, match="cut short by"):
        damaged = Recording(short)
    with damaged, pytest.raises(InputError, match="shot 5 is damaged"):
        damaged[5]
    with pytest.warns(RecordingWarning, match="cut short by"):
        found = recover(short, tmp_path / "b.h5")
    assert 0 < found.shots < 6 == found.shots + len(found.damaged)
    with Recording(tmp_path / "b.h5") as rest:
        assert all(whole(shot, int(number)) for shot, number in zip(rest, rest.ids, strict=True))


def test_foreign_files_are_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "text.h5").write_text("no recording\n")
    with h5py.File(tmp_path / "other.h5", "w", libver="latest") as file:
        file["x"] = 1
    for name, reason in (("text.h5", "expected an HDF5"), ("other.h5", "got another HDF5"), ("no.h5", "no such file")):
        with pytest.raises(InputError, match=rf"{name}: .*{reason}"):
            Recording(tmp_path / name)


def test_nothing_is_overwritten_and_mixed_shots_are_refused(take: Path, tmp_path: Path) -> None:
    for make in (Recorder, lambda path: recover(take, path)):
        with pytest.raises(InputError, match="exists already"):
            make(take)
    with pytest.raises(InputError, match=r"ends in \.h5"):
        Recorder(tmp_path / "a.hdf")
    with Recorder(tmp_path / "b.h5") as recorder:
        recorder.write(numbered_shot(0))
        with pytest.raises(InputError, match="expected red, green, blue, ir of 96 x 64 uint8"):
            recorder.write(mosaic(1))
    usage = shutil.disk_usage(tmp_path)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=0))
        with pytest.raises(RecordingError, match="disk is full"):
            RecordingWriter(tmp_path / "c.h5", Header.of(numbered_shot(0), None, None))
    assert not (tmp_path / "c.h5").exists()


def test_replay_at_full_speed_gives_every_shot_once(take: Path) -> None:
    camera = ReplayCamera(Recording(take), "full")
    assert camera.snap().id == 0
    assert [shot.id for shot in camera.stream(2)] == [1, 2]
    assert [shot.id for shot in camera.stream()] == [3, 4, 5]
    assert list(camera.stream()) == []
    with pytest.raises(ShotTimeoutError, match="all 6 shots were played"):
        camera.snap()
    assert (camera.statistics().shots, camera.statistics().dropped) == (6, 0)
    camera.close()
    camera.close()
    with pytest.raises(ValueError, match="closed"):
        camera.snap()


class Clock:
    """A clock that advances with each wait; it also replaces the event that ends a wait."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s

    def wait(self, seconds: float) -> bool:
        self.now_s += seconds
        return False

    def is_set(self) -> bool:
        return False

    def clear(self) -> None:
        pass


def test_replay_at_original_speed_keeps_the_pace_and_counts_what_is_late(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = record(tmp_path / "a.h5", [stamped(numbered_shot(k), k, period_us=30_000) for k in range(10)])
    clock = Clock()
    monkeypatch.setattr("quadfringe.recording.replay.time", clock)
    for keep, ids, dropped in (("latest", [0, 3, 4, 5, 6, 7, 8, 9], 2), ("all", list(range(10)), 0)):
        camera = ReplayCamera(Recording(path))
        camera._interrupted = clock  # type: ignore[assignment]
        begin_s = clock.now_s
        stream = camera.stream(keep=keep)  # type: ignore[arg-type]
        came = [next(stream).id]
        clock.now_s += 0.1  # three periods in which no shot is taken
        came += [shot.id for shot in stream]
        assert came == ids
        assert clock.now_s - begin_s == pytest.approx(9 * 0.030)
        assert (camera.statistics().shots, camera.statistics().dropped) == (10, dropped)


def test_a_replay_has_one_stream_at_a_time(take: Path) -> None:
    with open_camera(f"replay:{take}") as camera:
        stream = camera.stream()
        next(stream)
        with pytest.raises(ValueError, match="already streams"):
            camera.snap()
        stream.close()  # type: ignore[attr-defined]
        assert camera.snap().id is not None


def test_a_recording_is_described_on_one_screen() -> None:
    path = Path(__file__).parent / "golden" / "take.h5"
    with pytest.warns(RecordingWarning, match="earlier version"):
        short, full = lines_about(path), lines_about(path, full=True)
    assert len(short) < 24
    assert max(map(len, short)) <= 80
    assert short[-1].endswith("info --full")
    assert len(full) > 24
    assert full[1] in short  # the identity, whole
