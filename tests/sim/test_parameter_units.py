"""Every parameter of every effect has a unit that people see, or is declared to be a ratio, a number or a name."""

import re

import pytest

from gfimu import AccelerometerArray
from gfimu.diagnosis.report.plain_words import parameter_texts
from gfimu.diagnosis.verdict.verdict import NamedCause
from gfimu.units import NAME, NUMBER, RATIO, split_key
from sim.effects import BODY_EFFECTS, EFFECTS
from sim.effects.unknown import Unknown

CUBE = AccelerometerArray.load("cube12")
REGISTRY = {**EFFECTS, **BODY_EFFECTS, Unknown.name: Unknown}
PHYSICAL = re.compile(r"(1|m|s|rad|Hz|K|√|⁴|²|³|/|\(|\))+")
LONE_UNITS = {"rad": "°", "m/s²": "mg", "rad/s": "rpm"}


@pytest.mark.parametrize("name", REGISTRY)
def test_every_key_has_a_unit_or_is_declared_to_have_none(name):
    units = REGISTRY[name].parameter_units(CUBE)
    assert units.keys() == set(REGISTRY[name].parameter_keys(CUBE))
    for key, unit in units.items():
        assert unit in {RATIO, NUMBER, NAME} or PHYSICAL.fullmatch(unit), (key, unit)
        by_key = split_key(key)[1]
        assert by_key in {"", unit}, f"{key} ends in {by_key}, but is declared in {unit}"


@pytest.mark.parametrize("name", REGISTRY)
def test_every_parameter_prints_with_its_unit(name):
    units = REGISTRY[name].parameter_units(CUBE)
    values = {key: "a1" if unit == NAME else 0.0123 for key, unit in units.items()}
    stds = {key: 0.0004 for key, unit in units.items() if unit != NAME}
    texts = parameter_texts(NamedCause(name, values, stds, 0.99), units)
    for (key, unit), text in zip(units.items(), texts, strict=True):
        if unit == NAME:
            assert (text.value, text.familiar) == ("a1", "")
        elif unit in {RATIO, NUMBER}:
            assert text.value == "0.01230 ± 0.00040"
            assert text.familiar == ("1.230 ± 0.040 %" if unit == RATIO else ""), key
        else:
            assert text.value.endswith((f" {unit}", f" m{unit}")), text
            assert text.familiar.endswith(LONE_UNITS.get(unit, "")), text
            assert "%" not in text.familiar
        assert text.name == split_key(key)[0].replace("_", " ")


def test_vibration_rectification_is_no_percentage():
    key = "a11_m_s2_per_rad4_s4"
    effect = EFFECTS["vibration_rectification"]
    (text,) = parameter_texts(
        NamedCause(effect.name, {key: 5.8e-6}, {key: 2e-7}, 0.99), {key: effect.parameter_units(CUBE)[key]}
    )
    assert (text.name, text.value, text.familiar) == ("a11", "(5.80 ± 0.20)·10⁻⁶ m/s²/(rad/s)⁴", "")


def test_a_key_of_no_known_kind_is_no_percentage():
    (text,) = parameter_texts(NamedCause("new", {"strange_key": 0.01}, {"strange_key": 0.001}, 0.99))
    assert (text.name, text.familiar) == ("strange key", "")
