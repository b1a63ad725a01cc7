"""Campaigns on a Dask cluster of several processes: whatever dies or leaves, nothing is lost and nothing runs twice."""

import os
import signal
import sys
import threading
from collections import Counter
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import ModuleType

import pytest
from sweep_cases import always_dies, counted, waits

from gfimu import GfimuError, InputError, RecordingWarning
from sim.trials import Dataset
from sim.trials.sweep.cluster import open_cluster
from sim.trials.sweep.engine import run_campaign
from sim.trials.sweep.executors import check_cluster, open_workers
from sim.trials.sweep.pool import open_pool

dask = pytest.importorskip("dask")
distributed = pytest.importorskip("distributed")

PLAN = """
repeats = 12
seed = 7
batch = 2
[factors]
size = [1, 2, 5]
"""


@contextmanager
def cluster(workers=2):
    """A scheduler and worker processes; a worker that is killed is started again, as by a batch system."""
    with distributed.LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as found:
        yield found


@pytest.fixture
def slurm(tmp_path, monkeypatch):
    """Commands that submit and cancel jobs as Slurm's do, on this machine; returns the file of what they did."""
    pytest.importorskip("dask_jobqueue")
    tools, done = tmp_path / "tools", tmp_path / "jobs"
    tools.mkdir()
    (tools / "sbatch").write_text(
        f'#!/bin/sh\njob={tmp_path}/$$.sh\ncp "$1" $job\n'  # as Slurm does: the caller deletes its file at once
        f"setsid sh $job >/dev/null 2>&1 &\necho submitted $! >>{done}\necho Submitted batch job $!\n"
    )
    (tools / "scancel").write_text(f"#!/bin/sh\necho cancelled $1 >>{done}\nkill -- -$1\n")
    for tool in tools.iterdir():
        tool.chmod(0o755)
    monkeypatch.setenv("PATH", str(tools), prepend=os.pathsep)
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent), prepend=os.pathsep)  # of the work, for the jobs
    # A worker that starts on a busy machine may need longer than the minute after which it gives up by default.
    size = {"cores": 1, "processes": 1, "memory": "1GiB", "walltime": "00:10:00", "death-timeout": 600}
    with dask.config.set({f"jobqueue.slurm.{key}": value for key, value in size.items()}):
        yield done


@pytest.fixture
def ran(tmp_path, monkeypatch):
    """Run the plan, counting how often each case is run; returns folder content, and executions per case."""
    plan, marks = tmp_path / "plan.toml", tmp_path / "marks"
    plan.write_text(PLAN)
    marks.mkdir()
    monkeypatch.setenv("GFIMU_TEST_MARKER", str(marks))  # of workers that start from now on

    def run(name, opened, work=counted, progress=None):
        for mark in marks.iterdir():
            mark.unlink()
        dataset = Dataset.create(tmp_path / name, plan)
        run_campaign(dataset, work, opened, progress=progress)
        times = Counter(int(mark.name.partition("-")[0]) for mark in marks.iterdir())
        content = {file.name: file.read_bytes() for file in sorted((tmp_path / name).iterdir())}
        return content, [times[case] for case in range(36)], dataset

    return run


def after(cases, change):
    """Progress that calls ``change`` once, in a thread of its own, when so many cases are done."""
    begun = []

    def progress(done, total):
        if done >= cases and not begun:
            begun.append(threading.Thread(target=change, daemon=True))
            begun[0].start()

    return progress


def test_a_cluster_gives_the_bytes_of_the_pool_whoever_dies_or_leaves(ran):
    """Several seconds, as processes start: a pool, a cluster, and a worker in place of each that ends."""
    pool, once, _ = ran("pool", partial(open_pool, 2))
    assert set(once) == {1}
    with cluster() as found:
        opened = partial(open_cluster, found.scheduler_address)
        with distributed.Client(found, set_as_default=False) as client:
            undisturbed, times, _ = ran("undisturbed", opened)
            assert undisturbed == pool
            assert set(times) == {1}

            def kill():
                (pid, *_) = client.run(os.getpid).values()
                os.kill(pid, signal.SIGKILL)

            killed, times, _ = ran("killed", opened, waits, after(6, kill))
            assert killed == pool
            assert min(times) == 1
            assert sum(times) <= 36 + 2 * 2  # the batches that its worker held, at most

            def leave():
                (address, *_) = client.scheduler_info()["workers"]
                client.retire_workers([address], close_workers=True)

            left, times, _ = ran("left", opened, waits, after(6, leave))
            assert left == pool
            assert min(times) == 1
            assert sum(times) <= 36 + 2 * 2


@pytest.mark.study
def test_a_batch_that_kills_each_worker_of_a_cluster_is_reported_and_no_other_runs_again(ran):
    with dask.config.set({"distributed.scheduler.allowed-failures": 0}), cluster() as found:
        _, _, dataset = ran("out", partial(open_cluster, found.scheduler_address), always_dies)
    rows = dataset.table().to_pylist()
    assert [row["case"] for row in rows] == list(range(36))
    assert [row["case"] for row in rows if row["failure"]] == [4, 5]
    assert "died 3 times" in rows[5]["failure"]


@pytest.mark.study
def test_a_lost_connection_ends_in_one_line_and_another_call_goes_on(ran):
    with cluster(1) as found:
        address = found.scheduler_address
        with pytest.raises(InputError, match=rf"--cluster {address}: no Dask scheduler answers"):
            ran("out", partial(open_cluster, address), waits, after(6, found.close))
    _, times, dataset = ran("out", partial(open_pool, 1))
    assert set(times) == {0, 1}
    assert len(dataset.table()) == 36


def test_work_that_no_worker_finds_is_one_line(ran, monkeypatch):
    module = ModuleType("only_here")
    exec("def work(case):\n    return {}", module.__dict__)
    monkeypatch.setitem(sys.modules, "only_here", module)
    with cluster(1) as found, pytest.raises(GfimuError, match=r"No module named 'only_here'.*same gfimu") as refused:
        ran("out", partial(open_cluster, found.scheduler_address), module.work)
    assert "\n" not in str(refused.value)


def test_jobs_of_slurm_give_the_bytes_of_the_pool_and_are_cancelled(ran, slurm):
    expected, *_ = ran("pool", partial(open_pool, 2))
    with pytest.warns(RecordingWarning, match="squeue"):
        found, times, _ = ran("slurm", partial(open_workers, 2, "slurm"))
    assert found == expected
    assert times == [1] * 36
    did = [line.split() for line in slurm.read_text().splitlines()]
    assert [what for what, _ in did] == ["submitted"] * 2 + ["cancelled"] * 2
    assert {job for what, job in did if what == "submitted"} == {job for what, job in did if what == "cancelled"}


def test_slurm_that_is_not_there_is_one_line(monkeypatch, slurm):
    check_cluster("slurm")
    assert not slurm.exists()  # nothing was submitted
    with dask.config.set({"jobqueue.slurm.memory": None}), pytest.raises(InputError, match=r"jobqueue\.yaml"):
        check_cluster("slurm")
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(InputError, match="no sbatch here"):
        check_cluster("slurm")
