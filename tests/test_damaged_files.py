"""Damaged, changed and odd files: one clear error, no traceback, nothing read without end, and no terminal obeyed."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import quadfringe as qf
from quadfringe.calibration.opencv_files import read_opencv, write_opencv
from quadfringe.cli import app
from quadfringe.cli._output import printable, rows
from quadfringe.config import ChannelResponse, load_system
from quadfringe.data import Calibration, ResponseCalibration
from quadfringe.files import atomic, read_bytes
from quadfringe.io.texts import json_of

SECONDS = 20  # a reader that does not end is stopped, and the test fails


@pytest.fixture(autouse=True)
def _bounded() -> Iterator[None]:
    signal.alarm(SECONDS)
    yield
    signal.alarm(0)


@pytest.fixture
def saved(tmp_path: Path, small_bench: Path) -> Path:
    path = tmp_path / "c.json"
    Calibration.load(small_bench / "calibration.json").save(path)
    return path


def run(*words: object) -> Result:
    result = CliRunner().invoke(app, [str(word) for word in words], env={"NO_COLOR": "1", "COLUMNS": "300"})
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


# The digest of a calibration


@pytest.mark.parametrize(("before", "after"), [("1290.0", "1290.1"), ("1290.0", "1291"), ("191.5", "181.5")])
def test_a_changed_digit_of_a_calibration_is_told(before: str, after: str, saved: Path) -> None:
    text = saved.read_text()
    assert before in text
    saved.write_text(text.replace(before, after, 1))
    with pytest.raises(qf.ConfigError, match=r"c.json: was changed after it was saved: its digest is 'sha256:"):
        Calibration.load(saved)


@pytest.mark.parametrize("digest", [None, "", 5, "sha256:0"])
def test_a_changed_digest_is_told(digest: Any, saved: Path) -> None:
    saved.write_text(json.dumps(json.loads(saved.read_text()) | {"digest": digest}))
    with pytest.raises(qf.ConfigError, match="was changed after it was saved"):
        Calibration.load(saved)


def test_a_file_that_is_laid_out_anew_is_unchanged(saved: Path) -> None:
    known = Calibration.load(saved)
    values = json.loads(saved.read_text())
    values["camera"]["focal_px"] = [1290, 1290]
    saved.write_text(json.dumps(dict(reversed(values.items())), separators=(",", ":")))
    assert Calibration.load(saved) == known


def test_a_file_without_a_digest_is_read_and_info_says_so(saved: Path) -> None:
    known = Calibration.load(saved)
    assert run("info", saved).stdout.startswith("Calibration, unchanged since it was saved")
    assert f"ok      digest: {saved} is unchanged" in run("doctor", saved).stdout
    values = json.loads(saved.read_text())
    values.pop("digest")
    saved.write_text(json.dumps(values))
    assert Calibration.load(saved) == known
    assert run("info", saved).stdout.startswith("Calibration, without a digest, so a change since it was saved cannot")
    assert f"WARNING digest: {saved} has no digest" in run("doctor", saved).stdout


def test_a_changed_response_is_told(tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    made = ResponseCalibration(red=ChannelResponse(exponent=0.5), steps=8, inputs=("a.png",))
    made.save(path)
    assert ResponseCalibration.load(path) == made
    path.write_text(path.read_text().replace("0.5", "0.6", 1))
    with pytest.raises(qf.ConfigError, match="was changed after it was saved"):
        ResponseCalibration.load(path)


# JSON and TOML


@pytest.mark.parametrize("text", ["[" * 100_000, '{"camera":' * 100_000, "[" * 65 + "]" * 65])
def test_json_is_not_nested_without_end(text: str, tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    path.write_text(text)
    for command in ("info", "doctor"):
        result = run(command, path)
        assert (result.exit_code, "c.json: expected at most 64 lists and tables" in result.stderr) == (2, True)
    assert json_of("[" * 64 + "]" * 64, "deep") != []


@pytest.mark.parametrize("text", ["[" + "0," * 1_000_001 + "0]", "[" + "[]," * 100_001 + "0]"])
def test_json_is_not_long_without_end(text: str) -> None:
    for form in (text, text.encode()):
        with pytest.raises(qf.ConfigError, match=r"c: expected at most 1,000,000 values and 100,000 lists, got more"):
            json_of(form, "c")


def test_a_key_that_is_given_twice_is_an_error(saved: Path) -> None:
    text = saved.read_text().replace('"width_px": 512', '"width_px": 511,\n    "width_px": 512', 1)
    saved.write_text(text)
    with pytest.raises(qf.ConfigError, match=r"c.json: not valid JSON: the key 'width_px' is given twice; keep one"):
        Calibration.load(saved)


@pytest.mark.parametrize("text", ["a = " + "[" * 100_000, "a = " + "[" * 3000 + "]" * 3000, "a = " + "9" * 5000])
def test_toml_is_not_nested_without_end(text: str, tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text(text)
    with pytest.raises(qf.ConfigError, match=r"s.toml: (lists and tables are nested too deep|not valid TOML)"):
        load_system(path)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a" + ".b" * 20_000 + "=1", "expected keys of at most 16 parts"),
        ("[" + "a . " * 20_000 + "a]", "expected keys of at most 16 parts"),
        ("x = {a" + ".'b'" * 20_000 + "=1}", "expected keys of at most 16 parts"),
        ("\n".join(f"k{n}=1" for n in range(40_000)), "has 349 kB; expected at most 262 kB"),
        ("\n".join(f"k{n}=1" for n in range(20_000)), "20000 problems"),
        ("\n".join(f"[a{n}{'.b' * 15}]" for n in range(5_000)), "5000 problems"),
        ("capture = '" + "../" * 40 + "take'\nx = [" + "0.5, " * 999 + "0.5]", "capture: "),
    ],
)
def test_toml_is_limited_in_keys_and_length(text: str, reason: str, tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text(text)
    with pytest.raises(qf.ConfigError, match=rf"s\.toml: (\d problems?\n\s*)?{reason}"):
        load_system(path)


def test_a_message_names_ten_of_many_problems(tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    path.write_text(json.dumps({f"k{n}": 1 for n in range(90_000)}))
    with pytest.raises(qf.ConfigError, match=r"c\.json: 90002 problems") as failed:
        Calibration.load(path)
    assert len(str(failed.value).splitlines()) == 12
    assert str(failed.value).endswith("\n  and 89992 more")
    path.write_text(json.dumps({f"k{n}": 1 for n in range(100_001)}))
    with pytest.raises(qf.ConfigError, match=r"c\.json: not valid JSON: it has more than 100000 keys"):
        Calibration.load(path)


# Files that are not files


@pytest.mark.parametrize("name", ["c.json", "s.npz", "h.npy", "i.png", "s.toml", "p.ply"])
def test_devices_and_pipes_are_refused(name: str, tmp_path: Path) -> None:
    (tmp_path / "device").mkdir()
    (tmp_path / "device" / name).symlink_to("/dev/zero")
    os.mkfifo(tmp_path / name)
    for path, kind in ((tmp_path / "device" / name, "device"), (tmp_path / name, "pipe")):
        result = run("info", path)
        assert (result.exit_code, result.stderr) == (2, f"error: {path}: is a {kind}; name a file\n")


def test_a_file_beyond_the_limit_is_refused_by_its_size(tmp_path: Path) -> None:
    with (tmp_path / "c.json").open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(qf.InputError, match=r"c.json: has 1099512 MB; expected at most 8 MB"):
        Calibration.load(tmp_path / "c.json")
    with pytest.raises(qf.InputError, match=r"c.json: has 1099512 MB; expected at most 4295 MB"):
        read_bytes(tmp_path / "c.json")


def test_a_result_goes_where_a_link_leads(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "latest.json").symlink_to("data/one.json")
    for text in ("first", "second"):
        with atomic(tmp_path / "latest.json") as temporary:
            temporary.write_text(text)
        assert (tmp_path / "latest.json").is_symlink()
        assert (tmp_path / "data" / "one.json").read_text() == text
    assert [path.name for path in (tmp_path / "data").iterdir()] == ["one.json"]
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_no_result_takes_the_place_of_a_device_a_folder_or_a_circle(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.json")
    (tmp_path / "folder.json").mkdir()
    (tmp_path / "null.json").symlink_to("/dev/null")
    (tmp_path / "loop.json").symlink_to("loop.json")
    words = {"pipe": "is a pipe", "folder": "is a folder", "null": "null: is a device", "loop": "leads to itself"}
    for name, reason in words.items():
        with pytest.raises(qf.InputError, match=reason), atomic(tmp_path / f"{name}.json"):
            pass
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"{name}.json" for name in sorted(words)]
    assert Path("/dev/null").is_char_device()


# OpenCV


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("c.yml", "%YAML:1.0\n---\na: " + "[ " * 100_000),
        ("c.json", '{"a": ' * 100_000),
        ("c.xml", '<?xml version="1.0"?><opencv_storage>' + "<a>" * 100_000),
    ],
)
def test_opencv_is_not_given_what_crashes_it(name: str, text: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(qf.InputError, match=rf"{name}: expected at most 32 lists and tables inside one another"):
        read_opencv(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("c.yml", "%YAML:1.0\n---\na: [ " + "[], " * 100_000 + "]\n"),
        ("c.json", '{"a": [' + "[]," * 100_000 + "1]}"),
        ("c.xml", '<?xml version="1.0"?><opencv_storage>' + "<a></a>" * 100_000 + "</opencv_storage>"),
    ],
)
def test_opencv_is_not_given_what_takes_it_long(name: str, text: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(qf.InputError, match=rf"{name}: expected at most 100,000 beginnings and ends of lists"):
        read_opencv(tmp_path / name)


@pytest.mark.parametrize("number", ["1e300", "-1e200", "2."])
def test_a_rotation_that_overflows_is_an_error(number: str, saved: Path, tmp_path: Path) -> None:
    write_opencv(tmp_path / "c.yml", Calibration.load(saved))
    text = (tmp_path / "c.yml").read_text()
    place = text.index("data: [", text.index("R_projector_camera")) + len("data: [")
    (tmp_path / "c.yml").write_text(text[:place] + number + text[text.index(",", place) :])
    with pytest.raises(qf.ConfigError, match=r"c\.yml: R_projector_camera: expected a rotation matrix"):
        read_opencv(tmp_path / "c.yml")


def test_a_crash_of_opencv_is_an_error(saved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("quadfringe.calibration.opencv_files.DEPTH", 10**6)
    (tmp_path / "c.yml").write_text("%YAML:1.0\n---\na: " + "[ " * 100_000)
    with pytest.raises(qf.InputError, match=r"c.yml: expected an OpenCV FileStorage file; OpenCV crashes"):
        read_opencv(tmp_path / "c.yml")
    write_opencv(tmp_path / "good.yml", Calibration.load(saved))
    assert read_opencv(tmp_path / "good.yml").camera == Calibration.load(saved).camera


# Terminals


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("red \x1b[31m", "red \\x1b[31m"),
        ("title \x1b]0;x\x07", "title \\x1b]0;x\\x07"),
        ("\x9b31m", "\\x9b31m"),
        ("a\rb\x08", "a\\rb\\x08"),
        ("gpj.\u202eexe", "gpj.\\u202eexe"),
        ("\ud800", "\\ud800"),
        ("two\n\tlines, µm, 光", "two\n\tlines, µm, 光"),
    ],
)
def test_texts_of_files_command_no_terminal(text: str, shown: str) -> None:
    assert printable(text) == shown


def test_messages_and_tables_are_escaped(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "s.toml").write_text('"\\u001b[31mx" = 1\n')
    assert "\\x1b[31mx: this key is not known" in run("info", tmp_path / "s.toml").stderr
    np.savez(tmp_path / "a.npz", **{"\x1b[2J": np.array("\x1b]0;x\x07")})
    assert run("info", tmp_path / "a.npz").stdout == "\\x1b[2J: \\x1b]0;x\\x07\n"
    rows("[/b] \x1b[31m", ("figure", "value"), [("[red]a[/c]\x1b", 1.0)])
    out = capsys.readouterr().out
    assert "[/b] \\x1b[31m" in out
    assert "[red]a[/c]\\x1b" in out


@pytest.mark.parametrize("size", [(15, 64), (64, 15), (1, 1)])
@pytest.mark.parametrize("method", ["joint", "published"])
def test_small_images_are_told(size: tuple[int, int], method: str) -> None:
    shot = qf.Shot(*np.zeros((4, *size), np.uint8))
    with pytest.raises(qf.InputError, match=r"too small to decode; give at least \[16, 16\]"):
        qf.decode(shot, qf.Plan(912, decode={"method": method}))
