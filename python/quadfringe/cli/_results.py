"""What commands print of a shape: its uncertainty, and the response that was estimated."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from quadfringe.cli._output import say

if TYPE_CHECKING:
    from quadfringe.data import Shape

__all__ = ["response_told", "uncertainty_told"]


def response_told(shape: Shape, json: Path | None) -> dict[str, float]:
    """Print the response that was estimated from the shot; give its figures."""
    exponents = {name: channel["exponent"] for name, channel in shape.config["response"].items()}
    evidence = shape.config.get("response_evidence", {})
    sds = {name: evidence[name]["exponent_sd"] for name in exponents if name in evidence}
    listed = ", ".join(
        f"{name} {exponent:.2f}" + (f" +- {sds[name]:.2g}" if name in sds else "")
        for name, exponent in exponents.items()
    )
    say(f"response estimated from the shot, exponents: {listed} (--response linear skips this)", json)
    told = {f"response_exponent_{name}": value for name, value in exponents.items()}
    told |= {f"response_exponent_sd_{name}": value for name, value in sds.items()}
    if sds:
        left = max((abs(evidence[name]["second_harmonic_after"]) for name in sds), default=0.0)
        words = f"it leaves a second harmonic of at most {left:.1%} of the fringes, and a phase error of at most "
        say(f"{words}{evidence['phase_rad']:.2g} rad (RMS)", json)
    return told


def uncertainty_told(figures: Mapping[str, float]) -> str:
    """Describe the median uncertainty and how many wrong fringe orders to expect; empty when neither is known."""
    for unit in ("mm", "rad"):
        if (sigma := figures.get(f"uncertainty_median_{unit}")) is not None:
            wrong = figures.get("wrong_orders_expected", 0.0)
            return f", median uncertainty {sigma:.3g} {unit}, {wrong:.3g} pixels of wrong fringe order expected"
    return ""
