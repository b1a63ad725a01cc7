"""A phone over HTTP, as phyphox's remote access answers (/config, /control, /get with thresholds)."""

from __future__ import annotations

import json
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qsl, urlsplit

import numpy as np
import pytest

from firmware_bridge import record
from gfimu import InputError
from gfimu.recording import Recording

RATE_HZ = 400.0
ACCELEROMETER = {
    "source": "accelerometer",
    "outputs": [{"x": "accX"}, {"y": "accY"}, {"z": "accZ"}, {"abs": "acc"}, {"t": "acc_time"}],
}
LINEAR = {"source": "linear_acceleration", "outputs": [{"x": "accX"}, {"t": "acc_time"}]}


def eight_digits(values) -> list[float]:
    return [float(f"{value:.7e}") for value in values]


class Phone:
    """The state of the app; its clock runs while it measures. ``measured_s``: what is in its buffers at the start."""

    def __init__(self, *, inputs=(ACCELEROMETER,), measured_s=0.0) -> None:
        self.inputs = list(inputs)
        self.measured_s = measured_s
        self.started: float | None = None
        self.stops_after_s = np.inf
        self.session = "3fa9c1"
        self.refuses = False
        self.broken_until = 0.0
        self.body: bytes | None = None
        self.asked: list[str] = []

    @property
    def clock_s(self) -> float:
        running = 0.0 if self.started is None else time.monotonic() - self.started
        return self.measured_s + min(running, self.stops_after_s)

    @property
    def measuring(self) -> bool:
        return self.started is not None and time.monotonic() - self.started < self.stops_after_s

    def answer(self, url: str) -> dict:
        self.asked.append(url)
        parts = urlsplit(url)
        if parts.path == "/config":
            return {"title": "Acceleration with g", "inputs": self.inputs}
        if parts.path == "/control":
            if parts.query == "cmd=start" and not self.refuses:
                self.started = time.monotonic()
            return {"result": not self.refuses}
        t_s = (np.arange(int(self.clock_s * RATE_HZ)) + 1) / RATE_HZ
        columns = {"acc_time": t_s, "accX": np.sin(t_s), "accY": np.cos(t_s), "accZ": 9.81 + 0 * t_s}
        buffers = {}
        for name, wanted in parse_qsl(parts.query, keep_blank_values=True):
            values = columns[name]
            if wanted:
                threshold, _, reference = wanted.partition("|")
                values = values[columns[reference or name] > float(threshold)]
            else:
                values = values[-1:]
            shown = eight_digits(values) if len(values) or wanted else [None]
            buffers[name] = {"size": 0, "updateMode": "partial" if wanted else "single", "buffer": shown}
        status = {"session": self.session, "measuring": self.measuring, "timedRun": False, "countDown": 0}
        return {"buffer": buffers, "status": status}


@pytest.fixture
def serve():
    servers = []

    def start(phone: Phone) -> str:
        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self) -> None:
                if time.monotonic() < phone.broken_until:
                    self.close_connection = True
                    return
                body = json.dumps(phone.answer(self.path)).encode() if phone.body is None else phone.body
                self.send_response(200)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, *_) -> None:
                pass

        server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        server.daemon_threads = True
        threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
        servers.append(server)
        return f"phyphox://127.0.0.1:{server.server_address[1]}"

    yield start
    for server in servers:
        server.shutdown()
        server.server_close()


def test_a_phone_is_one_chip(serve, tmp_path) -> None:
    phone, out = Phone(measured_s=3.0), tmp_path / "run.parquet"
    report = record(serve(phone), out, duration_s=0.6)
    recording = Recording.read(out)
    assert phone.measuring  # it was started
    assert recording.t_s[0] == pytest.approx(3.0 + 1 / RATE_HZ, abs=1e-6)  # what was there before is not recorded
    assert not len(recording.gaps)
    assert recording.sample_rate == pytest.approx(RATE_HZ, rel=1e-3)
    expected = np.column_stack([np.sin(recording.t_s), np.cos(recording.t_s), np.full(len(recording), 9.81)])
    assert np.allclose(recording.readings, expected, atol=1.1e-4)  # counts of 0.1 mm/s²
    assert (report.stream.corrupt, report.stream.restarts, report.breaks) == (0, 0, 0)
    assert recording.metadata["phyphox_experiment"] == "Acceleration with g"
    assert not any("clear" in url for url in phone.asked)


def test_a_measurement_that_runs_is_not_started_again(serve, tmp_path) -> None:
    phone = Phone()
    phone.started = time.monotonic() - 0.5
    record(serve(phone), tmp_path / "run.csv", duration_s=0.3)
    assert not any("control" in url for url in phone.asked)
    assert Recording.read(tmp_path / "run.csv").t_s[0] > 0.5


def test_stopping_on_the_phone_ends_the_recording(serve, tmp_path) -> None:
    phone, out = Phone(), tmp_path / "run.csv"
    phone.stops_after_s = 0.5
    record(serve(phone), out)
    recording = Recording.read(out)
    assert len(recording) == 200
    assert "stopped on the phone" in recording.metadata["ended_by"]


def test_a_lost_network_loses_nothing_that_the_phone_has(serve, tmp_path) -> None:
    phone, out = Phone(), tmp_path / "run.csv"
    phone.started = time.monotonic()
    breaker = threading.Timer(0.4, lambda: setattr(phone, "broken_until", time.monotonic() + 0.8))
    port = serve(phone)
    breaker.start()
    report = record(port, out, duration_s=1.8)
    recording = Recording.read(out)
    assert report.breaks == 1
    assert report.stream.restarts == 0
    assert not len(recording.gaps)


@pytest.mark.parametrize(
    ("inputs", "words"),
    [((LINEAR,), "records linear_acceleration, not the accelerometer"), ((), "records no sensor")],
)
def test_an_experiment_without_the_accelerometer(serve, tmp_path, inputs, words) -> None:
    with pytest.raises(InputError, match=words):
        record(serve(Phone(inputs=inputs)), tmp_path / "run.csv")
    assert not list(tmp_path.iterdir())


def test_a_phone_that_refuses_to_start(serve, tmp_path) -> None:
    phone = Phone()
    phone.refuses = True
    with pytest.raises(InputError, match="refuses to start"):
        record(serve(phone), tmp_path / "run.csv")


@pytest.mark.parametrize("body", [b"<html>router</html>", b"[]", b'{"inputs": 3}', b""])
def test_something_else_behind_the_address(serve, tmp_path, body) -> None:
    phone = Phone()
    phone.body = body
    with pytest.raises(InputError, match="is not phyphox's remote access; open an experiment"):
        record(serve(phone), tmp_path / "run.csv")
    assert not list(tmp_path.iterdir())


def test_no_remote_access(tmp_path) -> None:
    with pytest.raises(InputError, match=r"can't be opened \(.*refused.*allow remote access"):
        record("phyphox://127.0.0.1:1", tmp_path / "run.csv")


@pytest.mark.parametrize(
    ("port", "options", "words"),
    [
        ("phyphox://", {}, "give phyphox://ADDRESS:PORT"),
        ("phyphox://1.2.3.4:99999", {}, "give phyphox://ADDRESS:PORT"),
        ("phyphox://1.2.3.4:80", {"form": "mimu4444"}, "--format is for frames"),
        ("phyphox://1.2.3.4:80", {"array": "cube12"}, "has 4 chips with 12 axes; this source has 1"),
        ("phyphox://1.2.3.4:80", {"setup": (b"rate",)}, "has no commands"),
    ],
)
def test_what_a_phone_can_not_have(tmp_path, port, options, words) -> None:
    with pytest.raises(InputError, match=words):
        record(port, tmp_path / "run.csv", **options)
