"""A diagnosis prints on one line, and so do the runs that it carries for pictures."""

from made_diagnoses import made_diagnosis


def test_one_line():
    found = made_diagnosis()
    for result in (found, found.runs[0]):
        assert "\n" not in repr(result)
        assert len(repr(result)) <= 240
    assert repr(found).startswith("Diagnosis(explained, ")
    assert all(cause.effect in repr(found) for cause in found.causes)
