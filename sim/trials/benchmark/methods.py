"""Running a method over worlds of the benchmark as a campaign: resumed, on several processes, each world a row."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from gfimu.base.errors import InputError, unknown_name
from gfimu.model.user_code import user_function
from sim.trials.benchmark.answer import Answer, answer_of
from sim.trials.benchmark.baselines import BASELINES, always_unknown, best_single, greedy_bic, oracle, sysid
from sim.trials.benchmark.real import real_task
from sim.trials.benchmark.release import MEASURED, RELEASE, chosen_cases, find_case
from sim.trials.benchmark.truth_file import task_of
from sim.trials.benchmark.world import Task
from sim.trials.sweep.dataset import Dataset
from sim.trials.sweep.design import Case
from sim.trials.sweep.plan import PlanFile

__all__ = ["BASELINE_METHODS", "answer_task", "answers_of", "benchmark_plan", "benchmark_work", "named_method"]

Method = Callable[[Task], Mapping[str, Any]]
"""A method: it takes a task and returns the JSON form of an `Answer`; ``world`` and ``method`` are filled in."""


_BASELINES = zip(BASELINES, (always_unknown, best_single, greedy_bic, sysid, oracle), strict=True)
BASELINE_METHODS: Mapping[str, Method] = {name: file.answer for name, file in _BASELINES}
"""The baselines by name."""


def named_method(name: str, own: Mapping[str, Method]) -> tuple[str, Method | None]:
    """Return how a plan names a method, and its function if that comes with the benchmark.

    Parameters
    ----------
    name : str
        A key of ``own``, or ``FILE.py:function``.
    own : mapping
        Methods that come with the benchmark, by name.

    Raises
    ------
    InputError
        If there is none of that name, or the file or the function is not there.
    """
    if name in own:
        return f"{own[name].__module__}:{own[name].__name__}", own[name]
    file, colon, function = name.rpartition(":")
    if not colon or not file.endswith(".py"):
        raise unknown_name("method", name, own)
    reference = f"{Path(file).resolve()}:{function}"
    user_function(reference, "a method")
    return reference, None


def benchmark_plan(
    reference: str, sets: Sequence[str], split: str, limit: int | None = None, data: str = ""
) -> PlanFile:
    """Return the plan of a run: worlds and method.

    Parameters
    ----------
    reference : str
        Method, as `named_method` returns it.
    sets : sequence of str
        Names of sets; none: all that are drawn.
    split : str
        ``dev`` or ``test``.
    limit : int, optional
        Only so many worlds of each set; they stand in a fixed random order.
    data : str
        Folder of the measured data, which the set ``real`` needs.

    Raises
    ------
    InputError
        If there is no such set or split, or measured data are needed and not there.
    """
    chosen = chosen_cases(sets, split, limit)
    if not chosen:
        raise InputError(f"{', '.join(sets)}: has no worlds in the split {split}; choose another one")
    for case in chosen:
        if case.generator == MEASURED:
            real_task(case.world, data)
    factors: dict[str, Any] = {"world": [case.world for case in chosen], "method": [reference], "release": [RELEASE]}
    return PlanFile(factors | ({"data": [data]} if data else {}), kind="benchmark", batch=1)


def benchmark_work(case: Case, own: Method | None = None) -> dict[str, Any]:
    """Run a method that comes with the benchmark, or that of the plan's file, on a world; the answer is JSON."""
    world, reference = str(case.values["world"]), str(case.values["method"])
    measured = find_case(world).generator == MEASURED
    task = real_task(world, str(case.values["data"])) if measured else task_of(world)
    answer = answer_task(own or user_function(reference, "a method"), task)
    return {
        "verdict": answer.verdict,
        "processor_s": answer.processor_s,
        "answer": msgspec.json.encode(answer).decode(),
    }


def answer_task(method: Method, task: Task) -> Answer:
    """Let a method answer a task; what it raises becomes an answer with the verdict ``error``."""
    start = _processor_time()
    try:
        found = {**method(task), "world": task.world}
        answer = answer_of(_plain(found), f"answer for {task.world}")
    except Exception as error:  # noqa: BLE001 - whatever a foreign method may raise is an outcome that counts
        first = next(iter(f"{type(error).__name__}: {error}".splitlines()), "")
        answer = Answer(task.world, "error", error=first)
    return msgspec.structs.replace(answer, processor_s=_processor_time() - start)


def answers_of(dataset: Dataset, name: str) -> list[Answer]:
    """Return the answers in the folder of a run, by a method called ``name``; a worker that died is an error."""
    found = []
    for row in dataset.table().to_pylist():
        if row["failure"]:
            answer = Answer(row["world"], "error", error=row["failure"])
        else:
            answer = msgspec.json.decode(row["answer"], type=Answer)
        found.append(msgspec.structs.replace(answer, method=name))
    return found


def _plain(value: Any) -> Any:
    """Turn numbers and arrays of NumPy into plain ones."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value.tolist() if hasattr(value, "tolist") else value


def _processor_time() -> float:
    """Return the processor time of this process and those it has ended, s."""
    return sum(os.times()[:4])
