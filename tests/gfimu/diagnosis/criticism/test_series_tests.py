"""Lines, jumps and changing noise are found in the channel and at the time where they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_fits import DURATION, POLICY, channel, fitted, quiet, recorded, twin

from gfimu.diagnosis import make_stretches, prepare, starting_point
from gfimu.diagnosis.criticism.generic import motion_of
from gfimu.diagnosis.criticism.series_tests import changing_noise, jumps, lines
from gfimu.diagnosis.data.rounding import Steps
from gfimu.diagnosis.fit.observed_at import observed_at

LIKELY = 10.0


def seen_of(stretches, fit):
    """A stretch, its residuals and its motion."""
    return stretches[0], observed_at(stretches, fit.point)[0], motion_of(stretches[0], fit.point, fit.point.drives[0])


def added(values):
    """A quiet stretch and its residuals with values (n, c + 1) added."""
    stretch, seen, _ = seen_of(*quiet())
    return stretch, replace(seen, residual=seen.residual + values)


def tone(frequency, size):
    """A tone of sizes (c + 1,) at the times of the quiet stretch."""
    [stretch] = quiet()[0]
    return np.outer(np.sin(2 * np.pi * frequency * stretch.run.t), size)


def test_noise_has_no_lines_no_jumps_and_one_level():
    stretch, seen, state = seen_of(*quiet())
    assert lines(stretch, seen).log_odds < 5.0
    assert jumps(stretch, seen).log_odds < 5.0
    assert changing_noise([stretch], [seen], [state]).log_odds < 5.0


@pytest.mark.parametrize(("place", "name"), [(1, "channel a12"), (12, "the reference")])
def test_a_tone_is_found_in_its_series(place, name):
    found = lines(*added(tone(17.3, 0.02 * np.eye(13)[place])))
    assert found.log_odds > LIKELY
    assert found.signature.startswith(f"{name} has a tone at 17.")
    assert float(found.signature.split()[-2]) == pytest.approx(17.3, abs=0.6 / DURATION)


def test_a_loud_tone_of_a_run_has_the_odds_of_its_energy():
    amplitude = 2.0

    def ring(t, spin, readings, reference):
        readings += amplitude * np.sin(2 * np.pi * 11.0 * t)[:, None]

    prepared = prepare([recorded(3, ring)], twin(), ["run"])
    stretches = make_stretches(twin(), prepared.runs, prepared.effects)
    point = starting_point(stretches, POLICY.knots)
    found = lines(stretches[0], observed_at(stretches, point)[0])
    # |Σ y e^{−iωt}|²/n of a tone is nA²/4, in units of the noise; what leaks from it raises the floor it stands on.
    noise = point.levels[0].white[:-1]
    most = np.sum(len(stretches[0].run.t) * amplitude**2 / 4 / noise**2)
    assert 0.1 * most < found.log_odds < most
    assert "tone at 11.0" in found.signature


def test_the_reference_is_no_witness_where_it_has_coarse_steps():
    stretch, seen = added(tone(17.3, 0.05 * np.eye(13)[12]))
    assert lines(stretch, seen).log_odds > LIKELY
    assert lines(replace(stretch, steps=Steps(reference=0.1)), seen).log_odds < 5.0


def test_a_tone_too_weak_in_each_channel_is_found_in_all():
    _, seen, _ = seen_of(*quiet())
    found = lines(*added(tone(13.0, np.append(0.18 * seen.levels.white[:12], 0.0))))
    assert found.log_odds > LIKELY
    assert found.signature.startswith("several channels share a tone at 13.")


def test_a_line_far_beyond_the_smallest_probability_has_finite_odds():
    stretch, seen = added(tone(11.0, np.append(np.full(12, 2.0), 0.0)))
    found = lines(stretch, seen)
    # |Σ y e^{−iωt}|²/n of a tone is nA²/4, in units of the noise; what leaks from it raises the level around it.
    most = np.sum(len(stretch.run.t) * 2.0**2 / 4 / seen.levels.white[:-1] ** 2)
    assert 0.1 * most < found.log_odds < most
    assert "tone at 11.0" in found.signature


def test_a_jump_has_its_channel_time_and_size():
    def jump(t, spin, readings, reference):
        readings[t > 9.7, channel("a12")] += 0.08

    stretch, seen, _ = seen_of(*fitted(recorded(3, jump)))
    found = jumps(stretch, seen)
    assert found.log_odds > LIKELY
    assert found.signature.startswith("channel a12 jumps by +0.0")
    [(key, size)] = found.surrogate.items()
    assert key.startswith("a12: step at ")
    assert size == pytest.approx(0.08, abs=0.02)
    [hint] = found.hints
    assert float(hint.split()[2]) == pytest.approx(9.7, abs=0.3)


@pytest.mark.parametrize("of", ["the rate", "time"])
def test_noise_that_grows_is_found_with_what_it_follows(of):
    rng = np.random.default_rng(3)

    def louder(t, spin, readings, reference):
        level = np.abs(spin.rate) / 10.0 if of == "the rate" else t / DURATION
        readings += 0.05 * level[:, None] * rng.standard_normal(readings.shape)

    stretch, seen, state = seen_of(*fitted(recorded(3, louder)))
    found = changing_noise([stretch], [seen], [state])
    assert found.log_odds > LIKELY
    assert found.signature == f"the noise of all channels changes with {of}"
    assert changing_noise([stretch] * 2, [seen] * 2, [state] * 2).log_odds == pytest.approx(
        found.log_odds - np.log(2.0)
    )
