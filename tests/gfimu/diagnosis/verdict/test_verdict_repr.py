"""A diagnosis prints on one line, and so do the runs that it carries; its parameters print with their units."""

import json
from dataclasses import replace

import pytest
from made_diagnoses import made_diagnosis

import gfimu
from gfimu import Diagnosis, InputError, NamedCause
from gfimu.diagnosis.report.picture import _notes
from gfimu.diagnosis.report.plain_words import parameter_units


def test_one_line():
    found = made_diagnosis()
    for result in (found, found.runs[0]):
        assert "\n" not in repr(result)
        assert len(repr(result)) <= 240
    assert repr(found).startswith("Diagnosis(explained, ")
    assert all(cause.effect in repr(found) for cause in found.causes)


def test_the_picture_prints_a_parameter_in_the_unit_that_its_effect_declares():
    found = made_diagnosis()
    key = "a11_m_s2_per_rad4_s4"
    cause = NamedCause("vibration_rectification", {key: 5.8e-6}, {key: 2e-7}, 0.99)
    units = parameter_units(found, cause)
    assert units[key] == "m/s²/(rad/s)⁴"
    assert "a11 (5.80 ± 0.20)·10⁻⁶ m/s²/(rad/s)⁴ (probability" in _notes(replace(found, causes=(cause,)))
    assert parameter_units(found, replace(cause, effect="not in the library")) == {}


def test_the_parts_write_themselves_as_the_contract_has_them():
    found = made_diagnosis("unknown")
    written = json.loads(Diagnosis.to_json(found))
    assert written["residual"]["unit"] == "m/s2"
    assert written["residual"]["after_by_channel"] == pytest.approx(dict(found.residual.after_by_channel))
    assert written["gain"]["held_out_rms_before"] == pytest.approx(found.gain.rms_before, nan_ok=True)
    assert written["unexplained"]["surrogate"] == dict(found.unexplained.surrogate)
    assert set(written["unexplained"]) == {
        "significant", "signature", "log_odds", "surrogate", "extends_twin", "left_out", "mistake",
    }  # fmt: skip


def test_a_diagnosis_writes_its_folder_as_the_command_does(tmp_path):
    taken = tmp_path / "file"
    taken.write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="file"):
        gfimu.write_report(made_diagnosis(), taken)
