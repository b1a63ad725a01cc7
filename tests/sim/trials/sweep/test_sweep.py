"""Campaigns: the cases of a plan, and that nothing is lost or run twice, whatever dies."""

from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial

import numpy as np
import pyarrow.parquet as pq
import pytest
from sweep_cases import always_dies, dies_once, quick

from gfimu import InputError
from sim.trials import Dataset, Design, load_plan
from sim.trials.sweep.engine import Workers, run_campaign
from sim.trials.sweep.pool import open_pool
from sim.trials.sweep.summary import failures, grouped

GRID = """
repeats = 3
seed = 7
batch = 4
[factors]
size = [1, 2, 5]
name = ["x", "y"]
"""
SPREAD = """
design = "{design}"
points = 64
[factors]
size = [1, 2]
[factors.noise]
low = 1e-3
high = 1e-1
scale = "log"
[factors.angle]
low = -1.0
high = 3.0
"""


def plan_file(folder, text):
    path = folder / "plan.toml"
    path.write_text(text)
    return path


def died(error):
    return 1 if isinstance(error, BrokenExecutor) else None


@contextmanager
def threads(count=2):
    with ThreadPoolExecutor(count) as pool:
        yield Workers(pool, lambda: count, died)


def pool():
    return open_pool(2)


def run(folder, plan, work=quick, opened=threads):
    dataset = Dataset.create(folder, plan)
    return dataset, run_campaign(dataset, work, opened)


def content(folder):
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


def test_a_grid_has_every_combination_with_every_seed(tmp_path):
    design = Design(load_plan(plan_file(tmp_path, GRID)))
    cases = [design[number] for number in range(len(design))]
    assert len(cases) == 3 * 2 * 3
    assert len({(case.values["size"], case.values["name"], case.seed) for case in cases}) == 18
    assert len({case.seed for case in cases}) == 3  # combinations are compared on the same chips


@pytest.mark.parametrize("design", ["random", "latin_hypercube", "sobol"])
def test_ranges_are_filled_evenly(tmp_path, design):
    drawn = Design(load_plan(plan_file(tmp_path, SPREAD.format(design=design))))
    values = [drawn[number].values for number in range(len(drawn))]
    noise, angle = np.array([v["noise"] for v in values]), np.array([v["angle"] for v in values])
    assert noise.min() >= 1e-3
    assert noise.max() <= 1e-1
    assert angle.min() >= -1.0
    assert angle.max() <= 3.0
    deciles = np.histogram(np.log10(noise), np.linspace(-3, -1, 9))[0]
    assert deciles.max() - deciles.min() <= (15 if design == "random" else 1)  # 8 of 64 each
    assert {v["size"] for v in values} == {1, 2}


def test_a_campaign_that_goes_on_gives_the_same_bytes(tmp_path):
    plan = plan_file(tmp_path, GRID)
    _, ran = run(tmp_path / "whole", plan)
    assert ran == 18
    part, _ = run(tmp_path / "part", plan, opened=partial(threads, 1))
    shards = sorted((tmp_path / "part").glob("*.parquet"))
    for shard in shards[1:4]:
        shard.unlink()
    ran_again = run_campaign(part, quick, threads)
    assert ran_again == sum(min(4, 18 - 4 * number) for number in (1, 2, 3))
    assert content(tmp_path / "whole") == content(tmp_path / "part")
    assert run_campaign(part, quick, threads) == 0


def test_a_failed_case_is_a_row(tmp_path):
    dataset, _ = run(tmp_path / "out", plan_file(tmp_path, "[factors]\nsize = [1, 3, 4]\n"))
    table = dataset.table()
    assert table["failure"].to_pylist() == ["", "size 3 is not made", "ZeroDivisionError: by nothing"]
    assert failures(table) == {"size 3 is not made": 1, "ZeroDivisionError: by nothing": 1}


def test_a_worker_that_dies_costs_nothing(tmp_path, monkeypatch):
    monkeypatch.setenv("GFIMU_TEST_MARKER", str(tmp_path / "marker"))
    plan = plan_file(tmp_path, GRID)
    run(tmp_path / "undisturbed", plan)
    run(tmp_path / "disturbed", plan, dies_once, pool)
    assert (tmp_path / "marker").exists()
    assert content(tmp_path / "undisturbed") == content(tmp_path / "disturbed")


def test_a_batch_that_a_broken_pool_refuses_is_not_lost(tmp_path):
    """A worker may die while another batch ends: the pool then raises where the next one is submitted."""
    pools = []

    class Refusing(ThreadPoolExecutor):
        taken = 0

        def submit(self, *task):
            if self is pools[0] and self.taken == 2:
                raise BrokenProcessPool("a worker died")
            self.taken += 1
            return super().submit(*task)

    @contextmanager
    def opened():
        pools.append(Refusing(2))
        with pools[-1] as executor:
            yield Workers(executor, lambda: 2, died)

    plan = plan_file(tmp_path, GRID)
    run(tmp_path / "undisturbed", plan)
    run(tmp_path / "disturbed", plan, opened=opened)
    assert len(pools) > 1
    assert content(tmp_path / "undisturbed") == content(tmp_path / "disturbed")


class Unreliable(Executor):
    """Holds batches for a while, and at random breaks, loses or cancels them, or loses a worker under one of them."""

    def __init__(self, rng, log):
        self.rng, self.log, self.pending, self.broken = rng, log, [], False

    def count(self):
        for future, task in self.pending[: 1 + self.rng.integers(3)]:
            self.finish(future, task)
        return int(self.rng.integers(1, 4))

    def submit(self, function, *values):
        if self.broken or self.rng.random() < 0.05:
            self.give_up()
            raise BrokenExecutor("refused")
        future = Future()
        self.pending.append((future, (function, values)))
        return future

    def finish(self, future, task):
        self.pending.remove((future, task))
        chance, (function, values) = self.rng.random(), task
        if chance < 0.08:
            future.cancel()
            future.set_running_or_notify_cancel()
        elif chance < 0.15:
            future.set_exception(WorkerDied())
        elif chance < 0.2:
            future.set_exception(BrokenExecutor("broke"))
            self.give_up()
        else:
            self.log.append(values[2])  # first case of a batch whose rows are returned
            future.set_result(function(*values))

    def give_up(self):
        self.broken = True
        for future, _ in self.pending:
            future.set_exception(BrokenExecutor("broke"))
        self.pending.clear()


class WorkerDied(Exception):
    """As Dask reports it: of one batch alone."""


def test_whatever_an_executor_does_each_batch_is_written_once(tmp_path, monkeypatch):
    """Random losses at every place where an executor can lose a batch; rows that were returned are never made again."""
    monkeypatch.setattr("sim.trials.sweep.engine._LOOK", 1e-3)
    monkeypatch.setattr("sim.trials.sweep.engine._TRIES", 99)
    plan = plan_file(tmp_path, GRID.replace("batch = 4", "batch = 1"))
    undisturbed = content(run(tmp_path / "undisturbed", plan)[0].folder)
    for seed in range(20):
        rng, log, pools = np.random.default_rng(seed), [], []

        @contextmanager
        def opened(rng=rng, log=log, pools=pools):
            pools.append(Unreliable(rng, log))
            lost = (CancelledError, BrokenExecutor)
            yield Workers(
                pools[-1], pools[-1].count, lambda e: 1 if isinstance(e, WorkerDied) else 0 * isinstance(e, lost)
            )

        dataset, ran = run(tmp_path / str(seed), plan, opened=opened)
        assert ran == 18
        assert sorted(log) == list(range(18))
        assert content(dataset.folder) == undisturbed


def test_a_batch_that_kills_its_worker_each_time_is_reported(tmp_path):
    dataset, ran = run(tmp_path / "out", plan_file(tmp_path, GRID), always_dies, pool)
    assert ran == 18
    rows = dataset.table().to_pylist()
    assert [row["case"] for row in rows if row["failure"]] == [4, 5, 6, 7]
    assert "died 3 times" in rows[5]["failure"]


def test_results_are_grouped_by_factors(tmp_path):
    dataset, _ = run(tmp_path / "out", plan_file(tmp_path, GRID))
    table = pq.ParquetDataset(sorted((tmp_path / "out").glob("*.parquet"))).read()
    rows = table.to_pylist()
    groups = grouped(table, dataset.plan, ["size"])
    assert [(group.values, group.result, group.cases) for group in groups[:2]] == [
        ({"size": 1}, "result_m", 6),
        ({"size": 1}, "good", 6),
    ]
    ones = [row["result_m"] for row in rows if row["size"] == 1]
    assert groups[0].median == np.median(ones)
    share = np.mean([row["good"] for row in rows if row["size"] == 1])
    assert groups[1].median == pytest.approx(share)
    assert groups[1].low <= share <= groups[1].high
    with pytest.raises(InputError, match="unknown factor 'sise'"):
        grouped(table, dataset.plan, ["sise"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[factors]\n", r"\[factors\] is empty"),
        ("points = 3\n[factors]\na = [1]\n", "leave points out"),
        ('design = "random"\n[factors]\na = [1]\n', "needs points"),
        ('design = "sobol"\npoints = 6\n[factors]\na = [1]\n', "powers of two; use 4 or 8"),
        ("[factors.a]\nlow = 1.0\nhigh = 2.0\n", "levels"),
        ("[factors.a]\nlow = 2.0\nhigh = 1.0\nlevels = 2\n", "not below"),
        ('[factors.a]\nlow = -1.0\nhigh = 1.0\nlevels = 2\nscale = "log"\n', "no logarithm"),
        ("[factors]\na = []\n", r"\[factors\] a = \[\]: must be a list of values"),
        ("[factors]\na = 5\n", r"\[factors\] a = 5: must be a list of values"),
        ("[factors]\na = [[1]]\n", r"\[factors\] a = \[\[1\]\]: must be a list of values"),
        ("[factors]\na = [1.0, nan]\n", r"a = \[1.0, nan\]: must be finite"),
        ("[factors.a]\nlow = 1.0\nhigh = 2.0\nlevels = 1\n", r"\[factors\] a: levels = 1 must be"),
        ("[factors.a]\nlo = 1.0\n", "a: unknown key 'lo'; .* did you mean 'low'"),
        ("factor = 3\n", "factor"),
    ],
)
def test_a_wrong_plan_is_one_line(tmp_path, text, message):
    with pytest.raises(InputError, match=message) as refused:
        load_plan(plan_file(tmp_path, text))
    assert "\n" not in str(refused.value)


def test_folders_of_others_are_left_alone(tmp_path):
    plan = plan_file(tmp_path, GRID)
    run(tmp_path / "out", plan)
    other = plan_file(tmp_path, GRID.replace("seed = 7", "seed = 8"))
    with pytest.raises(InputError, match="another plan"):
        Dataset.create(tmp_path / "out", other)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "letter.txt").touch()
    with pytest.raises(InputError, match="not empty and no campaign"):
        Dataset.create(tmp_path / "full", plan)
    with pytest.raises(InputError, match="no campaign"):
        Dataset.open(tmp_path / "full")


@pytest.mark.parametrize(
    "text",
    [
        "repeats = 1000000000000000000000\n[factors]\na = [1]\n",
        "[factors]\n" + "".join(f"a{number} = {list(range(20))}\n" for number in range(20)),
    ],
)
def test_more_files_than_a_folder_can_have_are_refused_at_once(tmp_path, text):
    with pytest.raises(InputError, match="use a larger batch"):
        Dataset.create(tmp_path / "out", plan_file(tmp_path, text))
    assert not (tmp_path / "out").exists()
