"""Simulate a shot as files: the images that a camera would have written, and the truth."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

from quadfringe.config import Fringes, SystemConfig, checked, load_system
from quadfringe.data import Truth
from quadfringe.data.shot_files import write_shot
from quadfringe.files import folder_for
from quadfringe.io.export import write_npz
from quadfringe.scanner import open_system

__all__ = ["virtual_bench_config", "write_simulation"]


def virtual_bench_config(system: Path | None, fringes: Fringes | None = None, **scene: Any) -> SystemConfig:
    """Return the config of a system file, or of the built-in virtual bench, with the given scene settings replaced.

    `fringes` replace those of the system.
    """
    config = SystemConfig() if system is None else load_system(system)
    given = {name: value for name, value in scene.items() if value is not None}
    found = checked(SystemConfig, config.model_dump() | {"scene": config.scene.model_dump() | given}, "scene")
    return found if fringes is None else found.model_copy(update={"fringes": fringes})


def write_simulation(folder: Path, config: SystemConfig) -> list[Path]:
    """Write the images of one shot, calibration.json and truth.npz to a folder; return their paths."""
    with open_system(config) as scanner:
        shot = scanner.grab()
    paths = list(write_shot(folder_for(folder), shot).values())
    assert scanner.calibration is not None, "the virtual bench has a calibration"
    scanner.calibration.save(folder / "calibration.json")
    paths.append(folder / "calibration.json")
    if shot.truth is not None:
        maps = {f.name: getattr(shot.truth, f.name) for f in fields(Truth)}
        write_npz(folder / "truth.npz", maps, {"config": scanner.config.model_dump_json(exclude_none=True)})
        paths.append(folder / "truth.npz")
    return paths
