"""`pattern`, `simulate`, `measure`: the fringes, a simulated shot of them, and the whole way at once."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli.output import Bayer, Fringes3, PredeformedOption, say

__all__ = ["measure", "pattern", "simulate"]

OutFolder = Annotated[Path, typer.Option(metavar="DIR", help="Folder for the files; made when missing.")]
SystemFile = Annotated[Path | None, typer.Argument(metavar="[SYSTEM.toml]", help="Default: the virtual bench.")]


class Layout(StrEnum):
    """How the mirrors of the projector are arranged."""

    regular = "regular"
    diamond = "diamond"


def pattern(
    out: OutFolder,
    fringes: Fringes3 = (36.0, 35.0, 30.0),
    width: Annotated[int, typer.Option(min=2, help="Columns of the projector.")] = 912,
    height: Annotated[int, typer.Option(min=1, help="Rows of the projector.")] = 1140,
    layout: Annotated[Layout, typer.Option(help="Mirror layout.")] = Layout.regular,
    calibration: Annotated[Path | None, typer.Option(metavar="FILE", help="Both projectors calibrated, JSON.")] = None,
    predeformed_z_mm: PredeformedOption = None,
) -> None:
    """Write the two images to project: visible.png (red, green, blue) and infrared.png, 8 bit.

    With --calibration and --predeformed-z-mm the infrared image makes up for an infrared projector that does not stand
    where the visible one does: exact on the plane at that depth.
    """
    from quadfringe.config import Fringes
    from quadfringe.data import Calibration
    from quadfringe.devices.light import predeformation
    from quadfringe.devices.patterns import write_patterns
    from quadfringe.errors import InputError

    if calibration is not None and predeformed_z_mm is None:
        raise InputError("--calibration changes nothing without --predeformed-z-mm, the depth of the reference plane")
    known = None if calibration is None else Calibration.load(calibration)
    asked = Fringes(numbers=fringes, layout=layout.value, predeformed_z_mm=predeformed_z_mm)
    for path in write_patterns(out, asked.numbers, (width, height), layout.value, predeformation(asked, known)):
        say(str(path))


def simulate(
    out: OutFolder,
    system: SystemFile = None,
    surface: Annotated[str | None, typer.Option(help="What stands on the bench, in place of the file's.")] = None,
    noise: Annotated[float | None, typer.Option(min=0, help="Noise, fraction of full scale.")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the noise.")] = None,
    bayer: Annotated[Bayer | None, typer.Option(help="A Bayer chip: raw.png in place of three images.")] = None,
) -> None:
    """Render one shot of the virtual bench: its images, calibration.json, truth.npz."""
    from quadfringe.evaluation.simulate import bench_config, write_simulation

    config = bench_config(system, surface=surface, noise=noise, seed=seed, bayer=None if bayer is None else bayer.value)
    for path in write_simulation(out, config):
        say(str(path))


def measure(
    out: Annotated[
        list[Path],
        typer.Option(metavar="FILE", help="Result: .ply, .tif or .npz; may be repeated."),
    ],
    system: SystemFile = None,
) -> None:
    """Take one shot with a system and save its shape."""
    from quadfringe.data.shape import SUFFIXES
    from quadfringe.files import require_suffix
    from quadfringe.scanner import open_system

    for path in out:
        require_suffix(path, SUFFIXES)
    with open_system(system) as scanner:
        shape = scanner.measure()
    for path in out:
        shape.save(path)
        say(f"{path}: {int(shape.returned.sum())} points")
