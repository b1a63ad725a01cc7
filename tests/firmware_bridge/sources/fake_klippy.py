"""A Klippy that answers as Klipper's API server does (docs/API_Server.md), with two ADXL345 that move on one rod."""

from __future__ import annotations

import json
import socket
import threading
from contextlib import suppress

import numpy as np

END = b"\x03"
HEADER = ["time", "x_acceleration", "y_acceleration", "z_acceleration"]
SECTIONS = ("mcu", "adxl345 hotend", "adxl345 bed", "resonance_tester")
MM_PER_M = 1e3


def motion(t_s):
    """Readings (n, 3) that every chip has at a time, m/s²."""
    t_s = np.asarray(t_s)
    return np.stack([3.0 * np.sin(2 * np.pi * 17 * t_s), 2.0 * np.cos(2 * np.pi * 31 * t_s), 9.81 + 0 * t_s], axis=-1)


class FakeKlippy:
    """Serves one connection after the other; every batch holds 0.1 s of a chip, `batches` of them.

    Rates are by chip, Hz. ``starts`` are the print times at which the clock of each connection begins.
    """

    def __init__(self, path, rates, *, batches=20, starts=(100.0,), state="ready", hold_open=True) -> None:
        self.path, self.rates, self.batches, self.starts, self.state = path, rates, batches, starts, state
        self.sections = [name for name in SECTIONS if name.split()[-1] in rates or "adxl345" not in name]
        self.hold_open = hold_open
        self.silent: set[str] = set()
        self.garbage = b""
        self.requests: list[dict] = []
        self.listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.listener.bind(str(path))
        self.listener.listen(1)
        self.listener.settimeout(0.05)
        self.done = threading.Event()
        self.thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.done.set()
        self.thread.join(5.0)
        self.listener.close()

    def _serve(self) -> None:
        for start in self.starts:
            connection = None
            while connection is None:
                with suppress(TimeoutError):
                    connection, _ = self.listener.accept()
                if self.done.is_set():
                    return
            with connection, suppress(OSError):
                self._talk(connection, start)

    def _talk(self, connection, start: float) -> None:
        connection.settimeout(0.02)
        waiting, templates, sent = b"", {}, 0
        while not self.done.is_set():
            try:
                data = connection.recv(4096)
                if not data:
                    return
                *texts, waiting = (waiting + data).split(END)
                for text in texts:
                    self._answer(connection, json.loads(text), templates)
            except TimeoutError:
                pass
            if len(templates) == len(self.rates) and sent < self.batches:
                connection.settimeout(5.0)
                for name, template in templates.items():
                    if name not in self.silent:
                        self._send(connection, {**template, "params": self._batch(name, start, sent)})
                connection.settimeout(0.02)
                sent += 1
            if sent == self.batches:
                if self.garbage:
                    connection.sendall(self.garbage)
                if not self.hold_open and start != self.starts[-1]:
                    return
                self.done.wait(0.02)

    def _answer(self, connection, request, templates) -> None:
        self.requests.append(request)
        method, parameters = request["method"], request["params"]
        if method == "info":
            result = {"state": self.state, "state_message": "Printer is " + self.state + "\nmore"}
        elif method == "objects/query":
            result = {"status": {"configfile": {"config": {name: {} for name in self.sections}}}, "eventtime": 1.0}
        elif parameters["sensor"] in self.rates:
            templates[parameters["sensor"]] = parameters["response_template"]
            result = {"header": HEADER}
        else:
            message = f"The value '{parameters['sensor']}' is not valid for sensor"
            self._send(connection, {"id": request["id"], "error": {"error": "WebRequestError", "message": message}})
            return
        self._send(connection, {"id": request["id"], "result": result})

    def _batch(self, name: str, start: float, number: int) -> dict:
        rate = self.rates[name]
        phase = 0.37 * list(self.rates).index(name)
        first, last = (int(np.ceil(0.1 * one * rate - phase)) for one in (number, number + 1))
        t_s = (np.arange(first, last) + phase) / rate
        rows = np.column_stack([np.round(start + t_s, 6), np.round(motion(t_s) * MM_PER_M, 6)])
        return {"data": rows.tolist(), "errors": 0, "overflows": number // 10}

    @staticmethod
    def _send(connection, message) -> None:
        text = json.dumps(message).encode() + END
        half = len(text) // 2
        connection.sendall(text[:half])
        connection.sendall(text[half:])
