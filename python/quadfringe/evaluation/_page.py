"""A page in Debian's chromium without a screen, for benchmarks and pictures of the live view."""

from __future__ import annotations

import json
import shutil
import subprocess
import threading
from base64 import b64decode
from pathlib import Path
from typing import Any
from urllib.request import urlopen

from quadfringe.errors import require

FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]


class Page:
    """A page of headless chromium, driven over the DevTools protocol.

    Browser test drivers record the network traffic of the page, and copying every cloud costs more than drawing it.
    """

    def __init__(self, folder: str) -> None:
        words = ["--headless=new", "--remote-debugging-port=0", f"--user-data-dir={folder}", "--window-size=1280,887"]
        # The kernel kills chromium when this program ends in any way; otherwise it would go on drawing.
        alone = ["setpriv", "--pdeathsig", "KILL", shutil.which("chromium") or "chromium"]
        self._chromium = subprocess.Popen([*alone, *FLAGS, *words, "about:blank"], stderr=subprocess.PIPE, text=True)
        assert self._chromium.stderr is not None
        said = next(line for line in self._chromium.stderr if "DevTools listening on" in line)
        # Read the rest of its output, or it blocks on a full pipe.
        threading.Thread(target=self._chromium.stderr.read, daemon=True).start()
        port = said.split("/")[2]
        with urlopen(f"http://{port}/json/list") as answer:
            target = next(target for target in json.load(answer) if target["type"] == "page")
        connect: Any = require("websockets.sync.client", "view").connect
        self._wire = connect(target["webSocketDebuggerUrl"], max_size=None)
        self._asked = 0

    def ask(self, method: str, **parameters: object) -> dict[str, Any]:
        """Send a command and wait for its answer."""
        self._asked += 1
        self._wire.send(json.dumps({"id": self._asked, "method": method, "params": parameters}))
        while (answer := json.loads(self._wire.recv())).get("id") != self._asked:
            pass
        result: dict[str, Any] = answer["result"]
        return result

    def value(self, expression: str) -> Any:
        """Evaluate an expression of the page."""
        return self.ask("Runtime.evaluate", expression=expression, returnByValue=True)["result"]["value"]

    def picture(self, path: Path) -> None:
        """Write a picture of the page, PNG."""
        path.write_bytes(b64decode(self.ask("Page.captureScreenshot")["data"]))

    def close(self) -> None:
        self._wire.close()
        self._chromium.kill()
        self._chromium.communicate()
