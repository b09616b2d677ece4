"""Make an editable wheel of a wheel.

    python scripts/editable.py WHEEL FOLDER

The compiled module goes to python/quadfringe, and the new wheel, which is printed, only names the folder python. So one
build serves both the wheel and the checkout, and changes in Python take effect at once.
"""

from __future__ import annotations

import sys
from base64 import urlsafe_b64encode
from hashlib import sha256
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

PYTHON = Path(__file__).resolve().parents[1] / "python"


def main(wheel: Path, folder: Path) -> None:
    """Write the editable wheel of `wheel` into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    editable = folder / wheel.name
    with ZipFile(wheel) as source:
        names = source.namelist()
        (module,) = [name for name in names if name.startswith("quadfringe/_core.") and not name.endswith(".pyi")]
        # Not overwritten in place: a running program may have mapped the file.
        temporary = PYTHON / f"{module}.new"
        temporary.write_bytes(source.read(module))
        temporary.chmod(0o755)
        temporary.replace(PYTHON / module)
        files = {name: source.read(name) for name in names if ".dist-info/" in name}
    (record,) = [name for name in files if name.endswith(".dist-info/RECORD")]
    del files[record]
    files["quadfringe.pth"] = f"{PYTHON}\n".encode()
    lines = [f"{name},sha256={_digest(content)},{len(content)}\n" for name, content in files.items()]
    files[record] = "".join([*lines, f"{record},,\n"]).encode()
    with ZipFile(editable, "w", ZIP_DEFLATED) as target:
        for name, content in files.items():
            target.writestr(name, content)
    print(editable)


def _digest(content: bytes) -> str:
    return urlsafe_b64encode(sha256(content).digest()).rstrip(b"=").decode()


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
