"""One thing has one name: options that several commands take, their help and their defaults."""

from __future__ import annotations

import re
from collections import defaultdict

import pytest
import typer
from every_item import every

import gfimu
from gfimu.commands import estimate, known_axis, program
from gfimu.commands.shell import options as shared
from gfimu.commands.shell.declare import Group, Option, marked

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
    "--max-memory",
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
                yield max(param.opts, key=len), words, param


BY_NAME = defaultdict(dict)
for option, where, one in options():
    BY_NAME[option][where] = one


def declared():
    """Yield the options that are declared for several commands, by their names on the shell."""
    for module in (shared, known_axis, estimate):
        for name, value in vars(module).items():
            if isinstance(value, Option):
                yield value.flag(name.lower()), value
            if isinstance(value, Group):
                yield from ((option.flag(name), option) for name, option in marked(value.parameters, Option).items())


SHARED = {**dict(reversed([*declared()])), "--json": Option("Print one JSON object instead of tables")}


@every("name", sorted(name for name, where in BY_NAME.items() if len(where) > 1))
def test_an_option_of_two_commands_is_declared_once(name):
    own = OF_ITS_OWN.get(name, set())
    for words, param in BY_NAME[name].items():
        if own is None or words in own:
            continue
        assert name in SHARED, f"{words} {name}: declare it in gfimu/commands/shell/options.py"
        assert SHARED[name].text.rstrip(".") in param.help, f"{words} {name}: {param.help}"
        assert (param.metavar or "") == SHARED[name].metavar, words


@every("name", SAME_DEFAULT)
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


@every("words", sorted(BY_NAME["--out"]))
def test_an_output_says_what_is_written(words):
    assert re.search(r"\bto write\b", BY_NAME["--out"][words].help), BY_NAME["--out"][words].help


@every(
    "words, param",
    [(words, param) for _, words, param in options() if "float" in str(param.type_descriptor.annotation)],
)
def test_a_number_says_its_unit(words, param):
    assert UNITS.search(param.help), f"{words}: {param.help}"


@every("words", sorted(COMMANDS))
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


def test_a_wrong_keyword_names_the_right_one_as_on_the_shell(gfimu_command):
    assert "did you mean --spin-axis?" in gfimu_command("score", "cube12", "--spinaxis", "z").stderr
    with pytest.raises(TypeError, match=r"score\(\) has no argument 'spinaxis'; did you mean 'spin_axis'\?"):
        gfimu.score("cube12", spinaxis="z")
    with pytest.raises(TypeError, match=r"no argument 'axis_point'; it is part of axis: .*TurningAxis\.of"):
        gfimu.score("cube12", axis_point=(0.0, 0.0, 0.1))


def test_a_picture_may_have_an_extension_in_capitals(gfimu_command, tmp_path):
    picture = tmp_path / "P.PNG"
    result = gfimu_command("tolerance", "cube12", "--closed-form", "--calibrated", "none", "--picture", picture)
    assert result.code == 0, result.stderr
    assert picture.read_bytes()[1:4] == b"PNG"
