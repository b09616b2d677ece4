"""A moving hand as a film: a recording, a PLY file of every instant, a movie, and a sheet of its pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from quadfringe.config import SystemConfig
from quadfringe.errors import require
from quadfringe.evaluation.moving_scene import RATE_HZ, SHOTS, HandFilm, film_hand
from quadfringe.evaluation.reproduction import Figure, Reproduction
from quadfringe.files import atomic
from quadfringe.view.colours import Picture
from quadfringe.view.report import Graph, Panel, draw_panels

__all__ = ["hand"]

STILLS = 6  # pictures on the sheet
ANIMATION_PX = (640, 240)  # width and height of the animation, which a browser plays


def hand(out: Path, shots: int = SHOTS, system: SystemConfig | None = None) -> Reproduction:
    """Measure the moving hand; write `out`/hand.h5, `out`/hand/shot_000000.ply and so on, and `out`/hand.mp4.

    The virtual bench renders the frames, and two emulated chips send them over GigE Vision on the loopback interface.
    Without the extra `aravis`, they are replayed from a file, and `hand_over_gige_vision` is 0. Writes also
    `out`/hand.png, a sheet of six instants, and `out`/hand.webp, the movie for a browser. Figures: numbers of shots,
    shapes and lost exposures, depth RMS of a shot in mm (median) and wrong orders in per cent (worst).
    """
    film = film_hand(out, shots, system)
    frames = _frames(film.made.movie)
    sheet, animation = out / "hand.png", out / "hand.webp"
    _draw(sheet, film, frames)
    _animate(animation, frames)
    records = tuple(_figures(film))
    lost = "no exposure lost" if not film.made.lost else f"{film.made.lost} exposures LOST"
    way = "over GigE Vision" if film.over_wire else "replayed from a file"
    verdict = f"{film.made.shapes} shapes of {film.made.shots} shots, {way}, {lost}"
    return Reproduction(records, (sheet, film.made.movie, animation), verdict)


def _figures(film: HandFilm) -> list[Figure]:
    made = film.made
    figures = [
        Figure(
            "hand_over_gige_vision", "frames came over GigE Vision (1) or from a file (0)", float(film.over_wire), "1"
        ),
        Figure("hand_shots", "shots", float(made.shots), "shots"),
        Figure("hand_shapes", "shapes", float(made.shapes), "shots"),
        Figure("hand_lost", "exposures lost", float(made.lost), "shots", expected=0.0),
        Figure(
            "hand_shots_with_wrong_pixels",
            "shots with a pixel changed on the way",
            float(made.shapes - len(made.depth_rms_mm)),
            "shots",
            expected=0.0,
        ),
    ]
    if made.depth_rms_mm:
        median_mm, worst = float(np.median(made.depth_rms_mm)), max(made.wrong_order_percent)
        figures.append(Figure("hand_depth_rms_mm_median", "depth of a shot, median", median_mm, "mm RMS"))
        figures.append(Figure("hand_depth_rms_mm_worst", "depth of a shot, worst", max(made.depth_rms_mm), "mm RMS"))
        figures.append(Figure("hand_wrong_order_percent_worst", "wrong orders of a shot, worst", worst, "%"))
    return figures


def _frames(movie: Path) -> list[Picture]:
    """Read the pictures of the movie, each (H, W, 3) in R, G, B order."""
    reader = cv2.VideoCapture(str(movie))
    frames: list[Picture] = []
    while True:
        got, frame = reader.read()
        if not got:
            return frames
        frames.append(np.ascontiguousarray(frame[:, :, ::-1]).astype(np.uint8))


def _draw(path: Path, film: HandFilm, frames: list[Picture]) -> None:
    chosen = sorted({round(i) for i in np.linspace(0, len(frames) - 1, min(STILLS, len(frames))).tolist()})
    stills = [Panel(f"{i / RATE_HZ:.1f} s: camera, shape", frames[i], bare=True) for i in chosen]
    times_s = np.arange(len(film.made.depth_rms_mm)) / RATE_HZ
    depth = {"": (times_s, np.array(film.made.depth_rms_mm))}
    wrong = {"": (times_s, np.array(film.made.wrong_order_percent))}
    rows: list[Sequence[Panel | Graph]] = [
        *(stills[i : i + 2] for i in range(0, len(stills), 2)),
        [
            Graph("depth error of every shot", "time, s", "mm RMS", depth),
            Graph("wrong fringe orders of every shot", "time, s", "%", wrong),
        ],
    ]
    draw_panels(path, "a moving hand, one shape for each exposure", rows)


def _animate(path: Path, frames: list[Picture]) -> None:
    """Write the movie as an animated WebP, which browsers show without a player; needs matplotlib's Pillow."""
    image = require("PIL.Image", "plot")
    small = [image.fromarray(cv2.resize(frame, ANIMATION_PX, interpolation=cv2.INTER_AREA)) for frame in frames]
    if small:
        with atomic(path) as temporary:
            small[0].save(
                temporary,
                format="webp",
                save_all=True,
                append_images=small[1:],
                duration=round(1e3 / RATE_HZ),
                loop=0,
                quality=60,
            )
