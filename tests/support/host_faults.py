"""A host whose clock is set or whose disk is slow, for child processes alone; `host_faults.c` says how."""

from __future__ import annotations

import mmap
import os
import struct
import subprocess
from pathlib import Path

__all__ = ["VARIABLE", "HostFaults", "faults_of_this_process", "faulty_host"]

VARIABLE = "QUADFRINGE_HOST_FAULTS"
SOURCE = Path(__file__).with_name("host_faults.c")


class HostFaults:
    """The faults of the processes that run with one file; changes take effect at once."""

    def __init__(self, file: Path) -> None:
        with file.open("r+b") as opened:
            self._map = mmap.mmap(opened.fileno(), 16)

    def set_clock(self, ahead_s: float) -> None:
        """Set UTC so many seconds ahead of the true one."""
        struct.pack_into("=q", self._map, 0, round(ahead_s * 1e9))

    def set_disk(self, write_s: float) -> None:
        """Let every write to a recording take so many seconds longer; a shot needs several."""
        struct.pack_into("=q", self._map, 8, round(write_s * 1e9))


def faulty_host(folder: Path) -> dict[str, str]:
    """Return the environment of child processes on a faulty host, at first without a fault."""
    library, file = folder / "host_faults.so", folder / "host_faults"
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, SOURCE, "-ldl"], check=True)
    file.write_bytes(bytes(16))
    return os.environ | {"LD_PRELOAD": str(library), VARIABLE: str(file)}


def faults_of_this_process() -> HostFaults:
    """Return the faults of this process, which runs with the environment of `faulty_host`."""
    return HostFaults(Path(os.environ[VARIABLE]))
