"""Wiring is undone in a prediction as it was done in the readings; clipping is found at its level."""

from __future__ import annotations

import numpy as np
import pytest

from gfimu.diagnosis import prepare_run
from gfimu.diagnosis.data.faults.clipping import clipping_level, own_rails
from gfimu.diagnosis.data.faults.wiring import find_wiring, range_factors, rewired
from sim.effects import make_effect
from sim.trials import Measurement, measure, random_profile
from sim.twin import Twin

TWIN = Twin.load("cube12_turntable")
SETTING = Measurement(duration=20.0)
WIRED = [
    make_effect("axis_swap", {"channels": ["a11", "a22"]}),
    make_effect("sign_flip", {"channel": ["a13", "a41"]}),
    make_effect("wrong_range", {"chip": "a3", "factor": 2.0}),
]


def run_and_prediction(*hidden):
    rng = np.random.default_rng(4)
    motion = random_profile(rng, SETTING.duration)
    recording = measure(rng, TWIN, hidden, SETTING, motion=motion)
    temperature = recording.reference["temperature_degC"]
    return prepare_run(recording, TWIN), TWIN.predict(motion, recording.t_s, temperature=temperature)[0]


@pytest.mark.parametrize("effect", WIRED, ids=lambda effect: effect.name)
def test_a_prediction_is_rewired_as_the_simulation_does_it(effect):
    motion, t = random_profile(np.random.default_rng(5), 10.0), np.arange(500) / 100.0
    plain, wired = (TWIN.predict(motion, t, effects=some)[0] for some in ((), (effect,)))
    np.testing.assert_allclose(rewired(plain, [effect], TWIN), wired, atol=1e-9)


def test_a_chip_in_a_wider_range_has_coarser_counts():
    factors = range_factors(WIRED, TWIN)
    assert factors[TWIN.array.chip_of_channel == 2].tolist() == [2.0] * 3
    assert factors.sum() == TWIN.array.n_channels + 3


def test_exchanged_channels_are_found():
    run, prediction = run_and_prediction(WIRED[0])
    white = TWIN.expected_noise(SETTING.sample_rate).white
    assert [(name, parameters) for name, parameters, _ in find_wiring(TWIN, run, prediction, white, set())] == [
        ("axis_swap", {"channels": ["a11", "a22"]})
    ]


def test_one_limit_of_all_channels_is_found_at_its_level():
    run, prediction = run_and_prediction(make_effect("saturation", {"limit_m_s2": 6.0}))
    expected = TWIN.expected_noise(SETTING.sample_rate)
    steps = np.full(TWIN.array.n_channels, expected.quantum)
    level = clipping_level(run, prediction, steps, expected.white)
    assert level == pytest.approx(6.0, abs=expected.quantum)
    assert own_rails(run, prediction, level, steps, expected.white) == []
    untouched, prediction = run_and_prediction()
    assert clipping_level(untouched, prediction, steps, expected.white) is None
