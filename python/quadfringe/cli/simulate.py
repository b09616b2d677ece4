"""`quadfringe simulate`: one shot of the virtual bench as files."""

from __future__ import annotations

from typing import Annotated

import typer

from quadfringe.cli._options import Bayer, EncodingOption, FringesOption, OutFolder, SystemFile, fringes_from
from quadfringe.cli._output import say

__all__ = ["simulate"]


def simulate(
    out: OutFolder,
    system: SystemFile = None,
    surface: Annotated[
        str | None,
        typer.Option(help="Surface in front of the camera, such as face or steps; default: from the system file."),
    ] = None,
    noise: Annotated[
        float | None,
        typer.Option(
            min=0, help="Standard deviation of the sensor noise, share of full scale; default: from the system file."
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of the noise; another seed gives another noise realisation.")
    ] = None,
    bayer: Annotated[
        Bayer | None,
        typer.Option(help="Simulate a Bayer chip with these filter colours: write raw.png in place of three images."),
    ] = None,
    fringes: FringesOption = None,
    encoding: EncodingOption = None,
) -> None:
    """Render one shot of the virtual bench: write its images, calibration.json and truth.npz."""
    from quadfringe.evaluation.simulate import virtual_bench_config, write_simulation

    shown = None if fringes is None and encoding is None else fringes_from(encoding, fringes, None)
    config = virtual_bench_config(
        system, shown, surface=surface, noise=noise, seed=seed, bayer=None if bayer is None else bayer.value
    )
    for path in write_simulation(out, config):
        say(str(path))
