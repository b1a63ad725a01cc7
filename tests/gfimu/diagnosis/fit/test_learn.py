"""Learning of the nuisance parameters: noise, roughness and knots."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_cases import cause_of, lively, small_twin, stretches_of
from numpy.testing import assert_allclose

from gfimu.diagnosis import Policy, starting_point
from gfimu.diagnosis.fit.learn import learn_noise, learn_roughness
from gfimu.diagnosis.fit.random_walk import walk_strength
from sim.effects import make_effect

TWIN = small_twin()


def learnt(effects=(), *, duration=20.0, causes=(), **setting):
    stretches = stretches_of(TWIN, effects, duration=duration, motion=lively(duration), **setting)
    point = replace(starting_point(stretches, 0.1), causes=causes)
    for _ in range(2):
        point = learn_noise(stretches, learn_roughness(stretches, point))
    return stretches, point


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_white_noise_of_channels_and_reference(factor):
    effects = [make_effect("noise", {"factor": factor})] if factor != 1.0 else []
    _, point = learnt(effects, tacho_noise=0.05, bias_instability=0.0)
    white, expected = point.levels[0].white, TWIN.expected_noise(50.0)
    truth = np.sqrt(expected.analogue**2 * factor**2 + expected.quantum**2 / 12.0)
    # 1000 samples, of which the fast half is used by its median.
    assert_allclose(white[:-1], truth, rtol=0.15)
    assert np.median(white[:-1] / truth) == pytest.approx(1.0, abs=0.05)
    assert white[-1] == pytest.approx(0.05, rel=0.1)


def test_bias_instability():
    _, quiet = learnt(bias_instability=0.0)
    _, loud = learnt(bias_instability=0.02)
    assert np.median(loud.levels[0].flicker[:-1]) == pytest.approx(0.02, rel=0.6)  # a short run: to a factor
    assert np.median(loud.levels[0].flicker[:-1]) > 3.0 * np.median(quiet.levels[0].flicker[:-1])
    assert loud.levels[0].flicker[-1] == 0.0


def test_a_random_walk():
    stretches, point = learnt([make_effect("bias_random_walk", {"strength_m_s2_rts": 0.04})], bias_instability=1e-3)
    walk = walk_strength(stretches, point, Policy())
    assert abs(walk.strength - 0.04) < 3.0 * walk.std
    assert walk.is_likely(Policy())
    # The walk of a point is kept, and what it has is no bias instability any more.
    walking = replace(point, levels=tuple(replace(one, walk=walk.strength) for one in point.levels))
    there = learn_noise(stretches, walking).levels[0]
    assert there.walk == walk.strength
    assert np.median(there.flicker[:-1]) < np.median(point.levels[0].flicker[:-1])


def test_the_noise_is_what_causes_leave():
    cause = cause_of("interference_tone", TWIN.array, [40.0, 0.0], frequency_hz=20.0)
    effect = cause.effect(TWIN.array, 0)
    _, blind = learnt([effect], bias_instability=0.0)
    _, seeing = learnt([effect], causes=(cause,), bias_instability=0.0)
    assert_allclose(seeing.levels[0].white[:-1], TWIN.expected_noise(50.0).white, rtol=0.15)
    assert (blind.levels[0].white >= 0.98 * seeing.levels[0].white).all()


def test_the_first_drive_is_that_of_the_reference():
    stretches = stretches_of(TWIN, duration=8.0, motion=lively())
    (drive,) = starting_point(stretches, 0.1).drives
    t = stretches[0].run.t
    assert np.sqrt(np.mean((drive.spin.at(t).rate - lively().at(t).rate) ** 2)) < 0.02
    assert drive.spline.spacing == 0.1
    assert starting_point(stretches, 0.001).drives[0].spline.spacing == pytest.approx(0.02)  # no closer than samples
    assert np.median(drive.roughness) < 300.0  # the motion's fourth derivative is some 20 rad/s⁴
