"""Work dealt out to processes that are split off."""

import multiprocessing
import os
import signal
import sys
import time

import pytest

from gfimu.diagnosis.parallel import each_apart, over_segments

SPLITS = pytest.mark.skipif(
    sys.platform != "linux" or len(os.sched_getaffinity(0)) < 2, reason="one processor, or none is split off"
)


def test_results_come_in_the_order_of_the_items():
    def late(number):
        time.sleep(0.02 * (5 - number))
        return number, [number] * 100_000

    assert [number for number, _ in each_apart(late, range(5))] == list(range(5))
    assert each_apart(late, []) == []


@SPLITS
def test_what_is_changed_elsewhere_stays_as_it_was_here():
    state = {"changed": 0}

    def change(number):
        state["changed"] += number + 1
        return os.getpid()

    processes = each_apart(change, range(4))
    assert os.getpid() not in processes
    assert state["changed"] == 0


@SPLITS
def test_an_error_is_raised_here_and_no_process_is_left():
    def fail(number):
        if number == 2:
            raise ValueError("the third")
        time.sleep(0.05)
        return number

    with pytest.raises(ValueError, match="the third"):
        each_apart(fail, range(40))
    assert not multiprocessing.active_children()


@SPLITS
def test_a_process_that_is_killed_is_told():
    def die(number):
        if number == 1:
            os.kill(os.getpid(), signal.SIGKILL)
        return number

    with pytest.raises(RuntimeError, match="ended without an answer"):
        each_apart(die, range(4))
    assert not multiprocessing.active_children()


@SPLITS
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
