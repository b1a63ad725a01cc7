"""What a fit leaves unexplained is found by its place, and nothing is found where it explains all."""

from __future__ import annotations

import numpy as np
from made_fits import POLICY, cause, channel, fitted, quiet, recorded

from gfimu.diagnosis.criticism.lack_of_fit import lack_of_fit
from sim.effects import make_effect


def test_noise_lacks_nothing():
    assert lack_of_fit(*quiet()).log_odds < 5.0


def test_a_jump_of_one_channel_has_its_channel():
    def jump(t, spin, readings, reference):
        readings[t > 9.7, channel("a12")] += 0.08

    found = lack_of_fit(*fitted(recorded(3, jump)))
    assert found.log_odds > POLICY.lack_odds
    assert (found.free[0].where.name, found.free[0].where.components) == ("channel", ("a12",))
    assert found.signature == "the offset of a12 changes, in time, with nothing else that is known"


def test_what_a_cause_explains_is_found_without_it_only():
    eccentric = recorded(2, effects=[make_effect("eccentricity", {"x_m": 0.002, "y_m": -0.001})])
    assert lack_of_fit(*fitted(eccentric)).log_odds > POLICY.lack_odds
    assert lack_of_fit(*fitted(eccentric, causes=[cause("eccentricity")])).log_odds < 5.0


def test_many_isolated_samples_are_a_lack_of_fit():
    assert lack_of_fit(*quiet(), spikes=3).log_odds < 5.0
    found = lack_of_fit(*quiet(), spikes=9)
    assert found.log_odds == 90.0
    assert found.signature == "9 isolated samples far off their neighbours"


def test_rounded_readings_are_not_tested_for_their_noise():
    rng = np.random.default_rng(3)

    def louder(t, spin, readings, reference):
        readings += 0.01 * np.abs(spin.rate)[:, None] * rng.standard_normal(readings.shape)

    stretches, fit = fitted(recorded(3, louder))
    assert "changes with the rate" in lack_of_fit(stretches, fit).signature
    assert "changes with" not in lack_of_fit(stretches, fit, rounded=True).signature
