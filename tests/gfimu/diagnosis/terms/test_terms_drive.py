"""The drive of a table as a nuisance parameter: its prior against a dense matrix, and its roughness."""

from __future__ import annotations

from dataclasses import astuple, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import BSpline

from gfimu.diagnosis import Drive, State
from gfimu.diagnosis.terms.drive import FIRST_ROUGHNESS, LEAST_ROUGHNESS, MARGIN
from gfimu.diagnosis.terms.spline import DEGREE, AngleSpline


def made_drive(*, angle_std=1e-2, spacing=0.1, seed=1):
    """A drive whose roughness differs from interval to interval."""
    rng = np.random.default_rng(seed)
    drive = Drive.still(np.linspace(0.0, 3.0, 61), 0.0, spacing, 0.4, angle_std)
    roughness = np.exp(rng.normal(np.log(300.0), 0.7, drive.spline.intervals))
    walk = np.cumsum(np.cumsum(rng.standard_normal(drive.spline.size)))
    return replace(drive, coefficients=0.01 * walk, roughness=roughness)


def extended_knots(spline):
    """The knots with those beyond the ends."""
    beyond = np.arange(1, DEGREE + 1)
    before, after = spline.start - spline.widths[0] * beyond[::-1], spline.stop + spline.widths[-1] * beyond
    return np.concatenate([before, spline.knots, after])


def dense_precision(drive):
    """The prior's precision by SciPy's fourth derivative and values."""
    spline = drive.spline
    knots, unit = extended_knots(spline), np.eye(spline.size)
    bend = BSpline(knots, unit, DEGREE).derivative(DEGREE)(spline.centres)  # (k, m)
    row = BSpline(knots, unit, DEGREE)(drive.since)
    precision = bend.T @ np.diag(drive.roughness**-2.0) @ bend
    if np.isfinite(drive.angle_std):
        precision += np.outer(row, row) / drive.angle_std**2
    return precision, bend, row


@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("angle_std", [1e-2, np.inf])
def test_prior_equals_a_dense_matrix(angle_std, cut):
    drive = made_drive(angle_std=angle_std)
    if cut:
        drive = drive.cut(np.arange(drive.spline.intervals) % 3 == 0)
    precision, bend, row = dense_precision(drive)
    x = drive.coefficients
    expected = float(np.sum((bend @ x / drive.roughness) ** 2))
    if np.isfinite(angle_std):
        expected += float((row @ x - drive.angle) / angle_std) ** 2
    assert drive.energy() == pytest.approx(expected, rel=1e-9)
    added = drive.add_precision(np.eye(len(x)))
    assert_allclose(added, precision + np.eye(len(x)), rtol=1e-8, atol=1e-9 * precision.max())
    gradient = -(precision @ x)
    if np.isfinite(angle_std):
        gradient += row * drive.angle / angle_std**2
    assert_allclose(drive.pull(), gradient, atol=1e-9 * np.abs(gradient).max())


@pytest.mark.parametrize("cuts", [0, 2])
def test_log_precision_is_that_of_the_bends_and_of_the_start(cuts):
    # A density in what the knots do not change: angle, rate, acceleration and jerk at the start, and the bends.
    drive = made_drive(angle_std=np.inf)
    for _ in range(cuts):
        drive = drive.cut(np.random.default_rng(3).random(drive.spline.intervals) < 0.3)
    spline = drive.spline
    function = BSpline(extended_knots(spline), np.eye(spline.size), DEGREE)
    start = [function(spline.start), *(function.derivative(order)(spline.start) for order in range(1, DEGREE))]
    units = np.vstack([start, function.derivative(DEGREE)(spline.centres)])
    expected = np.linalg.slogdet(units)[1] - np.log(drive.roughness).sum()
    assert drive.log_precision == pytest.approx(expected, abs=1e-6)


def test_at_rest_at_first():
    drive = Drive.still(np.linspace(1.0, 4.0, 31), 1.0, 0.1, 0.4, 1e-3)
    assert drive.spline.start <= 1.0 - MARGIN
    assert drive.spline.stop >= 4.0 + MARGIN
    state = drive.spin.at(np.linspace(1.0, 4.0, 7))
    assert_allclose(state.angle, 0.4)
    assert_allclose(state.rate, 0.0, atol=1e-12)
    assert drive.energy() == pytest.approx(0.0, abs=1e-15)
    assert (drive.roughness == FIRST_ROUGHNESS).all()
    # Where the angle is not known it starts from zero, and the margin holds the support of the outermost function.
    unknown = Drive.still(np.linspace(1.0, 4.0, 31), 1.0, 0.2, 0.4, np.inf)
    assert_allclose(unknown.coefficients, 0.0)
    assert unknown.spline.start <= 1.0 - DEGREE * 0.2


def test_a_step_is_added():
    drive = made_drive()
    step = np.random.default_rng(2).standard_normal(drive.spline.size)
    assert_allclose(drive.moved(step).coefficients, drive.coefficients + step)
    assert drive.moved(step).roughness is drive.roughness


def test_covering_reaches_farther_and_keeps_the_motion():
    drive = made_drive()
    inside = np.linspace(drive.spline.start, drive.spline.stop, 50)
    assert drive.covering(inside) is drive
    wider = drive.covering(np.array([drive.spline.start - 0.35, drive.spline.stop + 0.72]))
    assert wider.spline.start <= drive.spline.start - 0.35
    assert wider.spline.stop >= drive.spline.stop + 0.72
    assert_allclose(wider.spin.at(inside).angle, drive.spin.at(inside).angle, atol=1e-12)
    assert len(wider.roughness) == wider.spline.intervals
    assert wider.roughness[0] == drive.roughness[0]
    assert wider.roughness[-1] == drive.roughness[-1]
    # New coefficients go on in a straight line: no bend where all intervals are new.
    bend = wider.spline.bend(wider.coefficients)
    assert_allclose(bend[-1], 0.0, atol=1e-6 * np.abs(bend).max())
    early = drive.covering(np.array([drive.spline.start - 0.35]))
    assert early.spline.stop == pytest.approx(drive.spline.stop)


def test_closer_knots_keep_the_motion_and_its_spectrum():
    drive = made_drive(spacing=0.2)
    where = np.arange(drive.spline.intervals) % 3 == 0
    closer = drive.cut(where)
    t = np.linspace(drive.spline.start, drive.spline.stop, 400)
    for one, other in zip(astuple(closer.spin.at(t)), astuple(drive.spin.at(t)), strict=True):
        assert_allclose(one, other, atol=1e-8 * np.abs(other).max())
    inner = where[DEGREE:-DEGREE]
    assert closer.spline.intervals == drive.spline.intervals + inner.sum()
    assert_allclose(closer.spline.widths[[0, -1]], 0.2)  # the outermost stay: the drive can be continued
    power = closer.roughness**2 * closer.spline.widths
    at = drive.spline.interval(closer.spline.centres)[0]
    assert_allclose(power, (drive.roughness**2 * drive.spline.widths)[at])


def test_a_part_of_a_drive_with_uneven_knots():
    drive = made_drive()
    for _ in range(2):
        middle = np.abs(drive.spline.centres - 1.0) < 0.15
        drive = drive.cut(middle)
    t = np.linspace(1.0, 2.1, 40)
    part = drive.within(1.0, 2.1, 1.0, 5e-3)
    assert_allclose(part.spin.at(t).acceleration, drive.spin.at(t).acceleration, atol=1e-9)
    assert part.spline.halvings
    assert part.spline.intervals < drive.spline.intervals
    longer = part.covering(np.array([-3.0, 5.0]))
    assert_allclose(longer.spin.at(t).acceleration, drive.spin.at(t).acceleration, atol=1e-9)


def test_corners_are_missed_and_a_swift_sine_is_not():
    spline = AngleSpline(0.0, 0.05, 200)

    class Motion:
        def __init__(self, jerk):
            self.jerk = jerk

        def at(self, t):
            since = np.maximum(t - 5.02, 0.0)
            return State(np.sin(7.0 * t) + self.jerk * since**3 / 6.0, t, t)

    sine, corner = (
        replace(Drive.still(np.array([0.4, 9.6]), 0.4, 0.05, 0.0, np.inf), spline=spline, coefficients=c)
        for c in (spline.through(Motion(0.0)), spline.through(Motion(500.0)))
    )
    inner = (spline.centres > 1.0) & (spline.centres < 9.0)
    assert sine.missed[inner].max() < 0.3
    found = spline.centres[inner & (corner.missed > 0.3)]
    assert 0 < len(found) < 20
    assert np.abs(found - 5.02).max() < 0.5


def test_a_part_has_the_motion_and_the_prior_of_the_whole():
    drive = made_drive()
    part = drive.within(0.93, 2.11, 1.0, 5e-3)
    t = np.linspace(0.93, 2.11, 40)
    assert part.spline.start <= 0.93
    assert part.spline.stop >= 2.11
    assert part.spline.intervals < drive.spline.intervals
    assert_allclose(part.spin.at(t).angle, drive.spin.at(t).angle, atol=1e-12)
    first = round((part.spline.start - drive.spline.start) / 0.1)
    assert_allclose(part.roughness, drive.roughness[first : first + part.spline.intervals])
    assert part.angle == pytest.approx(float(drive.spin.at(np.array([1.0])).angle[0]))
    assert (part.angle_std, part.since) == (5e-3, 1.0)
    assert made_drive(angle_std=np.inf).within(0.93, 2.11, 1.0, 5e-3).angle_std == np.inf
    # Ends that lie on knots add no interval, and the whole is the most there is.
    exact = drive.within(drive.spline.start + 0.3, drive.spline.start + 1.2, 1.0, 5e-3)
    assert exact.spline.intervals == 9
    assert drive.within(-10.0, 10.0, 0.0, 1.0).spline.intervals == drive.spline.intervals


def test_following_takes_the_motion_of_another_and_keeps_the_prior():
    drive, other = made_drive(seed=1), made_drive(seed=2)
    same = drive.following(other)
    assert same.coefficients is other.coefficients
    assert same.roughness is drive.roughness
    coarse = made_drive(seed=3, spacing=0.2)
    found = drive.following(coarse)
    t = np.linspace(0.0, 3.0, 100)
    assert found.spline == drive.spline
    assert_allclose(found.spin.at(t).angle, coarse.spin.at(t).angle, atol=1e-6)


@pytest.mark.parametrize("rough", [300.0, 3000.0])
def test_the_fixed_point_finds_the_roughness_of_simulated_drives(rough):
    # Angles read with noise; MacKay's fixed point from a first guess that is wrong by a factor of three and more.
    rng = np.random.default_rng(5)
    spline = AngleSpline(0.0, 0.05, 400)
    bend = rough * rng.standard_normal(spline.intervals)
    padded = np.concatenate([np.zeros(DEGREE), bend * spline.spacing**DEGREE])
    truth = padded
    for _ in range(DEGREE):
        truth = np.cumsum(truth)
    t = np.linspace(0.0, spline.stop, 1600)
    design = np.array([spline.angle_row(one) for one in t])
    noise = 1e-5
    angle = design @ truth + noise * rng.standard_normal(len(t))
    drive = Drive(spline, np.zeros(spline.size), np.full(spline.intervals, 1e3), 0.0, np.inf, 0.0)
    for _ in range(15):
        information = drive.add_precision(design.T @ design / noise**2)
        covariance = np.linalg.inv(information)
        drive = replace(drive, coefficients=covariance @ (design.T @ angle / noise**2)).relearned(covariance)
    # 400 bends, of which the data determine nearly all: their rms is known to some 4 %.
    assert np.sqrt(np.mean(drive.roughness**2)) == pytest.approx(rough, rel=0.1)


def test_the_roughness_follows_where_the_drive_is_rough():
    spline = AngleSpline(0.0, 0.05, 200)
    rng = np.random.default_rng(6)
    scale = np.where(np.arange(200) < 100, 50.0, 5000.0)
    coefficients = np.concatenate([np.zeros(DEGREE), scale * rng.standard_normal(200) * spline.spacing**DEGREE])
    for _ in range(DEGREE):
        coefficients = np.cumsum(coefficients)
    drive = Drive(spline, coefficients, np.full(200, 1e3), 0.0, np.inf, 0.0)
    learnt = drive.relearned(np.zeros((spline.size, spline.size)))
    assert np.sqrt(np.mean(learnt.roughness[:90] ** 2)) == pytest.approx(60.0, rel=0.3)  # 50 and the least of 30
    assert np.sqrt(np.mean(learnt.roughness[110:] ** 2)) == pytest.approx(5000.0, rel=0.2)


def test_a_drive_without_bends_of_which_nothing_is_known_has_the_least_roughness():
    drive = Drive(AngleSpline(0.0, 0.05, 60), np.zeros(64), np.full(60, 1e3), 0.0, np.inf, 0.0)
    wide = np.linalg.pinv(drive.add_precision(np.zeros((64, 64))))
    assert_allclose(drive.relearned(wide).roughness, LEAST_ROUGHNESS)
