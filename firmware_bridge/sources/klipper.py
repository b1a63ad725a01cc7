"""ADXL345 of a 3D printer through Klipper's API server: ``adxl345/dump_adxl345`` over its unix domain socket.

Source: Klipper, docs/API_Server.md (JSON messages, each ended by the byte 0x03) and klippy/extras/adxl345.py.
"""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Iterable, Iterator
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.frames.frame_format import FrameFormat
from firmware_bridge.sources.chip_merger import ChipMerger
from firmware_bridge.sources.source import pack_samples
from gfimu.base.errors import GfimuError, InputError

__all__ = ["KlipperSource", "klipper_chips"]

_ENDPOINT = "adxl345/dump_adxl345"
_SECTION = "adxl345"
_HEADER = ("time", "x_acceleration", "y_acceleration", "z_acceleration")
_END = b"\x03"
_M_PER_MM = 1e-3
_ANSWER_S = 5.0  # Klipper answers in milliseconds unless its host is overloaded
_POLL_S = 0.05
_SILENT_S = 5.0  # a batch comes every 0.1 s; Klipper says nothing when it gives up a chip
_READ_BYTES = 1 << 16
_LONGEST_MESSAGE = 1 << 22  # bytes; a batch of 0.1 s has about 20 kB
_CLOCK_BACK_S = 1.0  # from which a time that goes back is a printer that was started anew


def klipper_chips(port: str) -> tuple[str, ...]:
    """Return the chips that a URL names, ``klipper:///tmp/klippy_uds?chip=hotend,bed``; none: the only one there is.

    Raises
    ------
    InputError
        If the URL is not of this form.
    """
    parts = urlsplit(port)
    asked = parse_qs(parts.query, keep_blank_values=True)
    chips = tuple(name.strip() for value in asked.get("chip", []) for name in value.split(","))
    if not parts.path or parts.netloc or set(asked) - {"chip"} or not all(chips):
        raise InputError(f"{port}: give klipper:///PATH/OF/SOCKET?chip=NAME,NAME, such as klipper:///tmp/klippy_uds")
    if len(set(chips)) < len(chips):
        raise InputError(f"{port}: a chip is named twice; name each once")
    return chips


class KlipperSource:
    """Subscribes to one or several ADXL345 of a printer; several are brought to the sample times of the first.

    Times are Klipper's print time, the clock of all its chips; each chip samples at a pace of its own.

    Parameters
    ----------
    port : str
        ``klipper://`` and the path of the socket, with ``?chip=`` and names from the printer's configuration.
    form : FrameFormat
        `firmware_bridge.sources.source.sample_format` of an array with these tri-axial chips.

    Raises
    ------
    InputError
        If the URL is not of this form, or has not as many chips as the array.
    """

    def __init__(self, port: str, form: FrameFormat) -> None:
        self._port, self._form = port, form
        self._path = urlsplit(port).path
        self._chips = klipper_chips(port)
        self._merger = ChipMerger(self._chips or ("",))
        self._socket: socket.socket | None = None
        self._waiting = b""
        self._early: list[dict[str, Any]] = []  # batches that came before the answer to the last request
        self._trouble: Exception | None = None  # raised once what came before it is passed on
        self._heard_s: dict[int, float] = {}  # since it was opened; the first chip from then on
        self._errors: dict[str, int] = {}
        self._overflows: dict[str, int] = {}
        self._unordered = 0

    @property
    def hint(self) -> str:
        """What to check when it can't be opened or sends nothing."""
        silent = [name for index, name in enumerate(self._chips) if self._merger.newest_s(index) == -np.inf]
        if self._heard_s and silent:
            return f"chip {silent[0]!r} sends nothing; try ACCELEROMETER_QUERY CHIP={silent[0]} on the printer"
        return "start Klipper with -a SOCKET (docs: API_Server.md) and give the path of that socket"

    def open(self) -> None:
        """Connect, and subscribe to every chip."""
        if not hasattr(socket, "AF_UNIX"):
            raise InputError(f"{self._port}: this system has no unix domain sockets; record on the printer's computer")
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._waiting, self._early, self._trouble = b"", [], None
        self._merger.start_anew()
        try:
            self._socket.settimeout(_ANSWER_S)
            self._socket.connect(self._path)
            self._subscribe()
            self._socket.settimeout(_POLL_S)
        except BaseException:
            self._socket.close()
            raise
        self._heard_s = {0: time.monotonic()}

    def _subscribe(self) -> None:
        """Ask for the chips by their names in the configuration."""
        state = self._ask("info", {})
        if state.get("state", "ready") != "ready":
            reason = (str(state.get("state_message") or "").splitlines() or [""])[0]
            raise ConnectionError(f"Klipper is not ready: {reason[:200]}")
        there = self._configured()
        if not self._chips:
            if len(there) != 1:
                raise InputError(
                    f"{self._port}: the printer has {len(there)} ADXL345"
                    + (f" ({', '.join(there)}); name them with ?chip=NAME,NAME and their array with --array" if there
                       else "; put a section [adxl345] into its configuration")
                )  # fmt: skip
            self._chips = there
            self._merger = ChipMerger(there)
        for name in self._chips:
            if there and name not in there:
                raise InputError(f"{self._port}: the printer has no ADXL345 {name!r}; it has {', '.join(there)}")
            answer = self._ask(_ENDPOINT, {"sensor": name, "response_template": {"chip": name}})
            if tuple(answer.get("header", _HEADER)) != _HEADER:
                raise InputError(f"{self._port}: chip {name!r} has columns {answer['header']}; {_HEADER} are needed")

    def _configured(self) -> tuple[str, ...]:
        """Return the names of the chips in the printer's configuration."""
        answer = self._ask("objects/query", {"objects": {"configfile": ["config"]}})
        try:
            sections = list(answer["status"]["configfile"]["config"])
        except (KeyError, TypeError):
            return ()
        return tuple(name.split()[-1] for name in map(str, sections) if name.split()[:1] == [_SECTION])

    def _ask(self, method: str, parameters: dict[str, Any]) -> dict[str, Any]:
        """Return the result of a request."""
        assert self._socket is not None
        self._socket.sendall(json.dumps({"id": method, "method": method, "params": parameters}).encode() + _END)
        until = time.monotonic() + _ANSWER_S
        while time.monotonic() < until:
            messages = list(self._messages())
            self._early += [message for message in messages if message.get("id") != method]
            for message in messages:
                if message.get("id") != method:
                    continue
                if "error" in message:
                    error = message["error"]
                    said = error.get("message") if isinstance(error, dict) else error
                    chip = f" of chip {parameters['sensor']!r}" if "sensor" in parameters else ""
                    reason = " ".join(str(said).split())[:200]
                    raise InputError(f"{self._port}: Klipper refuses {method}{chip}: {reason}")
                result = message.get("result")
                if isinstance(result, dict):
                    return result
                raise self._garbage()
        raise TimeoutError(f"no answer to {method} in {_ANSWER_S:g} s")

    def _messages(self) -> Iterator[dict[str, Any]]:
        """Read once, and yield the messages that are complete."""
        assert self._socket is not None
        data = self._socket.recv(_READ_BYTES)
        if not data:
            raise ConnectionError("Klipper closed the connection")
        *texts, self._waiting = (self._waiting + data).split(_END)
        if len(self._waiting) > _LONGEST_MESSAGE:
            raise self._garbage()
        for text in texts:
            try:
                message = json.loads(text)
            except (ValueError, RecursionError):
                message = None
            if not isinstance(message, dict):
                raise self._garbage()
            yield message

    def read(self, size: int, /) -> bytes:
        """Return the samples that are complete."""
        if self._trouble is not None:
            raise self._trouble
        now = time.monotonic()
        try:
            if now - min(self._heard_s.values()) > _SILENT_S:
                raise ConnectionError(f"a chip sent nothing for {_SILENT_S:g} s")
            self._take_all(self._early, now)
            self._early = []
            self._take_all(self._messages(), now)
        except TimeoutError:
            pass
        except (OSError, GfimuError) as error:
            self._trouble = error
        t_s, readings = self._merger.take(rest=self._trouble is not None)
        return pack_samples(self._form, t_s, readings) if len(t_s) else b""

    def _take_all(self, messages: Iterable[dict[str, Any]], now: float) -> None:
        for message in messages:
            if message.get("chip") in self._chips and isinstance(message.get("params"), dict):
                self._take(self._chips.index(message["chip"]), message["params"], now)

    def _take(self, chip: int, batch: dict[str, Any], now_s: float) -> None:
        """Take a batch of one chip: rows of time, s, and three readings, mm/s²."""
        name = self._chips[chip]
        rows = self._rows(batch.get("data"), name)
        self._heard_s[chip] = now_s
        for totals, key in ((self._errors, "errors"), (self._overflows, "overflows")):
            value = batch.get(key, 0)
            totals[name] = max(totals.get(name, 0), value if isinstance(value, int) else 0)
        newest = self._merger.newest_s(chip)
        if len(rows) and rows[0, 0] < newest - _CLOCK_BACK_S:
            raise ConnectionError("the printer's clock was set anew")
        before = np.maximum.accumulate(np.concatenate([[newest], rows[:, 0]]))[:-1]
        ordered = rows[rows[:, 0] > before]
        self._unordered += len(rows) - len(ordered)
        self._merger.add(chip, ordered[:, 0], ordered[:, 1:] * _M_PER_MM)

    def _rows(self, data: Any, name: str) -> NDArray[np.float64]:
        try:
            rows = np.array(data, dtype=float).reshape(-1, len(_HEADER))
        except (TypeError, ValueError):
            rows = np.full((1, len(_HEADER)), np.nan)
        if not np.isfinite(rows).all() or (rows[:, 0] < 0.0).any():
            raise GfimuError(f"{self._port}: a batch of chip {name!r} is no list of time, x, y and z")
        return rows

    def write(self, data: bytes, /) -> None:
        """Do nothing: Klipper sets up its chips itself."""

    def close(self) -> None:
        """Close the connection; Klipper then stops the chips."""
        if self._socket is not None:
            self._socket.close()

    def facts(self) -> dict[str, Any]:
        """Chips, their rates, what their interpolation adds, and what Klipper counts of each."""
        return {
            "klipper_chips": list(self._chips),
            "klipper_errors": self._errors,
            "klipper_overflows": self._overflows,
            "klipper_samples_unordered": self._unordered,
            **self._merger.facts(),
        }

    def _garbage(self) -> InputError:
        return InputError(f"{self._port}: what answers there is not Klipper's API server (JSON ended by 0x03)")
