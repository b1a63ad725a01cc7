"""Help: two examples per command that can be copied, legible on a narrow terminal, reached by every usual word."""

from __future__ import annotations

import json
import re
import shlex

import pytest
import typer
from every_item import every

import gfimu
from gfimu.commands import program
from gfimu.commands.shell.command_list import COMMANDS, JOBS, help_line
from gfimu.commands.shell.help_text import examples_of

GROUPS = ("benchmark", "campaign", "firmware")


def commands():
    for name, command in typer.main.get_command(program()).commands.items():
        yield name, command
        if name in GROUPS:
            yield from ((f"{name} {inner}", sub) for inner, sub in command.commands.items())


ALL = dict(commands())
EXAMPLES = [(words, line) for words, command in ALL.items() for _, line in examples_of(command.help)]

CHEAP = (
    "gfimu list arrays",
    "gfimu list scenarios --json",
    "gfimu show adxl355",
    "gfimu new array --out my_array.toml --schema array.schema.json",
    "gfimu new sender my_sender",
    "gfimu benchmark list",
    "gfimu benchmark list --json",
    "gfimu schema estimate",
    "gfimu schema campaign table --out table.schema.json",
    "gfimu score cube12 p3_three_plus_one --speed-rad-s 10",
    (
        "gfimu score one_chip --axis z --axis-point -0.1 0 0 --lever-std-m 0.003 --rotation-std-rad 0.05 "
        "--bias-std-m-s2 0.2"
    ),
    "gfimu drift --from-position 6.42 0 0 --known-bias-mg 1 0 0 --latitude 35.7",
    "gfimu simulate paper_run --out run.csv --set sensor.range_g=8 --set duration_s=5",
    "gfimu tolerance cube12 --closed-form --part adxl355 --calibrated poses+rest",
)
"""Examples that need no file and take a second or two."""


@every("name", sorted(COMMANDS))
def test_the_list_of_commands_prints_the_first_line_of_each_ones_help(name):
    assert ALL[name].name == name
    assert help_line(name) == " ".join(ALL[name].help.partition("\n\n")[0].split())


@every("words", ALL)
def test_every_command_has_two_examples(words):
    examples = [line for _, line in examples_of(ALL[words].help)]
    assert len(examples) >= 2
    assert any(line.startswith(f"gfimu {words}") or f"| gfimu {words} " in line for line in examples) or words == (
        "campaign run"  # whose word may be left out
    )


@every("words, line", EXAMPLES)
def test_an_example_parses(words, line):
    """Every option in it exists and every value has the type that is asked for."""
    del words
    arguments = shlex.split(line.rpartition("| ")[2])
    assert arguments.pop(0) == "gfimu"
    command = ALL[arguments.pop(0)]
    if hasattr(command, "commands"):
        inner = arguments.pop(0) if arguments[0] in command.commands else command.default
        command = command.commands[inner]
    if "--help" not in arguments:
        command.make_context("gfimu", arguments)


def test_cheap_examples_are_examples():
    assert set(CHEAP) <= {line for _, line in EXAMPLES}


@pytest.mark.parametrize("line", CHEAP)
def test_a_cheap_example_runs(gfimu_command, tmp_path, monkeypatch, line):
    monkeypatch.chdir(tmp_path)
    result = gfimu_command(*shlex.split(line)[1:])
    assert (result.code, result.stderr) == (0, "")


@pytest.mark.parametrize("width", [40, 80])
@every("words", ALL)
def test_help_fits_the_terminal(gfimu_command, monkeypatch, words, width):
    monkeypatch.setenv("COLUMNS", str(width))
    text = gfimu_command(*words.split(), "--help").stdout
    body, _, examples = text.partition("\nExamples:\n")
    whole = {word for line in body.splitlines() for word in [line.strip()] if " " not in word}
    assert [line for line in body.splitlines() if len(line) > width and line.strip() not in whole] == []
    if width == 80:
        assert [line for line in examples.splitlines() if len(line) > width] == []


@every("words", ALL)
def test_an_example_can_be_copied(gfimu_command, monkeypatch, words):
    """With its continuation lines joined, what is printed is the command line."""
    monkeypatch.setenv("COLUMNS", "60")
    text = gfimu_command(*words.split(), "--help").stdout
    lines = re.sub(r" \\\n\s*", " ", text.partition("\nExamples:\n")[2])
    printed = {line.strip() for line in lines.splitlines()}
    assert {line for _, line in examples_of(ALL[words].help)} <= printed


def test_examples_of_the_shell_are_no_part_of_the_documentation_in_python():
    assert "gfimu firmware trace --out trace.rrd" in " ".join(
        line for words, line in EXAMPLES if words == "firmware trace"
    )
    text = gfimu.firmware.trace.__doc__
    assert "Parameters\n" in text
    assert "Raises\n" in text
    assert "Shell" not in text
    assert "--out" not in text


@pytest.mark.parametrize("words", [("help", "score"), ("score", "-h"), ("score", "--help")])
def test_every_usual_word_shows_help(gfimu_command, words):
    assert gfimu_command(*words).stdout == gfimu_command("score", "--help").stdout
    assert gfimu_command(*words).code == 0


def test_an_option_that_takes_a_folder_says_so(gfimu_command):
    diagnose, estimate = (gfimu_command(name, "--help").stdout for name in ("diagnose", "estimate"))
    assert re.search(r"--out FOLDER +Folder to write", diagnose)
    assert re.search(r"--out FILE +Estimate to write", estimate)


def test_help_of_a_command_of_a_command(gfimu_command):
    assert "gfimu campaign table [OPTIONS] DIR" in gfimu_command("help", "campaign", "table").stdout
    assert gfimu_command("help").stdout == gfimu_command("-h").stdout
    wrong = gfimu_command("help", "scoer")
    assert (wrong.code, "did you mean 'score'" in wrong.stderr) == (2, True)


def test_the_list_of_commands_is_grouped_by_job(gfimu_command):
    text = gfimu_command("--help").stdout
    places = [text.index(f"\n{job}:\n") for job in JOBS]
    assert places == sorted(places)
    assert sum(map(len, JOBS.values())) == len(COMMANDS)


def test_the_version_for_people_and_machines(gfimu_command):
    assert gfimu_command("--version").stdout == f"gfimu {gfimu.__version__}\n"
    for words in (("--version", "--json"), ("--json", "--version")):
        found = json.loads(gfimu_command(*words).stdout)
        assert (found["name"], found["version"]) == ("gfimu", gfimu.__version__)
    assert "stands after the command" in gfimu_command("--json", "score").stderr
