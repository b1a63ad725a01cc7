"""Rails of single channels, found from readings and predictions made by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_runs import made_run

from gfimu.diagnosis.data.faults.rails import Rail, find_rails, on_rails, rail_parameters, rail_sentence

STEP, SIGMA, LEVEL = 0.04, 0.05, 20.0 * 0.04 * 12  # m/s²; the level is a whole count
N = 2000
TRUTH = np.column_stack([14.0 * np.sin(0.02 * np.arange(N)), 12.0 * np.cos(0.011 * np.arange(N))])
STEPS, WHITE = np.full(2, STEP), np.full(2, SIGMA)


def counted(values):
    noise = SIGMA * np.random.default_rng(7).standard_normal(values.shape)
    return np.round((values + noise) / STEP) * STEP


def clipped(upper=np.inf, lower=-np.inf):
    readings = counted(TRUTH)
    readings[:, 0] = np.clip(readings[:, 0], lower, upper)
    return made_run(readings)


def test_a_sound_run_has_no_rails():
    assert find_rails(clipped(), TRUTH, STEPS, WHITE) == []


@pytest.mark.parametrize(("upper", "lower"), [(LEVEL, -np.inf), (np.inf, -LEVEL), (LEVEL, -0.8 * LEVEL)])
def test_each_side_of_a_channel_is_found_at_its_level(upper, lower):
    found = find_rails(clipped(upper, lower), TRUTH, STEPS, WHITE)
    expected = [(0, sign, level) for sign, level in ((1, upper), (-1, lower)) if np.isfinite(level)]
    assert [(one.channel, one.sign) for one in found] == [one[:2] for one in expected]
    assert [one.level for one in found] == pytest.approx([one[2] for one in expected], abs=0.5 * STEP)
    assert all(one.scatter == 0.0 for one in found)


def test_a_rail_that_scatters_is_flat_where_the_prediction_moves_beyond():
    run = clipped(LEVEL)
    scatter = 2.0 * STEP * np.random.default_rng(3).standard_normal(N)
    readings = run.readings.copy()
    over = readings[:, 0] >= LEVEL - 0.1 * STEP
    readings[over, 0] = np.round((LEVEL + scatter[over]) / STEP) * STEP
    (one,) = find_rails(replace(run, readings=readings), TRUTH, STEPS, WHITE)
    assert (one.channel, one.sign) == (0, 1)
    assert one.level == pytest.approx(LEVEL, abs=STEP)
    assert one.scatter == pytest.approx(2.0 * STEP, rel=0.3)


def test_a_wrong_reference_makes_no_rail():
    """A channel that stays while the prediction moves is right where no other follows the prediction either."""
    readings = counted(np.where(TRUTH > LEVEL, LEVEL, TRUTH))
    still = np.abs(TRUTH[:, 0]) > LEVEL  # where the first would be on its rail the second stands still too
    readings[still, 1] = counted(np.full((int(still.sum()), 1), 3.0))[:, 0]
    assert find_rails(made_run(readings), TRUTH, STEPS, WHITE) == []


def test_a_channel_that_never_leaves_the_level_is_pinned():
    run = clipped(LEVEL)
    readings = np.column_stack([run.readings[:, 0], np.full(N, LEVEL)])
    beyond = np.column_stack([TRUTH[:, 0], np.full(N, 2.0 * LEVEL)])
    assert [(one.channel, one.sign) for one in find_rails(made_run(readings), beyond, STEPS, WHITE)] == [(0, 1), (1, 1)]


def test_readings_on_a_rail_are_marked_up_to_where_noise_is_cut():
    run = clipped(LEVEL)
    marked = on_rails(run, TRUTH, [Rail(0, 1, LEVEL, 0.0)], STEPS, WHITE)
    expected = (run.readings[:, 0] > LEVEL - 0.6 * STEP) | (TRUTH[:, 0] > LEVEL - 4.0 * SIGMA)
    assert np.array_equal(marked[:, 0], expected)
    assert not marked[:, 1].any()


def test_what_is_said_of_rails():
    run = clipped(LEVEL, -0.8 * LEVEL)
    rails = find_rails(run, TRUTH, STEPS, WHITE)
    parameters = rail_parameters(run, rails, ("a11", "a12"), STEPS)
    assert parameters["limit_m_s2"] == pytest.approx(0.9 * LEVEL)
    assert parameters["a11_upper_m_s2"] == pytest.approx(LEVEL)
    assert parameters["a11_lower_m_s2"] == pytest.approx(-0.8 * LEVEL)
    assert f"a11 at {LEVEL:+.2f} m/s²" in rail_sentence(rails, ("a11", "a12"), 17)
