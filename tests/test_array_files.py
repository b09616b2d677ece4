"""NPZ and NPY files with odd members: each is one clear error, and no value is read otherwise than it was saved."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadfringe as qf
from quadfringe.calibration.height import HeightCalibration
from quadfringe.io import read_npy, read_npz


def archive(path: Path, members: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w") as stored:
        for name, data in members.items():
            stored.writestr(name, data)
    return path


def npy(array: Any) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.asarray(array))
    return stream.getvalue()


MAPS = {
    f"{name}.npy": npy(np.zeros((4, 5), np.float32)) for name in ("phase_rad", "column_px", "modulation", "quality")
}
LONG = npy(np.zeros((4, 5), np.float32)).replace(b"(4, 5)", b"(2, 5)")
HUGE = npy(np.zeros((4, 5), np.float32)).replace(b"(4, 5), ", b"(9999999999999, 999999999), ")


@pytest.mark.parametrize(
    ("members", "reason"),
    [
        ({"phase_rad.npy": LONG}, r"phase_rad: expected 40 bytes for an array \(2, 5\) of float32, got 80"),
        ({"phase_rad.npy": HUGE}, "not a readable NPZ file: phase_rad"),
        ({"phase_rad.npy": b"text"}, "not a readable NPZ file: phase_rad"),
        ({"phase_rad.npy": npy(np.full((4, 5), "x"))}, "expected maps of float32, got phase_rad of <U1"),
        ({"phase_rad.npy": npy(np.zeros((4, 5), complex))}, "expected maps of float32, got phase_rad of complex128"),
        ({"phase_rad.npy": npy(np.zeros(5, np.float32))}, r"phase_rad: expected an array \(H, W\)"),
        ({"phase_rad.npy": npy(np.zeros(5, "f4,i4"))}, "phase_rad: expected an array of numbers or texts"),
        ({"config.npy": npy("[" * 100_000)}, "s.npz, config: expected at most 64 lists"),
        ({"config.npy": npy('{"decode": 5}')}, "s.npz, config: decode: expected a dict, got 5"),
        ({"config.npy": npy('{"warnings": 5}')}, "s.npz, config: warnings: expected a list, got 5"),
        ({"config.npy": npy("[]")}, "s.npz, config: expected a JSON object, got list"),
        ({"config.npy": npy(5.0)}, r"s.npz, config: expected a text, got float64 \(\)"),
        ({"config.npy": npy(["{}", "{}"])}, r"s.npz, config: expected a text, got <U2 \(2,\)"),
        ({"calibration.npy": npy("{")}, "s.npz, calibration: not valid JSON"),
        ({"calibration.npy": npy("{}")}, "s.npz, calibration: 2 problems"),
        ({"phase_rad": MAPS["phase_rad.npy"]}, "s.npz: not a readable NPZ file: it holds phase_rad twice"),
        ({"readme.txt": b"text"}, "not a readable NPZ file: readme.txt"),
    ],
)
def test_odd_members_of_a_shape_are_told(members: dict[str, bytes], reason: str, tmp_path: Path) -> None:
    path = archive(tmp_path / "s.npz", MAPS | members)
    with pytest.raises(qf.InputError, match=reason):
        qf.Shape.load(path)


def test_arrays_of_other_kinds_are_told(tmp_path: Path) -> None:
    keys = {"reference_rad": (4, 5), "coefficients": (4, 5, 4), "heights_mm": (5,), "residual_rms_mm": (5,)}
    good = {f"{name}.npy": npy(np.zeros(shape)) for name, shape in keys.items()}
    HeightCalibration.load(archive(tmp_path / "h.npz", good))
    for name, array in (("heights_mm", np.float64(5)), ("coefficients", np.zeros((4, 6, 4))), ("heights_mm", "x")):
        with pytest.raises(qf.InputError, match=r"h.npz: expected"):
            HeightCalibration.load(archive(tmp_path / "h.npz", good | {f"{name}.npy": npy(array)}))
    np.save(tmp_path / "a.npy", np.zeros((2, 3)))
    data = (tmp_path / "a.npy").read_bytes()
    for changed in (
        data[:-1],
        data + b"0",
        data.replace(b"(2, 3)", b"(-2,-3)"),
        data.replace(b"NUMPY\x01", b"NUMPY\x07"),
    ):
        (tmp_path / "a.npy").write_bytes(changed)
        with pytest.raises(qf.InputError, match=r"a.npy: not a readable NPY file: "):
            read_npy(tmp_path / "a.npy")


def test_arrays_in_every_layout_are_read(tmp_path: Path) -> None:
    kinds = (
        np.arange(6.0).reshape(2, 3).T,
        np.zeros((0, 3)),
        np.float32(5),
        np.array("text"),
        np.arange(3, dtype=">i4"),
    )
    np.savez_compressed(tmp_path / "a.npz", *kinds)
    for kept, array in zip(read_npz(tmp_path / "a.npz").values(), kinds, strict=True):
        np.testing.assert_array_equal(kept, array)
        assert kept.flags.writeable


def test_an_archive_of_many_members_or_bytes_is_refused(tmp_path: Path) -> None:
    one = npy(np.zeros(1))
    with pytest.raises(qf.InputError, match=r"many\.npz: .*it holds 20000 arrays, expected at most 1000"):
        read_npz(archive(tmp_path / "many.npz", {f"m{number}.npy": one for number in range(20_000)}))
    bomb = tmp_path / "bomb.npz"
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as stored:
        stored.writestr("a.npy", one)
        size, stored.filelist[0].file_size = stored.filelist[0].file_size, 1 << 31
    assert size == len(one)
    with pytest.raises(qf.InputError, match=r"bomb\.npz: .*its arrays have 2147 MB, expected at most 1074 MB"):
        read_npz(bomb)


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_archives_that_are_compressed_as_numpy_never_does_are_refused(method: int, tmp_path: Path) -> None:
    """BZIP2 makes a kB of a GB of zeros."""
    with zipfile.ZipFile(tmp_path / "a.npz", "w", method) as stored:
        stored.writestr("a.npy", npy(np.zeros(9)))
    with pytest.raises(qf.InputError, match=r"a\.npz: .*its arrays are compressed as NumPy never does"):
        read_npz(tmp_path / "a.npz")


def test_an_array_that_ends_early_is_refused(tmp_path: Path) -> None:
    path = archive(tmp_path / "a.npz", {"a.npy": npy(np.zeros(1 << 17))})
    data = bytearray(path.read_bytes())
    with zipfile.ZipFile(path) as stored:
        found = stored.infolist()[0]
    place = data.rindex(b"PK\x01\x02")
    data[place + 20 : place + 24] = (found.compress_size // 2).to_bytes(4, "little")
    path.write_bytes(data)
    with pytest.raises(qf.InputError, match=r"a\.npz: not a readable NPZ file: "):
        read_npz(path)
