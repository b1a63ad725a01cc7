"""No impossible verdict: what the gate withdraws, in which words, and what is said where causes explain in part."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from made_diagnoses import made_diagnosis

from gfimu import AccelerometerArray, InputError
from gfimu.diagnosis import diagnose, headline, report_html
from gfimu.recording import Recording
from sim.effects import make_effect
from sim.trials import Measurement, draw_world, measure, random_profile, study_cases
from sim.twin import Twin

SETTING = Measurement(duration=24.0)


@pytest.fixture(scope="module")
def twin():
    return Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


@pytest.mark.study
def test_causes_that_explain_in_part_say_so_everywhere():
    whole = made_diagnosis("explained")
    part = replace(whole, gain=replace(whole.gain, share_of_excess_removed=0.67))
    assert (whole.in_part, part.in_part) == (False, True)
    assert json.loads(part.to_json())["in_part"] is True
    assert headline(part).startswith("Found in part what the simulation leaves out: ")
    assert "67 %" in headline(part)
    assert "in part" not in headline(whole)
    assert "Verdict: Explained in part" in report_html(part)


@pytest.mark.study
def test_a_verdict_that_does_not_predict_unseen_data_is_unknown():
    # A place of the chips, taken out of the library, that gains imitate in the whole run but not in its parts.
    case = next(case for case in study_cases("left_out") if case.key == "left_out/80012")
    world = draw_world(case)
    found = diagnose([world.recording], world.twin)
    assert (found.verdict, found.causes) == ("unknown", ())
    assert "the causes found (scale_factor) do not predict validation data: " in found.unexplained.signature
    assert not any(effect.name == "scale_factor" for effect in found.twin.effects)


@pytest.mark.study
def test_gains_that_no_part_has_are_told_as_a_wrong_file(twin):
    gains = make_effect("scale_factor", dict.fromkeys(twin.array.channels[:3], 0.4))
    run = measure(np.random.default_rng(7), twin, [gains], SETTING)
    found = diagnose([run], twin)
    assert (found.verdict, found.causes) == ("unknown", ())
    assert found.unexplained.signature.startswith("the array file, axes or units do not fit these data: scale_factor ")
    assert not found.twin.effects


@pytest.mark.study
def test_one_channel_with_far_more_slow_noise_is_told(twin):
    rng = np.random.default_rng(12)
    motion = random_profile(rng, SETTING.duration)
    run = measure(rng, twin, [], SETTING, motion=motion)
    readings = run.readings.copy()
    steps = rng.standard_normal(len(readings))
    slow = np.zeros(len(readings))
    for row in range(1, len(slow)):  # first-order, 0.4 s, 60 mg
        slow[row] = 0.975 * slow[row - 1] + 0.6 * np.sqrt(1 - 0.975**2) * steps[row]
    channel = twin.array.channels.index("a22")
    readings[:, channel] += 0.1 * slow
    loud = diagnose([Recording.from_arrays(run.t_s, readings, twin.array, reference=run.reference)], twin)
    assert loud.noise.bias_instability_largest_channel == "a22"
    assert loud.noise.bias_instability_largest_m_s2 > 4 * loud.noise.bias_instability_m_s2
    assert loud.verdict == "unknown"
    assert "the bias instability of channel a22 is" in loud.unexplained.signature
    assert any("The largest bias instability is that of channel a22" in sentence for sentence in loud.sentences)
    assert "bias instability largest channel a22" in report_html(loud)
    quiet = diagnose([run], twin)
    assert quiet.verdict == "nothing_found"
    assert quiet.noise.bias_instability_largest_m_s2 < 4 * quiet.noise.bias_instability_m_s2


class Singular:
    """Stands for a step of the diagnosis whose equations can't be solved."""

    def __call__(self, *_, **__):
        raise np.linalg.LinAlgError("Eigenvalues did not converge")


@pytest.mark.study
def test_causes_that_cannot_be_judged_on_held_out_data_do_not_stand(twin, monkeypatch):
    tilted = make_effect("mount_tilt", {"x_rad": 0.01, "y_rad": 0.0})
    run = measure(np.random.default_rng(3), twin, [tilted], Measurement(duration=12.0))
    monkeypatch.setattr(sys.modules["gfimu.diagnosis.steps"], "gate_gains", Singular())
    found = diagnose([run], twin)
    assert (found.verdict, found.causes) == ("unknown", ())
    assert "can't be fitted to part of it" in found.unexplained.signature


def test_equations_without_a_solution_are_one_line_with_a_remedy(twin, monkeypatch):
    run = measure(np.random.default_rng(3), twin, [], Measurement(duration=8.0))
    monkeypatch.setattr(sys.modules["gfimu.diagnosis.steps"], "understand_any_length", Singular())
    with pytest.raises(InputError, match=r"first\.csv: the equations of this run have no solution .*; are the"):
        diagnose([run], twin, names=["first.csv"])
