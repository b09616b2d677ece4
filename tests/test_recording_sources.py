"""A recording is read from the file that was opened, whatever happens to its path or to the helper that reads it."""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator
from multiprocessing.context import BaseContext
from pathlib import Path
from threading import Thread, Timer
from typing import Any

import pytest
from support.takes import SHOTS, changed, recorded

from quadfringe.errors import InputError, RecordingError
from quadfringe.evaluation._takes import whole
from quadfringe.io.bounded import Helper, Limits, UnansweredError
from quadfringe.recording import Recording, recover
from quadfringe.recording._params import READ_S
from quadfringe.recording._source import Source, other_reader, sealed_reader
from quadfringe.recording._stored import Place

METHODS = ("spawn", "fork", "forkserver")


@pytest.fixture
def take(tmp_path: Path) -> Path:
    return recorded(tmp_path / "take.h5")


@pytest.fixture
def other(tmp_path: Path) -> Path:
    return recorded(tmp_path / "other.h5", first=100, shots=3)


def helper_pid() -> int:
    return sealed_reader.helper.run(os.getpid)


# Which file


def shots_in_child(received: Recording, other: Path, answers: Any) -> None:
    received.read(0)
    with Recording(other) as opened_here:
        mine = [whole(shot, 100 + number) for number, shot in enumerate(opened_here)]
        answers.put((mine, [whole(shot, number) for number, shot in enumerate(received)]))


@pytest.mark.parametrize("method", METHODS)
def test_a_recording_sent_to_another_process_stays_apart_from_those_opened_there(
    method: str, take: Path, other: Path
) -> None:
    context: BaseContext = multiprocessing.get_context(method)
    answers = context.Queue()
    with Recording(take) as recording:
        child = context.Process(target=shots_in_child, args=(recording, other, answers))  # type: ignore[attr-defined]
        child.start()
        assert answers.get(timeout=60) == ([True] * 3, [True] * SHOTS)
        child.join()


def test_a_file_that_was_replaced_is_no_damaged_file(take: Path, other: Path) -> None:
    recording = Recording(take)
    other.replace(take)
    assert whole(recording[1], 1)  # HDF5 has the file open
    sealed_reader.helper.close()
    with pytest.raises(RecordingError, match=r"shot 2 cannot be read: it was removed, or replaced by another file"):
        recording.read(2)
    take.unlink()
    with pytest.raises(RecordingError, match=r"shot 2 cannot be read: it was removed, or replaced by another file"):
        recording.read(2)
    recording.close()


def test_a_file_that_was_shortened_is_no_damaged_file(take: Path) -> None:
    with Recording(take) as recording:
        os.truncate(take, 3000)
        with pytest.raises(RecordingError, match="shot 5 cannot be read: it was shortened since it was opened"):
            recording.read(5)


def test_a_closed_recording_stays_closed(take: Path) -> None:
    recording = Recording(take)
    recording.close()
    with pytest.raises(ValueError, match=r"take\.h5: is closed"):
        recording.read(0)
    assert len(recording.ids) == SHOTS


def test_a_recording_that_nobody_closed_is_let_go(take: Path, other: Path) -> None:
    recording = Recording(take)
    del recording
    gc.collect()
    changed(take, lambda file: file.attrs.__setitem__("more", 1))  # not locked
    with Recording(other) as another:
        assert whole(another[0], 100)
    assert take not in [link.readlink() for link in Path(f"/proc/{helper_pid()}/fd").iterdir()]


# Whose fault


def kill_helper() -> None:
    process = helper_pid()
    os.kill(process, signal.SIGKILL)
    while Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z":
        time.sleep(0.01)


def test_a_killed_helper_costs_no_shot(take: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ask, asked = Source._ask, 0

    def killing(source: Source, method: str, *arguments: Any) -> Any:
        nonlocal asked
        asked += 1
        if asked % 3 == 0:
            kill_helper()
        return ask(source, method, *arguments)

    monkeypatch.setattr(Source, "_ask", killing)
    done = recover(take, tmp_path / "whole.h5")
    assert (done.shots, done.damaged) == (SHOTS, ())


def test_a_read_that_is_late_once_costs_no_shot(take: Path) -> None:
    with Recording(take) as recording:
        process = helper_pid()
        os.kill(process, signal.SIGSTOP)
        Timer(READ_S + 0.5, os.kill, (process, signal.SIGCONT)).start()
        assert whole(recording[1], 1)


@pytest.fixture
def in_place_of_third_shot(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., None]]:
    """Let the helper call something else when it is asked for the third shot or one after it."""
    ask = sealed_reader.ask
    with Helper(Limits(0.2, 1 << 28)) as helper:

        def set_to(function: Callable[..., object], *given: object) -> None:
            def other(place: Place, method: str, *arguments: Any) -> Any:
                later = method == "extents" and arguments[1] >= 2
                return helper.run(function, *given) if later else ask(place, method, *arguments)

            monkeypatch.setattr(sealed_reader, "ask", other)

        yield set_to


def test_a_shot_without_an_answer_is_not_recovered_as_damaged(
    take: Path, tmp_path: Path, in_place_of_third_shot: Callable[..., None]
) -> None:
    in_place_of_third_shot(time.sleep, 3600)
    with pytest.raises(RecordingError, match=r"take\.h5: shot 2 cannot be read: reading it does not end within 0\.2 s"):
        recover(take, tmp_path / "whole.h5")
    assert not (tmp_path / "whole.h5").exists()


def test_a_shot_that_crashes_hdf5_is_damaged_and_named(
    take: Path, tmp_path: Path, in_place_of_third_shot: Callable[..., None]
) -> None:
    in_place_of_third_shot(os.abort)
    with (
        Recording(take) as recording,
        pytest.raises(InputError, match=r"shot 2 is damaged \(reading it crashes \(SIGABRT"),
    ):
        recording[2]
    done = recover(take, tmp_path / "whole.h5")
    assert (done.shots, done.damaged) == (2, (2, 3, 4, 5))


def test_a_damaged_file_keeps_no_sound_one_waiting(take: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with Recording(take) as recording, Helper(Limits(60.0, 1 << 28)) as busy:
        monkeypatch.setattr(other_reader, "helper", busy)
        process = busy.run(os.getpid)
        waiting = Thread(target=pytest.raises, args=(UnansweredError, busy.run, time.sleep, 3600))
        waiting.start()
        assert whole(recording[0], 0)
        assert waiting.is_alive()
        os.kill(process, signal.SIGKILL)
        waiting.join()
