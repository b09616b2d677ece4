"""Check where a wheel runs and what is in it.

    python scripts/check_wheel.py WHEEL [POLICY]

POLICY names the oldest Linux that the wheel must run on, such as manylinux_2_17: auditwheel compares it with the
symbols that the module needs. abi3audit compares the module with the stable interface of Python. The first fault ends
the program with status 1.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

CONTENTS = (
    r"quadfringe/_core\.(abi3\.so|pyd)",
    r"quadfringe/_core\.pyi",
    r"quadfringe/py\.typed",
    r"quadfringe/view/page/page\.(css|html|js)",
    r"quadfringe-[^/]*\.dist-info/licenses/LICENSE(-APACHE|-MIT)?",
    r"quadfringe-[^/]*\.dist-info/licenses/licenses/libusb-LGPL-2\.1\.txt",
    r"quadfringe-[^/]*\.dist-info/sboms/quadfringe-python\.cyclonedx\.json",
)
BYTES_MAX = 8_000_000  # of the wheel, which has 4.7 MB; test data or debug information would exceed it


def check_contents(wheel: Path) -> None:
    """Check that nothing is missing, and that nothing but the module is compiled."""
    with ZipFile(wheel) as archive:
        names = archive.namelist()
    for pattern in CONTENTS:
        if not any(re.fullmatch(pattern, name) for name in names):
            sys.exit(f"{wheel.name}: expected a file {pattern}, found none")
    strange = [name for name in names if not name.startswith(("quadfringe/", "quadfringe-"))]
    compiled = [name for name in names if name.endswith((".so", ".pyd", ".dll", ".dylib"))]
    if strange or len(compiled) != 1:
        sys.exit(f"{wheel.name}: expected the package with one compiled module, got {compiled} and {strange}")
    if wheel.stat().st_size > BYTES_MAX:
        sys.exit(f"{wheel.name}: expected at most {BYTES_MAX} bytes, got {wheel.stat().st_size}")


def check_linux(wheel: Path, policy: str) -> str:
    """Check that the wheel needs no newer system than the policy states; return what it needs."""
    # On a host with glibc, auditwheel takes its libc.so, a text, for that of musl: it looks for libraries nowhere.
    nowhere = ["--ldpaths", "/nonexistent"] if policy.startswith("musllinux") else []
    command = [sys.executable, "-m", "auditwheel", "show", "--json", *nowhere, str(wheel)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{wheel.name}: auditwheel cannot read it:\n{done.stderr}")
    report = json.loads(done.stdout)
    needed, libraries = report["sym_tag" if nowhere else "overall_tag"], report["external_libs"].keys()
    strange = libraries - {"libc.so"} if nowhere else libraries
    (kind, age), (kind_wanted, age_wanted) = _split(needed), _split(policy)
    if kind != kind_wanted or age > age_wanted or report["unsupported_isa"] or strange:
        sys.exit(f"{wheel.name}: expected {policy} or older and no other library, auditwheel says:\n{report}")
    return f"auditwheel: {needed}, {', '.join(sorted(report['versioned_symbols']))}"


def _split(policy: str) -> tuple[str, tuple[int, ...]]:
    """Split manylinux_2_17_x86_64 into its kind and its version; a module that fits no policy has no version."""
    found = re.match(r"([a-z]+)_(\d+)_(\d+)", policy)
    return (found[1], (int(found[2]), int(found[3]))) if found else (policy, ())


def main(wheel: Path, policy: str | None) -> None:
    """Check everything that can be checked without installing the wheel."""
    check_contents(wheel)
    found = [f"{wheel.stat().st_size / 1e6:.1f} MB"]
    if policy is not None:
        found.append(check_linux(wheel, policy))
    subprocess.run([sys.executable, "-m", "abi3audit", "--strict", str(wheel)], check=True)
    print(f"{wheel.name}: {'; '.join([*found, 'abi3audit: stable interface only'])}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else None)
