"""One thing has one name: options that several commands take, their help, their defaults, and their former names."""

from __future__ import annotations

import inspect
import json
import re
import warnings
from collections import defaultdict

import pytest
import typer

import gfimu
from gfimu.cli.app import program
from gfimu.cli.former_options import FORMER_OPTIONS
from gfimu.cli.shared_options import SHARED

OF_ITS_OWN = {
    "--array": {"firmware build"},  # a name that the board states, no array that is read
    "--calibration": {"calibrate"},  # where to start from
    "--check": {"calibrate", "diagnose"},  # other poses; a look at the recordings
    "--out": None,  # names another thing in every command
}
"""Options whose name several commands use, each for a thing of its own; None: all of them."""

SAME_DEFAULT = (
    "--axis",
    "--axis-point",
    "--force",
    "--hub",
    "--image",
    "--inclination-rad",
    "--json",
    "--map",
    "--rrd",
)

WRITTEN = (
    "m|s|rad|Hz|mg|g|kHz|degrees|°|K|mm|%|m/s²|rad/s|rad/s²|°/h|µg/√Hz|µg/√s|m/s²/√s|m/s²/√Hz|rad²/s⁵|s²/rad²|"
    "bits per second|a ratio|reading unit squared|±2, 4, 8 or 16 g"
)
NO_UNIT = "ratio|frequency class|[Nn]umber|How many|Longest|m/s² per count|by default|Most|Range"
UNITS = re.compile(rf"(, |: |× )({WRITTEN})(?=\W|$)|{NO_UNIT}")


def commands():
    for name, command in typer.main.get_command(program()).commands.items():
        if hasattr(command, "commands"):
            yield from ((f"{name} {inner}", sub) for inner, sub in command.commands.items())
        else:
            yield name, command


COMMANDS = dict(commands())


def options():
    """Yield the long name of every option with its command and parameter."""
    for words, command in COMMANDS.items():
        for param in command.params:
            if param.param_type_name == "option":
                yield max(param.opts, key=len) if "--live" not in param.opts else "--live", words, param


BY_NAME = defaultdict(dict)
for option, where, one in options():
    BY_NAME[option][where] = one


@pytest.mark.parametrize("name", sorted(name for name, where in BY_NAME.items() if len(where) > 1))
def test_an_option_of_two_commands_comes_from_the_table(name):
    own = OF_ITS_OWN.get(name, set())
    for words, param in BY_NAME[name].items():
        if own is None or words in own:
            continue
        assert name in SHARED, f"{words} {name}: describe it in gfimu/cli/shared_options.py"
        assert SHARED[name].text.rstrip(".") in param.help, f"{words} {name}: {param.help}"
        assert (param.metavar or "") == SHARED[name].metavar, words


@pytest.mark.parametrize("name", sorted(SHARED))
def test_the_table_has_no_option_that_one_command_takes_alone(name):
    assert len(BY_NAME[name]) > 1


@pytest.mark.parametrize("name", SAME_DEFAULT)
def test_a_shared_option_has_one_default(name):
    defaults = {str(param.default) for words, param in BY_NAME[name].items() if words not in OF_ITS_OWN.get(name, ())}
    assert len(defaults) == 1, defaults


def test_seeds_are_zero_by_default_and_never_negative():
    """But the demo's, whose figures are in the documentation, and the search's, which a brief may give."""
    seeds = {words: (param.default, param.min) for words, param in BY_NAME["--seed"].items()}
    assert seeds.pop("demo") == (1, 0)
    assert seeds.pop("optimize") == (None, 0)
    assert set(seeds.values()) == {(0, 0)}


def test_every_command_takes_json():
    assert set(BY_NAME["--json"]) == set(COMMANDS)
    assert {param.name for param in BY_NAME["--json"].values()} == {"json"}


@pytest.mark.parametrize("words", sorted(BY_NAME["--out"]))
def test_an_output_says_what_is_written(words):
    assert re.search(r"\bto write\b", BY_NAME["--out"][words].help), BY_NAME["--out"][words].help


@pytest.mark.parametrize(
    ("words", "param"),
    [
        pytest.param(words, param, id=f"{words} {name}")
        for name, words, param in options()
        if "float" in str(param.type_descriptor.annotation)
    ],
)
def test_a_number_says_its_unit(words, param):
    assert UNITS.search(param.help), f"{words}: {param.help}"


@pytest.mark.parametrize("words", sorted(COMMANDS))
def test_descriptions_are_sentences(words):
    for param in COMMANDS[words].params:
        if param.param_type_name == "option" and not param.hidden and "--help" not in param.opts:
            assert param.help[0].isupper() or param.help.split()[0].rstrip(":,") in {
                "none",
                "array",
                "spin",
                "gyro",
                "pty",
            }
            assert param.help.rstrip().endswith((".", "?")), param.help


@pytest.mark.parametrize(
    ("words", "former", "present"),
    [(words, *pair) for words, renamed in FORMER_OPTIONS.items() for pair in renamed.items()],
)
def test_a_former_name_is_hidden_and_its_present_one_is_there(gfimu_command, words, former, present):
    help_text = gfimu_command(*words.split(), "--help").stdout
    assert re.search(rf"{present}\b", help_text)
    known = {name for param in COMMANDS[words].params for name in param.opts}
    assert present in known
    assert former not in known


def test_a_former_name_works_with_one_line_that_says_so(gfimu_command):
    now = gfimu_command("drift", "--bias-mg", 1, "--duration", 2, "--json")
    before = gfimu_command("drift", "--bias-mg", 1, "--time", 2, "--json")
    assert (before.code, json.loads(before.stdout)) == (0, json.loads(now.stdout))
    assert before.stderr == "gfimu: warning: --time is now called --duration; use that name\n"
    assert now.stderr == ""
    assert gfimu_command("drift", "--bias-mg", 1, "--time=2", "--json").stdout == now.stdout


def test_former_names_of_arguments_work_in_python():
    with pytest.warns(DeprecationWarning, match="drift: time is now called duration"):
        before = gfimu.drift("cube12", time=2.0, bias_mg=1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        now = gfimu.drift("cube12", duration=2.0, bias_mg=1.0)
    assert before.budget.time == now.budget.time == 2.0
    with pytest.raises(TypeError, match="give one of them"):
        gfimu.drift("cube12", time=2.0, duration=2.0, bias_mg=1.0)
    assert "duration" in inspect.signature(gfimu.drift).parameters


def test_a_picture_may_have_an_extension_in_capitals(gfimu_command, tmp_path):
    picture = tmp_path / "P.PNG"
    result = gfimu_command("tolerance", "cube12", "--closed-form", "--calibrated", "none", "--picture", picture)
    assert result.code == 0, result.stderr
    assert picture.read_bytes()[1:4] == b"PNG"
