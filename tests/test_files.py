"""Output files are complete or absent."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path

import pytest

from quadfringe.errors import InputError, MissingExtraError, require
from quadfringe.files import atomic, believable_bytes, figures_text, folder_for, read_bytes, require_suffix


def test_a_failed_write_leaves_nothing(tmp_path: Path) -> None:
    target = tmp_path / "shape.npz"

    def write() -> None:
        with atomic(target) as temporary:
            temporary.write_bytes(b"half")
            raise RuntimeError("power cut")

    with pytest.raises(RuntimeError, match="power cut"):
        write()
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_keeps_the_old_file(tmp_path: Path) -> None:
    target = tmp_path / "shape.npz"
    target.write_bytes(b"old")
    with pytest.raises(ZeroDivisionError), atomic(target) as temporary:  # noqa: PT012
        temporary.write_bytes(b"new")
        _ = 1 / 0
    assert target.read_bytes() == b"old"


def test_a_written_file_is_readable_by_others(tmp_path: Path) -> None:
    plain, careful = tmp_path / "plain", tmp_path / "careful"
    plain.write_text("x")
    with atomic(careful) as temporary:
        temporary.write_text("x")
    assert careful.stat().st_mode == plain.stat().st_mode


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"), atomic(tmp_path / "no" / "x.npz"):
        pass


def test_a_file_in_place_of_a_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot create this folder"):
        folder_for(tmp_path / "file")


def test_figures_are_valid_json_even_without_a_number() -> None:
    text = figures_text({"depth_rms_mm": 0.07, "nothing_mm": math.nan})
    assert json.loads(text) == {"figures": {"depth_rms_mm": 0.07, "nothing_mm": None}}


def test_suffixes_are_checked() -> None:
    assert require_suffix(Path("a.PLY"), (".ply",)) == ".ply"
    with pytest.raises(InputError, match=r"expected a name that ends in \.ply"):
        require_suffix(Path("a.stl"), (".ply",))


def test_a_missing_library_names_its_extra() -> None:
    with pytest.raises(MissingExtraError, match=r'pip install "quadfringe\[plot\]"'):
        require("no_such_module_at_all", "plot")


def test_a_file_of_holes_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "a.bmp"
    path.write_bytes(b"BM")
    os.truncate(path, 4_000_000_000)
    with pytest.raises(InputError, match=r"a\.bmp: has 4000 MB, and nearly all of it are holes that take no room"):
        read_bytes(path)
    os.truncate(path, 1_000_000)
    assert len(read_bytes(path)) == 1_000_000


def test_a_file_system_that_does_not_tell_the_room_is_believed() -> None:
    found = os.stat_result((0o100644, 1, 1, 1, 0, 0, 4_000_000_000, 0, 0, 0))
    assert believable_bytes(found) == 4_000_000_000
