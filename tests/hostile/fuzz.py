"""Attack a reader by libFuzzer: `python -m hostile.fuzz KIND [-max_total_time=60 ...]` in the folder tests.

Atheris counts which branches of quadfringe an input reaches, and changes further those that reach new ones. A result or
an `InputError` is right. Any other error, 5 s or 4 GB end the run with a status that is not 0, and the input stays in
out/fuzz/KIND; once mended, it belongs in tests/hostile/corpus/KIND, which `make test` reads.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import atheris
import numpy as np

with atheris.instrument_imports(include=["quadfringe"]):
    from hostile.mutations import damaged
    from hostile.targets import TARGETS, corpus, sound_inputs, target

FOLDER = Path("../out/fuzz")
LIMITS = ("-timeout=5", "-rss_limit_mb=4096", "-max_len=1048576")


def changed(data: bytes, most: int, seed: int) -> bytes:
    """Change an input as libFuzzer does, or by what damages files of numbers and texts."""
    if seed % 2:
        return bytes(atheris.Mutate(data, most))
    return damaged(data, np.random.default_rng(seed))[:most]


def main() -> None:
    kind, options = sys.argv[1], sys.argv[2:]
    if kind not in TARGETS:
        sys.exit(f"{kind}: expected one of {', '.join(TARGETS)}")
    inputs = FOLDER / kind / "inputs"
    inputs.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, target(kind, Path(folder)) as attack:
        known = [*sound_inputs(kind, Path(folder)), *(path.read_bytes() for path in corpus(kind))]
        for number, data in enumerate(known):
            (inputs / f"known-{number}").write_bytes(data)
        words = [sys.argv[0], str(inputs), f"-artifact_prefix={FOLDER / kind}/", *LIMITS, *options]
        atheris.Setup(words, attack, custom_mutator=changed)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
