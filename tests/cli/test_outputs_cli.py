"""Every command refuses to destroy: an output that is an input, a folder that is not there, a wrong extension."""

from __future__ import annotations

import inspect
import os
import re
from pathlib import Path
from typing import get_type_hints

import pytest
import typer
from every_item import every

import gfimu
from gfimu.base.files.outputs import OutputFile, OutputFolder
from gfimu.commands import program
from gfimu.commands.shell.declare import command_of

OTHER_WORDS = {
    "--from": "source",
    "--set": "changes",
    "--input": "input_kind",
    "--format": "form",
    "--range": "range_g",
    "--map": "column_map",
}
"""Options whose word Python or its builtins take, and the arguments that stand for them."""

PYTHON_NAME = {
    "list": "catalogue",
    "benchmark list": "benchmark_list",
    "campaign status": "campaign_status",
    "campaign table": "campaign_table",
    "campaign plot": "campaign_plot",
}
"""Commands whose word is a builtin of Python or a part of another function, and the functions that stand for them."""

NO_ARGUMENT = {"--json", "--help", "--check"}
NAMES_A_FILE = {
    "array",
    "twin",
    "scenario",
    "image",
    "verdict",
    "calibration",
    "update",
    "motion",
    "also",
    "recording",
    "column_map",
    "plan",
    "brief",
}

CALLS = {
    "simulate": {"scenario": "rest", "out": "made.csv"},
    "estimate": {"recording": "in.csv", "array": "cube12", "out": "made.csv"},
    "inspect": {"file": "in.csv"},
    "join": {"channels": "in.csv", "reference": "other.csv", "out": "made.csv"},
    "convert": {"source": "in.csv", "target": "made.csv"},
    "drift": {"recording": "in.csv"},
    "diagnose": {"recordings": "in.csv", "twin": "cube12_turntable", "out": "made"},
    "design": {"effects": "bias", "twin": "cube12_turntable"},
    "calibrate": {"method": "array", "recording": "in.csv", "out": "made.json"},
    "certificate": {"calibration": "in.json", "out": "made"},
    "noise": {"recording": "in.csv"},
    "impact": {"recording": "in.csv", "array": "cube12", "out": "made.csv"},
    "record": {"port": "socket://127.0.0.1:1", "out": "made.csv"},
    "view": {"file": "in.csv"},
    "optimize": {"chips": "4", "restarts": "1"},
    "demo": {},
    "start": {"files": "in.csv", "array": "cube12", "out": "made"},
    "new": {"kind": "array", "out": "made.toml"},
    "schema": {"command": "score", "out": "made.json"},
    "tolerance": {"array": "cube12", "units": "10", "workers": "1"},
    "campaign": {"plan": "in.toml", "out": "made"},
    "campaign table": {"folder": "campaign"},
    "campaign plot": {"folder": "campaign", "out": "made.png"},
    "benchmark worlds": {"out": "made", "limit": "1"},
    "benchmark run": {"method": "always_unknown", "out": "made", "limit": "1"},
    "benchmark judge": {"answers": "in.jsonl", "out": "made.jsonl"},
    "firmware run": {},
    "firmware build": {},
    "firmware trace": {"out": "made.vcd"},
}
"""A short call of every command that writes; a new one has to be added here."""


def commands():
    """Yield every command with its words and the function under it."""
    for name, command in typer.main.get_command(program()).commands.items():
        if hasattr(command, "commands"):
            for inner, sub in command.commands.items():
                words = name if inner == getattr(command, "default", "") else f"{name} {inner}"
                one = getattr(gfimu, PYTHON_NAME[words]) if words in PYTHON_NAME else getattr(gfimu, name)
                yield words, sub, one if callable(one) else getattr(one, inner)
        else:
            yield name, command, getattr(gfimu, PYTHON_NAME.get(name, name))


COMMANDS = {name: (command, function) for name, command, function in commands()}
POSITIONAL = {"run": "recording", "runs": "recordings"}


def argument_of(parameter) -> str:
    """Name of the Python argument behind a parameter of the command line."""
    if parameter.param_type_name == "argument":
        return POSITIONAL.get(parameter.name, parameter.name)
    flag = next(word for word in parameter.opts if word.startswith("--"))
    return OTHER_WORDS.get(flag, flag.removeprefix("--").replace("-", "_"))


BESIDE = {"drift": (gfimu.axis_drift, gfimu.drift_from_position, gfimu.drift_of_rest)}
"""Functions under a command besides the one of its name."""

FILES_OF = {"drift": gfimu.drift_of_rest}
"""Of these the one that reads and writes files."""


def filer(name):
    """The function under a command that reads and writes its files."""
    return FILES_OF.get(name, COMMANDS[name][1])


def written_by(name):
    """What the function under a command writes, by argument."""
    declared = command_of(filer(name))
    return {argument: option.writes for argument, option in declared.options.items() if option.writes is not None}


def read_by(name):
    """The arguments that name files to read, those of groups of options by their own names."""
    declared = command_of(filer(name))
    marks = {**declared.options, **options_of_groups(filer(name))}
    return [argument for argument, option in marks.items() if option.reads]


def options_of_groups(function):
    """The options that stand for one argument of a function, by their own names."""
    return {
        name: mark
        for group in command_of(function).groups.values()
        for name, parameter in group.parameters.items()
        for mark in parameter.annotation.__metadata__
    }


def parameters_of(name):
    return [p for p in COMMANDS[name][0].params if not NO_ARGUMENT & set(p.opts)]


@every("name", COMMANDS)
def test_every_option_is_an_argument_of_the_function(name):
    functions = [COMMANDS[name][1], *BESIDE.get(name, ())]
    arguments = {argument for function in functions for argument in inspect.signature(function).parameters}
    arguments.update(*map(options_of_groups, functions))
    assert {argument_of(parameter) for parameter in parameters_of(name)} <= arguments


@every("name", COMMANDS)
def test_every_path_is_declared_as_read_or_written(name):
    """A new option that writes but is not declared fails here, and so does one that reads a file."""
    command = COMMANDS[name][0]
    callback = inspect.unwrap(command.callback)
    hints = {one: str(parameter.annotation) for one, parameter in inspect.signature(callback).parameters.items()}
    hints |= get_type_hints(callback)
    written, read = written_by(name), read_by(name)
    for parameter in parameters_of(name):
        argument, text = argument_of(parameter), getattr(parameter, "help", "") or ""
        if "Path" in str(hints[parameter.name]):
            assert argument in written or argument in read, f"{name}: {argument} is neither read nor written"
        if re.search(r"\b(to write|[Ww]rite|Folder for|Folder to)\b", text):
            assert argument in written, f"{name}: {argument} is not checked"
        if written and argument in NAMES_A_FILE:
            assert argument in read, f"{name}: {argument} may name a file that is read"
    if written:
        assert name in CALLS


def test_the_docs_list_every_command_with_its_function(project_root):
    page = (project_root / "docs" / "reference" / "commands.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `gfimu ([a-z]+(?: [a-z]+)?)[^|]*\| `gfimu\.([a-z._]+)\(", page, re.MULTILINE))
    assert rows == {name: PYTHON_NAME.get(name, name.replace(" ", ".")) for name in COMMANDS}
    for flag, argument in OTHER_WORDS.items():
        assert f"`{flag}` is `{argument}`" in page
    written = {suffix for name in COMMANDS for output in written_by(name).values()
               if isinstance(output, OutputFile) for suffix in output.suffixes}  # fmt: skip
    assert all(f"`{suffix}`" in page for suffix in written)


def call(name, values):
    """Command line of a call."""
    words = name.split()
    for parameter in parameters_of(name):
        argument = argument_of(parameter)
        if argument in values:
            value = str(values[argument])
            words += [value] if parameter.param_type_name == "argument" else [parameter.opts[0], value]
    return words


def argument_is_file(name, argument):
    return isinstance(written_by(name)[argument], OutputFile)


OUTPUTS = [(name, argument) for name in COMMANDS for argument in written_by(name)]


FILES = [(name, argument) for name, argument in OUTPUTS if argument_is_file(name, argument)]


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder to work in."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in.csv").write_text("t_s,a11_m_s2\n0,1\n")
    return tmp_path


def contents(folder):
    return {str(file.relative_to(folder)): file.read_bytes() if file.is_file() else None for file in folder.rglob("*")}


def refused(result, before, folder, *words):
    assert result.code == 2, result
    assert result.stderr.count("\n") == 1, result.stderr
    assert all(word in result.stderr for word in words), result.stderr
    assert result.stdout == ""
    assert contents(folder) == before


def output_name(output, folder="."):
    return str(Path(folder, "x" + output.suffixes[0] if isinstance(output, OutputFile) else "x"))


@pytest.mark.parametrize(("name", "argument"), OUTPUTS)
def test_a_folder_that_is_not_there_is_not_made(gfimu_command, here, name, argument):
    output = written_by(name)[argument]
    before = contents(here)
    values = CALLS[name] | {argument: output_name(output, "typo")}
    refused(gfimu_command(*call(name, values)), before, here, "there is no folder typo", "choose a folder")


@pytest.mark.parametrize(("name", "argument"), FILES)
def test_a_wrong_extension_is_refused(gfimu_command, here, name, argument):
    output = written_by(name)[argument]
    before = contents(here)
    result = gfimu_command(*call(name, CALLS[name] | {argument: "made.xls"}))
    refused(result, before, here, "made.xls", output.suffixes[0])


@pytest.mark.parametrize(("name", "argument"), OUTPUTS)
def test_an_output_that_is_an_input_is_refused(gfimu_command, here, name, argument):
    output = written_by(name)[argument]
    options = {argument_of(parameter) for parameter in parameters_of(name)}
    for read in (reads for reads in read_by(name) if reads in options):
        if isinstance(output, OutputFolder):
            (here / "made").mkdir(exist_ok=True)
            (here / "made" / output.names[0]).write_text("kept")
            same = {argument: "made", read: f"made/{output.names[0]}"}
        else:
            file = f"kept{output.suffixes[0]}"
            (here / file).write_text("kept")
            same = {argument: file, read: f"./{file}"}
        before = contents(here)
        refused(gfimu_command(*call(name, CALLS[name] | same)), before, here, "is read by this command")


@pytest.mark.parametrize("link", [os.symlink, os.link])
def test_links_are_seen_through(gfimu_command, here, link):
    link("in.csv", "other.csv")
    before = contents(here)
    words = ("other.csv: is the same file as in.csv", "choose another --target")
    refused(gfimu_command("convert", "in.csv", "other.csv"), before, here, *words)


def test_two_outputs_must_be_two_files(gfimu_command, here):
    (here / "picture.rrd").write_text("kept")
    (here / "estimate.csv").symlink_to("picture.rrd")
    before = contents(here)
    result = gfimu_command("estimate", "in.csv", "--out", "estimate.csv", "--rrd", "picture.rrd")
    refused(result, before, here, "--out and --rrd name the same file")


def test_the_twin_in_the_folder_of_a_diagnosis_survives(gfimu_command, here):
    (here / "made").mkdir()
    (here / "made" / "twin.toml").write_text('array = "cube12"\n')
    before = contents(here)
    result = gfimu_command("diagnose", "in.csv", "--twin", "made/twin.toml", "--out", "made")
    refused(result, before, here, "made/twin.toml: is read by this command", "choose another --out")


def test_the_array_file_that_a_twin_names_survives(gfimu_command, here):
    (here / "made").mkdir()
    (here / "made" / "array.toml").write_text(gfimu.AccelerometerArray.load("cube12").to_toml())
    (here / "mine.toml").write_text('array = "made/array.toml"\n')
    before = contents(here)
    result = gfimu_command("diagnose", "in.csv", "--twin", "mine.toml", "--out", "made")
    refused(result, before, here, "array.toml", "is read by this command")
    result = gfimu_command("design", "bias", "gravity", "--twin", "mine.toml", "--out", "made/array.toml")
    refused(result, before, here, "array.toml", "is read by this command")


def test_files_named_by_named_files_survive(gfimu_command, here):
    """A twin names an array, the array a part; two that name each other are no trap."""
    (here / "mine.toml").write_text('array = "array.toml"\n')
    (here / "array.toml").write_text('[[chip]]\npart = "part.toml"\nnext = ["mine.toml"]\n')
    (here / "part.toml").write_text("kept = 1\n")
    before = contents(here)
    result = gfimu_command("design", "bias", "gravity", "--twin", "mine.toml", "--out", "./part.toml")
    refused(result, before, here, "part.toml", "is read by this command")


def test_a_file_is_no_folder_and_a_folder_no_file(gfimu_command, here):
    (here / "folder.csv").mkdir()
    before = contents(here)
    refused(gfimu_command("convert", "in.csv", "folder.csv"), before, here, "is a folder")
    refused(gfimu_command("demo", "--out", "in.csv"), before, here, "is a file")
    refused(gfimu_command("convert", "in.csv", "in.csv/x.csv"), before, here, "in.csv is a file")


def test_demo_looks_at_the_folder_it_will_make_last(gfimu_command, here):
    (here / "gfimu-demo").mkdir()
    (here / "gfimu-demo" / "diagnosis").write_text("kept")
    before = contents(here)
    refused(gfimu_command("demo"), before, here, "diagnosis", "is a file")


def test_view_makes_no_picture_over_its_input(gfimu_command, here):
    os.link("in.csv", "in.view.rrd")
    before = contents(here)
    refused(gfimu_command("view", "in.csv"), before, here, "is read by this command")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_device_is_no_place_for_a_file(gfimu_command, here):
    (here / "full.csv").symlink_to("/dev/full")
    refused(gfimu_command("convert", "in.csv", "full.csv"), contents(here), here, "is not an ordinary file")


def test_functions_refuse_as_the_commands_do(here):
    with pytest.raises(gfimu.InputError, match="is read by this command"):
        gfimu.convert("in.csv", Path.cwd() / "in.csv")
    with pytest.raises(gfimu.InputError, match="there is no folder"):
        gfimu.simulate("rest", out="typo/run.csv")
    recording = gfimu.simulate("rest", changes=["duration_s=1"])
    with pytest.raises(gfimu.InputError, match="there is no folder"):
        recording.write("typo/run.csv")
    assert sorted(contents(here)) == ["in.csv"]
