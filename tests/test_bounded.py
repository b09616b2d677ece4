"""The helper process ends on every fault of the code that it runs, and never outlives its caller."""

from __future__ import annotations

import errno
import multiprocessing
import multiprocessing.spawn
import operator
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from quadfringe.errors import InputError
from quadfringe.files import read_bytes
from quadfringe.io.bounded import BoundedError, Helper, Limits, UnansweredError

CALLER = """
import os, signal, time
from quadfringe.io.bounded import Helper, Limits
signal.signal(signal.SIGINT, signal.default_int_handler)
helper = Helper(Limits(time_s={time_s}, memory_bytes=1 << 28))
print(helper.run(os.getpid), flush=True)
{then}
"""
PATIENCE_S = 60.0


@pytest.fixture
def helper() -> Iterator[Helper]:
    with Helper(Limits(time_s=0.5, memory_bytes=1 << 28)) as started:
        yield started


def ends(process: int) -> bool:
    """Wait until a process has ended."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        try:
            state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
        except (FileNotFoundError, ProcessLookupError):
            return True
        if state == "Z":  # ended; the process that takes over orphans has not asked for its status yet
            return True
        time.sleep(0.02)
    return False


def test_results_come_from_another_process_that_goes_on(helper: Helper) -> None:
    process = helper.run(os.getpid)
    assert process != os.getpid()
    assert helper.run(int, "21", base=3) == 7
    np.testing.assert_array_equal(helper.run(np.arange, 1 << 20), np.arange(1 << 20))
    assert helper.run(os.getpid) == process
    helper.close()
    helper.close()
    assert ends(process)
    assert helper.run(os.getpid) != process


def test_errors_of_the_function_are_those_of_a_call(helper: Helper, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="invalid literal"):
        helper.run(int, "a word")
    with pytest.raises(InputError, match=r"no\.json"):
        helper.run(read_bytes, tmp_path / "no.json")
    with pytest.raises(TypeError, match=r"cannot pickle .*memoryview"):
        helper.run(memoryview, b"a")


@pytest.mark.parametrize(
    ("function", "argument", "reason"),
    [
        (time.sleep, 3600, r"does not end within 0\.5 s"),
        (sum, range(1 << 60), r"does not end within 0\.5 s"),
        (bytearray, 1 << 30, "needs more than 268 MB of memory"),
        (signal.raise_signal, signal.SIGSEGV, r"crashes \(SIGSEGV\)"),
        (os._exit, 3, r"crashes \(exit status 3\)"),
        (signal.raise_signal, signal.SIGKILL, r"was stopped from outside \(SIGKILL\)"),
    ],
    ids=["sleeps", "computes", "memory", "crash", "exit", "killed"],
)
def test_a_call_without_end_or_measure_is_an_error(
    helper: Helper, function: object, argument: object, reason: str
) -> None:
    with pytest.raises(BoundedError, match=reason):
        helper.run(operator.call, function, argument)  # type: ignore[arg-type]
    assert helper.run(int, "7") == 7


def test_what_need_not_be_the_fault_of_the_function_is_told_apart(helper: Helper) -> None:
    for function, argument in ((time.sleep, 3600), (signal.raise_signal, signal.SIGTERM)):
        with pytest.raises(UnansweredError):
            helper.run(operator.call, function, argument)  # type: ignore[arg-type]
    with pytest.raises(BoundedError) as crash:
        helper.run(os.abort)
    assert not isinstance(crash.value, UnansweredError)


@pytest.mark.parametrize(
    ("python", "reason"),
    [
        ("/bin/true", r"ended when it started \(exit status 0\); name the Python interpreter"),
        ("/no/python", r"cannot be started: .*No such file"),
        ("", "this program is no Python; name the Python interpreter with multiprocessing.set_executable"),
    ],
)
def test_a_helper_that_cannot_start_says_why(
    python: str, reason: str, helper: Helper, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a program that embeds Python, sys.executable is that program."""
    before = multiprocessing.spawn.get_executable()
    multiprocessing.set_executable(python)
    try:
        with pytest.raises(UnansweredError, match=reason):
            helper.run(int, "7")
    finally:
        multiprocessing.set_executable(before)
    monkeypatch.setattr("quadfringe.io.bounded.Pipe", _without_descriptors)
    with pytest.raises(UnansweredError, match=r"cannot be started: .*Too many open files"):
        helper.run(int, "7")


def _without_descriptors() -> None:
    raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))


def test_memory_is_limited_over_all_calls(helper: Helper) -> None:
    hold = "import builtins; builtins.held = [*getattr(builtins, 'held', []), bytearray(80 << 20)]"
    helper.run(exec, hold)
    helper.run(exec, hold)
    helper.run(exec, hold)
    with pytest.raises(BoundedError, match="needs more than"):
        helper.run(exec, hold)


@pytest.mark.parametrize("then", ["time.sleep(3600)", "helper.run(time.sleep, 3600)"], ids=["idle", "busy"])
def test_nothing_is_left_when_the_caller_is_killed(then: str) -> None:
    command = [sys.executable, "-c", CALLER.format(time_s=1.0, then=then)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as caller:
        assert caller.stdout is not None
        process = int(caller.stdout.readline())
        time.sleep(0.2)
        caller.kill()
    assert ends(process)


def test_ctrl_c_ends_a_call() -> None:
    command = [sys.executable, "-c", CALLER.format(time_s=3600.0, then="helper.run(time.sleep, 3600)")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as caller:
        assert caller.stdout is not None
        process = int(caller.stdout.readline())
        time.sleep(0.2)
        caller.send_signal(signal.SIGINT)
        assert "KeyboardInterrupt" in caller.communicate(timeout=PATIENCE_S)[1]
    assert ends(process)


def test_nothing_is_left_when_a_caller_ends_without_closing() -> None:
    command = [sys.executable, "-W", "error", "-c", CALLER.format(time_s=60.0, then="")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert ends(int(done.stdout))


def test_a_module_of_the_working_folder_is_not_imported(
    helper: Helper, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "colorsys.py").write_text("raise RuntimeError('foreign code')\n")
    monkeypatch.chdir(tmp_path)
    assert helper.run(exec, "import colorsys; colorsys.rgb_to_hsv") is None


def test_a_forked_copy_gets_its_own_process() -> None:
    copy = "if os.fork() == 0: print(helper.run(os.getpid), flush=True); os._exit(0)"
    then = f"{copy}\nos.wait(); print(helper.run(os.getpid))"
    command = [sys.executable, "-c", CALLER.format(time_s=60.0, then=then)]
    first, of_the_copy, again = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert first == again != of_the_copy
