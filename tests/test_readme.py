"""The README runs: every block, in order, in one empty folder, unless the line above it says why it cannot."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from typer.main import get_command

from quadfringe.cli import app
from quadfringe.config import load_system

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text()
FENCE = re.compile(r"^(?:<!-- not run: (?P<reason>[^\n]*) -->\n)?```(?P<kind>\w*)\n(?P<text>.*?)^```$", re.M | re.S)
MOST_WORDS, LEAST_WORDS = 30, 4  # of a reason


class Block(NamedTuple):
    """One fenced block; `reason` says why it is not run, None when it is."""

    kind: str
    text: str
    reason: str | None


def blocks_of(document: str) -> list[Block]:
    return [Block(found["kind"], found["text"], found["reason"]) for found in FENCE.finditer(document)]


def run(block: Block, folder: Path) -> None:
    """Run a block as its kind says, in a folder that keeps what earlier blocks have written."""
    if block.kind in ("python", "sh"):
        command = [sys.executable, "-c"] if block.kind == "python" else ["bash", "-euc"]
        path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        environment = {**os.environ, "PATH": path}
        done = subprocess.run([*command, block.text], cwd=folder, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    elif block.kind == "toml":
        (folder / "system.toml").write_text(block.text)
        load_system(folder / "system.toml")
    elif block.kind == "rust":
        # The doc tests of the crate run every Rust block of the README.
        assert 'include_str!("../../../README.md")' in (ROOT / "crates" / "quadfringe" / "src" / "lib.rs").read_text()
    else:
        pytest.fail(f"a block of kind {block.kind!r} is not run; state why in a line <!-- not run: REASON --> above it")


def check_commands(block: Block) -> None:
    """Check what can be checked without running: commands and options of quadfringe, targets of make."""
    for line in block.text.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        if words[:1] == ["make"]:
            assert re.search(rf"^{words[1]}:", (ROOT / "Makefile").read_text(), re.M), line
        elif words[:1] == ["quadfringe"]:
            check_options(words[1:], line)


def check_options(words: list[str], line: str) -> None:
    command: Any = get_command(app)
    while hasattr(command, "commands"):  # a group
        assert words, line
        assert words[0] in command.commands, line
        command, words = command.commands[words[0]], words[1:]
    known = {name for parameter in command.params for name in (*parameter.opts, *parameter.secondary_opts)}
    assert {word for word in words if word.startswith("--")} <= known, line


BLOCKS = blocks_of(README)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("readme")


@pytest.mark.parametrize("block", BLOCKS, ids=[f"{i}-{block.kind}" for i, block in enumerate(BLOCKS)])
def test_block_runs_or_says_why_not(block: Block, folder: Path) -> None:
    if block.reason is None:
        run(block, folder)
    else:
        assert LEAST_WORDS <= len(block.reason.split()) <= MOST_WORDS
        check_commands(block)


def test_every_block_is_seen() -> None:
    assert 2 * len(BLOCKS) == len(re.findall(r"^ *(?:```|~~~)", README, re.M))
    assert {"python", "sh", "toml", "rust"} <= {block.kind for block in BLOCKS if block.reason is None}


@pytest.mark.parametrize("picture", re.findall(r"!\[[^\]]*\]\(([^)]+)\)", README))
def test_pictures_exist(picture: str) -> None:
    assert (ROOT / picture).is_file()


# On planted faults


@pytest.mark.parametrize(
    ("document", "error"),
    [
        ("```python\nraise SystemExit(3)\n```\n", AssertionError),
        ("```sh\nfalse\ntrue\n```\n", AssertionError),
        ("```toml\n[decode]\nmethd = 1\n```\n", ValueError),
        ("```console\nquadfringe live\n```\n", pytest.fail.Exception),
        ("```\nplain\n```\n", pytest.fail.Exception),
    ],
)
def test_a_block_that_fails_is_found(document: str, error: type[BaseException], tmp_path: Path) -> None:
    (block,) = blocks_of(document)
    with pytest.raises(error):
        run(block, tmp_path)


@pytest.mark.parametrize("line", ["quadfringe lve", "quadfringe decode --gren x.png", "make nothing"])
def test_a_command_that_does_not_exist_is_found(line: str) -> None:
    (block,) = blocks_of(f"<!-- not run: it needs a camera -->\n```console\n{line}\n```\n")
    assert block.reason == "it needs a camera"
    with pytest.raises(AssertionError):
        check_commands(block)
