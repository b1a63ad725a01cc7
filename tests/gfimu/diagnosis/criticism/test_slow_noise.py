"""More noise than the parts should have is found, with its size and where it is, and only where it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_fits import POLICY, channel, fitted, quiet, recorded, twin

from gfimu.diagnosis.criticism.slow_noise import loudest_channel, white_factor
from gfimu.diagnosis.fit.linear import energy_of, with_residue
from gfimu.diagnosis.fit.observed_at import observed_at
from gfimu.diagnosis.fit.random_walk import walk_strength
from sim.effects import make_effect
from sim.trials import bias_instability
from sim.trials.study.outcome import calibration_residue


def test_noise_of_the_data_sheet_is_nothing():
    stretches, fit = quiet()
    assert not walk_strength(stretches, fit.point).is_likely(POLICY)
    assert not loudest_channel(stretches, fit.point).stands_out(POLICY)
    assert white_factor(stretches, fit.point.levels) is None


def test_a_random_walk_of_all_biases_is_estimated():
    walk = make_effect("bias_random_walk", {"strength_m_s2_rts": 0.02})
    stretches, fit = fitted(recorded(2, effects=[walk]))
    found = walk_strength(stretches, fit.point)
    assert found.is_likely(POLICY)
    assert abs(found.strength - 0.02) < 3.0 * found.std
    assert found.std < 0.25 * found.strength
    # The strength is that of the whole random walk, also where the noise of the point has it already.
    levels = tuple(replace(one, walk=0.02) for one in fit.point.levels)
    again = walk_strength(stretches, replace(fit.point, levels=levels))
    assert again.strength == pytest.approx(found.strength, rel=1e-6)


def test_a_random_walk_over_coarse_steps_is_estimated():
    walk = make_effect("bias_random_walk", {"strength_m_s2_rts": 0.1})
    coarse = make_effect("coarse_resolution", {"step_m_s2": 0.3})
    stretches, fit = fitted(recorded(2, effects=[walk, coarse]))
    assert stretches[0].steps.channels == pytest.approx(0.3)
    found = walk_strength(stretches, fit.point)
    assert found.is_likely(POLICY)
    assert abs(found.strength - 0.1) < 3.0 * found.std


def test_a_walk_of_three_channels_is_none_of_all():
    rng = np.random.default_rng(8)

    def drift(t, spin, readings, reference):
        readings[:, :3] += np.cumsum(0.004 * rng.standard_normal((len(t), 3)), axis=0)

    stretches, fit = fitted(recorded(7, drift))
    found = walk_strength(stretches, fit.point)
    assert found.log_odds > POLICY.lack_odds
    assert found.unequal > POLICY.unequal_walk
    assert not found.is_likely(POLICY)


def test_one_channel_with_far_more_slow_noise_stands_out():
    rng = np.random.default_rng(9)

    def drift(t, spin, readings, reference):
        readings[:, channel("a22")] += bias_instability(rng, len(t), 1, 0.02)[:, 0]

    stretches, fit = fitted(recorded(3, drift))
    found = loudest_channel(stretches, fit.point)
    assert found.stands_out(POLICY)
    assert found.name == "a22"
    assert found.level == pytest.approx(0.02, rel=0.5)
    # A level that the likelihood does not ask for is none: with the others' level raised there is no contrast.
    even = tuple(replace(one, flicker=np.full_like(one.flicker, 0.02)) for one in fit.point.levels)
    assert not loudest_channel(stretches, replace(fit.point, levels=even)).stands_out(POLICY)


def test_excess_white_noise_has_its_factor():
    stretches, fit = fitted(recorded(4, effects=[make_effect("noise", {"factor": 2.0})]))
    factor, std = white_factor(stretches, fit.point.levels)
    assert abs(factor - 2.0) < 3.0 * std
    assert std < 0.1
    # Of two runs, one of which is as expected, it is the rms.
    usual, other = quiet()
    both, _ = white_factor((*stretches, *usual), (*fit.point.levels, *other.point.levels))
    assert both == pytest.approx(np.sqrt((2.0**2 + 1.0) / 2.0), rel=0.05)


def test_residuals_at_a_point_are_without_its_calibration_residue():
    residue = calibration_residue(np.random.default_rng(5), twin().array)
    stretches, fit = fitted(recorded(5, effects=residue))
    [bare] = observed_at(stretches, fit.point)
    point = with_residue(stretches, fit.point, 1.0)
    [seen] = observed_at(stretches, point)
    drive = fit.point.drives[0].energy()
    assert seen.misfit + drive < energy_of(stretches, point) < bare.misfit + drive
    assert seen.misfit < bare.misfit - 50.0
