"""Measure pairs of projectors that are not coaxial with the joint method, against one projector for all channels.

    python evaluation/pair.py [--half tune|report] [--method joint] [--only WORD ...] [--infrared N] [--json FILE]

The infrared projector is turned and moved against the visible one, or stands 50 mm away and is aimed at the same
place. Planes from 700 to 900 mm and scenes of quadfringe.evaluation.world are rendered at 1024 x 768 with 3 %
noise and 8 bit. Figures count pixels that both projectors light, at least 2 px from an edge. Of the pixels that one
projector alone lights, at least 2 px from an edge, the script counts those that are returned, and those of them whose
order is wrong. Tune on the half `tune`, and report the figures of the half `report`.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict
from pathlib import Path
from statistics import fmean, median

from quadfringe.evaluation import world
from quadfringe.evaluation.world.pairs import PAIRS, PairBench, judge_pair
from quadfringe.files import figures_text

HALVES = {"tune": world.TUNE, "report": world.REPORT}
SCENES: dict[str, str | float] = {
    **{f"plane_{z_mm}mm": float(z_mm) for z_mm in (700, 750, 800, 850, 900)},
    **{name: name for name in ("peaks", "steps", "face", "painted_face", "rods", "clutter")},
}
REPEATS = 7  # timed decodes
TIMED = ("peaks", "steps")  # smooth, and with shadows of both projectors


def measured(bench: PairBench, scene: str | float, seeds: tuple[int, ...], method: str) -> dict[str, float]:
    """Give the mean figures of the seeds."""
    found = []
    for seed in seeds:
        taken = bench.take(scene, seed)
        shot = taken.take.shot
        shape = bench.decoder(shot, method=method).decode_without_verdict(shot)
        found.append(asdict(judge_pair(shape, taken)))
    return {key: fmean(one[key] for one in found) for key in found[0]}


def decode_ms(bench: PairBench, scene: str, method: str) -> float:
    """Give the median time of a decode over all threads, ms: other work on the machine hardly changes it."""
    shot = bench.take(scene, 2).take.shot
    decoder = bench.decoder(shot, method=method)
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        decoder.decode_without_verdict(shot)
        times.append(1e3 * (time.process_time() - start))
    return median(times[1:])


def line(name: str, scene: str, found: dict[str, float]) -> str:
    """Give a row of the table."""
    return (
        f"{name:16}{scene:16}{found['rms_mm']:8.4f}{found['rms_ratio']:7.3f}{found['p99_mm']:8.3f}"
        f"{found['returned_percent']:8.2f}{found['wrong_percent']:9.4f}{found['inside_2_percent']:8.2f}  "
        f"{found['alone_px']:.0f} {found['alone_returned_px']:.0f} {found['alone_wrong_px']:.0f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--half", choices=HALVES, default="report")
    parser.add_argument("--method", default="joint")
    parser.add_argument("--only", nargs="+", metavar="WORD", help="scenes whose name contains one of these words")
    parser.add_argument("--infrared", type=float, metavar="N", help="infrared fringe number of all pairs but coaxial")
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    names = [name for name in SCENES if options.only is None or any(word in name for word in options.only)]
    heads = f"{'RMS mm':>8}{'ratio':>7}{'99 %':>8}{'back %':>8}{'wrong %':>9}{'in 2 %':>8}"
    print(f"{'':32}{heads}  lit by one: px back wrong")
    figures: dict[str, float] = {}
    first: dict[str, float] = {}
    for pair in PAIRS:
        bench = PairBench.named(pair, None if pair == "coaxial" else options.infrared)
        for name in names:
            found = measured(bench, SCENES[name], HALVES[options.half], options.method)
            found["rms_ratio"] = found["rms_mm"] / first.setdefault(name, found["rms_mm"])
            figures |= {f"{pair}_{name}_{key}": value for key, value in found.items()}
            print(line(pair, name, found), flush=True)
        for name in TIMED:
            ms = decode_ms(bench, name, options.method)
            ratio = ms / first.setdefault(f"{name}_ms", ms)
            figures |= {f"{pair}_{name}_ms": ms, f"{pair}_{name}_ms_ratio": ratio}
            print(f"{pair:16}decode of {name}, all threads: {ms:.0f} ms, {ratio:.3f} of coaxial", flush=True)
    if options.json:
        options.json.write_text(figures_text(figures))


if __name__ == "__main__":
    main()
