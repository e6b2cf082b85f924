"""Headless Chromium for the tests of real clients: it opens a page of a folder, and the page posts what it found."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

MODULES = Path(__file__).parent / "peers" / "node_modules"


def program(module: str, *names: str) -> str:
    """Path of a program that needs an npm package; skips where one is missing, fails under CI."""
    path = next(filter(None, map(shutil.which, names)), None)
    if path is None or not (MODULES / module).is_dir():
        message = f"needs {names[0]} and {module} (run 'npm ci' in tests/peers)"
        if os.environ.get("CI"):
            pytest.fail(message)
        pytest.skip(message)
    return path


class _Handler(SimpleHTTPRequestHandler):
    """Serves a folder and the npm packages; takes the page's result."""

    def __init__(self, *args: Any, folder: Path, results: list[dict[str, Any]], done: threading.Event) -> None:
        self.results, self.done = results, done
        super().__init__(*args, directory=str(folder))

    def translate_path(self, path: str) -> str:
        if path.startswith("/node_modules/"):
            return str(MODULES.parent / path.split("?")[0].lstrip("/"))
        return super().translate_path(path)

    def do_POST(self) -> None:
        self.results.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        self.send_response(204)
        self.end_headers()
        self.done.set()

    def log_message(self, *_: Any) -> None:
        pass


def open_page(module: str, folder: Path, query: str = "") -> dict[str, Any]:
    """Open a folder's index.html, which uses an npm package, and return what it posts to /result."""
    chromium = program(module, "chromium", "google-chrome")
    results: list[dict[str, Any]] = []
    done = threading.Event()
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Handler, folder=folder, results=results, done=done))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    flags = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    flags += ["--no-first-run", "--disable-background-networking", f"--user-data-dir={folder / 'profile'}"]
    address = f"http://127.0.0.1:{server.server_port}/index.html{query}"
    browser = subprocess.Popen(
        [chromium, *flags, address], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    try:
        assert done.wait(180), "the page in Chromium gave no result within 180 s"
    finally:
        browser.terminate()
        browser.wait(20)
        server.shutdown()
        server.server_close()
    return results[0]
