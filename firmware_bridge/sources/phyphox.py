"""A phone as a tri-axial chip: the remote access of the app phyphox over HTTP.

Source: phyphox wiki, Remote-interface communication (``/config``, ``/control``, ``/get``).
"""

from __future__ import annotations

import http.client
import json
import math
import time
from typing import Any
from urllib.parse import quote, urlsplit

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.frames.frame_format import FrameFormat
from firmware_bridge.sources.source import pack_samples
from gfimu.base.errors import GfimuError, InputError

__all__ = ["PhyphoxSource"]

_TIMEOUT_S = 5.0
_POLL_S = 0.1
_LARGEST_ANSWER = 1 << 26  # bytes
_USUAL_PORT = 8080  # of Android; 80 on an iPhone
_AXES = ("x", "y", "z")


class PhyphoxSource:
    """Asks a phone for the readings that are new, ten times a second, and starts the measurement if it does not run.

    What was measured before is left on the phone and not recorded. When the measurement is stopped on the phone the
    recording ends: phyphox's clock stands still in a pause, so that what would follow had a wrong time.

    Parameters
    ----------
    port : str
        ``phyphox://ADDRESS:PORT`` as the app shows it behind "Allow remote access".
    form : FrameFormat
        `firmware_bridge.sources.source.sample_format` of an array with one tri-axial chip.

    Raises
    ------
    InputError
        If the URL is not of this form.
    """

    hint = "open an experiment with the accelerometer, allow remote access in its menu, and stay in the same network"

    def __init__(self, port: str, form: FrameFormat) -> None:
        try:
            parts = urlsplit(port)
            host, number = parts.hostname, parts.port or _USUAL_PORT
        except ValueError:
            host = None
        if not host or parts.path not in {"", "/"} or parts.query:
            raise InputError(f"{port}: give phyphox://ADDRESS:PORT as the app shows it, such as 192.168.1.20:8080")
        self._port, self._form = port, form
        self._http = http.client.HTTPConnection(host, number, timeout=_TIMEOUT_S)
        self._names: tuple[str, str, str, str] = ("", "", "", "")  # buffers of time and axes
        self._session: str | None = None
        self._since = -1.0
        self._ask_at = 0.0
        self._title = ""

    def open(self) -> None:
        """Find the accelerometer's buffers and start the measurement."""
        config = self._get("/config")
        self._names = self._buffers(config)
        self._title = str(config.get("title", ""))
        newest, status = self._newest()
        if status.get("session") != self._session:
            self._session = str(status.get("session"))
            self._since = newest
        if not status.get("measuring"):
            if self._get("/control?cmd=start").get("result") is not True:
                raise InputError(f"{self._port}: phyphox refuses to start the measurement; look at the phone")
            self._ask_at = time.monotonic() + _POLL_S

    def read(self, size: int, /) -> bytes:
        """Return the samples since the last question; asks at most ten times a second."""
        time.sleep(max(0.0, self._ask_at - time.monotonic()))
        self._ask_at = time.monotonic() + _POLL_S
        name_t, *axes = self._names
        since = repr(self._since)
        asked = [f"{quote(name_t)}={since}", *(f"{quote(name)}={since}%7C{quote(name_t)}" for name in axes)]
        answer = self._get("/get?" + "&".join(asked))
        if str(self._status(answer).get("session")) != self._session:
            raise ConnectionError("another experiment was opened")
        columns = [self._values(answer, name) for name in self._names]
        rows = min(map(len, columns))
        table = np.column_stack([column[:rows] for column in columns])  # (n, 4)
        table = _increasing(table, self._since)
        if not len(table) and not self._status(answer).get("measuring"):
            raise GfimuError(f"{self._port}: the measurement was stopped on the phone")
        if not len(table):
            return b""
        self._since = float(table[-1, 0])
        return pack_samples(self._form, table[:, 0], table[:, 1:])

    def write(self, data: bytes, /) -> None:
        """Do nothing: a phone takes no commands."""

    def close(self) -> None:
        """Close the connection; the phone goes on measuring."""
        self._http.close()

    def facts(self) -> dict[str, Any]:
        """Name of the experiment on the phone."""
        return {"phyphox_experiment": self._title}

    def _buffers(self, config: dict[str, Any]) -> tuple[str, str, str, str]:
        """Names of the buffers of time, x, y and z of the accelerometer, gravity included."""
        inputs = config.get("inputs")
        if not isinstance(inputs, list):
            raise self._garbage()
        sources = {one.get("source"): one.get("outputs") for one in inputs if isinstance(one, dict)}
        outputs = sources.get("accelerometer")
        found: dict[str, Any] = {}
        for one in outputs if isinstance(outputs, list) else []:
            found |= one if isinstance(one, dict) else {}
        names = [found.get(key) for key in ("t", *_AXES)]
        if not all(isinstance(name, str) and name for name in names):
            there = ", ".join(str(name) for name in sources if name) or "no sensor"
            raise InputError(
                f"{self._port}: the experiment on the phone records {there}, not the accelerometer with its time; "
                'open "Acceleration with g"'
            )
        t, x, y, z = (str(name) for name in names)
        return t, x, y, z

    def _newest(self) -> tuple[float, dict[str, Any]]:
        """Time of the newest sample on the phone, −1 s if there is none, and the app's state."""
        answer = self._get(f"/get?{quote(self._names[0])}")
        times = self._values(answer, self._names[0])
        return (float(times[-1]) if len(times) and math.isfinite(times[-1]) else -1.0), self._status(answer)

    def _status(self, answer: dict[str, Any]) -> dict[str, Any]:
        status = answer.get("status")
        if not isinstance(status, dict):
            raise self._garbage()
        return status

    def _values(self, answer: dict[str, Any], name: str) -> NDArray[np.float64]:
        """Return a buffer of an answer, (n,); NaN where the phone has no number."""
        try:
            return np.array(answer["buffer"][name]["buffer"], dtype=float).reshape(-1)
        except (KeyError, TypeError, ValueError):
            raise self._garbage() from None

    def _get(self, path: str) -> dict[str, Any]:
        """Return the answer to a question."""
        try:
            self._http.request("GET", path)
            response = self._http.getresponse()
            body = response.read(_LARGEST_ANSWER)
        except http.client.HTTPException as error:
            self._http.close()
            raise ConnectionError(str(error) or type(error).__name__) from None
        except OSError:
            self._http.close()
            raise
        if not response.isclosed():
            self._http.close()
        try:
            answer = json.loads(body)
        except ValueError:
            answer = None
        if not isinstance(answer, dict):
            raise self._garbage()
        if response.status != http.client.OK:
            raise InputError(f"{self._port}: phyphox answers {response.status}: {str(answer.get('error', path))[:200]}")
        return answer

    def _garbage(self) -> InputError:
        return InputError(f"{self._port}: what answers there is not phyphox's remote access; {self.hint}")


def _increasing(table: NDArray[np.float64], since: float) -> NDArray[np.float64]:
    """Return the rows, (n, 4), whose time in the first column exceeds all before; phyphox sends eight digits."""
    times = np.where(np.isfinite(table[:, 0]), table[:, 0], -np.inf)
    before = np.maximum.accumulate(np.concatenate([[since], times]))[:-1]
    return np.asarray(table[times > before])
