"""Work dealt out to processes that are split off."""

import multiprocessing
import os
import signal
import time

import pytest

from gfimu.diagnosis.fit import parallel
from gfimu.diagnosis.fit.parallel import each_apart, over_segments


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
