"""Debian's Chromium without a window, driven by the DevTools protocol over a pipe: no driver has to be installed."""

from __future__ import annotations

import base64
import contextlib
import fcntl
import json
import os
import select
import shutil
import signal
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_ARGUMENTS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run", "--disable-extensions",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage",
    "--remote-debugging-pipe", "--force-device-scale-factor=1",
)  # fmt: skip
_PATIENCE_S = 60.0


class Browser:
    """One page in one browser.

    ``messages`` are errors and warnings of the console and exceptions, ``requests`` all that the page loads.
    """

    def __init__(self, program: str, folder: Path) -> None:
        (command_out, command_in), (answer_out, answer_in) = _pipe(), _pipe()
        self._write, self._read = command_in, answer_out
        quiet = os.open(os.devnull, os.O_RDWR)
        redirections = [
            (os.POSIX_SPAWN_DUP2, quiet, 1), (os.POSIX_SPAWN_DUP2, quiet, 2),
            (os.POSIX_SPAWN_DUP2, command_out, 3), (os.POSIX_SPAWN_DUP2, answer_in, 4),
        ]  # fmt: skip
        arguments = [program, *_ARGUMENTS, f"--user-data-dir={folder}", "about:blank"]
        self._pid = os.posix_spawn(program, arguments, os.environ, file_actions=redirections, setsid=True)
        for one in (command_out, answer_in, quiet):
            os.close(one)
        self._number, self._rest, self._session = 0, b"", ""
        self.messages: list[str] = []
        self.requests: list[str] = []
        self._loaded = False
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> Any:
        """Call a method of the protocol and return its result."""
        self._number += 1
        number = self._number
        message = {"id": number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == number:
                assert "error" not in answer, f"{method}: {answer['error']}"
                return answer["result"]

    def open(self, file: Path, *, width: int = 1280, height: int = 900, dark: bool = False) -> None:
        """Open a file in a window of a size, and wait until it is loaded."""
        self.resize(width, height)
        self.emulate(dark=dark)
        self.messages.clear()
        self.requests.clear()
        self._loaded = False
        self.call("Page.navigate", url=file.as_uri())
        while not self._loaded:
            self._next()

    def resize(self, width: int, height: int = 900) -> None:
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def emulate(self, *, dark: bool = False, media: str = "") -> None:
        """Prefer dark or light colours; pretend another medium, ``print``."""
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", media=media, features=[scheme])

    def run(self, script: str) -> Any:
        """Evaluate an expression in the page; a promise is awaited."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, condition: str) -> None:
        """Wait until an expression is true."""
        end = time.monotonic() + _PATIENCE_S
        while not self.run(condition):
            assert time.monotonic() < end, f"never true: {condition}"
            time.sleep(0.02)

    def settle(self) -> None:
        """Wait until what was asked for is drawn."""
        self.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def press(self, key: str, *, shift: bool = False) -> None:
        """Press and release a key by its name."""
        codes = {"Tab": 9, "Enter": 13, "Escape": 27, " ": 32, "ArrowLeft": 37, "ArrowRight": 39, "ArrowUp": 38}
        text = {"Enter": "\r", "Tab": ""}.get(key, key if len(key) == 1 else "")
        common = {"key": key, "modifiers": 8 * shift, "windowsVirtualKeyCode": codes.get(key, ord(key[0]))}
        self.call(
            "Input.dispatchKeyEvent",
            type="keyDown" if text else "rawKeyDown",
            **common,
            **({"text": text} if text else {}),
        )
        self.call("Input.dispatchKeyEvent", type="keyUp", **common)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag with the left button, in points of the window."""
        steps = [
            ("mouseMoved", start, 0),
            ("mousePressed", start, 1),
            ("mouseMoved", end, 1),
            ("mouseReleased", end, 0),
        ]
        for kind, (x, y), held in steps:
            button = "none" if kind == "mouseMoved" and not held else "left"
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, buttons=held, clickCount=1)
        self.settle()

    def move(self, x: float, y: float) -> None:
        self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y, button="none")
        self.settle()

    def picture(self, file: Path, *, full: bool = False) -> None:
        """Write a PNG of the window, or of the whole page."""
        answer = self.call("Page.captureScreenshot", captureBeyondViewport=full)
        file.write_bytes(base64.b64decode(answer["data"]))

    def paper(self) -> bytes:
        """Return the page as PDF, A4."""
        answer = self.call("Page.printToPDF", preferCSSPageSize=True, printBackground=True)
        return base64.b64decode(answer["data"])

    def close(self) -> None:
        for one in (self._write, self._read):
            os.close(one)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._pid, signal.SIGKILL)
        os.waitpid(self._pid, 0)

    def _next(self) -> dict[str, Any]:
        """Return the next message; what it says of console and network is kept."""
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._read], [], [], _PATIENCE_S)
            assert ready, "the browser does not answer"
            part = os.read(self._read, 1 << 20)
            assert part, "the browser ended"
            self._rest += part
        message, _, self._rest = self._rest.partition(b"\0")
        event: dict[str, Any] = json.loads(message)
        found = event.get("params", {})
        match event.get("method"):
            case "Runtime.consoleAPICalled" if found["type"] in {"error", "warning", "assert"}:
                self.messages.append(f"{found['type']}: {found['args']}")
            case "Runtime.exceptionThrown":
                self.messages.append(f"exception: {found['exceptionDetails']}")
            case "Log.entryAdded" if found["entry"]["level"] in {"error", "warning"}:
                self.messages.append(f"log: {found['entry']['text']}")
            case "Network.requestWillBeSent" if not found["request"]["url"].startswith("data:"):
                self.requests.append(found["request"]["url"])
            case "Page.loadEventFired":
                self._loaded = True
        return event


def _pipe() -> tuple[int, int]:
    """A pipe whose descriptors are not those that the browser gets its own under."""
    pair = os.pipe()
    high = [fcntl.fcntl(one, fcntl.F_DUPFD_CLOEXEC, 10) for one in pair]
    for one in pair:
        os.close(one)
    return high[0], high[1]


def browser_program() -> str:
    """Path of a browser of Chromium's kind; the test is skipped where there is none."""
    for name in _NAMES:
        if (program := shutil.which(name)) is not None:
            return program
    pytest.skip(f"no browser here (looked for {', '.join(_NAMES)}); on Debian: apt-get install chromium")


@contextlib.contextmanager
def headless_browser() -> Iterator[Browser]:
    """A browser with an empty page, ended at the end of the block."""
    program = browser_program()
    with tempfile.TemporaryDirectory(prefix="browser-", ignore_cleanup_errors=True) as folder:
        try:
            browser = Browser(program, Path(folder))
        except (AssertionError, OSError) as error:
            pytest.skip(f"{program} does not start here: {error}")
        try:
            yield browser
        finally:
            browser.close()
