"""Every parameter of every effect has a unit that people see, or is declared to be a ratio, a number or a name."""

import re

import numpy as np
import pytest
from every_item import every

from gfimu import AccelerometerArray, NamedCause
from gfimu.diagnosis.report.plain_words import parameter_texts
from gfimu.model.parameter_units import KEY_ENDINGS, NAME, NUMBER, RATIO, key_name
from sim.effects import BODY_EFFECTS, EFFECTS, Size
from sim.effects.unknown import Unknown

CUBE = AccelerometerArray.load("cube12")
REGISTRY = {**EFFECTS, **BODY_EFFECTS, Unknown.name: Unknown}
PHYSICAL = re.compile(r"(1|m|s|rad|Hz|K|√|⁴|²|³|/|\(|\))+")
LONE_UNITS = {"rad": "°", "m/s²": "mg", "rad/s": "rpm"}


@every("name", REGISTRY)
def test_every_parameter_has_a_unit_or_is_declared_to_have_none(name):
    units = REGISTRY[name].parameter_units(CUBE)
    assert units.keys() == set(REGISTRY[name].parameter_keys(CUBE))
    for key, unit in units.items():
        assert unit in {RATIO, NUMBER, NAME} or PHYSICAL.fullmatch(unit), (key, unit)


@every("name", REGISTRY)
def test_every_key_ends_in_its_unit_and_in_no_other(name):
    units = REGISTRY[name].parameter_units(CUBE) | {size.key: size.unit for size in REGISTRY[name].sizes(CUBE)}
    for key, unit in units.items():
        endings = [ending for ending in KEY_ENDINGS.values() if f"_{key}".endswith(f"_{ending}")]
        longest = max(endings, key=len, default=None)
        assert KEY_ENDINGS.get(unit) == longest, f"{key} ends in {longest}, but is declared in {unit}"


@every("name", REGISTRY)
def test_every_size_has_a_unit_of_its_own(name):
    for size in REGISTRY[name].sizes(CUBE):
        assert size.unit == RATIO or PHYSICAL.fullmatch(size.unit), (size.key, size.unit)


@every("name", REGISTRY)
def test_what_a_diagnosis_fits_has_units(name):
    """Sizes and shapes become parameters, each of which has a unit."""
    effect = REGISTRY[name]
    for shape in effect.shapes(60.0, 100.0):
        made = effect.from_sizes(CUBE, np.full(len(effect.sizes(CUBE)), 0.01), shape)
        assert made.parameters.keys() <= effect.parameter_units(CUBE).keys()


def test_a_size_needs_a_unit():
    with pytest.raises(TypeError, match="unit"):
        Size(key="a11_m_s2", prior_std=0.1)


@every("name", REGISTRY)
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
        assert text.name == key_name(key, unit).replace("_", " ")


def test_vibration_rectification_is_no_percentage():
    key = "a11_m_s2_per_rad4_s4"
    effect = EFFECTS["vibration_rectification"]
    (text,) = parameter_texts(
        NamedCause(effect.name, {key: 5.8e-6}, {key: 2e-7}, 0.99), {key: effect.parameter_units(CUBE)[key]}
    )
    assert (text.name, text.value, text.familiar) == ("a11", "(5.80 ± 0.20)·10⁻⁶ m/s²/(rad/s)⁴", "")


@pytest.mark.parametrize("key", ["strange_key", "a11", "ratio"])
def test_a_parameter_of_unknown_unit_is_a_plain_number(key):
    (text,) = parameter_texts(NamedCause("new", {key: 0.01}, {key: 0.001}, 0.99), {})
    assert (text.name, text.value, text.familiar) == (key.replace("_", " "), "0.0100 ± 0.0010", "")


@pytest.mark.parametrize(
    ("key", "unit", "name"),
    [
        ("a11_m_s2", "m/s²", "a11"),
        ("delay_s", "s", "delay"),
        ("s", "s", "value"),
        ("ratio", RATIO, "ratio"),
        ("a11_m_s2", RATIO, "a11_m_s2"),
        ("a11_m_s2_per_rad4_s4", "m/s²/(rad/s)⁴", "a11"),
        ("a11_m_s2", "", "a11_m_s2"),
    ],
)
def test_a_key_without_its_unit(key, unit, name):
    assert key_name(key, unit) == name
