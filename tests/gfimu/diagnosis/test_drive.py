"""The drive's spline and the factored derivative, against scipy's splines and dense algebra."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import BSpline

from gfimu.diagnosis.data.run import prepare_run
from gfimu.diagnosis.diagnose import diagnose
from gfimu.diagnosis.drive import AngleSpline
from gfimu.diagnosis.drive_jacobian import DriveJacobian, lagged
from gfimu.diagnosis.refinement import refine
from gfimu.diagnosis.stretches import make_segments
from gfimu.geometry.array import AccelerometerArray
from sim.campaign import Measurement, measure
from sim.effects import make_effect
from sim.motion import SpinState
from sim.twin import Twin


@pytest.fixture(params=["uniform", "finer in places"])
def spline(request):
    plain = AngleSpline.uniform(-0.3, 4.1, 0.05)
    if request.param == "uniform":
        return plain
    middle = plain.interval_centres()
    finer = plain.halved((middle > 1.0) & (middle < 1.6))
    return finer.halved(np.abs(finer.interval_centres() - 1.3) < 0.1)


def test_states_are_those_of_the_same_spline_in_scipy(spline):
    rng = np.random.default_rng(1)
    coefficients = rng.standard_normal(spline.size)
    t = np.sort(rng.uniform(-0.3, 4.1, 300))
    angle = BSpline(spline.knots, coefficients, 4)
    state = spline.spin(coefficients).at(t)
    assert_allclose(state.angle, angle(t), rtol=0, atol=1e-12)
    assert_allclose(state.rate, angle.derivative()(t), rtol=0, atol=1e-10)
    assert_allclose(state.acceleration, angle.derivative(2)(t), rtol=0, atol=1e-8)
    for matrix, order in zip(spline.matrices(t), range(3), strict=True):
        assert_allclose(matrix @ coefficients, angle.derivative(order)(t) if order else angle(t), atol=1e-8)


def test_the_motion_goes_on_at_constant_rate_beyond_the_ends(spline):
    state = spline.spin(np.linspace(0.0, 3.0, spline.size) ** 2).at(np.array([4.1, 4.6]))
    assert state.rate[1] == pytest.approx(state.rate[0])
    assert state.angle[1] == pytest.approx(state.angle[0] + 0.5 * state.rate[0])


def test_roughness_is_the_fourth_derivative_of_the_angle(spline):
    coefficients = np.random.default_rng(2).standard_normal(spline.size)
    fourth = BSpline(spline.knots, coefficients, 4).derivative(4)
    assert_allclose(spline.roughness_rows() @ coefficients, fourth(spline.interval_centres()), rtol=1e-6)


def first_order_lag(n, samples):
    """Matrix (n, n) of y' = (x − y)/τ solved from zero, x joined by straight lines, by quadrature."""
    s = (np.arange(2000) + 0.5) / 2000  # within a sample period
    kernel = np.exp(-(1.0 - s) / samples) / samples / 2000
    old, new = float(kernel @ (1.0 - s)), float(kernel @ s)
    matrix = np.zeros((n, n))
    for row in range(n):
        if row:
            matrix[row] = np.exp(-1.0 / samples) * matrix[row - 1]
            matrix[row, row - 1] += old
        matrix[row, row] += new
    return matrix


@pytest.mark.parametrize("late", [False, True])
def test_factored_derivative_is_the_plain_one(spline, late):
    rng = np.random.default_rng(3)
    n, channels = 200, 7
    t = np.linspace(0.0, 4.0, n)
    times = np.column_stack([t, t + 1e-3, t])  # two chips and the reference
    chips = np.array([0, 0, 0, 1, 1, 1, 2])
    rate = np.sin(t)
    slopes = np.zeros((3, n, channels))
    slopes[2] = rng.standard_normal(channels)
    slopes[1] = np.outer(rate, rng.standard_normal(channels))
    slopes[:, :, -1] = np.array([0.0, 1.0, 0.0])[:, None]
    weights = rng.uniform(0.5, 2.0, channels)
    lag = first_order_lag(n, 2.0)
    delay = partial(lagged, samples=2.0) if late else None
    jacobian = DriveJacobian.build(spline, slopes, times, chips, weights, delay)
    assert len(jacobian.parts) == 5  # two functions per chip, one of the reference
    plain = []
    for channel, chip in enumerate(chips):
        matrix = sum(
            slope[:, [channel]] * part.toarray()
            for slope, part in zip(slopes, spline.matrices(times[:, chip]), strict=True)
        )
        plain.append(lag @ matrix if late and channel < 6 else matrix)
    for channel, matrix in enumerate(plain):
        plain[channel] = jacobian.channel(channel).toarray()
        # What a lag keeps is forgotten after twelve time constants.
        lost = 2.0 * np.exp(-12.0) * np.abs(matrix).max() if late and channel < 6 else 1e-6
        assert_allclose(plain[channel], matrix, atol=lost)
    stacked = np.array(plain)  # (c, n, m)
    assert_allclose(jacobian.information().toarray(), np.einsum("c,cni,cnj->ij", weights, stacked, stacked), atol=1e-5)
    step, values = rng.standard_normal(spline.size), rng.standard_normal((n, channels))
    assert_allclose(jacobian.forward(step), np.einsum("cnm,m->nc", stacked, step), atol=1e-6)
    assert_allclose(jacobian.backward(values), np.einsum("cnm,nc->m", stacked, values), atol=1e-6)
    columns = rng.standard_normal((channels, 4, n))
    assert_allclose(
        jacobian.correlate(columns, weights),
        np.einsum("c,cnm,cpn->mp", weights, stacked, columns),
        atol=1e-5,
    )
    cosines, share = rng.standard_normal((n, 3)), rng.uniform(0.0, 1.0, (3, channels))
    rows = jacobian.slow_rows(jacobian.slow(cosines), share, weights)
    slow = np.einsum("cnm,nk->ckm", stacked, cosines)
    assert_allclose(rows.T @ rows, np.einsum("c,kc,cki,ckj->ij", weights, share, slow, slow), atol=1e-5)
    each = rows.reshape(-1, 3, spline.size).transpose(1, 0, 2)  # (K, R, m)
    power = np.linalg.norm(each, axis=2)
    angles = each @ each.transpose(0, 2, 1) / np.maximum(power[:, :, None] * power[:, None, :], 1e-12)
    assert_allclose(angles - np.eye(angles.shape[1]) * angles, 0.0, atol=1e-4)
    share[:, -1] = 0.0  # no slow noise in the reference: its rows are not there
    fewer = jacobian.slow_rows(jacobian.slow(cosines), share, weights)
    assert len(fewer) < len(rows)
    assert_allclose(fewer.T @ fewer, np.einsum("c,kc,cki,ckj->ij", weights, share, slow, slow), atol=1e-5)


class OtherSimulation:
    """A twin that knows nothing of plays."""

    def __init__(self, twin):
        self._twin = twin

    def __getattr__(self, name):
        if name == "play":
            raise AttributeError(name)
        return getattr(self._twin, name)


def test_a_play_holds_what_the_drive_did_before():
    """The derivative against a small change of each coefficient, between the instants at which the play turns."""
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    rng = np.random.default_rng(11)
    play = make_effect("hysteresis", {"lost_m_s2": 0.3, "width_m_s2": 0.2})
    recording = measure(rng, twin, [play], Measurement(duration=20.0))
    (segment,) = make_segments(twin, [prepare_run(recording, twin)])
    segment.prepare_weights()
    jacobian = segment.linearise([play]).jacobian
    drive = segment.coefficients
    base = segment.predict([play])
    for _ in range(3):
        step = 1e-8 * rng.standard_normal(len(drive))
        segment.coefficients = drive + step
        change = segment.predict([play]) - base
        segment.coefficients = drive
        told = jacobian.forward(step)
        turning = np.abs(told - change) > 1e-3 * np.abs(change).max()
        assert turning.mean() < 0.01
        assert_allclose(told[~turning], change[~turning], atol=1e-3 * np.abs(change).max())
    assert twin.play([play]).share == pytest.approx(1.5)
    assert twin.play() is None
    assert twin.extended([play]).play().lost == pytest.approx(0.3)
    assert segment.felt_play([play]) is not None
    # Another simulation need not say so.
    segment.model = OtherSimulation(twin)
    assert segment.felt_play([play]) is None
    assert len(segment.linearise([play]).jacobian.parts) < len(jacobian.parts)


def tuned(rate):
    """A segment of a quiet run whose drive's roughness was learnt, at a sample rate, Hz."""
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12", sample_rate=rate)
    recording = measure(np.random.default_rng(8), twin, [], Measurement(duration=20.0, sample_rate=rate))
    (segment,) = make_segments(twin, [prepare_run(recording, twin)])
    segment.prepare_weights()
    for _ in range(3):
        segment.move_drive(segment.linearise([]))
    segment.learn_roughness()
    segment.tune_roughness([])
    return segment


def test_the_roughness_is_the_most_probable_one():
    segment = tuned(100.0)
    best = segment.roughness.factor

    def likelihood(factor):
        segment.roughness.factor = factor
        segment._set_prior()
        line = segment.linearise([])
        return segment.log_volume(line.drive) - 0.5 * line.drive.objective

    top = likelihood(best)
    assert top >= likelihood(0.5 * best)
    assert top >= likelihood(2.0 * best)
    assert best < 0.5  # six times as rough as the smoothed reference leaves the drive free to follow noise


@pytest.mark.parametrize("rate", [10.0, 25.0, 100.0])
def test_the_drive_is_followed_at_every_sample_rate(rate):
    segment = tuned(rate)
    for _ in range(3):
        segment.move_drive(segment.linearise([]))
    scaled = segment.residual([])[:, :-1] / segment.levels.white[:-1]
    # Knots as far apart as slow samples could not hold a motion that its corners need: 6 and more.
    assert 0.85 < np.sqrt(np.mean(scaled**2)) < 1.15


def test_an_average_over_time_weighs_intervals_by_their_width():
    spline = AngleSpline.uniform(0.0, 1.0, 0.1).halved(np.arange(10) == 4)
    values = spline.interval_centres()  # a straight line is its own average away from the ends
    assert_allclose(spline.moving_average(values, 0.2)[2:8], values[2:8], atol=0.013)
    assert_allclose(spline.moving_average(np.ones(11), 0.3), 1.0)


def test_a_part_has_the_breaks_of_the_whole():
    whole = AngleSpline.uniform(0.0, 2.0, 0.1).halved(np.arange(20) == 7)
    part = whole.within(0.3, 1.25)
    assert_allclose(part.breaks, [0.3, 0.4, 0.5, 0.6, 0.7, 0.75, 0.8, 0.9, 1.0, 1.1, 1.2, 1.25])
    assert whole.within(0.3005, 1.2).breaks[1] == pytest.approx(0.4)  # no sliver at the end


class Corners:
    """Ramps between steady rates whose corners last a few hundredths of a second; 0.1 ms grid."""

    def __init__(self, seed, corner):
        rng = np.random.default_rng(seed)
        step = 1e-4
        self.grid = np.arange(-1.5, 21.5, step)
        times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.4, 2.5, 16))])
        rates = np.concatenate([[0.0], np.repeat(rng.uniform(-14.0, 14.0, 8), 2)])
        kernel = np.hanning(round(corner / step))
        rate = np.interp(self.grid, times, rates)
        rate = np.convolve(np.pad(rate, len(kernel), mode="edge"), kernel / kernel.sum(), "same")
        rate = rate[len(kernel) : -len(kernel)]
        self.states = cumulative_trapezoid(rate, dx=step, initial=0.0), rate, np.gradient(rate, step)

    def at(self, t):
        return SpinState(*(np.interp(np.asarray(t, dtype=float), self.grid, state) for state in self.states))


@pytest.mark.parametrize("corner", [0.08, 0.03])
def test_sharp_corners_of_the_motion_are_no_effect(corner):
    # Knots 0.05 s apart everywhere cut the corners, and a mode of the table was named for what they missed.
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    motion = Corners(1, corner)
    recording = measure(np.random.default_rng(1), twin, [], Measurement(duration=20.0), motion=motion)
    assert diagnose([recording], twin).verdict == "nothing_found"


def test_a_gross_effect_is_named_alone_where_the_corners_are_sharp():
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    gross = make_effect("scale_factor", {"a11": 0.2, "a12": 0.2, "a13": 0.2}, twin.array)
    recording = measure(np.random.default_rng(2), twin, [gross], Measurement(duration=12.0), motion=Corners(1, 0.03))
    found = diagnose([recording], twin)
    assert (found.verdict, [cause.effect for cause in found.causes]) == ("explained", ["scale_factor"])


def test_knots_are_finer_only_where_the_drive_bends():
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    motion = Corners(1, 0.05)
    recording = measure(np.random.default_rng(1), twin, [], Measurement(duration=20.0), motion=motion)
    (segment,) = make_segments(twin, [prepare_run(recording, twin)])
    segment.prepare_weights()
    plain = segment.spline.size
    segment.coefficients = refine([segment], (), [()], iterations=8).drives[0]
    segment.learn_roughness()
    before = segment.spin.at(segment.run.t)
    assert segment.sharpen()
    assert plain < segment.spline.size < 1.7 * plain
    assert_allclose(segment.spin.at(segment.run.t).rate, before.rate, atol=2e-3)
    fine = segment.spline.interval_centres()[segment.spline.widths < 0.03]
    bend = np.abs(np.gradient(np.gradient(motion.states[2], 1e-4), 1e-4))
    sharp = motion.grid[bend > 0.2 * bend[(motion.grid > 0) & (motion.grid < 20)].max()]
    near = np.abs(fine[:, None] - sharp[None, ::20]).min(axis=1)
    assert np.quantile(near, 0.9) < 0.3


@pytest.mark.parametrize("skew", [0.0, 5e-4])
@pytest.mark.parametrize(("frequency", "damping"), [(7.0, 0.1), (4.0, 0.05), (20.0, 0.05)])
def test_a_drive_that_a_mode_remembers_is_differentiated_with_its_ringing(frequency, damping, skew):
    """Against central differences; the derivative by the state of the instant is off by a tenth and more."""
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    mode = make_effect("resonance", {"gain": 0.8, "frequency_hz": frequency, "damping_ratio": damping}, twin.array)
    effects = [mode, make_effect("channel_skew", {"per_chip_s": skew}, twin.array)]
    recording = measure(np.random.default_rng(4), twin, effects, Measurement(duration=6.0))
    (segment,) = make_segments(twin, [prepare_run(recording, twin)])
    segment.prepare_weights()
    most_known = 0.05 if skew else 0.015  # chips that are sampled in turn share one ringing
    for told, least, most in ((twin, 0.0, most_known), (Silent(**vars(twin)), 0.1, np.inf)):
        segment.model, segment.ringing = told, True
        jacobian = segment.linearise(effects).jacobian
        worst = 0.0
        for place in (12, 20, 47, 70):
            moved = np.zeros(segment.spline.size)
            moved[place] = 1e-5
            up, down = (
                segment.predict(effects, segment.spline.spin(segment.coefficients + sign * moved)) for sign in (1, -1)
            )
            true = (up - down) / 2e-5  # (n, c + 1)
            worst = max(worst, float(np.abs(jacobian.forward(moved) / 1e-5 - true).max() / np.abs(true).max()))
        assert least <= worst < most


class Silent(Twin):
    """A twin that does not tell what rings in it."""

    def modes(self, effects=()):
        return ()


def test_the_derivative_knows_how_a_strong_ripple_answers_the_drive():
    """Against a small change of each coefficient, also where the reference's gain is off and chips are late."""
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    effects = [
        make_effect("cogging", {"amplitude_rad_s2": 8.0, "order": 10.0, "phase_rad": 0.7}),
        make_effect("tacho_scale", {"ratio": 0.04}),
        make_effect("channel_skew", {"per_chip_s": 2e-3}),
    ]
    recording = measure(np.random.default_rng(6), twin, effects, Measurement(duration=8.0))
    (segment,) = make_segments(twin, [prepare_run(recording, twin)])
    segment.prepare_weights()
    base = segment.coefficients
    off = {}
    for segment.rippling in (False, True):
        jacobian = segment.linearise(effects).jacobian
        off[segment.rippling] = []
        for column in (40, 90, 140):
            step = np.zeros(segment.spline.size)
            step[column] = 1.0
            told = jacobian.forward(step)
            segment.coefficients = base + 1e-6 * step
            up = segment.predict(effects)
            segment.coefficients = base - 1e-6 * step
            change = (up - segment.predict(effects)) / 2e-6
            segment.coefficients = base
            off[segment.rippling].append(np.abs(told - change).max() / np.abs(change).max())
    assert max(off[True]) < 5e-4
    assert min(off[False]) > 4e-3
    assert max(off[False]) > 0.03
