"""All stretches together, and a residue of the calibration integrated out, against dense Gaussians."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_cases import cause_of, dense, dense_gaussian, lively, part_of, small_twin, stretches_of
from numpy.testing import assert_allclose

from gfimu.diagnosis import NoiseLevels, starting_point
from gfimu.diagnosis.fit.linear import Point, energy_of, linearise, of_causes, with_residue
from gfimu.diagnosis.terms.residue import Residue
from sim.effects import EFFECTS

TWIN = small_twin()
TILT = cause_of("table_tilt", TWIN.array, [2.0, -1.0])


def _measured(seed):
    return stretches_of(TWIN, [TILT.effect(TWIN.array, 0)], duration=5.0, seed=seed, motion=lively())[0]


@pytest.fixture(scope="module")
def stretches():
    return tuple(replace(part_of(_measured(seed), 100), index=k) for k, seed in enumerate((1, 2)))


@pytest.fixture(scope="module")
def point(stretches):
    start = starting_point(stretches, 0.1)
    drives = tuple(replace(one, roughness=np.full(one.spline.intervals, 200.0), angle_std=0.02) for one in start.drives)
    levels = tuple(NoiseLevels(one.white, np.append(np.full(6, 0.04), 0.0)) for one in start.levels)
    return Point((TILT,), drives, levels)


def dense_of(stretches, point, which, columns, prior=None):
    effects = [cause.effect(stretches[which].model.array, which) for cause in point.causes]
    levels = point.levels[which]
    modes = len(stretches[which].basis.corrections(levels))
    return dense_gaussian(stretches[which], point.drives[which], effects, levels, columns, modes=modes, prior=prior)


def test_stretches_add_up(stretches, point):
    both = linearise(stretches, point, of_causes(point))
    each = [
        linearise([one], Point(point.causes, (drive,), (levels,)), of_causes(point))
        for one, drive, levels in zip(stretches, point.drives, point.levels, strict=True)
    ]
    assert_allclose(both.gram, sum(one.gram for one in each))
    assert_allclose(both.score, sum(one.score for one in each))
    for key in ("energy", "objective", "log_volume", "log_noise"):
        assert getattr(both, key) == pytest.approx(sum(getattr(one, key) for one in each))
    assert len(both.drive_steps) == 2
    assert_allclose(both.drive_steps[1], each[1].drive_steps[0])
    assert energy_of(stretches, point) == pytest.approx(both.energy)


def test_without_columns_there_are_no_unknowns(stretches, point):
    linear = linearise(stretches, point)
    assert linear.gram.shape == (0, 0)
    assert linear.responses[0].shape == (point.drives[0].spline.size, 0)
    assert linear.objective < linear.energy


def test_a_residue_that_is_integrated_out_equals_the_dense_gaussian(stretches, point):
    # The residue is common to all stretches: one Gaussian of both, whose drives are independent.
    scale = 3.0
    admitted = with_residue(stretches, point, scale)
    linear = linearise(stretches, admitted, of_causes(admitted))
    residues = [dense(one) for one in admitted.residue.columns]
    columns = [
        dense(of_causes(point)(one, at))
        for one, at in zip(stretches, linearise(stretches, point).posteriors, strict=True)
    ]
    count = residues[0].shape[2]
    whole = [dense_of(stretches, point, k, np.concatenate([residues[k], columns[k]], axis=2)) for k in range(2)]
    gram, score = sum(one.gram for one in whole), sum(one.score for one in whole)
    inner = np.eye(count) + gram[:count, :count]
    gain = np.linalg.solve(inner, gram[:count, count:])
    best = np.linalg.solve(inner, score[:count])
    expected = gram[count:, count:] - gram[count:, :count] @ gain
    assert_allclose(linear.gram, expected, rtol=1e-3, atol=1e-4 * expected.max())
    assert_allclose(
        linear.score, score[count:] - gram[count:, :count] @ best, rtol=1e-3, atol=1e-3 * np.sqrt(expected.max())
    )
    assert_allclose(linear.residue, best, atol=2e-3)
    objective = sum(one.objective for one in whole) - float(score[:count] @ best)
    assert linear.objective == pytest.approx(objective, rel=1e-4)
    bare = linearise(stretches, point)
    paid = bare.log_volume - linear.log_volume
    assert paid == pytest.approx(0.5 * np.linalg.slogdet(inner)[1], rel=1e-3)


def test_a_residue_of_one_stretch_is_one_covariance_more(stretches, point):
    # Integrated out in the covariance of the observations instead of afterwards.
    one, alone = stretches[:1], Point(point.causes, point.drives[:1], point.levels[:1])
    admitted = with_residue(one, alone, 2.0)
    linear = linearise(one, admitted, of_causes(admitted))
    columns = dense(of_causes(alone)(one[0], linear.posteriors[0]))
    truth = dense_of(one, alone, 0, columns, prior=dense(admitted.residue.columns[0]))
    assert_allclose(linear.gram, truth.gram, rtol=1e-3, atol=1e-4 * truth.gram.max())
    assert_allclose(linear.score, truth.score, atol=1e-3 * np.sqrt(truth.gram.max()))
    assert linear.objective == pytest.approx(truth.objective, rel=1e-4)
    bare = dense_of(one, alone, 0, columns)
    volume = linear.log_volume - linearise(one, alone).log_volume
    assert volume == pytest.approx(truth.log_volume - bare.log_volume, abs=1e-2)


def test_the_drives_follow_the_unknowns_and_the_residue(stretches, point):
    # At the step that the normal equations promise, nothing is gained by another.
    admitted = with_residue(stretches, point, 3.0)
    linear = linearise(stretches, admitted, of_causes(admitted))
    step = np.linalg.solve(linear.gram, linear.score)
    drives = tuple(
        drive.moved(own + response @ step)
        for drive, own, response in zip(point.drives, linear.drive_steps, linear.responses, strict=True)
    )
    there = replace(admitted, causes=(TILT.moved(step, stretches[0].model.array),), drives=drives)
    promised = linear.objective - float(linear.score @ step)
    assert energy_of(stretches, there) == pytest.approx(promised, rel=1e-3)
    assert energy_of(stretches, there) < energy_of(stretches, admitted)


def test_a_residue_holds_what_a_good_calibration_leaves(stretches, point):
    admitted = with_residue(stretches, point, 2.0)
    array = stretches[0].model.array
    names = [name for name, family in stretches[0].model.families().items() if family.tolerance > 0.0]
    assert {"bias", "scale_factor", "misalignment", "sensor_position"} == set(names)
    assert Residue.is_possible(stretches[0])
    sizes = np.random.default_rng(1).standard_normal(admitted.residue.columns[0].count)
    effects = admitted.residue.effects(stretches[0], sizes)
    assert [one.name for one in effects] == names
    place = 0
    for effect in effects:
        values = effect.size_values(array)
        expected = 2.0 * EFFECTS[effect.name].tolerance * sizes[place : place + len(values)]
        assert_allclose(values, expected)
        place += len(values)
    # As effects they change the prediction as the columns say.
    drive, tilt = point.drives[0], TILT.effect(array, 0)
    change = stretches[0].predict([tilt, *effects], drive.spin) - stretches[0].predict([tilt], drive.spin)
    linear = admitted.residue.columns[0].times(sizes)
    assert np.linalg.norm(change - linear) < 2e-2 * np.linalg.norm(change)


def test_columns_of_another_kind(stretches, point):
    # Put beside the causes' own and with these eliminated, as criticism does.
    plain = linearise(stretches, point, of_causes(point))
    assert plain.gram.shape == (2, 2)
    jacobians = [one.jacobian for one in plain.posteriors]
    again = linearise(stretches, point, of_causes(point), jacobians=jacobians)
    assert_allclose(again.gram, plain.gram)
    assert again.posteriors[0].jacobian is jacobians[0]


def test_noise_of_different_points_can_be_compared(stretches, point):
    # −½ log det of the covariance of channels and reference.
    louder = replace(point, levels=tuple(NoiseLevels(2.0 * one.white, 2.0 * one.flicker) for one in point.levels))
    change = linearise(stretches, louder).log_noise - linearise(stretches, point).log_noise
    assert change == pytest.approx(-np.log(2.0) * sum(one.observations for one in stretches), rel=1e-9)
