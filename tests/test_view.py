"""Saved shapes on a page, without a browser: kinds of files, series, and what clicks and controls do."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import trimesh
from support.page_clients import CLICK, VALUES, first_messages, opened, update
from support.stepped import COLUMNS, ROWS, SOUGHT, stepped_shape, towards
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.cli import app
from quadfringe.data import Shape
from quadfringe.errors import InputError
from quadfringe.recording.series import Series
from quadfringe.view._files import open_file
from quadfringe.view.measuring import Ray, Spot
from quadfringe.view.saved import SavedViewer


@pytest.fixture(scope="module")
def shape() -> Shape:
    return stepped_shape()


@pytest.fixture(scope="module")
def folder(shape: Shape, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shape in every kind of file."""
    found = tmp_path_factory.mktemp("saved")
    for name in ("a.npz", "a.ply", "a.glb", "a.obj", "a.stl"):
        shape.save(found / name)
    shape.save(found / "faces.ply", faces=True)
    return found


@pytest.fixture(scope="module")
def page(folder: Path) -> Iterator[SavedViewer]:
    with SavedViewer([folder / "a.npz", folder / "a.glb"], port=8520) as viewer:
        yield viewer


# Files


@pytest.mark.parametrize("name", ["a.npz", "a.ply", "faces.ply", "a.glb", "a.obj", "a.stl"])
def test_every_kind_of_file_gives_the_same_surface(shape: Shape, folder: Path, name: str) -> None:
    item = open_file(folder / name).item(0)
    body = item.body("texture", 1, surface=True)
    mesh = shape.mesh()
    assert len(body.faces) == len(mesh.faces)
    normals = np.cross(*(body.points_mm[body.faces[:, k]] - body.points_mm[body.faces[:, 0]] for k in (1, 2)))
    assert (normals[:, 2] < 0).all(), "seen from the camera, corners turn left"
    spot = item.spot(towards(shape, SOUGHT, (0.0, 0.0, 0.0)))
    assert spot is not None
    assert shape.xyz_mm is not None
    np.testing.assert_allclose(spot.place_mm, shape.xyz_mm[SOUGHT], atol=1e-2)
    knows = name in ("a.npz", "a.ply", "faces.ply")
    assert spot.pixel == (SOUGHT if knows else None)
    assert (spot.uncertainty_mm is not None) is knows
    assert set(item.colourings) == {"texture", "height", *(("quality", "uncertainty") if knows else ())}
    other = item.spot(towards(shape, (20, 10), (0.0, 0.0, 0.0)))
    assert other is not None
    section = item.section(spot, other, np.array([0.0, 0.0, 1.0]))
    assert np.isfinite(section.height_mm).mean() > 0.99
    assert section.unit == ("px" if name in ("a.npz", "a.ply") else "mm")


@pytest.mark.parametrize("name", ["a.npz", "a.ply", "a.glb"])
def test_colourings_differ_and_points_are_thinned(folder: Path, name: str) -> None:
    item = open_file(folder / name).item(0)
    bodies = [item.body(colouring, 2, surface=False) for colouring in item.colourings]
    assert len({body.colour.tobytes() for body in bodies}) == len(bodies)
    assert all(len(body.faces) == 0 for body in bodies)
    assert len(bodies[0].points_mm) == pytest.approx(item.count / 4, rel=0.03)


def test_colours_of_a_glb_come_back(shape: Shape, tmp_path: Path) -> None:
    colour = np.random.default_rng(3).integers(0, 256, (ROWS, COLUMNS, 3), np.uint8)
    mesh = shape.mesh(colour=colour)
    mesh.save(tmp_path / "a.glb")
    body = open_file(tmp_path / "a.glb").item(0).body("texture", 1, surface=True)
    np.testing.assert_array_equal(body.colour, mesh.colour)


def test_points_without_pixels_are_measured_and_have_no_section(tmp_path: Path) -> None:
    points = np.stack([*np.mgrid[-20:21, -20:21], np.full((41, 41), 500)], axis=2).reshape(-1, 3)
    trimesh.PointCloud(points).export(tmp_path / "a.ply")
    item = open_file(tmp_path / "a.ply").item(0)
    spot = item.spot(Ray(np.zeros(3), np.array([0.0, 0.0, 1.0])))
    assert spot == Spot((0.0, 0.0, 500.0))
    with pytest.raises(InputError, match="a section needs triangles"):
        item.section(spot, spot, np.array([0.0, 0.0, 1.0]))


WRONG = {
    "a.txt": (b"text", "expected a saved shape, .npz, .zarr, .stl, .ply, .obj, .glb"),
    "a.npz": (b"PK\x03\x04", "not a readable NPZ file"),
    "a.glb": (b"glTF\x02\x00\x00\x00", "cannot be read"),
    "a.ply": (b"ply\nformat ascii 1.0\nelement vertex 9\nend_header\n", "a.ply: "),
    "a.stl": (b"", "expected finite points, got 0 points"),
    "a.obj": (b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "expected finite points"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_files_are_named_in_one_line(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(WRONG[name][0])
    result = CliRunner().invoke(app, ["view", str(tmp_path / name)])
    assert result.exit_code == 2
    assert result.stderr.startswith(f"error: {tmp_path / name}: ")
    assert WRONG[name][1] in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_a_mesh_that_takes_too_long_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("quadfringe.io.mesh_files.TIME_S", 0.001)
    monkeypatch.setattr("quadfringe.io.mesh_files.BYTES_PER_S", 1e12)
    with pytest.raises(InputError, match="cannot be read as a mesh: it does not end within"):
        open_file(folder / "a.obj").item(0)


@pytest.mark.parametrize("name", ["a.npz", "a.zarr", "a.glb"])
def test_missing_files_are_named(tmp_path: Path, name: str) -> None:
    result = CliRunner().invoke(app, ["view", str(tmp_path / name)])
    assert (result.exit_code, len(result.stderr.splitlines())) == (2, 1)
    assert name in result.stderr


def test_rows_that_no_image_has_are_refused(tmp_path: Path) -> None:
    cloud = trimesh.PointCloud(np.zeros((2, 3)))
    cloud.vertex_attributes = {"row": np.array([0, 2**30], np.int32), "column": np.array([0, 2**30], np.int32)}
    cloud.export(tmp_path / "a.ply")
    with pytest.raises(InputError, match="expected those of an image"):
        open_file(tmp_path / "a.ply").item(0)


# The page


def click(client: Any, ray: Ray) -> None:
    change = {"ray_origin": (ray.origin / 1000).tolist(), "ray_direction": ray.direction.tolist()}
    client.send(msgspec.msgpack.encode(CLICK | change))


def until(page: SavedViewer, words: str) -> str:
    end = time.monotonic() + 60
    while words not in (content := page._panel._text.content):
        assert time.monotonic() < end, content
        time.sleep(0.05)
    return str(content)


def test_clicks_measure(page: SavedViewer, shape: Shape) -> None:
    assert shape.xyz_mm is not None
    with opened(page.url) as client:
        uuids = {m["props"]["label"]: m["uuid"] for m in first_messages(client) if "label" in m.get("props", {})}
        click(client, Ray(np.zeros(3), np.array([0.0, 0.0, -1.0])))
        until(page, "No surface there")
        click(client, towards(shape, SOUGHT, (0.0, 0.0, 0.0)))
        assert "| 20, 30 | 0.120 |" in until(page, "| A |")
        click(client, towards(shape, (20, 50), (0.0, 0.0, 0.0)))
        text = until(page, "distance")
        length = np.linalg.norm(shape.xyz_mm[20, 50] - shape.xyz_mm[SOUGHT])
        assert f"**distance {length:.3f} mm** ± " in text
        assert page._panel._plot is not None
        click(client, towards(shape, (5, 5), (0.0, 0.0, 0.0)))
        until(page, "| A | -70.")
        assert page._panel._plot is None
        client.send(update(uuids["Forget the points"], value=True))
        until(page, "Click the shape")


def test_controls_of_every_value_keep_the_page_whole(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with SavedViewer([folder / "a.npz", folder / "a.glb"], port=8530) as page, opened(page.url) as client:
        uuids = [message["uuid"] for message in first_messages(client) if {"uuid", "props"} <= message.keys()]
        assert len(uuids) >= 7
        for uuid in uuids:
            for value in (*VALUES, "2: a.glb", "uncertainty", "points"):
                client.send(update(uuid, value=value))
            client.send(msgspec.msgpack.encode(CLICK | {"ray_direction": [0.0, 0.0, 0.0]}))
        client.send(update(uuids[0], value="2: a.glb"))
        end = time.monotonic() + 60
        while not page._words.content.startswith("a.glb"):
            assert time.monotonic() < end, page._words.content
            time.sleep(0.05)
    assert capfd.readouterr() == ("", "")


@pytest.mark.filterwarnings("error")
def test_a_closed_page_draws_no_more(folder: Path) -> None:
    page = SavedViewer([folder / "a.npz"], port=8535)
    page.close()
    page._update()


def test_names_of_files_are_plain_text_on_the_page(folder: Path, tmp_path: Path) -> None:
    name = "<img src=x>[a](b)" + "x" * 100 + ".npz"
    shutil.copy(folder / "a.npz", tmp_path / name)
    with SavedViewer([tmp_path / name, folder / "a.npz"], port=8540) as page:
        assert "<" not in page._words.content
        assert "[" not in page._words.content
        assert all(len(label) <= 64 for label in page._names)


def test_wrong_choices_are_named(folder: Path) -> None:
    for settings, words in (
        ({"colouring": "red"}, "colouring: expected texture, height, quality, uncertainty, got 'red'"),
        ({"drawn": "lines"}, "drawn: expected surface, points, got 'lines'"),
    ):
        with pytest.raises(InputError, match=words):
            SavedViewer([folder / "a.npz"], port=8545, **settings)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="expected at least one file"):
        SavedViewer([], port=8545)


def test_a_shape_without_points_is_refused(tmp_path: Path, shape: Shape) -> None:
    Shape(shape.phase_rad, shape.column_px, shape.modulation, shape.quality).save(tmp_path / "phase.npz")
    with pytest.raises(InputError, match=r"phase.npz: this shape holds phase only"):
        SavedViewer([tmp_path / "phase.npz"], port=8545)


# Series


@pytest.fixture(scope="module")
def series(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a batch writes for three shots, of which the second is dark."""
    from quadfringe.recording import Recorder
    from quadfringe.recording.batch import decode_recordings

    folder = tmp_path_factory.mktemp("series")
    camera = qf.Device(width_px=160, height_px=120, focal_px=(403.0, 403.0), centre_px=(79.5, 59.5))
    decode = qf.DecodeConfig(method="published", response="linear")
    system = qf.SystemConfig(camera=camera, scene=qf.SceneConfig(surface="steps"), decode=decode)
    with qf.open(system) as scanner, Recorder(folder / "take.h5", scanner.config, scanner.calibration) as recorder:
        shot = scanner.grab()
        assert isinstance(shot, qf.Shot)
        dark = {name: np.zeros_like(image) for name, image in shot.images.items()}
        for images in (shot.images, dark, shot.images):
            recorder.write(qf.Shot(**images, stamp=qf.Stamp(recorder.statistics().written + 1, 0, "bench")))
    list(decode_recordings([folder / "take.h5"], folder, ply=False, workers=1))
    return folder / "take.zarr"


def test_a_series_gives_the_shapes_of_its_shots(series: Path) -> None:
    opened_series = Series.open(series)
    assert len(opened_series) == 3
    shape = opened_series.shape(2)
    assert shape.calibration is not None
    assert shape.config["decode"]["method"] == "published"
    columns = shape.column_px[shape.returned]
    assert 0 < columns.min() < columns.max() < shape.calibration.projector.width_px
    assert len(shape.mesh().faces) > 1000
    with pytest.raises(InputError, match="shot 1 has no shape"):
        opened_series.shape(1)
    with pytest.raises(InputError, match="expected 0 to 2"):
        opened_series.shape(3)


def test_other_stores_are_refused(series: Path, tmp_path: Path) -> None:
    import zarr

    zarr.open_group(tmp_path / "other.zarr", mode="w")
    (tmp_path / "empty.zarr").mkdir()
    for name in ("other.zarr", "empty.zarr"):
        with pytest.raises(InputError, match=f"{name}: expected the result of a batch"):
            Series.open(tmp_path / name)
    shutil.copytree(series, tmp_path / "changed.zarr")
    group = zarr.open_group(tmp_path / "changed.zarr", mode="r+")
    del group["quality"]
    group.create_array("quality", shape=(3, 5, 5), dtype="f4")
    with pytest.raises(InputError, match=r"quality: expected numbers \(3, 120, 160\)"):
        Series.open(tmp_path / "changed.zarr")


def test_the_slider_shows_shots_and_says_why_one_has_no_shape(series: Path) -> None:
    with SavedViewer([series], port=8550) as page:
        for shot, words in ((1, "shot 1 has no shape"), (2, "shot 2 (0 to 2)")):
            page._shot.value = shot
            page._update()
            assert words in page._words.content
        assert (page._shot.visible, page._shot.max) == (True, 2)
