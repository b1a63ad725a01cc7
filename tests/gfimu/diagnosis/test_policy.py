"""The policy: every number of it is documented, used and needed; and how many numbers the diagnosis has."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import re
from pathlib import Path

import numpy as np
import pytest
from every_item import every
from scipy.stats import norm

import gfimu.diagnosis
from gfimu.base import STANDARD_GRAVITY
from gfimu.diagnosis import Policy

FOLDER = Path(gfimu.diagnosis.__file__).parent
FIELDS = [one.name for one in dataclasses.fields(Policy)]
ENTRY = re.compile(r"^([a-z_]+(?:, [a-z_]+)*) : (.+)\n((?: {4}.*\n?)+)", re.MULTILINE)


def entries() -> dict[str, tuple[str, str]]:
    """Type and text of every parameter in the docstring."""
    listed = inspect.getdoc(Policy).partition("----------\n")[2]
    return {
        name: (kind, " ".join(text.split()))
        for names, kind, text in ENTRY.findall(listed)
        for name in names.split(", ")
    }


def test_every_field_is_documented_in_order():
    assert list(entries()) == FIELDS


@every("name", FIELDS)
def test_every_field_has_its_unit_its_meaning_and_what_set_it(name):
    kind, text = entries()[name]
    assert kind.startswith(type(getattr(Policy, name)).__name__)
    assert re.search(r"\[(1|count|nats|s|rad|tolerances|m/s²|m/s² per √s)\]", text)
    assert re.search(r"\b(By choice|Set (on|by|as|above|beyond|where))\b", text)
    assert len(text.partition("[")[0].split()) > 3


def test_every_number_is_read_somewhere():
    source = "\n".join(
        file.read_text(encoding="utf-8") for file in FOLDER.rglob("*.py") if file.name != "policy.py"
    ) + inspect.getsource(Policy)
    derived = [name for name, member in vars(Policy).items() if isinstance(member, property)]
    read = set(re.findall(r"(?:(?<=policy\.)|(?<=Policy\.)|(?<=Policy\(\)\.)|(?<=self\.))([a-z_]+)", source))
    assert {*FIELDS, *derived} - read == set()


def test_what_follows_from_other_numbers():
    policy = Policy()
    # Odds of a likelihood at its peak against one that many standard deviations away.
    assert policy.ambiguous == pytest.approx(norm.logpdf(0.0) - norm.logpdf(policy.stds))
    assert np.exp(-policy.unequal_walk) == pytest.approx(1e-6)  # one in a million
    wider = dataclasses.replace(policy, stds=3.0, most_causes=5, small=0.2, worth_a_search=4.0, rounds=7)
    assert (wider.ambiguous, wider.body_causes, wider.body_dominant) == (4.5, 10, 0.2)
    assert (wider.mimic_energy, wider.body_rounds) == (8.0, 14)
    assert policy.usual_flicker / STANDARD_GRAVITY == pytest.approx(0.2e-3)


def numbers(file: Path) -> int:
    """How many constants of a module are written with numbers."""
    count = 0
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            literals = [one.value for one in ast.walk(node.value) if isinstance(one, ast.Constant)]
            count += any(isinstance(one, int | float) and not isinstance(one, bool) for one in literals)
    return count


def test_the_diagnosis_has_few_numbers():
    """Of those that stand in the modules most are numerical, or describe how a file of samples goes wrong."""
    assert len(FIELDS) <= 40
    assert sum(numbers(file) for file in FOLDER.rglob("*.py")) <= 234  # 389 before there was a policy
