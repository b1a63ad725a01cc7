"""Motion profiles and the analytic tumble."""

import numpy as np
import pytest

from gfimu import InputError
from sim import Chirp, Hold, Ramp, Sine, Tumble, paper_run, speed_sweep, spin_profile


def test_profile_goes_through_its_holds():
    spin = spin_profile([Hold(1.0), Ramp(4.0, 2.0), Hold(1.0), Ramp(-2.0, 1.0), Hold(1.0)], start_angle=0.3)
    state = spin.at(np.array([0.0, 0.5, 3.0, 3.9, 5.0, 6.0, 7.0, -0.5]))
    np.testing.assert_allclose(state.rate, [0, 0, 4, 4, -2, -2, -2, 0], atol=1e-12)
    np.testing.assert_allclose(state.acceleration, 0.0, atol=1e-9)
    # A ramp is symmetric: it turns by its mean rate. 2·2 + 4·1 + 1·1 − 2·1.
    assert state.angle[0] == pytest.approx(0.3)
    assert state.angle[5] - state.angle[0] == pytest.approx(4 + 4 + 1 - 2, abs=1e-12)


@pytest.mark.parametrize(
    "segments",
    [
        paper_run(),
        speed_sweep([1.0, 5.0, -5.0]),
        [Hold(0.5), Ramp(3.0, 1.0), Chirp(1.0, 0.5, 6.0, 5.0), Sine(0.5, 2.0, 3.0), Hold(0.5)],
    ],
    ids=["paper run", "speed sweep", "chirp and sine"],
)
def test_rate_and_acceleration_are_the_derivatives_of_angle_and_rate(segments):
    spin, h = spin_profile(segments), 1e-5
    t = np.linspace(0.01, sum(segment.duration for segment in segments) - 0.01, 4001)
    before, now, after = (spin.at(t + k * h) for k in (-1, 0, 1))
    np.testing.assert_allclose((after.angle - before.angle) / (2 * h), now.rate, atol=1e-6)
    np.testing.assert_allclose((after.rate - before.rate) / (2 * h), now.acceleration, atol=1e-6)
    # Twice continuously differentiable: the acceleration has no step anywhere.
    fine = spin.at(np.arange(t[0], t[-1], 1e-4)).acceleration
    assert np.abs(np.diff(fine)).max() < 0.5


def test_paper_run_lasts_thirty_seconds_and_turns_both_ways():
    segments = paper_run()
    assert sum(segment.duration for segment in segments) == pytest.approx(30.0)
    rate = spin_profile(segments).at(np.arange(0, 30, 0.01)).rate
    assert rate.max() == pytest.approx(np.pi)
    assert rate.min() == pytest.approx(-np.pi)
    assert np.mean(rate == 0.0) > 0.1


def test_chirp_moves_between_its_frequencies():
    rate = spin_profile([Chirp(1.0, 1.0, 10.0, 20.0)]).at(np.arange(0, 20, 1e-3)).rate
    crossings = np.flatnonzero(np.diff(np.signbit(rate))) * 1e-3
    early, late = (np.sum((crossings >= a) & (crossings < b)) / 2 / (b - a) for a, b in ((2, 4), (16, 18)))
    assert early == pytest.approx(10 ** (3 / 20), rel=0.2)
    assert late == pytest.approx(10 ** (17 / 20), rel=0.05)
    assert np.abs(rate).max() == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("segments", [[], [Hold(0.0)], [Hold(1.0), Ramp(1.0, -2.0)]])
def test_bad_profiles_are_refused(segments):
    with pytest.raises(InputError, match="segment"):
        spin_profile(segments)


@pytest.fixture(scope="module")
def tumble():
    return Tumble(rate=6.0, inclination=0.98, rest=0.5, spin_up=1.5, sway=(0.05, 0.04, 0.03))


def test_tumble_fields_are_derivatives_of_each_other(tumble):
    h, t = 1e-5, np.linspace(0.0, 12.0, 3001)
    before, now, after = (tumble.at(t + k * h) for k in (-1, 0, 1))
    np.testing.assert_allclose((after.position - before.position) / (2 * h), now.velocity, atol=1e-8)
    np.testing.assert_allclose((after.velocity - before.velocity) / (2 * h), now.acceleration, atol=1e-6)
    np.testing.assert_allclose((after.omega - before.omega) / (2 * h), now.alpha, atol=1e-5)
    spin = np.swapaxes(now.rotation, 1, 2) @ (after.rotation - before.rotation) / (2 * h)
    np.testing.assert_allclose(spin[:, [2, 0, 1], [1, 2, 0]], now.omega, atol=1e-6)


def test_tumble_keeps_angular_momentum_and_energy(tumble):
    body = tumble.at(np.linspace(2.0, 60.0, 2001))
    momentum = np.einsum("nij,nj->ni", body.rotation, body.omega * tumble.inertia)
    np.testing.assert_allclose(momentum, np.tile(momentum[0], (2001, 1)), atol=1e-10 * np.linalg.norm(momentum[0]))
    energy = np.sum(body.omega**2 * tumble.inertia, axis=1)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-12)
    # All three axes take part.
    assert np.all(np.ptp(body.omega, axis=0) > 1.0)


def test_tumble_starts_upright_and_at_rest(tumble):
    body = tumble.at(np.array([0.0, 0.3]))
    np.testing.assert_allclose(body.rotation, np.tile(np.eye(3), (2, 1, 1)), atol=1e-14)
    for field in (body.velocity, body.acceleration, body.omega, body.alpha):
        np.testing.assert_array_equal(field, 0.0)


@pytest.mark.parametrize(
    "wrong", [{"inertia": (1.0, 1.0, 2.0)}, {"inclination": 1.2}, {"rate": 0.0}, {"spin_up": -1.0}]
)
def test_bad_tumbles_are_refused(wrong):
    with pytest.raises(InputError, match="tumble"):
        Tumble(**wrong)
