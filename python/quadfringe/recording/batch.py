"""Decode many recordings on many cores or machines, each shot once, to zarr and PLY.

The work runs on any executor of `concurrent.futures`; `executor_for` makes one for this machine or a dask cluster.
Each shot is one task, which writes its status last; a run that was killed can therefore be continued, and ends with the
same files. The results belong to one recording, by its SHA-256, and a finished shot is taken as finished only when its
files match their checksum. A damaged shot has no shape; if its stamp is damaged, its id and time_us are 0. A shot that
cannot be read now, damaged or not, is reported, and the same command tries it again. It writes::

    OUT/take.zarr        the maps of `Shape` by their names, but for column_px and order, which follow from phase_rad
                         (shot, row, column); id, time_us, status, checksum (shot); settings, SHA-256 of the recording
    OUT/take/shot_000000.ply ...
    OUT/take/errors.json     reason for each shot without a shape; only when there are such shots

>>> from concurrent.futures import ThreadPoolExecutor
>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> import quadfringe as qf
>>> from quadfringe.recording import Recorder, batch
>>> camera = qf.Device(width_px=256, height_px=192, focal_px=(645, 645), centre_px=(127.5, 95.5))
>>> with TemporaryDirectory() as name, qf.open(qf.SystemConfig(camera=camera)) as scanner:
...     take = Path(name) / "take.h5"
...     with Recorder(take, scanner.config, scanner.calibration) as recorder:
...         recorder.write(scanner.grab())
...     jobs: list[batch.Job] = batch.prepare([take], Path(name) / "results", ply=False)
...     with ThreadPoolExecutor(1) as executor:  # or `executor_for(scheduler="tcp://lab:8786")`
...         (outcome,) = batch.run(jobs, executor)
>>> isinstance(outcome, batch.Outcome), outcome.error
(True, None)

All at once, on every core or on the workers of a dask cluster:

>>> for outcome in batch.decode_recordings([Path("take.h5")], Path("results")):  # doctest: +SKIP
...     print(outcome.shot, outcome.returned_percent, outcome.error)
>>> with batch.executor_for(workers=2) as executor:  # doctest: +SKIP
...     outcomes = list(batch.run(jobs, executor))
"""

from __future__ import annotations

import json
import multiprocessing
import os
import pickle
import time
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from multiprocessing.process import BaseProcess
from pathlib import Path
from threading import Lock, Thread
from typing import Any

import numpy as np

from quadfringe.config import SystemConfig
from quadfringe.config.cameras import ReplayConfig
from quadfringe.errors import BatchError, DecodeError, InputError, RecordingError, RecordingWarning, require
from quadfringe.files import atomic, folder_for
from quadfringe.recording import Recording
from quadfringe.recording._cores import usable_cores
from quadfringe.recording._results import REFUSED, Job, locked, open_results, save
from quadfringe.scanner import Scanner, open_system

__all__ = ["Job", "Outcome", "decode_recordings", "executor_for", "prepare", "run"]

# Most processes, the larger of the two: each takes some 200 MB, and more than the cores only wait for one another.
WORKERS_MOST, WORKERS_PER_CORE = 64, 4
END_S = 3.0  # in which idle workers end by themselves; they take a tenth of a second
RESTARTS = 3  # new pools after a worker process died: a shot that kills each of them is not retried for ever


@dataclass(frozen=True)
class Outcome:
    """The result of a shot: the percentage of returned pixels, or the reason why it has no shape."""

    recording: Path
    shot: int
    returned_percent: float | None
    error: str | None


def prepare(
    recordings: Sequence[Path], out: Path, system: SystemConfig | None = None, *, ply: bool = True
) -> list[Job]:
    """Examine every recording, and create its empty results or find those of an earlier run; decode nothing.

    Settings of `system` replace the recorded ones. Raises `InputError` for unreadable recordings, for two recordings of
    one name, for results of other settings in `out`, and for PLY files without a calibration. It does not lock `out`:
    one run at a time is for the caller to ensure, or for `decode_recordings`.
    """
    require("zarr", "batch")
    if ply:
        require("trimesh", "batch")
    stems = [recording.stem for recording in recordings]
    if twice := sorted({stem for stem in stems if stems.count(stem) > 1}):
        raise InputError(f"two recordings are named {', '.join(twice)}; use a separate --out for each")
    folder_for(out)
    return [_prepared(recording, out, system or SystemConfig(), ply) for recording in recordings]


def _prepared(recording: Path, out: Path, system: SystemConfig, ply: bool) -> Job:
    config = system.model_copy(update={"capture": ReplayConfig(file=recording.resolve(), speed="full")})
    with Recording(recording) as take, _opened(config) as scanner:
        if ply and scanner.calibration is None:
            raise InputError(
                f"{recording}: recorded without a calibration, so it has no points; name a calibration in --system, or "
                "use --no-ply"
            )
        # Estimated once here: otherwise each process would estimate it from the shots that it happens to get.
        sound = (shot for index in range(len(take)) if (shot := take.read(index)) is not None)
        scanner.change_decode(response=scanner.settle_response(sound))
        config = config.model_copy(update={"decode": scanner.config.decode})
        job = Job(recording.resolve(), out.resolve(), config, ply, len(take), ())
        finished = open_results(job, take, _settings(scanner), calibrated=scanner.calibration is not None)
    folder_for(job.folder)
    return replace(job, pending=tuple(np.flatnonzero(~finished).tolist()))


def _opened(config: SystemConfig) -> Scanner:
    """Open a recording as a system with one thread, because each core has one process."""
    scanner = open_system(config)
    scanner.change_decode(threads=1)
    return scanner


def _settings(scanner: Scanner) -> dict[str, Any]:
    """Return the settings that determine the results, as plain data."""
    config = scanner.config.model_dump(mode="json", exclude_none=True, exclude={"capture", "calibration"})
    calibration = scanner.calibration
    known = None if calibration is None else calibration.model_dump(mode="json", exclude_none=True)
    settings: dict[str, Any] = json.loads(json.dumps({"config": config, "calibration": known}))
    return settings


def decode_recordings(
    recordings: Sequence[Path],
    out: Path,
    system: SystemConfig | None = None,
    *,
    ply: bool = True,
    workers: int | None = None,
    scheduler: str | None = None,
) -> Iterator[Outcome]:
    """Decode all shots that are not decoded yet; yield outcomes as they finish, some twice after a process died.

    Raises `InputError` as `prepare` and `executor_for` and while another run writes into `out`, and `BatchError` when
    worker processes die repeatedly.
    """
    with locked(out):
        for _ in range(RESTARTS):
            jobs = prepare(recordings, out, system, ply=ply)
            try:
                with executor_for(workers, scheduler) as executor:
                    yield from run(jobs, executor)
                return
            except BrokenProcessPool:
                continue  # finished shots stay finished
    raise BatchError(f"worker processes died {RESTARTS} times; lower --workers, which all need memory")


def run(jobs: Sequence[Job], executor: Executor) -> Iterator[Outcome]:
    """Decode every pending shot with an executor; write errors.json at the end."""
    errors: dict[Path, dict[int, str]] = {job.folder: {} for job in jobs}
    futures: list[Future[Outcome]] = [executor.submit(decode_shot, job, shot) for job in jobs for shot in job.pending]
    folders = {job.recording: job.folder for job in jobs}
    try:
        for future in as_completed(futures):
            outcome = future.result()
            if outcome.error is not None:
                errors[folders[outcome.recording]][outcome.shot] = outcome.error
            yield outcome
    finally:
        for future in futures:
            future.cancel()
    for folder, found in errors.items():
        _write_errors(folder / "errors.json", found)


def _write_errors(path: Path, errors: dict[int, str]) -> None:
    path.unlink(missing_ok=True)
    if errors:
        with atomic(path) as temporary:
            temporary.write_text(json.dumps({str(shot): errors[shot] for shot in sorted(errors)}, indent=2) + "\n")


_ONE_AT_A_TIME = Lock()  # a cluster worker may run threads, but a decoder serves one at a time


def decode_shot(job: Job, shot: int) -> Outcome:
    """Decode one shot of a recording and write its results, the status last."""
    import zarr

    with _ONE_AT_A_TIME:
        take, scanner = _reader(job)
        group = zarr.open_group(job.store, mode="r+")
        try:
            shape = scanner.decode(take[shot])
        except RecordingError as error:  # not the fault of the shot, which stays pending
            _planned.cache_clear()
            return Outcome(job.recording, shot, None, str(error))
        except (DecodeError, InputError) as error:
            group["status"][shot] = REFUSED
            return Outcome(job.recording, shot, None, str(error))
        save(job, shot, shape, group)
        return Outcome(job.recording, shot, 100.0 * float(shape.returned.mean()), None)


def _reader(job: Job) -> tuple[Recording, Scanner]:
    """Return the recording and its decoder, which each process plans once."""
    return _planned(job.recording, pickle.dumps(job.config))


@lru_cache(maxsize=2)
def _planned(recording: Path, config: bytes) -> tuple[Recording, Scanner]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordingWarning)  # `prepare` gave the same warnings
        return Recording(recording), _opened(pickle.loads(config))


@contextmanager
def executor_for(workers: int | None = None, scheduler: str | None = None) -> Iterator[Executor]:
    """Yield a process pool of this machine, by default one process per core, or the workers of a dask scheduler.

    Cluster workers need quadfringe, and the recordings and results under the same paths. Raises `InputError` when no
    scheduler answers at the address, and for more processes than this machine can serve.
    """
    if scheduler is None:
        # Spawned, because a process with threads (kernel, HDF5) must not be forked.
        _check_workers(workers)
        spawned = multiprocessing.get_context("spawn")
        others = multiprocessing.active_children()
        pool = ProcessPoolExecutor(workers or usable_cores(), spawned, initializer=_end_with_parent)
        patience_s = 0.0
        try:
            yield pool
            patience_s = END_S
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
            started = [worker for worker in multiprocessing.active_children() if worker not in others]
            _end(started, patience_s)
        return
    distributed = require("distributed", "batch")
    try:
        client = distributed.Client(scheduler, timeout="10s")
    except (OSError, ValueError) as error:
        raise InputError(f"{scheduler}: no dask scheduler answers: {error}; check the address") from error
    with client, client.get_executor(retries=RESTARTS, pure=False) as cluster:
        yield cluster


def _check_workers(workers: int | None) -> None:
    """Raise `InputError` for a number of processes that the machine cannot serve."""
    most = max(WORKERS_MOST, WORKERS_PER_CORE * usable_cores())
    if workers is not None and not 1 <= workers <= most:
        raise InputError(f"workers: expected 1 to {most} processes on this machine, got {workers}")


def _end(workers: Sequence[BaseProcess], patience_s: float) -> None:
    """Wait for idle workers to end, which then leave nothing behind, and kill those that do not.

    One that was killed while it held the lock of the queue would keep the others waiting for ever.
    """
    end_s = time.monotonic() + patience_s
    for worker in workers:
        worker.join(max(0.0, end_s - time.monotonic()))
        if worker.is_alive():
            worker.kill()


def _end_with_parent() -> None:
    """End this worker when its parent ends: a worker waits for work without end, also from a parent that was killed."""

    def wait() -> None:
        if parent := multiprocessing.parent_process():
            parent.join()
            os._exit(1)

    Thread(target=wait, name="end-with-parent", daemon=True).start()
