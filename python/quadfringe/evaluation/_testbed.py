"""Orders to the umockdev testbed, in which two emulated LightCrafter 4500 projectors stand at ports 1-1 and 1-2."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager

TESTBED = "LIGHTCRAFTER_TESTBED"  # the environment variable in which the testbed gives its socket to a command
Order = Callable[[str, str], str]


@contextmanager
def orders() -> Iterator[Order]:
    """Give a function that sends a port and an event to the testbed and returns its answer."""
    with socket.socket(socket.AF_UNIX) as wire:
        wire.connect(os.environ[TESTBED])
        with closing(wire.makefile()) as answers:

            def send(port: str, event: str) -> str:
                wire.sendall(f"{port} {event}\n".encode())
                answer = answers.readline().strip()
                if not answer.startswith("ok"):
                    raise ValueError(f"order {event!r} to port {port}: expected ok, got {answer!r}")
                return answer.removeprefix("ok").strip()

            yield send
