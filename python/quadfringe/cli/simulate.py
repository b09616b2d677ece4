"""`quadfringe simulate`: one shot of the virtual bench as files."""

from __future__ import annotations

from typing import Annotated

import typer

from quadfringe.cli._output import Bayer, OutFolder, SystemFile, say

__all__ = ["simulate"]


def simulate(
    out: OutFolder,
    system: SystemFile = None,
    surface: Annotated[str | None, typer.Option(help="What stands on the bench, in place of the file's.")] = None,
    noise: Annotated[float | None, typer.Option(min=0, help="Noise, fraction of full scale.")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the noise.")] = None,
    bayer: Annotated[Bayer | None, typer.Option(help="A Bayer chip: raw.png in place of three images.")] = None,
) -> None:
    """Render one shot of the virtual bench: its images, calibration.json, truth.npz."""
    from quadfringe.evaluation.simulate import virtual_bench_config, write_simulation

    config = virtual_bench_config(
        system, surface=surface, noise=noise, seed=seed, bayer=None if bayer is None else bayer.value
    )
    for path in write_simulation(out, config):
        say(str(path))
