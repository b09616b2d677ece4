"""The guard of the live page in a real browser: the token opens it, and another page cannot reach it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import Any

import pytest

from quadfringe.view.viewer import Viewer

PATIENCE_MS = 60_000
# Tells in its title whether the WebSocket opened.
FOREIGN = """<!doctype html><title>waiting</title><script>
const socket = new WebSocket("ws://127.0.0.1:PORT", "viser-vVERSION");
socket.onopen = () => { document.title = "opened"; };
socket.onerror = () => { document.title = "refused"; };
</script>"""


@contextmanager
def another_page(text: str) -> Iterator[str]:
    """A page of another origin on this machine, as its URL."""

    class Answer(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(text.encode())

        def log_message(self, *_args: object) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Answer) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()
        thread.join()


def test_the_token_opens_the_page(browser: Any) -> None:
    with Viewer("0.0.0.0", port=8275) as viewer:
        page = browser.new_page()
        assert page.goto(viewer.url.partition("?")[0]).status == 403
        page.goto(viewer.url)
        page.get_by_text("waiting for the first shot").wait_for(timeout=PATIENCE_MS)
        assert page.goto(viewer.url.partition("?")[0]).status == 200, "the cookie does not count"
        page.get_by_text("waiting for the first shot").wait_for(timeout=PATIENCE_MS)
        page.close()


@pytest.mark.parametrize("guarded", [True, False])
def test_a_foreign_page_cannot_connect(browser: Any, guarded: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    import viser

    if not guarded:  # without the guard it can, so that the test would notice
        monkeypatch.setattr("quadfringe.view._guard.Guard.refusal", lambda *_: None)
    with Viewer(port=8280) as viewer:
        port = viewer.url.rsplit(":", 1)[1]
        with another_page(FOREIGN.replace("PORT", port).replace("VERSION", viser.__version__)) as url:
            page = browser.new_page()
            page.goto(url)
            page.wait_for_function("document.title !== 'waiting'", timeout=PATIENCE_MS)
            title = page.title()
            page.close()
    assert title == ("refused" if guarded else "opened")
