"""Results of the commands: each shows itself in a notebook and hands its table over, by the one mechanism."""

import ast
import collections.abc
import importlib
import inspect
import math
import re
import sys
import typing
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from test_results import checked

import gfimu
from firmware_bridge.board.trace import TraceCounts
from firmware_bridge.frames.decoder import StreamCounts
from firmware_bridge.host.record_report import RecordReport
from firmware_bridge.loop.fault_campaign import FaultOutcome, FaultReport
from firmware_bridge.loop.selftest import SelfTestReport, SelfTestRow
from firmware_bridge.loop.virtual_port import ServeReport
from firmware_bridge.loop.virtual_run import VirtualRun
from firmware_bridge.lpc1768.build import BuildReport
from firmware_bridge.strict.check import CheckReport
from firmware_bridge.strict.findings import Finding
from gfimu import CampaignStatus, DemoResult
from gfimu.base import homes_of
from gfimu.base.results import PlottedResult, TableResult
from gfimu.commands.demo_steps import Row
from gfimu.recording import ReferenceSeries, join_reference
from sim.trials.benchmark.judged import Judged
from sim.trials.benchmark.results import BenchmarkRun
from sim.trials.benchmark.table import Judgement
from sim.trials.sweep.pace import Run

PACKAGES = ("gfimu", "sim", "firmware_bridge")


def command_functions():
    """Return the public functions under the commands by name: of `gfimu`, and of its modules of commands."""
    found = {
        name: getattr(gfimu, name) for name, module in homes_of("gfimu").items() if module.startswith("gfimu.commands.")
    }
    for name in ("benchmark", "firmware"):
        module = getattr(gfimu, name)
        found |= {f"{name}.{one}": getattr(module, one) for one in module.__all__}
    return {name: one for name, one in found.items() if inspect.isfunction(one)}


def names_for_types(module):
    """Return what a module imports for type checkers only, by name."""
    tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
    blocks = [node for node in tree.body if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)]
    imports = [node for block in blocks for node in block.body if isinstance(node, ast.ImportFrom)]
    return {
        alias.asname or alias.name: getattr(importlib.import_module(node.module), alias.name)
        for node in imports
        for alias in node.names
    }


def returned(function):
    """Return the type that a function is annotated to return."""
    module = sys.modules[inspect.unwrap(function).__module__]
    kind = inspect.signature(function).return_annotation
    return eval(kind, {**vars(module), **names_for_types(module)}) if isinstance(kind, str) else kind


def own_types(annotation):
    """Yield the types of this project in an annotation, each with the containers around it."""
    arguments = typing.get_args(annotation)
    for argument in arguments:
        for one, around in own_types(argument):
            origin = typing.get_origin(annotation)
            is_container = inspect.isclass(origin) and issubclass(origin, collections.abc.Iterable)
            yield one, ((origin, *around) if is_container else around)
    if not arguments and inspect.isclass(annotation) and annotation.__module__.partition(".")[0] in PACKAGES:
        yield annotation, ()


def test_the_walk_sees_unions_containers_and_types_of_others():
    seen = list(own_types(list[SelfTestRow] | CampaignStatus | Path | None))
    assert seen == [(SelfTestRow, (list,)), (CampaignStatus, ())]
    assert list(own_types(dict[str, str])) == []
    functions = command_functions()
    assert {"design", "campaign_status", "benchmark.judge", "firmware.faults"} <= set(functions)
    assert len(functions) > 35
    assert returned(functions["firmware.run"]) == VirtualRun | ServeReport


@pytest.mark.parametrize("name", sorted(command_functions()))
def test_what_a_command_returns_shows_itself_in_a_notebook(name):
    for one, around in own_types(returned(command_functions()[name])):
        assert hasattr(one, "_repr_html_"), one
        assert issubclass(one, TableResult), one
        assert around == (), f"a container of {one.__name__} shows no table; return a result that iterates"


def test_the_page_of_the_commands_names_what_each_returns(project_root):
    page = (project_root / "docs" / "reference" / "commands.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `gfimu [^|]*\| `gfimu\.([a-z._]+)\([^|]*\| ([^|]*)\|", page, re.MULTILINE))
    assert len(rows) > 35
    functions = command_functions()
    for name, cell in rows.items():
        names = {one.__name__ for one, _ in own_types(returned(functions[name]))}
        assert names <= set(re.findall(r"`(\w+)`", cell)), name


def test_one_mechanism_makes_all_html():
    own = {
        one
        for function in command_functions().values()
        for one, _ in own_types(returned(function))
        for base in one.__mro__
        if "_repr_html_" in vars(base) and base is not TableResult
    }
    assert own == set()


def joined():
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 30.0, 0.01)
    rate = 3.0 + 2.0 * np.sin(0.7 * t) + np.sin(1.9 * t + 0.4)
    readings = np.column_stack([-0.05 * rate**2, 0.05 * np.gradient(rate, t), np.full(len(t), 9.81)])
    channels = gfimu.Recording(t, readings + rng.normal(0.0, 0.01, readings.shape), ("a11", "a12", "a13"))
    times = np.arange(1.0, 28.0, 0.05)
    reference = ReferenceSeries("tacho.csv", times - 2.5, {"tacho_rad_s": np.interp(times, t, rate)})
    return join_reference(channels, reference, force=True)


def judgement(answers):
    """Judge one answer per method, outcome and points, each to a world of its own."""
    rows = tuple(
        Judged(f"own/dev/{number}", method, () if outcome == "quiet" else ("bias",), ("bias",), outcome, points)
        for number, (method, outcome, points) in enumerate(answers)
    )
    return Judgement(rows)


COUNTS = StreamCounts(samples=100, messages=2, lost=3, corrupt=1, skipped_bytes=0, restarts=0)
FINDING = Finding("clock_off", "fault", "SSP1 <off>", 0x1A4, "main+8", 0, 0.25, 7, "switch it on", "UM10360 4.8")

MADE = {
    "Proposal": lambda: gfimu.design("cube12_turntable", ["tacho_scale", "gravity"], duration=20.0, evaluations=1),
    "Joined": joined,
    "CampaignStatus": lambda: CampaignStatus(Path("folder"), 10, 4, {"no <fit>": 1}, (Run("host", 7, 4, 2.0, 0.0),)),
    "BenchmarkList": gfimu.benchmark_list,
    "BenchmarkRun": lambda: BenchmarkRun(Path("folder"), Path("folder/answers.jsonl"), "mine", 5, 1),
    "DemoResult": lambda: DemoResult(1, (Row("drift", "1 m", "2 m", {}),), {"recording": Path("run.parquet")}),
    "RecordReport": lambda: RecordReport(Path("run.csv"), 1.0, COUNTS, 0, None, None),
    "BuildReport": lambda: BuildReport(
        "gfimu", Path("gfimu.elf"), Path("gfimu.bin"), "ab", "cd", "ziglang 0.16", 9000, 12, 3400, {"GFIMU_SPI_HZ": "1"}
    ),
    "ServeReport": lambda: ServeReport(1.0, 1.1, 2000, 0, 12, ("the clock is off",)),
    "VirtualRun": lambda: VirtualRun(gfimu.simulate("rest", seed=1, changes=["duration_s=2"]), COUNTS, None),
    "SelfTestReport": lambda: SelfTestReport((SelfTestRow("chips", False, "+0.3 g"),)),
    "TraceCounts": lambda: TraceCounts(12, 9, 1),
    "FaultReport": lambda: FaultReport((FaultOutcome("bit_flips", 90, 90, 0, COUNTS, ("overrun",), True, ""),)),
    "CheckReport": lambda: CheckReport(
        "gfimu", 0.05, "", 900, 40, 0, (120,), (115200.0,), ("8N1",), 300, 4096, 0, (FINDING,)
    ),
    "Judgement": lambda: judgement([("mine", "alone", 1.0), ("other", "wrong", -1.0)]),
}
TEXTS = {
    "Proposal": "weakest margin",
    "Joined": "rate error of the clocks",
    "CampaignStatus": "4 of 10",
    "BenchmarkList": "independent",
    "BenchmarkRun": "mine",
    "DemoResult": "run.parquet",
    "RecordReport": "run.csv",
    "BuildReport": "code and constants9000 bytes",
    "ServeReport": "the clock is off",
    "VirtualRun": "samples100",
    "SelfTestReport": "+0.3 g",
    "TraceCounts": "exceptions",
    "FaultReport": "overrun",
    "CheckReport": "300 of 4096 bytes",
    "Judgement": "100 (3–100)",
}


@pytest.mark.parametrize("name", MADE)
def test_a_result_of_a_command_shows_and_hands_over(name, tmp_path):
    result = MADE[name]()
    assert type(result).__name__ == name
    assert TEXTS[name] in checked(result._repr_html_())
    columns = result.to_columns()
    assert len({len(values) for values in columns.values()}) == 1
    assert list(result.to_pandas().columns) == list(result.to_polars().columns) == list(columns)
    assert pa.table(result).num_rows == len(result.to_pandas()) > 0
    if isinstance(result, PlottedResult):
        figure = result.plot()
        assert all(axes.get_ylabel() for axes in figure.axes)
        assert result.to_rerun(tmp_path / "result.rrd").stat().st_size > 0


def test_a_result_of_nothing_is_a_table_too():
    for empty in (
        FaultReport(()),
        SelfTestReport(()),
        CheckReport("gfimu", 0.1, "", 0, 0, 0, (), (), (), None, None, 0, ()),
    ):
        checked(empty._repr_html_())
        assert empty.to_arrow().num_rows == 0
        assert len(empty.to_pandas()) == 0


def test_reports_count_and_iterate_like_lists():
    report = MADE["SelfTestReport"]()
    assert [one.check for one in report] == ["chips"]
    assert (len(report), report[0].passed) == (1, False)
    faults = MADE["FaultReport"]()
    assert (len(faults), faults[0].fault, all(one.passed for one in faults)) == (1, "bit_flips", True)


def test_progress_without_a_process_has_no_time_left():
    still = CampaignStatus(Path("folder"), 10, 4, {}, ())
    assert "time left" not in checked(still._repr_html_())
    assert math.isnan(still.to_pandas()["left_s"][0])
    assert "3 s" in checked(MADE["CampaignStatus"]()._repr_html_())


def test_judged_answers_give_shares_and_the_deviation_of_the_mean():
    answers = [("mine", "alone", 1.0), ("mine", "alone", 1.0), ("mine", "missed", 0.0), ("mine", "quiet", 1.0)]
    (row,) = judgement(answers).to_pandas().to_dict("records")
    assert row["named_alone_share"] == pytest.approx(2 / 3)
    assert row["false_alarm_share"] == 0.0
    assert row["points"] == pytest.approx(0.75)
    assert row["points_std"] == pytest.approx(0.25)  # 0.5 / √4


def test_what_joins_gives_the_share_of_each_channel():
    result = joined()
    table = result.to_pandas().set_index("channel")["explained_share"]
    assert table["a11"] > 0.9
    assert table["a13"] < 0.1
    assert table.to_dict() == result.to_dict()["explained"]
