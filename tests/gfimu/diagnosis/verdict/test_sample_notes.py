"""Notes on the samples themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_diagnoses import made_diagnosis
from made_runs import made_run

from gfimu.diagnosis import with_sample_notes

RUN = made_run(np.zeros((100, 2)))


@pytest.fixture(scope="module")
def found():
    return made_diagnosis("nothing_found")


def test_sound_samples_need_no_note(found):
    noted = with_sample_notes(found, [RUN, RUN])
    assert noted.sentences == found.sentences
    assert noted.noise == found.noise


def test_the_largest_jitter_and_all_impossible_values_are_reported(found):
    runs = [replace(RUN, jitter=2e-4, impossible=1), replace(RUN, jitter=1e-3, impossible=2)]
    noted = with_sample_notes(found, runs)
    assert noted.noise.time_jitter_s == 1e-3
    assert noted.noise.impossible_values == 3.0
    assert noted.sentences[: len(found.sentences)] == found.sentences
    jitter, impossible = noted.sentences[len(found.sentences) :]
    assert "scatter by 1 ms rms" in jitter
    assert impossible.startswith("3 values are left out")
    (one,) = with_sample_notes(found, [replace(RUN, impossible=1)]).sentences[len(found.sentences) :]
    assert one.startswith("1 value is left out")
    assert found.noise.time_jitter_s is None
