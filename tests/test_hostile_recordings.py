"""Recordings made to mislead the reader: it opens no other file, and trusts no size that the file cannot hold."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from support.takes import SHOTS, changed, recorded

from quadfringe.data import Shot
from quadfringe.errors import InputError, RecordingError, RecordingWarning
from quadfringe.evaluation._takes import numbered_shot
from quadfringe.files import TEXT_BYTES
from quadfringe.recording import Recorder, Recording
from quadfringe.recording._checksums import crc_of_shot, crcs_of_shots
from quadfringe.recording._seal import FOOTER
from quadfringe.recording._source import Source

GOLDEN = Path(__file__).parent / "golden" / "take.h5"


@pytest.fixture
def take(tmp_path: Path) -> Path:
    return recorded(tmp_path / "take.h5")


@pytest.fixture
def hostile(tmp_path: Path) -> Path:
    """A recording without checksums of its stamps, as a file that somebody else made."""
    path = tmp_path / "hostile.h5"
    path.write_bytes(GOLDEN.read_bytes())
    return path


def external(file: h5py.File, secret: Path) -> None:
    file.create_dataset("id", (1,), "<u8", external=[(str(secret), 0, 8)])


def linked(file: h5py.File, secret: Path) -> None:
    file["id"] = h5py.ExternalLink(str(secret), "id")


def soft(file: h5py.File, _secret: Path) -> None:
    file["id"] = h5py.SoftLink("/time_us")


def virtual(file: h5py.File, secret: Path) -> None:
    layout = h5py.VirtualLayout((1,), "<u8")
    layout[:] = h5py.VirtualSource(str(secret), "id", (1,))
    file.create_virtual_dataset("id", layout)


@pytest.mark.parametrize("place", [external, linked, soft, virtual])
def test_a_recording_makes_the_program_read_no_other_file(
    place: Callable[[h5py.File, Path], None], hostile: Path, tmp_path: Path
) -> None:
    with h5py.File(tmp_path / "secret.h5", "w") as secret:
        secret["id"] = np.array([42], "<u8")
    changed(hostile, lambda file: (file.pop("id"), place(file, tmp_path / "secret.h5")))
    with pytest.raises(InputError, match=r"hostile\.h5: damaged recording: id is no dataset of this file itself"):
        Recording(hostile)


def test_long_texts_and_attributes_are_refused(hostile: Path) -> None:
    text = b"[" + b"1," * (TEXT_BYTES // 2) + b"1]"
    sound = hostile.read_bytes()
    changed(hostile, lambda file: (file.pop("config"), file.__setitem__("config", np.array(text, f"S{len(text)}"))))
    with pytest.raises(InputError, match=r"/config has 8 MB; expected at most 8 MB"):
        Recording(hostile)
    hostile.write_bytes(sound)
    changed(hostile, lambda file: file.attrs.__setitem__("more", "a" * 70_000))
    with pytest.raises(InputError, match="the attribute more has more than 65536 bytes"):
        Recording(hostile)


def test_keys_that_a_calibration_gives_twice_are_refused(hostile: Path) -> None:
    def double(file: h5py.File) -> None:
        text = file.pop("calibration").asstr()[()]
        file["calibration"] = text[:-1] + ',"camera":' + json.dumps(json.loads(text)["camera"]) + "}"

    with pytest.raises(InputError, match="calibration: not valid JSON: the key 'camera' is given twice"):
        Recording(changed(hostile, double))


def test_images_in_another_order_of_bytes_are_refused(hostile: Path) -> None:
    def turn(file: h5py.File) -> None:
        for name in ("red", "green", "blue", "ir"):
            file[name] = file.pop(name)[:].astype(">u2")

    with pytest.raises(InputError, match=">u2: not the type or size of a recording"):
        Recording(changed(hostile, turn))
    images = np.zeros((4, 16, 16), ">u2")
    with (
        pytest.raises(InputError, match=r"expected images of uint8, uint16 or float32, got >u2"),
        Recorder(hostile.with_name("new.h5")) as recorder,
    ):
        recorder.write(Shot(*images))


def test_an_image_beyond_the_end_is_damage(take: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for begin in ((1 << 63) - 1, 1 << 63, (1 << 64) - 2):
        with Recording(take) as recording:
            ask = Source._ask

            def moved(source: Source, *arguments: Any, ask: Any = ask, begin: int = begin) -> Any:
                return {name: replace(extent, begin=begin) for name, extent in ask(source, *arguments).items()}

            monkeypatch.setattr(Source, "_ask", moved)
            with pytest.raises(InputError, match=r"shot 1 is damaged \(an image ends beyond the end"):
                recording[1]
            monkeypatch.undo()


def test_more_rows_than_the_file_holds_are_refused(tmp_path: Path) -> None:
    """Each row of the table needs its bytes, also when the images are smaller."""
    take = tmp_path / "take.h5"
    with Recorder(take) as recorder:
        recorder.write(numbered_shot(0, (1, 4)))

    def lengthen(file: h5py.File) -> None:
        for name in ("red", "green", "blue", "ir", "id", "time_us", "crc32"):
            file[name].resize(300_000, axis=0)

    size = changed(take, lengthen).stat().st_size
    with take.open("ab") as file:
        file.write(bytes(8_000_000 - size))
    with pytest.raises(InputError, match="claims 300000 shots, but its size is that of 222222"):
        Recording(take)
    os.truncate(take, size)
    os.truncate(take, 8_000_000)  # a hole: the file has room on the disk for some thousand rows
    with pytest.raises(InputError, match=r"claims 300000 shots, but its size is that of \d{4,5};"):
        Recording(take)


@pytest.mark.parametrize("extents", [0, 1 << 28])
def test_the_seal_of_a_sparse_file_takes_no_time(extents: int, take: Path) -> None:
    """Some kB on the disk would be 5 GB to hash, or a table of 4 GB of extents."""
    data = take.read_bytes()
    magic, end, shots, *_ = FOOTER.unpack(data[-FOOTER.size :])
    hole = 1 << 32
    with take.open("wb") as file:
        file.write(data[:end])
        file.seek(hole + 16 * extents)
        file.write(FOOTER.pack(magic, hole, shots, extents, bytes(32), 0))
    begin_s = time.process_time()
    with pytest.warns(RecordingWarning, match="changed since it was closed"), Recording(take) as recording:
        assert recording.verify().damaged == ()
    assert time.process_time() - begin_s < 1.0


def test_the_checksums_of_many_shots_are_those_of_each() -> None:
    chance = np.random.default_rng(0)
    nothing = np.zeros(0, np.uint64), np.zeros(0, np.int64), np.zeros((0, 2, 3), np.int64), np.zeros((0, 4), np.uint32)
    assert crcs_of_shots("ab", *nothing).shape == (0,)
    rows = 50
    ids, times_us = chance.integers(0, 1 << 60, rows).astype(np.uint64), chance.integers(-9, 1 << 60, rows)
    for chips in (0, 2):
        stamps = chance.integers(-(1 << 60), 1 << 60, (rows, chips, 3))
        crcs = chance.integers(0, 1 << 32, (rows, 4)).astype(np.uint32)
        one_by_one = [
            crc_of_shot("ab", n, (int(ids[n]), int(times_us[n])), stamps[n].tolist(), crcs[n].tolist())
            for n in range(rows)
        ]
        assert crcs_of_shots("ab", ids, times_us, stamps, crcs).tolist() == one_by_one


def test_a_seal_says_that_the_file_was_closed(take: Path) -> None:
    """Otherwise a damaged last shot would pass as one that the writer did not finish."""
    with h5py.File(take) as file:
        closed = file["closed"].id.get_offset()
        last = file["red"].id.get_chunk_info_by_coord((SHOTS - 1, 0, 0)).byte_offset
    data = bytearray(take.read_bytes())
    assert data[closed] == 1
    data[closed] = 0
    data[last] ^= 1
    take.write_bytes(data)
    with pytest.warns(RecordingWarning, match="changed since it was closed"):
        recording = Recording(take)
    with recording:
        assert (len(recording), recording.closed_in_order) == (SHOTS, True)
        assert recording.verify().damaged == (SHOTS - 1,)


def test_a_pipe_is_no_missing_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "take.h5")
    with pytest.raises(InputError, match=r"take\.h5: is a pipe; name a file"):
        Recording(tmp_path / "take.h5")


def hollow(file: h5py.File, height_px: int, width_px: int) -> None:
    """Replace the images by larger ones that are holes."""
    as_it_is = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    as_it_is.set_chunk((1, height_px, width_px))
    as_it_is.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    as_it_is.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    space = h5py.h5s.create_simple((len(file["id"]), height_px, width_px))
    for name in ("red", "green", "blue", "ir"):
        del file[name]
        h5py.h5d.create(file.id, name.encode(), h5py.h5t.STD_U8LE, space, as_it_is)


@pytest.mark.parametrize(
    ("size", "reason"),
    [
        ((8192, 8193), r"claims shots of 268 MB, and nearly all of the file are holes .*; expected at most 268 MB"),
        ((16385, 16384), "expected images of at most 268,435,456 pixels, got 16384 x 16385"),
        ((40_000, 40_000), "expected images of at most 268,435,456 pixels, got 40000 x 40000"),
    ],
)
def test_huge_images_of_holes_are_refused(size: tuple[int, int], reason: str, hostile: Path) -> None:
    """Some kB on the disk would be shots of gigabytes, which take half a minute and all memory."""
    changed(hostile, lambda file: hollow(file, *size))
    assert 512 * hostile.stat().st_blocks < 1 << 20
    with pytest.raises(InputError, match=rf"hostile\.h5: .*{reason}"):
        Recording(hostile)


def test_images_of_holes_that_fit_are_read(hostile: Path) -> None:
    changed(hostile, lambda file: hollow(file, 1024, 1024))
    with pytest.warns(RecordingWarning, match="cannot be verified"):
        recording = Recording(hostile)
    with recording:
        assert recording.read(0) is None  # its checksums are those of other images
        assert recording.header.shot_bytes == 4 << 20


def test_a_shot_that_does_not_fit_into_memory_is_not_called_damaged(
    take: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise MemoryError("Unable to allocate 1.49 GiB")

    with Recording(take) as recording:
        monkeypatch.setattr("quadfringe.recording._source.np.empty", refuse)
        with pytest.raises(RecordingError, match=r"shot 1 cannot be read: Unable to allocate 1\.49 GiB"):
            recording.read(1)


def test_no_image_is_recorded_that_cannot_be_read(tmp_path: Path) -> None:
    row = np.zeros((1, 1), np.uint8)
    images = [np.broadcast_to(row, (16385, 16384))] * 4
    with (
        pytest.raises(InputError, match="expected images of at most 268,435,456 pixels"),
        Recorder(tmp_path / "new.h5") as recorder,
    ):
        recorder.write(Shot(*images))
    assert not list(tmp_path.iterdir())
