"""Whatever the README shows is run, in its order, in one empty folder."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from quadfringe.evaluation._scenes import ROOT

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
README = (ROOT / "README.md").read_text()
BLOCKS = [(kind, text) for kind, text in BLOCK.findall(README) if kind in ("python", "sh")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("readme")


@pytest.mark.parametrize(("kind", "text"), BLOCKS, ids=[f"{i}-{k}" for i, (k, _) in enumerate(BLOCKS)])
def test_block_runs(kind: str, text: str, folder: Path) -> None:
    if re.fullmatch(r"(make \w+.*\n)+", text):
        for line in text.splitlines():
            target = line.split()[1]
            assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE), target
        return
    commands = [sys.executable, "-c", text] if kind == "python" else ["bash", "-euc", text]
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(commands, cwd=folder, env={**os.environ, "PATH": path}, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_there_is_something_to_run() -> None:
    assert {"python", "sh"} <= {kind for kind, _ in BLOCKS}


@pytest.mark.parametrize("picture", re.findall(r"!\[[^\]]*\]\(([^)]+)\)", README))
def test_pictures_exist(picture: str) -> None:
    assert (ROOT / picture).is_file()
