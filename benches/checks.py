"""Time of the checks that a decode makes in Python, besides the kernel: each of them, and all together.

    python benches/checks.py [--json FILE] [--repeats 30]

Shots of the virtual bench (1024 x 768, 8 bit) by the published method, which is the faster one: by the camera of the
bench, and by a wide one that has the borders of the light in view. The calibration has a dark level and a response, as
that of a real camera. The minimum counts: each check runs alone on warm maps, and the machine may have other work.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

import quadfringe as qf
from quadfringe.config import ChannelResponse
from quadfringe.decoding._kernel import KernelDecoder
from quadfringe.decoding.black import below_black, too_dark
from quadfringe.decoding.causes import too_bright
from quadfringe.decoding.channel_offsets import contradiction
from quadfringe.decoding.decoder import judged
from quadfringe.decoding.light_border import borders_of
from quadfringe.decoding.plausibility import geometry_of, implausible
from quadfringe.decoding.verdict import judge
from quadfringe.files import figures_text

# Focal length of each camera, px; the second sees beyond the light.
CAMERAS = {"close": 2580.0, "wide": 1120.0}
LINEAR = ChannelResponse(offset=0.02, exponent=1.0)
RESPONSE = qf.Response(red=LINEAR, green=LINEAR, blue=LINEAR, ir=LINEAR)


def minimum_ms(run: Callable[[], object], repeats: int) -> float:
    run()
    spent = []
    for _ in range(repeats):
        start = perf_counter()
        run()
        spent.append(perf_counter() - start)
    return 1e3 * min(spent)


def checks(focal_px: float) -> dict[str, Callable[[], object]]:
    """Give the decode of a shot without its checks, and each of them, by name."""
    camera = qf.Device(width_px=1024, height_px=768, focal_px=(focal_px, focal_px), centre_px=(511.5, 383.5))
    with qf.open(qf.SystemConfig(camera=camera)) as scanner:
        shot = scanner.grab()
        plan = qf.Plan(912, calibration=scanner.calibration, decode=qf.DecodeConfig(method="published"))
    decoder = qf.Decoder(shot, plan)
    kernel = KernelDecoder(shot.first.shape, None, plan)
    shape, borders = decoder.decode(shot), borders_of(decoder.decode(shot))
    dark = None if plan.calibration is None else plan.calibration.model_copy(update={"dark": (0.01,) * 4})
    return {
        "decode without checks": lambda: decoder.decode_without_verdict(shot),
        "fringe orders": lambda: judge(shape, shot, None),
        "borders of the light": lambda: borders_of(shape),
        "calibration and its rows": lambda: implausible(shape, borders),
        "calibration only": lambda: geometry_of(shape),
        "offsets of the channels": lambda: contradiction(shape, shot, plan),
        "saturation": lambda: too_bright(shot),
        "dark level": lambda: too_dark(shot, dark),
        "black of a response": lambda: below_black(shot, RESPONSE, dark),
        "all without dark level and response": lambda: judged(shape, shot, plan, kernel),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--repeats", type=int, default=30)
    options = parser.parse_args()
    figures: dict[str, float] = {}
    for camera, focal_px in CAMERAS.items():
        print(f"{camera} camera, published, minimum of {options.repeats} in ms")
        for name, run in checks(focal_px).items():
            ms = minimum_ms(run, options.repeats)
            print(f"  {name:36}{ms:8.3f}")
            figures[f"{camera}_{name.replace(' ', '_')}_ms"] = ms
    if options.json:
        options.json.write_text(figures_text(figures))


if __name__ == "__main__":
    main()
