"""Work dealt out to processes that are split off."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from gfimu.diagnosis.fit import parallel
from gfimu.diagnosis.fit.parallel import each_apart, over_segments
from gfimu.diagnosis.time_limit import TIME_LIMIT, check_time, limited_to, unlimited


def test_results_come_in_the_order_of_the_items():
    def late(number):
        time.sleep(0.02 * (5 - number))
        return number, [number] * 100_000

    assert [number for number, _ in each_apart(late, range(5))] == list(range(5))
    assert each_apart(late, []) == []


@pytest.mark.usefixtures("several_processors")
def test_what_is_changed_elsewhere_stays_as_it_was_here():
    state = {"changed": 0}

    def change(number):
        state["changed"] += number + 1
        return os.getpid()

    processes = each_apart(change, range(4))
    assert os.getpid() not in processes
    assert state["changed"] == 0


@pytest.mark.usefixtures("several_processors")
def test_an_error_is_raised_here_and_no_process_is_left():
    def fail(number):
        if number == 2:
            raise ValueError("the third")
        time.sleep(0.05)
        return number

    with pytest.raises(ValueError, match="the third"):
        each_apart(fail, range(40))
    assert not multiprocessing.active_children()


@pytest.mark.usefixtures("several_processors")
def test_a_process_that_is_killed_is_told():
    def die(number):
        if number == 1:
            os.kill(os.getpid(), signal.SIGKILL)
        return number

    with pytest.raises(RuntimeError, match="ended without an answer"):
        each_apart(die, range(4))
    assert not multiprocessing.active_children()


@pytest.mark.usefixtures("several_processors")
def test_a_result_that_cannot_be_sent_is_computed_here():
    results = each_apart(lambda number: lambda: number, range(3))
    assert [result() for result in results] == [0, 1, 2]


def test_without_processes_the_work_is_done_all_the_same(monkeypatch):
    def refuse(*_):
        raise BlockingIOError("no more processes")

    monkeypatch.setattr(parallel, "_Apart", refuse)
    assert each_apart(lambda number: number**2, range(4)) == [0, 1, 4, 9]


@pytest.mark.usefixtures("several_processors")
def test_a_process_that_was_split_off_splits_off_none():
    def nested(number):
        inner = each_apart(lambda _: os.getpid(), range(3))
        return os.getpid(), inner

    for process, inner in each_apart(nested, range(2)):
        assert set(inner) == {process}


def test_segments_are_worked_on_here():
    state = {"changed": 0}

    def change(one, other):
        state["changed"] += 1
        return one + other

    assert over_segments(change, [1, 2, 3], [10, 20, 30]) == [11, 22, 33]
    assert state["changed"] == 3


PARENT = """
import os, sys, time
from gfimu.diagnosis.fit import parallel
parallel._processors = lambda: 2
def work(number):
    os.write(1, f"{os.getpid()}\\n".encode())
    time.sleep(60)
parallel.each_apart(work, range(2))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="processes are split off on Linux only")
def test_no_process_lives_on_when_its_parent_ends():
    usual = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    numbers = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
    parents = {number: subprocess.Popen([sys.executable, "-c", PARENT], **usual) for number in numbers}
    for number, parent in parents.items():
        workers = [int(parent.stdout.readline()) for _ in range(2)]
        parent.send_signal(number)
        parent.wait(timeout=10)
        until = time.monotonic() + 2.0
        while any(map(is_running, workers)) and time.monotonic() < until:
            time.sleep(0.05)
        assert not any(map(is_running, workers)), number


def is_running(number):
    """Whether a process has not ended; one that nobody has asked for its exit code has."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.usefixtures("several_processors")
def test_what_is_done_is_kept_when_the_time_is_over():
    def work(number):
        while number > 2:
            time.sleep(0.02)
            check_time()
        return number

    kept = []
    with pytest.raises(KeyboardInterrupt, match=TIME_LIMIT), limited_to(2.0):
        each_apart(work, range(9), keep=kept.append)
    assert sorted(kept) == [0, 1, 2]
    assert not multiprocessing.active_children()


def test_threads_end_with_what_they_work_for(monkeypatch):
    monkeypatch.setattr(parallel, "_processors", lambda: 2)
    ended, begun = [], threading.Event()

    def work(number):
        if number == 0:
            assert begun.wait(10.0)
            raise KeyboardInterrupt
        begun.set()
        until = time.monotonic() + 20.0
        while time.monotonic() < until:
            try:
                check_time()
            except KeyboardInterrupt:
                ended.append(number)
                raise

    with limited_to(100.0), pytest.raises(KeyboardInterrupt):
        over_segments(work, range(2))
    assert ended == [1]
    check_time()


def test_an_inner_limit_is_no_longer_than_the_outer_one():
    with limited_to(-1.0):
        with limited_to(100.0), pytest.raises(KeyboardInterrupt):
            check_time()
        with unlimited():
            check_time()
