"""Every call of the golden set gives what is stored of it, and JSON as the schema of its command says."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import jsonschema
import pytest

import gfimu

from .calls import CALLS, EXPECTED, Outcome
from .golden import check


def schema_of(line: str) -> dict:
    """Schema of the command of a line, or of an unknown one: an error is an object of every schema."""
    words = line.split()
    for name in (" ".join(words[:2]), words[0]):
        try:
            return gfimu.schema(name)
        except gfimu.InputError:
            continue
    return gfimu.schema("score")


def refuse_constant(text):
    raise AssertionError(f"{text} is no JSON")


def fits(folder: Path, line: str, outcome: Outcome) -> None:
    """Hold what a line printed against the schema of its command; the files that it names are there."""
    validator = jsonschema.Draft202012Validator(schema_of(line))
    for text in outcome.stdout.splitlines() if line.startswith("live") else [outcome.stdout][: len(outcome.stdout)]:
        found = json.loads(text, parse_constant=refuse_constant)
        assert [error.message[:300] for error in validator.iter_errors(found)] == [], line
        if outcome.code:
            assert found["error"]["exit_code"] == outcome.code
            assert outcome.stderr.endswith(f"gfimu: {found['error']['message']}\n")
        elif not line.startswith("schema"):
            assert all((folder / path).exists() for path in found.get("files", {}).values())


@pytest.mark.parametrize("name", CALLS)
def test_a_call_gives_what_is_stored_and_what_its_schema_says(name, tmp_path):
    assert check(CALLS[name], tmp_path, partial(fits, tmp_path)) == []


def test_nothing_is_stored_of_no_call():
    assert {file.stem for file in EXPECTED.iterdir()} == set(CALLS)
