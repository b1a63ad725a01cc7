"""Monte Carlo: the filter and the smoother sit on the posterior Cramér–Rao bound and know it.

Data-sheet noise, 3.9 mg steps and 35 mg of turn-on bias; a cube of 6 cm, which 10 rev/s leaves within ±16 g. The ratio
is taken while the body turns at more than half its top speed, because near zero a bound by the slope of ω² does not
hold, or while it rests all the time. The bound knows of rest what there was of it, whole blocks before the body moves,
whether a run recognised them or not. All scenarios with 60 runs, at 800 Hz
too: ``python -m tests.studies rate``.
"""

from __future__ import annotations

import numpy as np
import pytest
import rate_worlds
from rate_worlds import cube, first_rest, measure, rms, sensor_errors, study, tumble, turntable
from scipy.stats import chi2

from gfimu import posterior_rate_bound
from gfimu.rate import FilterSettings, filter_rate

SCENARIOS = [(turntable, speed) for speed in (0.1, 1, 10)] + [(tumble, speed) for speed in (0.1, 1, 8)]
NAMES = [f"{motion.__name__}-{speed}" for motion, speed in SCENARIOS]
RUNS = 60


def check(found):
    rows = found.turning()
    for method in ("filter", "smoother"):
        assert 0.95 < found.ratio(method, rows) < 1.10, method
        assert 0.95 < rms(found.std[method][:, rows]) / rms(found.bound[method][rows]) < 1.10, method


@pytest.fixture(scope="module", params=list(zip(SCENARIOS, NAMES, strict=True)), ids=NAMES)
def at_100_hz(request):
    (motion, speed), _ = request.param
    return study(cube(), motion(100.0, 2 * np.pi * speed), RUNS)


@pytest.mark.study(but=["turntable-10", "tumble-1"])
def test_ratio_to_the_bound(at_100_hz):
    check(at_100_hz)


def test_ratio_at_rest():
    """30 s of rest: about 15 of the 3600 blocks fail by chance and none of them may cost the rest."""
    check(study(cube(), turntable(100.0, 0.0), RUNS, seed=6043))


def check_consistency(found):
    """Mean NEES over the runs, sample by sample, is χ²/runs: 95 % of the samples lie within its 95 % interval.

    Samples within 1/|ω| of each other are not independent, so the share and the mean scatter; three standard
    deviations of that are allowed.
    """
    rows = found.turning()
    independent = found.independent(rows)
    low, high = chi2.ppf([0.025, 0.975], 3 * RUNS) / RUNS
    for method in ("filter", "smoother"):
        mean = found.nees[method][:, rows].mean(axis=0)
        share = np.mean((mean > low) & (mean < high))
        assert share > 0.95 - 3 * np.sqrt(0.95 * 0.05 / independent), method
        assert mean.mean() / 3 == pytest.approx(1, abs=3 * np.sqrt(2 / (3 * RUNS * independent))), method


def check_innovations(found, correlated=0.0):
    """Mean normalised innovation and its correlation from sample to sample, over all runs and run by run.

    ``correlated`` is what the unequal noise of the axes, which the filter leaves out, may do to the correlation's mean.
    """
    rows = found.turning()
    nis, freedom = found.nis[:, rows].sum(axis=1), found.dof[:, rows].sum(axis=1)
    assert nis.sum() / freedom.sum() == pytest.approx(1, abs=3 * np.sqrt(2 / freedom.sum()))
    least_share = 0.95 - 3 * np.sqrt(0.95 * 0.05 / len(nis))  # of the runs within their 95 % interval
    low, high = chi2.ppf([0.025, 0.975], freedom[:, None]).T
    assert np.mean((nis > low) & (nis < high)) > least_share
    centred = found.nis[:, rows] / found.dof[:, rows] - 1
    one, next_one = centred[:, :-1], centred[:, 1:]
    correlation = np.sum(one * next_one, axis=1) / np.sum(one**2, axis=1)
    std = 1 / np.sqrt(rows.sum())
    assert np.mean(np.abs(correlation) < 1.96 * std) > least_share
    assert abs(correlation.mean()) < correlated + 3 * std / np.sqrt(len(nis))


@pytest.mark.study(but=["turntable-1", "turntable-10", "tumble-1"])
def test_normalised_estimation_error(at_100_hz):
    check_consistency(at_100_hz)


@pytest.mark.study(but=["turntable-1", "turntable-10", "tumble-1"])
def test_innovations_are_white_with_the_stated_covariance(at_100_hz):
    check_innovations(at_100_hz, 0.01)


def test_innovations_of_equal_axes_are_white_at_half_a_radian_per_sample(monkeypatch):
    monkeypatch.setattr(rate_worlds, "NOISE_LSB_100_HZ", np.full(3, 0.9))
    check_innovations(study(cube(), turntable(100.0, 2 * np.pi * 10), RUNS, methods=("filter",)))


def test_trapezoid_fails_where_the_default_holds():
    """8 rev/s tumble at 100 Hz: why the quadrature is of sixth order."""
    motion = tumble(100.0, 2 * np.pi * 8, duration=10.0)
    values = measure(cube(), motion, np.random.default_rng(0))
    rows = motion.t > 6
    error = {}
    for name in ("centred6", "adams_moulton4", "trapezoid"):
        found = filter_rate(cube(), motion.t, values, sensor_errors(cube(), 100.0), FilterSettings(quadrature=name))
        error[name] = rms((found.omega - motion.omega)[rows])
    assert error["trapezoid"] > 2 * error["centred6"]
    assert error["trapezoid"] > error["adams_moulton4"] > 0.99 * error["centred6"]


@pytest.mark.parametrize(("motion", "speed", "runs"), [(turntable, 10, 6), (tumble, 8, 6)])
def test_ratio_at_800_hz(motion, speed, runs):
    found = study(cube(), motion(800.0, 2 * np.pi * speed, duration=8.0), runs)
    rows = found.turning()
    for method in ("filter", "smoother"):
        # Standard error of the ratio: samples within 1/|ω| of each other are not independent.
        independent = 3 * runs * rows.sum() / 800.0 * 2 * np.pi * speed / 2
        assert found.ratio(method, rows) == pytest.approx(1.02, abs=0.02 + 3 / np.sqrt(2 * independent)), method


def test_at_rest_between_two_bounds():
    """A body that stands is at rest exactly; the filter takes it to be so to within 5 mrad/s at the end of each block.

    Its error therefore lies above the bound of an exactly known rest and below the one with that uncertainty, which is
    no bound here, but for the 3 % that it loses by leaving out that the noises of α and the null space are correlated.
    Medians over the runs, because a block in doubt (0.4 %) is not used.
    """
    motion = turntable(100.0, 0.0, duration=10.0)
    found = study(cube(), motion, 40)
    rows = motion.t > 0.6
    for method in ("filter", "smoother"):
        exact = posterior_rate_bound(
            cube(), motion.t, motion.omega, sensor_errors(cube(), 100.0), rest=first_rest(motion), rest_std=1e-6,
            smoother=method == "smoother",
        )  # fmt: skip
        error = np.median([rms(run[rows]) for run in found.error[method]])
        low = rms(np.sqrt(np.diagonal(exact, axis1=1, axis2=2))[rows])
        assert 0.97 * low < error < 1.03 * rms(found.bound[method][rows]), method


@pytest.mark.study
def test_ratio_at_rest_at_800_hz():
    check(study(cube(), turntable(800.0, 0.0), RUNS, seed=6044))


@pytest.mark.study
@pytest.mark.parametrize(("motion", "speed"), SCENARIOS)
def test_ratio_at_800_hz_in_full(motion, speed):
    found = study(cube(), motion(800.0, 2 * np.pi * speed), RUNS)
    check(found)
    check_consistency(found)
    check_innovations(found, 0.01)
