"""Measure, record and show numbered shots until killed: `python live_writer.py FILE.h5` prints each shot written."""

from __future__ import annotations

import sys
from pathlib import Path

import quadfringe as qf
from quadfringe.data import AnyShot
from quadfringe.evaluation._live import Carousel
from quadfringe.evaluation._takes import HEIGHT_PX, WIDTH_PX, numbered_shot
from quadfringe.recording import Recorder
from quadfringe.scanner.streaming import LiveStream
from quadfringe.view.viewer import Viewer

RATE_HZ = 200.0
PORT = 8290
SYSTEM = qf.SystemConfig(
    camera=qf.Device(
        width_px=WIDTH_PX, height_px=HEIGHT_PX, focal_px=(240.0, 240.0), centre_px=(WIDTH_PX / 2, HEIGHT_PX / 2)
    ),
    decode=qf.DecodeConfig(method="published", response="linear"),
)


def main(path: Path) -> None:
    with qf.open(SYSTEM) as scanner:
        recorder = Recorder(path, scanner.config, scanner.calibration)
        plan = qf.Plan(912, calibration=scanner.calibration, decode={"method": "published"})
        shot = scanner.grab()
        shown = qf.Decoder(shot, plan).decode_without_verdict(shot)

        def record(shot: AnyShot) -> None:
            recorder.write(shot)
            print(recorder.statistics().written, flush=True)

        camera = Carousel([numbered_shot(number) for number in range(16)], RATE_HZ)
        with (
            Viewer(port=PORT, clouds_per_s=100) as viewer,
            LiveStream(camera, lambda _: shown, taps={"record": record}) as stream,  # type: ignore[arg-type]
        ):
            viewer.follow(stream, recorder.statistics)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
