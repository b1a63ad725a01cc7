"""What a fit leaves unexplained is found by channel and function, and nothing is found where it explains all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_fits import POLICY, cause, channel, fitted, quiet, recorded, twin

from gfimu.diagnosis.criticism.generic import judges_reference, series_products
from gfimu.diagnosis.criticism.lack_of_fit import dependence_unexplained, lack_of_fit
from gfimu.diagnosis.data.rounding import Steps
from gfimu.diagnosis.fit.linear import linearise
from sim.effects import make_effect
from sim.twin import Twin


def pickup(t, spin, readings, reference):
    """One channel picks up a field that turns twice per revolution, in proportion to the rate."""
    readings[:, channel("a31")] += 0.02 * spin.rate * np.cos(2 * spin.angle)


def test_noise_lacks_nothing():
    assert lack_of_fit(*quiet()).log_odds < 5.0


def test_a_dependence_of_one_channel_has_its_function_and_size():
    stretches, fit = fitted(recorded(3, pickup))
    found = lack_of_fit(stretches, fit)
    assert found.log_odds > POLICY.lack_odds
    assert found.signature == "channel a31 depends on 2 per revolution × rate (cosine)"
    assert found.dependence == "2 per revolution × rate (cosine)"
    [(key, size)] = found.surrogate.items()
    assert key == "a31: 2 per revolution × rate (cosine)"
    # Of a function of unit rms.
    state = fit.point.drives[0].spin.at(stretches[0].run.t)
    assert size == pytest.approx(float(np.std(0.02 * state.rate * np.cos(2 * state.angle))), rel=0.05)
    assert lack_of_fit(stretches, fit, smooth=False).log_odds < found.log_odds


def test_what_a_cause_explains_is_found_without_it_only():
    eccentric = recorded(2, effects=[make_effect("eccentricity", {"x_m": 0.002, "y_m": -0.001})])
    bare = lack_of_fit(*fitted(eccentric))
    assert bare.log_odds > POLICY.lack_odds
    assert bare.signature.startswith("several channels (strongest ")
    assert lack_of_fit(*fitted(eccentric, causes=[cause("eccentricity")])).log_odds < 5.0


def test_causes_are_projected_out():
    stretches, fit = quiet()

    def constant(stretch, at):
        return 0.03 * np.ones((len(stretch.run.t), 1))

    free, _ = series_products(stretches, fit.point, constant)
    biased = replace(fit.point, causes=(cause("bias", "channel a12"),))
    gram, score = series_products(stretches, biased, constant)
    place = channel("a12")
    assert gram[place, place] < 1e-2 * free[place, place]
    assert abs(score[place]) < 1e-2 * np.sqrt(free[place, place]) * 3.0
    others = np.delete(np.arange(12), place)
    np.testing.assert_allclose(gram[np.ix_(others, others)], free[np.ix_(others, others)], rtol=0.2, atol=1.0)


def test_the_score_of_a_function_is_its_product_with_the_whitened_residual():
    stretches, fit = quiet()
    wave = np.cos(2 * np.pi * 0.7 * stretches[0].run.t)[:, None]
    gram, score = series_products(stretches, fit.point, lambda stretch, at: wave)
    [posterior] = linearise(stretches, fit.point).posteriors
    # W(r − Jδ): its product with any column is that column's score.
    np.testing.assert_allclose(score, (wave.T @ posterior.whitened)[0], rtol=1e-6, atol=1e-6 * np.abs(score).max())
    assert gram.shape == (13, 13)
    np.testing.assert_allclose(gram, gram.T, rtol=1e-9, atol=1e-9 * np.abs(gram).max())


def test_a_coarse_or_commanded_reference_is_not_judged():
    [stretch] = quiet()[0]
    assert judges_reference([stretch])
    assert not judges_reference([stretch, replace(stretch, steps=Steps(reference=0.1))])
    commanded = Twin(array=twin().array, array_name="cube12", drive_source="command")
    assert not judges_reference([replace(stretch, model=commanded)])


def test_the_jerk_of_the_reference_is_no_sign_beside_a_cause_with_a_memory():
    def jerky(t, spin, readings, reference):
        reference += 2e-3 * np.gradient(spin.acceleration, t)

    stretches, fit = fitted(recorded(6, jerky))
    found = dependence_unexplained(stretches, fit.point)
    assert found.dependence == "jerk", found
    assert found.signature == "the reference depends on jerk"
    mode = cause("resonance", shape={"frequency_hz": 9.0, "damping_ratio": 0.1})
    beside = dependence_unexplained(stretches, replace(fit.point, causes=(mode.at(np.array([1e-6])),)))
    assert beside.dependence != "jerk"
    assert beside.log_odds < found.log_odds


@pytest.mark.study
def test_a_weakly_damped_mode_that_is_fitted_exactly_leaves_no_dependence():
    """The drive's prior is smoother than a table that a mode acts back on: the jerk of its reference has 11 nats."""
    shape = {"frequency_hz": 3.97, "damping_ratio": 0.0125}
    mode = make_effect("resonance", {"gain": 0.82, **shape})
    run = recorded(7, effects=[mode], duration=20.0)
    stretches, fit = fitted(run, causes=[cause("resonance", shape=shape)], exact=True)
    assert dependence_unexplained(stretches, fit.point).log_odds < 5.0


def test_many_isolated_samples_are_a_lack_of_fit():
    assert lack_of_fit(*quiet(), smooth=False, spikes=3).log_odds < 5.0
    found = lack_of_fit(*quiet(), smooth=False, spikes=9)
    assert found.log_odds == 90.0
    assert found.signature == "9 isolated samples far off their neighbours"


def test_rounded_readings_are_not_tested_for_their_noise():
    rng = np.random.default_rng(3)

    def louder(t, spin, readings, reference):
        readings += 0.01 * np.abs(spin.rate)[:, None] * rng.standard_normal(readings.shape)

    stretches, fit = fitted(recorded(3, louder))
    assert "changes with the rate" in lack_of_fit(stretches, fit, smooth=False).signature
    assert "changes with" not in lack_of_fit(stretches, fit, smooth=False, rounded=True).signature


def test_each_stretch_is_one_more_chance():
    stretches, fit = quiet()
    one = lack_of_fit(stretches, fit, smooth=False, rounded=True)
    point = replace(fit.point, drives=fit.point.drives * 2, levels=fit.point.levels * 2)
    two = lack_of_fit(stretches * 2, replace(fit, point=point), smooth=False, rounded=True)
    assert two.log_odds == pytest.approx(one.log_odds - np.log(2.0))
