"""--json: one object on standard output and nothing else, as `gfimu schema` describes it; errors too."""

from __future__ import annotations

import importlib
import json
import math
import socket
import subprocess
import sys
import time

import msgspec
import numpy as np
import pytest

import gfimu
from gfimu.cli.app import program
from gfimu.commands.results.base import Result
from gfimu.commands.schema import schema_names
from gfimu.errors import InputError
from gfimu.recording import Recording

schema_file = importlib.import_module("gfimu.commands.schema")

CALLS = {
    "list arrays": "list",
    "show adxl355": "show",
    "new array --out a.toml --schema a.json": "new",
    "schema score": "schema",
    "simulate rest --set duration_s=2 --out made.csv": "simulate",
    "inspect log.csv --out map.toml": "inspect",
    "convert run.csv made.parquet": "convert",
    "convert run.csv clean.csv --drop corrupt,duplicates": "convert",
    "convert cube12 cube.xml --to turntable": "convert",
    "convert cal.json imu.yaml --to ros --chip a1 --noise rest.csv": "convert",
    "join channels.csv tacho.csv --reference-map tacho.toml --out joined.csv": "join",
    "calibrate multi-position poses.csv --out cal_again.json": "calibrate",
    "certificate cal.json --out cert": "certificate",
    "certificate cal.json --compare cal.json": "certificate",
    "noise rest.csv --kalibr kalibr.yaml": "noise",
    "noise rest.csv --axis z --axis-point -0.1 0 0": "noise",
    "estimate run.csv --rest-bias --position --latitude 52 --out est.csv": "estimate",
    "estimate run.csv --method filter --out est.csv": "estimate",
    "impact run.csv --cfc 10 --threshold-g 0.05 --out filtered.csv": "impact",
    "view run.csv --out run.rrd": "view",
    "check run.csv --twin cube12_turntable": "check",
    "diagnose run.csv --twin cube12_turntable --check": "diagnose",
    "diagnose run.csv --twin cube12_turntable --out diag": "diagnose",
    "design tacho_scale gravity --twin cube12_turntable --evaluations 1 --out next.toml": "design",
    "score cube12 wheel_pair p3_three_plus_one --per-channel": "score",
    "score one_chip --axis z --axis-point -0.1 0 0": "score",
    "optimize --chips 4 --restarts 2 --out best.toml": "optimize",
    "optimize --chips 4 --most-chips 5 --pareto chips gdop --restarts 2 --front front": "optimize",
    "drift --bias-mg 10 --duration 2 --monte-carlo 4": "drift",
    "drift rest.csv --duration 2 --lead 5": "drift",
    "drift --from-position 6.4 0 0 --latitude 35": "drift",
    "drift --array one_chip --axis z --axis-point -0.1 0 0 --bias-mg 5 --noise-ug 290": "drift",
    "tolerance cube12 --units 10 --workers 1 --calibrated none": "tolerance",
    "tolerance cube12 --closed-form --picture t.png": "tolerance",
    "campaign plan.toml --out camp --workers 1": "campaign",
    "campaign status camp": "campaign status",
    "campaign table camp --csv q.csv": "campaign table",
    "campaign plot camp --out q.svg": "campaign plot",
    "benchmark list": "benchmark list",
    "benchmark worlds --sets own --limit 1 --out worlds": "benchmark worlds",
    "benchmark run always_unknown --sets own --limit 1 --out bench": "benchmark run",
    "benchmark judge bench --partial --out judged_again.jsonl": "benchmark judge",
    "benchmark table judged.jsonl": "benchmark table",
    "firmware run --scenario rest --duration 0.5 --out fw.csv": "firmware run",
    "firmware selftest": "firmware selftest",
    "firmware trace --duration 0.002 --out trace.vcd": "firmware trace",
    "firmware check --duration 0.05": "firmware check",
}
"""Calls, and the command whose schema their results have."""

BY_HAND = {"demo", "live", "record", "firmware build", "firmware faults"}
"""Commands with a test of their own, below or beside those of the command."""


def program_names():
    import typer

    for name, command in typer.main.get_command(program()).commands.items():
        if hasattr(command, "commands"):
            default = getattr(command, "default", "")
            yield from (name if inner == default else f"{name} {inner}" for inner in command.commands)
        else:
            yield name


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """A folder with the files that the calls read."""
    folder = tmp_path_factory.mktemp("json")
    gfimu.simulate("paper_run", changes=["duration_s=25"], seed=1, out=folder / "run.csv")
    gfimu.simulate("rest", changes=["duration_s=30"], out=folder / "rest.csv")
    gfimu.simulate("calibration_poses", out=folder / "poses.csv")
    gfimu.calibrate("multi-position", folder / "poses.csv", out=folder / "cal.json")
    (folder / "log.csv").write_text("ms,ax,ay,az\n" + "".join(f"{10 * k},0.{k % 7},0.0,1.0\n" for k in range(100)))
    run = Recording.read(folder / "run.csv")
    array = gfimu.AccelerometerArray.load("cube12")
    Recording(run.t_s, run.readings, run.channels).carrying(array).write(folder / "channels.csv")
    times = np.arange(0.003, 24.0, 0.05)
    rates = np.interp(times, run.t_s, run.reference["tacho_rad_s"]) * 30.0 / math.pi
    rows = zip(1000.0 * (times - 3.05) / 1.0035, rates, strict=True)
    (folder / "tacho.csv").write_text("millis;speed\n" + "".join(f"{t:.3f};{rate:.5f}\n" for t, rate in rows))
    (folder / "tacho.toml").write_text(
        'name = "tacho"\n[time]\ncolumn = "millis"\nunit = "ms"\n'
        '[reference]\ntacho_rad_s = { column = "speed", unit = "rpm" }\n'
    )
    (folder / "plan.toml").write_text(
        'repeats = 2\n[factors]\nscenario = ["paper_run"]\nmethod = ["integrate", "algebraic"]\nduration_s = [3.0]\n'
    )
    return folder


@pytest.fixture(scope="module")
def campaign(here):
    """The campaign that the calls look at, in that folder."""
    return gfimu.campaign(here / "plan.toml", out=here / "camp", workers=1)


@pytest.fixture(scope="module")
def benchmark(here):
    """Answers of a method to one world of the benchmark, and what the judge says of them."""
    gfimu.benchmark.run("always_unknown", out=here / "bench", sets=["own"], limit=1)
    gfimu.benchmark.judge(here / "bench", out=here / "judged.jsonl", partial=True)


def refuse_constant(text):
    raise AssertionError(f"{text} is no JSON")


def read(text):
    """Return the one object in a text; NaN and Infinity are none."""
    return json.loads(text, parse_constant=refuse_constant)


def fits(name, found):
    """Hold a result against the schema of its command."""
    reasons = []
    for kind in (*schema_file._RESULTS[name], "base.Failed"):
        try:
            msgspec.convert(found, schema_file._struct(kind), strict=True)
            break
        except msgspec.ValidationError as error:
            reasons.append(f"{kind}: {error}")
    else:
        assert name == "certificate", reasons
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft202012Validator(gfimu.schema(name))
    assert [error.message[:300] for error in validator.iter_errors(found)] == []


@pytest.mark.parametrize("line", CALLS)
def test_a_result_is_as_its_schema_says(gfimu_command, here, monkeypatch, request, line):
    if line.startswith("firmware"):
        pytest.importorskip("unicorn")
    if line.startswith("campaign"):
        request.getfixturevalue("campaign")
    if line.startswith("benchmark"):
        request.getfixturevalue("benchmark")
    monkeypatch.chdir(here)
    result = gfimu_command(*line.split(), "--json")
    assert result.code == 0, result.stderr
    found = read(result.stdout)
    fits(CALLS[line], found)
    for path in found.get("files", {}).values() if CALLS[line] != "schema" else ():
        assert (here / path).exists()


def test_every_command_has_a_schema_and_a_call():
    names = set(program_names())
    assert set(schema_names()) == names
    assert set(CALLS.values()) | BY_HAND == names


@pytest.mark.parametrize("name", schema_names())
def test_a_schema_is_one_and_describes_every_key(name):
    content = gfimu.schema(name)
    assert content["$schema"].endswith("2020-12/schema")
    for part in content["$defs"].values():
        assert part["description"]
        for key, value in part["properties"].items():
            assert value.get("description"), f"{part['title']}.{key}"
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator.check_schema(content)


ENDINGS = {
    "_m_s2": "m/s²",
    "_rad_s": "rad/s",
    "_rad_s2": "rad/s²",
    "_rad": "rad",
    "_hz": "Hz",
    "_mg": "mg",
    "_degC": "°C",
    "_deg_h": "°/h",
    "_m": "m",
}


def test_units_of_descriptions_are_those_of_the_keys():
    for name in schema_names():
        for part in gfimu.schema(name)["$defs"].values():
            for key, value in part["properties"].items():
                ending = max((one for one in ENDINGS if key.endswith(one)), key=len, default="")
                text = value["description"]
                if ending and text.endswith(")") and "(" in text:
                    assert ENDINGS[ending] in text.rpartition("(")[2], f"{part['title']}.{key}: {text}"


def test_an_undocumented_key_is_refused():
    with pytest.raises(msgspec.ValidationError, match="unknown field"):
        msgspec.convert({"name": "x", "text": "y", "more": 1}, schema_file._struct("first_steps.Shown"))
    assert all(
        schema_file._struct(kind).__struct_config__.forbid_unknown_fields
        for kinds in schema_file._RESULTS.values()
        for kind in kinds
        if isinstance(schema_file._struct(kind), type) and issubclass(schema_file._struct(kind), Result)
    )


def test_a_schema_is_written(tmp_path, gfimu_command):
    out = tmp_path / "score.schema.json"
    assert gfimu_command("schema", "score", "--out", out).stdout == f"wrote schema: {out}\n"
    assert json.loads(out.read_text()) == gfimu.schema("score")
    with pytest.raises(InputError, match=r"unknown command 'scor'.*did you mean 'score'"):
        gfimu.schema("scor")


ERRORS = {
    "score nope": 2,
    "simulate rest": 2,
    "estimate gone.csv --out x.csv": 2,
    "convert gone.csv x.csv": 2,
    "campaign table gone": 2,
    "live --array cube12 --from gone.csv": 2,
    "qqq": 2,
}


@pytest.mark.parametrize("line", ERRORS)
def test_an_error_is_an_object_too(gfimu_command, tmp_path, monkeypatch, line):
    monkeypatch.chdir(tmp_path)
    result = gfimu_command(*line.split(), "--json")
    assert result.code == ERRORS[line]
    found = read(result.stdout)
    assert found["error"]["exit_code"] == result.code
    assert result.stderr == f"gfimu: {found['error']['message']}\n"
    command = next((name for name in sorted(schema_names(), reverse=True) if line.startswith(name)), "score")
    fits(command, found)


def test_an_error_of_the_system_is_an_object_too(gfimu_command, monkeypatch):
    import gfimu.commands.score

    def unreadable(*_, **__):
        raise PermissionError(13, "Permission denied", "some/file")

    monkeypatch.setattr(gfimu.commands.score, "score", unreadable)
    result = gfimu_command("score", "--json")
    assert read(result.stdout)["error"]["message"] == "some/file: Permission denied"


def test_live_prints_json_lines(gfimu_command, here, monkeypatch):
    monkeypatch.chdir(here)
    result = gfimu_command("live", "--from", "run.csv", "--json")
    assert result.code == 0
    lines = result.stdout.splitlines()
    assert len(lines) > 1000
    for line in (*lines[:3], *lines[-3:], *(line for line in lines if "event" in line)):
        fits("live", read(line))
    (here / "broken.csv").write_text("t_s,a11_m_s2\n")
    broken = gfimu_command("live", "--from", "broken.csv", "--array", "cube12", "--rate", "100", "--json")
    assert broken.stdout.count("\n") == 1
    fits("live", read(broken.stdout))


def test_a_recording_and_the_board_behind_it(gfimu_command, tmp_path):
    pytest.importorskip("unicorn")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    code = "from gfimu.cli import main; main()"
    words = ["firmware", "run", "--scenario", "rest", "--port", f"tcp:{port}", "--duration", "4", "--json"]
    board = subprocess.Popen(
        [sys.executable, "-c", code, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert "board on" in board.stderr.readline()
    time.sleep(0.2)
    out = tmp_path / "run.csv"
    place = f"socket://127.0.0.1:{port}"
    recorded = gfimu_command("record", "--port", place, "--out", out, "--duration", "1", "--json")
    assert recorded.code == 0, recorded.stderr
    fits("record", read(recorded.stdout))
    served, _ = board.communicate(timeout=60)
    assert board.returncode == 0
    fits("firmware run", read(served))


def test_what_the_others_print(gfimu_command, tmp_path):
    pytest.importorskip("unicorn")
    pytest.importorskip("ziglang")
    built = gfimu_command("firmware", "build", "selfcheck", "--out", tmp_path / "made", "--json")
    fits("firmware build", read(built.stdout))
    fits("firmware faults", read(gfimu_command("firmware", "faults", "--json").stdout))


def test_the_demo(gfimu_command, tmp_path):
    result = gfimu_command("demo", "--out", tmp_path / "demo", "--json")
    assert result.code == 0, result.stderr
    fits("demo", read(result.stdout))
