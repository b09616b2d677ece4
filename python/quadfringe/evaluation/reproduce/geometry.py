"""Height by three ways from the same phase: the closed form (S5), a polynomial per pixel (S6), triangulation (S7)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.calibration.height import HeightCalibration, fit_heights
from quadfringe.config import Device, Fringes
from quadfringe.data import Calibration, Shape, Shot, core_device, xyz_mm_of
from quadfringe.decoding import Decoder, Plan
from quadfringe.decoding.compare import rms
from quadfringe.evaluation.reproduction import Figure, Reproduction
from quadfringe.view.report import Graph, Panel, draw_panels
from quadfringe.view.style import DIVERGING, symmetric

__all__ = ["crossed_axes_mm", "geometry"]

Map = NDArray[np.float32]
WIDTH_PX, HEIGHT_PX = 640, 480
DISTANCE_MM, BASELINE_MM = 800.0, 300.0  # L0 and d
FIELD_MM = 220.0  # width of the field of view
FIELD_LIT_MM = 300.0  # width that the projector lights on the plane normal to its axis
NOISE, SEED = 0.01, 5
PLANES_MM = (-40.0, -20.0, 0.0, 20.0, 40.0)  # heights that the polynomials are fitted to
BETWEEN_MM = (-30.0, -10.0, 10.0, 30.0)  # heights that they have not seen
DEGREE = 3
PEAKS_SCALE_MM = 3.0
WAYS = {"closed_form": "closed form (S5)", "polynomial": "polynomial (S6)", "triangulation": "triangulation (S7)"}
Heights = dict[str, Map]


def geometry(out: Path, shrink: int = 1) -> Reproduction:
    """Measure planes and the peaks surface by the closed form, by polynomials and by triangulation, on the same shots.

    The bench meets the conditions of the closed form: the camera looks straight down from L0 = 800 mm, the
    projector of the same height stands d = 300 mm to its side, and their axes cross on the reference plane. The
    polynomials of degree 3 are fitted to five planes and judged between them; noise is 1 %. The camera has
    1/`shrink` of the pixels in each direction. Writes `out`/geometry.png. Figures: RMS error of the height in mm
    against the truth, of each way on the planes and on the peaks, and how far each pair of ways differs there.
    """
    bench = _Bench(shrink)
    polynomial = fit_heights(PLANES_MM, [bench.plane(h).phase_rad for h in PLANES_MM], DEGREE)
    ways = _Ways(bench, polynomial)
    planes = {h: ways.heights(bench.plane(h)) for h in BETWEEN_MM}
    errors = {way: np.stack([found[way] - np.float32(h) for h, found in planes.items()]) for way in WAYS}
    seen = bench.peaks()
    peaks = ways.heights(seen)
    off = {way: peaks[way] - bench.peaks_mm for way in WAYS}
    records = [
        *(
            Figure(f"planes_{way}_rms_mm", f"planes between, {WAYS[way]}", rms(e), "mm RMS")
            for way, e in errors.items()
        ),
        *(Figure(f"peaks_{way}_rms_mm", f"peaks, {WAYS[way]}", rms(e), "mm RMS") for way, e in off.items()),
    ]
    for first, second in (("closed_form", "triangulation"), ("polynomial", "triangulation")):
        apart = rms(peaks[first] - peaks[second])
        words = f"peaks, {WAYS[first]} less {WAYS[second]}"
        records.append(Figure(f"peaks_{first}_less_{second}_rms_mm", words, apart, "mm RMS"))
    path = out / "geometry.png"
    _draw(path, peaks, off, errors)
    worst = max(records[:3], key=lambda one: one.value)
    return Reproduction(
        tuple(records), (path,), f"the three ways agree; the worst errs by {worst.value:.2g} mm RMS on planes"
    )


def crossed_axes_mm(difference_rad: Map, x_mm: Map) -> Map:
    """Return heights (H, W), mm, by (S5) from the phase less that of the reference plane, (H, W), rad.

    `x_mm` (H, W) is where the ray of the pixel ends on the reference plane, positive away from the projector; P0 is the
    fringe period on the plane normal to the axis of the projector where the two axes cross.
    """
    angle = np.arctan2(BASELINE_MM, DISTANCE_MM)
    sine, cosine = np.sin(angle), np.cos(angle)
    period_mm = FIELD_LIT_MM / Fringes().numbers[0]
    g = DISTANCE_MM + x_mm.astype(np.float64) * cosine * sine
    difference = np.where(difference_rad == 0, np.nan, difference_rad.astype(np.float64))
    first = 2 * np.pi * DISTANCE_MM**2 * BASELINE_MM * cosine / (period_mm * difference * g**2)
    height = DISTANCE_MM / (first - BASELINE_MM * cosine * sine / g + 1)
    return np.where(difference_rad == 0, 0.0, height).astype(np.float32)


class _Bench:
    """The bench of the closed form, and shots on it."""

    def __init__(self, shrink: int) -> None:
        width_px, height_px = WIDTH_PX // shrink, HEIGHT_PX // shrink
        focal_px = width_px / FIELD_MM * DISTANCE_MM
        self.camera = _device(width_px, height_px, focal_px)
        angle = np.arctan2(BASELINE_MM, DISTANCE_MM)
        sine, cosine = float(np.sin(angle)), float(np.cos(angle))
        along_mm = DISTANCE_MM / cosine
        # The projector stands at x = -d; its axis turns towards the crossing, so its z axis is (sine, 0, cosine).
        self.projector = _device(912, 1140, 912 / FIELD_LIT_MM * along_mm).model_copy(
            update={
                "rotation": ((cosine, 0.0, -sine), (0.0, 1.0, 0.0), (sine, 0.0, cosine)),
                "translation_mm": (BASELINE_MM * cosine, 0.0, BASELINE_MM * sine),
            }
        )
        camera, projector = core_device(self.camera), core_device(self.projector)
        self._bench = _core.Bench(camera=camera, visible=projector, infrared=projector)
        known = Calibration(camera=self.camera, projector=self.projector)
        self._plan = Plan(912, Fringes(), known)
        self._decoder: Decoder | None = None
        columns = np.arange(width_px, dtype=np.float32) - np.float32((width_px - 1) / 2)
        self.x_mm = np.broadcast_to(columns * np.float32(DISTANCE_MM / focal_px), (height_px, width_px))

    def plane(self, height_mm: float) -> Shape:
        """Measure a plane at a height over the reference plane."""
        return self._measured(self._bench.cast_plane(point_mm=(0, 0, DISTANCE_MM - height_mm), normal=(0, 0, -1)))

    def peaks(self) -> Shape:
        """Measure the peaks surface; `peaks_mm` is then its true height (H, W)."""
        cast = self._bench.cast_peaks(z_mm=DISTANCE_MM, scale_mm=PEAKS_SCALE_MM)
        self.peaks_mm = np.float32(DISTANCE_MM) - cast.xyz_mm()[:, :, 2]
        return self._measured(cast)

    def _measured(self, cast: _core.Cast) -> Shape:
        images = self._bench.render(cast, Fringes().numbers, noise=NOISE, seed=SEED)
        shot = Shot(images["red"], images["green"], images["blue"], images["ir"])
        self._decoder = self._decoder or Decoder(shot, self._plan)
        return self._decoder.decode_without_verdict(shot)


class _Ways:
    """The three ways from the phase of a shot to heights."""

    def __init__(self, bench: _Bench, polynomial: HeightCalibration) -> None:
        self._bench, self._polynomial = bench, polynomial
        self._reference_rad = bench.plane(0.0).phase_rad

    def heights(self, shape: Shape) -> Heights:
        """Return the heights (H, W) over the reference plane by each way, mm."""
        return {
            "closed_form": crossed_axes_mm(shape.phase_rad - self._reference_rad, self._bench.x_mm),
            "polynomial": self._polynomial.height_from_phase(shape.phase_rad),
            "triangulation": np.float32(DISTANCE_MM) - xyz_mm_of(shape)[:, :, 2],
        }


def _device(width_px: int, height_px: int, focal_px: float) -> Device:
    centre_px = ((width_px - 1) / 2, (height_px - 1) / 2)
    return Device(width_px=width_px, height_px=height_px, focal_px=(focal_px, focal_px), centre_px=centre_px)


def _draw(path: Path, peaks: Heights, off: Heights, errors: Heights) -> None:
    shown_mm = symmetric(*peaks.values())
    common_mm = symmetric(*off.values())
    heights = np.array(BETWEEN_MM)
    lines = {WAYS[way]: (heights, np.array([rms(one) for one in e])) for way, e in errors.items()}
    row, columns = (length // n for length, n in zip(off["polynomial"].shape, (2, 1), strict=True))
    along = {WAYS[way]: (np.arange(columns), e[row]) for way, e in off.items()}
    rows: list[list[Panel | Graph]] = [
        [Panel(f"peaks: {WAYS[way]}", image, "height, mm", "viridis", shown_mm) for way, image in peaks.items()],
        [Panel(f"error: {rms(e):.3f} mm RMS", e, "mm", DIVERGING, common_mm) for e in off.values()],
        [
            Graph("planes between those of the fit", "height of the plane, mm", "error, mm RMS", lines),
            Graph(f"peaks: error along row {row}", "column, px", "mm", along),
        ],
    ]
    draw_panels(path, "height by three ways from the same phase, noise 1 %", rows)
