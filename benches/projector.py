"""The driver of the projector over the real libusb: time of a transaction, and time until a fault is reported.

    target/debug/lightcrafter-testbed .venv/bin/python benches/projector.py [--count 500] [--json FILE]

`make test-usb` runs it in its testbed with two emulated projectors. Each of two threads sets the LED drive of its
projector, which takes three transactions, and reads it back in a fourth. Other programs may slow some of the
transactions, while a wait in the driver slows all; of ten parts of the run the one with the smallest median counts, and
it must be below 5 ms. A command that gets no valid answer is sent twice, and each time the driver waits for 2 s; with
5 s for everything else, each fault must raise its error within 9 s. The exit status is 1 otherwise.
"""

from __future__ import annotations

import argparse
import sys
import threading
import time
from pathlib import Path
from statistics import median

from quadfringe.devices.lightcrafter import LightCrafter
from quadfringe.evaluation._testbed import orders
from quadfringe.files import figures_text

PORTS = ("1-1", "1-2")
PARTS = 10
BARS = {"transaction_ms": 5.0, "slowest_error_s": 2 * 2.0 + 5.0}
FAULTS = {"refuse": 1, "truncate": 2, "silence": 2, "wrong-sequence": 2}  # how often each is repeated


def transactions(count: int) -> float:
    """Give the milliseconds of a transaction while two threads use two projectors."""
    times: list[float] = []

    def use(port: str, polarity: int) -> None:
        with LightCrafter(port) as projector:
            for i in range(count):
                drive = (polarity, i % 100, 0)
                start = time.perf_counter()
                projector.set_led_drive(drive)  # writes polarity and current and reads them back
                middle = time.perf_counter()
                found = projector.led_drive()
                times.extend([(middle - start) / 3, time.perf_counter() - middle])
                if found != drive:
                    raise AssertionError(f"projector at {port}: expected the LED drive {drive}, got {found}")

    threads = [threading.Thread(target=use, args=(port, polarity)) for polarity, port in enumerate(PORTS, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if len(times) != 2 * len(PORTS) * count:
        raise AssertionError(f"expected {2 * len(PORTS) * count} times, got {len(times)}")
    size = len(times) // PARTS
    return 1e3 * min(median(times[part * size : (part + 1) * size]) for part in range(PARTS))


def seconds_until_errors() -> dict[str, float]:
    """Give the seconds from a command to the error of each fault."""
    spent_s = {}
    with orders() as order, LightCrafter(PORTS[0]) as projector:
        for fault, times in FAULTS.items():
            order(PORTS[0], f"fault {fault} {times}")
            start = time.monotonic()
            try:
                projector.versions()
            except OSError:
                spent_s[fault] = time.monotonic() - start
            else:
                raise AssertionError(f"{fault}: expected an error, got none")
    return spent_s


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--count", type=int, default=500, help="pairs of a write and a read in each thread")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    spent_s = seconds_until_errors()
    figures = {"transaction_ms": transactions(options.count), "slowest_error_s": max(spent_s.values())}
    for fault, seconds in spent_s.items():
        print(f"{fault}: error after {seconds:.2f} s")
    print(f"a transaction, two projectors at once: {figures['transaction_ms']:.3f} ms")
    if options.json:
        options.json.write_text(figures_text(figures))
    missed = [name for name, bar in BARS.items() if figures[name] >= bar]
    for name in missed:
        print(f"missed: {name}: {figures[name]:.4g}, expected below {BARS[name]:g}", file=sys.stderr)
    return int(bool(missed))


if __name__ == "__main__":
    sys.exit(main())
