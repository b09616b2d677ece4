"""The report of a shape: one file without network, complete, and deaf to markup in the texts of a file."""

from __future__ import annotations

import base64
import json
import re
import sys
import zlib
from dataclasses import replace
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.bars import hold
from typer.testing import CliRunner, Result

import quadfringe as qf
from quadfringe.cli import app
from quadfringe.data import Calibration, CalibrationRecord, CalibrationStep, Reason
from quadfringe.errors import InputError, MissingExtraError
from quadfringe.view import style
from quadfringe.view.page import page_of, write_page
from quadfringe.view.page._params import VERTICES_MAX
from quadfringe.view.report import Graph, Panel, draw_panels

EVIL = '</script></table><script>document.title="taken"</script><img src=x onerror="alert(1)">\x00\u202e\'"&'
FETCHING = {"src", "href", "srcset", "data", "action", "poster", "background"}


class Parsed(HTMLParser):
    """The tags of a page with their attributes, and the text of its elements by name."""

    def __init__(self, page: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, list[str]] = {}
        self._open = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self._open = tag
        self.texts.setdefault(tag, []).append("")

    def handle_endtag(self, _tag: str) -> None:
        self._open = ""

    def handle_data(self, data: str) -> None:
        if self._open:
            self.texts[self._open][-1] += data

    @property
    def programs(self) -> list[str]:
        kinds = [attributes.get("type") for tag, attributes in self.tags if tag == "script"]
        return [text for kind, text in zip(kinds, self.texts["script"], strict=True) if kind is None]

    def element(self, name: str) -> str:
        (place,) = [i for i, (tag, a) in enumerate(t for t in self.tags if t[0] == "script") if a.get("id") == name]
        return self.texts["script"][place]


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def shape(bench: tuple[qf.Shot, Calibration]) -> qf.Shape:
    shot, calibration = bench
    found = qf.decode(shot, qf.Plan(912, calibration=calibration))
    reason = np.where(found.returned, Reason.RETURNED, Reason.SHADOW).astype(np.uint8)
    reason[:40][~found.returned[:40]] = Reason.MISFIT
    return replace(found, reason=reason)


@pytest.fixture(scope="module")
def page(shape: qf.Shape) -> str:
    return page_of(shape, "face.npz")


def test_the_page_is_one_file_that_fetches_nothing(page: str) -> None:
    parsed = Parsed(page)
    fetched = [value for _, attributes in parsed.tags for name, value in attributes.items() if name in FETCHING]
    assert len(fetched) == 8
    assert all(value is not None and value.startswith("data:image/png;base64,") for value in fetched)
    assert {tag for tag, _ in parsed.tags} & {"link", "iframe", "object", "base"} == set()
    words = " ".join([*parsed.programs, *parsed.texts["style"]])
    assert re.findall(r"https?:|url\(|@import|fetch\(|XMLHttpRequest|\bimport\b", words) == []


def test_the_policy_of_the_page_names_its_program_and_style(page: str) -> None:
    parsed = Parsed(page)
    (policy,) = [a["content"] or "" for tag, a in parsed.tags if tag == "meta" and "http-equiv" in a]
    for kind, text in (("script-src", parsed.programs[0]), ("style-src", parsed.texts["style"][0])):
        digest = base64.b64encode(sha256(text.encode()).digest()).decode()
        assert f"{kind} 'sha256-{digest}'" in policy
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy


def test_texts_of_files_are_shown_and_not_obeyed(shape: qf.Shape) -> None:
    assert shape.calibration is not None
    step = CalibrationStep(name="levels", good=False, verdict=EVIL)
    record = CalibrationRecord(made_utc=EVIL, quadfringe_version=EVIL, rig=EVIL, steps=(step,))
    settings = {EVIL: EVIL, "warnings": [EVIL], "decode": {"method": EVIL, "method_version": [EVIL]}}
    settings |= {
        "quadfringe_version": EVIL,
        "fringes": {EVIL: [EVIL]},
        "response_from": EVIL,
        "response": {"red": EVIL},
    }
    hostile = replace(shape, config=settings, calibration=shape.calibration.model_copy(update={"record": record}))
    sound, taken = Parsed(page_of(shape, "face")), Parsed(page_of(hostile, EVIL))
    assert taken.programs == sound.programs
    for tag in ("script", "img", "style", "section", "meta"):
        assert len(taken.texts[tag]) == len(sound.texts[tag])
    assert [name for _, attributes in taken.tags for name in attributes if name.startswith("on")] == []
    assert "document.title" in taken.texts["h1"][0]
    assert "\x00" not in taken.texts["h1"][0]


def test_a_name_with_half_a_letter_can_be_written(shape: qf.Shape, tmp_path: Path) -> None:
    write_page(tmp_path / "r.html", shape, "a\udcff.npz")
    assert "a\\udcff.npz" in (tmp_path / "r.html").read_text(encoding="utf-8")


def test_every_missing_pixel_has_a_reason_in_the_table(page: str, shape: qf.Shape) -> None:
    rows = {name: float(share) for name, share in re.findall(r">([^<>]+)</td><td class=\"number\">([\d.]+) %", page)}
    reasons = shape.reasons()
    listed = {name: share for name, share in rows.items() if name.startswith("missing: ")}
    assert listed == {f"missing: {one.words}": round(reasons[one], 2) for one in (Reason.SHADOW, Reason.MISFIT)}
    hold("report.shares_percent", abs(rows["returned"] + sum(listed.values()) - 100))
    assert sum(name.startswith("of these doubtful: ") for name in rows) == 2


def test_the_surface_of_the_page_is_the_mesh(page: str, shape: qf.Shape) -> None:
    parsed = Parsed(page)
    facts = json.loads(parsed.element("facts"))
    data = zlib.decompress(base64.b64decode(parsed.element("data")))
    step = int(np.ceil(np.sqrt(np.isfinite(shape.depth_mm).sum() / VERTICES_MAX)))
    mesh, n = shape.mesh(step=step), facts["vertices"]
    assert (n, facts["faces"]) == (len(mesh.vertices_mm), len(mesh.faces))
    places = np.cumsum(np.frombuffer(data, "<u2", 3 * n).reshape(3, n), axis=1, dtype=np.uint16).T
    points = np.array(facts["low"]) + np.array(facts["scale"]) * places
    hold("report.rounding_mm", np.abs(points * (1, -1, -1) - mesh.vertices_mm).max())
    corners = np.cumsum(np.frombuffer(data[-12 * len(mesh.faces) :], "<i4"), dtype=np.int32)
    np.testing.assert_array_equal(corners.reshape(-1, 3), mesh.faces)
    colour = np.frombuffer(data, np.uint8, 3 * n, offset=9 * n).reshape(3, n)
    np.testing.assert_array_equal(np.cumsum(colour, axis=1, dtype=np.uint8).T, mesh.colour)


def test_a_shape_without_points_has_a_page_without_surface(shape: qf.Shape) -> None:
    bare = replace(shape, xyz_mm=None, uncertainty_mm=None, albedo=None, calibration=None, reason=None)
    words = page_of(bare, "phase.npz")
    assert 'id="stage"' not in words
    assert "the file does not say why pixels are missing" in words
    assert "the shape has phases and no points" in words


def test_a_shape_without_any_data_has_a_page() -> None:
    nothing = np.full((20, 30), np.nan, np.float32)
    points = np.full((20, 30, 3), np.nan, np.float32)
    reason = np.full((20, 30), 200, np.uint8)  # of a later version
    empty = qf.Shape(nothing, nothing, nothing, nothing, xyz_mm=points, uncertainty_mm=nothing, reason=reason)
    words = page_of(empty, "empty.npz")
    assert "0.0 %" in words
    assert 'id="stage"' not in words


def test_the_command_writes_the_page(shape: qf.Shape, tmp_path: Path) -> None:
    shape.save(tmp_path / "face.npz")
    done = run("report", tmp_path / "face.npz", "--out", tmp_path / "r.html")
    assert done.exit_code == 0, done.output
    assert "<title>face.npz</title>" in (tmp_path / "r.html").read_text()
    for arguments, words in (
        (["--out", tmp_path / "r.pdf"], ".html"),
        (["--shot", 1, "--out", tmp_path / "s.html"], "--shot is for recordings"),
    ):
        refused = run("report", tmp_path / "face.npz", *arguments)
        assert (refused.exit_code, words in refused.stderr) == (2, True)
    folder = run("report", tmp_path, "--out", tmp_path / "f.html")
    assert (folder.exit_code, "quadfringe decode" in folder.stderr) == (2, True)


def test_a_shot_of_a_recording_is_decoded(small_bench: Path, tmp_path: Path) -> None:
    take = tmp_path / "take.h5"
    assert run("record", small_bench / "system.toml", "--shots", 2, "--out", take).exit_code == 0
    done = run("report", take, "--shot", 1, "--out", tmp_path / "r.html")
    assert done.exit_code == 0, done.output
    assert 'id="stage"' in (tmp_path / "r.html").read_text()
    beyond = run("report", take, "--shot", 2, "--out", tmp_path / "s.html")
    assert (beyond.exit_code, "has 2 shots" in beyond.stderr) == (2, True)


def test_decode_writes_the_same_page(small_bench: Path, tmp_path: Path) -> None:
    words = ["decode", small_bench, "--fringes", 36, 35, 30, "--projector-width", 912, "--method", "published"]
    words += ["--calibration", small_bench / "calibration.json", "--out", tmp_path / "x.npz", "--report"]
    assert run(*words, tmp_path / "x.html").exit_code == 0
    assert run("report", tmp_path / "x.npz", "--out", tmp_path / "y.html").exit_code == 0
    assert (tmp_path / "x.html").read_bytes() == (tmp_path / "y.html").read_bytes()
    refused = run(*words, tmp_path / "x.png")
    assert (refused.exit_code, ".html" in refused.stderr) == (2, True)


def test_what_is_missing_is_named(shape: qf.Shape, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match=r"\.html"):
        write_page(tmp_path / "r.txt", shape, "face")
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtraError, match=r"quadfringe\[plot\]"):
        write_page(tmp_path / "r.html", shape, "face")
    assert list(tmp_path.iterdir()) == []


# The look of pictures


def test_missing_data_are_told_from_every_value_of_a_map() -> None:
    from matplotlib import colormaps
    from matplotlib.colors import to_rgb

    def lab(colours: object) -> np.ndarray:
        return cv2.cvtColor(np.asarray(colours, np.float32).reshape(1, -1, 3), cv2.COLOR_RGB2LAB)[0]

    for name in (*style.MAPS, "gray"):
        values = lab(colormaps[name](np.arange(256))[:, :3])
        apart = np.linalg.norm(values - lab(to_rgb(style.no_data_of(name))), axis=1).min()
        hold("pictures.no_data_apart", apart)
    middle = np.array(colormaps[style.DIVERGING](0.5)[:3])
    assert middle.min() > 0.95  # zero is white


def test_panels_have_letters_units_and_a_name_for_missing_data(tmp_path: Path) -> None:
    from matplotlib.figure import Figure

    image = np.array([[0.0, np.nan], [9.0, -1.0]])
    axes = Figure().add_subplot()
    panel = Panel("depth, $x$", image, "mm", limits=(0.0, 1.0))
    panel.draw(axes.figure, axes, style.lettered(1, panel.title))
    assert axes.get_title(loc="left") == "(b) depth, $x$"
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("column, px", "row, px")
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["no data"]
    (place,) = axes.child_axes
    assert place.get_ylabel() == "mm"
    line = {"a": (np.arange(3), np.arange(3))}
    draw_panels(tmp_path / "two.png", "title $", [[panel, Graph("curve", "x, mm", "y, mm", line)]])
    assert cv2.imread(str(tmp_path / "two.png")).shape[1] > 600


def test_limits_about_zero_hold_the_values() -> None:
    assert style.symmetric(np.array([np.nan, -3.0]), np.array([1.0])) == (-3.0, 3.0)
    assert style.symmetric(np.array([np.nan]), least=0.5) == (-0.5, 0.5)
