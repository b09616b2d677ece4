"""Records and settings of the public API: they check themselves, and repr and help can be read."""

from __future__ import annotations

import dataclasses
import inspect
import pydoc
import re
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from pydantic import BaseModel

import quadfringe as qf
from quadfringe import _core, config, data, devices, recording, scanner
from quadfringe.config import Surface

MODELS = sorted(
    {m for m in vars(config).values() if inspect.isclass(m) and issubclass(m, BaseModel)}
    | {qf.Calibration, qf.ResponseCalibration},
    key=lambda model: model.__name__,
)
LINE = 120


# Records


def records() -> dict[str, Any]:
    """One filled record of each kind, by name."""
    with qf.open(qf.SystemConfig(scene={"bayer": "rggb"})) as bayer:
        mosaic = bayer.grab()
    with qf.open() as bench, bench.stream(1) as stream:
        measured = next(stream)
        statistics = stream.statistics()
        calibration, system = bench.calibration, bench.config
    assert measured.shot.truth is not None
    shape = measured.result()
    compared = qf.compare(shape, measured.shot.truth, causes=False)
    crosstalk = tuple(tuple(float(a == b) for b in range(4)) for a in range(4))
    found = [
        measured.shot,
        mosaic,
        measured.shot.truth,
        qf.Stamp(1, 2, "bench", {name: data.FrameStamp(1, 2, 3) for name in ("visible", "infrared")}),
        data.ChipImage(np.zeros((4, 6), np.uint16), "Mono12", 4095.0, None, qf.Stamp(1, 2, "bench")),
        shape,
        shape.config,
        measured,
        statistics,
        calibration,
        system,
        qf.SceneConfig(
            crosstalk=crosstalk, albedo=0.5, height_map={"file": "a" * 200, "pitch_mm": (1, 1), "origin_mm": (0, 0)}
        ),
        qf.Response(red={"exponent": 0.5}),
        qf.ResponseCalibration(steps=12, inputs=tuple(f"image_{i}.bmp" for i in range(48))),
        config.AravisConfig(
            device="AD-080GE", visible={"pixel_format": "BayerRG12"}, features={f"Feature{i}": i for i in range(40)}
        ),
        qf.Plan(912, calibration=calibration, response=qf.Response(red={"exponent": 0.5})),
        shape.mesh(),
        shape.normals(),
        compared,
        *(compared.profiles[name] for name in ("fringe phase", "surface angle")),
        devices.CameraStatistics(1, 2, {name: devices.ChipStatistics(1) for name in ("visible", "infrared")}),
        recording.RecorderStatistics(1, 2, 3, (Path("a.h5"),), None),
        recording.Verification(4, (1,), ("cut short",)),
        recording.Recovered(*range(len(dataclasses.fields(recording.Recovered)))),
    ]
    return {
        f"{number} {type(record).__name__}": record for number, record in enumerate(found) if record is not shape.config
    }


def kinds_of(record: Any) -> tuple[type, ...]:
    """Classes of a record: that of the virtual bench is derived from `Truth`."""
    return type(record).__mro__[:-1]


def test_the_repr_of_every_record_fits_three_lines() -> None:
    for name, record in records().items():
        words = repr(record)
        assert sum(-(-len(line) // LINE) for line in words.splitlines()) <= 3, f"{name}: {words}"
        assert any(kind.__name__ in words for kind in kinds_of(record))


def test_every_record_is_among_them() -> None:
    tested = {kind for record in records().values() for kind in kinds_of(record)}
    for module in (data, devices, recording, scanner):
        for name in module.__all__:
            kind = getattr(module, name)
            if dataclasses.is_dataclass(kind) and kind is not devices.Devices:
                assert kind in tested or kind in {data.FrameStamp, devices.ChipStatistics}, name


GREY = np.zeros((6, 8), np.uint8)


@pytest.mark.parametrize(
    ("images", "reason"),
    [
        ((GREY, None, GREY, GREY), "green: expected one grey image .* got None"),
        ((GREY, GREY, GREY, [[1, 2]]), "ir: expected one grey image .* got list"),
        ((GREY, GREY, GREY, GREY[1:]), "expected one size .* ir 8 x 5"),
        ((GREY, GREY, GREY, GREY.astype(np.uint16)), "expected one type .* ir uint16"),
        ((GREY.astype(float),) * 4, "red: .* got float64"),
        ((np.zeros((6, 8, 3), np.uint8),) * 4, r"red: .* shape \(6, 8, 3\); give each plane"),
    ],
)
def test_a_shot_checks_its_images(images: tuple[Any, ...], reason: str) -> None:
    with pytest.raises(qf.InputError, match=reason):
        qf.Shot(*images)
    if images[3] is not images[0]:
        with pytest.raises(qf.InputError, match=reason.replace(", blue", "")):
            qf.BayerShot(images[0], "rggb", images[3])


@pytest.mark.parametrize("full_scale", [0, -1.0, float("nan")])
def test_a_shot_checks_its_full_scale(full_scale: float) -> None:
    with pytest.raises(qf.InputError, match="full_scale: expected a positive number"):
        qf.Shot(GREY, GREY, GREY, GREY, full_scale)


def test_a_shape_checks_its_maps() -> None:
    flat = np.zeros((6, 8), np.float32)
    with pytest.raises(qf.InputError, match=r"expected one size .* quality 8 x 5"):
        qf.Shape(flat, flat, flat, flat[1:])
    with pytest.raises(qf.InputError, match=r"xyz_mm: expected an array \(H, W, 3\), got an array of shape \(6, 8\)"):
        qf.Shape(flat, flat, flat, flat, xyz_mm=flat)
    with pytest.raises(qf.InputError, match=r"modulation: expected an array .* got NoneType"):
        qf.Shape(flat, flat, None, flat)  # type: ignore[arg-type]
    shape = qf.Shape(flat, flat, flat, flat)
    assert (shape.depth_mm, shape.xyz_mm) == (None, None)


# Settings


def test_a_wrong_argument_says_the_same_as_a_wrong_key(tmp_path: Path) -> None:
    path = tmp_path / "system.toml"
    path.write_text('[decode]\nmethd = "x"\nthreads = 0\n[scene]\nsurface = "cow"\n')
    with pytest.raises(qf.ConfigError) as from_file:
        qf.open(path)
    with pytest.raises(qf.ConfigError) as from_python:
        qf.SystemConfig(decode={"methd": "x", "threads": 0}, scene={"surface": "cow"})
    lines = str(from_file.value).splitlines()[1:]
    assert str(from_python.value).splitlines()[1:] == lines
    assert (
        lines[0].strip() == "scene.surface: expected 'plane', 'peaks', 'steps', 'sphere', 'face' or 'hand', got 'cow'"
    )
    assert "  decode.methd: this key is not known; did you mean method?" in lines
    assert len(lines) == 3
    with pytest.raises(
        qf.ConfigError, match="DecodeConfig: 1 problem\n  methd: this key is not known; did you mean method"
    ):
        qf.DecodeConfig(methd="x")  # type: ignore[call-arg]
    with pytest.raises(qf.ConfigError, match="noise: this key is not known; it belongs to scene"):
        qf.SystemConfig(noise=0.1)  # type: ignore[call-arg]


def test_surfaces_are_those_of_the_kernel() -> None:
    with pytest.raises(ValueError, match="cow") as caught:
        _core.Bench().cast("cow")
    for name in get_args(Surface):
        assert name in str(caught.value)
        _core.Bench(camera=_core.Device(16, 12, (40.0, 40.0), (7.5, 5.5))).cast(name)
    listed = str(caught.value).split("expected", 1)[1].split("got")[0]
    assert len(re.findall(r"\w+", listed.replace("one of", "").replace(" or ", " "))) == len(get_args(Surface)), listed


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
def test_help_describes_every_field(model: type[BaseModel]) -> None:
    shown = pydoc.plain(pydoc.render_doc(model))
    for name, field in model.model_fields.items():
        assert field.description, f"{model.__name__}.{name}"
        assert f"{name}: {field.description.split()[0]}" in shown
    assert "Annotated" not in shown.split("Method resolution order")[0]


def test_an_older_name_of_the_method_is_read() -> None:
    assert qf.DecodeConfig(method="best") == qf.DecodeConfig(method="joint")
    assert qf.DecodeConfig.model_validate({"method": "best"}).method == "joint"
