"""The import of Aravis through GObject introspection, and the translation of its errors.

Only `_binding`, `_device` and `_stream` call Aravis. Two rules: no Python runs in a thread of Aravis (no signals, no
callbacks), because that thread would wait for the interpreter while frames are lost; and every call that can fail turns
a GLib error into a `CameraError`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from quadfringe.errors import CameraError, CameraLostError, CameraNotFoundError, MissingExtraError

__all__ = ["aravis_binding", "translated"]

INSTALL = (
    "cameras need Aravis and its Python binding:\n"
    "  apt-get install --no-install-recommends gir1.2-aravis-0.8 libgirepository1.0-dev libcairo2-dev pkg-config gcc\n"
    '  pip install "quadfringe[aravis]"'
)


@cache
def aravis_binding() -> Any:
    """Import Aravis once; raises `MissingExtraError` with what to install."""
    try:
        import gi

        gi.require_version("Aravis", "0.8")
        from gi.repository import Aravis
    except (ImportError, ValueError) as error:
        raise MissingExtraError(f"{INSTALL}\n({error})") from error
    return Aravis


@contextmanager
def translated(what: str) -> Iterator[None]:
    """Turn a GLib error into a `CameraError` that says what was attempted."""
    from gi.repository import GLib

    try:
        yield
    except GLib.Error as error:
        errors = aravis_binding().DeviceError
        kinds = {errors.TIMEOUT: CameraLostError, errors.NOT_FOUND: CameraNotFoundError}
        quark = aravis_binding().device_error_quark()
        raised = next((kind for code, kind in kinds.items() if error.matches(quark, code)), CameraError)
        raise raised(f"{what}: {error.message}") from error
