"""The certificate of a calibration: terms, budget, conditions, what is not determined; its file and its schema."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from certification_cases import calibration_of, random_covariance, random_model, random_rotation

from gfimu import Certificate, InputError
from gfimu.calibration import certify
from gfimu.calibration.certificate.certificate import Component, Sheet, Term
from gfimu.calibration.certificate.quantities import stated_quantities
from gfimu.calibration.certificate.schema import SCHEMA_FILE, certificate_schema
from gfimu.calibration.combine import combine

G = 9.80665


@pytest.fixture
def calibration(rng):
    return calibration_of(random_model(rng), random_covariance(rng))


def valid(value, schema, parts):
    """Whether a value fits a schema of the keywords that ours has."""
    known = {"$ref", "$defs", "$schema", "title", "description", "type", "properties", "required", "items", "enum",
             "additionalProperties", "anyOf"}  # fmt: skip
    assert set(schema) <= known, set(schema) - known
    if "$ref" in schema:
        return valid(value, parts[schema["$ref"].removeprefix("#/$defs/")], parts)
    if "anyOf" in schema:
        return any(valid(value, one, parts) for one in schema["anyOf"])
    if "enum" in schema:
        return value in schema["enum"]
    kind = schema["type"]
    if kind == "object":
        keys, others = schema.get("properties", {}), schema["additionalProperties"]
        return (
            isinstance(value, dict)
            and set(schema.get("required", ())) <= set(value)
            and all(
                valid(one, keys[key], parts) if key in keys else others and valid(one, others, parts)
                for key, one in value.items()
            )
        )
    if kind == "array":
        return isinstance(value, list) and all(valid(one, schema["items"], parts) for one in value)
    types = {"string": str, "number": (int, float), "null": type(None), "integer": int}
    return isinstance(value, types[kind]) and not isinstance(value, bool)


def test_values_and_deviations_are_those_of_the_quantities(calibration):
    found, stated = certify(calibration), stated_quantities(calibration)
    std = np.sqrt(np.diag(stated.covariance(calibration.covariance)))
    for name, value, deviation in zip(stated.names, stated.values, std, strict=True):
        term = found.term(name)
        assert term.value == pytest.approx(value)
        assert term.std == pytest.approx(deviation)
        assert term.expanded == pytest.approx(1.959964 * deviation, rel=1e-5)
        assert term.degrees_of_freedom is None


def test_units_of_the_field(rng):
    """Bias in mg, scale factor per g, K2 in µg/g², angles in degrees: by hand."""
    model = replace(random_model(rng, 256.0), quadratic=np.array([2e-6, 0.0, 0.0]))
    found = certify(calibration_of(model, random_covariance(rng, 256.0), unit="lsb"))
    m = model.sensitivity
    expected = {
        "a11_K0": (model.bias[0] / m[0, 0] / G * 1e3, "mg"),
        "a11_K1": (m[0, 0] * G, "lsb per g"),
        # E / K1 = a + K2 a², in g: 1 g of input reads 1 + K2 G more, K2 = q M_xx
        "a11_K2": (2e-6 * m[0, 0] * G * 1e6, "µg/g²"),
        "a1_angle_xy": (np.degrees(np.arccos(m[0] @ m[1] / np.linalg.norm(m[0]) / np.linalg.norm(m[1]))), "°"),
    }
    for name, (value, unit) in expected.items():
        term = found.term(name)
        assert term.familiar_unit == unit
        assert term.value * term.familiar_factor == pytest.approx(value, rel=1e-9)


def test_what_was_not_determined_has_no_value(rng):
    model = replace(random_model(rng), quadratic=np.zeros(3))
    found = certify(calibration_of(model, random_covariance(rng), "x_axis", quadratic=False))
    for key in ("K2", "K3", "K_ip", "K_io", "K_po"):
        term = found.term(f"a12_{key}")
        assert (term.value, term.std, term.expanded, term.note) == (None, None, None, "not determined")
    defined = found.term("a11_delta_o")
    assert (defined.value, defined.std, defined.note) == (0.0, None, "zero by definition of the frame")
    assert found.term("a13_delta_o").std > 0.0


def test_the_misfit_has_the_degrees_of_freedom_of_the_redundancy(calibration):
    """A covariance scaled by 4 is 1/4 noise and 3/4 misfit: ν = r (4/3)²."""
    scaled = replace(calibration, statistics={"redundancy": 9.0, "covariance_factor": 4.0})
    term = certify(scaled).term("a11_K0")
    stds = sorted(one.std for one in certify(scaled).budget if one.quantity == "a11_K0")
    np.testing.assert_allclose(stds, np.array([0.5, math.sqrt(0.75)]) * term.std)
    assert term.degrees_of_freedom == pytest.approx(16.0)
    assert term.coverage_factor == pytest.approx(2.1199, abs=1e-4)


def test_further_components_join_by_squares(calibration):
    alone = certify(calibration).term("a11_K0")
    table = Component("a11_K0", "levelling of the table", "B", "uniform", 3.0 * alone.std, "m/s²")
    both = certify(calibration, components=[table])
    assert both.term("a11_K0").std == pytest.approx(math.sqrt(10.0) * alone.std)
    assert both.term("a12_K0").std == pytest.approx(certify(calibration).term("a12_K0").std)
    assert table in both.budget


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"quantity": "a11_K9"}, ["a11_K9", "terms: a11_K0"]),
        ({"unit": "mg"}, ["mg", "m/s²"]),
        ({"std": math.nan}, ["nan"]),
        ({"std": -1.0}, ["-1.0"]),
    ],
)
def test_a_component_that_fits_no_term_is_refused(calibration, change, words):
    with pytest.raises(InputError) as error:
        certify(calibration, components=[replace(Component("a11_K0", "table", "B", "uniform", 1.0, "m/s²"), **change)])
    assert all(word in str(error.value) for word in words)


def test_a_calibration_without_covariance_is_refused(calibration):
    with pytest.raises(InputError, match=r"cal\.json: the covariance is zero"):
        certify(replace(calibration, covariance=np.zeros_like(calibration.covariance)), source="cal.json")


def test_chips_are_stated_each_with_its_own_fit(rng):
    """Two chips of one recording: statistics with the chip's name, conditions as a range."""
    first = calibration_of(random_model(rng), random_covariance(rng))
    second = replace(
        first,
        channels=("b11", "b12", "b13"),
        names=tuple(name.replace("a1_", "b1_") for name in first.names),
        statistics={"poses": 18.0, "redundancy": 9.0, "covariance_factor": 4.0},
    )
    found = certify(combine([first, second]))
    assert found.term("a11_K0").degrees_of_freedom is None
    assert found.term("b11_K0").degrees_of_freedom == pytest.approx(16.0)
    assert found.term("a11_K0").value == found.term("b11_K0").value
    assert (found.conditions["poses"], found.conditions["covariance_factor"]) == ("18", "1 to 4")


def test_the_correlations_are_those_of_the_terms(calibration):
    (chip,) = certify(calibration).chips
    stated = stated_quantities(calibration)
    covariance = stated.covariance(calibration.covariance)
    std = np.sqrt(np.diag(covariance))
    assert chip.correlation_names == stated.names
    np.testing.assert_allclose(chip.correlation, covariance / np.outer(std, std), atol=1e-12)


def test_the_file_reads_back_and_fits_the_published_schema(calibration, tmp_path):
    sheet = Sheet("Angular sensor", (Term("range", "", "range", "rad/s", 40.0, 1.0, 2.0, 2.0),), {"rate": "0"}, ("so",))
    found = certify(calibration, item="cube", date="2026-11-27", angular_sensor=sheet)
    found.save(tmp_path / "certificate.json")
    data = json.loads((tmp_path / "certificate.json").read_text(encoding="utf-8"))
    assert Certificate.from_dict(data) == found
    schema = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))
    assert valid(data, {"$ref": schema["$ref"]}, schema["$defs"])
    for wrong in ({"item": 3}, {"unknown": 1}, {"budget": [{}]}, {"format_version": 2}):
        assert not valid(data | wrong, {"$ref": schema["$ref"]}, schema["$defs"])
    assert not valid({key: data[key] for key in data if key != "chips"}, {"$ref": schema["$ref"]}, schema["$defs"])


def test_the_published_schema_is_that_of_the_dataclasses():
    assert SCHEMA_FILE.read_text(encoding="utf-8") == certificate_schema(), (
        "run: python docs/scripts/make_files_reference.py"
    )


def test_every_key_of_the_schema_has_a_meaning():
    parts = json.loads(certificate_schema())["$defs"]
    assert len(parts) == 7
    assert all(key["description"] for part in parts.values() for key in part["properties"].values())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"format": "other"}, "not a certificate"),
        ({"format_version": 2}, "format version 2"),
        ({"chips": 1}, "damaged certificate"),
    ],
)
def test_a_damaged_file_is_refused(calibration, change, words):
    with pytest.raises(InputError, match=words):
        Certificate.from_dict(certify(calibration).to_dict() | change, source="theirs.json")


@pytest.mark.parametrize("key", ["value", "std", "expanded"])
def test_a_number_that_is_not_finite_is_refused(calibration, key):
    data = certify(calibration).to_dict()
    data["chips"][0]["terms"][1][key] = math.nan
    with pytest.raises(InputError, match=r"theirs\.json: a11_K1 is not finite"):
        Certificate.from_dict(data, source="theirs.json")


def test_rotating_the_fixture_changes_the_model_and_not_the_intrinsic_parameters(rng):
    model, covariance = random_model(rng), random_covariance(rng)
    ours = certify(calibration_of(model, covariance))
    theirs = certify(calibration_of(model, covariance, rotation=random_rotation(rng)))
    for mine, other in zip(ours.chips[0].intrinsic, theirs.chips[0].intrinsic, strict=True):
        assert other.value == pytest.approx(mine.value, rel=1e-9)
        assert other.expanded == pytest.approx(mine.expanded, rel=1e-6)
    assert theirs.term("a11_K1").value != pytest.approx(ours.term("a11_K1").value, rel=1e-3)
