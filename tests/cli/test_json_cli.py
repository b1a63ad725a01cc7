"""The schemas of what --json prints. tests/golden holds the output of every command against them."""

from __future__ import annotations

import importlib
import json
import socket
import subprocess
import sys
import time

import jsonschema
import msgspec
import pytest

import gfimu
from gfimu import InputError
from gfimu.base.declared import struct_of
from gfimu.commands import program
from gfimu.commands.schema import schema_names
from gfimu.commands.show import Shown
from tests.golden.calls import CALLS

schema_file = importlib.import_module("gfimu.commands.schema")


def program_names():
    import typer

    for name, command in typer.main.get_command(program()).commands.items():
        if hasattr(command, "commands"):
            default = getattr(command, "default", "")
            yield from (name if inner == default else f"{name} {inner}" for inner in command.commands)
        else:
            yield name


def test_every_command_has_a_schema_and_a_call():
    names = set(program_names())
    assert set(schema_names()) == names
    lines = [line for call in CALLS.values() if not call.name.startswith("error_") for line in call.lines]
    assert {max((one for one in names if f"{line} ".startswith(f"{one} ")), key=len) for line in lines} == names


@pytest.mark.parametrize("name", schema_names())
def test_a_schema_is_one_and_describes_every_key(name):
    content = gfimu.schema(name)
    assert content["$schema"].endswith("2020-12/schema")
    for part in content["$defs"].values():
        assert part["description"]
        for key, value in part["properties"].items():
            assert value.get("description"), f"{part['title']}.{key}"
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
        msgspec.convert({"name": "x", "text": "y", "more": 1}, struct_of(Shown))
    kinds = [kind for name in schema_file.schema_names() for kind in schema_file._kinds(name)[0]]
    structs = [kind for kind in kinds if isinstance(kind, type) and issubclass(kind, msgspec.Struct)]
    assert len(structs) > 30
    assert all(kind.__struct_config__.forbid_unknown_fields for kind in structs)


def test_a_schema_is_written(tmp_path, gfimu_command):
    out = tmp_path / "score.schema.json"
    assert gfimu_command("schema", "score", "--out", out).stdout == f"wrote schema: {out}\n"
    assert json.loads(out.read_text()) == gfimu.schema("score")
    with pytest.raises(InputError, match=r"unknown command 'scor'.*did you mean 'score'"):
        gfimu.schema("scor")


def test_an_error_of_the_system_is_an_object_too(gfimu_command, monkeypatch):
    import gfimu.commands.score

    def unreadable(*_, **__):
        raise PermissionError(13, "Permission denied", "some/file")

    monkeypatch.setattr(gfimu.commands.score, "as_array", unreadable)
    result = gfimu_command("score", "--json")
    assert json.loads(result.stdout)["error"]["message"] == "some/file: Permission denied"


def test_a_recording_and_the_board_behind_it(gfimu_command, tmp_path):
    pytest.importorskip("unicorn")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    code = "from gfimu.commands.shell.program import main; main()"
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
    served, _ = board.communicate(timeout=60)
    assert board.returncode == 0
    for name, text in (("record", recorded.stdout), ("firmware run", served)):
        assert list(jsonschema.Draft202012Validator(gfimu.schema(name)).iter_errors(json.loads(text))) == []
