"""Batch decoding on several processes gives the same files, also after interruptions."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import zarr
from support.bars import tolerance

import quadfringe as qf
from quadfringe.data import AnyShot, Shot, Stamp
from quadfringe.errors import InputError, RecordingError, RecordingWarning
from quadfringe.recording import Recorder, Recording
from quadfringe.recording._results import locked, maps_of
from quadfringe.recording.batch import decode_recordings, executor_for, prepare, run
from quadfringe.recording.series import Series

CAMERA = qf.Device(width_px=256, height_px=192, focal_px=(645.0, 645.0), centre_px=(127.5, 95.5))
SYSTEM = qf.SystemConfig(
    camera=CAMERA, scene=qf.SceneConfig(surface="steps", noise=0.01), decode=qf.DecodeConfig(method="published")
)
SHOTS, BLACK = 6, 3


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Shots with different noise, one of them without infrared light."""
    path = tmp_path_factory.mktemp("takes") / "take.h5"
    with qf.open(SYSTEM) as scanner, Recorder(path, scanner.config, scanner.calibration) as recorder:
        shot = scanner.grab()
        noise = np.random.default_rng(5)
        for number in range(SHOTS):
            images = {n: (i // 2 + noise.integers(0, 3, i.shape)).astype(np.uint8) for n, i in shot.images.items()}
            if number == BLACK:
                images["ir"] = np.zeros_like(images["ir"])
            recorder.write(Shot(**images, stamp=Stamp(number + 1, 1000 * number, "bench")))
    return path


@pytest.fixture(scope="module")
def whole(take: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of an uninterrupted run on one process."""
    out = tmp_path_factory.mktemp("whole")
    outcomes = {o.shot: o for o in decode_recordings([take], out, workers=1)}
    assert sorted(outcomes) == list(range(SHOTS))
    assert [shot for shot, o in outcomes.items() if o.error] == [BLACK]
    return out


def test_the_joint_method_stores_the_albedo() -> None:
    assert "albedo" in maps_of(qf.SystemConfig(), calibrated=True)
    for decode in ({"albedo": False}, {"method": "published"}):
        assert "albedo" not in maps_of(qf.SystemConfig.model_validate({"decode": decode}), calibrated=True)


def digests(folder: Path) -> dict[str, str]:
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def test_results_are_those_of_decoding_by_hand(take: Path, whole: Path) -> None:
    group = zarr.open_group(whole / "take.zarr", mode="r")
    assert group["status"][:].tolist() == [2 if shot == BLACK else 1 for shot in range(SHOTS)]
    assert group["id"][:].tolist() == [1, 2, 3, 4, 5, 6]
    assert np.isnan(group["xyz_mm"][BLACK]).all()
    with Recording(take) as recorded, qf.open(SYSTEM) as scanner:
        shape = scanner.decode(recorded[1])
    stored = set(shape.maps) - {"column_px", "order"}
    assert stored | {"id", "time_us", "status", "checksum"} == set(group)
    for name in stored:
        np.testing.assert_array_equal(group[name][1], shape.maps[name], name)
    settings = group.attrs["settings"]
    assert settings["config"]["decode"]["method"] == "published"
    assert settings["calibration"]["camera"]["width_px"] == CAMERA.width_px
    plys = sorted(path.name for path in (whole / "take").glob("*.ply"))
    assert plys == [f"shot_{shot:06d}.ply" for shot in range(SHOTS) if shot != BLACK]
    errors = json.loads((whole / "take" / "errors.json").read_text())
    assert list(errors) == [str(BLACK)]
    assert "channel ir is black" in errors[str(BLACK)]


def test_finished_shots_are_not_done_again(take: Path, whole: Path) -> None:
    before = digests(whole)
    again = list(decode_recordings([take], whole, workers=1))
    assert [outcome.shot for outcome in again] == [BLACK]
    assert digests(whole) == before


def test_a_killed_run_goes_on_and_ends_with_the_same_files(take: Path, whole: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "quadfringe", "batch", str(take), "--out", str(tmp_path), "--workers", "1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True) as killed:
        end = time.monotonic() + 120
        while not list((tmp_path / "take").glob("shot_*.ply")) and time.monotonic() < end:
            time.sleep(0.02)
        import os
        import signal

        os.killpg(killed.pid, signal.SIGKILL)
    assert 0 < len(list((tmp_path / "take").glob("shot_*.ply"))) < SHOTS - 1
    (tmp_path / "take" / ".shot_000000-left.ply").write_text("torn")
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1, done.stderr
    assert "1 of 6 shots have no shape" in done.stderr
    assert digests(tmp_path) == digests(whole)


def test_a_run_removes_nothing_but_what_runs_of_its_recording_left(take: Path, tmp_path: Path) -> None:
    """A name of a recording may hold what a pattern of names is made of."""
    others = [tmp_path / name for name in (".git-mine", ".take-notes", ".b-12345678.partial")]
    left = [tmp_path / ".*-12345678.partial", tmp_path / ".take-12345678.partial"]
    for folder in (*others, *left):
        folder.mkdir()
    for name in ("*.h5", "take.h5"):
        shutil.copy(take, tmp_path / name)
        prepare([tmp_path / name], tmp_path, ply=False)
    assert [folder.exists() for folder in (*others, *left)] == [True, True, True, False, False]


def test_the_command_prints_its_result_and_nothing_else(take: Path, tmp_path: Path) -> None:
    """Workers that were killed at the end left semaphores, of which Python warned."""
    words = ["batch", str(take), "--out", str(tmp_path / "out"), "--no-ply", "--workers", "2"]
    code = f"from quadfringe.cli import app; app({words})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (1, 1), done.stderr
    assert done.stderr.startswith(f"error: 1 of {SHOTS} shots have no shape")
    assert f"{SHOTS - 1} shots decoded" in done.stdout


@pytest.mark.parametrize("workers", [-1, 0, 100_000, 10**30])
def test_a_number_of_workers_that_no_machine_serves_is_refused(workers: int) -> None:
    with pytest.raises(InputError, match=rf"workers: expected 1 to \d+ processes on this machine, got {workers}"):
        executor_for(workers).__enter__()


def another_take(take: Path, path: Path) -> Path:
    """Record the same shots a second later."""
    path.parent.mkdir()
    with Recording(take) as recorded, Recorder(path, recorded.config, recorded.calibration) as recorder:
        for shot in recorded:
            assert shot.stamp is not None
            recorder.write(replace(shot, stamp=replace(shot.stamp, time_us=shot.stamp.time_us + 1_000_000)))
    return path


def test_another_recording_of_the_same_name_does_not_continue_the_results(
    take: Path, whole: Path, tmp_path: Path
) -> None:
    other = another_take(take, tmp_path / "later" / "take.h5")
    with pytest.raises(InputError, match="from another recording"):
        list(decode_recordings([other], whole, workers=1))


def test_changed_results_are_made_again(take: Path, whole: Path, tmp_path: Path) -> None:
    out = Path(shutil.copytree(whole, tmp_path / "out"))
    (out / "take" / "shot_000001.ply").write_bytes(b"ply")
    chunk = out / "take.zarr" / "phase_rad" / "c" / "2" / "0" / "0"
    data = bytearray(chunk.read_bytes())
    data[len(data) // 2] ^= 1
    chunk.write_bytes(data)
    shutil.rmtree(out / "take.zarr" / "xyz_mm" / "c" / "4")
    with pytest.warns(RecordingWarning, match="results of 3 shots were changed and are made again: 1, 2, 4"):
        again = list(decode_recordings([take], out, workers=1))
    assert sorted(outcome.shot for outcome in again) == [1, 2, BLACK, 4]
    assert digests(out) == digests(whole)


@pytest.mark.parametrize("changed", ["id/c/0", "phase_rad/zarr.json"])
def test_results_whose_description_was_changed_are_refused(
    take: Path, whole: Path, tmp_path: Path, changed: str
) -> None:
    out = Path(shutil.copytree(whole, tmp_path / "out"))
    file = out / "take.zarr" / changed
    file.write_bytes(file.read_bytes() + b" ")
    with pytest.raises(InputError, match="changed since it was made"):
        prepare([take], out)


def test_two_runs_into_one_folder_are_refused(take: Path, tmp_path: Path) -> None:
    with locked(tmp_path), pytest.raises(InputError, match="another batch writes into this folder"):
        list(decode_recordings([take], tmp_path, workers=1))
    with locked(tmp_path):
        assert not (tmp_path / "take.zarr").exists()


def test_a_damaged_shot_is_named_and_the_others_are_decoded(take: Path, whole: Path, tmp_path: Path) -> None:
    """The first shot, which a response would be estimated from."""
    torn = tmp_path / "take.h5"
    torn.write_bytes(take.read_bytes())
    with h5py.File(torn) as file:
        place = file["blue"].id.get_chunk_info_by_coord((0, 0, 0)).byte_offset
    with torn.open("r+b") as raw:
        raw.seek(place + 100)
        raw.write(b"\xff\x00\xff\x00")
    outcomes = {outcome.shot: outcome.error for outcome in decode_recordings([torn], tmp_path / "out", workers=1)}
    assert "shot 0 is damaged" in str(outcomes[0])
    assert sorted(shot for shot, error in outcomes.items() if error) == [0, BLACK]
    made = zarr.open_group(tmp_path / "out" / "take.zarr", mode="r")
    expected = zarr.open_group(whole / "take.zarr", mode="r")
    np.testing.assert_array_equal(made["phase_rad"][1], expected["phase_rad"][1])
    assert made["status"][0] == 2


def test_a_dask_scheduler_gives_the_same_files(take: Path, whole: Path, tmp_path: Path) -> None:
    import distributed

    cluster = distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None, protocol="tcp://", host="127.0.0.1"
    )
    with cluster:
        list(decode_recordings([take], tmp_path, scheduler=cluster.scheduler_address))
    assert digests(tmp_path) == digests(whole)


def test_what_cannot_be_done_is_said_before_anything_is_written(take: Path, whole: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="two recordings are named take"):
        prepare([take, take], tmp_path)
    with pytest.raises(InputError, match="no such file"):
        prepare([tmp_path / "no.h5"], tmp_path / "out")
    other = SYSTEM.model_copy(update={"decode": qf.DecodeConfig(method="joint")})
    with pytest.raises(InputError, match="made with other settings"):
        prepare([take], whole, other)
    (tmp_path / "take.zarr").mkdir()
    with pytest.raises(InputError, match="expected the result of a batch"):
        prepare([take], tmp_path)
    with pytest.raises(InputError, match="no dask scheduler answers"), executor_for(scheduler="tcp://127.0.0.1:9"):
        pass


def test_without_a_calibration_there_is_phase_but_no_ply(take: Path, tmp_path: Path) -> None:
    path = tmp_path / "bare.h5"
    with Recording(take) as recorded, Recorder(path) as recorder:
        recorder.write(replace(recorded[0], stamp=None))
    with pytest.raises(InputError, match="without a calibration"):
        prepare([path], tmp_path / "out")
    jobs = prepare([path], tmp_path / "out", ply=False)
    with executor_for(1) as executor:
        assert [outcome.error for outcome in run(jobs, executor)] == [None]
    group = zarr.open_group(jobs[0].store, mode="r")
    assert "xyz_mm" not in group
    assert (group["reason"][0] == 0).mean() == np.isfinite(group["uncertainty_rad"][0]).mean()
    assert Series.open(jobs[0].store).shape(0).reasons().keys() >= {qf.Reason.RETURNED}
    assert np.isfinite(group["phase_rad"][0]).mean() > 0.3


def test_a_response_that_nobody_states_is_the_same_in_every_process(take: Path, tmp_path: Path) -> None:
    """Each shot has another gamma, so that a response found in another shot would give other files."""
    bent = tmp_path / "bent.h5"
    silent = {"response": None, "crosstalk": None, "projector_response": None}
    with Recording(take) as recorded:
        assert recorded.calibration is not None
        calibration = recorded.calibration.model_copy(update=silent)
        with Recorder(bent, recorded.config, calibration) as recorder:
            for number, gamma in enumerate((1.6, 1.8, 2.0)):
                shot = recorded[number]
                images = {n: np.rint(255 * (i / 255.0) ** gamma).astype(np.uint8) for n, i in shot.images.items()}
                recorder.write(Shot(**images, stamp=shot.stamp))
    for workers in (1, 2):
        list(decode_recordings([bent], tmp_path / str(workers), workers=workers))
    assert digests(tmp_path / "1") == digests(tmp_path / "2")
    response = zarr.open_group(tmp_path / "1" / "bent.zarr", mode="r").attrs["settings"]["config"]["decode"]["response"]
    assert response["red"]["exponent"] == pytest.approx(1 / 1.6, rel=tolerance("response.exponent_error_part"))


def test_a_shot_that_cannot_be_read_now_is_tried_again_by_the_next_run(
    take: Path, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs, getitem = prepare([take], tmp_path), Recording.__getitem__

    def busy(recording: Recording, index: int) -> AnyShot:
        if index == 1:
            raise RecordingError("take.h5: shot 1 cannot be read: reading it does not end within 1.5 s")
        return getitem(recording, index)

    with monkeypatch.context() as patched, ThreadPoolExecutor(1) as pool:
        patched.setattr(Recording, "__getitem__", busy)
        assert {o.shot for o in run(jobs, pool) if o.error} == {1, BLACK}
    assert prepare([take], tmp_path)[0].pending == (1, BLACK)
    with ThreadPoolExecutor(1) as pool:
        assert {o.shot for o in run(prepare([take], tmp_path), pool) if o.error} == {BLACK}
    assert digests(tmp_path / "take.zarr") == digests(whole / "take.zarr")
