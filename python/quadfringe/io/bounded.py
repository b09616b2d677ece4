"""Run functions that read doubtful files in a helper process, with a limit of time for each call and of memory.

A damaged or hostile file can make a library in C loop without end, take all memory, or crash. In a helper process this
ends the helper, and the caller gets an error. Windows has no such limits: there the function runs in the process.

An error of the function and a crash by itself say something of the file. That a call takes too long, that somebody
kills the helper, and that it cannot start, may have other causes: `UnansweredError`.

>>> with Helper(Limits(time_s=3.0, memory_bytes=1 << 28)) as helper:
...     helper.run(int, "12")
12
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import weakref
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from multiprocessing.spawn import get_executable
from pathlib import Path
from typing import Any, NamedTuple, ParamSpec, Self, TypeVar

from quadfringe.io.locks import ForkedLock

__all__ = ["BoundedError", "Helper", "Limits", "UnansweredError"]

START_S = 30.0  # for starting Python and importing the function, in addition to the limit: a busy machine is slow
READY = b"ready"
CRASHES = [getattr(signal, name, None) for name in ("SIGSEGV", "SIGABRT", "SIGBUS", "SIGFPE", "SIGILL", "SIGSYS")]
EXECUTABLE = "name the Python interpreter with multiprocessing.set_executable"
SERVE = "import sys; from quadfringe.io.bounded import serve; serve(*map(int, sys.argv[1:4]))"

P = ParamSpec("P")
R = TypeVar("R")


class BoundedError(RuntimeError):
    """The helper process exceeded a limit or crashed; the message says which, without the name of the file."""


class UnansweredError(BoundedError):
    """No answer, for a reason that need not be the function: too late, killed by another process, or not started."""


@dataclass(frozen=True)
class Limits:
    """Limits of a helper process: wall-clock time of each call, s; memory beyond that of the started process, bytes."""

    time_s: float
    memory_bytes: int


class _Answer(NamedTuple):
    """What a call returned or raised."""

    value: Any
    error: BaseException | None


class Helper:
    """A process that runs functions one at a time; use it in a `with` block.

    The process starts with the first call, and again with the next call after it was ended. It ends by itself when its
    caller ends, at the latest when the time of the present call is over. It is a protection from faults of libraries,
    and no prison for their code: it has the rights of the caller.
    """

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self._lock = ForkedLock()
        self._child: _Child | None = None

    def run(self, function: Callable[P, R], /, *arguments: P.args, **named: P.kwargs) -> R:
        """Return `function(*arguments, **named)` of the helper process, or raise what it raises.

        The function must be importable by name, like those of quadfringe and of Python; arguments and result are
        pickled. Imports within the function count for the limits. Raises `BoundedError` when the call exceeds a limit
        or ends the process, and `UnansweredError`, which is one, when another cause is as likely.
        """
        if sys.platform == "win32":
            return function(*arguments, **named)
        with self._lock:
            if self._child is None or self._child.owner != os.getpid():
                self._child = _Child(self.limits)
            try:
                answer = self._child.ask(pickle.dumps((function, arguments, named)), self.limits.time_s + START_S)
            except BaseException:  # also Ctrl-C: an answer that comes later would be taken for that of the next call
                self._child.end()
                self._child = None
                raise
        if isinstance(answer.error, MemoryError):
            raise BoundedError(f"needs more than {self.limits.memory_bytes / 1e6:.0f} MB of memory") from answer.error
        if answer.error is not None:
            raise answer.error
        result: R = answer.value
        return result

    @property
    def running(self) -> bool:
        """Whether calls reach a process that earlier calls reached."""
        return sys.platform == "win32" or (self._child is not None and self._child.owner == os.getpid())

    def close(self) -> None:
        """End the process; further calls do nothing."""
        with self._lock:
            if self._child is not None:
                self._child.end()
                self._child = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


class _Child:
    """The process and the connection to it."""

    def __init__(self, limits: Limits) -> None:
        self.owner = os.getpid()
        self.time_s = limits.time_s
        try:
            self.connection, theirs = Pipe()
            with theirs:
                self.process = _started(theirs.fileno(), limits)
        except OSError as error:  # no descriptors, no processes, no memory
            raise UnansweredError(f"needs a helper process, which cannot be started: {error}") from error
        self.end = weakref.finalize(self, _end, self.process, self.connection, self.owner)
        self._await_start()

    def _await_start(self) -> None:
        """Raise `UnansweredError` unless the process says that it is ready: the program may be no Python."""
        with suppress(EOFError, OSError):
            if self.connection.poll(START_S) and self.connection.recv_bytes() == READY:
                return
        self.end()
        raise UnansweredError(
            f"needs a helper process, which ended when it started ({_ended(self.process.returncode)}); {EXECUTABLE}"
        )

    def ask(self, request: bytes, wait_s: float) -> _Answer:
        """Send a request and wait for its answer; raise `BoundedError` when none comes."""
        late = False
        with suppress(EOFError, OSError):  # the process has ended
            self.connection.send_bytes(request)
            if self.connection.poll(wait_s):
                answer: _Answer = pickle.loads(self.connection.recv_bytes())
                return answer
            late = True
            self.process.kill()
        status = self.process.wait()
        if late or status == -signal.SIGALRM:
            raise UnansweredError(f"does not end within {self.time_s:g} s")
        if status < 0 and -status not in CRASHES:
            raise UnansweredError(f"was stopped from outside ({_ended(status)})")
        raise BoundedError(f"crashes ({_ended(status)})")


def _started(descriptor: int, limits: Limits) -> subprocess.Popen[bytes]:
    python = os.fsdecode(get_executable() or b"")  # an embedding program can set it, as for multiprocessing
    if not python or (getattr(sys, "frozen", False) and python == sys.executable):
        raise UnansweredError(f"needs a helper process, and this program is no Python; {EXECUTABLE}")
    package = str(Path(__file__).parents[2])
    known = os.environ.get("PYTHONPATH")
    return subprocess.Popen(
        # -P: no module of the working directory is imported, as little as by the console script.
        [python, "-P", "-c", SERVE, str(descriptor), str(int(1e6 * limits.time_s)), str(limits.memory_bytes)],
        pass_fds=[descriptor],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=os.environ | {"PYTHONPATH": os.pathsep.join((package, known)) if known else package},
        start_new_session=True,  # Ctrl-C in a terminal is for the caller, which decides when reading ends
    )


def _ended(status: int) -> str:
    return signal.Signals(-status).name if status < 0 else f"exit status {status}"


def _end(process: subprocess.Popen[bytes], connection: Connection, owner: int) -> None:
    if os.getpid() == owner:  # a forked copy of the caller leaves the process alone
        process.kill()
        process.wait()
    connection.close()


def serve(descriptor: int, time_us: int, memory_bytes: int) -> None:
    """Answer the requests that come through a connection until the other side closes it; runs in the helper."""
    import resource  # Windows has no such module

    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGALRM, signal.SIG_DFL)  # ends the process at once, wherever it is
    connection, limited = Connection(descriptor), False
    with suppress(EOFError, OSError):
        connection.send_bytes(READY)
        while True:
            request = connection.recv_bytes()
            try:
                function, arguments, named = pickle.loads(request)  # imports the function, before the limits begin
                if not limited:
                    _limit_memory(memory_bytes)
                    limited = True
                signal.setitimer(signal.ITIMER_REAL, time_us / 1e6)
                answer = pickle.dumps(_Answer(function(*arguments, **named), None))
            except Exception as error:  # noqa: BLE001 - raised again in the caller
                answer = pickle.dumps(_Answer(None, error))
            connection.send_bytes(answer)
            signal.setitimer(signal.ITIMER_REAL, 0.0)


def _limit_memory(more_bytes: int) -> None:
    """Let the address space grow by this much from now on, on systems that tell how large it is."""
    import resource

    statm = Path("/proc/self/statm")
    if not statm.exists():
        return
    pages = int(statm.read_text().split()[0])
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + more_bytes, hard))
