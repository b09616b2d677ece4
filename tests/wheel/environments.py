"""A new environment with the wheel, in which programs find neither the checkout nor a compiler."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

UV = shutil.which("uv", path=str(Path(sys.executable).parent))
TOOLS = ("cc", "gcc", "clang", "c++", "cargo", "rustc", "zig", "make")
HIDDEN = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "DISPLAY", "WAYLAND_DISPLAY")


class Environment:
    """The wheel in a folder with at most one extra."""

    def __init__(self, folder: Path, wheel: Path, extra: str) -> None:
        assert UV is not None, "uv is not installed: make wheel"
        self.folder = folder
        self.programs = folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
        self.python = self.programs / "python"
        self._do([UV, "venv", "--quiet", "--python", sys.executable, str(folder / "venv")], dict(os.environ))
        wanted = f"{wheel}[{extra}]" if extra else str(wheel)
        # Nothing is compiled here either.
        options = ["--quiet", "--only-binary", ":all:", "--python", str(self.python)]
        self._do([UV, "pip", "install", *options, wanted], dict(os.environ))

    @property
    def variables(self) -> dict[str, str]:
        """The variables of a program: the PATH has the programs of this environment alone."""
        kept = {name: value for name, value in os.environ.items() if name not in HIDDEN}
        return kept | {"PATH": str(self.programs), "HOME": str(self.folder)}

    def quadfringe(self, *arguments: str, fails: bool = False) -> str:
        """Run a command in the folder and return what it printed; fail if it succeeds only when it should not."""
        return self._do([str(self.programs / "quadfringe"), *arguments], self.variables, fails=fails)

    def run(self, program: str) -> str:
        """Run Python code in the folder and return what it printed."""
        return self._do([str(self.python), "-c", program], self.variables)

    def _do(self, command: list[str], variables: dict[str, str], *, fails: bool = False) -> str:
        done = subprocess.run(command, cwd=self.folder, env=variables, capture_output=True, text=True, timeout=300)
        printed = done.stdout + done.stderr
        assert (done.returncode != 0) == fails, f"{command}: status {done.returncode}\n{printed}"
        assert "Traceback" not in printed, printed
        return printed
