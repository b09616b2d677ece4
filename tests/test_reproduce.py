"""The experiments of `quadfringe reproduce`: what each finds, their names, and all of them on one page."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest
from support.bars import hold
from typer.testing import CliRunner, Result

import quadfringe as qf
from quadfringe.cli import _progress, app
from quadfringe.errors import InputError
from quadfringe.evaluation import reproduce
from quadfringe.evaluation.reproduce import ALIASES, EXPERIMENTS, NAMES, Experiment, Figure, Reproduction

SMALL = qf.Device(width_px=256, height_px=192, focal_px=(645.0, 645.0), centre_px=(127.5, 95.5))
HALF = qf.Device(width_px=512, height_px=384, focal_px=(1290.3, 1290.3), centre_px=(255.5, 191.5))


def run(*words: object) -> Result:
    return CliRunner().invoke(app, ["reproduce", *map(str, words)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("reproduce")


# What the experiments find


def test_the_improved_filter_follows_three_times_the_slope(folder: Path) -> None:
    found = reproduce.slope_range(folder)
    known = {one.name: one for one in found.records}
    assert [known[f"range_{name}"].expected for name in ("traditional", "improved", "factor")] == [1 / 3, 1.0, 3.0]
    hold("range.factor", known["range_factor"].value)
    hold("range.improved", known["range_improved"].value)
    hold("range.traditional", known["range_traditional"].value)
    assert found.picture.name == "range.png"


def test_three_ways_give_one_height(folder: Path) -> None:
    figures = reproduce.geometry(folder, shrink=4).figures
    for way in ("closed_form", "polynomial", "triangulation"):
        hold("geometry.rms_mm", [figures[f"planes_{way}_rms_mm"], figures[f"peaks_{way}_rms_mm"]])
    for first in ("closed_form", "polynomial"):
        hold("geometry.rms_mm", figures[f"peaks_{first}_less_triangulation_rms_mm"])


def test_crosstalk_is_undone(folder: Path) -> None:
    found = reproduce.crosstalk(folder, (0.0, 0.15), SMALL)
    figures = found.figures
    hold("crosstalk.stray_before_percent", figures["stray_before_percent"])
    hold("calibration.stray_after_percent", figures["stray_after_percent"])
    hold("crosstalk.times_better", figures["plain_depth_rms_mm"] / figures["calibrated_depth_rms_mm"])
    assert figures["calibrated_wrong_order_percent"] == 0
    assert "WORSE" not in found.verdict


def test_steps_have_their_heights(folder: Path) -> None:
    figures = reproduce.steps(folder, HALF).figures
    hold("acceptance.step_mm", figures["steps_joint_height_error_mm"])
    hold("demo.wrong_order_percent", figures["steps_joint_wrong_order_percent"])


def test_a_mask_has_its_shape(folder: Path) -> None:
    found = reproduce.mask(folder, SMALL)
    hold("demo.returned_percent", found.figures["mask_joint_returned_percent"])
    assert (folder / "mask.png").stat().st_size > 10_000


# Names


def test_every_name_has_an_experiment_and_every_old_name_a_new_one() -> None:
    assert tuple(EXPERIMENTS) == NAMES
    assert not set(ALIASES) & set(NAMES)
    for old, new in ALIASES.items():
        assert reproduce.named(old) is EXPERIMENTS[new]
    with pytest.raises(InputError, match=r"identity, deviated-pair, tolerance, .*depth, all; got 'everything'"):
        reproduce.named("everything")
    refused = run("everything")
    assert refused.exit_code == 2
    assert "expected one of identity" in refused.stderr


# All of them


def planted(name: str, error: Exception | None = None) -> Experiment:
    """Give an experiment that writes a picture, or raises the error."""

    def compute(out: Path) -> Reproduction:
        if error is not None:
            raise error
        (out / f"{name}.png").write_bytes(b"\x89PNG of " + name.encode())
        records = (
            Figure(f"{name}_mm", f"{name} <b>", 2.0, "mm", published=3.0),
            Figure(f"{name}_far_mm", "search", 100.0, "mm", at_least=True),
        )
        return Reproduction(records, (out / f"{name}.png", out / f"{name}.mp4"), f"{name} is right")

    return Experiment(name, f"about {name}", compute, 1.0)


@pytest.fixture
def three(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in NAMES:
        monkeypatch.delitem(EXPERIMENTS, name)
    monkeypatch.setitem(EXPERIMENTS, "identity", planted("identity"))
    monkeypatch.setitem(EXPERIMENTS, "tolerance", planted("tolerance", InputError("no light")))
    monkeypatch.setitem(EXPERIMENTS, "depth", planted("depth"))


@pytest.mark.usefixtures("three")
def test_one_that_fails_does_not_stop_the_others(tmp_path: Path) -> None:
    done = run("all", "--out", tmp_path, "--json", "-")
    assert done.exit_code == 1
    assert "error: tolerance: InputError: no light" in done.stderr
    record = json.loads(done.stdout)
    assert record == json.loads((tmp_path / "reproduce.json").read_text())
    assert record["figures"] == {f"{n}_{k}": v for n in ("identity", "depth") for k, v in (("mm", 2), ("far_mm", 100))}
    assert [one["error"] for one in record["experiments"]] == [None, "InputError: no light", None]
    page = (tmp_path / "reproduce.html").read_text()
    for words in ("1 of 3 experiments failed: tolerance (InputError: no light)", "Depth is right.", "at least 100"):
        assert words in page
    assert "identity &lt;b&gt;" in page
    assert page.count('src="data:image/png;base64,') == page.count("src=") == 2
    assert "depth.mp4" in page
    # Without a terminal each experiment has a line, with the time to go once the speed is known.
    lines = [line for line in done.stderr.splitlines() if line.startswith("reproduce: ")]
    assert [line.split(", ")[1] for line in lines] == ["identity", "tolerance", "depth"]
    assert all("to go" in line for line in lines)


@pytest.mark.usefixtures("three")
def test_an_old_name_runs_the_experiment(tmp_path: Path) -> None:
    done = run("pair-depth", "--out", tmp_path, "--json", tmp_path / "figures.json")
    assert done.exit_code == 0, done.output
    assert json.loads((tmp_path / "figures.json").read_text()) == {"figures": {"depth_mm": 2.0, "depth_far_mm": 100.0}}
    assert "at least 100" in done.stdout
    assert "published" in done.stdout


def test_a_fault_of_the_program_ends_the_run(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="wrong call"):
        reproduce.run_all(tmp_path, experiments=[planted("identity", TypeError("wrong call"))])


# Progress without a terminal


def test_long_commands_say_how_far_they_are(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = [0.0]
    monkeypatch.setattr(_progress, "monotonic", lambda: now[0])
    with _progress.meter("work", 100, 400.0) as shown:
        for _ in range(25):
            shown.begin("part <\x1b>")
            now[0] += 1
            shown.advance(4)
    assert capsys.readouterr().err.splitlines() == [
        r"work: 20%, part <\x1b>, about 20 s to go",
        r"work: 60%, part <\x1b>, about 10 s to go",
        r"work: 100%, part <\x1b>, about 0 s to go",
    ]
    with _progress.meter("work", 2, 90.0, each=True) as shown:
        shown.begin("first")
    assert capsys.readouterr().err == "work: 0%, first, about 1 min 30 s to go\n"


def test_one_long_experiment_says_its_time(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(_progress, "EVERY_S", 0.01)
    with _progress.clock("hand", 110.0):
        time.sleep(0.1)
    said = capsys.readouterr().err.splitlines()
    assert said[:2] == ["hand: about 1 min 50 s on two cores", "hand: 0 s of about 1 min 50 s"]
