"""Efficiency of a phase estimate: its variance over the least one that noise allows at the same spatial resolution.

The estimator is a black box from four images to a phase map. The images are

    I_c(x) = a + b cos(k_c phi(x) + s_c) + n_c(x),    c = R, G, B, IR,    k_c = N_c / N_R,

with independent Gaussian noise of standard deviation sigma, not rounded and far from clipping. One pixel with a, b and
sigma known carries the Fisher information

    J(x) = (b / sigma)^2 sum_c k_c^2 sin^2(k_c phi(x) + s_c)

on its phase, so that 1 / J is the Cramer-Rao bound of a single pixel. Background and modulation count as known; if they
are not, the true bound is higher, so the ratio given here is never too good.

An estimator that averages over neighbours has less variance than that, and less resolution. Let h_x(d) be the change
of its mean at x for a unit change of the true phase at x - d. For the same h the Cramer-Rao inequality of biased
estimators says

    Var phi^(x) >= sum_d h_x(d)^2 / J(x - d)

and, averaged over the field (Cauchy-Schwarz),

    mean Var >= sum_d h(d)^2 / mean J = 1 / (N mean J),    h = mean of h_x,    N = 1 / sum_d h(d)^2.

N is the number of independent pixels that one value averages: the resolution, measured from the response of the
estimator. The efficiency is the ratio of the two sides: 1 is the optimum, and an estimator is below it only by errors
of measurement. Smoothing does not improve it, because it raises N and lowers the bound alike.

The second step needs windows in which J averages out, half a fringe or more; for a single pixel the best possible ratio
is mean J mean 1/J, 1.06 for 36, 35, 30 fringes. tests/test_efficiency.py checks the measure
on estimators whose efficiency is known.

h is measured under noise, the working point of the estimator: the true phase of every pixel changes by +-EPSILON_RAD
at random, the noise stays the same, and the change of the estimate is correlated with the signs. Two halves of the
seeds give h independently, and sum h^2 is the sum of their products, so that the error of one half is not squared. The
sum of h must be near 1: then a uniform change of phase passes unchanged, and the window of d contains the response. It
is the least certain of the figures; its error is the width of the window over the root of the pixels: 0.04 for six
seeds of 0.75 million pixels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

Map = NDArray[np.float64]
Mask = NDArray[np.bool_]
Images = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]
Ratios = tuple[float, float, float, float]
Estimator = Callable[[Images], NDArray[np.floating]]

SIGMA = 0.03  # of full scale
BACKGROUND, MODULATION = 0.5, 0.35  # five sigma from either end
SHIFTS_RAD = (0.0, 0.0, np.pi / 2, 0.0)  # R, G, B, IR
EPSILON_RAD = 0.05  # less than the noise of one pixel
REACH_PX = 40  # of h, along rows and columns: more than a fringe and a half
SEEDS = 6


@dataclass(frozen=True)
class Efficiency:
    """Figures of one estimator on one phase field; variances are means over the pixels that count."""

    variance_rad2: float
    bound_rad2: float  # at the resolution of the estimator
    pixels_per_value: float  # N
    response_sum: float  # of h; 1 when a uniform change of phase passes unchanged
    bias_rms_rad: float  # of the mean over the seeds against the truth

    @property
    def variance_over_bound(self) -> float:
        """Variance over the Cramer-Rao bound at the same resolution; 1 is the optimum."""
        return self.variance_rad2 / self.bound_rad2

    def as_figures(self) -> dict[str, float]:
        """Give the figures by name with unit."""
        return {
            "variance_over_bound": self.variance_over_bound,
            "noise_rms_rad": self.variance_rad2**0.5,
            "bound_rms_rad": self.bound_rad2**0.5,
            "pixels_per_value": self.pixels_per_value,
            "response_sum": self.response_sum,
            "bias_rms_rad": self.bias_rms_rad,
        }


def efficiency(
    estimate: Estimator,
    phase_rad: Map,
    inner: Mask,
    ratios: Ratios,
    *,
    seeds: int = SEEDS,
    reach_px: int = REACH_PX,
) -> Efficiency:
    """Measure an estimator on a phase field (H, W), NaN where there is no light, over the pixels of `inner`.

    `ratios` are k_c of R, G, B, IR. Pixels that any of the runs does not return with the right order are left out.
    Raises ValueError when the estimate does not depend on the phase.
    """
    plain, changed, signs = [], [], []
    for seed in range(seeds):
        signs.append(np.random.default_rng([seed, 1]).choice((-1.0, 1.0), phase_rad.shape))
        plain.append(estimate(images(phase_rad, ratios, seed)).astype(np.float64))
        changed.append(estimate(images(phase_rad + EPSILON_RAD * signs[-1], ratios, seed)).astype(np.float64))
    stack = np.stack(plain)
    with np.errstate(invalid="ignore"):
        right = (np.abs(np.stack([*plain, *changed]) - phase_rad) < np.pi).all(axis=0)
    counted = inner & right
    responses = [
        response(np.where(counted, after - before, 0.0), sign, reach_px) / (EPSILON_RAD * counted.sum())
        for before, after, sign in zip(plain, changed, signs, strict=True)
    ]
    halves = [np.mean(responses[i::2], axis=0) for i in (0, 1)]
    energy = float(np.sum(halves[0] * halves[1]))
    if not energy > 0:
        raise ValueError(f"expected an estimate that follows the phase, got a response of energy {energy}")
    variance = stack.var(axis=0, ddof=1)
    mean_square = (stack.mean(axis=0) - phase_rad)[counted] ** 2 - variance[counted] / seeds
    return Efficiency(
        variance_rad2=float(variance[counted].mean()),
        bound_rad2=energy / float(information(phase_rad, ratios)[counted].mean()),
        pixels_per_value=1 / energy,
        response_sum=float(np.mean(halves, axis=0).sum()),
        bias_rms_rad=max(0.0, float(mean_square.mean())) ** 0.5,
    )


def images(phase_rad: Map, ratios: Ratios, seed: int) -> Images:
    """Give R, G, B, IR of a phase field, float32 with full scale 1; the background alone where the phase is NaN."""
    random = np.random.default_rng([seed, 0])
    found = []
    for ratio, shift_rad in zip(ratios, SHIFTS_RAD, strict=True):
        fringes = np.nan_to_num(np.cos(ratio * phase_rad + shift_rad))
        light = BACKGROUND + MODULATION * fringes
        light[np.isnan(phase_rad)] = BACKGROUND - MODULATION
        found.append((light + SIGMA * random.standard_normal(light.shape)).astype(np.float32))
    return (found[0], found[1], found[2], found[3])


def information(phase_rad: Map, ratios: Ratios) -> Map:
    """Give J, the Fisher information of a pixel on its phase, 1 / rad^2."""
    terms = [(k * np.sin(k * phase_rad + s)) ** 2 for k, s in zip(ratios, SHIFTS_RAD, strict=True)]
    return np.asarray((MODULATION / SIGMA) ** 2 * np.sum(terms, axis=0))


def response(change_rad: Map, sign: Map, reach_px: int) -> Map:
    """Give the sum over the field of the change times the sign at a distance d, |d| <= reach_px along both axes."""
    shape = [fft.next_fast_len(n + 2 * reach_px, real=True) for n in change_rad.shape]
    correlation = fft.irfft2(fft.rfft2(change_rad, shape) * np.conj(fft.rfft2(sign, shape)), shape)
    near = np.arange(-reach_px, reach_px + 1)
    return np.asarray(correlation[np.ix_(near, near)])
