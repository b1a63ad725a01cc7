"""A small residue of the calibration in all numbers at once is no cause, and hides none."""

from __future__ import annotations

import numpy as np
import pytest

from gfimu import AccelerometerArray
from gfimu.diagnosis import Policy, diagnose, make_stretches, prepare
from gfimu.diagnosis.criticism import holdout
from gfimu.diagnosis.search.nuisance_models import understand
from sim.effects import EFFECTS, make_effect
from sim.trials import Measurement, draw_world, measure, study_cases
from sim.trials.study.cases import Case
from sim.twin import Twin

TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
CORRECTED = {name for name, family in EFFECTS.items() if getattr(family, "tolerance", 0.0) > 0.0}
"""Effects of which a good calibration leaves something."""


@pytest.mark.study
def test_a_residue_alone_is_no_cause_and_is_reported():
    world = draw_world(Case("reduced", 700, residue=True, duration=20.0))
    found = diagnose([world.recording], world.twin)
    assert found.verdict == "nothing_found", found
    assert found.noise.calibration_residue == 1.0
    assert any("calibration is a little off" in sentence for sentence in found.sentences)
    corrections = {effect.name for effect in found.twin.effects}
    assert corrections == CORRECTED
    again = diagnose([world.recording], found.twin)
    assert again.verdict == "nothing_found"
    assert again.noise.calibration_residue == 0.0


@pytest.mark.study
def test_a_cause_beside_a_residue_is_named_alone():
    world = draw_world(Case("reduced", 701, ("clock_error",), 1500.0, residue=True, duration=20.0))
    found = diagnose([world.recording], world.twin)
    assert [cause.effect for cause in found.causes] == ["clock_error"]
    ((_, truth),) = world.truth
    (cause,) = found.causes
    assert abs(cause.parameters["ratio"] - truth["ratio"]) < 4 * cause.std["ratio"]


@pytest.mark.study
@pytest.mark.parametrize("residue", [True, False])
def test_a_residue_is_admitted_beside_a_cause_where_there_is_one(residue):
    world = draw_world(Case("reduced", 702, ("tacho_latency",), 1500.0, residue=residue, duration=20.0))
    prepared = prepare([world.recording], world.twin, ["run"])
    found = understand(make_stretches(world.twin, prepared.runs, prepared.effects), Policy())
    assert (found.residue > 0.0) == residue


@pytest.mark.study
def test_two_causes_are_not_taken_for_a_residue():
    world = draw_world(Case("reduced", 703, ("eccentricity", "clock_error"), 1000.0, duration=20.0))
    found = diagnose([world.recording], world.twin)
    assert {cause.effect for cause in found.causes} == {"eccentricity", "clock_error"}


@pytest.mark.study
def test_a_mode_beside_a_residue_is_named_alone():
    world = draw_world(Case("reduced", 701, ("resonance",), 1500.0, residue=True, duration=14.0))
    found = diagnose([world.recording], world.twin)
    assert [cause.effect for cause in found.causes] == ["resonance"]
    ((_, truth),) = world.truth
    # Its ± is too small: a drive that follows how the mode decays is not fitted beside a residue.
    assert found.causes[0].parameters["frequency_hz"] == pytest.approx(truth["frequency_hz"], rel=0.02)


@pytest.mark.study
def test_a_single_small_error_is_not_called_a_residue():
    recording = measure(
        np.random.default_rng(5), TWIN, [make_effect("bias", {"a21_m_s2": 0.02})], Measurement(duration=20.0)
    )
    found = diagnose([recording], TWIN)
    assert found.noise.calibration_residue == 0.0
    assert "bias" in {cause.effect for cause in found.causes}
    assert not any("calibrate the unit" in cause.why for cause in found.causes)


@pytest.mark.study
def test_a_cause_that_a_residue_would_replace_as_well_is_not_certain():
    """Small errors of all numbers and strong bias instability: one effect alone is as probable as all together."""
    case = next(one for one in study_cases("residue") if one.seed == 50002)
    world = draw_world(case)
    found = diagnose([world.recording], world.twin)
    for cause in found.causes:
        assert cause.probability < 0.95  # 0.995 without the residue among its rivals
        assert "calibrate the unit" in cause.why


@pytest.mark.study
def test_the_gain_of_a_residue_is_that_of_the_part_it_was_not_fitted_to(monkeypatch):
    measured = holdout.measure
    seen = []

    def kept(nominal, extended, *rest):
        seen.append(next(effect for effect in extended.known if effect.name == "bias"))
        return measured(nominal, extended, *rest)

    monkeypatch.setattr(holdout, "measure", kept)
    world = draw_world(Case("reduced", 702, residue=True, duration=30.0))
    found = diagnose([world.recording], world.twin)
    assert found.calibration_residue
    assert found.gain.rms_after < found.gain.rms_before
    whole = next(effect for effect in found.twin.effects if effect.name == "bias")
    one, other = seen[0], seen[-1]  # of the odd blocks, held at the even ones, and the other way round
    names = [f"{channel}_m_s2" for channel in TWIN.array.channels]
    of_whole, of_one, of_other = (np.array([e.parameters[key] for key in names]) for e in (whole, one, other))
    # Each part's own, and not those of the whole run; both near them, as they measure the same.
    assert np.abs(of_one - of_other).max() > 1e-5
    assert np.abs(of_one - of_whole).max() > 1e-5
    assert np.sqrt(np.mean((of_one - of_other) ** 2)) < 2 * np.sqrt(np.mean(of_whole**2))
