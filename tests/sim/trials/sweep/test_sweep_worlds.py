"""Cases of kind ``measure``: what they give of a world, against a solution written down here."""

import numpy as np
import pytest

from sim.trials import Case, Measurement, WorldFactory, measure_case
from sim.twin import Twin

SEED = 12345


def test_the_errors_are_those_of_a_least_squares_solution():
    """α, p and ω² of every sample by least squares, against the motion of the table (upright, about z)."""
    twin = Twin.load("cube12_turntable")
    made = WorldFactory(twin, Measurement(duration=10.0)).world(np.random.default_rng(SEED))
    array, readings = twin.array.relative_to([0.0, 0.0, 0.0]), made.recording.readings
    H = np.hstack([array.regression_matrix, array.centripetal_matrix])
    x = np.linalg.lstsq(H, readings.T, rcond=None)[0].T  # (n, 12)
    alpha = x[:, :3] - np.outer(made.motion.acceleration, [0.0, 0.0, 1.0])
    p = x[:, 3:6] - [0.0, 0.0, twin.gravity]
    found = measure_case(Case(0, {"duration_s": 10.0}, SEED))
    assert found["alpha_rms_rad_s2"] == pytest.approx(np.sqrt(np.mean(np.sum(alpha**2, axis=1))), rel=1e-6)
    assert found["p_rms_m_s2"] == pytest.approx(np.sqrt(np.mean(np.sum(p**2, axis=1))), rel=1e-6)
    speed = np.sqrt(np.maximum(x[:, 6:9].sum(axis=1), 0.0)) - np.abs(made.motion.rate)
    assert found["speed_rms_rad_s"] == pytest.approx(np.sqrt(np.mean(speed**2)), rel=1e-6)
    end = np.sum(alpha[:-1], axis=0) / 100.0
    assert found["omega_end_rad_s"] == pytest.approx(np.linalg.norm(end), rel=1e-6)


def test_a_nominal_world_deviates_by_its_noise():
    quiet = {"duration_s": 40.0, "bias_instability_mg": 0.0}
    found = [measure_case(Case(k, quiet, k))["deviation_over_noise"] for k in range(5)]
    assert np.mean(found) == pytest.approx(1.0, abs=5 / np.sqrt(2 * 5 * 48000))


def test_a_drawn_error_grows_with_its_standard_deviation():
    def error(std):
        return measure_case(Case(0, {"duration_s": 10.0, "scale_factor.std_ratio": std}, SEED))["p_rms_m_s2"]

    none, some, more = error(0.0), error(0.01), error(0.02)
    assert none == measure_case(Case(0, {"duration_s": 10.0}, SEED))["p_rms_m_s2"]
    # The same draws, twice as large: the part beyond the noise is four times as large in power.
    assert (more**2 - none**2) == pytest.approx(4 * (some**2 - none**2), rel=0.1)


def test_an_effect_is_hidden_at_the_size_asked_for():
    def deviation(size):
        values = {"duration_s": 10.0, "effect": "bias", "d_prime": size}
        return measure_case(Case(0, values, SEED))["deviation_over_noise"]

    excess = [(deviation(size) ** 2 - deviation(1e-3) ** 2) * 12000 for size in (100.0, 200.0)]  # Σ(Δ/σ)² = d′²
    assert excess == pytest.approx([100.0**2, 200.0**2], rel=0.15)  # of bias and noise crossed: 2 d′, 2 %
