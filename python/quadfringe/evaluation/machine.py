"""Describe the machine that a time was measured on: processor, system, versions, and the commit of a checkout."""

from __future__ import annotations

import os
import platform
import subprocess
from pathlib import Path

from quadfringe import _core
from quadfringe.recording._cores import usable_cores

__all__ = ["described", "resident_bytes", "usable_cores"]


def described() -> dict[str, str | int | None]:
    """Return cpu, cores, os, python, quadfringe and commit; the commit is None outside a git checkout.

    A commit that ends in "-dirty" had uncommitted changes.

    >>> from quadfringe.evaluation.machine import described
    >>> sorted(described())
    ['commit', 'cores', 'cpu', 'os', 'python', 'quadfringe']
    """
    return {
        "cpu": _cpu(),
        "cores": usable_cores(),
        "os": platform.platform(),
        "python": platform.python_version(),
        "quadfringe": _core.__version__,
        "commit": _commit(),
    }


def resident_bytes() -> int | None:
    """Return the resident memory of this process, bytes; None on systems other than Linux."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return None
    return pages * os.sysconf("SC_PAGE_SIZE")


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _commit() -> str | None:
    """Return the commit if git tracks this very file; the environment may lie inside another checkout."""
    here = Path(__file__).resolve()
    git = ["git", "-C", str(here.parent)]
    tracked = _output([*git, "ls-files", "--error-unmatch", here.name])
    return None if tracked is None else _output([*git, "describe", "--always", "--dirty", "--exclude", "*"])


def _output(command: list[str]) -> str | None:
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return done.stdout.strip()
