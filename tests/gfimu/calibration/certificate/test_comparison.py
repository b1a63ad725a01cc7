"""E_n between two certificates: its form, its statistics, and what is not compared."""

from dataclasses import replace

import numpy as np
import pytest
from certification_cases import calibration_of, random_covariance, random_model, random_rotation
from scipy.stats import norm

from gfimu import InputError, UnitError
from gfimu.calibration import METHODS, Observations, certify, compare


def rows_of(first, second):
    return {row.name: row for row in compare(first, second, other="theirs").rows}


def test_e_n_is_the_difference_over_both_expanded_uncertainties(rng):
    model = random_model(rng)
    ours = certify(calibration_of(model, random_covariance(rng)))
    theirs = certify(calibration_of(random_model(rng), random_covariance(rng), "x_axis"))
    rows = rows_of(ours, theirs)
    assert len(rows) == 9
    for name, row in rows.items():
        mine, other = ours.term(name), theirs.term(name)
        expected = (mine.value - other.value) / np.sqrt(mine.expanded**2 + other.expanded**2)
        assert row.e_n == pytest.approx(expected)
        assert row.satisfactory == (abs(expected) <= 1.0)


def test_terms_are_compared_where_the_sensing_axes_define_the_frame(rng):
    model, covariance = random_model(rng), random_covariance(rng)
    triangular = certify(calibration_of(model, covariance, "x_axis"))
    again = certify(calibration_of(model, covariance, "x_axis", rotation=random_rotation(rng)))
    rows = rows_of(triangular, again)
    assert {"a11_K0", "a11_K1", "a11_K2", "a13_delta_o", "a12_delta_p", "a11_sensitivity"} <= set(rows)
    assert "a11_delta_o" not in rows  # zero by definition
    assert max(abs(row.e_n) for row in rows.values()) < 1e-5
    full = certify(calibration_of(model, covariance))
    assert compare(full, full, other="theirs").left_out == (
        "terms of the model of a1: the reference axes (poses, poses) depend on the mounting",
    )


def test_under_equal_truth_one_in_twenty_is_not_satisfactory(rng):
    """x₁ − x₂ is normal with σ₁² + σ₂² and U = k σ, k the 97.5 % quantile: P(|E_n| > 1) = P(|z| > k) = 5 % exactly.

    400 pairs with other covariances on the two sides; the binomial deviation of a count is 1.1 %, of the mean of nine
    (correlated) quantities at most that.
    """
    truth = random_model(rng)
    sides = [calibration_of(truth, scale * random_covariance(rng), "x_axis") for scale in (1.0, 4.0)]
    counts, pairs = np.zeros(9), 400
    draws = [rng.multivariate_normal(one.values, one.covariance, pairs) for one in sides]
    for values in zip(*draws, strict=True):
        drawn = [certify(replace(one, values=own)).chips[0].intrinsic for one, own in zip(sides, values, strict=True)]
        e_n = [
            (mine.value - other.value) / np.hypot(mine.expanded, other.expanded)
            for mine, other in zip(*drawn, strict=True)
        ]
        counts += np.abs(e_n) > 1.0
    expected = 2.0 * norm.sf(norm.ppf(0.975))
    one = np.sqrt(expected * (1.0 - expected) / pairs)
    assert np.abs(counts / pairs - expected).max() < 4.0 * one
    assert abs(counts.mean() / pairs - expected) < 3.0 * one


def test_two_laboratories_with_other_poses_agree(rng):
    """Adjustments of 24 and 40 poses of one triad, 100 pairs: |E_n| > 1 in 5 %, within 4 binomial deviations."""
    truth = replace(random_model(rng), quadratic=np.zeros(3))
    bad, pairs = np.zeros(9), 100
    for _ in range(pairs):
        poses = [noisy_poses(truth, count, rng) for count in (24, 40)]
        found = [certify(METHODS["multi-position"].fit(observed, gravity=9.81)) for observed in poses]
        rows = rows_of(*found)
        names = [term.name for term in found[0].chips[0].intrinsic]
        bad += [not rows[name].satisfactory for name in names]
    assert abs(bad.mean() / pairs - 0.05) < 4.0 * np.sqrt(0.05 * 0.95 / pairs)


def noisy_poses(model, count, rng):
    directions = rng.standard_normal((count, 3)) @ random_rotation(rng)
    a = 9.81 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return Observations.from_means(model.read(a) + 1e-3 * rng.standard_normal((count, 3)), 1e-6 * np.eye(3))


def test_a_bias_that_moved_shows_in_the_offsets_alone(rng):
    model, covariance = random_model(rng), random_covariance(rng)
    moved = replace(model, bias=model.bias + 0.1)
    rows = rows_of(certify(calibration_of(model, covariance)), certify(calibration_of(moved, covariance)))
    assert {name for name, row in rows.items() if not row.satisfactory} == {"a11_offset", "a12_offset", "a13_offset"}


def test_what_is_of_another_unit_chip_or_instrument_is_refused(rng):
    calibration = calibration_of(random_model(rng), random_covariance(rng))
    ours = certify(calibration, item="no. 1")
    counts = certify(replace(calibration, unit="lsb"))
    other = certify(
        replace(
            calibration,
            channels=("b11", "b12", "b13"),
            names=tuple(name.replace("a1_", "b1_") for name in calibration.names),
        )
    )
    with pytest.raises(UnitError, match="theirs: is in lsb, not in m_s2"):
        compare(ours, counts, other="theirs")
    with pytest.raises(InputError, match="theirs: is of b1, not of a1"):
        compare(ours, other, other="theirs")
    with pytest.raises(InputError, match=r"is of 'no. 2', not of 'no. 1'"):
        compare(ours, certify(calibration, item="no. 2"), other="theirs")
