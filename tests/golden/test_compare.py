"""Both sides of every tolerance, and what may not move at all."""

from __future__ import annotations

import json

import pytest

from .compare import TOLERANCES, differences, text

STORED = {
    "closed": {
        "value": 2.0,
        "list": [0.0, 3.0],
        "count": 3,
        "verdict": "explained",
        "missing": None,
        "flag": True,
        "line": "scale = 0.0333333333333",
    },
    "filter": {"value": 2.0, "list": [0.0, 3.0], "rows": [[1.0, 2.0]], "line": "no rest in 3.2 s"},
    "fit": {
        "x": {"value": 0.5, "std": 0.01},
        "bias_m_s2": 0.5,
        "bias_std_m_s2": 0.01,
        "gain": 0.5,
        "why": "a11 is off by 0.25 ± 0.01 m/s², -3 dB",
    },
}

SAME = [
    ("closed", "value", 2.0 * (1 + 0.9e-9)),
    ("closed", "list", [2.9e-9, 3.0]),
    ("closed", "list", [0.0, 3.0 * (1 - 0.9e-9)]),
    ("closed", "line", "scale = 0.0333333333335"),
    ("filter", "value", 2.0 * (1 + 0.9e-6)),
    ("filter", "value", 2),
    ("filter", "list", [2.9e-6, 3.0]),
    ("filter", "rows", [[1.0 + 1.9e-6, 2.0]]),
    ("fit", "x", {"value": 0.529, "std": 0.01}),
    ("fit", "x", {"value": 0.471, "std": 0.01 * (1 + 0.9e-4)}),
    ("fit", "bias_m_s2", 0.529),
    ("fit", "bias_std_m_s2", 0.01 * (1 - 0.9e-4)),
    ("fit", "gain", 0.5 * (1 + 0.9e-4)),
    ("fit", "why", "a11 is off by 0.26 ± 0.02 m/s², -4 dB"),
]

OTHER = [
    ("closed", "value", 2.0 * (1 + 1.1e-9), "value: 2.0 -> 2.00"),
    ("closed", "list", [3.1e-9, 3.0], "list[0]: 0.0 -> 3.1e-09"),
    ("closed", "list", [0.0, 3.0 * (1 - 1.1e-9)], "list[1]: 3.0 -> 2.99"),
    ("closed", "list", [0.0, 3.0, 4.0], "list: [0.0, 3.0] -> [0.0, 3.0, 4.0]"),
    ("closed", "count", 4, "count: 3 -> 4"),
    ("closed", "verdict", "unknown", 'verdict: "explained" -> "unknown"'),
    ("closed", "missing", 0.0, "missing: null -> 0.0"),
    ("closed", "value", None, "value: 2.0 -> null"),
    ("closed", "value", float("nan"), "value: 2.0 -> NaN"),
    ("closed", "flag", False, "flag: true -> false"),
    ("closed", "flag", 1, "flag: true -> 1"),
    ("closed", "count", {"of": 3}, 'count: 3 -> {"of": 3}'),
    ("closed", "line", "scale = 0.0333333334333", "line: "),
    ("closed", "line", "scale: 0.0333333333333", "line: "),
    ("filter", "value", 2.0 * (1 + 1.1e-6), "value: 2.0 -> 2.00"),
    ("filter", "line", "no rest in 3.20 s", "line: "),
    ("filter", "rows", [[1.0 + 2.1e-6, 2.0]], "rows[0][0]: 1.0 -> 1.00"),
    ("filter", "line", "no rest in 3.3 s", 'line: "no rest in 3.2 s" -> "no rest in 3.3 s"'),
    ("fit", "x", {"value": 0.531, "std": 0.01}, "x.value: 0.5 -> 0.531"),
    ("fit", "x", {"value": 0.5, "std": 0.01 * (1 + 1.1e-4)}, "x.std: 0.01 -> 0.01000"),
    ("fit", "bias_m_s2", 0.469, "bias_m_s2: 0.5 -> 0.469"),
    ("fit", "gain", 0.5 * (1 + 1.1e-4), "gain: 0.5 -> 0.50005"),
    ("fit", "why", "a12 is off by 0.25 ± 0.01 m/s², -3 dB", "why: "),
    ("fit", "why", "a11 is off by 0.25 ± 0.01 rad, -3 dB", "why: "),
]


def compared(kind, stored, found):
    return list(differences(json.loads(json.dumps(stored)), found, TOLERANCES[kind]))


@pytest.mark.parametrize(("kind", "key", "value"), SAME)
def test_a_change_just_inside_passes(kind, key, value):
    assert compared(kind, STORED[kind], STORED[kind] | {key: value}) == []


@pytest.mark.parametrize(("kind", "key", "value", "line"), OTHER)
def test_a_change_just_outside_is_one_line(kind, key, value, line):
    found = compared(kind, STORED[kind], STORED[kind] | {key: value})
    assert len(found) == 1
    assert found[0].startswith(line)


@pytest.mark.parametrize("kind", TOLERANCES)
def test_keys_missing_and_new_and_exit_codes_are_told(kind):
    line = {"score": {"exit_code": 0, "stderr": [], "printed": {"a": 1.0}}}
    assert compared(kind, line, {"score": line["score"] | {"exit_code": 2}}) == ["score.exit_code: 0 -> 2"]
    assert compared(kind, line, {"score": line["score"] | {"stderr": ["gfimu: no"]}}) == [
        'score.stderr: [] -> ["gfimu: no"]'
    ]
    assert compared(kind, line, {"score": line["score"] | {"printed": {"b": 1.0}}}) == [
        "score.printed.a: missing",
        "score.printed.b: new",
    ]


@pytest.mark.parametrize("kind", TOLERANCES)
def test_rounding_is_finer_than_the_tolerance(kind):
    value = {"b": [2.0 / 3.0, -1e5 / 7.0], "a": {"value": 1e-7 / 3.0, "word": "ß"}, "c": [], "d": {}, "e": ["x", 1]}
    stored = text(value, TOLERANCES[kind])
    assert compared(kind, json.loads(stored), value) == []
    assert text(json.loads(stored), TOLERANCES[kind]) == stored
    assert list(json.loads(stored)) == sorted(value)
    assert '"ß"' in stored
