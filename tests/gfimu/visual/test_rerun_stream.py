"""Rerun streams: a file is whole or not there; viewers listen to this machine only."""

from __future__ import annotations

import gc
import socket
import subprocess
import sys
import time

import pytest

from firmware_bridge.host.live import LiveView
from gfimu import AccelerometerArray, GfimuError
from gfimu.base.files.rerun_stream import rrd_stream
from gfimu.visual import viewer
from gfimu.visual.live import LivePicture
from gfimu.visual.viewer import viewer_command, viewer_stream


@pytest.fixture
def picture(tmp_path):
    """A rerun recording with one line of text."""
    import rerun as rr

    file = tmp_path / "look.rrd"
    with rrd_stream(file, "test") as stream:
        stream.log("text", rr.TextLog("said"))
    return file


def test_the_file_is_complete(picture):
    verified = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "verify", str(picture)], capture_output=True, check=False
    )
    assert verified.returncode == 0, verified.stderr


def test_a_block_that_fails_leaves_no_file_and_says_nothing(tmp_path, capfd):
    import rerun as rr

    def fail():
        with rrd_stream(tmp_path / "look.rrd", "test") as stream:
            stream.log("text", rr.TextLog("said"))
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    gc.collect()
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr().err == ""


def test_a_live_view_keeps_or_drops_its_picture(tmp_path, capfd):
    cube = AccelerometerArray.load("cube12")
    LiveView(cube, 0.04, rrd=tmp_path / "kept.rrd", picture=LivePicture(cube)).close()
    LiveView(cube, 0.04, rrd=tmp_path / "dropped.rrd", picture=LivePicture(cube)).close(keep=False)
    gc.collect()
    assert [file.name for file in tmp_path.iterdir()] == ["kept.rrd"]
    assert capfd.readouterr().err == ""


def bound_to_loopback(command):
    return command[command.index("--bind") + 1] == "127.0.0.1"


def test_view_opens_a_viewer_on_this_machine_only(picture, monkeypatch):
    calls = []

    def run(command, **_):
        calls.append(command)
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(viewer.subprocess, "run", run)
    viewer.open_viewer(picture)
    assert calls[0][-1] == str(picture)
    assert bound_to_loopback(calls[0])


def test_remedies_say_so_too(picture, monkeypatch):
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(viewer.subprocess, "run", lambda command, **_: subprocess.CompletedProcess(command, 1))
    with pytest.raises(GfimuError, match=r"rerun --web-viewer --bind 127\.0\.0\.1 .*look\.rrd"):
        viewer.open_viewer(picture)
    monkeypatch.delenv("DISPLAY")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(viewer, "_PORT", free_port())
    with pytest.raises(GfimuError, match=r"rerun --web-viewer --bind 127\.0\.0\.1` first .*--rrd"):
        viewer_stream("test")
    with pytest.raises(GfimuError, match=r"rerun --web-viewer --bind 127\.0\.0\.1 .*look\.rrd"):
        viewer.open_viewer(picture)


def test_a_viewer_that_does_not_start_is_one_line(monkeypatch):
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(viewer, "_PORT", free_port())
    monkeypatch.setattr(viewer, "viewer_command", lambda *_: [sys.executable, "-c", "raise SystemExit(3)"])
    with pytest.raises(GfimuError, match="does not start here"):
        viewer_stream("test")


def test_record_opens_a_viewer_on_this_machine_only(monkeypatch):
    """A real rerun server in place of the window: no other address of this machine answers."""
    port = free_port()
    started = []

    def command(*arguments):
        started.append(viewer_command(*arguments, "--serve-grpc"))
        return started[0]

    popen = subprocess.Popen
    processes = []
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(viewer, "_PORT", port)
    monkeypatch.setattr(viewer, "viewer_command", command)
    monkeypatch.setattr(viewer.subprocess, "Popen", lambda *a, **k: processes.append(popen(*a, **k)) or processes[0])
    try:
        stream = viewer_stream("test")
        stream.flush(timeout_sec=5)
        stream.disconnect()
        assert bound_to_loopback(started[0])
        assert answers("127.0.0.1", port)
        assert not answers("127.0.0.2", port)  # a server on all addresses would
        viewer_stream("test").disconnect()
        assert len(processes) == 1  # the viewer that is there is used again
    finally:
        for process in processes:
            viewer._end(process)
    end = time.monotonic() + 10.0
    while answers("127.0.0.1", port):
        assert time.monotonic() < end, "the server is left running"
        time.sleep(0.05)


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def answers(host, port):
    with socket.socket() as probe:
        probe.settimeout(1.0)
        return probe.connect_ex((host, port)) == 0
