"""The names of the rate methods stand in one place, and every caller finds them there."""

import ast
from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import numpy as np
import pytest

import gfimu
from gfimu import (
    AccelerometerArray,
    InputError,
    Recording,
    SensorErrors,
    estimate_from_rest,
    estimate_rate,
    specific_force,
)
from gfimu.motion.estimation import estimate
from gfimu.rate import registry
from gfimu.rate.registry import RATE_METHODS, RateMethod, rate_method

CUBE = AccelerometerArray.load("cube12")


@pytest.fixture
def run():
    """Rest for 3 s, then a turn about the vertical that begins slowly."""
    t = np.arange(600) / 100
    turning = np.clip(t - 3.0, 0.0, None)
    axis = np.array([[0.0, 0.0, 1.0]])
    true = specific_force(CUBE, 9.80665 * axis, 2.0 * (turning > 0)[:, None] * axis, 2.0 * turning[:, None] * axis)
    noise = np.random.default_rng(3).normal(0, 0.01, true.shape)
    return Recording.from_arrays(t, true + noise, CUBE)


@pytest.mark.parametrize("method", RATE_METHODS.values(), ids=RATE_METHODS)
def test_every_record_is_complete(method):
    assert RATE_METHODS[method.name] is method
    assert method.uses
    assert callable(method.solver)
    assert not (method.recursive and method.open_loop)
    with pytest.raises(FrozenInstanceError):
        method.uses = "nothing"


@pytest.mark.parametrize(
    "ask",
    [
        rate_method,
        lambda name: estimate(None, CUBE, method=name),
        lambda name: estimate_rate(CUBE, [0.0], np.zeros((1, 12)), None, method=name),
    ],
)
def test_an_unknown_method_is_one_line_with_the_list(ask):
    with pytest.raises(InputError) as refused:
        ask("magic")
    assert str(refused.value) == "unknown method 'magic'; valid: algebraic, batch, filter, integrate, ml, smoother"


@pytest.mark.parametrize("name", [name for name, method in RATE_METHODS.items() if not method.recursive])
def test_only_recursive_methods_take_a_gyro(run, name):
    with pytest.raises(InputError, match=f"^method '{name}' can't use gyro; use filter, smoother or batch$"):
        estimate(run, CUBE, method=name, use=["gyro"])


def turning_at_one(array, t, readings, errors, settings):
    """A method that the package does not have: 1 rad/s about z, whatever the readings are."""
    found = RATE_METHODS["algebraic"].solver(array, t, readings, errors, settings)
    return replace(found, method="mine", omega=np.tile([0.0, 0.0, 1.0], (len(t), 1)))


def test_a_new_method_is_one_record(run, monkeypatch):
    mine = RateMethod("mine", turning_at_one, "nothing")
    monkeypatch.setattr(registry, "RATE_METHODS", {**RATE_METHODS, "mine": mine})
    for solve in (estimate, estimate_from_rest):
        found = solve(run, CUBE, method="mine")
        assert found.metadata["method"] == "mine"
        np.testing.assert_array_equal(found.omega[:, 2], 1.0)
    errors = SensorErrors.from_parts(CUBE, 100.0)
    assert estimate_rate(CUBE, run.t_s, run.readings, errors, method="mine").method == "mine"
    with pytest.raises(InputError, match="valid: algebraic, batch, filter, integrate, mine, ml, smoother"):
        estimate(run, CUBE, method="magic")


def decisions(tree):
    """String constants that comparisons, membership tests and keys of dictionaries hold."""
    for node in ast.walk(tree):
        parts = []
        if isinstance(node, ast.Compare):
            parts = [node.left, *node.comparators]
        elif isinstance(node, ast.Dict):
            parts = [key for key in node.keys if key is not None]
        for part in parts:
            for leaf in ast.walk(part):
                if isinstance(leaf, ast.Constant) and isinstance(leaf.value, str):
                    yield leaf.value, leaf.lineno


def test_nothing_decides_by_the_name_of_a_method():
    """What differs between the methods stands in their records."""
    package = Path(gfimu.__file__).parent
    found = [
        f"{file.relative_to(package)}:{line}: {text!r}"
        for file in sorted(package.rglob("*.py"))
        if "diagnosis" not in file.parts
        for text, line in decisions(ast.parse(file.read_text(encoding="utf-8")))
        if text in {"integrate", "algebraic", "ml", "filter", "smoother"}
    ]
    assert found == []
