"""A free body integrated out block by block, against the same Gaussian written out densely."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from gfimu import AccelerometerArray, Chip, TurningAxis
from gfimu.diagnosis import Columns, Policy, family_columns, starting_point
from gfimu.diagnosis.data.body.run import prepare_body_run
from gfimu.diagnosis.data.body.stretch import make_body_stretches
from gfimu.diagnosis.fit.gauss_newton import determined, fit
from gfimu.diagnosis.fit.linear import linearise, of_causes
from gfimu.diagnosis.search.beam import Blocks, leading_sets
from gfimu.diagnosis.search.screening import screen
from gfimu.diagnosis.terms.hand.drive import HandDrive
from gfimu.diagnosis.terms.hand.learning import first_noise
from gfimu.diagnosis.terms.hand.posterior import condition_hand
from gfimu.motion import BodyDrive
from gfimu.recording import Recording
from sim.effects import make_effect
from sim.twin import Twin

PLACES = {"a": [-0.05, 0.0, 0.01], "b": [0.06, 0.0, 0.0], "c": [0.0, 0.04, 0.0]}
CHIPS = tuple(Chip(name, np.array(place), np.eye(3)) for name, place in PLACES.items())
TWIN = Twin(array=AccelerometerArray("three", CHIPS), drive_source="gyro", array_name="three")
PAIR = AccelerometerArray(
    "two", tuple(Chip(n, np.array([x, 0.0, 0.0]), np.eye(3)) for n, x in (("a", -0.05), ("b", 0.07)))
)
PAIR = replace(PAIR, turning_axis=TurningAxis(np.array([0.0, 0.0, 1.0]), np.zeros(3)))
WHEEL = Twin(array=PAIR, drive_source="gyro", array_name="two")
POLICY = Policy().of_body()


def stretch_of(*hidden, seed=1, duration=6.0, twin=TWIN, noise=0.002):
    """A body moved about by hand at random, never at rest."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, duration, 0.01)
    omega, force = (size * gaussian_filter1d(rng.normal(size=(len(t), 3)), 25.0, axis=0) for size in (25.0, 30.0))
    effects = [make_effect(name, parameters, twin.array) for name, parameters in hidden]
    readings = twin.predict_body(BodyDrive(t, omega, force + np.array([0.0, 0.0, 9.8])), t, effects=effects)
    readings = readings + rng.normal(size=readings.shape) * twin.expected_noise(100.0).white
    gyro = {f"gyro_{axis}_rad_s": omega[:, k] + noise * rng.normal(size=len(t)) for k, axis in enumerate("xyz")}
    run = prepare_body_run(Recording.from_arrays(t, readings, twin.array, reference=gyro), twin)
    return make_body_stretches(twin, [run], [[]])


@pytest.mark.parametrize(("twin", "noise"), [(TWIN, 0.002), (WHEEL, 0.03)], ids=["any rotation", "about a known axis"])
def test_blocks_give_what_a_dense_covariance_of_every_sample_gives(twin, noise):
    (stretch,) = stretch_of(("bias", {"b2_m_s2": 0.3}), twin=twin, noise=noise)
    levels = replace(first_noise(stretch), agitation=1e-3, acceleration=1.5, acceleration_slope=0.02)
    at = condition_hand(stretch, HandDrive.of(stretch), [], levels)
    families = [twin.families()[name] for name in ("bias", "sensor_position")]
    columns = Columns.together([family_columns(stretch, at.observed, at.drive, [], one, {}) for one in families])
    gram, score, _ = at.products(columns)

    # Rows whitened by the covariance of a sample: white noise, the lost angular acceleration, and a force of any size.
    on, (m, c) = stretch.on, stretch.mask[:, :-1].shape
    change = stretch.change_in_motion[stretch.starts]
    arms, white = twin.array.regression_matrix[:, :3], levels.white[:-1]
    roots = []
    for row in range(m):
        noise = levels.common(change)[row] * np.diag(white**2) + levels.lost(change)[row] * arms @ arms.T
        squared = stretch.rate_error[stretch.starts][row] * at.jacobian.squared_rate
        noise += np.outer(squared, squared)
        force = np.linalg.qr(twin.array.axes, mode="complete")[0][:, 3:].T  # combinations without the force
        roots.append(np.linalg.solve(np.linalg.cholesky(force @ noise @ force.T), force) * on[row])

    def rows(values):  # (m, c, k)
        return np.concatenate([root @ one for root, one in zip(roots, values, strict=True)])

    def dense(some):
        out = np.zeros((m, c, some.count))
        for channel, (places, part) in enumerate(zip(some.places[:-1], some.parts[:-1], strict=True)):
            out[:, channel, places] = part / np.where(
                at.observed.weight[:, [channel]] > 0, at.observed.weight[:, [channel]], 1
            )
        return out

    slow = np.zeros((m, c, c * stretch.cosines.shape[1]))
    for channel in range(c):
        slow[:, channel].reshape(m, c, -1)[:, channel] = levels.instability * stretch.cosines
    nuisances = np.hstack([rows(slow), rows(dense(at.motion))])
    wanted, right = rows(dense(columns)), rows(stretch.grouped(at.residual)[:, :, None])
    inner = nuisances.T @ nuisances + np.eye(nuisances.shape[1])

    def product(one, other):
        return one.T @ other - (one.T @ nuisances) @ np.linalg.solve(inner, nuisances.T @ other)

    size = np.sqrt(product(wanted, wanted).diagonal())
    assert gram == pytest.approx(product(wanted, wanted), abs=1e-6 * size.max() ** 2)
    assert score == pytest.approx(product(wanted, right)[:, 0], abs=1e-6 * size.max())
    assert at.objective == pytest.approx(product(right, right)[0, 0], rel=1e-9)


def test_one_fit_for_both_kinds_of_drive_finds_a_bias():
    stretches = stretch_of(("bias", {"b2_m_s2": 0.3}), seed=2)
    point = starting_point(stretches, POLICY.knots)
    blocks = Blocks(screen(stretches, point), POLICY)
    best = leading_sets(blocks, 2, POLICY)[0]
    found = fit(stretches, replace(point, causes=blocks.causes(best.members)), POLICY)
    assert found.key == {("bias", "channel b2")}
    assert found.causes[0].effect(TWIN.array, 0).parameters["b2_m_s2"] == pytest.approx(0.3, abs=0.02)


def test_what_the_data_do_not_determine_stays_at_zero_with_the_spread_of_its_prior():
    stretches = stretch_of(("bias", {"b2_m_s2": 0.3}), seed=2)
    point = starting_point(stretches, POLICY.knots)
    blocks = Blocks(screen(stretches, point), POLICY)
    every = next(n for n, h in enumerate(blocks.hypotheses) if h.cause.key == ("bias", "all channels"))
    found = fit(stretches, replace(point, causes=blocks.causes((every,))), POLICY)
    gram = linearise(stretches, found.point, of_causes(found.point)).gram
    _, turn, seen = determined(gram, POLICY.least_information)
    assert 3 <= (~seen).sum() < len(seen)  # at least the mean of every axis passes for a specific force
    (cause,) = found.causes
    assert turn[:, ~seen].T @ cause.coordinates == pytest.approx(0.0, abs=1e-6)
    assert np.diag(turn[:, ~seen].T @ cause.covariance @ turn[:, ~seen]) == pytest.approx(1.0, rel=1e-3)


def test_an_effect_is_not_searched_beside_one_that_can_do_all_it_does():
    stretches = stretch_of(("chip_delay", {"b_s": 4e-3}), seed=3)
    blocks = Blocks(screen(stretches, starting_point(stretches, POLICY.knots)), POLICY)
    names = [{blocks.hypotheses[n].cause.name for n in one.members} for one in leading_sets(blocks, 3, POLICY)]
    assert any("chip_delay" in some for some in names)
    assert not any({"channel_skew", "chip_delay"} <= some or {"misalignment", "cross_axis"} <= some for some in names)
