"""A diagnosis prints on one line, and so do the runs that it carries."""

import json

import pytest
from made_diagnoses import made_diagnosis

import gfimu
from gfimu import Diagnosis, InputError


def test_one_line():
    found = made_diagnosis()
    for result in (found, found.runs[0]):
        assert "\n" not in repr(result)
        assert len(repr(result)) <= 240
    assert repr(found).startswith("Diagnosis(explained, ")
    assert all(cause.effect in repr(found) for cause in found.causes)


def test_the_parts_write_themselves_as_the_contract_has_them():
    found = made_diagnosis("unknown")
    written = json.loads(Diagnosis.to_json(found))
    assert written["residual"]["unit"] == "m/s2"
    assert written["residual"]["after_by_channel"] == pytest.approx(dict(found.residual.after_by_channel))
    assert written["gain"]["held_out_rms_before"] == pytest.approx(found.gain.rms_before, nan_ok=True)
    (located,) = written["causes"]
    assert (located["effect"], located["place"], located["function"]["x_unit"]) == ("unlisted", "reference", "rad/s")
    assert set(written["unexplained"]) == {"significant", "signature", "log_odds", "mistake"}


def test_a_diagnosis_writes_its_folder_as_the_command_does(tmp_path):
    taken = tmp_path / "file"
    taken.write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="file"):
        gfimu.write_report(made_diagnosis(), taken)
